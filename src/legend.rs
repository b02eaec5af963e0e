//! The legend of a picture: what its colours mean, drawn from the view's own declaration ([`crate::view::Drawn`]).
//!
//! [`Key::new`] resolves ranges and shares, [`strip`] lays the strip below a picture out, [`axes`] what a chart in the
//! picture needs. Both give marks that the window paints and captures draw as SVG.

use crate::chart::{self, escape, text_width};
use crate::frame;
use crate::light::Light;
use crate::measure::metrics::Errors;
use crate::palette::{GREY, LABELS, OCTAVES, Palette, Rgb, bytes};
use crate::setup::{Arrange, Setup};
use crate::techniques;
use crate::view::{self, Area, Class, Legend, Span};
use anyhow::{Context, Result};
use glam::Vec3;

/// What only a rendered frame knows of its legend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Known {
    /// Of how many frames each side's light is averaged.
    pub frames: Vec<u32>,
    /// Of each side, where counted.
    pub errors: Vec<Option<Errors>>,
    /// Where cascades meet, metres along the camera's axis; empty without cascades.
    pub splits: Vec<f32>,
    /// Of each face of a light's maps the pixels that it is looked up by and the triangles drawn into it; None: not drawn.
    pub faces: Vec<Option<[u32; 2]>>,
    /// Nearest and farthest depth of the map shown, metres along the light's axis.
    pub depth: Option<[f32; 2]>,
}

/// A legend with its figures.
#[derive(Clone, Debug, Default)]
pub struct Key {
    pub title: String,
    pub parts: Vec<Part>,
    chart: Option<Chart>,
    /// The part of the picture that belongs to the side which draws the chart: left, top, width and height, shares.
    part: [f32; 4],
    /// The chart lies small in a corner of it.
    inset: bool,
}

#[derive(Clone, Debug)]
pub enum Part {
    /// A colour scale: what it shows, and marks at places from 0 to 1.
    Scale(Palette, String, Vec<(f32, String)>),
    Class(Rgb, String),
    Text(String),
}

#[derive(Clone, Debug)]
enum Chart {
    Plot(Area, [Ticks; 2]),
    /// Distances along the camera's axis: metres at the left end of the camera's frustum and its far end, tangent of half
    /// the angle of view.
    Side(f32, f32),
    Squares([&'static str; 2], Option<[&'static str; 2]>),
}

/// The marks of an axis, at places from 0 to 1, and what it shows.
#[derive(Clone, Debug)]
struct Ticks {
    what: String,
    marks: Vec<(f32, String)>,
}

/// Something drawn, in the units of the size that was laid out for; y downwards.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// Left, top, right, bottom.
    Fill([f32; 4], Rgb),
    Scale([f32; 4], Palette),
    Line([f32; 2], [f32; 2]),
    /// Its middle in height; where it is anchored; size. With a ground of its own over a picture.
    Text {
        at: [f32; 2],
        anchor: Anchor,
        size: f32,
        text: String,
        strong: bool,
        ground: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A share as a percentage with about three figures.
pub fn percent(share: f64) -> String {
    let p = share * 100.0;
    let decimals = if p == 0.0 { 0 } else { (2.0 - p.abs().log10().floor()).clamp(0.0, 5.0) as usize };
    format!("{p:.decimals$} %")
}

/// The letter of a side of the comparison; the first is 0.
pub fn letter(side: usize) -> &'static str {
    ["A", "B", "C", "D"][side.min(3)]
}

/// A side's letter and technique.
pub fn side_name(setup: &Setup, side: usize) -> String {
    let title = match setup.is_truth(side) {
        true => "truth",
        false => techniques::find(&setup.side(side).technique).map_or("", |i| i.title),
    };
    if setup.sides() > 1 { format!("{} {title}", letter(side)) } else { title.into() }
}

