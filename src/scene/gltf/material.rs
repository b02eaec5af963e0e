//! Materials and their base colour textures. Only what the drawn triangles use is loaded.

use super::accessors::Accessors;
use super::{broken, get, name_of, uri};
use crate::scene::textures::{self, MAX_IMAGE, MAX_IMAGES};
use crate::scene::{Filter, Material, Minified, Texture, Wrap};
use ::gltf::json::material::AlphaMode;
use ::gltf::json::texture::{MagFilter, MinFilter, Sampler, WrappingMode};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root, texture};
use anyhow::{Result, anyhow, ensure};
use glam::{Affine2, Vec2, Vec4};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// How the triangles of a material find their texture coordinates.
#[derive(Clone, Copy)]
pub struct TexCoords {
    /// The `n` of the attribute `TEXCOORD_n`.
    pub set: u32,
    pub transform: Affine2,
}

/// The materials met so far.
pub struct Materials<'a> {
    root: &'a Root,
    pub list: Vec<Material>,
    tex_coords: Vec<Option<TexCoords>>,
    /// By the file's index, `None` for the default material.
    known: HashMap<Option<usize>, u32>,
    /// Image and how it is sampled, each pair once.
    textures: Vec<(usize, [Wrap; 2], Filter)>,
    /// Materials drawn opaque although they blend.
    pub blended: usize,
    /// Textures without an image that can be read.
    pub without_image: usize,
    /// Images that materials are drawn without, a note each.
    pub missing: Vec<String>,
}

impl<'a> Materials<'a> {
    pub fn new(root: &'a Root) -> Self {
        Self {
            root,
            list: Vec::new(),
            tex_coords: Vec::new(),
            known: HashMap::new(),
            textures: Vec::new(),
            blended: 0,
            without_image: 0,
            missing: Vec::new(),
        }
    }

    /// The scene's index of a material and, if it has a texture, where its coordinates come from.
    pub fn index(
        &mut self,
        material: Option<Index<::gltf::json::Material>>,
        owner: &str,
    ) -> Result<(u32, Option<TexCoords>)> {
        let key = material.map(|index| index.value());
        if let Some(&known) = self.known.get(&key) {
            return Ok((known, self.tex_coords[known as usize]));
        }
        let (material, tex_coords) = match material {
            Some(index) => {
                let material = get(&self.root.materials, index, "material", owner)?;
                self.convert(material, index.value())?
            }
            None => (
                Material {
                    name: "default".into(),
                    base_color: Vec4::ONE,
                    texture: None,
                    alpha_cutoff: None,
                    double_sided: false,
                },
                None,
            ),
        };
        let index = self.list.len() as u32;
        self.list.push(material);
        self.tex_coords.push(tex_coords);
        self.known.insert(key, index);
        Ok((index, tex_coords))
    }

