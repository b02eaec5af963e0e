//! The types of a set-up file's keys, so that a wrong one is refused by name, value and range.

use super::Arrange;
use crate::light::KINDS;
use crate::message::shortened;
use crate::techniques;
use crate::truth::Samples;
use anyhow::{Context, Result, bail};
use toml::{Table, Value};

/// A key, what its value must be, and what it takes in words.
type Rule = (&'static str, fn(&Value) -> bool, &'static str);

fn text(v: &Value) -> bool {
    v.is_str()
}
fn number(v: &Value) -> bool {
    v.is_float() || v.is_integer()
}
fn count(v: &Value) -> bool {
    v.as_integer().is_some_and(|v| (0..=u32::MAX as i64).contains(&v))
}
fn three(v: &Value) -> bool {
    v.as_array().is_some_and(|v| v.len() == 3 && v.iter().all(number))
}
fn two_numbers(v: &Value) -> bool {
    v.as_array().is_some_and(|v| v.len() == 2 && v.iter().all(number))
}

fn four_numbers(v: &Value) -> bool {
    v.as_array().is_some_and(|v| v.len() == 4 && v.iter().all(number))
}

fn two_counts(v: &Value) -> bool {
    v.as_array().is_some_and(|v| v.len() == 2 && v.iter().all(count))
}

fn samples(v: &Value) -> bool {
    v.clone().try_into::<Samples>().is_ok()
}

const TOP: &[Rule] = &[
    ("scene", text, "a built-in scene's name or the path of a scene's file, in quotes"),
    ("time", number, "a number from 0 to 1000000 s"),
    ("animation", count, "a whole number from 0"),
    ("technique", text, "a technique's id, in quotes"),
    ("view", text, "a view's id, in quotes"),
    ("arrange", |v| v.clone().try_into::<Arrange>().is_ok(), "one of swipe, side-by-side, flicker"),
    ("split", number, "a number from 0 to 1"),
    ("front", count, "the number of a side, from 0"),
    ("legend", Value::is_bool, "true or false"),
    ("size", two_counts, "two whole numbers from 1 to 16384 pixels, such as [1280, 720]"),
    ("supersample", count, "1, 2, 3 or 4 pixels across and down"),
    ("transparent", Value::is_bool, "true or false"),
    ("crop", four_numbers, "four numbers from 0 to 1: left, top, width and height as shares of the picture's sides"),
    ("seed", count, "a whole number from 0 to 4294967295"),
    ("truth_samples", samples, Samples::TAKES),
    ("error_dilation", count, "0, 1 or 2 pixels"),
    ("error_base", |v| matches!(v.as_str(), Some("dark" | "light")), "\"dark\" or \"light\""),
    ("error_window", count, "an odd number from 1 to 255 pixels"),
    ("probe", two_numbers, "two numbers from 0 to 1"),
    ("outlines", Value::is_bool, "true or false"),
    ("light_on", Value::is_bool, "true or false"),
    ("light_number", count, "the number of a light, from 1"),
    ("camera", |v| v.is_str() || v.is_table(), "a camera's name, in quotes, or a table"),
    ("shadow_camera", |v| v.is_str() || v.is_table(), "a camera's name, in quotes, or a table"),
    ("light", |v| v.is_str() || v.is_table(), "a light's name, in quotes, or a table"),
    (
        "more_lights",
        |v| v.as_array().is_some_and(|v| v.iter().all(|l| l.is_str() || l.is_table())),
        "a list of lights, each a name, in quotes, or a table as of [light], with on",
    ),
    ("params", Value::is_table, "a table for each technique"),
    ("overlay", Value::is_table, "a table with view, opacity and inset"),
    (
        "against",
        |v| v.as_array().is_some_and(|v| v.iter().all(Value::is_table)),
        "a list of tables with technique and params",
    ),
    ("path", Value::is_table, "a table with keys, as [[path.keys]]"),
];

const PATH: &[Rule] = &[
    ("between", |v| matches!(v.as_str(), Some("smooth" | "linear")), "\"smooth\" or \"linear\""),
    (
        "keys",
        |v| v.as_array().is_some_and(|v| v.iter().all(Value::is_table)),
        "a list of tables with time and camera, light or both, as [[path.keys]]",
    ),
];

const KEY: &[Rule] = &[
    ("time", number, "a number from 0 to 1000000 s"),
    ("camera", Value::is_table, "a table with position, target, up, fov and height"),
    ("light", Value::is_table, "a table with what moves of the light"),
];

const CAMERA: &[Rule] = &[
    ("position", three, "three numbers, metres"),
    ("target", three, "three numbers, metres"),
    ("up", three, "three numbers, a direction"),
    ("fov", number, "a number from 1 to 170°"),
    ("height", number, "a number from 0.000001 to 1000000000 m"),
    ("near", number, "a number from 0.000001 to 1000000000 m"),
    ("far", number, "a number greater than near, metres"),
];

