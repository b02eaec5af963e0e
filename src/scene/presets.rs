//! Cameras and lights that suit a scene's extent, all in scene space.

use crate::light::Light;
use crate::message::{quoted, shortened};
use crate::scene::pose::{Placement, placements};
use crate::scene::{Camera, NamedCamera, NamedLight, Scene};
use glam::{DVec3, Vec3, Vec4};

/// An axis-aligned box around the scene, scene space.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    pub fn center(self) -> Vec3 {
        self.min.midpoint(self.max)
    }

    /// Of the sphere around the box.
    pub fn radius(self) -> f32 {
        (0.5 * (self.max - self.min).length()).max(1e-6)
    }
}

/// Calls `visit` with every vertex as often as it is drawn at the clock's start, in scene space.
pub fn for_each_vertex(scene: &Scene, mut visit: impl FnMut(DVec3)) {
    for placed in placements(scene, 0, 0.0) {
        (0..placed.mesh.positions.len()).for_each(|i| visit(placed.position(i)));
    }
}

/// Adds cameras and lights that suit the scene's size and place.
pub fn add(scene: &mut Scene, bounds: Bounds) {
    tell_unseen(scene, bounds);
    let own = scene.cameras.len();
    let detail = detail(scene).unwrap_or(bounds);
    let far = 20.0 * bounds.radius();
    add_camera(scene, "overview", overview(bounds, far), None);
    if detail.radius() < 0.3 * bounds.radius() {
        add_camera(scene, "detail", overview(detail, far), None);
    }
    let low = low(scene, detail, far);
    add_camera(scene, "low", low, None);
    if own > 0 {
        open_with_a_view(scene);
    }

    let center = bounds.center();
    let radius = bounds.radius();
    let towards_sun = |elevation: f32| {
        let (sin, cos) = elevation.to_radians().sin_cos();
        // From the left of the overview camera: shadows fall across the picture.
        Vec3::new(-12.0 / 13.0 * cos, sin, 5.0 / 13.0 * cos)
    };
    for (name, elevation) in [("sun", 45.0), ("low-sun", 12.0)] {
        let to_light = towards_sun(elevation);
        add_light(scene, name, Light::Directional { to_light, angular_radius: 0.0, color: Vec3::ONE }, None);
    }
    // The colours make the irradiance one at the scene's centre.
    let offset = 2.0 * radius * Vec3::new(-0.35, 0.8, 0.5).normalize();
    let spot = Light::Spot {
        position: center + offset,
        direction: -offset,
        // The sphere around the scene fills 30 degrees from two radii away.
        outer_angle: 32.0,
        range: 4.0 * radius,
        radius: 0.0,
        color: Vec3::splat(offset.length_squared()),
    };
    add_light(scene, "spot", spot, None);
    let position = Vec3::new(center.x, bounds.max.y + 0.35 * radius, center.z);
    let color = Vec3::splat(position.distance_squared(center));
    add_light(scene, "omni", Light::Omni { position, range: 4.0 * radius, radius: 0.0, color }, None);
}

/// Notes what of the scene its cameras cannot show, and a scene too small for what a set-up can hold.
fn tell_unseen(scene: &mut Scene, bounds: Bounds) {
    let size = 2.0 * bounds.radius();
    if size < 1e-4 {
        scene.notes.push(format!(
            "The scene is only {size:.1e} m across: near planes and light ranges, which are 1e-6 m at least, may cut it off; scale it up."
        ));
    }
    for NamedCamera { name, camera, .. } in &scene.cameras {
        let [first, last] = camera.span([bounds.min, bounds.max]);
        let (name, far) = (shortened(name), camera.far);
        if first > far {
            scene.notes.push(format!(
                "Camera {name} shows nothing: all of the scene lies behind its far plane, {far} m away."
            ));
        } else if last < camera.near {
            scene.notes.push(format!(
                "Camera {name} shows nothing: all of the scene lies behind it or before its near plane."
            ));
        } else if 0.5 * (first + last) > far {
            scene.notes.push(format!(
                "Camera {name} does not show most of the scene: it lies behind its far plane, {far} m away."
            ));
        }
    }
}