impl Key {
    /// The legend of a set-up's picture in a scene of these bounds.
    pub fn new(setup: &Setup, bounds: [Vec3; 2], known: &Known) -> Key {
        let id = setup.overlay.as_ref().map_or(&setup.view, |o| &o.view);
        let Some(view) = setup.find_view(id) else { return Key::default() };
        let inset = setup.overlay.as_ref().is_some_and(|o| o.inset);
        let mut key = Key { title: view.title.into(), part: part(setup, id), inset, ..Key::default() };
        let lit = view.group != view::Group::Scene || ["facing", "light-depth"].contains(&view.id);
        if setup.light_count() > 1 && lit && !["shaded", "flip"].contains(&view.id) {
            key.title = format!("{} of light {}", key.title, setup.light_number);
        }
        key.sides(setup, known);
        let errors = known.errors.first().copied().flatten().filter(|_| setup.sides() == 1);
        let class = |c: &Class| {
            let share = c.share.and_then(|share| errors.as_ref().and_then(share));
            let text = share.map_or(c.what.into(), |s| format!("{} {}", c.what, percent(s)));
            Part::Class(c.color, text)
        };
        // What a frame tells is of the first side.
        let first = if setup.sides() > 1 { format!("{} ", letter(0)) } else { String::new() };
        let cascades = |key: &mut Key| {
            for (i, ends) in known.splits.windows(2).enumerate() {
                let [near, far] = [0, 1].map(|end| chart::short(ends[end].into()));
                let text = format!("{first}{}: {near} to {far} m", i + 1);
                key.parts.push(Part::Class(LABELS[i.min(7)], text));
            }
        };
        let faces = |key: &mut Key| {
            for (i, face) in known.faces.iter().enumerate() {
                let name = format!("{first}{}", i + 1);
                let text = match face {
                    Some([samples, triangles]) => format!("{name}: {samples} pixels, {triangles} triangles"),
                    None => format!("{name}: not drawn"),
                };
                key.parts.push(Part::Class(LABELS[i.min(7)], text));
            }
        };
        if view.shows_scene() && (setup.outlines || setup.frozen().is_some()) {
            let frozen = setup.frozen().map(|_| (LABELS[8], "shadow camera's frustum"));
            let one = known.splits.is_empty() && known.faces.is_empty();
            let boxed = one.then_some((LABELS[1], "what the map covers"));
            let lines = frozen.into_iter().chain(boxed);
            key.parts.extend(lines.map(|(color, what)| Part::Class(color, what.into())));
            if !matches!(view.drawn.legend(), Legend::Cascades | Legend::Side) {
                cascades(&mut key);
            }
            if !matches!(view.drawn.legend(), Legend::Faces) {
                faces(&mut key);
            }
        }
        match view.drawn.legend() {
            Legend::None => {}
            Legend::Scale(palette, v) => {
                let depth = known.depth.filter(|_| matches!(view.drawn, view::Drawn::Depth));
                let unit = if v.unit.is_empty() || depth.is_some() { String::new() } else { format!(", {}", v.unit) };
                let [low, high] = v.range.map(f64::from);
                let ticks = match depth {
                    // Bright is near.
                    Some([near, far]) => linear_ticks(near.into(), far.into(), 5)
                        .into_iter()
                        .rev()
                        .map(|(x, t)| (1.0 - x, format!("{t} m")))
                        .collect(),
                    None if matches!(view.drawn, view::Drawn::Depth) => Vec::new(),
                    None if v.log => count_ticks(high),
                    None => linear_ticks(low, high, 5),
                };
                let of = if depth.is_some() && setup.sides() > 1 { " (of A)" } else { "" };
                key.parts.push(Part::Scale(palette, format!("{}{unit}{of}", v.what), ticks));
            }
            Legend::Octaves(what, power) => {
                let label = |i: i32| match i {
                    _ if i < 0 => format!("1/{}", chart::short(2f64.powf(f64::from(-i) * f64::from(power)))),
                    _ => chart::short(2f64.powf(f64::from(i) * f64::from(power))),
                };
                let ticks = (-4..=4).step_by(2).map(|i| ((i + 4) as f32 / 8.0, label(i))).collect();
                key.parts.push(Part::Scale(OCTAVES, what.into(), ticks));
            }
            Legend::EyeDepth => {
                let [low, high] = eye_depths(setup, bounds);
                key.parts.push(Part::Scale(GREY, "depth, m".into(), log_ticks(low.into(), high.into(), 7)));
            }
            Legend::LightDepth => {
                let far = light_reach(&setup.light, bounds);
                key.parts.push(Part::Scale(
                    GREY,
                    "distance from the light, m".into(),
                    linear_ticks(0.0, far.into(), 5),
                ));
            }
            Legend::Classes(classes) => key.parts.extend(classes.iter().map(class)),
            Legend::Cascades => cascades(&mut key),
            Legend::Faces => faces(&mut key),
            Legend::Chart(area, x, y, classes) => {
                key.parts.extend(classes.iter().map(class));
                let ticks = |axis: view::Axis| Ticks { what: axis.what.into(), marks: span_ticks(axis.span, known) };
                key.chart = Some(Chart::Plot(area, [ticks(x), ticks(y)]));
            }
            Legend::Side => {
                cascades(&mut key);
                if let Some(last) = known.splits.last() {
                    let c = &setup.camera;
                    let sides = (bounds[0] - c.position).abs().max((bounds[1] - c.position).abs());
                    let end = last.min(sides.dot(c.forward().abs()));
                    key.chart = Some(Chart::Side(end, 0.5 * c.height_at(end) / end));
                }
            }
            Legend::Squares(titles, classes) => {
                key.parts.extend(classes.iter().map(class));
                key.chart = Some(Chart::Squares(titles, None));
            }
            Legend::Curves(titles, along, classes) => {
                key.parts.extend(classes.iter().map(class));
                key.chart = Some(Chart::Squares(titles, Some(along)));
            }
        }
        key
    }

