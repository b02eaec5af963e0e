//! Error, flicker and cost along a path of camera, light or parameter.

use super::metrics::FACING;
use super::path_cost::{self, Cost};
use super::path_figures::Figure;
use super::{params_text, timing};
use crate::chart::{self, Lines};
use crate::frame::{Ask, History, Made, Renderer};
use crate::path::Route;
use crate::scene::Camera;
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Result, ensure};
use glam::{Mat4, Vec4};
use rayon::prelude::*;

/// Pixels of the pictures that the cases are counted in by default, the same on every adapter.
pub const SIZE: [u32; 2] = [256, 256];

/// One frame of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Point {
    pub t: f32,
    /// What runs along the path, in its unit.
    pub value: f32,
    /// Wrong pixels as a share of those that face the light, within its cone and range.
    pub error_share: f64,
    /// What changed since the last frame. None in the first one, and where no pixel is seen twice.
    #[serde(flatten)]
    pub change: Option<Change>,
    /// What the frame costs, where that was asked for.
    #[serde(flatten)]
    pub cost: Option<Cost>,
}

impl Point {
    /// What the technique changes beyond the truth: [`Change::flicker`].
    pub fn flicker(&self) -> Option<f64> {
        self.change.map(|c| c.flicker)
    }
}

/// What changed from one frame to the next, over the pixels seen in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Change {
    /// Mean size of the change: of the technique's visibility, of the truth, and of the first beyond the second.
    pub change: f64,
    pub truth_change: f64,
    pub flicker: f64,
    /// Shares of the pixels whose label changed: the technique's, the truth's, and the technique's where the truth's did
    /// not.
    pub label_changes: f64,
    pub truth_label_changes: f64,
    pub label_flicker: f64,
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

/// What is to be found on a path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Techniques by their ids.
    pub techniques: Vec<String>,
    /// Frames along the path.
    pub frames: usize,
    /// Also what each frame costs. It takes its time: every frame is rendered four times more.
    pub cost: bool,
}

/// What was found on a path.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Stability {
    pub case: String,
    pub axis: String,
    pub width: u32,
    pub height: u32,
    pub adapter: String,
    /// The adapter is a program on the CPU: its times say nothing of a GPU's.
    pub software: bool,
    pub tracks: Vec<Track>,
    /// Techniques that do not serve the light, and why.
    pub left_out: Vec<(String, String)>,
}

impl Stability {
    /// Whether a figure is known anywhere on the path.
    pub fn has(&self, figure: Figure) -> bool {
        self.tracks.iter().flat_map(|t| &t.points).any(|p| figure.of(p).is_some())
    }
}

/// A figure along a path as a chart.
pub fn lines(found: &Stability, figure: Figure) -> Lines {
    let line = |track: &Track| {
        let points = track.points.iter().map(|p| (p.value as f64, figure.of(p).unwrap_or(f64::NAN)));
        (track.technique.clone(), chart::mark(&track.technique), points.collect())
    };
    Lines {
        title: format!("{}: {} along the path", found.case, figure.name()),
        x: found.axis.clone(),
        y: figure.axis(found.software).into(),
        log_y: false,
        lines: found.tracks.iter().map(line).collect(),
    }
}

/// What was found on paths as CSV: a row a frame.
pub struct Table {
    writer: csv::Writer<Vec<u8>>,
}

impl Table {
    pub fn new() -> Result<Table> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let names = ["case", "technique", "params", "axis", "t", "value"];
        let of_labels = ["label_changes", "truth_label_changes", "label_flicker"];
        let figures = ["error_share", "change", "truth_change", "flicker"];
        let cost = ["passes", "layers", "layers_drawn", "triangles", "ms", "software"];
        writer.write_record(names.iter().chain(&figures).chain(&of_labels).chain(&cost))?;
        Ok(Table { writer })
    }

    pub fn add(&mut self, found: &Stability) -> Result<()> {
        for Track { technique, params, points } in &found.tracks {
            for Point { t, value, error_share, change, cost } in points {
                let change = change.map(|c| c.figures().map(Some)).unwrap_or_default();
                let place = (t, value, error_share, change);
                let layers = cost.and_then(|c| c.layers);
                let layers = (layers.map(|l| l.layers), layers.map(|l| l.layers_drawn));
                let times = (cost.map(|c| c.ms), cost.map(|_| found.software));
                let cost = (cost.map(|c| c.passes), layers, cost.and_then(|c| c.triangles), times);
                self.writer.serialize((&found.case, technique, params, &found.axis, place, cost))?;
            }
        }
        Ok(())
    }

    /// The text.
    pub fn finish(self) -> Result<Vec<u8>> {
        self.writer.into_inner().context("the table of points cannot be put together")
    }
}

