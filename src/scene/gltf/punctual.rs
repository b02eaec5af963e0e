//! The file's own cameras and lights, in scene space.

use super::hierarchy::{Hierarchy, label};
use super::{broken, few, get};
use crate::light::Light;
use crate::message::{counted, quoted};
use crate::scene::camera::FARTHEST;
use crate::scene::pose::{moving, world_matrices};
use crate::scene::presets::{Bounds, add_camera, add_light};
use crate::scene::{Camera, Scene};
use ::gltf::json::Root;
use ::gltf::json::extensions::scene::khr_lights_punctual as khr;
use ::gltf::json::validation::Checked;
use anyhow::Result;
use glam::{Mat4, Vec3};

/// Most cameras, and most lights, of a file, as of presets.
const MOST: usize = 1000;

/// Adds the cameras and lights of the scene's nodes, where they are at the clock's start.
pub fn add(root: &Root, hierarchy: &Hierarchy, bounds: Bounds, scene: &mut Scene) -> Result<()> {
    let (mut lights, mut dark, mut beyond, mut far) = (0, 0, 0, 0);
    let mut told = Vec::new();
    let worlds = world_matrices(scene, Some(0), 0.0);
    let moving = moving(scene);
    let nodes = (0..).zip(hierarchy.scene.iter().zip(worlds)).filter(|(_, (index, _))| hierarchy.drawn[**index]);
    for (place, (&index, world)) in nodes {
        let node = &root.nodes[index];
        let world = world.as_mat4();
        let owner = label(root, index);
        let moved = moving[place as usize].then_some(place);
        let extension = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if world.w_axis.truncate().abs().max_element() > FARTHEST {
            far += usize::from(node.camera.is_some()) + usize::from(extension.is_some());
            continue;
        }
        if let Some(camera) = node.camera {
            let file = get(&root.cameras, camera, "camera", &owner)?;
            if scene.cameras.len() < MOST {
                let name = first_name([&file.name, &node.name], "camera", camera.value());
                let camera = convert_camera(file, world, bounds, &mut tell("camera", &name, &mut told));
                add_camera(scene, &name, camera, moved);
            } else {
                beyond += 1;
            }
        }
        if let Some(extension) = extension {
            let file = get(AsRef::<[khr::Light]>::as_ref(root), extension.light, "light", &owner)?;
            if lights == MOST {
                beyond += 1;
                continue;
            }
            let name = first_name([&file.name, &node.name], "light", extension.light.value());
            let light = convert_light(file, world, (bounds, moved.is_some()), &mut tell("light", &name, &mut told))
                .ok_or_else(|| broken(format!("light {} has an unknown type", extension.light)))?;
            dark += usize::from(light.color() == Vec3::ZERO);
            add_light(scene, &name, light, moved);
            lights += 1;
        }
    }
    scene.notes.extend(counted(
        beyond,
        &format!("camera or light beyond the first {MOST} of its kind is left out."),
        &format!("cameras and lights beyond the first {MOST} of their kind are left out."),
    ));
    scene.notes.extend(counted(
        far,
        &format!("camera or light lies farther than {FARTHEST:e} m from zero and is left out."),
        &format!("cameras and lights lie farther than {FARTHEST:e} m from zero and are left out."),
    ));
    scene.notes.extend(counted(
        lights,
        "light has a brightness that suits the scene, not its photometric intensity.",
        "lights have a brightness that suits the scene, not their photometric intensity.",
    ));
    scene.notes.extend(counted(
        dark,
        "light has the colour or the intensity zero and stays dark.",
        "lights have the colour or the intensity zero and stay dark.",
    ));
    scene.notes.extend(few(told, "values of cameras and lights"));
    Ok(())
}

/// Collects what is taken instead of a value of a camera or light.
fn tell<'a>(kind: &'a str, name: &'a str, told: &'a mut Vec<String>) -> impl FnMut(&str, f32, String) + use<'a> {
    move |key, value, taken| {
        let note = format!("The {kind} {} has {key} {value}; {taken}.", quoted(name));
        // A camera or light that hangs on several nodes is told of once.
        if !told.contains(&note) {
            told.push(note);
        }
    }
}

fn first_name(names: [&Option<String>; 2], kind: &str, index: usize) -> String {
    let given = names.into_iter().flatten().map(|name| name.trim()).find(|name| !name.is_empty());
    given.map_or_else(|| format!("{kind} {index}"), str::to_owned)
}

