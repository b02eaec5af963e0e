//! A set-up as the command that captures it.

use super::{Arrange, Base, Setup, Side};
use crate::files;
use crate::params::Values;
use crate::scene::{Camera, Scene, builtin};
use crate::techniques;
use anyhow::{Context, Result, bail};
use toml::{Table, Value};

impl Setup {
    /// A command for a POSIX shell that draws the set-up's picture into a file, byte for byte. It says what differs from what the scene
    /// starts with, and leaves out what the picture does not show: parameters of techniques that are not in it.
    ///
    /// # Errors
    /// A scene whose path is no text.
    pub fn command(&self, scene: &Scene, file: &str) -> Result<String> {
        let mut words = vec!["shadowscope".to_string(), "capture".into()];
        words.extend(self.arguments(scene)?);
        words.extend(["-o".to_string(), file.into()]);
        let quoted = words.iter().map(|word| shlex::try_quote(word)).collect::<Result<Vec<_>, _>>();
        Ok(quoted.context("a command holds no zero bytes")?.join(" "))
    }

    fn arguments(&self, scene: &Scene) -> Result<Vec<String>> {
        let mut plain = Setup::new(&self.scene, scene)?;
        plain.set_clock(scene, self.clock());
        // With the numbers that a file would have.
        let table: Table = toml::from_str(&self.text().context("the set-up cannot be written as TOML")?)?;
        let mut out = vec![named(&self.scene)?];
        let mut add = |option: &str, value: String| out.extend([format!("--{option}"), value]);
        if self.animation != 0 {
            add("animation", self.animation.to_string());
        }
        if self.time != 0.0 {
            add("time", self.time.to_string());
        }
        if self.size != plain.size {
            add("size", format!("{}x{}", self.size[0], self.size[1]));
        }
        if self.technique != plain.technique {
            add("technique", self.technique.clone());
        }
        if self.view != plain.view {
            add("view", self.view.clone());
        }
        for (option, camera, usual) in [
            ("camera", Some(self.camera), plain.camera),
            ("shadow-camera", self.shadow_camera.filter(|c| *c != self.camera), self.camera),
        ] {
            if let Some(camera) = camera.filter(|camera| *camera != usual) {
                let table = table.get(&option.replace('-', "_")).and_then(Value::as_table);
                add(option, camera_text(&camera, table.context("a camera is missing")?, self, scene));
            }
        }
        self.lamp_arguments(scene, &plain, &table, &mut add);
        if self.truth_samples != plain.truth_samples {
            add("truth-samples", self.truth_samples.to_string());
        }
        for assignment in self.changed(&self.technique, self.values()) {
            add("set", assignment);
        }
        for side in &self.against {
            add("against", self.side_text(side));
        }
        if self.arrange != plain.arrange {
            add("arrange", Arrange::id(self.arrange).into());
        }
        if self.split != plain.split {
            add("split", self.split.to_string());
        }
        if self.front != plain.front {
            add("front", self.front.to_string());
        }
        if let Some(o) = &self.overlay {
            add(if o.inset { "inset" } else { "overlay" }, format!("{}:{}", o.view, o.opacity));
        }
        if self.error_dilation != plain.error_dilation {
            add("error-dilation", self.error_dilation.to_string());
        }
        if self.error_base == Base::Light {
            add("error-base", "light".into());
        }
        if self.error_window != plain.error_window {
            add("error-window", self.error_window.to_string());
        }
        if self.probe != plain.probe {
            add("probe", numbers(self.probe));
        }
        if self.seed != plain.seed {
            add("seed", self.seed.to_string());
        }
        if self.supersample != plain.supersample {
            add("supersample", self.supersample.to_string());
        }
        if let Some(crop) = self.crop {
            add("crop", numbers(crop));
        }
        if let Some(path) = table.get("path") {
            add("own-path", path.to_string());
        }
        let flags = [("legend", self.legend), ("outlines", self.outlines), ("transparent", self.transparent)];
        out.extend(flags.into_iter().filter(|(_, on)| *on).map(|(name, _)| format!("--{name}")));
        Ok(out)
    }