    /// Which side is where, and how wrong it is.
    fn sides(&mut self, setup: &Setup, known: &Known) {
        let error = |side: usize| {
            let share = known.errors.get(side).copied().flatten().filter(|_| !setup.is_truth(side)).map(|e| e.share());
            // Figures are of the light at work, whatever the picture shows.
            let light =
                if setup.light_count() > 1 { format!(" of light {}", setup.light_number) } else { String::new() };
            share.map_or(String::new(), |s| format!(" ({} wrong{light})", percent(s)))
        };
        let frames = |side: usize| match known.frames.get(side) {
            Some(2..) => format!(" after {} frames", known.frames[side]),
            _ => String::new(),
        };
        let name = |side: usize| side_name(setup, side) + &frames(side) + &error(side);
        match setup.sides() {
            1 if setup.overlay.is_some() => self.title = format!("{} over {}", self.title, name(0)),
            1 => self.title = format!("{}: {}", self.title, name(0)),
            _ if setup.view == "difference" => {
                self.title = format!("{}: {} − {}", self.title, name(0), name(1));
            }
            n => {
                let places: &[&str] = match (setup.arrange, n) {
                    (Arrange::Flicker, _) => {
                        self.parts.push(Part::Text(name(setup.front as usize)));
                        return;
                    }
                    (_, 2) => &["left", "right"],
                    _ => &["upper left", "upper right", "lower left", "lower right"],
                };
                self.parts.extend((0..n).map(|i| Part::Text(format!("{}: {}", places[i], name(i)))));
            }
        }
    }

    /// How much of the picture's lower edge a chart's axis takes, for text of this size.
    pub fn lower_axis(&self, size: f32) -> f32 {
        if matches!(self.chart, Some(Chart::Side(..))) && !self.inset { 3.4 * size } else { 0.0 }
    }

    /// Whether there is anything that a strip could say beside the title.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }
}

/// The depths that the view `depth` runs over, as in `shaders/shade.wgsl`.
fn eye_depths(setup: &Setup, bounds: [Vec3; 2]) -> [f32; 2] {
    let c = &setup.camera;
    if c.height.is_some() {
        let [low, high] = c.depths(bounds);
        return [low, high.max(1.0001 * low)];
    }
    let low = c.near.max(1e-3);
    let reach = (c.position - bounds[0]).abs().max((c.position - bounds[1]).abs()).length();
    [low, c.far.min(reach).max(2.0 * low)]
}

/// The distance at which the view `light-depth` is white, likewise.
fn light_reach(light: &Light, bounds: [Vec3; 2]) -> f32 {
    let extent = bounds[1] - bounds[0];
    match light {
        Light::Directional { .. } => extent.dot(light.axis().abs()),
        _ => light.range().min(extent.length()),
    }
}

/// About `count` round values from low to high, with their places.
fn linear_ticks(low: f64, high: f64, count: u32) -> Vec<(f32, String)> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let step = chart::round_step(low, high, count);
    let first = (low / step - 1e-6).ceil() as i64;
    let last = (high / step + 1e-6).floor() as i64;
    (first..=last).map(|i| ((((i as f64) * step - low) / span) as f32, chart::short(i as f64 * step))).collect()
}