/// A technique on its way along a path, with the last frame.
struct Lane {
    setup: Setup,
    made: Option<Made>,
    last: Shadow,
    track: Track,
}

/// Runs techniques (with the set-up's parameters) along a path. `watch` is told the share done, and stops the work by saying
/// no.
///
/// # Errors
/// What the device reports, or that it was stopped.
pub fn run(
    renderer: &mut Renderer,
    route: &Route,
    setup: &Setup,
    Run { techniques, frames, cost }: &Run,
    watch: &mut dyn FnMut(f32) -> bool,
) -> Result<Stability> {
    let errors_part = if *cost { 0.4 } else { 1.0 };
    // A technique's own map would need that technique.
    let mut start = setup.measured();
    route.place(&mut start, 0.0);
    let [width, height] = setup.size;
    let mut found = Stability {
        case: route.id().into(),
        axis: route.axis().into(),
        width,
        height,
        adapter: renderer.gpu.info.name.clone(),
        software: renderer.gpu.software(),
        ..Stability::default()
    };
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
            let track = Track { technique: id.clone(), params: params_text(&setup), points: Vec::new() };
            lanes.push(Lane { setup, made: None, last: Shadow::default(), track });
        }
    }
    let mut last: Option<Seen> = None;
    let places: Vec<f32> = (0..*frames).map(|k| k as f32 / frames.saturating_sub(1).max(1) as f32).collect();
    for (k, t) in places.iter().copied().enumerate() {
        // The techniques see the same surfaces and the same hard truth, which is traced with the first of them.
        let mut seen: Option<(Seen, Vec<Option<usize>>)> = None;
        for (i, lane) in lanes.iter_mut().enumerate() {
            route.place(&mut lane.setup, t);
            renderer.exchange(&mut lane.made);
            let drawn = draw(renderer, &lane.setup, k == 0);
            renderer.exchange(&mut lane.made);
            let shadow = drawn?;
            let (now, same) = match &seen {
                Some(seen) => seen,
                None => {
                    let now = Seen::read(renderer, &lane.setup)?;
                    let same = last.as_ref().map(|last| reproject(&now, last)).unwrap_or_default();
                    seen.insert((now, same))
                }
            };
            let change = last.as_ref().and_then(|last| change(same, [&shadow, &lane.last], [&now.hard, &last.hard]));
            let error_share = now.error(&shadow.visibility);
            lane.track.points.push(Point { t, value: route.value(t), error_share, change, cost: None });
            lane.last = shadow;
            let part = (i + 1) as f32 / techniques.len() as f32;
            ensure!(watch(errors_part * (k as f32 + part) / *frames as f32), timing::STOPPED);
        }
        last = seen.map(|(seen, _)| seen);
    }
    let number = lanes.len() as f32;
    for (i, lane) in lanes.iter_mut().enumerate().filter(|_| *cost) {
        renderer.exchange(&mut lane.made);
        let costs = path_cost::along(renderer, route, &lane.setup, &places, &mut |done| {
            watch(errors_part + (1.0 - errors_part) * (i as f32 + done) / number)
        });
        renderer.exchange(&mut lane.made);
        lane.track.points.iter_mut().zip(costs?).for_each(|(point, cost)| point.cost = Some(cost));
    }
    found.tracks = lanes.into_iter().map(|lane| lane.track).collect();
    Ok(found)
}

/// Frames that [`flicker`] compares with the one before.
const STEPS: usize = 16;
/// How far the camera moves between them, in pixels at the distance of its target. Not a simple fraction, so that a
/// pixel's samples fall ever elsewhere.
const STEP: f32 = 0.37;

/// What changes of a set-up whose camera moves sideways by 0.37 pixels at its target's distance, sixteen times: the mean
/// over the steps; None if no pixel is seen twice.
///
/// # Errors
/// A light that the technique or the truth does not serve, or what the device reports.
pub fn flicker(renderer: &mut Renderer, setup: &Setup) -> Result<Option<Change>> {
    let mut steps = Vec::new();
    for one in setup.each_light()? {
        steps.extend(flicker_steps(renderer, &one)?);
    }
    Ok(Change::mean(&steps))
}

