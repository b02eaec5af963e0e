//! Navratil 2015, section 3.3: cubes and paraboloids around lights that shine in all directions, and how much of them is drawn.

use super::{Bench, holds, short, with};
use crate::frame::{Ask, Renderer};
use crate::light::Light;
use crate::measure::table;
use crate::measure::timing::{self, Times};
use crate::scene::builtin::crowd;
use crate::setup::Setup;
use anyhow::{Context, Result};
use glam::{Vec3, vec3};
use std::sync::Arc;

/// A row of his tables: his name, ours, and his frames a second at 1024² texels in tables 3.1 and 3.2.
pub struct Method {
    pub name: &'static str,
    pub technique: &'static str,
    culling: &'static str,
    rates: Option<[f64; 2]>,
}

const fn method(name: &'static str, technique: &'static str, culling: &'static str, rates: Option<[f64; 2]>) -> Method {
    Method { name, technique, culling, rates }
}

/// The unoptimised cube first. What he did not have is last.
pub const METHODS: [Method; 8] = [
    method("Cube6", "cube", "none", Some([75.71, 19.11])),
    method("Cube6Optim", "cube", "casters", Some([150.43, 57.15])),
    method("Cube6Opt+EFC", "cube", "view", Some([188.71, 127.47])),
    method("DP", "dual-paraboloid", "none", Some([167.95, 41.50])),
    method("DPOptim", "dual-paraboloid", "casters", Some([207.24, 57.47])),
    method("DPOptim+PC", "dual-paraboloid", "view", Some([208.15, 90.56])),
    method("cube, by samples", "cube", "samples", None),
    method("dual paraboloid, by samples", "dual-paraboloid", "samples", None),
];

impl Method {
    /// The set-up with it. His paraboloids move corners only, and have fine casters.
    pub fn apply(&self, start: &Setup, resolution: u32) -> Result<Setup> {
        let mut sets = vec![format!("resolution={resolution}"), format!("culling={}", self.culling)];
        if self.technique != "cube" {
            sets.push("raster=linear".into());
        }
        with(start, self.technique, &sets.iter().map(String::as_str).collect::<Vec<_>>())
    }
}

/// Pixels of the pictures.
pub const SIZE: [u32; 2] = [480, 270];

/// A light at a place.
pub fn lamp(position: Vec3, range: f32) -> Light {
    Light::Omni { position, range, radius: 0.0, color: Vec3::splat(12.0) }
}

/// A crowd of so many vertices, and the set-up that it starts with. The scene opened last is let go of first.
pub fn crowd_of(b: &mut Bench, vertices: usize) -> Result<(Renderer, Setup)> {
    b.open = None;
    let scene = crowd::build(vertices);
    let start = Setup { size: SIZE, ..Setup::new("crowd", &scene)? };
    Ok((Renderer::new(b.gpu.clone(), Arc::new(scene))?, start))
}

/// A built-in scene from one of its cameras, under one of its lights or the one that it starts with.
pub fn placed(b: &mut Bench, scene: &str, camera: &str, light: Option<&str>) -> Result<Setup> {
    let (renderer, start) = b.open(scene)?;
    let mut start = Setup { size: SIZE, ..start };
    let all = renderer.scene();
    let found = all.cameras.iter().find(|c| c.name == camera);
    start.camera = found.with_context(|| format!("{scene} has no camera {camera}"))?.camera;
    if let Some(light) = light {
        let found = all.lights.iter().find(|l| l.name == light);
        start.light = found.with_context(|| format!("{scene} has no light {light}"))?.light;
    }
    Ok(start)
}

/// The passes of a name, milliseconds; those of masked casters too.
pub fn pass_ms(t: &Times, name: &str) -> f64 {
    t.passes.iter().filter(|(n, _)| n.starts_with(name)).map(|(_, q)| q.median).sum()
}

/// The technique's passes but for the look-up, milliseconds.
pub fn map_ms(t: &Times) -> f64 {
    let own = |name: &str| !crate::frame::SHARED_PASSES.contains(&name) && name != "resolve";
    t.passes.iter().filter(|(name, _)| own(name)).map(|(_, q)| q.median).sum()
}

/// The whole frame without the picture: the G-buffer and the technique's passes.
pub fn frame_ms(t: &Times) -> f64 {
    pass_ms(t, "G-buffer") + t.gpu.median
}

/// Maps that a frame draws.
pub fn maps_drawn(renderer: &mut Renderer, setup: &Setup) -> Result<usize> {
    renderer.render(setup, Ask { picture: false, truth: crate::frame::Truth::Off, ..Ask::of(setup) })?;
    Ok(renderer.known()?.faces.iter().flatten().count())
}

pub fn told(b: &Bench, setup: &Setup, times: &[Times]) -> String {
    let frames = times.iter().map(|t| t.gpu.frames).min().unwrap_or(0);
    let software = if b.gpu.software() { " Software: compare ratios only." } else { "" };
    let [w, h] = setup.size;
    format!("{w} × {h} pixels, {}; medians of {frames} frames or more, taking turns.{software}\n", b.gpu.info.name)
}

/// Where the light of tables 3.1 and 3.2 stands: behind the camera, so that it sees as the camera does, and in the camera's view.
const PLACES: [Vec3; 2] = [vec3(-19.6, 4.9, 0.0), vec3(0.0, 4.9, 0.0)];

