//! A pixel's story: what the technique did there, in numbers of its own data, beside what rays say.

use super::causes::{CAUSES, Causes, Evidence};
use super::diagnosis::{self, Diagnosis};
use super::metrics::{AWAY, BACKGROUND, FACING, OUTSIDE, Pixels, distance_to};
use crate::chart::digits;
use crate::frame::{Ask, Looked, Place, Renderer, ShownValue, pixel_at};
use crate::light::Light;
use crate::params::Value;
use crate::setup::Setup;
use crate::techniques;
use crate::truth::Samples;
use anyhow::{Context, Result, ensure};
use glam::{DVec3, Vec3};
use serde::Serialize;

/// A frame read back with its truth: what stories are told and diagnoses made from.
pub struct Seen {
    /// Width and height, pixels.
    pub size: [u32; 2],
    pub pixels: Pixels,
    pub causes: Causes,
    pub evidence: Vec<Evidence>,
    /// m, its perspective and projection parts, and a texel's area in pixels; empty of techniques without maps.
    pub aliasing: Vec<[f32; 4]>,
    pub places: Vec<Place>,
    /// Position, and depth along the camera's axis, 0 for background.
    pub position: Vec<[f32; 4]>,
    pub triangles: Vec<u32>,
    /// Pixels to the nearest one that is truly dark, and to the nearest that is truly lit.
    pub to: [Vec<f32>; 2],
}

impl Seen {
    /// Reads the last frame back, which must have been analysed and have traced the truth.
    ///
    /// # Errors
    /// What the device reports.
    pub fn read(renderer: &mut Renderer) -> Result<Seen> {
        let mask = renderer.read_mask()?;
        let (hard, mean) = (renderer.read_labels()?, renderer.read_truth()?);
        let pixels = Pixels { visibility: renderer.read_visibility()?, hard, mean, mask };
        let (causes, evidence) = renderer.read_evidence()?;
        let width = renderer.read_width()?;
        let marked = |lit: bool| -> Vec<bool> {
            pixels.hard.iter().zip(&pixels.mask).map(|(h, m)| *m == FACING && (*h >= 0.5) == lit).collect()
        };
        let to = [false, true].map(|lit| distance_to(&marked(lit), width));
        let aliasing = renderer.analysis().aliasing(&renderer.gpu)?.unwrap_or_default();
        Ok(Seen {
            size: [width as u32, (pixels.mask.len() / width) as u32],
            causes,
            evidence,
            aliasing,
            places: renderer.read_places()?,
            position: renderer.read_position()?,
            triangles: renderer.read_surface()?.iter().map(|words| words[3]).collect(),
            to,
            pixels,
        })
    }

    /// Draws a set-up's technique at the set-up's size, and reads that.
    ///
    /// # Errors
    /// A light that technique or truth do not serve, or what the device reports.
    pub fn draw(renderer: &mut Renderer, setup: &Setup) -> Result<Seen> {
        let setup = judged(setup);
        for info in [techniques::find_or_say(&setup.technique)?, techniques::TRUTH] {
            info.serve(&setup.light)?;
        }
        renderer.render(&setup, Ask { analysis: true, picture: false, ..Ask::of(&setup) })?;
        Seen::read(renderer)
    }

    pub fn width(&self) -> usize {
        self.size[0] as usize
    }

    /// The number of a pixel.
    pub fn index(&self, pixel: [u32; 2]) -> usize {
        pixel[1] as usize * self.width() + pixel[0] as usize
    }

    /// The pixel of a number.
    pub fn pixel(&self, i: usize) -> [u32; 2] {
        [(i % self.width()) as u32, (i / self.width()) as u32]
    }

    /// Whether the technique's label of a pixel differs from the truth's.
    pub fn wrong(&self, i: usize) -> bool {
        let p = &self.pixels;
        p.mask[i] == FACING && (p.visibility[i] >= 0.5) != (p.hard[i] >= 0.5)
    }
}

/// What is drawn of a set-up to be judged: its technique alone, shaded, the truth averaged as the technique aims.
pub fn judged(setup: &Setup) -> Setup {
    Setup { truth_samples: Samples::Fixed(setup.shown_samples()), ..setup.measured() }
}

/// Where the shadow ray of a pixel is stopped first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hit {
    /// Metres from the surface.
    pub distance: f32,
    /// Its number in the scene.
    pub triangle: u32,
    /// Scene space, metres.
    pub at: [f32; 3],
}

