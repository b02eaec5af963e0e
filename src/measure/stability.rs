//! Error and flicker along a path of camera, light or parameter.

use super::metrics::FACING;
use super::{params_text, timing};
use crate::frame::{Ask, Made, Renderer, Truth};
use crate::scene::{Camera, Scene};
use crate::setup::Setup;
use crate::techniques;
use crate::truth::Samples;
use anyhow::{Result, ensure};
use glam::{Mat4, Vec4};
use rayon::prelude::*;

/// The built-in cases, in the order of the lists.
pub use crate::scene::builtin::CASES;

/// A scene with a path on which some techniques fail.
pub struct Case {
    /// Also the name of its scene.
    pub id: &'static str,
    /// What it provokes and in which techniques, a sentence.
    pub doc: &'static str,
    /// What runs along the path, with its unit: `sun elevation, °`.
    pub axis: &'static str,
    /// The value of `axis` at t, 0 to 1.
    pub value: fn(f32) -> f32,
    /// Moves a set-up of the case's scene to t.
    pub place: fn(&mut Setup, f32),
    /// Frames that the path has by default.
    pub frames: usize,
    /// Makes the scene, which starts as it is placed at 0.
    pub build: fn() -> Scene,
}

/// Pixels of the pictures that the cases are counted in by default, the same on every adapter.
pub const SIZE: [u32; 2] = [256, 256];

/// A case by id.
pub fn find(id: &str) -> Option<&'static Case> {
    CASES.iter().find(|c| c.id == id)
}

/// One frame of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Point {
    pub t: f32,
    /// What runs along the path, in its unit.
    pub value: f32,
    /// Wrong pixels as a share of those that face the light.
    pub error_share: f64,
    /// Shares of the pixels seen in this frame and the last whose label changed: the technique's, the truth's, and the
    /// technique's where the truth's did not. None in the first frame, and where no pixel is seen twice.
    pub changes: Option<f64>,
    pub truth_changes: Option<f64>,
    pub flicker: Option<f64>,
}

/// A technique along a path.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Track {
    pub technique: String,
    pub params: String,
    pub points: Vec<Point>,
}

impl Track {
    /// The frame with the largest error, the first of several.
    pub fn worst(&self) -> Option<&Point> {
        self.points.iter().reduce(|a, b| if b.error_share > a.error_share { b } else { a })
    }

    /// Mean of a figure over the frames that have it.
    pub fn mean(&self, of: fn(&Point) -> Option<f64>) -> Option<f64> {
        let all: Vec<f64> = self.points.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }

    /// Largest of a figure over the frames that have it.
    pub fn max(&self, of: fn(&Point) -> Option<f64>) -> Option<f64> {
        self.points.iter().filter_map(of).max_by(f64::total_cmp)
    }
}

/// What was found on a path.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Stability {
    pub case: String,
    pub axis: String,
    pub width: u32,
    pub height: u32,
    pub tracks: Vec<Track>,
    /// Techniques that do not serve the light, and why.
    pub left_out: Vec<(String, String)>,
}

/// A technique on its way along a path, with what it said of the last frame.
struct Lane {
    setup: Setup,
    made: Option<Made>,
    labels: Vec<bool>,
    track: Track,
}