/// Puts the first camera that sees something before all others. Early exporters left out the turn between their cameras' axes and
/// those of glTF: such cameras look past the scene.
fn open_with_a_view(scene: &mut Scene) {
    let around = |placed: &Placement| {
        let all = (0..placed.mesh.positions.len()).map(|i| placed.position(i).as_vec3());
        all.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
    };
    let all = placements(scene, 0, 0.0);
    let sees = |camera: &Camera| all.iter().any(|placed| may_see(camera, around(placed)));
    let seeing = scene.cameras.iter().position(|named| sees(&named.camera));
    if let Some(index @ 1..) = seeing {
        let [blind, other] = [0, index].map(|i| quoted(&scene.cameras[i].name));
        scene.notes.push(format!("The camera {blind} sees nothing of the scene, which opens with {other} instead."));
        scene.cameras[..=index].rotate_right(1);
    }
}

/// Whether a box is not beyond one of the sides of what a camera sees in a picture of 16 to 9.
fn may_see(camera: &Camera, [low, high]: [Vec3; 2]) -> bool {
    let seen = camera.projection(16.0 / 9.0) * camera.view();
    let corners: [_; 8] = std::array::from_fn(|i| {
        let corner = Vec3::new([low, high][i & 1].x, [low, high][i >> 1 & 1].y, [low, high][i >> 2].z);
        (seen * corner.extend(1.0), (corner - camera.position).dot(camera.forward()))
    });
    let beyond = |outside: &dyn Fn(Vec4, f32) -> bool| corners.iter().all(|(clip, depth)| outside(*clip, *depth));
    !(beyond(&|clip, _| clip.x < -clip.w)
        || beyond(&|clip, _| clip.x > clip.w)
        || beyond(&|clip, _| clip.y < -clip.w)
        || beyond(&|clip, _| clip.y > clip.w)
        || beyond(&|_, depth| depth < camera.near)
        || beyond(&|_, depth| depth > camera.far))
}

/// Adds a camera under a name that no other has; `node`: what moves it.
pub fn add_camera(scene: &mut Scene, name: &str, camera: Camera, node: Option<u32>) {
    let name = unique(&shortened(name), |name| scene.cameras.iter().any(|other| other.name == name));
    let camera = if node.is_some() { camera.settled(scene.origin) } else { camera };
    scene.cameras.push(NamedCamera { name, camera, node });
}

/// Adds a light under a name that no other has; `node`: what moves it.
pub fn add_light(scene: &mut Scene, name: &str, light: Light, node: Option<u32>) {
    let name = unique(&shortened(name), |name| scene.lights.iter().any(|other| other.name == name));
    let light = if node.is_some() { light.settled(scene.origin) } else { light };
    scene.lights.push(NamedLight { name, light, node });
}

fn unique(name: &str, taken: impl Fn(&str) -> bool) -> String {
    if !taken(name) {
        return name.into();
    }
    // Numbers are taken from 2 on: by doubling and halving, as a file may use one name for thousands.
    let is_taken = |number: usize| taken(&format!("{name} {number}"));
    let mut free = 2;
    while is_taken(free) {
        free *= 2;
    }
    let mut held = free / 2;
    while held + 1 < free {
        let middle = held.midpoint(free);
        if is_taken(middle) { held = middle } else { free = middle }
    }
    format!("{name} {free}")
}

/// From above at a slant, as close as shows all of the box in a picture of 4 to 3.
fn overview(bounds: Bounds, far: f32) -> Camera {
    let fov = 45.0f32;
    let forward = -Vec3::new(0.75, 0.7, 1.0).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    let center = bounds.center();
    let half = 0.5 * (bounds.max - bounds.min);
    let slope = (0.5 * fov).to_radians().tan();
    let mut distance = 0.0f32;
    for corner in 0..8 {
        let sign = |bit: i32| if corner & bit == 0 { -1.0 } else { 1.0 };
        let corner = half * Vec3::new(sign(1), sign(2), sign(4));
        let sideways = (up.dot(corner).abs() / slope).max(right.dot(corner).abs() / (slope * 4.0 / 3.0));
        distance = distance.max(sideways - forward.dot(corner));
    }
    camera(center - 1.05 * distance * forward, center, fov, bounds, far)
}

