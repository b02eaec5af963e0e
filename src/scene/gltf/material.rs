//! Materials and their base colour textures. Only what the drawn triangles use is loaded.

use super::accessors::Accessors;
use super::{broken, get, name_of, uri};
use crate::scene::textures::{self, MAX_IMAGES};
use crate::scene::{Material, Texture, Wrap};
use ::gltf::json::material::AlphaMode;
use ::gltf::json::texture::WrappingMode;
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
    /// Image and wrap modes, each pair once.
    textures: Vec<(usize, [Wrap; 2])>,
    /// Materials drawn opaque although they blend.
    pub blended: usize,
    /// Textures without an image that can be read.
    pub without_image: usize,
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
            texture = self.texture(info, &owner)?;
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
        let webp = texture.extensions.as_ref().and_then(|extensions| {
            let source = extensions.others.get("EXT_texture_webp")?.get("source")?;
            Some(Index::new(u32::try_from(source.as_u64()?).ok()?))
        });
        let owner = format!("texture {}", info.index);
        let image = match webp {
            Some(image) => image,
            // The crate's way of saying that there is no source.
            None if texture.source.value() == u32::MAX as usize => {
                self.without_image += 1;
                return Ok(None);
            }
            None => texture.source,
        };
        get(&self.root.images, image, "image", &owner)?;
        let mut wrap = [Wrap::Repeat; 2];
        if let Some(sampler) = texture.sampler {
            let sampler = get(&self.root.samplers, sampler, "sampler", &owner)?;
            wrap = [&sampler.wrap_s, &sampler.wrap_t].map(|mode| match mode {
                Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                _ => Wrap::Repeat,
            });
        }
        let key = (image.value(), wrap);
        let known = self.textures.iter().position(|texture| *texture == key);
        let index = known.unwrap_or_else(|| {
            self.textures.push(key);
            self.textures.len() - 1
        });
        Ok(Some(index as u32))
    }

    /// Decodes the textures in use, in parallel. Also says how many were made smaller.
    pub fn textures(&self, accessors: &Accessors, folder: &Path) -> Result<(Vec<Texture>, usize)> {
        let mut images: Vec<usize> = self.textures.iter().map(|texture| texture.0).collect();
        images.sort_unstable();
        images.dedup();
        let held = AtomicU64::new(0);
        let mut decoded: HashMap<usize, (image::RgbaImage, bool)> = images
            .into_par_iter()
            .map(|index| {
                let decoded = decode(self.root, index, accessors, folder)?;
                // Many may be of one and the same small buffer.
                let all = held.fetch_add(decoded.0.len() as u64, Ordering::Relaxed) + decoded.0.len() as u64;
                ensure!(all <= MAX_IMAGES, textures::TOO_LARGE);
                Ok((index, decoded))
            })
            .collect::<Result<_>>()?;
        let reduced = decoded.values().filter(|image| image.1).count();
        let mut textures = Vec::with_capacity(self.textures.len());
        for (i, &(image, wrap)) in self.textures.iter().enumerate() {
            let again = self.textures[i + 1..].iter().any(|later| later.0 == image);
            let decoded = if again { decoded.get(&image).cloned() } else { decoded.remove(&image) };
            let image = decoded.unwrap_or_default().0;
            let (width, height) = image.dimensions();
            textures.push(Texture { width, height, rgba: image.into_raw(), wrap });
        }
        Ok((textures, reduced))
    }
}

/// Decodes an image; `true`: it was larger than is kept, and is reduced.
fn decode(root: &Root, index: usize, accessors: &Accessors, folder: &Path) -> Result<(image::RgbaImage, bool)> {
    let image = &root.images[index];
    let owner = format!("image {index}{}", name_of(image.name.as_deref()));
    let bytes: Cow<[u8]> = match (image.buffer_view, &image.uri) {
        (Some(view), _) => accessors.view(view, &owner)?.into(),
        (None, Some(uri)) => uri::fetch(uri, folder, &owner)?.into(),
        (None, None) => return Err(broken(format!("{owner} has no data"))),
    };
    textures::decode(&bytes, None)
        .map_err(|reason| anyhow!("{owner} cannot be decoded ({reason}); save it again as PNG, JPEG or WebP"))
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