/// Runs the techniques (with the set-up's parameters) along a case's path of `frames` frames. `watch` is told the share
/// done, and stops the work by saying no.
///
/// # Errors
/// What the device reports, or that it was stopped.
pub fn run(
    renderer: &mut Renderer,
    case: &Case,
    setup: &Setup,
    techniques: &[String],
    frames: usize,
    watch: &mut dyn FnMut(f32) -> bool,
) -> Result<Stability> {
    // A technique's own map would need that technique.
    let mut start = Setup { view: "shaded".into(), truth_samples: Samples::Fixed(1), ..setup.clone() };
    (case.place)(&mut start, 0.0);
    let [width, height] = setup.size;
    let mut found = Stability { case: case.id.into(), axis: case.axis.into(), width, height, ..Stability::default() };
    let mut lanes = Vec::new();
    for id in techniques {
        let info = techniques::find_or_say(id)?;
        if let Some(reason) = info.refuses(&start.light) {
            found.left_out.push((id.clone(), reason));
        } else if let Some(reason) = techniques::TRUTH.refuses(&start.light) {
            found.left_out.push((id.clone(), format!("there is no truth to compare with: {reason}")));
        } else {
            let mut setup = start.clone();
            setup.select(id)?;
            let track = Track { technique: id.clone(), params: params_text(setup.values()), points: Vec::new() };
            lanes.push(Lane { setup, made: None, labels: Vec::new(), track });
        }
    }
    let mut last: Option<Seen> = None;
    for k in 0..frames {
        let t = if frames > 1 { k as f32 / (frames - 1) as f32 } else { 0.0 };
        // The techniques see the same surfaces and the same truth, which is traced with the first of them.
        let mut seen: Option<(Seen, Vec<Option<usize>>)> = None;
        for (i, lane) in lanes.iter_mut().enumerate() {
            (case.place)(&mut lane.setup, t);
            renderer.exchange(&mut lane.made);
            let drawn = draw(renderer, &lane.setup);
            renderer.exchange(&mut lane.made);
            let labels = drawn?;
            let (now, same) = match &seen {
                Some(seen) => seen,
                None => {
                    let now = Seen::read(renderer, &lane.setup)?;
                    let same = last.as_ref().map(|last| reproject(&now, last)).unwrap_or_default();
                    seen.insert((now, same))
                }
            };
            let mut point = Point { t, value: (case.value)(t), error_share: now.error(&labels), ..Point::default() };
            if let Some(last) = &last
                && let Some(changed) = changes(same, [&labels, &now.truth], [&lane.labels, &last.truth])
            {
                point.changes = Some(changed[0]);
                point.truth_changes = Some(changed[1]);
                point.flicker = Some(changed[2]);
            }
            lane.track.points.push(point);
            lane.labels = labels;
            let part = (i + 1) as f32 / techniques.len() as f32;
            ensure!(watch((k as f32 + part) / frames as f32), timing::STOPPED);
        }
        last = seen.map(|(seen, _)| seen);
    }
    found.tracks = lanes.into_iter().map(|lane| lane.track).collect();
    Ok(found)
}

/// Frames that [`flicker`] compares with the one before.
const STEPS: usize = 16;
/// How far the camera moves between them, in pixels at the distance of its target. Not a simple fraction, so that a
/// pixel's samples fall ever elsewhere.
const STEP: f32 = 0.37;

/// Mean flicker of a set-up whose camera moves sideways by 0.37 pixels at its target's distance, sixteen times; None if
/// no pixel is seen twice.
///
/// # Errors
/// A light that the technique or the truth does not serve, or what the device reports.
pub fn flicker(renderer: &mut Renderer, setup: &Setup) -> Result<Option<f64>> {
    techniques::find_or_say(&setup.technique)?.serve(&setup.light)?;
    techniques::TRUTH.serve(&setup.light)?;
    let camera = setup.camera;
    let right = camera.view().row(0).truncate();
    let step = right * STEP * pixel_at_one_metre(&camera, setup.size) * camera.position.distance(camera.target);
    let mut last: Option<(Seen, Vec<bool>)> = None;
    let mut shares = Vec::new();
    for k in 0..=STEPS {
        let by = step * k as f32;
        let camera = Camera { position: camera.position + by, target: camera.target + by, ..camera };
        let setup = Setup { camera, view: "shaded".into(), truth_samples: Samples::Fixed(1), ..setup.clone() };
        let labels = draw(renderer, &setup)?;
        let now = Seen::read(renderer, &setup)?;
        if let Some((last, before)) = &last {
            let changed = changes(&reproject(&now, last), [&labels, &now.truth], [before, &last.truth]);
            shares.extend(changed.map(|c| c[2]));
        }
        last = Some((now, labels));
    }
    Ok((!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64))
}

