//! Sequences: a set-up's picture frame by frame along a way, as numbered files or as one animated file.

mod webp;

use crate::capture::{self, SEQUENCE, SETUP};
use crate::files;
use crate::frame::{History, Pixels, Renderer};
use crate::measure::STOPPED;
use crate::path::Route;
use crate::scene::builtin::cases;
use crate::scene::{Camera, Clock, Scene};
use crate::setup::Setup;
use anyhow::{Context, Result, ensure};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What moves from frame to frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "along")]
pub enum Along {
    /// The camera, once around the upright line through its target, from so many degrees on.
    Turntable { start: f32 },
    /// Camera and light, on the set-up's own path.
    Path,
    /// What moves on the path of the case whose scene it is.
    Case { case: String },
    /// The clock of the scene's animation, seconds.
    Clock { from: f32, to: f32 },
}

/// How a set-up becomes frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sequence {
    #[serde(flatten)]
    pub along: Along,
    pub frames: u32,
    /// Frames a second.
    pub fps: f32,
}

/// Fewest and most frames, and how many a second.
pub const FRAMES: [u32; 2] = [2, 10_000];
pub const FPS: [f32; 2] = [0.01, 1000.0];
/// Those that nobody chose: of a turntable, and a second.
const TURN: u32 = 60;
const PER_SECOND: f32 = 30.0;

/// How a file of frames or an animation ends.
pub const ENDINGS: [&str; 3] = ["png", "apng", "webp"];

impl Along {
    /// The path that a set-up has: its own, or else that of the case whose scene it is.
    pub fn path_of(setup: &Setup) -> Option<Along> {
        let case = || cases::find(&setup.scene).map(|case| Along::Case { case: case.id.into() });
        setup.path.as_ref().map(|_| Along::Path).or_else(case)
    }

    fn route(&self, setup: &Setup) -> Result<Option<Route>> {
        Ok(match self {
            Along::Path => {
                let path = setup.path.clone().context(
                    "the set-up has no path of its own; record one in the window (F3) or write its [[path.keys]]",
                )?;
                ensure!(path.keys.len() > 1, "the set-up's path has one key; it takes two to go anywhere");
                Some(Route::Own(path))
            }
            Along::Case { case } => {
                let found = cases::find(case)
                    .with_context(|| format!("there is no case {case}; `shadowscope list cases` names them"))?;
                ensure!(
                    setup.scene == found.id,
                    "the path of {case} leads through its own scene, not through {}: animate {case} itself, or a set-up of it",
                    setup.scene
                );
                Some(Route::Case(found))
            }
            Along::Turntable { .. } | Along::Clock { .. } => None,
        })
    }
}

impl Sequence {
    /// What is left out follows: a turn takes 60 frames, a path as long as it takes to play it, 30 frames a second.
    ///
    /// # Errors
    /// The set-up has no such path or animation, or numbers are out of range.
    pub fn new(along: Along, setup: &Setup, frames: Option<u32>, fps: Option<f32>) -> Result<Sequence> {
        let route = along.route(setup)?;
        let seconds = match (&along, &route) {
            (Along::Clock { from, to }, _) => Some((to - from).abs()),
            (_, Some(route)) => Some(route.seconds()),
            _ => None,
        };
        let rate = |frames: u32, seconds: f32| ((frames - 1) as f32 / seconds.max(1e-3)).clamp(FPS[0], FPS[1]);
        let (frames, fps) = match (seconds, frames, fps, &route) {
            (None, ..) => (frames.unwrap_or(TURN), fps.unwrap_or(PER_SECOND)),
            (_, Some(frames), Some(fps), _) => (frames, fps),
            (Some(seconds), Some(frames), None, _) => (frames, rate(frames.max(2), seconds)),
            // What a case provokes shows in so many.
            (Some(seconds), None, None, Some(Route::Case(case))) => {
                (case.frames as u32, rate(case.frames as u32, seconds))
            }
            (Some(seconds), None, fps, _) => {
                let fps = fps.unwrap_or(PER_SECOND);
                (((seconds * fps).round() as u32).saturating_add(1), fps)
            }
        };
        let sequence = Sequence { along, frames, fps };
        sequence.check(setup)?;
        Ok(sequence)
    }