/// What a technique's map has at a pixel; metres of depth along the map's axis, places in texels from its upper left corner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InMap {
    /// Which of the maps, from 0; the one that takes over, and its share.
    pub map: u32,
    pub next: Option<(u32, f32)>,
    /// Texels of a side.
    pub side: u32,
    /// Where the surface lies.
    pub texel: [f32; 2],
    /// Where it would lie without the warp, if there is one.
    pub before_warp: Option<[f32; 2]>,
    /// The texel's corners on the surface's plane, scene space, and its longest side there, metres.
    pub footprint: [[f32; 3]; 4],
    pub footprint_m: f32,
    /// Of the surface from the light, of what it is compared as, and of what the texel holds; None: nothing.
    pub receiver_m: f32,
    pub compared_m: f32,
    pub held_m: Option<f32>,
    /// How far nearer to the light than the surface's plane in its middle the texel's depth is.
    pub before_plane_m: Option<f32>,
    /// How much nearer to the light the surface is compared: constant, by slope, along its normal, onto its plane in the texel's middle.
    pub bias_m: [f32; 4],
    /// What the surface's plane gains over a texel, along both sides together.
    pub slope_m: f32,
    /// How far the filter's taps reach, texels.
    pub reach: f32,
    /// The surface lies beside the map.
    pub outside: bool,
    /// The smallest difference of depth that the map's format tells apart there.
    pub step_m: f32,
}

impl InMap {
    fn new(looked: &Looked, setup: &Setup) -> InMap {
        let middle = looked.taps[looked.taps.len() / 2];
        let held = middle.w == 1.0;
        let corners = looked.corners.map(|c| c.truncate());
        let side = |i: usize| corners[i].distance(corners[(i + 1) % 4]);
        let warped = looked.before.distance(looked.texel) > 0.01;
        InMap {
            map: looked.layer,
            next: (looked.share > 0.0).then_some((looked.next, looked.share)),
            side: looked.side as u32,
            texel: looked.texel.into(),
            before_warp: warped.then_some(looked.before.into()),
            footprint: corners.map(Into::into),
            footprint_m: (0..4).map(side).fold(0.0, f32::max),
            receiver_m: looked.depth,
            compared_m: looked.compared,
            held_m: held.then_some(looked.held),
            before_plane_m: held.then_some(middle.z - middle.x),
            bias_m: looked.bias.into(),
            slope_m: looked.slope.x.abs() + looked.slope.y.abs(),
            reach: looked.radius,
            outside: looked.outside == 1,
            step_m: step(looked, setup),
        }
    }

    /// All biases together, metres towards the light.
    pub fn moved(&self) -> f32 {
        self.bias_m.iter().sum()
    }
}

/// Metres of depth between two neighbouring numbers of the map's format, at what a pixel is compared as.
pub fn step(looked: &Looked, setup: &Setup) -> f32 {
    let [near, far, depth] = [looked.near, looked.far, looked.compared].map(f64::from);
    let perspective = looked.perspective == 1;
    // As `stored_depth` in WGSL, and how fast depth changes with it.
    let even = (far - depth) / (far - near);
    let (stored, rate) = match perspective {
        true => (even * near / depth.max(1e-6 * near), depth * depth * (far - near) / (near * far)),
        false => (even, far - near),
    };
    let bits = match setup.values().get("format") {
        Some(Value::Text(format)) if format == "16" => -16.0,
        Some(Value::Text(format)) if format == "24" => -24.0,
        // A float's last bit.
        _ => stored.clamp(1e-30, 1.0).log2().floor() - 23.0,
    };
    (rate * bits.exp2()) as f32
}

/// What a view of the technique's own shows at a pixel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Own {
    pub view: &'static str,
    pub title: &'static str,
    /// With its unit.
    pub value: String,
}

