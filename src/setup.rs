//! The set-up: one value that says everything a picture or a figure depends on.
//!
//! It is a bookmark, the command line's input, what a capture embeds, and what undo steps through.

mod command;
mod lights;
pub mod place;
mod presets;
mod shape;
mod shown;

pub use lights::{Lamp, MOST_LIGHTS};
pub use shown::{Crop, MAX_SUPERSAMPLE, parse_crop};

use crate::capture;
use crate::contact;
use crate::files;
use crate::light::{KINDS, Light, MAX_RADIUS};
use crate::message;
use crate::params::{Kind, Value, Values};
use crate::path::{self, OwnPath};
use crate::scene::camera::FARTHEST;
use crate::scene::{Camera, Clock, NamedLight, Scene, builtin, formats};
use crate::techniques::{self, Info};
use crate::truth::Samples;
use crate::view::{self, View};
use anyhow::{Context, Result, bail, ensure};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Everything a frame depends on. Saved as TOML; lengths in metres, angles in degrees. Here camera and light stand in scene
/// space, in files in the scene's own coordinates ([`place`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self", deny_unknown_fields)]
pub struct Setup {
    /// A built-in scene's name or the path of a scene's file; bytes of it that are no text as [`files::name_of`] writes them.
    pub scene: String,
    /// Scene space's zero in the scene's own coordinates, [`Scene::origin`]. No part of a file as TOML: the scene knows it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub origin: DVec3,
    /// The scene's clock, seconds: where its animation stands.
    #[serde(default)]
    pub time: f32,
    /// Which of the file's animations plays, from 0.
    #[serde(default)]
    pub animation: u32,
    /// A technique's id, as `list techniques` prints it.
    #[serde(default = "default_technique")]
    pub technique: String,
    /// What is drawn, as `list views` prints it.
    #[serde(default = "default_view")]
    pub view: String,
    /// What the figure is composed of where it shows more than one technique.
    #[serde(default, skip_serializing_if = "is_default")]
    pub arrange: Arrange,
    /// Where [`Arrange::Swipe`] changes from the first side to the second, as a share of the width.
    #[serde(default = "half")]
    pub split: f32,
    /// The side that [`Arrange::Flicker`] shows, from 0.
    #[serde(default, skip_serializing_if = "is_default")]
    pub front: u32,
    /// Captures have the view's legend below the picture.
    #[serde(default, skip_serializing_if = "is_default")]
    pub legend: bool,
    /// Width and height of the picture, pixels.
    #[serde(default = "default_size")]
    pub size: [u32; 2],
    /// Pixels, across and down, that are drawn for one of a capture and averaged, 1 to [`MAX_SUPERSAMPLE`].
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub supersample: u32,
    /// Captures have alpha 0 where no surface is.
    #[serde(default, skip_serializing_if = "is_default")]
    pub transparent: bool,
    /// The part of the picture that captures show.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
    /// Start of every random pattern.
    #[serde(default)]
    pub seed: u32,
    /// How many samples per pixel the truth averages.
    #[serde(default)]
    pub truth_samples: Samples,
    /// Pixels by which wrong ones grow in views of errors, 0 to 2, and what lies under them.
    #[serde(default)]
    pub error_dilation: u32,
    #[serde(default)]
    pub error_base: Base,
    /// Width of the window of the view `error-density`, pixels; odd.
    #[serde(default = "default_window")]
    pub error_window: u32,
    /// The place in the picture that charts of a single pixel are of, shares of its sides from the upper left corner.
    #[serde(default = "middle", skip_serializing_if = "is_middle")]
    pub probe: [f32; 2],
    /// Draw what maps cover as lines into the scene; always drawn while there is a shadow camera.
    #[serde(default, skip_serializing_if = "is_default")]
    pub outlines: bool,
    /// Whether `light` is on.
    #[serde(default = "lights::yes", skip_serializing_if = "lights::is_yes")]
    pub light_on: bool,
    /// The number of `light` among all lights, from 1: `more_lights` stand before and behind it.
    #[serde(default = "lights::first", skip_serializing_if = "lights::is_first")]
    pub light_number: u32,
    pub camera: Camera,
    /// The camera that maps are fitted to while another looks at them; None: the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow_camera: Option<Camera>,
    /// The light at work: the one whose maps, visibility, truth and errors are shown.
    pub light: Light,
    /// The other lights, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub more_lights: Vec<Lamp>,
    /// Parameters by technique and name; what is absent takes its default.
    #[serde(default)]
    pub params: BTreeMap<String, Values>,
    /// A view that is blended over the shaded picture, which stands in for `view` then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overlay: Option<Overlay>,
    /// What the technique is compared with: the second side, and up to two more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub against: Vec<Side>,
    /// A path of one's own, along which stability and cost are measured.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "path::shared")]
    pub path: Option<Arc<OwnPath>>,
    /// What stands for a metre in parameters that nobody chose, metres: the scene's.
    #[serde(skip, default = "metre")]
    pub unit: f64,
}

/// What lies under marked errors: the picture in dark greys, or in light ones for print and projectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Base {
    #[default]
    Dark,
    Light,
}

/// Most pixels by which wrong ones grow, and the widest window of their density.
pub const MAX_DILATION: u32 = 2;
pub const MAX_WINDOW: u32 = 255;