    /// Refuses what cannot be drawn.
    pub fn check(&self, setup: &Setup) -> Result<()> {
        let [least, most] = FRAMES;
        ensure!(
            (least..=most).contains(&self.frames),
            "{} frames are not allowed; a sequence takes {least} to {most}",
            self.frames
        );
        let [least, most] = FPS;
        ensure!(
            (least..=most).contains(&self.fps),
            "{} frames a second are not allowed; it takes {least} to {most}",
            self.fps
        );
        if let Along::Clock { from, to } = self.along {
            for time in [from, to] {
                ensure!(
                    (0.0..=1e6).contains(&time),
                    "a clock that stands at {time} s is not allowed; it takes 0 to 1000000 s"
                );
            }
        }
        if let Along::Turntable { start } = self.along {
            ensure!((-360.0..=360.0).contains(&start), "a start at {start}° is not allowed; it takes -360 to 360°");
        }
        self.along.route(setup).map(|_| ())
    }

    /// The set-up of a frame, from 0. Those of a turn close: the one behind the last would be the first.
    ///
    /// # Errors
    /// As [`Sequence::check`].
    pub fn place(&self, setup: &Setup, scene: &Scene, frame: u32) -> Result<Setup> {
        let mut at = setup.clone();
        let share = frame as f32 / (self.frames - 1).max(1) as f32;
        match (&self.along, self.along.route(setup)?) {
            (Along::Turntable { start }, _) => {
                let turned = f64::from(frame % self.frames) * 360.0 / f64::from(self.frames);
                at.camera = turned_about(&setup.camera, f64::from(*start) + turned);
            }
            (Along::Clock { from, to }, _) => {
                at.set_clock(scene, Clock { time: from + (to - from) * share, ..setup.clock() })
            }
            (_, Some(route)) => route.place_sides(&mut at, share),
            (_, None) => {}
        }
        // To places that a file can hold.
        at.count_from(scene.origin);
        Ok(at)
    }
}

/// A camera after a turn about the upright line through its target, degrees; seen from above anticlockwise. What is upright, rolled or
/// seen from above turns with it.
fn turned_about(camera: &Camera, degrees: f64) -> Camera {
    if degrees % 360.0 == 0.0 {
        return *camera;
    }
    let turn = DQuat::from_axis_angle(DVec3::Y, degrees.to_radians());
    let [_, up, forward] = camera.frame();
    let target = camera.target.as_dvec3();
    let position = (target + turn * (camera.position.as_dvec3() - target)).as_vec3();
    // Looking along what is up, the picture's own upwards turns.
    let held = if forward.y.abs() > 0.999 { up } else { camera.up.as_dvec3() };
    Camera { position, up: (turn * held).as_vec3(), ..*camera }
}

/// Whether a file's name stands for numbered frames: it ends in a hyphen before the ending.
pub fn is_numbered(path: &Path) -> bool {
    path.file_stem().is_some_and(|stem| stem.as_encoded_bytes().ends_with(b"-"))
}

/// The file of a frame, from 0: `frame-.png` becomes `frame-0001.png`.
pub fn numbered(path: &Path, frame: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("{:04}.", frame + 1));
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}

/// Refuses a file's name that no sequence can be written as, before anything is drawn.
pub fn check_name(path: &Path) -> Result<()> {
    let ending = ending(path);
    let name = path.display();
    ensure!(
        ENDINGS.contains(&ending.as_str()),
        "{name}: an animation's file name ends in .png, .apng or .webp, numbered frames' in -.png"
    );
    ensure!(!is_numbered(path) || ending == "png", "{name}: numbered frames are .png files");
    Ok(())
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// A sequence that is being drawn.
struct Run<'a> {
    renderer: &'a mut Renderer,
    setup: &'a Setup,
    sequence: &'a Sequence,
    watch: &'a mut dyn FnMut(f32) -> bool,
    /// Of all frames: the first one's.
    size: Option<[u32; 2]>,
    /// What is to be said of the first frame of which something is.
    notes: Vec<String>,
}

impl Run<'_> {
    /// Draws a frame, which goes on from the last one.
    fn frame(&mut self, frame: u32) -> Result<(Pixels, Setup)> {
        let frames = self.sequence.frames;
        ensure!((self.watch)(frame as f32 / frames as f32), STOPPED);
        let scene = self.renderer.scene().clone();
        let setup = self.sequence.place(self.setup, &scene, frame)?;
        let history = if frame == 0 { History::Whole } else { History::Goes };
        let (mut pixels, notes) = capture::picture(self.renderer, &setup, history)
            .with_context(|| format!("frame {} of {frames} cannot be drawn", frame + 1))?;
        let [width, height] = *self.size.get_or_insert(pixels.size);
        // A legend with other figures may be a line more or less.
        pixels.rgba.resize(4 * width as usize * height as usize, 255);
        pixels.size = [width, height];
        if self.notes.is_empty() {
            self.notes = notes;
        }
        Ok((pixels, setup))
    }
}

