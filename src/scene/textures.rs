//! A scene's textures as one texture array, so that raster and rays sample them alike.

use super::{Scene, Texture};
use crate::gpu::Gpu;
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

/// Longest side of a layer, texels; larger images are scaled down.
pub const MAX_SIDE: u32 = 1024;
/// All layers together take no more than this, bytes.
const BUDGET: u64 = 1 << 30;

/// Scales every texture to one size, makes its mip chain (averaged in linear light) and uploads it.
///
/// # Errors
/// More textures than the adapter has layers.
pub fn upload(gpu: &Gpu, scene: &Scene) -> Result<wgpu::TextureView> {
    let layers = scene.textures.len().max(1) as u32;
    let limit = gpu.device.limits().max_texture_array_layers;
    ensure!(layers <= limit, "{} has {layers} textures, and {} takes {limit}", scene.name, gpu.info.name);
    let longest = scene.textures.iter().map(|t| t.width.max(t.height)).max().unwrap_or(1);
    let mut side = longest.next_power_of_two().min(MAX_SIDE);
    while side as u64 * side as u64 * 4 * layers as u64 > BUDGET {
        side /= 2;
    }
    let mips = side.ilog2() + 1;
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("textures"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
        mip_level_count: mips,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let chains: Vec<Vec<Vec<u8>>> = scene
        .textures
        .par_iter()
        .map(|t| {
            let image = image::RgbaImage::from_raw(t.width, t.height, t.rgba.clone())
                .with_context(|| format!("{}: a texture's size does not match its data", scene.name))?;
            let image = if (t.width, t.height) == (side, side) {
                image
            } else {
                let filter = match t.filter.magnified_nearest && t.width.max(t.height) <= side {
                    true => image::imageops::FilterType::Nearest,
                    false => image::imageops::FilterType::Triangle,
                };
                image::imageops::resize(&image, side, side, filter)
            };
            let mut chain = vec![image.into_raw()];
            for level in 1..mips {
                chain.push(halve(&chain[level as usize - 1], side >> (level - 1)));
            }
            Ok(chain)
        })
        .collect::<Result<_>>()?;
    for (layer, chain) in chains.iter().enumerate() {
        for (level, texels) in chain.iter().enumerate() {
            let side = side >> level;
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level: level as u32,
                    origin: wgpu::Origin3d { x: 0, y: 0, z: layer as u32 },
                    aspect: wgpu::TextureAspect::All,
                },
                texels,
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(side * 4), rows_per_image: None },
                wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            );
        }
    }
    Ok(texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    }))
}

/// How many texels of a texture are left, each way, in layers of `side` texels: those of its image, or all that fit.
pub fn kept(texture: &Texture, side: u32) -> [u32; 2] {
    [texture.width, texture.height].map(|n| n.clamp(1, side))
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