/// Side of the square that a pixel covers on a plane across the view, metres a metre of depth.
fn pixel_at_one_metre(camera: &Camera, size: [u32; 2]) -> f32 {
    2.0 * (camera.fov.to_radians() / 2.0).tan() / size[1] as f32
}

/// Draws a set-up with its truth; each pixel's label: lit or not.
fn draw(renderer: &mut Renderer, setup: &Setup) -> Result<Vec<bool>> {
    renderer.render(
        setup,
        Ask { size: setup.size, truth: Truth::All, analysis: false, timed: false, picture: false, fresh: false },
    )?;
    Ok(labels(&renderer.read_visibility()?))
}

fn labels(visibility: &[f32]) -> Vec<bool> {
    visibility.iter().map(|v| *v >= 0.5).collect()
}

/// What of a frame does not depend on the technique. A value a pixel, rows from the top.
struct Seen {
    /// World to clip space.
    view_proj: Mat4,
    size: [u32; 2],
    /// Side of a pixel's square on a plane across the view, metres a metre of depth.
    pixel: f32,
    /// World position, and depth along the camera's axis.
    position: Vec<Vec4>,
    triangle: Vec<u32>,
    /// Whether the surface faces the light.
    facing: Vec<bool>,
    /// Whether it is lit in truth.
    truth: Vec<bool>,
}

impl Seen {
    /// Reads the renderer's last frame, which was of this set-up.
    fn read(renderer: &mut Renderer, setup: &Setup) -> Result<Seen> {
        let size = setup.size;
        Ok(Seen {
            view_proj: setup.camera.projection(size[0] as f32 / size[1] as f32) * setup.camera.view(),
            size,
            pixel: pixel_at_one_metre(&setup.camera, size),
            position: renderer.read_position()?.into_iter().map(Vec4::from).collect(),
            triangle: renderer.read_surface()?.into_iter().map(|s| s[3]).collect(),
            facing: renderer.read_mask()?.into_iter().map(|m| m == FACING).collect(),
            truth: labels(&renderer.read_hard_truth()?),
        })
    }

    /// Share of the pixels facing the light that are labelled wrongly.
    fn error(&self, labels: &[bool]) -> f64 {
        let (facing, wrong) = (0..labels.len())
            .into_par_iter()
            .filter(|i| self.facing[*i])
            .map(|i| (1usize, (labels[i] != self.truth[i]) as usize))
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        wrong as f64 / facing.max(1) as f64
    }
}

/// How far apart, in pixels' squares, two points of one triangle may lie and count as one. The nearest pixel's sample is
/// at most 0.71 pixels away, which on a surface seen at less than about 5° is farther than this.
const APART: f32 = 8.0;
/// The same of points on different triangles: meshes may be finer than pixels.
const APART_ACROSS: f32 = 1.5;

/// For each pixel of a frame that faces the light the pixel of the last frame that shows the same point of the surface:
/// the nearest to where the last camera saw it, if that shows a point close by that faces the light too.
fn reproject(now: &Seen, last: &Seen) -> Vec<Option<usize>> {
    let [width, height] = last.size.map(|s| s as f32);
    (0..now.position.len())
        .into_par_iter()
        .map(|i| {
            if !now.facing[i] {
                return None;
            }
            let clip = last.view_proj * now.position[i].truncate().extend(1.0);
            let (x, y) = ((0.5 + 0.5 * clip.x / clip.w) * width, (0.5 - 0.5 * clip.y / clip.w) * height);
            let inside = clip.w > 0.0 && x >= 0.0 && x < width && y >= 0.0 && y < height;
            let j = if inside { y as usize * last.size[0] as usize + x as usize } else { return None };
            let apart = now.position[i].truncate().distance(last.position[j].truncate());
            let most = if last.triangle[j] == now.triangle[i] { APART } else { APART_ACROSS };
            (last.facing[j] && apart <= most * last.pixel * last.position[j].w).then_some(j)
        })
        .collect()
}

