//! A sheet as PDF: a page of its size, pictures as they are, text as text.

use super::compose::{Item, Sheet};
use super::layout::Area;
use super::write::placed;
use crate::chart::text_width;
use crate::frame::Pixels;
use crate::legend::Anchor;
use anyhow::{Context, Result, anyhow};
use krilla::color::rgb;
use krilla::geom::{Path, PathBuilder, Point, Rect, Size, Transform};
use krilla::image::Image;
use krilla::metadata::Metadata;
use krilla::num::NormalizedF32;
use krilla::page::PageSettings;
use krilla::paint::{Fill, LinearGradient, SpreadMethod, Stop, Stroke};
use krilla::surface::Surface;
use krilla::text::{Font, TextDirection};
use krilla::{Document, SerializeSettings};

/// Of a sheet the PDF file, which holds neither dates nor anything random.
pub fn pdf(sheet: &Sheet, name: &str) -> Result<Vec<u8>> {
    let point = 72.0 / sheet.spec.dpi as f32;
    let [width, height] = sheet.size.map(|side| side as f32 * point);
    let font = Font::new(epaint_default_fonts::UBUNTU_LIGHT.into(), 0).context("the built-in font cannot be read")?;
    let mut document = Document::new_with(SerializeSettings::default());
    document.set_metadata(Metadata::new().title(name.into()).creator("Shadowscope".into()));
    let settings = PageSettings::from_wh(width, height).context("the sheet has no size that a page could have")?;
    let mut page = document.start_page_with(settings);
    let mut surface = page.surface();
    surface.push_transform(&Transform::from_scale(point, point));
    for item in &sheet.items {
        draw(&mut surface, sheet, &font, item);
    }
    surface.pop();
    surface.finish();
    page.finish();
    document.finish().map_err(|e| anyhow!("the sheet cannot be written as PDF: {e:?}"))
}

fn paint([r, g, b]: [u8; 3], opacity: f64) -> Fill {
    let opacity = NormalizedF32::new(opacity as f32).unwrap_or(NormalizedF32::ONE);
    Fill { paint: rgb::Color::new(r, g, b).into(), opacity, ..Fill::default() }
}

fn stroke([r, g, b]: [u8; 3], width: f64) -> Stroke {
    Stroke { paint: rgb::Color::new(r, g, b).into(), width: width as f32, ..Stroke::default() }
}

/// A rectangle with its corners so far inside; None: it has no area.
fn rectangle([l, t, r, b]: [f64; 4], inside: f64) -> Option<Path> {
    let [l, t, r, b] = [l + inside, t + inside, r - inside, b - inside].map(|side| side as f32);
    let mut path = PathBuilder::new();
    path.push_rect(Rect::from_ltrb(l, t, r, b)?);
    path.finish()
}

fn draw(surface: &mut Surface, sheet: &Sheet, font: &Font, item: &Item) {
    match item {
        Item::Picture { at, cell, texels } => picture(surface, sheet, *at, *cell, *texels),
        Item::Rect { at, fill, frame } => {
            let inside = frame.map_or(0.0, |(_, width)| width / 2.0);
            surface.set_fill(fill.map(|(color, opacity)| paint(color, opacity)));
            surface.set_stroke(frame.map(|(color, width)| stroke(color, width)));
            if let Some(path) = rectangle(*at, inside) {
                surface.draw_path(&path);
            }
        }
        Item::Scale { at, stops } => {
            let last = (stops.len() - 1).max(1) as f32;
            let stop = |(i, color): (usize, &[u8; 3])| Stop {
                offset: NormalizedF32::new(i as f32 / last).unwrap_or(NormalizedF32::ONE),
                color: rgb::Color::new(color[0], color[1], color[2]).into(),
                opacity: NormalizedF32::ONE,
            };
            let gradient = LinearGradient {
                x1: at[0] as f32,
                y1: at[1] as f32,
                x2: at[2] as f32,
                y2: at[1] as f32,
                transform: Transform::identity(),
                spread_method: SpreadMethod::Pad,
                stops: stops.iter().enumerate().map(stop).collect(),
                anti_alias: false,
            };
            surface.set_fill(Some(Fill { paint: gradient.into(), ..Fill::default() }));
            surface.set_stroke(Some(stroke([0x88; 3], 1.0)));
            if let Some(path) = rectangle(*at, 0.0) {
                surface.draw_path(&path);
            }
        }
        Item::Line { from, to, color, width } => {
            let mut path = PathBuilder::new();
            path.move_to(from[0] as f32, from[1] as f32);
            path.line_to(to[0] as f32, to[1] as f32);
            surface.set_fill(None);
            surface.set_stroke(Some(stroke(*color, *width)));
            if let Some(path) = path.finish() {
                surface.draw_path(&path);
            }
        }
        Item::Text { at, anchor, size, color, text, upwards } => {
            // Lines are set for fonts that are a little wider than the built-in one.
            let wide = text_width(text, *size) / WIDER;
            let back = match anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => wide / 2.0,
                Anchor::End => wide,
            };
            surface.set_fill(Some(paint(*color, 1.0)));
            surface.set_stroke(None);
            let [x, y] = at.map(|side| side as f32);
            if *upwards {
                surface.push_transform(&Transform::from_rotate_at(-90.0, x, y));
            }
            let start = Point::from_xy(x - back as f32, y);
            surface.draw_text(start, font.clone(), *size as f32, text, false, TextDirection::Auto);
            if *upwards {
                surface.pop();
            }
        }
    }
}

/// What [`text_width`] says over the width in the built-in font.
const WIDER: f64 = 1.06;

fn picture(surface: &mut Surface, sheet: &Sheet, at: Area, cell: usize, texels: Area) {
    let Pixels { size: [across, down], rgba } = placed(&sheet.cells[cell].picture, texels, at);
    let image = Image::from_rgba8(rgba, across, down);
    let [x, y, w, h] = at.map(|side| side as f32);
    if let Some(size) = Size::from_wh(w, h) {
        surface.push_transform(&Transform::from_translate(x, y));
        surface.draw_image(image, size);
        surface.pop();
    }
}
