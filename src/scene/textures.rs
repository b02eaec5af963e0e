//! A scene's textures as two texture arrays, so that raster and rays sample them alike: small images, and large ones.

use super::{Scene, Texture};
use crate::gpu::Gpu;
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

/// Longest side of what counts as small, texels. The layers of an array are all as large as its largest image, so that a few
/// large ones do not make all others large.
const SMALL: u32 = 1024;

/// What an adapter takes.
#[derive(Clone, Copy)]
pub struct Limits {
    /// Longest side of a texture, texels.
    side: u32,
    /// Layers of an array.
    layers: u32,
    /// Bytes of all layers of both arrays, without their mips.
    bytes: u64,
}

impl Limits {
    pub fn of(gpu: &Gpu) -> Limits {
        let limits = gpu.device.limits();
        // An adapter with memory of its own has that for little else.
        let gigabytes = if gpu.info.device_type == wgpu::DeviceType::DiscreteGpu { 4 } else { 1 };
        Limits {
            side: limits.max_texture_dimension_2d,
            layers: limits.max_texture_array_layers,
            bytes: gigabytes << 30,
        }
    }
}

/// Which array and layer each texture goes to, and the arrays' sides.
pub struct Arrays {
    /// Sides of the layers, texels, and how many textures go to each.
    sides: [u32; 2],
    counts: [usize; 2],
    /// Of each texture: its array, and the layer there.
    places: Vec<(usize, u32)>,
    layers: u32,
}

impl Arrays {
    /// Each image keeps its texels where the adapter has room; else the larger array's sides are halved until there is.
    pub fn of(textures: &[Texture], limits: Limits) -> Arrays {
        // Layers are square: what is much longer than wide has no more than sixteen times its texels.
        let square = |t: &Texture| {
            let room = (16.0 * f64::from(t.width) * f64::from(t.height)).sqrt() as u32;
            room.next_power_of_two().max(SMALL)
        };
        let side = |t: &Texture| t.width.max(t.height).next_power_of_two().min(square(t)).min(limits.side);
        let (mut sides, mut counts) = ([1; 2], [0; 2]);
        let place = |t: &Texture| {
            let array = usize::from(side(t) > SMALL);
            sides[array] = side(t).max(sides[array]);
            counts[array] += 1;
            (array, counts[array] as u32 - 1)
        };
        let places = textures.iter().map(place).collect();
        let bytes = |sides: [u32; 2]| (0..2).map(|i| u64::from(sides[i]).pow(2) * 4 * counts[i] as u64).sum::<u64>();
        while bytes(sides) > limits.bytes {
            let larger = usize::from(bytes([sides[0], 0]) <= bytes([0, sides[1]]));
            sides[larger] /= 2;
        }
        Arrays { sides, counts, places, layers: limits.layers }
    }

    /// A texture as materials name it: 1 and more; the lowest bit of what lies over 65536 says that it is a large one.
    pub fn number(&self, texture: usize) -> u32 {
        let (array, layer) = self.places[texture];
        (layer + 1) | (array as u32) << 16
    }

    /// How many texels of a texture are left, each way: those of its image, or all that fit.
    pub fn kept(&self, textures: &[Texture], texture: usize) -> [u32; 2] {
        let (side, t) = (self.sides[self.places[texture].0], &textures[texture]);
        [t.width, t.height].map(|n| n.clamp(1, side))
    }

    /// How many textures have fewer texels than their images, and at most how many a side; None: none has.
    pub fn reduced(&self, textures: &[Texture]) -> Option<(usize, u32)> {
        let smaller = |i: &usize| self.kept(textures, *i) != [textures[*i].width, textures[*i].height];
        let reduced: Vec<usize> = (0..textures.len()).filter(smaller).collect();
        let largest = reduced.iter().map(|i| self.sides[self.places[*i].0]).max()?;
        Some((reduced.len(), largest))
    }

    /// Scales every texture to its array's size, makes its mip chain (averaged in linear light) and uploads it.
    ///
    /// # Errors
    /// More textures than the adapter has layers.
    pub fn upload(&self, gpu: &Gpu, scene: &Scene) -> Result<[wgpu::TextureView; 2]> {
        let (most, limit) = (self.counts.into_iter().max().unwrap_or(0), self.layers);
        ensure!(
            most <= limit as usize,
            "{} has {most} textures of a kind, and {} takes {limit}",
            scene.name,
            gpu.info.name
        );
        let array = |i: usize| {
            let (side, layers) = (self.sides[i], self.counts[i].max(1) as u32);
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("textures"),
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
                mip_level_count: side.ilog2() + 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8UnormSrgb,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        let arrays = [array(0), array(1)];
        let all: Vec<_> = scene.textures.iter().zip(&self.places).collect();
        // A few at a time: all chains together can take more memory than the scene.
        for some in all.chunks(rayon::current_num_threads().max(1)) {
            let chain = |(t, place): &(&Texture, &(usize, u32))| chain(t, self.sides[place.0]);
            let chains: Vec<_> = some
                .par_iter()
                .map(chain)
                .collect::<Option<_>>()
                .with_context(|| format!("{}: a texture's size does not match its data", scene.name))?;
            for ((_, (array, layer)), chain) in some.iter().zip(chains) {
                for (level, texels) in chain.iter().enumerate() {
                    let side = self.sides[*array] >> level;
                    gpu.queue.write_texture(
                        wgpu::TexelCopyTextureInfo {
                            texture: &arrays[*array],
                            mip_level: level as u32,
                            origin: wgpu::Origin3d { x: 0, y: 0, z: *layer },
                            aspect: wgpu::TextureAspect::All,
                        },
                        texels,
                        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(side * 4), rows_per_image: None },
                        wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                    );
                }
            }
            // So that what was copied on the way there is free again.
            gpu.queue.submit([]);
        }
        Ok(arrays.map(|array| {
            array.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        }))
    }
}