/// Draws a sequence and writes it: as numbered frames, each with its set-up inside, or as an animation with the set-up and the sequence
/// inside, APNG or lossless WebP. `watch` is told the share done, and stops the work by saying no: frames that are written stay,
/// an animation is not begun. Returns what is to be said of the pictures.
///
/// # Errors
/// As [`capture::picture`], what the file system says, or that it was stopped.
pub fn write(
    renderer: &mut Renderer,
    setup: &Setup,
    sequence: &Sequence,
    path: &Path,
    watch: &mut dyn FnMut(f32) -> bool,
) -> Result<Vec<String>> {
    check_name(path)?;
    sequence.check(setup)?;
    let mut run = Run { renderer, setup, sequence, watch, size: None, notes: Vec::new() };
    if is_numbered(path) {
        for frame in 0..sequence.frames {
            let (pixels, setup) = run.frame(frame)?;
            let path = numbered(path, frame);
            capture::write_png(&path, pixels.size, &pixels.rgba, Some(&setup.to_toml(&path)?))?;
        }
        return Ok(run.notes);
    }
    let texts = [setup.to_toml(path)?, toml::to_string(sequence).context("the sequence cannot be written as TOML")?];
    let bytes = match ending(path).as_str() {
        "webp" => webp::encode(&mut run, &texts)?,
        _ => apng(&mut run, &texts)?,
    };
    files::save(path, &bytes)?;
    Ok(run.notes)
}

/// Draws all frames into an APNG.
fn apng(run: &mut Run, [setup, sequence]: &[String; 2]) -> Result<Vec<u8>> {
    const CANNOT: &str = "the animation cannot be written as PNG";
    let Sequence { frames, fps, .. } = *run.sequence;
    let (first, _) = run.frame(0)?;
    let mut bytes = Vec::new();
    let mut encoder = capture::png_encoder(&mut bytes, first.size, png::ColorType::Rgba);
    encoder.add_itxt_chunk(SETUP.into(), setup.clone()).context(CANNOT)?;
    encoder.add_itxt_chunk(SEQUENCE.into(), sequence.clone()).context(CANNOT)?;
    // Played again and again.
    encoder.set_animated(frames, 0).context(CANNOT)?;
    let [over, under] = delay(fps);
    encoder.set_frame_delay(over, under).context(CANNOT)?;
    encoder.set_blend_op(png::BlendOp::Source).context(CANNOT)?;
    let mut writer = encoder.write_header().context(CANNOT)?;
    writer.write_image_data(&first.rgba).context(CANNOT)?;
    for frame in 1..frames {
        let (pixels, _) = run.frame(frame)?;
        writer.write_image_data(&pixels.rgba).context(CANNOT)?;
    }
    writer.finish().context(CANNOT)?;
    Ok(bytes)
}

/// How long a frame stays, seconds, as a fraction.
fn delay(fps: f32) -> [u16; 2] {
    if fps >= 1.0 && fps.fract() == 0.0 {
        [1, fps as u16]
    } else {
        [(1000.0 / fps).round().clamp(1.0, 65535.0) as u16, 1000]
    }
}

/// The sequence inside an animation; None: the file has none.
///
/// # Errors
/// The file cannot be read, or what it holds is no sequence.
pub fn read(path: &Path) -> Result<Option<Sequence>> {
    let Some(text) = capture::read_text(path, SEQUENCE)? else { return Ok(None) };
    let sequence = toml::from_str(&text).map_err(|e| crate::setup::one_line(&e.to_string()));
    sequence.map(Some).with_context(|| format!("the sequence inside {} cannot be used", path.display()))
}

/// The clock of a set-up's animation, from its start to its end.
///
/// # Errors
/// The scene is not animated.
pub fn whole_clock(setup: &Setup, scene: &Scene) -> Result<Along> {
    let to = scene.duration(setup.animation);
    ensure!(to > 0.0, "{} has no animation whose clock could run", setup.scene);
    Ok(Along::Clock { from: 0.0, to })
}

pub(crate) use webp::read_texts;