const LIGHT: &[Rule] = &[
    (
        "kind",
        |v| v.as_str().is_some_and(|k| KINDS.contains(&k)),
        "one of directional, spot, omni, hemisphere, rect-area",
    ),
    ("to_light", three, "three numbers, a direction"),
    ("direction", three, "three numbers, a direction"),
    ("position", three, "three numbers, metres"),
    ("center", three, "three numbers, metres"),
    ("half_u", three, "three numbers, metres"),
    ("half_v", three, "three numbers, metres"),
    ("outer_angle", number, "a number from 0.1 to 89°"),
    ("range", number, "a number from 0.000001 to 1000000000 m"),
    ("radius", number, "a number from 0 to 10 m"),
    ("angular_radius", number, "a number from 0 to 10°"),
    ("color", three, "three numbers from 0 up"),
];

/// The keys that a light of each kind needs.
const NEEDED: [&[&str]; 5] = [
    &["to_light"],
    &["position", "direction", "outer_angle", "range"],
    &["position", "range"],
    &["position", "direction", "range"],
    &["center", "half_u", "half_v", "range"],
];

/// The keys that it may have beside these.
const OPTIONAL: [&[&str]; 5] =
    [&["angular_radius", "color"], &["radius", "color"], &["radius", "color"], &["color"], &["color"]];

const OVERLAY: &[Rule] = &[
    ("view", text, "a view's id, in quotes"),
    ("opacity", number, "a number from 0 to 1"),
    ("inset", Value::is_bool, "true or false"),
];

const SIDE: &[Rule] = &[
    ("technique", text, "a technique's id or truth, in quotes"),
    ("params", Value::is_table, "a table of the technique's parameters"),
];
/// Parameters that once had another name: technique, then and now. Files and rows written then still open.
const RENAMED: [(&str, &str, &str); 15] = [
    ("pssm", "delta_bias", "split_bias"),
    ("psm", "delta_mode", "slide"),
    ("psm", "delta", "slide_back"),
    ("psm", "least_near", "min_near"),
    ("psm", "push", "push_near"),
    ("rtw", "p", "power"),
    ("rtw", "k_e", "edge_weight"),
    ("rtw", "tau", "edge_threshold"),
    ("rtw", "k_n", "normal_weight"),
    ("rtw", "importance_resolution", "importance_bins"),
    ("rtw", "sigma", "profile_blur"),
    ("rtw", "e", "floor"),
    ("tsm", "p", "focus_share"),
    ("pssm", "taps", "kernel"),
    ("sdsm", "taps", "kernel"),
];

/// Gives the parameters of a set-up the names that they have now.
pub fn rename(setup: &mut Table) {
    let Some(Value::Table(params)) = setup.get_mut("params") else { return };
    for (id, then, now) in RENAMED {
        if let Some(Value::Table(values)) = params.get_mut(id)
            && let Some(value) = values.remove(then)
        {
            values.entry(now).or_insert(value);
        }
    }
    // Cascades once had a blur of their own, with any number of taps; now pcf is a filter of theirs.
    for id in ["pssm", "sdsm"] {
        let Some(Value::Table(values)) = params.get_mut(id).filter(|values| values.get("filter").is_none()) else {
            continue;
        };
        if values.get("blur").and_then(number_of).is_some_and(|blur| blur > 0.0) {
            values.insert("filter".into(), Value::String("pcf".into()));
        }
        if let Some(Value::Integer(kernel)) = values.get_mut("kernel") {
            *kernel |= 1;
        }
    }
}

fn number_of(v: &Value) -> Option<f64> {
    v.as_float().or_else(|| v.as_integer().map(|v| v as f64))
}

/// Refuses keys that do not exist, and values of the wrong type.
pub fn check(table: &Table) -> Result<()> {
    apply(TOP, table, "")?;
    for key in ["camera", "shadow_camera"] {
        if let Some(Value::Table(camera)) = table.get(key) {
            apply(CAMERA, camera, &format!("{key}."))?;
            need(camera, &["position", "target", shape(camera), "near", "far"], key)?;
        }
    }
    if let Some(Value::Table(light)) = table.get("light") {
        check_light(light)?;
    }
    for lamp in table.get("more_lights").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table) {
        let mut light = lamp.clone();
        if let Some(on) = light.remove("on").filter(|on| !on.is_bool()) {
            bail!("more_lights.on = {} is not allowed; it takes true or false", shortened(&on.to_string()));
        }
        check_light(&light).context("more_lights")?;
    }
    if let Some(Value::Table(overlay)) = table.get("overlay") {
        apply(OVERLAY, overlay, "overlay.")?;
        need(overlay, &["view"], "overlay")?;
    }
    for side in table.get("against").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table) {
        apply(SIDE, side, "against.")?;
        need(side, &["technique"], "a side of against")?;
    }
    if let Some(Value::Table(path)) = table.get("path") {
        check_path(path)?;
    }
    if let Some(Value::Table(params)) = table.get("params") {
        for (id, values) in params {
            let info = techniques::find_or_say(id)?;
            let Some(values) = values.as_table() else {
                let given = shortened(&values.to_string());
                bail!("params.{id} = {given} is not allowed; it takes a table of {id}'s parameters");
            };
            for (name, value) in values {
                if let (Value::Array(_) | Value::Table(_) | Value::Datetime(_), Some(spec)) =
                    (value, info.specs().find(|s| s.name == name))
                {
                    let given = shortened(&value.to_string());
                    bail!("params.{id}.{name} = {given} is not allowed; it takes {}", spec.range());
                }
            }
        }
    }
    Ok(())
}