/// A pixel's story. What a technique lacks is absent.
#[derive(Clone, Debug, Serialize)]
pub struct Story {
    /// From the upper left corner, of a picture of `size`.
    pub pixel: [u32; 2],
    pub size: [u32; 2],
    pub technique: String,
    /// In words: whether it can be shadowed, what the technique says, and whether that is right.
    pub class: String,
    /// It can be wrong: it faces the light and is reached by it.
    pub facing: bool,
    pub wrong: bool,
    /// Position in the scene's own coordinates and depth along the camera's axis, metres; the triangle.
    pub position: Option<[f64; 3]>,
    pub depth: f32,
    pub triangle: Option<u32>,
    /// The same place in the renderer's coordinates.
    #[serde(skip)]
    pub place: Option<[f32; 3]>,
    /// Of the technique; of the one ray from the pixel's centre; and the mean over so many.
    pub visibility: f32,
    pub truth: f32,
    pub mean: f32,
    pub samples: u32,
    /// The towards-the-light vector's length, metres; None under the sun.
    pub light_distance: Option<f32>,
    /// Unit vector towards the light.
    pub to_light: [f32; 3],
    pub hit: Option<Hit>,
    /// As [`CAUSES`] names it.
    pub cause: Option<&'static str>,
    pub map: Option<InMap>,
    /// Where it lies in which of the technique's maps, texels.
    pub texel: Option<([f32; 2], u32)>,
    /// m, its perspective and projection parts, and a texel's area in pixels.
    pub aliasing: Option<[f32; 4]>,
    pub own: Vec<Own>,
    pub diagnosis: Option<Diagnosis>,
}