/// How the sides of a comparison share the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Arrange {
    /// The first left of a line, the second right of it.
    #[default]
    Swipe,
    /// Each in a part of its own: two beside each other, more in two rows.
    SideBySide,
    /// One of them at a time.
    Flicker,
}

impl Arrange {
    pub const ALL: [Arrange; 3] = [Arrange::Swipe, Arrange::SideBySide, Arrange::Flicker];

    /// As set-ups and the command line have it.
    pub fn id(self) -> &'static str {
        match self {
            Arrange::Swipe => "swipe",
            Arrange::SideBySide => "side-by-side",
            Arrange::Flicker => "flicker",
        }
    }
}

/// One side of a comparison: a technique with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Side {
    /// A technique's id, or [`Side::TRUTH`].
    pub technique: String,
    #[serde(default)]
    pub params: Values,
}

impl Side {
    /// In place of a technique: the truth.
    pub const TRUTH: &str = "truth";

    pub fn is_truth(&self) -> bool {
        self.technique == Side::TRUTH
    }

    /// The technique; None for the truth.
    pub fn info(&self) -> Option<&'static Info> {
        techniques::find(&self.technique)
    }

    /// The truth, or a technique, of which nothing is chosen.
    ///
    /// # Errors
    /// No technique of that name.
    pub fn new(technique: &str) -> Result<Side> {
        let side = Side { technique: technique.into(), params: Values::new() };
        if !side.is_truth() {
            techniques::find_or_say(technique)?;
        }
        Ok(side)
    }

    /// From `TECHNIQUE` or `TECHNIQUE:key=value;…`.
    pub fn parse(text: &str) -> Result<Side> {
        let (technique, rest) = text.split_once(':').unwrap_or((text, ""));
        let mut side = Side::new(technique).with_context(|| format!("--against {text}"))?;
        for assignment in rest.split(';').filter(|a| !a.is_empty()) {
            let Some((name, value)) = assignment.split_once('=') else {
                bail!("--against {text}: write {assignment} as key=value");
            };
            let spec = side.info().and_then(|i| i.specs().find(|s| s.name == name));
            let spec = spec.with_context(|| format!("--against {text}: {technique} has no parameter {name}"))?;
            side.params.insert(name.into(), spec.parse(&format!("{technique}.{name}"), value)?);
        }
        Ok(side)
    }

    /// Fills in defaults where so many metres stand for one.
    fn complete(&mut self, unit: f64) {
        if let Some(info) = self.info() {
            info.fill(&mut self.params, unit);
        }
    }
}

/// A view over the shaded picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Overlay {
    pub view: String,
    /// 0: not seen. 1: hides what is below.
    #[serde(default = "half")]
    pub opacity: f32,
    /// Small in a corner instead of all over.
    #[serde(default)]
    pub inset: bool,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
fn metre() -> f64 {
    1.0
}
fn is_zero(origin: &DVec3) -> bool {
    *origin == DVec3::ZERO
}
/// The technique of a set-up that names none.
pub const DEFAULT_TECHNIQUE: &str = "shadow-map";

fn default_technique() -> String {
    DEFAULT_TECHNIQUE.into()
}
fn default_view() -> String {
    "shaded".into()
}
fn default_size() -> [u32; 2] {
    [1280, 720]
}
fn one() -> u32 {
    1
}
fn is_one(number: &u32) -> bool {
    *number == 1
}
fn middle() -> [f32; 2] {
    [0.5; 2]
}

fn is_middle(probe: &[f32; 2]) -> bool {
    *probe == middle()
}

fn default_window() -> u32 {
    15
}
fn half() -> f32 {
    0.5
}

/// Largest width and height of a picture, pixels.
pub const MAX_SIZE: u32 = 16384;

impl Setup {
    /// The set-up a scene starts with: its first camera and light, the first technique.
    pub fn new(name: &str, scene: &Scene) -> Result<Setup> {
        let camera = scene.cameras.first().context("the scene has no camera")?.camera;
        let light = scene.lights.first().context("the scene has no light")?.light;
        let mut setup = Setup {
            scene: name.into(),
            origin: scene.origin,
            time: 0.0,
            animation: 0,
            technique: default_technique(),
            view: default_view(),
            arrange: Arrange::Swipe,
            split: half(),
            front: 0,
            legend: false,
            size: default_size(),
            supersample: one(),
            transparent: false,
            crop: None,
            seed: 0,
            truth_samples: Samples::Auto,
            error_dilation: 0,
            error_base: Base::Dark,
            error_window: default_window(),
            probe: middle(),
            outlines: false,
            light_on: true,
            light_number: lights::first(),
            camera,
            shadow_camera: None,
            light,
            more_lights: Vec::new(),
            params: BTreeMap::new(),
            overlay: None,
            against: Vec::new(),
            path: None,
            unit: scene.unit(),
        };
        setup.complete();
        Ok(setup)
    }

    /// Opens a built-in scene by name, a scene's file, a set-up (.toml) or a capture (.png).
    ///
    /// # Errors
    /// One sentence that names the file, the key and what is allowed.
    pub fn open(what: &str) -> Result<(Setup, Scene)> {
        Setup::open_for(what, &[])
    }