/// The same for a file of presets; what its lights hold is checked with each.
pub fn check_presets(presets: &Table) -> Result<()> {
    let tables: fn(&Value) -> bool = |v| v.as_array().is_some_and(|v| v.iter().all(Value::is_table));
    apply(
        &[
            ("cameras", tables, "a list of tables, as [[cameras]]"),
            ("lights", tables, "a list of tables, as [[lights]]"),
        ],
        presets,
        "",
    )?;
    let list = |key: &str| presets.get(key).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table);
    let name: Rule = ("name", |v| v.as_str().is_some_and(|name| !name.trim().is_empty()), "a name, in quotes");
    for (i, camera) in list("cameras").enumerate() {
        let whose = format!("camera {}", i + 1);
        apply(&[&[name], CAMERA].concat(), camera, &format!("{whose}: "))?;
        need(camera, &["name", "position", "target", shape(camera)], &whose)?;
    }
    for (i, light) in list("lights").enumerate() {
        let whose = format!("light {}", i + 1);
        need(light, &["name", "kind"], &whose)?;
        let given = Table::from_iter(light.get("name").map(|value| ("name".to_string(), value.clone())));
        apply(&[name], &given, &format!("{whose}: "))?;
    }
    Ok(())
}

/// The same for a path's table; what its lights hold is checked with the light itself.
fn check_path(path: &Table) -> Result<()> {
    apply(PATH, path, "path.")?;
    need(path, &["keys"], "path")?;
    let keys = path.get("keys").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_table);
    for (i, key) in keys.enumerate() {
        let name = format!("key {} of the path", i + 1);
        apply(KEY, key, &format!("{name}: "))?;
        need(key, &["time"], &name)?;
        if let Some(Value::Table(camera)) = key.get("camera") {
            apply(&CAMERA[..5], camera, &format!("{name}: camera."))?;
            need(camera, &["position", "target"], &format!("{name}: camera"))?;
        }
        if let Some(Value::Table(light)) = key.get("light") {
            apply(&LIGHT[1..5], light, &format!("{name}: light."))?;
        }
    }
    Ok(())
}

/// The same for a light's table, which must hold what its kind needs and nothing else.
pub fn check_light(light: &Table) -> Result<()> {
    apply(LIGHT, light, "light.")?;
    need(light, &["kind"], "light")?;
    let kind = light.get("kind").and_then(Value::as_str).unwrap_or_default();
    let Some(i) = KINDS.iter().position(|k| *k == kind) else { return Ok(()) };
    need(light, NEEDED[i], &format!("{} {kind} light", if kind == "omni" { "an" } else { "a" }))?;
    let keys = [NEEDED[i], OPTIONAL[i]].concat();
    if let Some(key) = light.keys().find(|k| *k != "kind" && !keys.contains(&k.as_str())) {
        bail!("light.{} is not a key of a {kind} light; there are {}", shortened(key), keys.join(", "));
    }
    Ok(())
}

fn apply(rules: &[Rule], table: &Table, path: &str) -> Result<()> {
    for (key, value) in table {
        match rules.iter().find(|r| r.0 == key) {
            Some((_, fits, takes)) if !fits(value) => {
                bail!("{path}{key} = {} is not allowed; it takes {takes}", shortened(&value.to_string()))
            }
            Some(_) => {}
            None => {
                let keys: Vec<&str> = rules.iter().map(|r| r.0).collect();
                bail!("{path}{} is unknown; there are {}", shortened(key), keys.join(", "))
            }
        }
    }
    Ok(())
}

/// Which key says how much a camera shows.
fn shape(camera: &Table) -> &'static str {
    if camera.contains_key("height") { "height" } else { "fov" }
}

fn need(table: &Table, keys: &[&str], whose: &str) -> Result<()> {
    match keys.iter().find(|k| !table.contains_key(**k)) {
        Some(key) => bail!("{whose} lacks the key {key}; it needs {}", keys.join(", ")),
        None => Ok(()),
    }
}
