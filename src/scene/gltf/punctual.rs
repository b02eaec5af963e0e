//! The file's own cameras and lights, in scene space.

use super::hierarchy::{Hierarchy, label};
use super::presets::{Bounds, add_camera, add_light};
use super::{broken, counted, get};
use crate::light::Light;
use crate::scene::pose::{moves, world_matrices};
use crate::scene::{Camera, Scene};
use ::gltf::json::Root;
use ::gltf::json::extensions::scene::khr_lights_punctual as khr;
use ::gltf::json::validation::Checked;
use anyhow::Result;
use glam::{Mat4, Vec3};

/// Adds the cameras and lights of the scene's nodes, where they are at the clock's start.
pub fn add(root: &Root, hierarchy: &Hierarchy, bounds: Bounds, scene: &mut Scene) -> Result<()> {
    let mut lights = 0;
    let worlds = world_matrices(scene, Some(0), 0.0);
    for (place, (&index, world)) in (0..).zip(hierarchy.scene.iter().zip(worlds)) {
        let node = &root.nodes[index];
        let world = world.as_mat4();
        let owner = label(root, index);
        let moved = moves(scene, place).then_some(place);
        if let Some(camera) = node.camera {
            let file = get(&root.cameras, camera, "camera", &owner)?;
            let name = first_name([&file.name, &node.name], "camera", camera.value());
            add_camera(scene, &name, convert_camera(file, world, bounds), moved);
        }
        let extension = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(extension) = extension {
            let file = get(AsRef::<[khr::Light]>::as_ref(root), extension.light, "light", &owner)?;
            let name = first_name([&file.name, &node.name], "light", extension.light.value());
            let light = convert_light(file, world, bounds)
                .ok_or_else(|| broken(format!("light {} has an unknown type", extension.light)))?;
            add_light(scene, &name, light, moved);
            lights += 1;
        }
    }
    scene.notes.extend(counted(
        lights,
        "light has a brightness that suits the scene, not its photometric intensity.",
        "lights have a brightness that suits the scene, not their photometric intensity.",
    ));
    Ok(())
}

fn first_name(names: [&Option<String>; 2], kind: &str, index: usize) -> String {
    let given = names.into_iter().flatten().map(|name| name.trim()).find(|name| !name.is_empty());
    given.map_or_else(|| format!("{kind} {index}"), str::to_owned)
}

fn convert_camera(file: &::gltf::json::Camera, world: Mat4, bounds: Bounds) -> Camera {
    let diagonal = 2.0 * bounds.radius();
    let position = world.w_axis.truncate();
    let to_center = (bounds.center() - position).dot((-world.z_axis.truncate()).normalize_or(Vec3::NEG_Z));
    let distance = if to_center > 0.05 * bounds.radius() { to_center } else { bounds.radius() };
    let positive = |x: f32| x > 0.0 && x.is_finite();
    let (fov, height, znear, zfar) = match (&file.perspective, &file.orthographic) {
        (Some(p), _) => (p.yfov.to_degrees(), None, p.znear, p.zfar),
        // Half the height of what is seen.
        (None, Some(o)) => (45.0, Some(2.0 * o.ymag.abs()), o.znear, Some(o.zfar)),
        (None, None) => (45.0, None, 0.0, None),
    };
    let near = if positive(znear) { znear } else { 1e-3 * diagonal };
    let far = zfar.filter(|far| far.is_finite() && *far > near).unwrap_or(10.0 * diagonal);
    let fov = if fov.is_finite() { fov.clamp(1.0, 170.0) } else { 45.0 };
    let camera = Camera::new(Vec3::ZERO, distance * Vec3::NEG_Z, fov, near, far.max(2.0 * near));
    Camera { height: height.filter(|h| positive(*h)), ..camera }.placed(world)
}

fn convert_light(file: &khr::Light, world: Mat4, bounds: Bounds) -> Option<Light> {
    let position = world.w_axis.truncate();
    let backward = world.z_axis.truncate().normalize_or(Vec3::Z);
    let distance = position.distance(bounds.center());
    let range = file.range.filter(|range| *range > 0.0 && range.is_finite());
    let range = range.unwrap_or(distance + 2.0 * bounds.radius());
    let color = Vec3::from(file.color);
    let largest = color.max_element();
    let color = if color.is_finite() && largest > 0.0 { color.max(Vec3::ZERO) / largest } else { Vec3::ONE };
    let near_color = color * (distance * distance).max(1.0);
    Some(match file.type_ {
        Checked::Valid(khr::Type::Directional) => Light::Directional { to_light: backward, angular_radius: 0.0, color },
        Checked::Valid(khr::Type::Point) => Light::Omni { position, range, radius: 0.0, color: near_color },
        Checked::Valid(khr::Type::Spot) => {
            let angle = file.spot.as_ref().map_or(45.0, |spot| spot.outer_cone_angle.to_degrees());
            let outer_angle = if angle.is_finite() { angle.clamp(0.5, 88.5) } else { 45.0 };
            Light::Spot { position, direction: -backward, outer_angle, range, radius: 0.0, color: near_color }
        }
        Checked::Invalid => return None,
    })
}
