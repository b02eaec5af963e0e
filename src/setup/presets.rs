//! Cameras and lights in a file beside a scene's, in the words of a set-up.

use super::{check_camera, check_light, one_line, place, shape};
use crate::files;
use crate::light::Light;
use crate::message::{counted, quoted, shortened};
use crate::scene::{Camera, NamedCamera, NamedLight, Scene};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use toml::{Table, Value};

/// Most cameras, and most lights, of a file.
const MOST: usize = 1000;

/// Adds those of `NAME.presets.toml`, if the file is there, before the scene's own; of two with one name the file's stays.
///
/// # Errors
/// One sentence that names the file, the key and what is allowed.
pub fn add(scene: &mut Scene, path: &Path) -> Result<()> {
    let file = path.with_extension("presets.toml");
    if !file.exists() {
        return Ok(());
    }
    let text = files::read_text(&file)?;
    let (cameras, lights) = read(&text, scene).with_context(|| format!("{} cannot be used", file.display()))?;
    let name = shortened(&file.file_name().unwrap_or_default().to_string_lossy());
    scene.notes.extend(counted(
        cameras.len(),
        &format!("camera is from {name}."),
        &format!("cameras are from {name}."),
    ));
    scene.notes.extend(counted(lights.len(), &format!("light is from {name}."), &format!("lights are from {name}.")));
    scene.cameras.retain(|own| cameras.iter().all(|camera| camera.name != own.name));
    scene.lights.retain(|own| lights.iter().all(|light| light.name != own.name));
    scene.cameras.splice(0..0, cameras);
    scene.lights.splice(0..0, lights);
    Ok(())
}

fn read(text: &str, scene: &Scene) -> Result<(Vec<NamedCamera>, Vec<NamedLight>)> {
    let mut table: Table = toml::from_str(text).map_err(|e| one_line(&e.to_string()))?;
    shape::check_presets(&table)?;
    // Clipping planes that suit the scene, where a pose has none.
    let first = scene.cameras.first().map(|c| c.camera).context("the scene has no camera")?;
    let mut cameras: Vec<NamedCamera> = Vec::new();
    for (name, mut camera) in named(&mut table, "cameras")? {
        for (key, value) in [("near", first.near), ("far", first.far)] {
            camera.entry(key).or_insert(Value::Float(value.into()));
        }
        let camera: Camera = in_scene_space(scene, "camera", camera)?;
        check_camera(&format!("the camera {}", quoted(&name)), &camera)?;
        ensure!(cameras.iter().all(|other| other.name != name), "two cameras are named {}", quoted(&name));
        cameras.push(NamedCamera { name, camera, node: None });
    }
    let mut lights: Vec<NamedLight> = Vec::new();
    for (name, light) in named(&mut table, "lights")? {
        shape::check_light(&light).with_context(|| format!("the light {}", quoted(&name)))?;
        let light: Light = in_scene_space(scene, "light", light)?;
        check_light(&format!("the light {}", quoted(&name)), &light)?;
        ensure!(lights.iter().all(|other| other.name != name), "two lights are named {}", quoted(&name));
        lights.push(NamedLight { name, light, node: None });
    }
    Ok((cameras, lights))
}

/// The tables of a list, each with the name that was in it.
fn named(table: &mut Table, list: &str) -> Result<Vec<(String, Table)>> {
    let Some(Value::Array(all)) = table.remove(list) else { return Ok(Vec::new()) };
    ensure!(all.len() <= MOST, "there are {} {list}; up to {MOST} are read", all.len());
    let split = |value| match value {
        Value::Table(mut table) => {
            let name = table.remove("name").and_then(|name| name.as_str().map(shortened));
            Some((name.unwrap_or_default(), table))
        }
        _ => None,
    };
    Ok(all.into_iter().filter_map(split).collect())
}

fn in_scene_space<T: serde::de::DeserializeOwned>(scene: &Scene, key: &str, table: Table) -> Result<T> {
    let mut setup = Table::from_iter([(key.to_string(), Value::Table(table))]);
    place::take_off(&mut setup, scene.origin);
    let value = setup.remove(key).context("it was there")?;
    value.try_into().map_err(|e: toml::de::Error| one_line(&e.to_string()))
}