    /// As [`Setup::open`]; of a scene's file with a light that these techniques serve.
    pub fn open_for(what: &str, techniques: &[&str]) -> Result<(Setup, Scene)> {
        let path = &files::path_of(what);
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let told = path.display();
        match extension.as_str() {
            "toml" => {
                let text = files::read_text(path)?;
                Setup::from_toml(&text, path).with_context(|| format!("{told} is not a usable set-up"))
            }
            held if capture::HOLD.contains(&held) => {
                let text = capture::read_setup(path)?;
                Setup::from_toml(&text, path).with_context(|| format!("the set-up inside {told} cannot be used"))
            }
            _ => {
                let mut scene = load_scene(what)?;
                let mut setup = Setup::new(what, &scene)?;
                if let Some((place, note)) = suited_light(what, &scene, techniques) {
                    setup.light = scene.lights[place].light;
                    scene.notes.extend(note);
                }
                Ok((setup, scene))
            }
        }
    }

    /// Reads a set-up, loads the scene it names, and checks one against the other. In a file
    /// `camera` and `light` may also be the name of one of the scene's, or be left out.
    pub fn from_toml(text: &str, path: &Path) -> Result<(Setup, Scene)> {
        let table = read_table(text)?;
        let name = Setup::scene_named(&table, path.parent().unwrap_or(Path::new("")))?;
        let mut scene = load_scene(&name)?;
        let (setup, note) = Setup::in_scene(table, &name, &scene)?;
        scene.notes.extend(note);
        Ok((setup, scene))
    }

    /// The scene that a table in a file of this folder names.
    pub fn scene_named(table: &toml::Table, folder: &Path) -> Result<String> {
        let mut table = table.clone();
        shape::rename(&mut table);
        shape::check(&table)?;
        Ok(beside(scene_name(&table)?, folder))
    }

