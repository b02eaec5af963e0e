//! The map viewer: a technique's depth maps beside the picture or instead of it, linked with it texel by texel.

use super::compare;
use super::model::Model;
use super::panel::grouped;
use super::style::{ACCENT, TEXT};
use crate::frame::{self, MapLayer};
use crate::palette::{GREY, OCTAVES, Rgb, bytes};
use crate::view::Group;
use egui::{
    Align2, Button, Color32, ColorImage, CursorIcon, FontId, Id, Painter, Pos2, Rect, RichText, Sense, Stroke,
    StrokeKind, TextureHandle, TextureOptions, Ui, UiBuilder, Vec2, pos2, vec2,
};
use rayon::prelude::*;
use std::sync::Arc;

/// Where the viewer is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    #[default]
    Closed,
    Beside,
    Instead,
}

/// What is shown of each texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Quantity {
    #[default]
    Depth,
    Samples,
}

/// What a texture was made of: the map by its number, quantity, points per texel and texel in the middle, size in pixels, range.
type Key = (u64, Quantity, [f32; 3], [usize; 2], [f32; 2]);

/// The viewer's state.
#[derive(Default)]
pub struct Maps {
    pub place: Place,
    /// The map that is asked for, from 0.
    pub layer: u32,
    held: Option<Held>,
    /// Counts the maps taken in.
    taken: u64,
    quantity: Quantity,
    /// Points per texel; None: the whole map fits.
    zoom: Option<f32>,
    /// The texel in the middle.
    middle: Vec2,
    /// Depths from white to black, metres; None: as the map has them.
    range: Option<[f32; 2]>,
    texture: Option<(Key, TextureHandle)>,
    /// The texel under the pointer.
    texel: Option<[u32; 2]>,
    /// Where in the viewport the pointer is, 0 to 1.
    pub pointed: Option<[f32; 2]>,
}

/// A map with what is known of its depths.
struct Held {
    map: Arc<MapLayer>,
    /// Nearest and farthest, metres, and between which the middle 98 % lie.
    ends: [f32; 2],
    usual: [f32; 2],
    /// Texels by depth from the nearest to the farthest, over the most.
    bins: Vec<f32>,
    /// Texels without a caster, and those whose caster lies flat on the near plane.
    empty: usize,
    flat: usize,
}

const BINS: usize = 96;
/// Heights of the bar with the buttons and of the one with the range, points.
const BAR: f32 = 30.0;
const RANGE: f32 = 58.0;
/// Most pixels of the picture that are marked for a texel.
const MARKS: usize = 6000;

const EMPTY: Color32 = Color32::from_rgb(30, 34, 42);
const GROUND: Color32 = Color32::from_rgb(16, 18, 22);

impl Maps {
    /// Takes a map in; where there was none before, all of it is shown.
    pub fn take(&mut self, map: MapLayer) {
        // What lies flat on the near plane (pancaking) says nothing of depths.
        let flat = |i: &usize| map.depth[*i] >= 1.0;
        let mut depths: Vec<f32> = (0..map.depth.len()).filter(|i| !flat(i)).filter_map(|i| map.metres(i)).collect();
        let flat = (0..map.depth.len()).filter(flat).count();
        depths.par_sort_unstable_by(f32::total_cmp);
        let at = |share: f64| depths.get(((depths.len().max(1) - 1) as f64 * share) as usize).copied().unwrap_or(0.0);
        let ends = [at(0.0), at(1.0)];
        let mut bins = vec![0.0f32; BINS];
        let scale = BINS as f32 / (ends[1] - ends[0]).max(1e-9);
        depths.iter().for_each(|d| bins[(((d - ends[0]) * scale) as usize).min(BINS - 1)] += 1.0);
        let most = bins.iter().copied().fold(1.0, f32::max);
        bins.iter_mut().for_each(|b| *b = (*b / most).sqrt());
        let empty = map.depth.len() - depths.len() - flat;
        if self.held.as_ref().is_none_or(|h| h.map.side != map.side) {
            self.zoom = None;
            self.middle = Vec2::splat(map.side as f32 / 2.0);
        }
        self.layer = map.layer;
        self.taken += 1;
        self.held = Some(Held { ends, usual: [at(0.01), at(0.99)], bins, empty, flat, map: Arc::new(map) });
    }

    /// The map that the scene's thread is to read back, if one is looked at.
    pub fn wanted(&self) -> Option<u32> {
        (self.place != Place::Closed).then_some(self.layer)
    }

