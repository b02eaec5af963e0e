//! The map viewer: a technique's depth maps beside the picture or instead of it, linked with it texel by texel.

use super::compare;
use super::model::{Model, Tab};
use super::panel::grouped;
use super::style::{ACCENT, SUN, TEXT};
use crate::frame::{self, LightSpace, MapLayer};
use crate::legend::letter;
use crate::palette::{GREY, OCTAVES, Rgb, bytes};
use crate::view::Group;
use egui::{
    Align2, Button, Color32, ColorImage, CursorIcon, FontId, Id, Painter, Pos2, Rect, RichText, Sense, Shape, Stroke,
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

/// Where texels are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Space {
    /// As the map is stored.
    #[default]
    Map,
    /// Where they lie in the light's image of the scene.
    Light,
}

/// What a texture was made of: the map by its number, quantity and space, points per unit and place in the middle, size in
/// pixels, range.
type Key = (u64, (Quantity, Space), [f32; 3], [usize; 2], [f32; 2]);

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
    space: Space,
    /// Points per unit of the [`Canvas`]; None: the whole map fits.
    zoom: Option<f32>,
    /// The place in the middle.
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
    /// The part of the light's image that the map covers, shares of its sides.
    cover: Rect,
}

/// The plane that the viewer shows. In its units the map's own texels are 1 wide; the part of the light's image that the map
/// covers is as long as the map's sides.
struct Canvas<'a> {
    map: &'a MapLayer,
    /// With the unit's size in shares of the light's image, and the canvas' upper left corner there.
    light: Option<(&'a LightSpace, Vec2, Vec2)>,
    size: Vec2,
}

impl<'a> Canvas<'a> {
    fn new(held: &'a Held, space: Space) -> Canvas<'a> {
        let map = &*held.map;
        let side = map.side as f32;
        let Some(light) = map.light_space.as_ref().filter(|_| space == Space::Light) else {
            return Canvas { map, light: None, size: Vec2::splat(side) };
        };
        let shape = held.cover.size() * vec2(light.aspect, 1.0);
        let size = shape * (side / shape.max_elem());
        Canvas { map, light: Some((light, held.cover.size() / size, held.cover.min.to_vec2())), size }
    }

    /// The place in the map, texels, of a place here; None: beside the map.
    fn texel(&self, at: Vec2) -> Option<Vec2> {
        let texel = match self.light {
            Some((light, unit, corner)) => light.to_texel((corner + at * unit).into())?.into(),
            None => at,
        };
        let side = self.map.side as f32;
        (texel.x >= 0.0 && texel.y >= 0.0 && texel.x < side && texel.y < side).then_some(texel)
    }

    /// The place here of a place in the map, texels.
    fn place(&self, texel: Vec2) -> Vec2 {
        match self.light {
            Some((light, unit, corner)) => (Vec2::from(light.of_texel(texel.into())) - corner) / unit,
            None => texel,
        }
    }
}

/// The part of the light's image that a map covers, shares of its sides.
fn cover(map: &MapLayer) -> Rect {
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    let Some(light) = &map.light_space else { return whole };
    let side = map.side as f32;
    let border = (0..=64).flat_map(|i| {
        let t = side * i as f32 / 64.0;
        [[t, 0.0], [t, side], [0.0, t], [side, t]]
    });
    let places = border.map(|texel| Pos2::from(light.of_texel(texel))).filter(|p| p.is_finite());
    let around = places.map(|p| Rect::from_min_max(p, p)).reduce(Rect::union).unwrap_or(whole);
    let inside = around.intersect(whole);
    if inside.is_positive() { inside } else { whole }
}

const BINS: usize = 96;
/// Width that the buttons need in one row, without those of several maps.
const ROOM: f32 = 510.0;
/// Heights of a row of buttons and of the one with the range, points.
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
        }
        self.layer = map.layer;
        self.taken += 1;
        self.held =
            Some(Held { ends, usual: [at(0.01), at(0.99)], bins, empty, flat, cover: cover(&map), map: Arc::new(map) });
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
    let (bar, rest) = rect.split_top_bottom_at_y(rect.top() + bar_height(rect, m));
    let (image, range) = rest.split_top_bottom_at_y((rest.bottom() - RANGE).max(rest.top()));
    buttons(ui, bar, m);
    let draws = m.info().all_views().any(|v| v.group == Group::Map && v.id.starts_with("shadow-map"));
    let maps = &mut m.maps;
    if maps.held.is_none() {
        let text = if draws { "Reading the map …" } else { "This technique draws no depth map." };
        ui.painter().text(rest.center(), Align2::CENTER_CENTER, text, FontId::proportional(13.5), TEXT);
        return;
    }
    let pinned = m.inspect.story.as_ref().filter(|_| m.drawer == Some(Tab::Pixel)).and_then(|s| s.texel);
    map(ui, image, maps, pinned);
    if maps.quantity == Quantity::Depth {
        depths(ui, range.shrink2(vec2(14.0, 4.0)), maps);
    } else {
        samples(ui, range.shrink2(vec2(14.0, 4.0)));
    }
}

/// Height of the viewer's buttons.
pub fn bar_height(rect: Rect, m: &Model) -> f32 {
    let layers = m.maps.held.as_ref().map_or(1, |h| h.map.layers);
    let narrow = rect.width() < ROOM + if layers > 1 { 30.0 * layers as f32 } else { 0.0 };
    if narrow { 2.0 * BAR } else { BAR }
}