    /// As [`Setup::from_toml`] of a table whose scene, called `name`, is loaded; and what is to be said of the light.
    pub fn in_scene(mut table: toml::Table, name: &str, scene: &Scene) -> Result<(Setup, Option<String>)> {
        shape::rename(&mut table);
        shape::check(&table)?;
        rename_views(&mut table);
        let suited = match (table.get("light"), table.get("technique")) {
            (None, id) => suited_light(name, scene, &[id.and_then(|id| id.as_str()).unwrap_or(DEFAULT_TECHNIQUE)]),
            _ => None,
        };
        table.insert("scene".into(), name.into());
        place::take_off(&mut table, scene.origin);
        let number = |key: &str| table.get(key).and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)));
        let (animation, time) = (number("animation").unwrap_or_default(), number("time").unwrap_or_default());
        let clock = Clock { animation: animation as u32, time: time as f32 };
        for key in ["camera", "shadow_camera"] {
            let camera = match table.get(key) {
                Some(toml::Value::String(name)) => scene_camera(scene, name, clock)?,
                None if key == "camera" => scene.cameras[0].at(scene, clock),
                _ => continue,
            };
            table.insert(key.into(), toml::Value::try_from(camera)?);
        }
        let light = match table.get("light") {
            Some(toml::Value::String(name)) => Some(scene_light(scene, name, clock)?),
            None => Some(scene.lights[suited.as_ref().map_or(0, |s| s.0)].at(scene, clock)),
            Some(_) => None,
        };
        if let Some(light) = light {
            table.insert("light".into(), toml::Value::try_from(light)?);
        }
        for lamp in table.get_mut("more_lights").and_then(toml::Value::as_array_mut).into_iter().flatten() {
            if let toml::Value::String(name) = lamp {
                let light = scene_light(scene, name, clock)?;
                *lamp = toml::Value::try_from(Lamp { on: true, light })?;
            }
        }
        let mut setup = Setup::deserialize(toml::Value::Table(table)).map_err(|e| one_line(&e.to_string()))?;
        setup.unit = scene.unit();
        setup.complete();
        setup.check()?;
        setup.widen();
        let animations = scene.animations.len().max(1);
        ensure!(
            (setup.animation as usize) < animations,
            "animation = {} is not allowed; {} takes 0 to {}",
            setup.animation,
            setup.scene,
            animations - 1
        );
        Ok((setup, suited.and_then(|s| s.1)))
    }

    /// The set-up as TOML text for a file: the path of its scene counts from that file's folder.
    pub fn to_toml(&self, file: &Path) -> Result<String> {
        let mut setup = self.clone();
        setup.scene = from_folder_of(file, &self.scene);
        setup.text().context("the set-up cannot be written as TOML")
    }

    /// Fills in the defaults of the selected technique's parameters, so that a saved set-up holds them all.
    pub fn complete(&mut self) {
        if let Some(info) = techniques::find(&self.technique) {
            info.fill(self.params.entry(self.technique.clone()).or_default(), self.unit);
        }
        self.against.iter_mut().for_each(|side| side.complete(self.unit));
    }

    /// Takes another scene's unit over. Lengths that stand at their defaults take those of the new one.
    pub fn take_unit(&mut self, unit: f64) {
        let before = std::mem::replace(&mut self.unit, unit);
        if before == unit {
            return;
        }
        let chosen = |technique: &str, values: &mut Values| {
            let specs = techniques::find(technique).into_iter().flat_map(|i| i.specs());
            for spec in specs.filter(|s| s.default_in(before) != s.default_in(unit)) {
                if values.get(spec.name) == Some(&spec.default_in(before)) {
                    values.remove(spec.name);
                }
            }
        };
        self.params.iter_mut().for_each(|(technique, values)| chosen(technique, values));
        self.against.iter_mut().for_each(|side| chosen(&side.technique, &mut side.params));
        self.complete();
    }

    /// The set-up of one technique alone, with nothing over it: what is measured.
    pub fn alone(&self) -> Setup {
        Setup { against: Vec::new(), arrange: Arrange::Swipe, front: 0, overlay: None, ..self.clone() }
    }

    /// What is measured of a set-up: its technique alone, shaded, with maps fitted to the camera that looks.
    pub fn measured(&self) -> Setup {
        let view = default_view();
        Setup {
            view,
            legend: false,
            supersample: one(),
            transparent: false,
            crop: None,
            shadow_camera: None,
            outlines: false,
            error_dilation: 0,
            error_base: Base::Dark,
            ..self.alone()
        }
    }

    /// The set-up of one side of the comparison, alone; the first is 0. The truth has that of the first.
    pub fn side(&self, i: usize) -> Setup {
        let mut setup = self.alone();
        setup.overlay = self.overlay.clone();
        if let Some(side) = i.checked_sub(1).and_then(|i| self.against.get(i)).filter(|s| !s.is_truth()) {
            setup.technique = side.technique.clone();
            setup.params.insert(side.technique.clone(), side.params.clone());
        }
        setup
    }

    /// A technique beside the others, with what was set of it before.
    ///
    /// # Errors
    /// No technique of that name.
    pub fn kept(&self, technique: &str) -> Result<Side> {
        let mut side = Side::new(technique)?;
        side.params = self.params.get(technique).cloned().unwrap_or_default();
        side.complete(self.unit);
        Ok(side)
    }

    /// Sides of the comparison; 1 without one.
    pub fn sides(&self) -> usize {
        1 + self.against.len()
    }

    /// The technique of a side; None: it is the truth.
    pub fn info(&self, side: usize) -> Option<&'static Info> {
        match side.checked_sub(1) {
            None => techniques::find(&self.technique),
            Some(i) => self.against.get(i).and_then(Side::info),
        }
    }

    /// A view that every technique has, or that of one of the sides; another side without it is drawn shaded.
    pub fn find_view(&self, id: &str) -> Option<&'static View> {
        (0..self.sides()).find_map(|side| self.view_of(side, id))
    }

    /// A view of a side's technique; the truth has those that every technique has.
    pub fn view_of(&self, side: usize, id: &str) -> Option<&'static View> {
        let values = match side.checked_sub(1) {
            None => self.values(),
            Some(i) => &self.against.get(i)?.params,
        };
        match self.info(side) {
            Some(info) => view::find(id, info, values),
            None => view::VIEWS.iter().find(|v| v.id == id),
        }
    }

    /// Samples per pixel of the truth that all sides are held against: the most that one of them asks for.
    pub fn shown_samples(&self) -> u32 {
        let own = (self.info(0), self.values());
        let others = self.against.iter().filter(|side| !side.is_truth()).map(|side| (side.info(), &side.params));
        let shown = |(info, values): (Option<_>, _)| Some(self.truth_samples.shown(&self.light, info?, values));
        std::iter::once(own).chain(others).filter_map(shown).max().unwrap_or(1)
    }

    /// Whether a side is the truth.
    pub fn is_truth(&self, side: usize) -> bool {
        side.checked_sub(1).and_then(|i| self.against.get(i)).is_some_and(Side::is_truth)
    }

    /// Whether the picture needs the truth.
    pub fn needs_truth(&self) -> bool {
        let shown = match &self.overlay {
            Some(overlay) => &overlay.view,
            None => &self.view,
        };
        let other = shown == "difference" && !self.against.is_empty();
        self.against.iter().any(Side::is_truth) || view::needs_truth(shown) && !other
    }

    /// Turns the whole numbers of a file into floats where a parameter is one.
    fn widen(&mut self) {
        let sides = self.against.iter_mut().map(|s| (&s.technique, &mut s.params));
        for (id, values) in self.params.iter_mut().chain(sides) {
            for spec in techniques::find(id).into_iter().flat_map(|i| i.specs()) {
                if let (Kind::Float { .. }, Some(Value::Int(v))) = (spec.kind, values.get(spec.name)) {
                    values.insert(spec.name.into(), Value::Float(*v as f64));
                }
            }
        }
    }

    /// The set-up without technique, parameters and view: what the configurations of one sweep share.
    pub fn around(&self) -> Setup {
        Setup {
            technique: String::new(),
            view: String::new(),
            split: 0.0,
            error_dilation: 0,
            error_base: Base::Dark,
            error_window: default_window(),
            supersample: one(),
            transparent: false,
            crop: None,
            probe: middle(),
            params: BTreeMap::new(),
            path: None,
            ..self.alone()
        }
    }

    /// Selects a technique by its id.
    pub fn select(&mut self, technique: &str) -> Result<()> {
        techniques::find_or_say(technique)?;
        self.technique = technique.into();
        self.complete();
        Ok(())
    }

    /// Applies `key=value` or `technique.key=value`; a bare key goes to the techniques in `to` that have it.
    pub fn set(&mut self, assignment: &str, to: &[String]) -> Result<()> {
        let Some((key, text)) = assignment.split_once('=') else {
            bail!("--set {assignment}: write it as key=value or technique.key=value");
        };
        let (wanted, name) = match key.split_once('.') {
            Some((technique, name)) => (vec![technique.to_string()], name),
            None => (to.to_vec(), key),
        };
        let mut found = false;
        for id in &wanted {
            let info = techniques::find_or_say(id)?;
            if let Some(spec) = info.specs().find(|s| s.name == name) {
                let value = spec.parse(&format!("{id}.{name}"), text)?;
                self.params.entry(id.clone()).or_default().insert(name.into(), value);
                found = true;
            }
        }
        if !found {
            let mut names = BTreeSet::new();
            for id in &wanted {
                names.extend(techniques::find_or_say(id)?.specs().map(|s| s.name));
            }
            let names: Vec<&str> = names.into_iter().collect();
            bail!("--set {assignment}: {} has no parameter {name}; there are {}", wanted.join(", "), names.join(", "));
        }
        Ok(())
    }

    /// The moment of the scene's animation.
    pub fn clock(&self) -> Clock {
        Clock { animation: self.animation, time: self.time }
    }

    /// Sets the scene's clock. Camera and lights that are the scene's own follow its animation; others stay, and so does the
    /// shadow camera, which is left behind.
    pub fn set_clock(&mut self, scene: &Scene, to: Clock) {
        let way = [self.clock(), to];
        (self.animation, self.time) = (to.animation, to.time);
        self.camera = scene.follow_camera(self.camera, way);
        let lights = self.more_lights.iter_mut().map(|lamp| &mut lamp.light).chain([&mut self.light]);
        lights.for_each(|light| *light = scene.follow_light(*light, way));
    }

    /// The camera that maps are fitted to, where it is not the one that looks.
    pub fn frozen(&self) -> Option<Camera> {
        self.shadow_camera.filter(|c| *c != self.camera)
    }

    /// The selected technique's values.
    pub fn values(&self) -> &Values {
        static NONE: Values = Values::new();
        self.params.get(&self.technique).unwrap_or(&NONE)
    }

    /// The selected technique's values that mean something beside each other. That it has no contact shadows is not among them.
    pub fn meaningful(&self) -> Values {
        let Some(info) = techniques::find(&self.technique) else { return self.values().clone() };
        let off = !contact::wanted(self.values());
        let applies = |name: &str| {
            !(off && name == "contact") && info.specs().any(|s| s.name == name && info.applies(s, self.values()))
        };
        self.values().iter().filter(|(name, _)| applies(name)).map(|(n, v)| (n.clone(), v.clone())).collect()
    }

    /// Checks every range.
    pub fn check(&self) -> Result<()> {
        let info = techniques::find_or_say(&self.technique)?;
        // Of a comparison one side's view is enough.
        let has = |id: &str| if self.find_view(id).is_some() { Ok(()) } else { view::check(id, info, self.values()) };
        has(&self.view)?;
        in_range("split", self.split, 0.0, 1.0, "")?;
        self.probe.iter().try_for_each(|share| in_range("probe", *share, 0.0, 1.0, ""))?;
        ensure!(self.against.len() < 4, "there are {} sides in against; at most 3 can be shown", self.against.len());
        let truth = self.against.iter().find(|side| side.is_truth() && !side.params.is_empty());
        ensure!(truth.is_none(), "against: the truth has no parameters, but some are given");
        ensure!(
            (self.front as usize) < self.sides(),
            "front = {} is not allowed; there are {} sides",
            self.front,
            self.sides()
        );
        if let Some(overlay) = &self.overlay {
            has(&overlay.view).context("overlay")?;
            ensure!(
                overlay.view != "difference" || self.against.is_empty(),
                "overlay.view = difference is not allowed in a comparison; take it as the view"
            );
            in_range("overlay.opacity", overlay.opacity, 0.0, 1.0, "")?;
        }
        in_range("time", self.time, 0.0, 1e6, " s")?;
        for side in self.size {
            ensure!(
                (1..=MAX_SIZE).contains(&side),
                "size = [{}, {}] is not allowed; each side takes 1 to {MAX_SIZE} pixels",
                self.size[0],
                self.size[1]
            );
        }
        self.check_shown()?;
        ensure!(
            self.error_dilation <= MAX_DILATION,
            "error_dilation = {} is not allowed; it takes 0 to {MAX_DILATION} pixels",
            self.error_dilation
        );
        ensure!(
            self.error_window % 2 == 1 && self.error_window <= MAX_WINDOW,
            "error_window = {} is not allowed; it takes an odd number from 1 to {MAX_WINDOW} pixels",
            self.error_window
        );
        check_camera("camera", &self.camera)?;
        self.shadow_camera.map_or(Ok(()), |c| check_camera("shadow_camera", &c))?;
        let count = self.light_count();
        ensure!(count <= MOST_LIGHTS, "more_lights: {count} lights are too many; a set-up takes up to {MOST_LIGHTS}");
        ensure!(
            (1..=count).contains(&(self.light_number as usize)),
            "light_number = {} is not allowed; it takes 1 to {count}, the number of lights",
            self.light_number
        );
        check_light("light", &self.light)?;
        self.more_lights.iter().try_for_each(|lamp| check_light("more_lights", &lamp.light))?;
        self.path.as_ref().map_or(Ok(()), |p| p.check(&self.light))?;
        let own = self.params.iter().map(|(id, values)| (format!("params.{id}"), id, values));
        let sides = self.against.iter().filter(|s| !s.is_truth());
        for (path, id, values) in own.chain(sides.map(|s| ("against.params".into(), &s.technique, &s.params))) {
            let info = techniques::find_or_say(id)?;
            for (name, value) in values {
                let key = format!("{path}.{name}");
                match info.specs().find(|s| s.name == name) {
                    Some(spec) => spec.check(&key, value)?,
                    None => {
                        let names: Vec<&str> = info.specs().map(|s| s.name).collect();
                        bail!("{} is unknown; {id} has {}", message::shortened(&key), names.join(", "))
                    }
                };
            }
        }
        Ok(())
    }
}

