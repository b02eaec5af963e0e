//! A path of one's own in the stability tab: recorded, and edited key by key.

use super::controls::{Tip, chips};
use super::model::Model;
use crate::light::Light;
use crate::path::{Between, Key, LONGEST, LightKey, OwnPath, Sample, reduce, to_millis};
use crate::scene::Camera;
use egui::{Align, Button, DragValue, Layout, RichText, Role, ScrollArea, Ui, WidgetInfo, vec2};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The longest recording, seconds: it then ends by itself.
const MOST: f32 = 600.0;
/// Seconds without a change after which things count as having stood still, until so long before the next one. Shorter
/// ones are those between two passes of a slow window.
const STILL: f32 = 0.5;
const STEP: f32 = 0.1;
/// Height of the list of keys beyond which it scrolls by itself, points.
const LIST: f32 = 160.0;
/// Seconds from the last key to one that is added at the end.
const NEXT: f32 = 2.0;
/// Seconds within which a new key takes the place of another, and the least between two.
const NEAR: f32 = 0.02;
const LEAST: f32 = 0.01;

/// A recording under way.
pub struct Recording {
    since: Instant,
    samples: Vec<Sample>,
}

impl Default for Recording {
    fn default() -> Recording {
        Recording { since: Instant::now(), samples: Vec::new() }
    }
}

impl Recording {
    /// Seconds so far.
    pub fn seconds(&self) -> f32 {
        self.since.elapsed().as_secs_f32()
    }

    /// Takes in where camera and light stand at a time, seconds since the recording began, if that is another place.
    pub fn take(&mut self, time: f32, camera: Camera, light: Light) {
        let now = Sample { time: to_millis(time), camera, light };
        if let Some(last) = self.samples.last().copied() {
            if now.time <= last.time || (last.camera, last.light) == (camera, light) {
                return;
            }
            if now.time - last.time > STILL {
                self.samples.push(Sample { time: to_millis(now.time - STEP), ..last });
            }
        }
        self.samples.push(now);
    }
}

impl Model {
    /// Begins to record how camera and light move.
    pub fn record(&mut self) {
        self.timeline.playing = false;
        let mut recording = Recording::default();
        recording.take(0.0, self.setup.camera, self.setup.light);
        self.timeline.recording = Some(recording);
    }

    /// Goes on recording, if it does.
    pub(super) fn take_sample(&mut self) {
        let Some(recording) = &mut self.timeline.recording else { return };
        let seconds = recording.seconds();
        recording.take(seconds, self.setup.camera, self.setup.light);
        if seconds > MOST {
            self.stop_recording();
        }
    }

    /// Ends the recording and makes key frames of it, which replace the path, as one step that can be undone.
    pub fn stop_recording(&mut self) {
        let Some(recording) = self.timeline.recording.take() else { return };
        let between = self.setup.path.as_ref().map_or(Between::default(), |p| p.between);
        match reduce(&recording.samples, self.diagonal(), between) {
            Some(path) => {
                self.history.commit(&self.setup, true);
                self.say(format!("Recorded {:.1} s in {} keys.", path.seconds(), path.keys.len()));
                self.setup.path = Some(Arc::new(path));
                self.timeline.choose_own();
                self.timeline.t = 1.0;
            }
            None => self.say("Nothing moved while it recorded: the path is as it was."),
        }
    }

    /// Makes a key of where camera and light stand now: at the end of the path, or where the timeline is.
    pub fn add_key(&mut self, at_end: bool) {
        let takes = [!self.timeline.without_camera, self.timeline.with_light];
        let path = self.setup.path.as_deref();
        let time = match path {
            None => 0.0,
            Some(p) if at_end => p.times()[1] + NEXT,
            Some(p) => {
                let time = p.time(self.timeline.t) as f32;
                // Hardly beside a key it is that.
                p.keys.iter().map(|k| k.time).find(|k| (k - time).abs() < NEAR).unwrap_or(time)
            }
        };
        let key = Key::of(&self.setup, time, takes);
        let path = Arc::make_mut(self.setup.path.get_or_insert_default());
        path.set(key);
        self.timeline.t = path.share(to_millis(time));
    }
}