/// Of the pixels seen in both frames the shares whose label changed: the technique's, the truth's, and the technique's
/// where the truth's did not. `now` and `last` hold the technique's labels and the truth's. None: no pixel is seen twice.
fn changes(same: &[Option<usize>], now: [&[bool]; 2], last: [&[bool]; 2]) -> Option<[f64; 3]> {
    let count = |i: usize, j: usize| {
        let [own, truth] = [0, 1].map(|k| now[k][i] != last[k][j]);
        [1, own as usize, truth as usize, (own && !truth) as usize]
    };
    let [both, own, truth, flicker] = same
        .par_iter()
        .enumerate()
        .filter_map(|(i, j)| Some(count(i, (*j)?)))
        .reduce(|| [0; 4], |a, b| [0, 1, 2, 3].map(|k| a[k] + b[k]));
    (both > 0).then(|| [own, truth, flicker].map(|n| n as f64 / both as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec4;

    const SIZE: [u32; 2] = [6, 2];

    /// A wall across the view, two units wide and high, as a camera sees it that stands `aside` pixels to the right.
    fn seen(aside: usize) -> Seen {
        let [w, h] = SIZE.map(|s| s as f32);
        let shift = aside as f32 * 2.0 / w;
        let point = |i: usize| {
            let (x, y) = (i % SIZE[0] as usize, i / SIZE[0] as usize);
            vec4((x as f32 + 0.5) / w * 2.0 - 1.0 + shift, 1.0 - (y as f32 + 0.5) / h * 2.0, 0.0, 1.0)
        };
        Seen {
            view_proj: Mat4::from_translation(glam::vec3(-shift, 0.0, 0.0)),
            size: SIZE,
            pixel: 2.0 / w,
            position: (0..12).map(point).collect(),
            triangle: vec![7; 12],
            facing: vec![true; 12],
            truth: vec![true; 12],
        }
    }

    #[test]
    fn points_are_found_where_the_last_camera_saw_them() {
        let (last, mut now) = (seen(0), seen(2));
        // What the camera, two pixels farther right, sees in column x stood in column x + 2.
        let moved = [Some(2), Some(3), Some(4), Some(5), None, None, Some(8), Some(9), Some(10), Some(11), None, None];
        assert_eq!(reproject(&now, &last), moved);
        now.facing[0] = false;
        // Another triangle at the same place is the next facet of a fine mesh; farther away it is another thing.
        now.triangle[0] = 8;
        now.triangle[1] = 8;
        now.position[1].z = 0.6;
        let mut last = last;
        last.facing[4] = false;
        last.position[5].z = -100.0;
        let kept = [None, None, None, None, None, None, Some(8), Some(9), Some(10), Some(11), None, None];
        assert_eq!(reproject(&now, &last), kept);
        // Behind the last camera nothing was seen.
        last.view_proj = Mat4::from_cols_array(&[1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., -1.]);
        assert!(reproject(&now, &last).iter().all(Option::is_none));
    }

    #[test]
    fn flicker_equals_a_hand_count() {
        let same = [Some(1), Some(2), None, Some(3), Some(0)];
        let now = [true, true, false, false, true];
        let last = [false, true, false, true, true];
        // Pixels 0, 1, 3 and 4 are seen twice. The technique: true/true, true/false, false/true, true/false: three change.
        let truth_now = [true, true, true, false, true];
        let truth_last = [true, true, true, true, true];
        // The truth: true/true, true/true, false/true, true/true: one changes, where the technique's does too.
        let found = changes(&same, [&now, &truth_now], [&last, &truth_last]);
        assert_eq!(found, Some([0.75, 0.25, 0.5]));
        assert_eq!(changes(&[None, None], [&now, &truth_now], [&last, &truth_last]), None);
    }

    #[test]
    fn errors_count_only_what_faces_the_light() {
        let mut seen = seen(0);
        seen.facing[0] = false;
        seen.facing[1] = false;
        let mut labels = vec![true; 12];
        labels[0] = false;
        labels[2] = false;
        assert_eq!(seen.error(&labels), 0.1);
    }
}