    pub fn toggle(&mut self) {
        self.place = match self.place {
            Place::Closed => Place::Beside,
            Place::Beside => Place::Instead,
            Place::Instead => Place::Closed,
        };
        if self.place == Place::Closed {
            // It may be large.
            (self.held, self.texture) = (None, None);
        }
    }

    /// Lets go of a map that belongs to another technique or scene.
    pub fn forget(&mut self) {
        self.held = None;
        self.layer = 0;
    }
}

/// The part of a rectangle that the viewer takes, and what is left for the picture.
pub fn split(rect: Rect, place: Place) -> [Rect; 2] {
    match place {
        Place::Closed => [Rect::NOTHING, rect],
        Place::Instead => [rect, Rect::NOTHING],
        Place::Beside => {
            let (left, right) = rect.split_left_right_at_fraction(0.5);
            [right.with_min_x(right.left() + 2.0), left]
        }
    }
}

/// Draws the viewer.
pub fn show(ui: &mut Ui, rect: Rect, m: &mut Model) {
    if !rect.is_positive() {
        return;
    }
    ui.painter().rect_filled(rect, 0.0, GROUND);
    let (bar, rest) = rect.split_top_bottom_at_y(rect.top() + BAR);
    let (image, range) = rest.split_top_bottom_at_y((rest.bottom() - RANGE).max(rest.top()));
    buttons(ui, bar, m);
    let draws = m.info().maps().any(|v| v.group == Group::Map && v.id.starts_with("shadow-map"));
    let maps = &mut m.maps;
    if maps.held.is_none() {
        let text = if draws { "Reading the map …" } else { "This technique draws no depth map." };
        ui.painter().text(rest.center(), Align2::CENTER_CENTER, text, FontId::proportional(13.5), TEXT);
        return;
    }
    map(ui, image, maps);
    if maps.quantity == Quantity::Depth {
        depths(ui, range.shrink2(vec2(14.0, 4.0)), maps);
    } else {
        samples(ui, range.shrink2(vec2(14.0, 4.0)));
    }
}

/// Which map, what of it, how large, and the button that closes.
fn buttons(ui: &mut Ui, bar: Rect, m: &mut Model) {
    let mut inside = ui.new_child(UiBuilder::new().max_rect(bar.shrink2(vec2(8.0, 4.0))).id_salt("map buttons"));
    inside.shrink_clip_rect(bar);
    inside.horizontal_centered(|ui| {
        let maps = &mut m.maps;
        let layers = maps.held.as_ref().map_or(1, |h| h.map.layers);
        let chip = |chosen, text: String| Button::selectable(chosen, text).frame_when_inactive(true);
        if layers > 1 {
            for i in 0..layers {
                let tip = format!("Map {} of {layers}.", i + 1);
                if ui.add(chip(maps.layer == i, (i + 1).to_string())).on_hover_text(tip).clicked() {
                    maps.layer = i;
                }
            }
            ui.separator();
        }
        let quantities = [
            (Quantity::Depth, "Depth", "Depth along the light's axis: near bright, far dark."),
            (Quantity::Samples, "Samples", "How many pixels of the picture look into each texel."),
        ];
        for (quantity, title, tip) in quantities {
            if ui.add(chip(maps.quantity == quantity, title.into())).on_hover_text(tip).clicked() {
                maps.quantity = quantity;
            }
        }
        ui.separator();
        if ui.add(chip(maps.zoom.is_none(), "Fit".into())).on_hover_text("The whole map.").clicked() {
            maps.zoom = None;
        }
        let one = 1.0 / ui.ctx().pixels_per_point();
        if ui.add(chip(maps.zoom == Some(one), "1:1".into())).on_hover_text("A pixel for each texel.").clicked() {
            maps.zoom = Some(one);
            maps.middle = maps.texel.map_or(maps.middle, |t| vec2(t[0] as f32, t[1] as f32));
        }
        let instead = maps.place == Place::Instead;
        let (title, tip) = if instead {
            ("Beside", "The picture and the map beside each other.")
        } else {
            ("Instead", "The map alone.")
        };
        if ui.button(title).on_hover_text(tip).clicked() {
            maps.place = if instead { Place::Beside } else { Place::Instead };
        }
        if ui.button("×").on_hover_text("Close the map viewer (M).").clicked() {
            maps.place = Place::Closed;
        }
    });
    if m.maps.place == Place::Closed {
        (m.maps.held, m.maps.texture) = (None, None);
    }
}

