//! The file's own cameras and lights, in scene space.

use super::hierarchy::{Hierarchy, label};
use super::{broken, get};
use crate::light::Light;
use crate::message::counted;
use crate::scene::geometry::world_matrices;
use crate::scene::presets::{Bounds, add_camera, add_light};
use crate::scene::{Camera, Scene};
use ::gltf::json::Root;
use ::gltf::json::extensions::scene::khr_lights_punctual as khr;
use ::gltf::json::validation::Checked;
use anyhow::Result;
use glam::{Mat4, Vec3};

/// Adds the cameras and lights of the scene's nodes, where they are at the file's pose.
pub fn add(root: &Root, hierarchy: &Hierarchy, bounds: Bounds, scene: &mut Scene) -> Result<()> {
    let mut orthographic = 0;
    let mut lights = 0;
    let worlds = world_matrices(scene, None, 0.0);
    for (&index, world) in hierarchy.scene.iter().zip(worlds) {
        let node = &root.nodes[index];
        let world = world.as_mat4();
        let owner = label(root, index);
        if let Some(camera) = node.camera {
            let file = get(&root.cameras, camera, "camera", &owner)?;
            let name = first_name([&file.name, &node.name], "camera", camera.value());
            match &file.perspective {
                Some(perspective) => add_camera(scene, &name, convert_camera(perspective, world, bounds)),
                None => orthographic += 1,
            }
        }
        let extension = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(extension) = extension {
            let file = get(AsRef::<[khr::Light]>::as_ref(root), extension.light, "light", &owner)?;
            let name = first_name([&file.name, &node.name], "light", extension.light.value());
            let light = convert_light(file, world, bounds)
                .ok_or_else(|| broken(format!("light {} has an unknown type", extension.light)))?;
            add_light(scene, &name, light);
            lights += 1;
        }
    }
    scene.notes.extend(counted(orthographic, "orthographic camera is left out.", "orthographic cameras are left out."));
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

fn convert_camera(file: &::gltf::json::camera::Perspective, world: Mat4, bounds: Bounds) -> Camera {
    let position = world.w_axis.truncate();
    let diagonal = 2.0 * bounds.radius();
    let mut forward = (-world.z_axis.truncate()).normalize_or(Vec3::NEG_Z);
    if forward.y.abs() > 0.9999 {
        // Our cameras have their top towards +y: keep the picture's direction by not looking
        // straight along it.
        forward = (forward + 0.02 * world.y_axis.truncate().normalize_or(Vec3::Z)).normalize();
    }
    let to_center = (bounds.center() - position).dot(forward);
    let distance = if to_center > 0.05 * bounds.radius() { to_center } else { bounds.radius() };
    let near = if file.znear > 0.0 && file.znear.is_finite() { file.znear } else { 1e-3 * diagonal };
    let far = file.zfar.filter(|far| far.is_finite() && *far > near).unwrap_or(10.0 * diagonal);
    let fov = file.yfov.to_degrees();
    Camera {
        position,
        target: position + forward * distance,
        fov: if fov.is_finite() { fov.clamp(1.0, 170.0) } else { 45.0 },
        near,
        far: far.max(2.0 * near),
    }
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