/// What makes and changes the path.
pub fn show(ui: &mut Ui, m: &mut Model) {
    let free = m.measuring.is_none() && m.loading.is_none();
    let takes = !m.timeline.without_camera || m.timeline.with_light;
    ui.horizontal(|ui| {
        let recording = m.timeline.recording.is_some();
        let record = Button::new(if recording { "Stop" } else { "Record" }).min_size(vec2(58.0, 21.0));
        let tip = "Record how the camera and the light move, until you stop: that becomes a path with few key frames, in place of \
                   the present one. Undo brings that back.";
        if ui.add_enabled(free, record).tip(tip).clicked() {
            if recording { m.stop_recording() } else { m.record() }
        }
        let tips = [
            ("Add at end", "A key of where things stand now, two seconds behind the last one.", true),
            ("Add here", "A key of where things stand now, at the timeline's place; on a key it replaces that.", false),
        ];
        for (name, tip, at_end) in tips {
            let there = at_end || m.setup.path.as_ref().is_some_and(|p| p.seconds() > 0.0);
            let button = ui.add_enabled(free && takes && there && !recording, Button::new(name));
            if button.tip(tip).clicked() {
                m.add_key(at_end);
            }
        }
    });
    if let Some(recording) = &m.timeline.recording {
        let text = format!("recording, {:.0} s: move the camera or the light", recording.seconds());
        ui.label(RichText::new(text).small().color(ui.visuals().warn_fg_color));
        ui.ctx().request_repaint_after(Duration::from_millis(500));
    }
    ui.horizontal(|ui| {
        ui.label(RichText::new("keys take").small().weak());
        let tips = ["Where the camera stands and looks.", "Where the light stands and shines."];
        let on = [!m.timeline.without_camera, m.timeline.with_light];
        match chips(ui, (0..2).map(|i| (["camera", "light"][i], on[i], tips[i].to_string()))) {
            Some(0) => m.timeline.without_camera = on[0],
            Some(_) => m.timeline.with_light = !on[1],
            None => {}
        }
    });
    let Some(path) = m.setup.path.clone() else {
        let text = "No path yet. Record while you fly or move the light, or add keys from place to place.";
        ui.label(RichText::new(text).small().weak());
        return;
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new("between").small().weak());
        let tips = ["A curve without corners through all keys.", "Straight from key to key."];
        let items = Between::ALL.into_iter().zip(tips).map(|(b, tip)| (b.id(), path.between == b, tip.to_string()));
        if let Some(i) = chips(ui, items)
            && let Some(path) = &mut m.setup.path
        {
            Arc::make_mut(path).between = Between::ALL[i];
        }
    });
    let mut gone = None;
    let list = ScrollArea::vertical().id_salt("keys").max_height(LIST).auto_shrink([false, true]);
    list.show_rows(ui, 21.0, path.keys.len(), |ui, shown| {
        for (i, key) in path.keys.iter().enumerate().take(shown.end).skip(shown.start) {
            ui.horizontal(|ui| row(ui, m, &path, (i, key), &mut gone));
        }
    });
    if let (Some(i), Some(path)) = (gone, &mut m.setup.path) {
        if path.keys.len() > 1 {
            let time = path.time(m.timeline.t) as f32;
            Arc::make_mut(path).keys.remove(i);
            m.timeline.t = path.share(time);
        } else {
            m.setup.path = None;
        }
    }
}

/// A key: going there, its time, what it moves, and taking it away.
fn row(ui: &mut Ui, m: &mut Model, path: &OwnPath, (i, key): (usize, &Key), gone: &mut Option<usize>) {
    let free = m.measuring.is_none() && m.loading.is_none() && m.timeline.recording.is_none();
    let go =
        ui.add_enabled(free, Button::new(RichText::new(format!("key {}", i + 1)).small()).min_size(vec2(50.0, 21.0)));
    if go.tip("Go there.").clicked() {
        m.timeline.playing = false;
        m.scrub(path.share(key.time));
    }
    let time = |k: Option<&Key>, by: f32| k.map(|k| k.time + by);
    let low = i.checked_sub(1).and_then(|i| time(path.keys.get(i), LEAST)).unwrap_or(0.0);
    let high = time(path.keys.get(i + 1), -LEAST).unwrap_or(LONGEST).max(low);
    let mut at = key.time;
    let drag = DragValue::new(&mut at).range(low..=high).speed(0.02).max_decimals(3).suffix(" s");
    let field = ui.add_enabled_ui(free, |ui| ui.add_sized([72.0, 21.0], drag)).inner;
    field.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, format!("time of key {}", i + 1)));
    if field.tip("When it is there, between the keys before and after it.").changed()
        && let Some(path) = &mut m.setup.path
    {
        let here = path.time(m.timeline.t) as f32;
        Arc::make_mut(path).keys[i].time = to_millis(at);
        m.timeline.t = path.share(here);
    }
    let moves = match (key.camera, key.light) {
        (Some(_), Some(_)) => "camera, light",
        (None, Some(_)) => "light",
        _ => "camera",
    };
    ui.label(RichText::new(moves).small().weak());
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let remove = ui.add_enabled(free, Button::new("×").small());
        remove.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("remove key {}", i + 1)));
        if remove.tip("Take this key away.").clicked() {
            *gone = Some(i);
        }
    });
}

/// Whether a camera stands or looks elsewhere than another, by more than what rounding does.
pub fn camera_moved(a: &Camera, b: &Camera) -> bool {
    let far = |p: glam::Vec3, q: glam::Vec3| p.distance(q) > 1e-4 * a.reach();
    let tilted = a.up.distance(b.up) > 1e-4 || a.height != b.height;
    far(a.position, b.position) || far(a.target, b.target) || (a.fov - b.fov).abs() > 1e-3 || tilted
}

/// The same for a light in a scene of this diagonal, metres.
pub fn light_moved(a: &Light, b: &Light, diagonal: f32) -> bool {
    let (p, q) = (LightKey::of(a), LightKey::of(b));
    let placed = p.position.or(p.center).zip(q.position.or(q.center));
    a.index() != b.index()
        || placed.is_some_and(|(p, q)| p.distance(q) > 1e-4 * diagonal)
        || a.axis().distance(b.axis()) > 1e-4
}
