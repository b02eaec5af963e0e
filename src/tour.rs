//! The tour: every built-in scene with every technique as pictures, for machines without a display.

use crate::capture::{self, write_png};
use crate::cli::progress_bar;
use crate::files;
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::scene::builtin;
use crate::setup::Setup;
use crate::techniques;
use ab_glyph::{Font, FontRef, PxScale, ScaleFont};
use anyhow::{Context, Result};
use std::path::Path;
use std::sync::Arc;

const SIZE: [u32; 2] = [640, 360];
const GAP: u32 = 12;
const CAPTION: u32 = 26;

/// Writes `SCENE-TECHNIQUE.png` for all of them, and `contact-sheet.png`, into a folder.
pub fn write(folder: &Path, adapter: Option<&str>) -> Result<()> {
    let sheet_path = folder.join("contact-sheet.png");
    if let Some(note) = files::check_target(&sheet_path)? {
        eprintln!("{note}");
    }
    let gpu = Arc::new(Gpu::new(adapter)?);
    let columns = techniques::ALL.len() as u32;
    let rows = builtin::NAMES.len() as u32;
    let sheet_size = [columns * (SIZE[0] / 2 + GAP) + GAP, rows * (SIZE[1] / 2 + GAP + CAPTION) + GAP];
    let mut sheet = image::RgbaImage::from_pixel(sheet_size[0], sheet_size[1], image::Rgba([30, 32, 36, 255]));
    let font =
        FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).context("the built-in font cannot be read")?;
    let bar = progress_bar((columns * rows) as u64);
    for (row, name) in builtin::NAMES.iter().enumerate() {
        let scene = builtin::build(name).with_context(|| format!("there is no scene {name}"))?;
        let mut setup = Setup::new(name, &scene)?;
        setup.size = SIZE;
        let mut renderer = Renderer::new(gpu.clone(), Arc::new(scene))?;
        for (column, info) in techniques::ALL.iter().enumerate() {
            bar.set_message(format!("{name}, {}", info.id));
            setup.select(info.id)?;
            if info.refuses(&setup.light).is_none() {
                capture::capture(&mut renderer, &setup, &folder.join(format!("{name}-{}.png", info.id)))?;
                let picture = image::RgbaImage::from_raw(SIZE[0], SIZE[1], renderer.read_picture()?)
                    .context("the picture's size does not match")?;
                let small = image::imageops::thumbnail(&picture, SIZE[0] / 2, SIZE[1] / 2);
                let x = GAP + column as u32 * (SIZE[0] / 2 + GAP);
                let y = GAP + row as u32 * (SIZE[1] / 2 + GAP + CAPTION);
                image::imageops::replace(&mut sheet, &small, x as i64, y as i64);
                write_text(&mut sheet, &font, [x, y + SIZE[1] / 2 + 4], &format!("{name}: {}", info.id));
            }
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    write_png(&sheet_path, sheet_size, sheet.as_raw(), None)?;
    eprintln!("wrote {} and a picture for each scene and technique beside it", sheet_path.display());
    Ok(())
}

fn write_text(sheet: &mut image::RgbaImage, font: &FontRef, at: [u32; 2], text: &str) {
    let font = font.as_scaled(PxScale::from(18.0));
    let mut x = at[0] as f32;
    let base = at[1] as f32 + font.ascent();
    for c in text.chars() {
        let glyph = font.glyph_id(c).with_scale_and_position(PxScale::from(18.0), ab_glyph::point(x, base));
        x += font.h_advance(font.glyph_id(c));
        if let Some(outline) = font.font().outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            outline.draw(|dx, dy, cover| {
                let (px, py) = (corner.x as i64 + dx as i64, corner.y as i64 + dy as i64);
                if let (Ok(px), Ok(py)) = (u32::try_from(px), u32::try_from(py))
                    && let Some(pixel) = sheet.get_pixel_mut_checked(px, py)
                {
                    let mix = |a: u8| (a as f32 + (235.0 - a as f32) * cover) as u8;
                    *pixel = image::Rgba([mix(pixel[0]), mix(pixel[1]), mix(pixel[2]), 255]);
                }
            });
        }
    }
}