fn check_light(key: &str, light: &Light) -> Result<()> {
    let limits =
        |name: &str, value, [least, most]: [f32; 2], unit| in_range(&format!("{key}.{name}"), value, least, most, unit);
    let (position, direction, range, color) = match *light {
        Light::Directional { to_light, angular_radius, color } => {
            limits("angular_radius", angular_radius, [0.0, MAX_RADIUS], "°")?;
            check_direction(&format!("{key}.to_light"), to_light)?;
            (Vec3::ZERO, to_light, 1.0, color)
        }
        Light::Spot { position, direction, outer_angle, range, radius, color } => {
            limits("outer_angle", outer_angle, [0.1, 89.0], "°")?;
            limits("radius", radius, [0.0, MAX_RADIUS], " m")?;
            (position, direction, range, color)
        }
        Light::Omni { position, range, radius, color } => {
            limits("radius", radius, [0.0, MAX_RADIUS], " m")?;
            (position, Vec3::Y, range, color)
        }
        Light::Hemisphere { position, direction, range, color } => (position, direction, range, color),
        Light::RectArea { center, half_u, half_v, range, color } => {
            check_place(&format!("{key}.half_u"), half_u)?;
            check_place(&format!("{key}.half_v"), half_v)?;
            check_place(&format!("{key}.center"), center)?;
            let spans = half_u.cross(half_v).try_normalize().is_some();
            ensure!(spans, "{key}.half_u and half_v must span a rectangle of some area");
            (center, Vec3::Y, range, color)
        }
    };
    check_place(&format!("{key}.position"), position)?;
    check_direction(&format!("{key}.direction"), direction)?;
    limits("range", range, [1e-6, 1e9], " m")?;
    ensure!(color.is_finite() && color.min_element() >= 0.0, "{key}.color = {color} must be three numbers from 0 up");
    Ok(())
}