/// What changes from step to step for the light at work.
fn flicker_steps(renderer: &mut Renderer, setup: &Setup) -> Result<Vec<Change>> {
    techniques::find_or_say(&setup.technique)?.serve(&setup.light)?;
    techniques::TRUTH.serve(&setup.light)?;
    let camera = setup.camera;
    let right = camera.view().row(0).truncate();
    let step = right * STEP * pixel_at(&camera, setup.size, camera.position.distance(camera.target));
    let mut last: Option<(Seen, Shadow)> = None;
    let mut steps = Vec::new();
    for k in 0..=STEPS {
        let by = step * k as f32;
        let camera = Camera { position: camera.position + by, target: camera.target + by, ..camera };
        let setup = Setup { camera, ..setup.clone() };
        let shadow = draw(renderer, &setup, k == 0)?;
        let now = Seen::read(renderer, &setup)?;
        if let Some((last, before)) = &last {
            steps.extend(change(&reproject(&now, last), [&shadow, before], [&now.hard, &last.hard]));
        }
        last = Some((now, shadow));
    }
    Ok(steps)
}

/// Side of the square that a pixel covers on a plane across the view at a depth, metres.
fn pixel_at(camera: &Camera, size: [u32; 2], depth: f32) -> f32 {
    camera.height_at(depth) / size[1] as f32
}

/// What a technique says of a frame, and what is true, a number per pixel: the truth that the set-up names, or else of one
/// sample per pixel for techniques that say lit or dark, and averaged for those that filter.
#[derive(Default)]
struct Shadow {
    visibility: Vec<f32>,
    truth: Vec<f32>,
}

/// Draws a set-up with its truth. `first`: no frame goes before it that the technique could average with.
fn draw(renderer: &mut Renderer, setup: &Setup, first: bool) -> Result<Shadow> {
    let history = if first { History::Whole } else { History::Goes };
    // A view of one light: that at work.
    let setup = &Setup { view: "visibility".into(), ..setup.clone() };
    renderer.render(setup, Ask { picture: false, history, ..Ask::of(setup) })?;
    Ok(Shadow { visibility: renderer.read_visibility()?, truth: renderer.read_truth()? })
}

/// A pixel's label.
fn lit(visibility: f32) -> bool {
    visibility >= 0.5
}

/// What of a frame does not depend on the technique. A value a pixel, rows from the top.
struct Seen {
    /// World to clip space.
    view_proj: Mat4,
    size: [u32; 2],
    camera: Camera,
    /// World position, and depth along the camera's axis.
    position: Vec<Vec4>,
    triangle: Vec<u32>,
    /// Whether the surface faces the light.
    facing: Vec<bool>,
    /// The truth of one sample per pixel.
    hard: Vec<f32>,
}

impl Seen {
    /// Reads the renderer's last frame, which was of this set-up.
    fn read(renderer: &mut Renderer, setup: &Setup) -> Result<Seen> {
        let size = setup.size;
        Ok(Seen {
            view_proj: setup.camera.projection(size[0] as f32 / size[1] as f32) * setup.camera.view(),
            size,
            camera: setup.camera,
            position: renderer.read_position()?.into_iter().map(Vec4::from).collect(),
            triangle: renderer.read_surface()?.into_iter().map(|s| s[3]).collect(),
            facing: renderer.read_mask()?.into_iter().map(|m| m == FACING).collect(),
            hard: renderer.read_labels()?,
        })
    }

    /// Share of the pixels facing the light, within its cone and range, that are labelled wrongly.
    fn error(&self, visibility: &[f32]) -> f64 {
        let (facing, wrong) = (0..visibility.len())
            .into_par_iter()
            .filter(|i| self.facing[*i])
            .map(|i| (1usize, (lit(visibility[i]) != lit(self.hard[i])) as usize))
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
            (last.facing[j] && apart <= most * pixel_at(&last.camera, last.size, last.position[j].w)).then_some(j)
        })
        .collect()
}

impl Change {
    /// From the sums over a number of pixels, in the order of the fields.
    fn of(sums: [f64; 6], number: f64) -> Change {
        let [change, truth_change, flicker, label_changes, truth_label_changes, label_flicker] =
            sums.map(|sum| sum / number);
        Change { change, truth_change, flicker, label_changes, truth_label_changes, label_flicker }
    }