    /// The lights: the first by `--light`, the others behind it.
    fn lamp_arguments(&self, scene: &Scene, plain: &Setup, table: &Table, add: &mut impl FnMut(&str, String)) {
        let lamps = self.lamps();
        let mut tables: Vec<Value> = table.get("more_lights").and_then(Value::as_array).cloned().unwrap_or_default();
        if let Some(own) = table.get("light") {
            tables.insert(self.at_work().min(tables.len()), own.clone());
        }
        // A scene's file may begin with another light than its first.
        let first = builtin::is_builtin(&self.scene) && lamps.len() == 1 && lamps[0].light == plain.light;
        for (i, (lamp, table)) in lamps.iter().zip(&tables).enumerate().filter(|(i, _)| *i > 0 || !first) {
            let own = scene.lights.iter().find(|l| l.at(scene, self.clock()) == lamp.light);
            let own = own.filter(|l| {
                scene.lights.iter().find(|other| other.name == l.name).is_some_and(|f| std::ptr::eq(f, *l))
            });
            let own = own.filter(|l| l.name != "all");
            let text = own.map_or_else(|| light_text(table), |l| l.name.clone());
            add(if i == 0 { "light" } else { "add-light" }, text);
        }
        let off: Vec<String> =
            (1..).zip(&lamps).filter(|(_, lamp)| !lamp.on).map(|(i, _): (usize, _)| i.to_string()).collect();
        if !off.is_empty() {
            add("lights-off", off.join(","));
        }
        if self.at_work() > 0 {
            add("choose-light", (self.at_work() + 1).to_string());
        }
    }

    /// What of a technique's values is not as it is by default, `name=value` each.
    fn changed(&self, technique: &str, values: &Values) -> Vec<String> {
        let specs = techniques::find(technique).into_iter().flat_map(|info| info.specs());
        let changed = specs.filter_map(|spec| {
            let value = values.get(spec.name).filter(|value| **value != spec.default_in(self.unit))?;
            Some(format!("{}={value}", spec.name))
        });
        changed.collect()
    }

    fn side_text(&self, side: &Side) -> String {
        let changed = self.changed(&side.technique, &side.params);
        if changed.is_empty() { side.technique.clone() } else { format!("{}:{}", side.technique, changed.join(";")) }
    }
}

/// What a scene is called from any folder.
fn named(scene: &str) -> Result<String> {
    if builtin::is_builtin(scene) {
        return Ok(scene.into());
    }
    let path = std::path::absolute(files::path_of(scene)).with_context(|| format!("{scene} cannot be found"))?;
    match path.to_str() {
        Some(text) => Ok(text.into()),
        None => bail!(
            "the path of {scene} has bytes that are no text, which a command cannot hold; save the set-up instead"
        ),
    }
}

fn numbers<const N: usize>(all: [f32; N]) -> String {
    all.map(|x| x.to_string()).join(",")
}

/// The numbers of a table's key, as an option has them.
fn values(table: &Table, key: &str) -> String {
    match table.get(key) {
        Some(Value::Array(all)) => all.iter().map(number).collect::<Vec<_>>().join(","),
        Some(one) => number(one),
        None => String::new(),
    }
}

fn number(value: &Value) -> String {
    value.as_float().map_or_else(|| value.to_string(), |x| x.to_string())
}

/// As `--camera` has it: the name of one of the scene's, or all that differs from its first.
fn camera_text(camera: &Camera, table: &Table, setup: &Setup, scene: &Scene) -> String {
    let named = scene.cameras.iter().find(|c| c.at(scene, setup.clock()) == *camera);
    let first = |name: &str| scene.cameras.iter().find(|c| c.name == name);
    if let Some(named) = named.filter(|named| first(&named.name).is_some_and(|f| std::ptr::eq(f, *named))) {
        return named.name.clone();
    }
    let usual = scene.cameras[0].camera;
    let shape =
        if camera.height.is_some() { format!("height={}", values(table, "height")) } else { values(table, "fov") };
    let mut text = format!("{}:{}:{shape}", values(table, "position"), values(table, "target"));
    if let Some(Value::Array(_)) = table.get("up") {
        text += &format!(":{}", values(table, "up"));
    }
    for (key, other) in [
        ("fov", camera.height.is_some() && camera.fov != usual.fov),
        ("near", camera.near != usual.near),
        ("far", camera.far != usual.far),
    ] {
        if other {
            text += &format!(":{key}={}", values(table, key));
        }
    }
    text
}

/// As `--light` has it.
fn light_text(table: &Value) -> String {
    let Some(table) = table.as_table() else { return String::new() };
    let kind = table.get("kind").and_then(Value::as_str).unwrap_or_default();
    let keys = table.keys().filter(|key| !["kind", "on"].contains(&key.as_str()));
    let pairs: Vec<String> = keys.map(|key| format!("{key}={}", values(table, key))).collect();
    format!("{kind}:{}", pairs.join(";"))
}