/// What gives a camera's picture its shape.
pub(crate) fn check_shape(key: &str, up: Vec3, fov: f32, height: Option<f32>) -> Result<()> {
    check_direction(&format!("{key}.up"), up)?;
    in_range(&format!("{key}.fov"), fov, 1.0, 170.0, "°")?;
    height.map_or(Ok(()), |height| in_range(&format!("{key}.height"), height, 1e-6, 1e9, " m"))
}

fn check_camera(key: &str, c: &Camera) -> Result<()> {
    check_shape(key, c.up, c.fov, c.height)?;
    in_range(&format!("{key}.near"), c.near, 1e-6, 1e9, " m")?;
    check_place(&format!("{key}.position"), c.position)?;
    check_place(&format!("{key}.target"), c.target)?;
    ensure!(c.far > c.near && c.far.is_finite(), "{key}.far = {} must be greater than {key}.near = {}", c.far, c.near);
    ensure!(c.position != c.target, "{key}.target must differ from {key}.position");
    Ok(())
}

/// Views of older files: `split` is a comparison with the truth, what showed one cause shows all.
fn rename_views(table: &mut toml::Table) {
    let view = table.get("view").and_then(|v| v.as_str());
    if matches!(view, Some("acne" | "detachment")) {
        table.insert("view".into(), "causes".into());
    } else if view == Some("split") {
        table.insert("view".into(), default_view().into());
        let truth = toml::Table::from_iter([("technique".to_string(), Side::TRUTH.into())]);
        table.insert("against".into(), toml::Value::Array(vec![truth.into()]));
    }
}

/// A number as people write it: 1e30, not thirty zeros.
fn short(x: f32) -> String {
    let plain = x == 0.0 || (1e-4..1e7).contains(&x.abs()) || !x.is_finite();
    if plain { x.to_string() } else { format!("{x:e}") }
}

fn short_all(v: Vec3) -> String {
    format!("[{}]", v.to_array().map(short).join(", "))
}

fn in_range(key: &str, value: f32, min: f32, max: f32, unit: &str) -> Result<()> {
    let [given, least, most] = [value, min, max].map(short);
    ensure!((min..=max).contains(&value), "{key} = {given} is not allowed; it takes {least} to {most}{unit}");
    Ok(())
}

/// Refuses places farther than [`FARTHEST`].
pub(crate) fn check_place(key: &str, value: Vec3) -> Result<()> {
    let given = short_all(value);
    ensure!(value.is_finite(), "{key} = {given} is not allowed; it takes three finite numbers");
    ensure!(
        value.abs().max_element() <= FARTHEST,
        "{key} = {given} is not allowed; it takes three numbers from -{FARTHEST:e} to {FARTHEST:e}"
    );
    Ok(())
}