    fn convert(&mut self, material: &::gltf::json::Material, index: usize) -> Result<(Material, Option<TexCoords>)> {
        let pbr = &material.pbr_metallic_roughness;
        let extensions = material.extensions.as_ref();
        let (factor, info) = match extensions.and_then(|e| e.pbr_specular_glossiness.as_ref()) {
            Some(old) => (old.diffuse_factor.0, old.diffuse_texture.as_ref()),
            None => (pbr.base_color_factor.0, pbr.base_color_texture.as_ref()),
        };
        let owner = format!("material {index}{}", name_of(material.name.as_deref()));
        let base_color = Vec4::from(factor);
        if !base_color.is_finite() {
            return Err(broken(format!("the base colour of {owner} is not finite")));
        }
        let mut tex_coords = None;
        let mut texture = None;
        if let Some(info) = info {
            // A picture without its texture says more than none.
            texture = self.texture(info, &owner).unwrap_or_else(|reason| {
                self.missing.push(drawn_without(&reason));
                None
            });
            tex_coords = texture.map(|_| coordinates(info));
        }
        let mut alpha_cutoff = None;
        match material.alpha_mode {
            Checked::Valid(AlphaMode::Mask) => {
                alpha_cutoff = Some(material.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0));
            }
            Checked::Valid(AlphaMode::Blend) => self.blended += 1,
            _ => {}
        }
        let material = Material {
            name: material.name.clone().unwrap_or_else(|| format!("material {index}")),
            base_color,
            texture,
            alpha_cutoff,
            double_sided: material.double_sided,
        };
        Ok((material, tex_coords))
    }

    /// The scene's index of the texture that `info` names; `None` if it has no image we can read.
    fn texture(&mut self, info: &texture::Info, owner: &str) -> Result<Option<u32>> {
        let texture = get(&self.root.textures, info.index, "texture", owner)?;
        let other = texture.extensions.as_ref().and_then(|extensions| {
            let named = |name: &str| extensions.others.get(name)?.get("source")?.as_u64();
            let source = named("KHR_texture_basisu").or_else(|| named("EXT_texture_webp"))?;
            Some(Index::new(u32::try_from(source).ok()?))
        });
        let owner = format!("texture {}", info.index);
        let image = match other {
            Some(image) => image,
            // The crate's way of saying that there is no source.
            None if texture.source.value() == u32::MAX as usize => {
                self.without_image += 1;
                return Ok(None);
            }
            None => texture.source,
        };
        get(&self.root.images, image, "image", &owner)?;
        let sampler = texture.sampler.map(|index| get(&self.root.samplers, index, "sampler", &owner)).transpose()?;
        let wrap = sampler.map_or([Wrap::Repeat; 2], |sampler| {
            [&sampler.wrap_s, &sampler.wrap_t].map(|mode| match mode {
                Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                _ => Wrap::Repeat,
            })
        });
        let key = (image.value(), wrap, sampler.map_or(Filter::default(), filter));
        let known = self.textures.iter().position(|texture| *texture == key);
        let index = known.unwrap_or_else(|| {
            self.textures.push(key);
            self.textures.len() - 1
        });
        Ok(Some(index as u32))
    }

    /// Decodes the textures in use, in parallel; materials lose those that cannot be. Also says how many were made smaller.
    pub fn textures(&mut self, accessors: &Accessors, folder: &Path) -> (Vec<Texture>, usize) {
        let mut images: Vec<usize> = self.textures.iter().map(|texture| texture.0).collect();
        images.sort_unstable();
        images.dedup();
        let root = self.root;
        // Many may be of one and the same small buffer.
        let held = AtomicU64::new(0);
        let bounded = |index: usize| {
            ensure!(held.load(Ordering::Relaxed) <= MAX_IMAGES, "image {index}: {}", textures::TOO_LARGE);
            let decoded = decode(root, index, accessors, folder)?;
            held.fetch_add(decoded.0.len() as u64, Ordering::Relaxed);
            Ok(decoded)
        };
        let results: Vec<_> = images.into_par_iter().map(|index| (index, bounded(index))).collect();
        let mut decoded = HashMap::new();
        for (index, result) in results {
            match result {
                Ok(image) => drop(decoded.insert(index, image)),
                Err(reason) => self.missing.push(drawn_without(&reason)),
            }
        }
        let reduced = decoded.values().filter(|image| image.1).count();
        let mut textures = Vec::with_capacity(self.textures.len());
        let mut copies = held.into_inner();
        // Where each of `self.textures` is now.
        let mut places = Vec::with_capacity(self.textures.len());
        for (i, &(image, wrap, filter)) in self.textures.iter().enumerate() {
            let again = self.textures[i + 1..].iter().any(|later| later.0 == image);
            // A copy for each way to sample it.
            let copied = decoded.get(&image).filter(|_| again).map_or(0, |image| image.0.len() as u64);
            copies += copied;
            if copies > MAX_IMAGES {
                copies -= copied;
                self.missing.push(drawn_without(&anyhow!("image {image}: {}", textures::TOO_LARGE)));
                places.push(None);
                continue;
            }
            let decoded = if again { decoded.get(&image).cloned() } else { decoded.remove(&image) };
            places.push(decoded.map(|(image, _)| {
                let (width, height) = image.dimensions();
                textures.push(Texture { width, height, rgba: image.into_raw(), wrap, filter });
                textures.len() as u32 - 1
            }));
        }
        for material in &mut self.list {
            material.texture = material.texture.and_then(|texture| places[texture as usize]);
        }
        (textures, reduced)
    }
}

/// Decodes an image; `true`: it was larger than [`MAX_IMAGE`] and is reduced to it.
fn decode(root: &Root, index: usize, accessors: &Accessors, folder: &Path) -> Result<(image::RgbaImage, bool)> {
    let image = &root.images[index];
    let owner = format!("image {index}{}", name_of(image.name.as_deref()));
    let bytes: Cow<[u8]> = match (image.buffer_view, &image.uri) {
        (Some(view), _) => accessors.view(view, &owner)?.into(),
        (None, Some(uri)) => uri::fetch(uri, folder, &owner)?.into(),
        (None, None) => return Err(broken(format!("{owner} has no data"))),
    };
    let bad =
        |reason: String| anyhow!("{owner} cannot be decoded ({reason}); save it again as PNG, JPEG, WebP or KTX2");
    if bytes.starts_with(b"\xABKTX 20\xBB") {
        return basis(&bytes).map_err(|reason| bad(reason.to_string()));
    }
    textures::decode(&bytes, None).map_err(bad)
}

