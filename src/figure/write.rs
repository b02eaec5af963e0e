//! Files of a sheet.

use super::compose::{Item, Sheet};
use super::layout::{Area, nearest};
use super::{KEYWORD, pdf, tex};
use crate::capture;
use crate::chart::{self, escape};
use crate::files;
use crate::frame::Pixels;
use crate::legend::Anchor;
use anyhow::{Context, Result, ensure};
use base64::Engine;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    Png,
    Svg,
    Pdf,
    Tex,
}

impl Format {
    pub const ALL: [Format; 4] = [Format::Png, Format::Svg, Format::Pdf, Format::Tex];

    /// A file's ending.
    pub fn ending(self) -> &'static str {
        match self {
            Format::Png => "png",
            Format::Svg => "svg",
            Format::Pdf => "pdf",
            Format::Tex => "tex",
        }
    }
}

/// The sheet's files in a folder.
fn paths(folder: &Path, name: &str, formats: &[Format]) -> Vec<PathBuf> {
    formats.iter().map(|format| folder.join(format!("{name}.{}", format.ending()))).collect()
}

/// Writes a sheet into a folder in these formats, and where its spec asks for it each cell as a capture. Returns the files.
///
/// # Errors
/// A file that cannot be written; what was there before stays whole.
pub fn write(sheet: &Sheet, folder: &Path, name: &str, formats: &[Format]) -> Result<Vec<PathBuf>> {
    ensure!(!formats.is_empty(), "no format is chosen; there are png, svg, pdf and tex");
    let mut out = Vec::new();
    for (format, path) in formats.iter().zip(paths(folder, name, formats)) {
        let bytes = match format {
            Format::Png => png(sheet, &path)?,
            Format::Svg => svg(sheet, &path)?.into_bytes(),
            Format::Pdf => pdf::pdf(sheet, name)?,
            Format::Tex => tex::tex(sheet, name, formats).into_bytes(),
        };
        files::save(&path, &bytes)?;
        out.push(path);
    }
    if sheet.spec.cells {
        let mut names: Vec<String> = Vec::new();
        for cell in sheet.cells.iter().filter(|cell| cell.refused.is_none()) {
            let whole = cell.stems.iter().map(|stem| plain(stem)).filter(|label| !label.is_empty());
            let mut stem = whole.collect::<Vec<_>>().join("-");
            if stem.is_empty() || stem == name {
                stem = format!("{name}-cell");
            }
            let mut unique = stem.clone();
            let mut number = 2;
            while names.contains(&unique) {
                unique = format!("{stem}-{number}");
                number += 1;
            }
            let path = folder.join(format!("{unique}.png"));
            capture::write_png(&path, cell.picture.size, &cell.picture.rgba, Some(&cell.setup.to_toml(&path)?))?;
            names.push(unique);
            out.push(path);
        }
    }
    Ok(out)
}

/// A label as a part of a file's name.
fn plain(label: &str) -> String {
    let mut out = String::new();
    for c in label.to_lowercase().chars() {
        match c {
            c if c.is_alphanumeric() => out.push(c),
            _ if !out.is_empty() && !out.ends_with('-') => out.push('-'),
            _ => {}
        }
    }
    out.truncate(out.char_indices().nth(60).map_or(out.len(), |(i, _)| i));
    out.trim_end_matches('-').into()
}

/// A picture of a page that others enlarge: texels as they are where they are not, else each as a block so large that no mixing at its edges is
/// seen.
pub(super) fn placed(picture: &Pixels, texels: Area, at: Area) -> Pixels {
    let [.., w, h] = texels;
    if [w, h] == [at[2], at[3]] {
        return enlarged(picture, texels, [w, h]);
    }
    let times = 2 * at[2].div_ceil(w).max(1);
    enlarged(picture, texels, [w * times, h * times])
}

/// Part of a picture, enlarged to the nearest texel.
fn enlarged(picture: &Pixels, [x, y, w, h]: Area, [across, down]: [u32; 2]) -> Pixels {
    let texels: &[[u8; 4]] = bytemuck::cast_slice(&picture.rgba);
    let columns: Vec<usize> = nearest(x, w, across).map(|x| x as usize).collect();
    let mut rgba = Vec::with_capacity(4 * across as usize * down as usize);
    for y in nearest(y, h, down) {
        let row = &texels[y as usize * picture.size[0] as usize..][..picture.size[0] as usize];
        columns.iter().for_each(|x| rgba.extend(row[*x]));
    }
    Pixels { size: [across, down], rgba }
}

/// The sheet in memory: on white paper, four bytes a pixel.
pub fn pixels(sheet: &Sheet) -> Result<Pixels> {
    let [width, height] = sheet.size;
    let mut rgba = vec![255; 4 * width as usize * height as usize];
    for item in &sheet.items {
        let Item::Picture { at: [x, y, w, h], cell, texels } = item else { continue };
        let part = enlarged(&sheet.cells[*cell].picture, *texels, [*w, *h]);
        for (row, line) in part.rgba.chunks_exact(4 * *w as usize).enumerate() {
            let start = 4 * ((*y as usize + row) * width as usize + *x as usize);
            for (to, from) in rgba[start..][..line.len()].chunks_exact_mut(4).zip(line.chunks_exact(4)) {
                let alpha = u32::from(from[3]);
                (0..3).for_each(|i| to[i] = ((u32::from(from[i]) * alpha + 255 * (255 - alpha) + 127) / 255) as u8);
            }
        }
    }
    // Text and lines lie over all pictures.
    let over = chart::pixels(&drawing(sheet, false)?).context("the sheet's text cannot be drawn")?;
    chart::lay_over(&mut rgba, &over);
    Ok(Pixels { size: sheet.size, rgba })
}