/// Tables 3.1 and 3.2: two scenes, each with every method, as ratios to the unoptimised cube.
pub fn rates(b: &mut Bench) -> Result<String> {
    const VERTICES: [usize; 2] = [600_000, 3_000_000];
    let mut frames = [[0.0; METHODS.len()]; 2];
    let mut maps = [[0usize; PLACES.len()]; METHODS.len()];
    let mut parts = [[[0.0; 3]; METHODS.len()]; 2];
    let (mut told_of, mut drawn_vertices) = (String::new(), [0; 2]);
    for (i, vertices) in VERTICES.into_iter().enumerate() {
        let (mut renderer, mut start) = crowd_of(b, vertices)?;
        drawn_vertices[i] = 3 * renderer.scene().triangles();
        for (place, at) in PLACES.into_iter().enumerate() {
            b.done(i * PLACES.len() + place, VERTICES.len() * PLACES.len());
            start.light = lamp(at, 60.0);
            let setups: Vec<Setup> = METHODS.iter().map(|m| m.apply(&start, 1024)).collect::<Result<_>>()?;
            let times = timing::briefly(&mut renderer, &setups, 2)?;
            // The same for all: its mean, so that it does not blur what differs.
            let g_buffer = times.iter().map(|t| pass_ms(t, "G-buffer")).sum::<f64>() / times.len() as f64;
            for (m, setup) in setups.iter().enumerate() {
                let t = &times[m];
                frames[i][m] += (g_buffer + t.gpu.median) / PLACES.len() as f64;
                let ms = [g_buffer, pass_ms(t, "caster culling"), pass_ms(t, "shadow maps")];
                parts[i][m].iter_mut().zip(ms).for_each(|(sum, ms)| *sum += ms / PLACES.len() as f64);
                // As many of either scene.
                if i == 0 {
                    maps[m][place] = maps_drawn(&mut renderer, setup)?;
                }
            }
            told_of = told(b, &start, &times);
        }
    }
    let head = ["method", "3.1: his", "ours", "3.2: his", "ours", "maps drawn, behind / in view", "maps, MB"];
    let mut rows = vec![head.map(String::from).to_vec()];
    let head = ["3.2, ms", "G-buffer", "culling", "drawing the maps", "frame"];
    let mut spent = vec![head.map(String::from).to_vec()];
    for (m, method) in METHODS.iter().enumerate() {
        let mut row = vec![method.name.to_string()];
        for i in 0..2 {
            row.push(method.rates.map_or("-".into(), |r| format!("{:.2}", r[i] / METHODS[0].rates.unwrap_or(r)[i])));
            row.push(format!("{:.2}", frames[i][0] / frames[i][m]));
        }
        let [behind, seen] = maps[m];
        row.push(format!("{behind} / {seen}"));
        let layers = if method.technique == "cube" { 6 } else { 2 };
        row.push(format!("{}", layers * 4));
        rows.push(row);
        let cells = parts[1][m].iter().chain([&frames[1][m]]).map(|ms| short(*ms));
        spent.push([method.name.to_string()].into_iter().chain(cells).collect());
    }
    // As fast, within the twentieth that times of so few frames vary by.
    let order = |[a, b]: [f64; 2]| b <= 1.05 * a;
    let frame = |i: usize, [a, b]: [usize; 2]| order([frames[i][a], frames[i][b]]);
    let both = |pairs: &[[usize; 2]]| holds((0..2).all(|i| pairs.iter().all(|pair| frame(i, *pair))));
    let drawing = |pairs: &[[usize; 2]]| {
        holds((0..2).all(|i| pairs.iter().all(|[a, b]| order([parts[i][*a][2], parts[i][*b][2]]))))
    };
    let skipped = 6 - maps[2][0];
    Ok(format!(
        "{told_of}Maps of 1024²; {} and {} vertices; means of two places of the light, behind the camera and in its view. Frames a \
         second over those of the unoptimised cube:\n\n{}\n{}\n\
         - Each step of culling makes drawing the maps faster: {} of the cube, {} of paraboloids.\n\
         - It makes whole frames faster: {} of the cube, {} of paraboloids.\n\
         - Unoptimised, two paraboloids are faster than six faces: {}.\n\
         - With all culled paraboloids are a little faster than the cube with fewer vertices, and slower with more: {}.\n\
         - Face culling skips {skipped} of six faces where the light stands behind the camera, {} of what the cube draws; plane \
         clipping one side of two.\n\
         - Two paraboloids take a third of the cube's memory at the same side.\n",
        drawn_vertices[0],
        drawn_vertices[1],
        table::markdown(&rows),
        table::markdown(&spent),
        drawing(&[[0, 1], [1, 2]]),
        drawing(&[[3, 4], [4, 5]]),
        both(&[[0, 1], [1, 2]]),
        both(&[[3, 4], [4, 5]]),
        both(&[[0, 3]]),
        holds(frame(0, [2, 5]) && frame(1, [5, 2])),
        format_args!("{:.0} %", 100.0 * skipped as f64 / 6.0),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Gpu;

    /// Behind the camera one face and one side are enough; in its view all are drawn.
    #[test]
    fn the_places_of_the_tables_need_one_map_and_all() {
        let scene = crowd::build(12_000);
        let mut start = Setup { size: [96, 54], ..Setup::new("crowd", &scene).unwrap() };
        let mut renderer = Renderer::new(Arc::new(Gpu::new(None).unwrap()), Arc::new(scene)).unwrap();
        let mut drawn = |method: &Method, at: Vec3| {
            start.light = lamp(at, 60.0);
            maps_drawn(&mut renderer, &method.apply(&start, 64).unwrap()).unwrap()
        };
        assert_eq!([&METHODS[2], &METHODS[5]].map(|m| PLACES.map(|at| drawn(m, at))), [[1, 6], [1, 2]]);
        assert_eq!(PLACES.map(|at| drawn(&METHODS[0], at)), [6, 6]);
    }
}