/// The range that depths are drawn over, metres.
fn shown(maps: &Maps, held: &Held) -> [f32; 2] {
    let [near, far] = maps.range.unwrap_or(held.usual);
    [near, far.max(near + 1e-6 * near.abs().max(1.0))]
}

/// The map itself.
fn map(ui: &mut Ui, image: Rect, maps: &mut Maps) {
    let Some(held) = &maps.held else { return };
    let side = held.map.side as f32;
    let fit = (image.width().min(image.height()) - 8.0).max(8.0) / side;
    let r = ui.interact(image, Id::unique("map"), Sense::click_and_drag());
    if maps.zoom.is_none() {
        maps.middle = Vec2::splat(side / 2.0);
    }
    let mut zoom = maps.zoom.unwrap_or(fit);
    if r.dragged() {
        maps.middle -= r.drag_delta() / zoom;
        maps.zoom = Some(zoom);
        ui.set_cursor_icon(CursorIcon::Grabbing);
    }
    let pointer = r.hover_pos();
    let wheel = ui.input(|i| i.smooth_scroll_delta.y);
    if let (Some(at), true) = (pointer, wheel != 0.0) {
        let before = zoom;
        zoom = (zoom * (wheel * 0.005).exp()).clamp(0.5 * fit, 64.0);
        // What is under the pointer stays there.
        let from = at - image.center();
        maps.middle += from / before - from / zoom;
        maps.zoom = Some(zoom);
    }
    maps.middle = maps.middle.clamp(Vec2::ZERO, Vec2::splat(side));
    let middle = maps.middle;
    let texel_at = |p: Pos2| middle + (p - image.center()) / zoom;
    let at_texel = |t: Vec2| image.center() + (t - middle) * zoom;

    let scale = ui.ctx().pixels_per_point();
    let size = [image.width(), image.height()].map(|s| (s * scale).round().max(1.0) as usize);
    let range = shown(maps, held);
    let key = (maps.taken, maps.quantity, [zoom, middle.x, middle.y], size, range);
    if maps.texture.as_ref().is_none_or(|(k, _)| *k != key) {
        let drawn = draw(&held.map, maps.quantity, size, scale * zoom, middle, range);
        match &mut maps.texture {
            Some((k, texture)) => {
                *k = key;
                texture.set(drawn, TextureOptions::NEAREST);
            }
            None => maps.texture = Some((key, ui.ctx().load_texture("map", drawn, TextureOptions::NEAREST))),
        }
    }
    let painter = ui.painter().with_clip_rect(image);
    if let Some((_, texture)) = &maps.texture {
        painter.image(texture.id(), image, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
    }
    maps.texel = pointer.and_then(|p| {
        let t = texel_at(p);
        let inside = t.x >= 0.0 && t.y >= 0.0 && t.x < side && t.y < side;
        inside.then_some([t.x as u32, t.y as u32])
    });
    let mark = |t: [f32; 2], color: Color32| {
        let square = Rect::from_min_max(
            at_texel(vec2(t[0].floor(), t[1].floor())),
            at_texel(vec2(t[0].floor() + 1.0, t[1].floor() + 1.0)),
        );
        let square = square.expand((3.0 - square.width() / 2.0).max(0.5));
        painter.rect_stroke(square, 0.0, Stroke::new(3.0, Color32::BLACK), StrokeKind::Outside);
        painter.rect_stroke(square, 0.0, Stroke::new(1.5, color), StrokeKind::Outside);
    };
    if let Some([x, y]) = maps.texel {
        mark([x as f32, y as f32], Color32::WHITE);
        say(&painter, image, &described(&held.map, [x, y]));
    } else if let Some((texel, layer)) = pointed(maps) {
        if layer == held.map.layer {
            mark(texel, ACCENT);
            say(
                &painter,
                image,
                &format!("under the pointer: {}", described(&held.map, texel.map(|t| t.max(0.0) as u32))),
            );
        } else {
            say(&painter, image, &format!("The pixel under the pointer looks into map {}.", layer + 1));
        }
    }
}

/// A texel in words.
fn described(map: &MapLayer, [x, y]: [u32; 2]) -> String {
    let (x, y) = (x.min(map.side - 1), y.min(map.side - 1));
    let i = (y * map.side + x) as usize;
    let depth = map.metres(i).map_or("no caster".into(), |d| format!("depth {} m", crate::chart::short(d.into())));
    let samples = map.samples.as_ref().map_or(String::new(), |s| match s[i] {
        1 => ", 1 sample".into(),
        n => format!(", {n} samples"),
    });
    format!("texel {x}, {y}: {depth}{samples}")
}

/// The place in the maps of the pixel that the pointer is over in the picture.
fn pointed(maps: &Maps) -> Option<([f32; 2], u32)> {
    let (held, at) = (maps.held.as_ref()?, maps.pointed?);
    let [w, h] = held.map.size;
    let pixel = [(at[0] * w as f32) as u32, (at[1] * h as f32) as u32].map(|p| p.min(w.max(h)));
    let index = pixel[1].min(h - 1) as usize * w as usize + pixel[0].min(w - 1) as usize;
    held.map.places.get(index).copied().flatten()
}

fn say(painter: &Painter, image: Rect, text: &str) {
    let galley = painter.layout_no_wrap(text.into(), FontId::proportional(12.5), TEXT);
    let place = Align2::LEFT_BOTTOM.anchor_size(image.left_bottom() + vec2(10.0, -8.0), galley.size());
    painter.rect_filled(place.expand2(vec2(5.0, 2.0)), 3.0, Color32::from_black_alpha(170));
    painter.galley(place.min, galley, TEXT);
}

/// The map as a picture of `size` pixels, `zoom` of them for a texel, with this texel in the middle.
fn draw(
    map: &MapLayer,
    quantity: Quantity,
    [w, h]: [usize; 2],
    zoom: f32,
    middle: Vec2,
    [near, far]: [f32; 2],
) -> ColorImage {
    let color = |c: Rgb| {
        let [r, g, b] = bytes(c);
        Color32::from_rgb(r, g, b)
    };
    let side = map.side as f32;
    // Where texels are smaller than pixels, the mean of some of them.
    let steps = ((1.0 / zoom).ceil() as usize).clamp(1, 4);
    let one = |x: usize, y: usize| {
        let (mut sum, mut seen, mut inside) = (0.0f32, 0, 0);
        for k in 0..steps * steps {
            let sub = |i: usize| (i as f32 + 0.5) / steps as f32;
            let p = vec2(x as f32 + sub(k % steps), y as f32 + sub(k / steps)) - vec2(w as f32, h as f32) / 2.0;
            let t = middle + p / zoom;
            if t.x < 0.0 || t.y < 0.0 || t.x >= side || t.y >= side {
                continue;
            }
            inside += 1;
            let i = t.y as usize * map.side as usize + t.x as usize;
            let value = match quantity {
                Quantity::Depth => map.metres(i),
                Quantity::Samples => map.samples.as_ref().map(|s| s[i] as f32),
            };
            if let Some(v) = value {
                (sum, seen) = (sum + v, seen + 1);
            }
        }
        let value = sum / seen.max(1) as f32;
        match quantity {
            _ if inside == 0 => GROUND,
            _ if seen == 0 => EMPTY,
            Quantity::Depth => color(GREY.at(0.04 + 0.96 * (far - value) / (far - near))),
            Quantity::Samples if value == 0.0 => Color32::from_rgb(250, 250, 247),
            // A texel with n samples is about √n pixels wide.
            Quantity::Samples => color(OCTAVES.at(0.5 * value.log2() / 8.0 + 0.5)),
        }
    };
    let pixels = (0..w * h).into_par_iter().map(|i| one(i % w, i / w)).collect();
    ColorImage::new([w, h], pixels)
}

/// The range of depths with their histogram; its ends can be dragged.
fn depths(ui: &mut Ui, rect: Rect, maps: &mut Maps) {
    let Some(held) = &maps.held else { return };
    let [first, last] = held.ends;
    let span = (last - first).max(1e-6);
    let bars = rect.with_max_y(rect.bottom() - 18.0);
    let x_of = |d: f32| bars.left() + bars.width() * ((d - first) / span).clamp(0.0, 1.0);
    let [near, far] = shown(maps, held);
    let painter = ui.painter().with_clip_rect(rect.expand(6.0));
    painter.rect_filled(bars, 2.0, EMPTY);
    let wide = bars.width() / BINS as f32;
    for (i, height) in held.bins.iter().enumerate() {
        let left = bars.left() + i as f32 * wide;
        let depth = first + span * (i as f32 + 0.5) / BINS as f32;
        let bar =
            Rect::from_min_max(pos2(left, bars.bottom() - height * bars.height()), pos2(left + wide, bars.bottom()));
        let [r, g, b] = bytes(GREY.at(0.2 + 0.8 * (far - depth) / (far - near)));
        painter.rect_filled(bar, 0.0, Color32::from_rgb(r, g, b));
    }
    let mut ends = [near, far];
    for (i, name) in ["nearest shown", "farthest shown"].into_iter().enumerate() {
        let x = x_of(ends[i]);
        let handle = Rect::from_center_size(pos2(x, bars.center().y), vec2(10.0, bars.height()));
        let r = ui.interact(handle, Id::unique(name), Sense::drag());
        let color = if r.hovered() || r.dragged() { ACCENT } else { Color32::WHITE };
        painter.line_segment([pos2(x, bars.top()), pos2(x, bars.bottom())], Stroke::new(2.0, color));
        if r.hovered() || r.dragged() {
            ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        if let (true, Some(at)) = (r.dragged(), r.interact_pointer_pos()) {
            ends[i] = first + span * ((at.x - bars.left()) / bars.width()).clamp(0.0, 1.0);
            ends[1 - i] = if i == 0 { ends[1].max(ends[0] + 1e-3 * span) } else { ends[0].min(ends[1] - 1e-3 * span) };
        }
    }
    if ends != [near, far] {
        maps.range = Some(ends);
    }
    // To a thousandth of the range.
    let number = |d: f32| crate::chart::short(((d / span * 1e3).round() * span / 1e3).into());
    let flat = match held.flat {
        0 => String::new(),
        n => format!(", {} on the near plane", grouped(n)),
    };
    let text = format!(
        "{} to {} m of {} to {} m; {} texels empty{flat}",
        number(ends[0]),
        number(ends[1]),
        number(first),
        number(last),
        grouped(held.empty)
    );
    painter.text(bars.left_bottom() + vec2(0.0, 3.0), Align2::LEFT_TOP, text, FontId::proportional(11.5), TEXT);
    if maps.range.is_some() {
        let place = Rect::from_min_max(pos2(rect.right() - 44.0, bars.bottom() + 1.0), rect.max);
        let auto = ui.put(place, Button::new(RichText::new("auto").small()).small());
        if auto.on_hover_text("The range in which 98 % of the depths lie.").clicked() {
            maps.range = None;
        }
    }
}

/// The colours of samples per texel.
fn samples(ui: &Ui, rect: Rect) {
    let bar = rect.with_max_y(rect.bottom() - 18.0).with_max_x(rect.left() + rect.width().min(320.0));
    let steps = 64;
    for i in 0..steps {
        let [r, g, b] = bytes(OCTAVES.at((i as f32 + 0.5) / steps as f32));
        let x = |i: usize| bar.left() + bar.width() * i as f32 / steps as f32;
        let part = Rect::from_min_max(pos2(x(i), bar.top() + 8.0), pos2(x(i + 1) + 0.5, bar.bottom()));
        ui.painter().rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    for (place, text) in [(0.0, "1/256"), (0.25, "1/16"), (0.5, "1"), (0.75, "16"), (1.0, "256 samples per texel")] {
        let align = if (0.1..0.9).contains(&place) { Align2::CENTER_TOP } else { Align2::LEFT_TOP };
        let at = pos2(bar.left() + bar.width() * place - if place == 1.0 { 14.0 } else { 0.0 }, bar.bottom() + 3.0);
        ui.painter().text(at, align, text, FontId::proportional(11.5), TEXT);
    }
}

/// Marks the pixels of the picture that look into the texel under the pointer.
pub fn marks(ui: &Ui, rect: Rect, m: &Model) {
    let (Some(held), Some(texel)) = (&m.maps.held, m.maps.texel) else { return };
    let map = &held.map;
    let [w, h] = map.size;
    let here = |place: &frame::Place| {
        place.is_some_and(|(t, layer)| layer == map.layer && t.map(|t| t.max(0.0) as u32) == texel)
    };
    let found: Vec<usize> = (0..map.places.len()).filter(|i| here(&map.places[*i])).take(MARKS).collect();
    let pink = Color32::from_rgb(255, 60, 200);
    for part in compare::parts(rect, &m.setup) {
        let painter = ui.painter().with_clip_rect(part.seen);
        let pixel = vec2(part.whole.width() / w as f32, part.whole.height() / h as f32);
        let place = |i: &usize| {
            let at = vec2((i % w as usize) as f32, (i / w as usize) as f32);
            Rect::from_min_size(part.whole.min + at * pixel, pixel)
        };
        found.iter().for_each(|i| _ = painter.rect_filled(place(i), 0.0, pink));
        if let Some(around) = found.iter().map(place).reduce(Rect::union) {
            // A single pixel would hardly be seen.
            painter.rect_stroke(around.expand(5.0), 2.0, Stroke::new(1.5, pink), StrokeKind::Outside);
        }
    }
}
