//! `flatland`: Chong's tables for his scenes and for others.

use super::print;
use crate::files;
use crate::flatland::{Flatland, scenes, table::Report};
use anyhow::{Context, Result, bail};

pub fn run(scene: Option<&str>, json: bool) -> Result<()> {
    let worlds: Vec<(String, Flatland)> = match scene {
        None => scenes::chong().map(|(name, world)| (name.to_string(), world)).into(),
        Some(scene) => vec![(scene.to_string(), open(scene)?)],
    };
    let reports = worlds.iter().map(|(name, world)| Report::of(name, world)).collect::<Result<Vec<_>>>()?;
    if json {
        return print(&format!("{}\n", serde_json::to_string_pretty(&reports)?));
    }
    print(&reports.iter().map(Report::text).collect::<Vec<_>>().join("\n"))
}

/// One of Chong's scenes by name, one of the random ones (`random-7`), or a file.
fn open(scene: &str) -> Result<Flatland> {
    let named = scenes::chong();
    if let Some((_, world)) = named.iter().find(|(name, _)| *name == scene) {
        return Ok(world.clone());
    }
    if let Some(number) = scene.strip_prefix("random-").and_then(|n| n.parse().ok()) {
        return Ok(scenes::random(number));
    }
    if !scene.ends_with(".toml") {
        let names: Vec<_> = named.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        bail!("{scene} is neither a scene of flatland ({}, random-1, random-2, …) nor a .toml file", names.join(", "));
    }
    let text = files::read_text(&files::path_of(scene))?;
    Flatland::from_toml(&text).with_context(|| format!("{scene} is no world of flatland"))
}
