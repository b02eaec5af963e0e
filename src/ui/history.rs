//! Undo and redo: the set-up before and after each step.

use super::controls::{shown_name, shown_value};
use crate::legend::letter;
use crate::scene::{Camera, Clock, Scene};
use crate::setup::{Setup, Side};
use crate::techniques;
use std::time::{Duration, Instant};

/// Steps kept.
const LIMIT: usize = 200;
/// How long the camera must stand still for its way there to be a step.
pub const REST: Duration = Duration::from_millis(400);

struct Step {
    before: Setup,
    after: Setup,
}

/// What can be undone and redone.
pub struct History {
    last: Setup,
    past: Vec<Step>,
    future: Vec<Step>,
    /// Where the camera was seen last, and since when it stands there.
    camera: Camera,
    since: Instant,
}

impl History {
    pub fn new(setup: &Setup) -> History {
        let (past, future) = (Vec::new(), Vec::new());
        History { last: setup.clone(), past, future, camera: setup.camera, since: Instant::now() }
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// Makes a step of what changed since the last call. The passing of time is none; a flight becomes one when the camera
    /// has come to rest, or `at_once`.
    pub fn commit(&mut self, now: &Setup, at_once: bool) {
        if *now == self.last {
            return;
        }
        if now.camera != self.camera {
            self.camera = now.camera;
            self.since = Instant::now();
        }
        let flown = Setup { camera: now.camera, time: now.time, ..self.last.clone() };
        if *now != flown {
            // A flight just before is a step of its own; another animation may take the camera along.
            if now.camera != self.last.camera && now.animation == self.last.animation && !at_once {
                self.push(flown);
            }
            self.push(now.clone());
        } else if now.camera == self.last.camera {
            self.last.time = now.time;
        } else if at_once || self.since.elapsed() >= REST {
            self.push(flown);
        }
    }

    /// Moves the pinned places of all steps as the present one moves with the picture's shape: no step of its own.
    pub fn move_probes(&mut self, moved: impl Fn(&mut [f32; 2])) {
        let steps = self.past.iter_mut().chain(&mut self.future);
        let all = steps.flat_map(|step| [&mut step.before, &mut step.after]).chain([&mut self.last]);
        all.for_each(|setup| moved(&mut setup.probe));
    }

    fn push(&mut self, after: Setup) {
        self.past.push(Step { before: std::mem::replace(&mut self.last, after.clone()), after });
        self.past.drain(..self.past.len().saturating_sub(LIMIT));
        self.future.clear();
    }

    /// Whether a flight waits to become a step.
    pub fn waits(&self, now: &Setup) -> bool {
        now.camera != self.last.camera
    }

    /// Lets the clock of the open scene pass, and what follows its animation.
    pub fn pass(&mut self, scene: &Scene, time: f32) {
        let clock = Clock { time, ..self.last.clock() };
        self.last.set_clock(scene, clock);
    }

    /// Takes what changed since the last call as no step: the passing of time on a path.
    pub fn absorb(&mut self, now: &Setup) {
        self.last = now.clone();
    }

    /// The set-up before the last step, and what that step had changed.
    pub fn undo(&mut self, scene: &Scene, now: &Setup) -> Option<(Setup, String)> {
        let step = self.past.pop()?;
        self.last = stepped(&step.after, &step.before, (scene, now));
        let told = changes(&step.before, &step.after);
        self.future.push(step);
        Some((self.last.clone(), told))
    }

    /// The set-up after the step that was undone last, and what the step changes.
    pub fn redo(&mut self, scene: &Scene, now: &Setup) -> Option<(Setup, String)> {
        let step = self.future.pop()?;
        self.last = stepped(&step.before, &step.after, (scene, now));
        let told = changes(&step.before, &step.after);
        self.past.push(step);
        Some((self.last.clone(), told))
    }
}

/// The set-up at a step's other end. What moves without steps stays as it is now, unless the step changed it.
fn stepped(from: &Setup, to: &Setup, (scene, now): (&Scene, &Setup)) -> Setup {
    let mut out = to.clone();
    if from.scene == to.scene {
        out.set_clock(scene, Clock { time: now.time, ..to.clock() });
        if from.camera == to.camera {
            out.camera = now.camera;
        }
        // A case's path moves the light at work.
        let lights = |s: &Setup| (s.light_number, s.lamps());
        if lights(from) == lights(to) {
            out.set_lamps(now.lamps(), now.at_work());
        }
    }
    out
}

/// What differs between two set-ups, in words: `bias 0.002 → 0.01`.
fn changes(before: &Setup, after: &Setup) -> String {
    let mut all = Vec::new();
    let mut differ = |name: &str, a: String, b: String| {
        if a != b {
            all.push(format!("{name} {a} → {b}"));
        }
    };
    let name = super::panel::scene_name;
    differ("scene", name(&before.scene), name(&after.scene));
    differ("technique", before.technique.clone(), after.technique.clone());
    differ("view", before.view.clone(), after.view.clone());
    differ("truth samples", before.truth_samples.to_string(), after.truth_samples.to_string());
    let size = |s: &Setup| format!("{} × {}", s.size[0], s.size[1]);
    differ("size", size(before), size(after));
    differ("split", format!("{:.0} %", before.split * 100.0), format!("{:.0} %", after.split * 100.0));
    differ("arranged", before.arrange.id().into(), after.arrange.id().into());
    let sides = |s: &Setup| {
        let all: Vec<&str> = s.against.iter().map(|side| side.technique.as_str()).collect();
        if all.is_empty() { "nothing".into() } else { all.join(", ") }
    };
    differ("against", sides(before), sides(after));
    let overlay = |s: &Setup| {
        let at = |o: &crate::setup::Overlay| {
            if o.inset { format!("{} inset", o.view) } else { format!("{} {:.0} %", o.view, o.opacity * 100.0) }
        };
        s.overlay.as_ref().map_or("none".into(), at)
    };
    differ("overlay", overlay(before), overlay(after));
    let word = |on: bool| if on { "on" } else { "off" }.to_string();
    differ("legend in captures", word(before.legend), word(after.legend));
    differ("supersampling", before.supersample.to_string(), after.supersample.to_string());
    differ("transparent", word(before.transparent), word(after.transparent));
    let crop = |s: &Setup| s.crop.map_or("none".into(), |_| format!("{:?}", s.part()));
    differ("crop", crop(before), crop(after));
    differ("outlines", word(before.outlines), word(after.outlines));
    differ("frozen camera", word(before.shadow_camera.is_some()), word(after.shadow_camera.is_some()));
    differ("error dilation", before.error_dilation.to_string(), after.error_dilation.to_string());
    differ("error base", format!("{:?}", before.error_base), format!("{:?}", after.error_base));
    differ("error window", before.error_window.to_string(), after.error_window.to_string());
    differ("probe", format!("{:.3?}", before.probe), format!("{:.3?}", after.probe));
    differ("front", before.front.to_string(), after.front.to_string());
    differ("time", format!("{:.2} s", before.time), format!("{:.2} s", after.time));
    for (i, (a, b)) in
        before.against.iter().zip(&after.against).enumerate().filter(|(_, (a, b))| a.technique == b.technique)
    {
        for spec in a.info().into_iter().flat_map(|i| i.specs()) {
            let value = |s: &Side| shown_value(s.params.get(spec.name).unwrap_or(&spec.default_in(after.unit)));
            differ(&format!("{} {}", letter(i + 1), shown_name(spec)), value(a), value(b));
        }
    }
    for info in techniques::ALL.iter() {
        for spec in info.specs() {
            let value = |s: &Setup| {
                s.params.get(info.id).and_then(|v| v.get(spec.name)).cloned().unwrap_or(spec.default_in(s.unit))
            };
            let own = info.id == after.technique;
            let title = if own { shown_name(spec) } else { format!("{} {}", info.id, shown_name(spec)) };
            differ(&title, shown_value(&value(before)), shown_value(&value(after)));
        }
    }
    let keys = |s: &Setup| s.path.as_ref().map_or("none".into(), |p| format!("{} keys", p.keys.len()));
    let others = before.path != after.path && keys(before) == keys(after);
    differ("path", keys(before), keys(after) + if others { ", changed" } else { "" });
    if before.scene == after.scene {
        differ("light", before.light.kind().into(), after.light.kind().into());
        if before.light != after.light && before.light.kind() == after.light.kind() {
            all.push("light".into());
        }
        if before.light_count() != after.light_count() {
            all.push(format!("lights {} → {}", before.light_count(), after.light_count()));
        } else if before.light_number != after.light_number {
            all.push(format!("chosen light {} → {}", before.light_number, after.light_number));
        } else if before.more_lights != after.more_lights || before.light_on != after.light_on {
            all.push("lights".into());
        }
        if before.camera != after.camera {
            all.push("camera".into());
        }
    }
    match all.len() {
        0 => "a change".into(),
        1..=3 => all.join(", "),
        n => format!("{} and {} more", all[..2].join(", "), n - 2),
    }
}