/// Counts on a scale by the logarithm of one more.
fn count_ticks(most: f64) -> Vec<(f32, String)> {
    let counts = [0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];
    let along = |n: f64| (n.ln_1p() / most.ln_1p()) as f32;
    counts.into_iter().filter(|n| *n <= most).map(|n| (along(n), chart::short(n))).collect()
}

/// Round values on a logarithmic scale: 1, 2, 5 of each power of ten, fewer where they would be more than `most`.
fn log_ticks(low: f64, high: f64, most: usize) -> Vec<(f32, String)> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let powers = (low.log10().floor() as i32)..=(high.log10().ceil() as i32);
    let all = |steps: &[f64]| -> Vec<f64> {
        let values = powers.clone().flat_map(|p| steps.iter().map(move |s| s * 10f64.powi(p)));
        values.filter(|v| (low * 0.9999..=high * 1.0001).contains(v)).collect()
    };
    let values = [&[1.0, 2.0, 5.0][..], &[1.0, 3.0], &[1.0]].map(all);
    let values = values.iter().find(|v| v.len() <= most).unwrap_or(&values[2]);
    values.iter().map(|v| (((v / low).ln() / (high / low).ln()) as f32, chart::short(*v))).collect()
}

fn span_ticks(span: Span, known: &Known) -> Vec<(f32, String)> {
    match span {
        Span::Linear(low, high) => linear_ticks(low.into(), high.into(), 5),
        Span::Root => [0.0, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0f64].map(|s| (s.sqrt() as f32, percent(s))).into(),
        Span::Splits => match known.splits.as_slice() {
            [low, .., high] => log_ticks((*low).into(), (*high).into(), 7),
            _ => Vec::new(),
        },
        Span::HalfOctaves(bins) => {
            let at = |bin: u32| (bin as f32 + 0.5) / bins as f32;
            let octaves = (1..bins).step_by(2).map(|bin| (at(bin), (1u64 << ((bin - 1) / 2)).to_string()));
            [(at(0), "0".to_string())].into_iter().chain(octaves).collect()
        }
        Span::Octaves(octaves) => {
            let at = |i: i32| (i + octaves) as f32 / (2 * octaves) as f32;
            (-octaves..=octaves).map(|i| (at(i), chart::short(2f64.powi(i)))).collect()
        }
        Span::Faces => {
            let count = known.faces.len();
            (0..count).map(|i| ((i as f32 + 0.5) / count as f32, (i + 1).to_string())).collect()
        }
    }
}

/// Lays out the strip, `width` wide with text of this size: its height, and its marks from its upper left corner.
pub fn strip(key: &Key, width: f32, size: f32) -> (f32, Vec<Mark>) {
    let mut marks = Vec::new();
    let margin = 0.8 * size;
    let wide = |text: &str, size: f32| text_width(text, size.into()) as f32;
    let small = 0.85 * size;
    let row = 1.6 * size;
    // The row that is being filled: how far, and how high it has become.
    let (mut x, mut y, mut high) = (margin, 0.4 * size, row);
    let mut place = |need: f32, tall: f32| {
        if x > margin && x + need > width - margin {
            (x, y, high) = (margin, y + high, row);
        }
        let at = [x, y];
        x += need + 1.6 * size;
        high = high.max(tall);
        (at, y + high)
    };
    let text = |at: [f32; 2], anchor, size, text: &str, strong| Mark::Text {
        at,
        anchor,
        size,
        text: text.into(),
        strong,
        ground: false,
    };
    let (at, mut bottom) = place(wide(&key.title, size), row);
    marks.push(text([at[0], at[1] + row / 2.0], Anchor::Start, size, &key.title, true));
    for part in &key.parts {
        match part {
            Part::Text(t) => {
                let (at, b) = place(wide(t, size), row);
                bottom = bottom.max(b);
                marks.push(text([at[0], at[1] + row / 2.0], Anchor::Start, size, t, false));
            }
            Part::Class(color, t) => {
                let (at, b) = place(1.4 * size + wide(t, size), row);
                bottom = bottom.max(b);
                let top = at[1] + 0.3 * size;
                marks.push(Mark::Fill([at[0], top, at[0] + size, top + size], *color));
                marks.push(text([at[0] + 1.4 * size, at[1] + row / 2.0], Anchor::Start, size, t, false));
            }
            Part::Scale(palette, what, ticks) => {
                let name = wide(what, size) + 0.8 * size;
                // Marks at the ends reach beyond the bar.
                let ends = ticks.first().map_or(0.0, |t| 0.5 * wide(&t.1, small));
                let bar = (18.0 * size).min(width - 2.0 * margin).max(4.0 * size);
                let (at, b) = place(name + ends + bar + ends, row + 0.9 * small);
                bottom = bottom.max(b);
                marks.push(text([at[0], at[1] + row / 2.0], Anchor::Start, size, what, false));
                let [left, top] = [at[0] + name + ends, at[1] + 0.35 * size];
                marks.push(Mark::Scale([left, top, left + bar, top + 0.8 * size], *palette));
                let mut free = f32::NEG_INFINITY;
                for (t, label) in ticks {
                    let x = left + t * bar;
                    marks.push(Mark::Line([x, top + 0.8 * size], [x, top + 1.05 * size]));
                    let half = 0.5 * wide(label, small);
                    if x - half > free {
                        marks.push(text([x, top + 1.05 * size + 0.55 * small], Anchor::Middle, small, label, false));
                        free = x + half + 0.4 * small;
                    }
                }
            }
        }
    }
    (bottom + 0.3 * size, marks)
}