/// A heading, and lines below it: what, and its value in words.
pub type Section = (&'static str, Vec<(String, String)>);

/// Tells the stories of pixels of a frame; `setup` is the frame's, `frames` of how many its light is averaged and of how many it
/// is to be. `views`: also what the technique's own views show, which takes a pass over the picture each.
///
/// # Errors
/// A pixel beside the picture, or what the device reports.
pub fn tell(
    renderer: &mut Renderer,
    setup: &Setup,
    seen: &Seen,
    pixels: &[[u32; 2]],
    frames: [u32; 2],
    views: bool,
) -> Result<Vec<Story>> {
    let [width, height] = seen.size;
    ensure!(pixels.iter().all(|p| p[0] < width && p[1] < height), "there is no such pixel in {width} × {height}");
    let looked = renderer.looked(pixels)?;
    let origin = renderer.scene().origin;
    let mut stories = Vec::new();
    for (k, pixel) in pixels.iter().enumerate() {
        let i = seen.index(*pixel);
        let looked = looked.as_ref().map(|all| &all[k]).filter(|l| l.outside < 2);
        let mut story = plain(setup, seen, i, origin);
        story.map = looked.map(|l| InMap::new(l, setup));
        if views && story.facing {
            let shown = renderer.shown_at(setup, *pixel)?;
            story.own = shown.into_iter().map(own).collect();
        }
        story.diagnosis = diagnosis::diagnose(setup, seen, i, looked, frames);
        stories.push(story);
    }
    Ok(stories)
}

/// Draws a set-up and tells the story of the pixel at a place of the picture, shares of its sides from the upper left corner.
///
/// # Errors
/// As [`Seen::draw`].
pub fn at(renderer: &mut Renderer, setup: &Setup, place: [f32; 2]) -> Result<Story> {
    let setup = judged(setup);
    let seen = Seen::draw(renderer, &setup)?;
    let pixel = pixel_at(place, seen.size);
    tell(renderer, &setup, &seen, &[pixel], [1, 1], true)?.pop().context("no story")
}

fn own(shown: crate::frame::Shown) -> Own {
    let value = match shown.value {
        ShownValue::Number(x, unit) => format!("{} {unit}", digits(x.into())).trim().to_string(),
        ShownValue::Class(what) => what.into(),
    };
    Own { view: shown.view.id, title: shown.view.title, value }
}

/// What is known without a map.
fn plain(setup: &Setup, seen: &Seen, i: usize, origin: DVec3) -> Story {
    let p = &seen.pixels;
    let [x, y, z, depth] = seen.position[i];
    let at = Vec3::new(x, y, z);
    let surface = depth > 0.0;
    let away = match setup.light {
        Light::Directional { .. } => setup.light.position(),
        _ => setup.light.position() - at,
    };
    let facing = p.mask[i] == FACING;
    let evidence = &seen.evidence[i];
    let hit = (facing && p.hard[i] < 0.5 && evidence.blocked()).then(|| Hit {
        distance: evidence.distance(),
        triangle: evidence.triangle,
        at: (at + away.normalize_or_zero() * evidence.distance()).into(),
    });
    let directional = matches!(setup.light, Light::Directional { .. });
    let class = match p.mask[i] {
        BACKGROUND => "background: no surface is seen here".to_string(),
        AWAY => "turned away from the light: dark whatever the technique does".into(),
        OUTSIDE if away.length() > setup.light.range() => {
            format!("faces the light, but beyond its range of {} m: dark", digits(setup.light.range().into()))
        }
        OUTSIDE => "faces the light, but outside its cone: dark".into(),
        _ => {
            let told = if p.visibility[i] >= 0.5 { "lit" } else { "in shadow" };
            let how = if seen.wrong(i) { "wrongly" } else { "rightly" };
            let within =
                if matches!(setup.light, Light::Directional { .. }) { "" } else { ", within its cone and range" };
            format!("faces the light{within}; {told}, {how}")
        }
    };
    let cause = seen.causes.classes[i];
    Story {
        pixel: seen.pixel(i),
        size: seen.size,
        technique: setup.technique.clone(),
        class,
        facing,
        wrong: seen.wrong(i),
        position: surface.then(|| (at.as_dvec3() + origin).to_array()),
        place: surface.then_some([x, y, z]),
        depth,
        triangle: surface.then(|| seen.triangles[i]),
        visibility: p.visibility[i],
        truth: p.hard[i],
        mean: p.mean[i],
        samples: setup.shown_samples(),
        light_distance: (surface && !directional).then(|| away.length()),
        to_light: away.normalize_or_zero().into(),
        hit,
        cause: CAUSES.get((cause as usize).wrapping_sub(1)).map(|c| c.title),
        map: None,
        texel: seen.places.get(i).copied().flatten(),
        aliasing: seen.aliasing.get(i).copied().filter(|a| facing && a[0] > 0.0),
        own: Vec::new(),
        diagnosis: None,
    }
}

/// Metres in words: in centimetres or millimetres where they are few.
pub fn metres(m: f32) -> String {
    let m = f64::from(m);
    let text = match m.abs() {
        0.0 => "0 m".into(),
        // To three digits.
        x if x < 0.009_995 => format!("{} mm", digits(m * 1e3)),
        x if x < 0.9995 => format!("{} cm", digits(m * 1e2)),
        _ => format!("{} m", digits(m)),
    };
    text.replace('-', "−")
}

fn number(x: f32) -> String {
    digits(x.into()).replace('-', "−")
}

impl Story {
    /// The story in words, section by section.
    pub fn sections(&self) -> Vec<Section> {
        let mut all = Vec::new();
        let mut lines = vec![("pixel".into(), format!("{}, {}", self.pixel[0], self.pixel[1]))];
        lines.push(("class".into(), self.class.clone()));
        if self.facing {
            lines.push(("visibility".into(), number(self.visibility)));
            let mean = match self.samples {
                1 => String::new(),
                n => format!("; mean of {n} samples {}", number(self.mean)),
            };
            lines.push(("truth".into(), format!("{}{mean}", if self.truth >= 0.5 { "lit" } else { "in shadow" })));
        }
        lines.extend(self.cause.map(|cause| ("cause".into(), cause.into())));
        all.push(("Pixel", lines));

        let mut lines = Vec::new();
        if let Some(p) = self.position {
            lines.push(("position".into(), p.map(|x| digits(x).replace('-', "−")).join(", ") + " m"));
            lines.push(("from the camera".into(), metres(self.depth)));
        }
        lines.extend(self.triangle.map(|t| ("triangle".into(), t.to_string())));
        lines.extend(self.light_distance.map(|d| ("from the light".into(), metres(d))));
        if self.facing {
            let told = match self.hit {
                Some(hit) => format!("stopped after {} by triangle {}", metres(hit.distance), hit.triangle),
                None if self.truth >= 0.5 => "reaches the light".into(),
                None => "reaches the light's middle; most of the light is hidden".into(),
            };
            lines.push(("ray to the light".into(), told));
        }
        if !lines.is_empty() {
            all.push(("Surface", lines));
        }
        match (&self.map, self.texel) {
            (Some(map), _) => all.push(("In the map", map.lines())),
            (None, Some(([x, y], map))) => {
                let texel = format!("{}, {} of map {map}", x.floor(), y.floor());
                all.push(("In the map", vec![("texel".into(), texel)]));
            }
            _ => {}
        }
        if let Some([m, perspective, projection, area]) = self.aliasing {
            let lines = vec![
                ("aliasing error m".into(), format!("{} pixels a texel", number(m))),
                ("perspective part".into(), number(perspective)),
                ("projection part".into(), number(projection)),
                ("texel's area".into(), format!("{} pixels", number(area))),
            ];
            all.push(("Aliasing", lines));
        }
        if !self.own.is_empty() {
            all.push(("Technique", self.own.iter().map(|o| (o.title.to_lowercase(), o.value.clone())).collect()));
        }
        all
    }

    /// The story as text, with the diagnosis.
    pub fn text(&self) -> String {
        let mut out = String::new();
        for (title, lines) in self.sections() {
            out += &format!("{title}\n");
            for (what, value) in lines {
                out += &format!("  {what:<18} {value}\n");
            }
        }
        match &self.diagnosis {
            Some(diagnosis) => out += &diagnosis.text(),
            None if self.facing => out += "Nothing is wrong here.\n",
            None => {}
        }
        out
    }
}

impl InMap {
    fn lines(&self) -> Vec<(String, String)> {
        let [x, y] = self.texel;
        let mut lines = Vec::new();
        let layer = match self.next {
            Some((next, share)) => {
                format!("number {}, {} texels a side; {:.0} % of map {next}", self.map, self.side, 100.0 * share)
            }
            None => format!("number {}, {} texels a side", self.map, self.side),
        };
        lines.push(("map".into(), layer));
        lines.push(("texel".into(), format!("{}, {}", x.floor(), y.floor())));
        if let Some([u, v]) = self.before_warp {
            lines.push(("warp moves it by".into(), format!("{}, {} texels", number(x - u), number(y - v))));
        }
        lines.push(("on the surface".into(), format!("up to {} long", metres(self.footprint_m))));
        if self.outside {
            lines.push(("depth held".into(), "none: beside the map".into()));
            return lines;
        }
        lines.push(("receiver's depth".into(), metres(self.receiver_m)));
        lines.push(("depth held".into(), self.held_m.map_or("nothing".into(), metres)));
        if let Some(before) = self.before_plane_m {
            let told = match before {
                x if x.abs() < 1e-6 => "on it".into(),
                x if x > 0.0 => format!("{} nearer to the light", metres(x)),
                x => format!("{} farther from the light", metres(-x)),
            };
            lines.push(("from the plane".into(), told));
        }
        lines.push(("compared as".into(), metres(self.compared_m)));
        let [constant, slope, normal, plane] = self.bias_m;
        lines.push(("moved to the light".into(), metres(self.moved())));
        for (what, m) in
            [("  constant", constant), ("  slope", slope), ("  along the normal", normal), ("  to its plane", plane)]
        {
            if m.abs() > 1e-7 {
                lines.push((what.into(), metres(m)));
            }
        }
        lines.push(("plane's slope".into(), format!("{} a texel", metres(self.slope_m))));
        lines.push(("depth's step".into(), metres(self.step_m)));
        if self.reach > 0.0 {
            lines.push(("filter reaches".into(), format!("{} texels", number(self.reach))));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    /// A map's next number lies a step farther, of every format and kind of depth.
    #[test]
    fn a_step_is_the_distance_of_two_numbers() {
        let [near, far] = [2.0f64, 50.0];
        for perspective in [0, 1] {
            // As `stored_depth` in WGSL, and backwards.
            let stored = |d: f64| {
                let even = (far - d) / (far - near);
                if perspective == 1 { even * near / d } else { even }
            };
            let depth = |s: f64| {
                if perspective == 1 { far * near / (near + s * (far - near)) } else { far - s * (far - near) }
            };
            for d in [2.5, 7.0, 20.0, 49.0] {
                assert!((depth(stored(d)) - d).abs() < 1e-9);
                let looked =
                    Looked { near: near as f32, far: far as f32, compared: d as f32, perspective, ..Looked::zeroed() };
                for (format, next) in [
                    ("16", 1.0 / 65536.0),
                    ("24", 1.0 / 16777216.0),
                    ("32f", f64::from((stored(d) as f32).next_up()) - f64::from(stored(d) as f32)),
                ] {
                    let mut setup = Setup::open("cubes").unwrap().0;
                    setup.select("shadow-map").unwrap();
                    setup.set(&format!("format={format}"), &["shadow-map".into()]).unwrap();
                    let exact = (depth(stored(d)) - depth(stored(d) + next)).abs();
                    let told = f64::from(step(&looked, &setup));
                    assert!((told / exact - 1.0).abs() < 1e-3, "{perspective} {d} {format}: {told} for {exact}");
                }
            }
        }
    }
}