fn png(sheet: &Sheet, path: &Path) -> Result<Vec<u8>> {
    let Pixels { size, rgba } = pixels(sheet)?;
    // Paper lets nothing through.
    let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    encoded(size, &rgb, png::ColorType::Rgb, Some((&sheet.spec.to_toml(path)?, sheet.spec.dpi)))
}

/// As PNG, with a spec and pixels an inch if given.
fn encoded(size: [u32; 2], data: &[u8], color: png::ColorType, spec: Option<(&str, u32)>) -> Result<Vec<u8>> {
    let doing = "the picture cannot be written as PNG";
    let mut bytes = Vec::new();
    let mut encoder = capture::png_encoder(&mut bytes, size, color);
    if let Some((text, dpi)) = spec {
        let metre = (f64::from(dpi) / 0.0254).round() as u32;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: metre, yppu: metre, unit: png::Unit::Meter }));
        encoder.add_itxt_chunk(KEYWORD.into(), text.into()).context(doing)?;
    }
    let mut writer = encoder.write_header().context(doing)?;
    writer.write_image_data(data).context(doing)?;
    writer.finish().context(doing)?;
    Ok(bytes)
}

fn svg(sheet: &Sheet, path: &Path) -> Result<String> {
    let drawing = drawing(sheet, true)?;
    let spec = sheet.spec.to_toml(path)?;
    let held = format!(
        "<metadata><{KEYWORD} xmlns=\"https://shadowscope.invalid/figure\">{}</{KEYWORD}></metadata>\n",
        escape(&spec)
    );
    // Behind the opening tag, which is the first line.
    let (first, rest) = drawing.split_once('\n').unwrap_or((&drawing, ""));
    Ok(format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{first}\n{held}{rest}"))
}

const FAMILY: &str = "Helvetica, Arial, 'Liberation Sans', Ubuntu, sans-serif";

/// Texts, lines and, with `all`, paper and pictures.
fn drawing(sheet: &Sheet, all: bool) -> Result<String> {
    let [w, h] = sheet.size;
    let mm = |pixels: u32| f64::from(pixels) * 25.4 / f64::from(sheet.spec.dpi);
    let size = match all {
        true => format!("width=\"{:.3}mm\" height=\"{:.3}mm\"", mm(w), mm(h)),
        false => format!("width=\"{w}\" height=\"{h}\""),
    };
    let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    let mut out =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" {size} viewBox=\"0 0 {w} {h}\" font-family=\"{FAMILY}\">\n");
    if all {
        out += "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
    }
    for (i, item) in sheet.items.iter().enumerate() {
        // Writing to a String does not fail.
        let _ = match item {
            Item::Picture { .. } if !all => Ok(()),
            Item::Picture { at: [x, y, w, h], cell, texels } => {
                let part = placed(&sheet.cells[*cell].picture, *texels, [*x, *y, *w, *h]);
                let bytes = encoded(part.size, &part.rgba, png::ColorType::Rgba, None)?;
                let held = base64::engine::general_purpose::STANDARD.encode(bytes);
                let sharp = if part.size == [*w, *h] { "" } else { " style=\"image-rendering:pixelated\"" };
                writeln!(
                    out,
                    "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\"{sharp} href=\"data:image/png;base64,{held}\"/>"
                )
            }
            Item::Rect { at: [l, t, r, b], fill, frame } => {
                let inside = frame.map_or(0.0, |(_, width)| width / 2.0);
                let fill =
                    fill.map_or("none".into(), |(color, opacity)| format!("{}\" fill-opacity=\"{opacity}", hex(color)));
                let stroke = frame.map_or(String::new(), |(color, width)| {
                    format!(" stroke=\"{}\" stroke-width=\"{width:.2}\"", hex(color))
                });
                writeln!(
                    out,
                    "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{fill}\"{stroke}/>",
                    l + inside,
                    t + inside,
                    (r - l - 2.0 * inside).max(0.0),
                    (b - t - 2.0 * inside).max(0.0)
                )
            }
            Item::Scale { at: [l, t, r, b], stops } => {
                let last = (stops.len() - 1).max(1) as f64;
                let all: String = stops
                    .iter()
                    .enumerate()
                    .map(|(k, c)| format!("<stop offset=\"{:.4}\" stop-color=\"{}\"/>", k as f64 / last, hex(*c)))
                    .collect();
                writeln!(
                    out,
                    "<defs><linearGradient id=\"g{i}\">{all}</linearGradient></defs><rect x=\"{l:.2}\" y=\"{t:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"url(#g{i})\" stroke=\"#888888\"/>",
                    r - l,
                    b - t
                )
            }
            Item::Line { from, to, color, width } => writeln!(
                out,
                "<path d=\"M{:.2} {:.2}L{:.2} {:.2}\" stroke=\"{}\" stroke-width=\"{width}\"/>",
                from[0],
                from[1],
                to[0],
                to[1],
                hex(*color)
            ),
            Item::Text { at: [x, y], anchor, size, color, text, upwards } => {
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                let turn = if *upwards { format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"") } else { String::new() };
                writeln!(
                    out,
                    "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size:.2}\" fill=\"{}\" text-anchor=\"{anchor}\"{turn}>{}</text>",
                    hex(*color),
                    escape(text)
                )
            }
        };
    }
    Ok(out + "</svg>\n")
}