    /// The fields, in their order.
    pub fn figures(&self) -> [f64; 6] {
        let c = self;
        [c.change, c.truth_change, c.flicker, c.label_changes, c.truth_label_changes, c.label_flicker]
    }

    /// Mean of each figure; None of none.
    fn mean(all: &[Change]) -> Option<Change> {
        let sums = all.iter().map(Change::figures).reduce(add)?;
        Some(Change::of(sums, all.len() as f64))
    }
}

fn add<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// What changed between two frames, this and the last, over the pixels that `same` finds in both: sizes against the
/// shadows' own truths, labels against the hard ones. None: no pixel is seen twice.
fn change(same: &[Option<usize>], [now, last]: [&Shadow; 2], hard: [&[f32]; 2]) -> Option<Change> {
    let count = |i: usize, j: usize| {
        let size = |now: &[f32], last: &[f32]| (now[i] as f64 - last[j] as f64).abs();
        let (own, truth) = (size(&now.visibility, &last.visibility), size(&now.truth, &last.truth));
        let label = lit(now.visibility[i]) != lit(last.visibility[j]);
        let truth_label = lit(hard[0][i]) != lit(hard[1][j]);
        let labels = [label, truth_label, label && !truth_label].map(|is| is as u32 as f64);
        [1.0, own, truth, (own - truth).max(0.0), labels[0], labels[1], labels[2]]
    };
    let pairs: Vec<[f64; 7]> = same.par_iter().enumerate().filter_map(|(i, j)| Some(count(i, (*j)?))).collect();
    // Added up in one order, so that two runs give the same digits.
    let [both, sums @ ..] = pairs.into_iter().reduce(add)?;
    Some(Change::of(sums, both))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec4};

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
            // At a depth of 1 m the picture is two units wide.
            camera: Camera { height: Some(2.0 * h / w), ..Camera::new(Vec3::Z, Vec3::ZERO, 60.0, 0.1, 10.0) },
            position: (0..12).map(point).collect(),
            triangle: vec![7; 12],
            facing: vec![true; 12],
            hard: vec![1.0; 12],
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
        let shadow =
            |visibility: [f32; 5], truth: [f32; 5]| Shadow { visibility: visibility.into(), truth: truth.into() };
        let now = shadow([1.0, 0.75, 0.0, 0.25, 0.375], [1.0, 1.0, 1.0, 0.5, 0.0]);
        let last = shadow([0.25, 1.0, 0.25, 1.0, 0.0], [0.75, 0.75, 1.0, 0.0, 1.0]);
        // Pixels 0, 1, 3 and 4 are seen twice. The technique: 1/1, 0.75/0.25, 0.25/1, 0.375/0.25. Changes: 0, 0.5, 0.75, 0.125;
        // of label in the second and the third. The truth: 1/0.75, 1/1, 0.5/0, 0/0.75. Changes: 0.25, 0, 0.5, 0.75.
        // The hard one: 1/1, 1/1, 0/1, 0/1. Labels change in the last two.
        let hard = [[1.0, 1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0, 0.0]];
        let found = change(&same, [&now, &last], [&hard[0], &hard[1]]);
        let hand = Change {
            change: 1.375 / 4.0,
            truth_change: 1.5 / 4.0,
            // What the first pixel and the last change too little pays for nothing.
            flicker: (0.5 + 0.25) / 4.0,
            label_changes: 0.5,
            truth_label_changes: 0.5,
            label_flicker: 0.25,
        };
        assert_eq!(found, Some(hand));
        assert_eq!(change(&[None, None], [&now, &last], [&hard[0], &hard[1]]), None);
        let twice = Change { flicker: 0.0, ..hand };
        assert_eq!(Change::mean(&[hand, twice]), Some(Change { flicker: hand.flicker / 2.0, ..hand }));
        assert_eq!(Change::mean(&[]), None);
    }

    #[test]
    fn errors_count_only_what_faces_the_light() {
        let mut seen = seen(0);
        seen.facing[0] = false;
        seen.facing[1] = false;
        let mut visibility = vec![1.0; 12];
        visibility[0] = 0.0;
        visibility[2] = 0.49;
        assert_eq!(seen.error(&visibility), 0.1);
    }
}