/// A texture's mip levels in a layer of `side` texels; None if its size does not match its data.
fn chain(t: &Texture, side: u32) -> Option<Vec<Vec<u8>>> {
    let image: image::ImageBuffer<image::Rgba<u8>, &[u8]> =
        image::ImageBuffer::from_raw(t.width, t.height, &t.rgba[..])?;
    let first = if (t.width, t.height) == (side, side) {
        t.rgba.clone()
    } else {
        let filter = match t.filter.magnified_nearest && t.width.max(t.height) <= side {
            true => image::imageops::FilterType::Nearest,
            false => image::imageops::FilterType::Triangle,
        };
        image::imageops::resize(&image, side, side, filter).into_raw()
    };
    let mut chain = vec![first];
    for level in 0..side.ilog2() {
        chain.push(halve(&chain[level as usize], side >> level));
    }
    Some(chain)
}

/// The next smaller mip level: the mean of 2 × 2 texels, colours in linear light.
fn halve(texels: &[u8], side: u32) -> Vec<u8> {
    let linear: [f32; 256] = std::array::from_fn(|i| {
        let c = i as f32 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    });
    let encode = |c: f32| {
        let c = if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (c * 255.0).round() as u8
    };
    let half = side / 2;
    let mut out = Vec::with_capacity((half * half * 4) as usize);
    for y in 0..half {
        for x in 0..half {
            let at = |dx: u32, dy: u32, c: usize| texels[((2 * y + dy) * side + 2 * x + dx) as usize * 4 + c] as usize;
            for c in 0..4 {
                let four = [at(0, 0, c), at(1, 0, c), at(0, 1, c), at(1, 1, c)];
                out.push(if c < 3 {
                    encode(four.map(|v| linear[v]).iter().sum::<f32>() / 4.0)
                } else {
                    ((four.iter().sum::<usize>() + 2) / 4) as u8
                });
            }
        }
    }
    out
}

/// Longest side of an image that is kept, texels.
pub const MAX_IMAGE: u32 = 8192;

/// Bytes that all images of a scene may have together.
pub const MAX_IMAGES: u64 = 8 << 30;
/// What is said where they have more.
pub const TOO_LARGE: &str = "its images take more than 8 GiB; scale them down";

/// Decodes an image; `true`: it was larger than [`MAX_IMAGE`] and is reduced to it. `hint`: its format where its contents
/// do not tell, as those of TGA do not.
///
/// # Errors
/// Why it cannot be decoded.
pub fn decode(bytes: &[u8], hint: Option<image::ImageFormat>) -> Result<(image::RgbaImage, bool), String> {
    let format = image::guess_format(bytes).ok().or(hint).ok_or("unknown format")?;
    let reader = image::ImageReader::with_format(std::io::Cursor::new(bytes), format);
    let decoded = reader.decode().map_err(|error| error.to_string())?;
    if decoded.width().max(decoded.height()) > MAX_IMAGE {
        return Ok((decoded.thumbnail(MAX_IMAGE, MAX_IMAGE).into_rgba8(), true));
    }
    Ok((decoded.into_rgba8(), false))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { side: 8192, layers: 256, bytes: 1 << 30 };

    fn textures(sides: &[[u32; 2]]) -> Vec<Texture> {
        sides.iter().map(|[width, height]| Texture { width: *width, height: *height, ..Texture::default() }).collect()
    }

    #[test]
    fn small_images_stay_small_beside_large_ones() {
        let images = textures(&[[64, 64], [2048, 100], [1024, 512], [4096, 4096]]);
        let arrays = Arrays::of(&images, LIMITS);
        assert_eq!((arrays.sides, arrays.counts), ([1024, 4096], [2, 2]));
        // As WGSL reads them: the layer from 1 on, and whether it is one of the large ones.
        assert_eq!([0, 1, 2, 3].map(|i| arrays.number(i)), [1, 65537, 2, 65538]);
        assert_eq!(arrays.reduced(&images), None);
        assert_eq!(Arrays::of(&[], LIMITS).sides, [1, 1]);
    }

    #[test]
    fn what_has_no_room_is_halved() {
        // 40 of 64 MiB, and 80 of 4 MiB.
        let images = textures(&[vec![[4096, 4096]; 40], vec![[1024, 1024]; 80]].concat());
        let arrays = Arrays::of(&images, LIMITS);
        assert_eq!(arrays.sides, [1024, 2048]);
        assert_eq!(arrays.reduced(&images), Some((40, 2048)));
        assert_eq!(arrays.kept(&images, 0), [2048; 2]);
        // Of thin ones a square of their longer side would be nearly empty.
        let arrays = Arrays::of(&textures(&[[65500, 1], [8192, 64]]), LIMITS);
        assert_eq!(arrays.sides, [1024, 4096]);
        // The adapter's own limit.
        assert_eq!(Arrays::of(&textures(&[[16384, 16384]]), LIMITS).sides, [1, 8192]);
    }
}