/// What a chart in a picture of this size needs: axes with marks and units, titles; from the picture's upper left corner.
/// `free`: as far down as nothing lies over the picture.
pub fn axes(key: &Key, [w, h]: [f32; 2], free: f32, size: f32) -> Vec<Mark> {
    let [left, top, width, height] = [0, 1, 2, 3].map(|i| key.part[i] * [w, h][i % 2]);
    let mut by = [left, top];
    let mut marks = if key.inset {
        // As in shaders/lib/inset.wgsl.
        let gap = height / 90.0;
        let [w, h] = [width / 3.0, height / 3.0];
        by = [left + width - w - gap, top + gap];
        let mut marks = chart_axes(key, [w, h], h, 0.7 * size);
        // What is too wide for it would lie over the picture.
        let inside = |[l, t, r, b]: [f32; 4]| l >= 0.0 && t >= 0.0 && r <= w && b <= h;
        marks.retain(|mark| match mark {
            Mark::Text { at, anchor, size, text, .. } => inside(text_box(*at, *anchor, *size, text)),
            _ => true,
        });
        marks
    } else {
        chart_axes(key, [width, height], height.min(free - top), size)
    };
    let moved = |[x, y]: [f32; 2]| [x + by[0], y + by[1]];
    for mark in &mut marks {
        match mark {
            Mark::Line(from, to) => (*from, *to) = (moved(*from), moved(*to)),
            Mark::Text { at, .. } => *at = moved(*at),
            Mark::Fill(..) | Mark::Scale(..) => {}
        }
    }
    marks
}

/// The part of a figure in which the first side that has this view draws it; all of it where the others are cut out of the
/// same picture.
fn part(setup: &Setup, view: &str) -> [f32; 4] {
    let has = |side| setup.view_of(side, view).is_some();
    const WHOLE: u32 = 1 << 14;
    let panes = frame::panes(setup, [WHOLE; 2]);
    let Some(p) = panes.iter().find(|p| has(p.side)) else { return [0.0, 0.0, 1.0, 1.0] };
    let [x, y] = [0, 1].map(|i| p.at[i] - p.part[i]);
    [x, y, p.size[0], p.size[1]].map(|v| v as f32 / WHOLE as f32)
}