/// Decodes a KTX2 file of Basis Universal data, ETC1S or UASTC: its largest image of up to [`MAX_IMAGE`]; `true`: it is not the
/// first.
fn basis(bytes: &[u8]) -> Result<(image::RgbaImage, bool)> {
    let failed = |error: basisu::Error| match error {
        basisu::Error::Unsupported { .. } | basisu::Error::UnsupportedFeature(_) => anyhow!("a kind of KTX2 not read"),
        _ => anyhow!("damaged KTX2 data, or none of Basis Universal"),
    };
    check_levels(bytes)?;
    let texture = basisu::Transcoder::new(bytes).map_err(failed)?;
    for level in 0..texture.level_count().max(1) {
        let size = texture.image_level_info(level).map_err(failed)?;
        if size.width.max(size.height) > MAX_IMAGE {
            continue;
        }
        let texels =
            texture.transcode(level, basisu::TargetFormat::Rgba32, basisu::DecodeFlags::NONE).map_err(failed)?;
        let image = image::RgbaImage::from_raw(size.width, size.height, texels);
        return Ok((image.ok_or_else(|| anyhow!("damaged KTX2 data"))?, level > 0));
    }
    Err(anyhow!("more than {MAX_IMAGE} texels a side"))
}

/// Refuses a KTX2 file that is no flat image, or whose levels claim more bytes than they have texels (KTX 2.0, sections 3
/// and 4): the decoder reserves what is claimed.
fn check_levels(bytes: &[u8]) -> Result<()> {
    let damaged = || anyhow!("damaged KTX2 data");
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let long = |at: usize| Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let header = |at: usize| word(at).ok_or_else(damaged);
    let (size, levels) = ([header(20)?, header(24)?], header(40)?.clamp(1, 32));
    if size.into_iter().max() > Some(2 * MAX_IMAGE) {
        return Err(anyhow!("more than {} texels a side", 2 * MAX_IMAGE));
    }
    if header(28)? > 0 || header(32)? > 1 || header(36)? != 1 {
        return Err(anyhow!("a KTX2 file of more than one flat image"));
    }
    for level in 0..levels {
        let entry = 80 + 24 * level as usize;
        let (stored, unpacked) = (long(entry + 8).ok_or_else(damaged)?, long(entry + 16).ok_or_else(damaged)?);
        // Blocks of 4 × 4 texels take 16 bytes.
        let [x, y] = size.map(|side| u64::from((side >> level).max(1)).div_ceil(4));
        if stored > bytes.len() as u64 || unpacked > x * y * 16 {
            return Err(damaged());
        }
    }
    Ok(())
}

fn drawn_without(reason: &anyhow::Error) -> String {
    format!("A material is drawn without its texture: {reason:#}.").replace(['\n', '\r'], " ")
}

fn filter(sampler: &Sampler) -> Filter {
    let minified = match sampler.min_filter {
        Some(Checked::Valid(MinFilter::Nearest)) => Minified::Nearest,
        Some(Checked::Valid(MinFilter::NearestMipmapNearest)) => Minified::NearestLevel,
        Some(Checked::Valid(MinFilter::NearestMipmapLinear)) => Minified::MixedLevels,
        _ => Minified::Mean,
    };
    Filter { magnified_nearest: matches!(sampler.mag_filter, Some(Checked::Valid(MagFilter::Nearest))), minified }
}

fn coordinates(info: &texture::Info) -> TexCoords {
    let extensions = info.extensions.as_ref();
    let Some(transform) = extensions.and_then(|e| e.texture_transform.as_ref()) else {
        return TexCoords { set: info.tex_coord, transform: Affine2::IDENTITY };
    };
    TexCoords {
        set: transform.tex_coord.unwrap_or(info.tex_coord),
        // The angle is counter-clockwise to the eye, and v points down.
        transform: Affine2::from_scale_angle_translation(
            Vec2::from(transform.scale.0),
            -transform.rotation.0,
            Vec2::from(transform.offset.0),
        ),
    }
}