/// `tell`: called with the key and value of what is not taken as it is, and with what is.
fn convert_camera(
    file: &::gltf::json::Camera,
    world: Mat4,
    bounds: Bounds,
    tell: &mut impl FnMut(&str, f32, String),
) -> Camera {
    let diagonal = 2.0 * bounds.radius();
    let position = world.w_axis.truncate();
    let to_center = (bounds.center() - position).dot((-world.z_axis.truncate()).normalize_or(Vec3::NEG_Z));
    let distance = if to_center > 0.05 * bounds.radius() { to_center } else { bounds.radius() };
    let positive = |x: f32| x > 0.0 && x.is_finite();
    let (fov, height, znear, zfar) = match (&file.perspective, &file.orthographic) {
        (Some(p), _) => {
            let given = p.yfov.to_degrees();
            // Half a turn and more is no picture.
            let fov = if given > 0.0 && given < 180.0 { given.clamp(1.0, 170.0) } else { 45.0 };
            if fov != given {
                tell("yfov", p.yfov, format!("{fov}° are taken"));
            }
            (fov, None, Some(p.znear), p.zfar)
        }
        (None, Some(o)) => {
            // Half the height of what is seen.
            let height = Some(2.0 * o.ymag.abs()).filter(|h| positive(*h)).map(|h| h.clamp(1e-6, 1e9));
            if height.is_none() {
                tell("ymag", o.ymag, "a perspective of 45° is taken".into());
            }
            // Its near plane may lie in the camera.
            (45.0, height, Some(o.znear).filter(|near| *near != 0.0), Some(o.zfar))
        }
        (None, None) => (45.0, None, None, None),
    };
    // A camera without a far plane has one behind all that it may ever see.
    let endless = (10.0 * diagonal).max(3.0 * (distance + diagonal));
    let near = znear.filter(|near| positive(*near)).unwrap_or(1e-3 * diagonal).clamp(1e-6, 1e8);
    if let Some(given) = znear.filter(|given| *given != near) {
        tell("znear", given, format!("{near} m is taken"));
    }
    let far = zfar.filter(|far| far.is_finite() && *far > near).unwrap_or(endless).max(2.0 * near);
    if let Some(given) = zfar.filter(|given| *given <= near || given.is_nan()) {
        tell("zfar", given, format!("{far} m is taken, as it must lie beyond znear"));
    }
    Camera { height, ..Camera::new(Vec3::ZERO, distance * Vec3::NEG_Z, fov, near, far) }.placed(world)
}

/// `tell`: as in [`convert_camera`].
fn convert_light(
    file: &khr::Light,
    world: Mat4,
    (bounds, moves): (Bounds, bool),
    tell: &mut impl FnMut(&str, f32, String),
) -> Option<Light> {
    let position = world.w_axis.truncate();
    let backward = world.z_axis.truncate().normalize_or(Vec3::Z);
    let distance = position.distance(bounds.center());
    // A lamp without a range reaches all, wherever an animation takes it.
    let all = (distance + 2.0 * bounds.radius()) * if moves { 100.0 } else { 1.0 };
    let usable = |range: &f32| *range > 0.0 && range.is_finite();
    let range = file.range.filter(usable).unwrap_or(all).clamp(1e-6, 1e9);
    if let Some(given) =
        file.range.filter(|given| *given != range && file.type_ != Checked::Valid(khr::Type::Directional))
    {
        tell("range", given, format!("{range} m is taken"));
    }
    let color = Vec3::from(file.color).max(Vec3::ZERO);
    let largest = color.max_element();
    let color = match largest > 0.0 && file.intensity != 0.0 {
        true if color.is_finite() => color / largest,
        true => Vec3::ONE,
        false => Vec3::ZERO,
    };
    let near_color = color * (distance * distance).max(1.0);
    Some(match file.type_ {
        Checked::Valid(khr::Type::Directional) => Light::Directional { to_light: backward, angular_radius: 0.0, color },
        Checked::Valid(khr::Type::Point) => Light::Omni { position, range, radius: 0.0, color: near_color },
        Checked::Valid(khr::Type::Spot) => {
            let given = file.spot.as_ref().map(|spot| spot.outer_cone_angle);
            // Beyond a quarter turn, with room for its rounding, or with no cone at all it means nothing.
            let cone = |angle: &f32| *angle > 0.0 && *angle < 1.58;
            let angle = given.filter(cone).map_or(45.0, f32::to_degrees);
            let outer_angle = angle.clamp(0.5, 88.5);
            if let Some(given) = given.filter(|given| given.to_degrees() != outer_angle) {
                tell(
                    "outerConeAngle",
                    given,
                    format!("{outer_angle}° are taken, of 0.5° to 88.5° that a spot may have"),
                );
            }
            Light::Spot { position, direction: -backward, outer_angle, range, radius: 0.0, color: near_color }
        }
        Checked::Invalid => return None,
    })
}