fn chart_axes(key: &Key, [w, h]: [f32; 2], free: f32, size: f32) -> Vec<Mark> {
    let mut marks = Vec::new();
    let text = |at, anchor, text: &str| Mark::Text { at, anchor, size, text: text.into(), strong: false, ground: true };
    match &key.chart {
        None => {}
        Some(Chart::Plot(area, [x, y])) => {
            let [left, top, right, bottom] = match area {
                Area::Margins => [0.05 * w, 0.05 * h, 0.95 * w, 0.95 * h],
                Area::Square => {
                    let half = 0.5 * w.min(h) / 1.04;
                    [0.5 * w - half, 0.5 * h - half, 0.5 * w + half, 0.5 * h + half]
                }
            };
            plot(&mut marks, [left, top, right, bottom], x, y, size);
        }
        Some(Chart::Side(end, tangent)) => {
            let scale = (1.1 * end / w).max(2.2 * end * tangent / h);
            let y = free - 1.6 * size;
            let [left, right] = [0.05 * end / scale, (0.05 * end + end) / scale];
            marks.push(Mark::Line([left, y], [right, y]));
            for (t, label) in linear_ticks(0.0, (*end).into(), 6) {
                let x = left + t * (right - left);
                marks.push(Mark::Line([x, y - 0.25 * size], [x, y + 0.25 * size]));
                marks.push(text([x, y + 0.8 * size], Anchor::Middle, &label));
            }
            marks.push(text([right, y - 1.1 * size], Anchor::End, "distance along the camera's axis, m"));
        }
        Some(Chart::Squares(titles, along)) => {
            let scale = (2.08 / w).max(1.04 / h);
            let side = 1.0 / scale;
            let top = 0.5 * h - 0.5 * side;
            for (i, title) in titles.iter().enumerate() {
                let left = 0.5 * w + (i as f32 - 1.0) * side;
                if let Some([x, y]) = along {
                    let unit = |what: &str| Ticks { what: what.into(), marks: linear_ticks(0.0, 1.0, 5) };
                    plot(&mut marks, [left, top, left + side, top + side], &unit(x), &unit(y), size);
                }
                // What runs upwards is named at the left.
                let (x, anchor) =
                    if along.is_some() { (side - 0.5 * size, Anchor::End) } else { (0.5 * side, Anchor::Middle) };
                marks.push(text([left + x, top + size], anchor, title));
            }
        }
    }
    marks
}

/// The axes of a plot at its left and lower border; marks that would touch are left out.
fn plot(marks: &mut Vec<Mark>, [left, top, right, bottom]: [f32; 4], x: &Ticks, y: &Ticks, size: f32) {
    let text = |at, anchor, text: &str| Mark::Text { at, anchor, size, text: text.into(), strong: false, ground: true };
    marks.push(Mark::Line([left, bottom], [right, bottom]));
    marks.push(Mark::Line([left, top], [left, bottom]));
    let mut free = f32::NEG_INFINITY;
    for (t, label) in &x.marks {
        let at = left + t * (right - left);
        let half = 0.5 * text_width(label, size.into()) as f32;
        marks.push(Mark::Line([at, bottom - 0.3 * size], [at, bottom]));
        if at - half > free {
            marks.push(text([at, bottom - 0.95 * size], Anchor::Middle, label));
            free = at + half + 0.8 * size;
        }
    }
    marks.push(text([right - 0.5 * size, bottom - 2.4 * size], Anchor::End, &x.what));
    let mut free = f32::INFINITY;
    for (t, label) in &y.marks {
        let at = bottom - t * (bottom - top);
        marks.push(Mark::Line([left, at], [left + 0.3 * size, at]));
        // The corner belongs to the axis below.
        if at + 0.7 * size < free && at < bottom - 1.8 * size && at > top + 1.8 * size {
            marks.push(text([left + 0.8 * size, at], Anchor::Start, label));
            free = at - 0.7 * size;
        }
    }
    marks.push(text([left + 0.8 * size, top + size], Anchor::Start, &y.what));
}

/// Size of the text in a picture of so many pixels: as large as in a window of this size, and readable in a small figure.
fn text_size([w, h]: [u32; 2]) -> f32 {
    (w as f32).min(1.6 * h as f32).max(720.0) / 80.0
}

/// Height of the strip that goes below a picture of so many pixels.
pub fn strip_height(key: &Key, size: [u32; 2]) -> u32 {
    strip(key, size[0] as f32, text_size(size)).0.ceil() as u32
}

/// How high a picture is with which its strip adds up to a height; None where there is no room for one.
pub fn picture_height(key: &Key, [width, whole]: [u32; 2]) -> Option<u32> {
    let mut height = whole;
    // The text, and so the strip, shrinks a little with the picture.
    for _ in 0..4 {
        height = whole.checked_sub(strip_height(key, [width, height])).filter(|height| *height > 0)?;
    }
    Some(height)
}

/// The picture of a capture, four bytes a pixel, with the strip below it; the new size.
///
/// # Errors
/// The drawing cannot be made into a picture.
pub fn below(key: &Key, size: [u32; 2], mut rgba: Vec<u8>) -> Result<([u32; 2], Vec<u8>)> {
    let (height, strip) = strip(key, size[0] as f32, text_size(size));
    let height = height.ceil() as u32;
    rgba.extend(draw(&svg(&strip, [size[0], height], true))?);
    Ok(([size[0], size[1] + height], rgba))
}