/// Which map, what of it, how large, and the button that closes.
fn buttons(ui: &mut Ui, bar: Rect, m: &mut Model) {
    let mut inside = ui.new_child(UiBuilder::new().max_rect(bar.shrink2(vec2(8.0, 4.0))).id_salt("map buttons"));
    inside.shrink_clip_rect(bar);
    inside.horizontal_wrapped(|ui| {
        let maps = &mut m.maps;
        let layers = maps.held.as_ref().map_or(1, |h| h.map.layers);
        let chip = |chosen, text: String| Button::selectable(chosen, text).frame_when_inactive(true);
        if m.setup.sides() > 1 {
            ui.label(RichText::new(format!("{}:", letter(0))).color(TEXT)).on_hover_text("The maps of the first side.");
        }
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
        let spaces = [
            (Space::Map, "Map", "The map as it is stored and looked up."),
            (
                Space::Light,
                "Light",
                "The map's texels where they lie in the light's image of the scene: without fit and warp.",
            ),
        ];
        for (space, title, tip) in spaces {
            let there = maps.held.as_ref().is_some_and(|h| space == Space::Map || h.map.light_space.is_some());
            let button = ui.add_enabled(there, chip(maps.space == space && there, title.into()));
            if button.on_hover_text(tip).clicked() {
                (maps.space, maps.zoom) = (space, None);
            }
        }
        ui.separator();
        if ui.add(chip(maps.zoom.is_none(), "Fit".into())).on_hover_text("The whole map.").clicked() {
            maps.zoom = None;
        }
        let one = 1.0 / ui.ctx().pixels_per_point();
        if ui
            .add(chip(maps.zoom == Some(one), "1:1".into()))
            .on_hover_text("A pixel for each texel (in the light's image, for a middling one).")
            .clicked()
        {
            maps.zoom = Some(one);
        }
        let instead = maps.place == Place::Instead;
        let (title, tip) = if instead {
            ("Beside the picture", "The picture and the map beside each other (M).")
        } else {
            ("Fill the view", "The map alone, in place of the picture (M).")
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

/// The map itself; `pinned`: the texel of the pixel that is inspected, and its map.
fn map(ui: &mut Ui, image: Rect, maps: &mut Maps, pinned: Option<([f32; 2], u32)>) {
    let Some(held) = &maps.held else { return };
    let canvas = Canvas::new(held, maps.space);
    let fit = ((image.size() - Vec2::splat(8.0)).max(Vec2::splat(8.0)) / canvas.size).min_elem();
    let r = ui.interact(image, Id::unique("map"), Sense::click_and_drag());
    if maps.zoom.is_none() {
        maps.middle = canvas.size / 2.0;
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
    maps.middle = maps.middle.clamp(Vec2::ZERO, canvas.size);
    let middle = maps.middle;
    let on_screen = |texel: Vec2| image.center() + (canvas.place(texel) - middle) * zoom;

    let scale = ui.ctx().pixels_per_point();
    let size = [image.width(), image.height()].map(|s| (s * scale).round().max(1.0) as usize);
    let range = shown(maps, held);
    let key = (maps.taken, (maps.quantity, maps.space), [zoom, middle.x, middle.y], size, range);
    if maps.texture.as_ref().is_none_or(|(k, _)| *k != key) {
        let drawn = draw(&canvas, maps.quantity, size, scale * zoom, middle, range);
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
    let under = pointer.and_then(|p| canvas.texel(middle + (p - image.center()) / zoom));
    maps.texel = under.map(|t| [t.x as u32, t.y as u32]);
    let mark = |t: [f32; 2], color: Color32| {
        let first = vec2(t[0].floor(), t[1].floor());
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|c| on_screen(first + Vec2::from(c)));
        // A texel smaller than this would hardly be seen.
        let around = Rect::from_points(&corners);
        let small = around.width().max(around.height()) < 6.0;
        let square = Rect::from_center_size(around.center(), Vec2::splat(7.0));
        for (width, color) in [(4.0, Color32::BLACK), (1.5, color)] {
            if small {
                painter.rect_stroke(square, 0.0, Stroke::new(width, color), StrokeKind::Middle);
            } else {
                painter.add(Shape::closed_line(corners.to_vec(), Stroke::new(width, color)));
            }
        }
    };
    if let Some((texel, _)) = pinned.filter(|(_, layer)| *layer == held.map.layer) {
        mark(texel, SUN);
    }
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

/// The map as a picture of `size` pixels, `zoom` of them for a unit of the canvas, with this place in the middle.
fn draw(
    canvas: &Canvas,
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
    let map = canvas.map;
    // Where texels are smaller than pixels, the mean of some of them.
    let steps = ((1.0 / zoom).ceil() as usize).clamp(1, 4);
    let one = |x: usize, y: usize| {
        let (mut sum, mut seen, mut inside) = (0.0f32, 0, 0);
        for k in 0..steps * steps {
            let sub = |i: usize| (i as f32 + 0.5) / steps as f32;
            let p = vec2(x as f32 + sub(k % steps), y as f32 + sub(k / steps)) - vec2(w as f32, h as f32) / 2.0;
            let Some(t) = canvas.texel(middle + p / zoom) else { continue };
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