/// As [`check_place`]; and what is zero, or nearly, points nowhere.
pub(crate) fn check_direction(key: &str, value: Vec3) -> Result<()> {
    check_place(key, value)?;
    ensure!(value.try_normalize().is_some(), "{key} = {} must not be zero or as good as zero", short_all(value));
    Ok(())
}

/// Folds a parser's message of several lines into one sentence.
pub(crate) fn one_line(message: &str) -> anyhow::Error {
    let lines = message.lines().map(str::trim).filter(|l| !l.is_empty() && *l != "|" && !l.contains("| ^"));
    let lines = lines.map(|line| message::cut(line, 200));
    anyhow::anyhow!("{}", lines.collect::<Vec<_>>().join(" "))
}

/// Loads a built-in scene or a file, with the cameras and lights of the presets beside it.
pub fn load_scene(name: &str) -> Result<Scene> {
    if let Some(scene) = builtin::build(name) {
        return Ok(scene);
    }
    let path = files::path_of(name);
    ensure!(
        formats::is_named(&path) || path.exists(),
        "{} is neither a built-in scene ({}) nor a file; those of scenes end in .{}, set-ups in .toml, captures in .png",
        message::shortened(name),
        builtin::NAMES.join(", "),
        formats::ENDINGS.join(", .")
    );
    let mut scene = formats::load(&path)?;
    presets::add(&mut scene, &path)?;
    Ok(scene)
}

/// The place of a glTF file's light to begin with where its first gives none, or where that is not served by all of these techniques: the
/// next that does and is, or is at least by one; with what is to be said of it.
fn suited_light(name: &str, scene: &Scene, techniques: &[&str]) -> Option<(usize, Option<String>)> {
    if techniques.is_empty() || builtin::is_builtin(name) {
        return None;
    }
    let infos: Vec<&Info> = techniques.iter().filter_map(|id| techniques::find(id)).collect();
    let shines = |l: &NamedLight| l.light.color() != Vec3::ZERO;
    let by_all = |l: &NamedLight| shines(l) && infos.iter().all(|info| info.refuses(&l.light).is_none());
    let by_one = |l: &NamedLight| shines(l) && infos.iter().any(|info| info.refuses(&l.light).is_none());
    let first = scene.lights.first()?;
    let found = scene.lights.iter().position(by_all).or_else(|| scene.lights.iter().position(by_one))?;
    let note = (found > 0).then(|| {
        let refused = || infos.iter().find_map(|info| info.refuses(&first.light));
        let why = if shines(first) { refused().unwrap_or_default() } else { "it stays dark".into() };
        let name = &scene.lights[found].name;
        format!("Light comes from {name:?} instead of {:?} ({why}).", first.name)
    });
    Some((found, note))
}

/// The table of a set-up's text, with the names that its keys have now.
pub(crate) fn read_table(text: &str) -> Result<toml::Table> {
    let mut table: toml::Table = toml::from_str(text).map_err(|e| one_line(&e.to_string()))?;
    shape::rename(&mut table);
    Ok(table)
}

/// Lays a table over another: what both have as tables is mixed, unless the new one is `whole`; the rest is replaced.
pub(crate) fn lay_over(held: &mut toml::Table, by: &toml::Table, whole: &dyn Fn(&str, &toml::Table) -> bool) {
    for (key, value) in by {
        match (held.get_mut(key), value) {
            (Some(toml::Value::Table(held)), toml::Value::Table(new)) if !whole(key, new) => lay_over(held, new, whole),
            _ => _ = held.insert(key.clone(), value.clone()),
        }
    }
}

/// The scene that a table names.
pub(crate) fn scene_name(table: &toml::Table) -> Result<&str> {
    table
        .get("scene")
        .and_then(|v| v.as_str())
        .context("the key scene is missing; give a built-in scene's name or the path of a scene's file")
}

/// A scene's name as it counts from the folder of a file that is or will be there.
pub(crate) fn from_folder_of(file: &Path, name: &str) -> String {
    if !builtin::is_builtin(name)
        && let (Ok(scene), Some(folder)) = (files::path_of(name).canonicalize(), resolved_folder(file))
        && let Some(path) = pathdiff::diff_paths(scene, folder)
    {
        let path = files::name_of(path.as_os_str());
        // Slashes are understood everywhere.
        return if cfg!(windows) { path.replace('\\', "/") } else { path };
    }
    name.into()
}

/// A scene's name as a set-up in `folder` means it: a path counts from there if such a file exists.
pub(crate) fn beside(name: &str, folder: &Path) -> String {
    let path = folder.join(files::path_of(name));
    if !builtin::is_builtin(name) && path.exists() { files::name_of(path.as_os_str()) } else { name.into() }
}

/// The folder that a file is in or will be in, without links.
fn resolved_folder(file: &Path) -> Option<PathBuf> {
    let folder = std::path::absolute(file).ok()?.parent()?.to_path_buf();
    let there = folder.ancestors().find(|at| at.exists())?;
    Some(there.canonicalize().ok()?.join(folder.strip_prefix(there).ok()?))
}

/// One of the scene's cameras by name, as it stands at a moment.
pub fn scene_camera(scene: &Scene, name: &str, clock: Clock) -> Result<Camera> {
    match scene.cameras.iter().find(|c| c.name == name) {
        Some(c) => Ok(c.at(scene, clock)),
        None => {
            let names = message::list(scene.cameras.iter().map(|c| c.name.as_str()));
            bail!("{} has no camera named {}; there are {names}", scene.name, message::shortened(name))
        }
    }
}