/// Draws the axes of a chart into its picture, whose colours are multiplied by their alpha.
///
/// # Errors
/// As [`below`].
pub fn draw_axes(key: &Key, size: [u32; 2], rgba: &mut [u8]) -> Result<()> {
    let [w, h] = size.map(|s| s as f32);
    let marks = axes(key, [w, h], h, text_size(size));
    if marks.is_empty() {
        return Ok(());
    }
    chart::lay_over(rgba, &draw(&svg(&marks, size, false))?);
    Ok(())
}

fn draw(svg: &str) -> Result<Vec<u8>> {
    chart::pixels(svg).context("the legend cannot be drawn")
}

/// Marks as SVG: on white paper, or light on nothing for what lies over a picture.
fn svg(marks: &[Mark], [w, h]: [u32; 2], paper: bool) -> String {
    let hex = |c: Rgb| {
        let [r, g, b] = bytes(c);
        format!("#{r:02x}{g:02x}{b:02x}")
    };
    let ink = if paper { "#222222" } else { "#f0f0f0" };
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{w}" height="{h}" viewBox="0 0 {w} {h}" font-family="Helvetica, Arial, 'Liberation Sans', Ubuntu, sans-serif">"##
    );
    if paper {
        out += r##"<rect width="100%" height="100%" fill="#ffffff"/>"##;
    }
    for (i, mark) in marks.iter().enumerate() {
        match mark {
            Mark::Fill([l, t, r, b], color) => {
                let (w, h) = (r - l, b - t);
                out += &format!(
                    r##"<rect x="{l}" y="{t}" width="{w}" height="{h}" fill="{}" stroke="#888888" stroke-width="0.75"/>"##,
                    hex(*color)
                );
            }
            Mark::Scale([l, t, r, b], palette) => {
                let last = (palette.stops.len() - 1) as f32;
                let stops = palette.stops.iter().enumerate();
                let stops: String = stops
                    .map(|(k, c)| format!(r#"<stop offset="{}" stop-color="{}"/>"#, k as f32 / last, hex(*c)))
                    .collect();
                let (w, h) = (r - l, b - t);
                out += &format!(
                    r##"<defs><linearGradient id="g{i}">{stops}</linearGradient></defs><rect x="{l}" y="{t}" width="{w}" height="{h}" fill="url(#g{i})" stroke="#888888" stroke-width="0.75"/>"##
                );
            }
            Mark::Line([ax, ay], [bx, by]) => {
                out += &format!(r#"<path d="M{ax} {ay}L{bx} {by}" stroke="{ink}" stroke-width="1"/>"#);
            }
            Mark::Text { at: [x, y], anchor, size, text, strong, ground } => {
                if *ground {
                    let [l, t, r, b] = text_box([*x, *y], *anchor, *size, text);
                    let (w, h) = (r - l, b - t);
                    out += &format!(
                        r##"<rect x="{l}" y="{t}" width="{w}" height="{h}" rx="2" fill="#000000" fill-opacity="0.6"/>"##
                    );
                }
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                let weight = if *strong { r#" font-weight="bold""# } else { "" };
                let base = y + 0.35 * size;
                out += &format!(
                    r#"<text x="{x}" y="{base}" font-size="{size}" fill="{ink}" text-anchor="{anchor}"{weight}>{}</text>"#,
                    escape(text)
                );
            }
        }
    }
    out + "</svg>"
}

/// The ground of a text over a picture.
pub fn text_box([x, y]: [f32; 2], anchor: Anchor, size: f32, text: &str) -> [f32; 4] {
    let wide = text_width(text, size.into()) as f32;
    let left = match anchor {
        Anchor::Start => x,
        Anchor::Middle => x - wide / 2.0,
        Anchor::End => x - wide,
    };
    [left - 0.3 * size, y - 0.65 * size, left + wide + 0.3 * size, y + 0.65 * size]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::{Overlay, Side};

    #[test]
    fn ticks_are_round_and_in_place() {
        let texts = |t: Vec<(f32, String)>| t.into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(texts(linear_ticks(0.0, 4.0, 5)), ["0", "1", "2", "3", "4"]);
        assert_eq!(texts(linear_ticks(-1.0, 1.0, 5)), ["−1", "−0.5", "0", "0.5", "1"]);
        assert_eq!(texts(linear_ticks(0.0, 37.0, 5)), ["0", "10", "20", "30"]);
        assert_eq!(texts(log_ticks(0.1, 12.0, 7)), ["0.1", "0.2", "0.5", "1", "2", "5", "10"]);
        let halves = span_ticks(Span::HalfOctaves(20), &Known::default());
        assert_eq!(halves[1].1, "1");
        assert_eq!(halves[3].1, "4");
        assert!(linear_ticks(1.0, 1.0, 5).is_empty() && log_ticks(0.0, 1.0, 5).is_empty());
    }

    /// Axes lie in the part of the side that draws the chart, and in its inset.
    #[test]
    fn axes_lie_where_the_chart_is() {
        let (setup, _) = Setup::open("cubes").unwrap();
        let side = |id: &str| Side { technique: id.into(), ..Side::new(Side::TRUTH).unwrap() };
        let all = Setup { against: vec![side("pcf"), side("truth")], technique: "pssm".into(), ..setup.clone() };
        let all = Setup { view: "side".into(), arrange: Arrange::SideBySide, ..all };
        let alone = Setup { against: Vec::new(), ..all.clone() };
        let second = Setup { technique: "pcf".into(), against: vec![side("pssm")], ..all.clone() };
        let over = Overlay { view: "side".into(), opacity: 1.0, inset: true };
        let inset = Setup { view: "shaded".into(), overlay: Some(over), ..alone.clone() };
        let [w, h] = [800.0, 600.0];
        for (setup, part) in [
            (&alone, [0.0, 0.0, w, h]),
            (&all, [0.0, 0.0, w / 2.0, h / 2.0]),
            (&second, [w / 2.0, 0.0, w, h]),
            (&inset, [2.0 / 3.0 * w - 10.0, 0.0, w, h / 3.0 + 10.0]),
        ] {
            let known = Known { splits: vec![1.0, 5.0, 20.0], ..Known::default() };
            let bounds = [Vec3::splat(-10.0), Vec3::splat(10.0)];
            let key = Key { inset: setup.overlay.is_some(), ..Key::new(setup, bounds, &known) };
            let key = Key { chart: Some(Chart::Side(20.0, 0.4)), ..key };
            let marks = axes(&key, [w, h], h, 12.0);
            assert!(marks.len() > 5, "{marks:?}");
            for mark in marks {
                let [l, t, r, b] = match mark {
                    Mark::Text { at, anchor, size, text, .. } => text_box(at, anchor, size, &text),
                    Mark::Line(a, b) => [a[0].min(b[0]), a[1].min(b[1]), a[0].max(b[0]), a[1].max(b[1])],
                    other => panic!("{other:?}"),
                };
                let inside = l >= part[0] - 4.0 && t >= part[1] - 0.1 && r <= part[2] + 0.1 && b <= part[3] + 0.1;
                assert!(inside, "{:?} beyond {part:?}", [l, t, r, b]);
            }
        }
    }

    /// Nothing reaches beyond the strip, and texts of a row do not touch, whatever the width.
    #[test]
    fn strips_stay_inside() {
        let class = |i: usize| Part::Class(LABELS[i], format!("a class with a long name {i}"));
        let scale = Part::Scale(GREY, "depth, m".into(), log_ticks(0.1, 300.0, 7));
        let key = Key {
            title: "View: technique".into(),
            parts: vec![class(1), scale, class(2)],
            chart: None,
            part: [0.0, 0.0, 1.0, 1.0],
            inset: false,
        };
        for width in [320.0, 640.0, 1280.0] {
            let (height, marks) = strip(&key, width, 13.0);
            let mut boxes: Vec<[f32; 4]> = Vec::new();
            for mark in &marks {
                if let Mark::Text { at, anchor, size, text, .. } = mark {
                    let [l, t, r, b] = text_box(*at, *anchor, *size, text);
                    let inner = [l + 0.3 * size, t + 0.1 * size, r - 0.3 * size, b - 0.1 * size];
                    assert!(
                        inner[0] >= 0.0 && inner[2] <= width && inner[1] >= 0.0 && inner[3] <= height,
                        "{width} {text}"
                    );
                    for o in &boxes {
                        let apart = inner[0] >= o[2] || o[0] >= inner[2] || inner[1] >= o[3] || o[1] >= inner[3];
                        assert!(apart, "{width}: {text} touches another text");
                    }
                    boxes.push(inner);
                }
            }
        }
    }
}