/// From the scene's edge, a little above what is there, like a person who looks along it.
fn low(scene: &Scene, detail: Bounds, far: f32) -> Camera {
    let center = detail.center();
    let half = 0.5 * (detail.max - detail.min);
    let diagonal = 2.0 * detail.radius();
    // Eye height in metres if the scene's size makes metres likely.
    let eye = 1.7f32.clamp(0.002 * diagonal, 0.05 * diagonal);
    let outside = 0.1 * diagonal;
    let mut position = match half.x > 1.5 * half.z {
        true => center + Vec3::new(half.x + outside, 0.0, 0.35 * half.z),
        false => center + Vec3::new(0.35 * half.x, 0.0, half.z + outside),
    };
    let near = 0.05 * diagonal;
    let mut ground = floor_height(scene, 0.02 * diagonal).unwrap_or(detail.min.y);
    for_each_vertex(scene, |vertex| {
        let vertex = vertex.as_vec3();
        if (vertex - position).with_y(0.0).length_squared() < near * near {
            ground = ground.max(vertex.y);
        }
    });
    position.y = ground + eye;
    let target = center.with_y((detail.min.y + 0.3 * half.y).max(ground));
    camera(position, target, 55.0, detail, far)
}

/// The height at which most of the level surface lies, within `band` metres; None if nothing is level.
fn floor_height(scene: &Scene, band: f32) -> Option<f32> {
    let mut level = Vec::new();
    for placed in placements(scene, 0, 0.0) {
        for t in placed.mesh.indices.chunks_exact(3) {
            let corner = |i: u32| placed.position(i as usize).as_vec3();
            let [a, b, c] = [t[0], t[1], t[2]].map(corner);
            let area = (b - a).cross(c - a);
            if area.y.abs() > 0.9 * area.length() {
                level.push(((a.y + b.y + c.y) / 3.0, area.length()));
            }
        }
    }
    level.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    // A window of that height slides over them: the one that holds the most counts.
    let (mut first, mut held, mut most, mut height) = (0, 0.0, 0.0, None);
    for (y, area) in &level {
        held += area;
        while level[first].0 < y - band {
            held -= level[first].1;
            first += 1;
        }
        if held > most * 1.001 {
            (most, height) = (held, Some(*y));
        }
    }
    height
}

/// The box around most of the vertices: without the wide floor or sky that holds few of them.
fn detail(scene: &Scene) -> Option<Bounds> {
    let mut count = 0;
    for_each_vertex(scene, |_| count += 1);
    // A sample is enough.
    let step = count / 50_000 + 1;
    let mut axes: [Vec<f32>; 3] = Default::default();
    let mut index = 0;
    for_each_vertex(scene, |vertex| {
        if index % step == 0 {
            axes.iter_mut().zip(vertex.as_vec3().to_array()).for_each(|(axis, value)| axis.push(value));
        }
        index += 1;
    });
    let last = axes[0].len().checked_sub(1)?;
    // Three in a hundred at each end do not count.
    let mut at = |place: usize| {
        Vec3::from_array(axes.each_mut().map(|axis| *axis.select_nth_unstable_by(place, f32::total_cmp).1))
    };
    Some(Bounds { min: at(last * 3 / 100), max: at(last - last * 3 / 100) })
}

/// `seen` is what the camera looks at; it sets the near plane.
fn camera(position: Vec3, target: Vec3, fov: f32, seen: Bounds, far: f32) -> Camera {
    // Within what a set-up takes, also for things a hair wide.
    let near = (0.002 * seen.radius()).max(1e-6);
    Camera::new(position, target, fov, near, far.max(10.0 * near))
}