/// One of the scene's lights by name, as it stands at a moment.
pub fn scene_light(scene: &Scene, name: &str, clock: Clock) -> Result<Light> {
    match scene.lights.iter().find(|l| l.name == name) {
        Some(l) => Ok(l.at(scene, clock)),
        None => {
            let names = message::list(scene.lights.iter().map(|l| l.name.as_str()));
            bail!("{} has no light named {}; there are {names}", scene.name, message::shortened(name))
        }
    }
}

/// Reads `--camera` and its like: a name, for that camera at a moment, or `px,py,pz:tx,ty,tz:fov` in the scene's own coordinates (near and far then follow the scene's
/// first camera), with `height=` metres instead of a field of view for an orthographic camera, and behind it what is up, and `near=` and `far=`.
pub fn parse_camera(scene: &Scene, text: &str, clock: Clock) -> Result<Camera> {
    let parts: Vec<&str> = text.split(':').collect();
    if !(3..=7).contains(&parts.len()) || scene.cameras.iter().any(|c| c.name == text) {
        return scene_camera(scene, text, clock);
    }
    let form = || {
        format!(
            "the camera {text} cannot be read: write it as NAME, px,py,pz:tx,ty,tz:fov or px,py,pz:tx,ty,tz:height=metres, and behind it \
             :ux,uy,uz for what is up, :near=metres and :far=metres"
        )
    };
    let first = scene.cameras[0].camera;
    let place = |text| anyhow::Ok((parse_vec3(text)? - scene.origin).as_vec3());
    let (position, target) = (place(parts[0]).with_context(form)?, place(parts[1]).with_context(form)?);
    let mut camera = Camera { position, target, up: Vec3::Y, height: None, ..first };
    match parts[2].strip_prefix("height=") {
        Some(height) => camera.height = Some(height.parse().with_context(form)?),
        None => camera.fov = parts[2].parse().with_context(form)?,
    }
    for part in &parts[3..] {
        match part.split_once('=') {
            Some(("near", near)) => camera.near = near.parse().with_context(form)?,
            Some(("far", far)) => camera.far = far.parse().with_context(form)?,
            // Of an orthographic camera: for when it is one no more.
            Some(("fov", fov)) => camera.fov = fov.parse().with_context(form)?,
            Some(_) => bail!(form()),
            None => camera.up = parse_vec3(part).with_context(form)?.as_vec3(),
        }
    }
    Ok(camera)
}

/// Reads `--light` and `--add-light`: a name, `NAME:key=value;…` for that light changed, or `KIND:key=value;…` with the keys of the set-up's `[light]` table.
pub fn parse_light(scene: &Scene, text: &str, clock: Clock) -> Result<Light> {
    let named = scene.lights.iter().any(|l| l.name == text);
    let Some((kind, rest)) = text.split_once(':').filter(|_| !named) else {
        return scene_light(scene, text, clock);
    };
    // A light of the scene by name, of which some values are others; a kind's name means the kind.
    let held =
        scene.lights.iter().filter(|_| !KINDS.contains(&kind)).find(|l| l.name == kind).map(|l| l.at(scene, clock));
    let mut table = toml::Table::new();
    table.insert("kind".into(), held.map_or(kind, |l| l.kind()).into());
    for pair in rest.split(';').filter(|p| !p.is_empty()) {
        let (key, value) = pair
            .split_once('=')
            .with_context(|| format!("--light {text}: write it as NAME, NAME:key=value;… or KIND:key=value;…"))?;
        let numbers: Vec<f64> = value
            .split(',')
            .map(|n| n.trim().parse())
            .collect::<Result<_, _>>()
            .with_context(|| format!("--light {text}: {value} is not a number or three"))?;
        let value = if let [one] = numbers[..] { one.into() } else { numbers.into() };
        table.insert(key.trim().into(), value);
    }
    let held = held.map(toml::Value::try_from).transpose()?;
    let filled = |mut table: toml::Table| {
        for (key, value) in held.iter().filter_map(toml::Value::as_table).flatten() {
            table.entry(key.clone()).or_insert(value.clone());
        }
        table
    };
    shape::check_light(&filled(table.clone())).with_context(|| format!("--light {text}"))?;
    // What the scene's light holds is taken off already.
    place::take_off_light(&mut table, scene.origin);
    let table = filled(table);
    Light::deserialize(toml::Value::Table(table)).map_err(|e| one_line(&format!("--light {text}: {e}")))
}

/// Reads `--own-path`: the table `path` of a set-up's file, in one line.
pub fn parse_path(scene: &Scene, text: &str) -> Result<Arc<OwnPath>> {
    let told = || format!("--own-path {}", message::shortened(text));
    let mut table: toml::Table =
        toml::from_str(&format!("path = {text}")).map_err(|e| one_line(&e.to_string())).with_context(told)?;
    shape::check(&table).with_context(told)?;
    place::take_off(&mut table, scene.origin);
    let path = table.remove("path").with_context(told)?;
    let path = OwnPath::deserialize(path).map_err(|e| one_line(&e.to_string())).with_context(told)?;
    Ok(Arc::new(path))
}

fn parse_vec3(text: &str) -> Result<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>()?;
    ensure!(numbers.len() == 3, "{text} is not three numbers");
    Ok(DVec3::from_slice(&numbers))
}
