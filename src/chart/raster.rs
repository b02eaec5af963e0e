//! Charts as pixels.

use anyhow::{Context, Result, ensure};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};
use std::sync::Arc;

/// Widest picture, pixels.
const WIDEST: u32 = 16384;

/// Draws an SVG as PNG of a width in pixels. All text is set in the built-in font, so that the same chart gives the same
/// picture everywhere.
///
/// # Errors
/// A width that is not allowed, or text that is no SVG.
pub fn png(svg: &str, pixels_wide: u32) -> Result<Vec<u8>> {
    ensure!(
        (1..=WIDEST).contains(&pixels_wide),
        "a width of {pixels_wide} is not allowed; it takes 1 to {WIDEST} pixels"
    );
    let tree = parsed(svg)?;
    let drawn = drawn(&tree, pixels_wide as f32 / tree.size().width())?;
    drawn.encode_png().context("the chart cannot be written as PNG")
}

/// Draws an SVG at its own size: four bytes a pixel, colours multiplied by alpha.
///
/// # Errors
/// Text that is no SVG.
pub fn pixels(svg: &str) -> Result<Vec<u8>> {
    Ok(drawn(&parsed(svg)?, 1.0)?.take())
}

/// Lays [`pixels`] over a picture of the same size, four bytes a pixel, whose colours are multiplied by their alpha too.
pub fn lay_over(picture: &mut [u8], over: &[u8]) {
    for (p, o) in picture.chunks_exact_mut(4).zip(over.chunks_exact(4)) {
        let under = 255 - u32::from(o[3]);
        (0..4).for_each(|i| p[i] = (u32::from(o[i]) + (u32::from(p[i]) * under + 127) / 255).min(255) as u8);
    }
}

fn parsed(svg: &str) -> Result<Tree> {
    let mut fonts = fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let family = fonts.faces().next().and_then(|f| f.families.first()).map(|f| f.0.clone());
    let family = family.context("the built-in font cannot be read")?;
    fonts.set_sans_serif_family(&family);
    let options = Options { font_family: family, fontdb: Arc::new(fonts), ..Options::default() };
    Tree::from_str(svg, &options).context("the chart is not SVG that can be drawn")
}

fn drawn(tree: &Tree, scale: f32) -> Result<Pixmap> {
    let [width, height] = [tree.size().width(), tree.size().height()].map(|s| (s * scale).round().max(1.0) as u32);
    let mut pixels = Pixmap::new(width, height).context("the chart is too high to be drawn at this width")?;
    resvg::render(tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    Ok(pixels)
}
