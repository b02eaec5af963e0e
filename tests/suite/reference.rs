//! Sample, facing and truth of every pixel against a reference in double precision that shares nothing with the shaders:
//! a camera ray through the pixel's centre, the nearest triangle, and a shadow ray from the point where it is hit.

use crate::common::*;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use shadowscope::frame::Renderer;
use shadowscope::light::Light;
use shadowscope::measure::metrics::{BACKGROUND, FACING, OUTSIDE};
use shadowscope::scene::{Camera, Material, Scene, builtin};
use shadowscope::setup::Setup;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// A box of a hierarchy: its triangles, or two children side by side.
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    first: usize,
    /// 0: inner.
    count: usize,
}

/// A scene's triangles, and a hierarchy of boxes that only saves time.
struct Reference {
    triangles: Vec<[DVec3; 3]>,
    /// The first of the triangles that have the same corners.
    surface: Vec<usize>,
    double_sided: Vec<bool>,
    nodes: Vec<Node>,
    order: Vec<usize>,
    /// Largest coordinate, metres: what rounding is measured by.
    size: f64,
}

/// Where a ray meets a triangle's plane: its parameter, and the weights of the corners, one of them negative outside.
struct Meeting {
    t: f64,
    weights: DVec3,
}

fn meet(t: &[DVec3; 3], origin: DVec3, direction: DVec3) -> Option<Meeting> {
    let [a, b, c] = t.map(|p| p - origin);
    let volumes = DVec3::new(direction.dot(c.cross(b)), direction.dot(a.cross(c)), direction.dot(b.cross(a)));
    let whole = volumes.element_sum();
    if whole == 0.0 {
        return None;
    }
    let normal = (b - a).cross(c - a);
    Some(Meeting { t: a.dot(normal) / direction.dot(normal), weights: volumes / whole })
}

impl Reference {
    fn new(renderer: &Renderer) -> Reference {
        let geometry = renderer.geometry();
        let triangles: Vec<[DVec3; 3]> =
            (0..geometry.triangles.len()).map(|t| geometry.corners(t).map(|p| p.as_dvec3())).collect();
        let mut found = HashMap::new();
        let surface = triangles.iter().enumerate().map(|(i, t)| {
            let mut key = t.map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
            key.sort();
            *found.entry(key).or_insert(i)
        });
        let surface = surface.collect();
        let double_sided = geometry.triangles.iter().map(|t| {
            let material = geometry.vertices[t[0] as usize].material;
            renderer.scene().materials[material as usize].double_sided
        });
        let double_sided = double_sided.collect();
        let size = triangles.iter().flatten().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        let mut nodes = vec![Node { low: [0.0; 3], high: [0.0; 3], first: 0, count: 0 }];
        split(&triangles, &mut order, 0, 0, &mut nodes);
        Reference { triangles, surface, double_sided, nodes, order, size }
    }

    /// Calls `visit` with the triangles near a ray, those in nearer boxes first. It says up to where others matter.
    fn walk(&self, origin: DVec3, direction: DVec3, mut most: f64, mut visit: impl FnMut(usize) -> f64) {
        let (start, inverse) = (origin.to_array(), direction.recip().to_array());
        // Where the ray enters a box; beyond all where it does not. In plain steps: it is most of the work.
        let entry = |n: &Node| {
            let (mut near, mut far) = (0.0, f64::MAX);
            for axis in 0..3 {
                let x = (n.low[axis] - start[axis]) * inverse[axis];
                let y = (n.high[axis] - start[axis]) * inverse[axis];
                let (a, b) = if x < y { (x, y) } else { (y, x) };
                // 0 · ∞ says nothing.
                if !x.is_nan() && !y.is_nan() {
                    near = if a > near { a } else { near };
                    far = if b < far { b } else { far };
                }
            }
            if near <= far { near } else { f64::INFINITY }
        };
        let mut stack = vec![(0, 0.0)];
        while let Some((i, near)) = stack.pop() {
            // What lies level still counts.
            if near > most * (1.0 + 1e-9) {
                continue;
            }
            let n = &self.nodes[i];
            if n.count > 0 {
                for k in n.first..n.first + n.count {
                    most = visit(self.order[k]);
                }
                continue;
            }
            let (left, right) = (entry(&self.nodes[n.first]), entry(&self.nodes[n.first + 1]));
            let [later, sooner] = if left > right { [(0, left), (1, right)] } else { [(1, right), (0, left)] };
            for (side, near) in [later, sooner] {
                if near < f64::INFINITY {
                    stack.push((n.first + side, near));
                }
            }
        }
    }

    /// The nearest triangle that the camera sees along a ray, and how far it is.
    fn nearest(&self, eye: DVec3, direction: DVec3, near: f64) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        self.walk(eye, direction, f64::INFINITY, |i| {
            if let Some(m) = meet(&self.triangles[i], eye, direction)
                && m.weights.min_element() >= 0.0
                && m.t > near
                && best.is_none_or(|b| m.t < b.1)
                && (self.double_sided[i] || self.normal(i).dot(direction) < 0.0)
            {
                best = Some((i, m.t));
            }
            best.map_or(f64::INFINITY, |b| b.1)
        });
        best
    }

    fn normal(&self, i: usize) -> DVec3 {
        let [a, b, c] = self.triangles[i];
        (b - a).cross(c - a).normalize()
    }

    /// The point of a triangle that a ray from the eye hits, or passes nearest.
    fn sample(&self, i: usize, eye: DVec3, direction: DVec3) -> DVec3 {
        let t = &self.triangles[i];
        if let Some(m) = meet(t, eye, direction).filter(|m| m.t > 0.0 && m.weights.min_element() >= 0.0) {
            return t[0] * m.weights.x + t[1] * m.weights.y + t[2] * m.weights.z;
        }
        let d = direction.normalize();
        let across = |v: DVec3| v - d * v.dot(d);
        let edge = |k: usize| {
            let (from, to) = (t[k], t[(k + 1) % 3]);
            let (p, e) = (across(from - eye), across(to - from));
            let s = (-p.dot(e) / e.length_squared().max(1e-300)).clamp(0.0, 1.0);
            (from.lerp(to, s), (p + e * s).length())
        };
        let found = [0, 1, 2].map(edge).into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        found.expect("three edges").0
    }

    /// What a shadow ray that starts on a triangle meets. `near`: a plane nearer than that to the origin touches it.
    fn shadow(&self, own: usize, origin: DVec3, to_light: DVec3, far: f64, near: f64) -> Shadow {
        let mut found = Shadow::Lit;
        self.walk(origin, to_light, far, |i| {
            if found != Shadow::Blocked
                && self.surface[i] != self.surface[own]
                && let Some(m) = meet(&self.triangles[i], origin, to_light)
                && m.weights.min_element() >= 0.0
                && m.t > 0.0
                && m.t < far
            {
                let touches = self.normal(i).dot(self.triangles[i][0] - origin).abs() < near;
                found = if touches { Shadow::Touches } else { Shadow::Blocked };
            }
            if found == Shadow::Blocked { f64::NEG_INFINITY } else { far }
        });
        found
    }
}

/// Makes node `at` of the triangles `order`, which begin at `first` of the whole list, by halves.
fn split(triangles: &[[DVec3; 3]], order: &mut [usize], first: usize, at: usize, nodes: &mut Vec<Node>) {
    let corners = order.iter().flat_map(|i| triangles[*i]);
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let room = 1e-12 * (low.abs().max_element().max(high.abs().max_element()) + 1.0);
    let [from, to] = [low - room, high + room].map(|p| p.to_array());
    nodes[at] = Node { low: from, high: to, first, count: order.len() };
    if order.len() > 4 {
        let axis = (high - low).max_position();
        let place = |i: &usize| triangles[*i].iter().map(|p| p[axis]).sum::<f64>();
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
        let children = nodes.len();
        (nodes[at].first, nodes[at].count) = (children, 0);
        nodes.extend([0, 1].map(|_| Node { low: from, high: to, first: 0, count: 0 }));
        let (left, right) = order.split_at_mut(middle);
        split(triangles, left, first, children, nodes);
        split(triangles, right, first + middle, children + 1, nodes);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shadow {
    Lit,
    Blocked,
    /// Only by a triangle whose plane holds the sample: a neighbour that is touched, or one in the same place.
    Touches,
}

/// Rays through pixels, of length 1 along the camera's axis.
struct Pinhole {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    size: DVec2,
}

impl Pinhole {
    fn new(camera: &Camera, size: [u32; 2]) -> Pinhole {
        let (eye, target) = (camera.position.as_dvec3(), camera.target.as_dvec3());
        let forward = (target - eye).normalize();
        let up = if forward.y.abs() > 0.9999 { DVec3::NEG_Z } else { DVec3::Y };
        let tangent = ((camera.fov as f64).to_radians() / 2.0).tan();
        let right = forward.cross(up).normalize();
        let up = right.cross(forward) * tangent;
        let size = DVec2::new(size[0] as f64, size[1] as f64);
        Pinhole { eye, forward, right: right * tangent * size.x / size.y, up, size }
    }

    /// `at`: in pixels from the upper left corner.
    fn ray(&self, at: DVec2) -> DVec3 {
        let x = 2.0 * at / self.size - 1.0;
        self.forward + x.x * self.right - x.y * self.up
    }

    /// Where a point is seen, pixels.
    fn seen(&self, p: DVec3) -> DVec2 {
        let v = p - self.eye;
        let v = v / v.dot(self.forward);
        let x = v.dot(self.right) / self.right.length_squared();
        let y = -v.dot(self.up) / self.up.length_squared();
        (DVec2::new(x, y) + 1.0) / 2.0 * self.size
    }
}

/// Towards the light, not normalised; how far it is in that length; whether it shines there at all.
fn towards(light: &Light, p: DVec3) -> (DVec3, f64, bool) {
    if let Light::Directional { to_light, .. } = light {
        return (to_light.as_dvec3().normalize(), f64::INFINITY, true);
    }
    let to_light = light.position().as_dvec3() - p;
    let reached = to_light.length() <= light.range() as f64;
    let cosine = match light {
        Light::Spot { direction, .. } | Light::Hemisphere { direction, .. } => {
            -to_light.normalize().dot(direction.as_dvec3().normalize())
        }
        _ => 1.0,
    };
    let inside = match light {
        Light::Spot { outer_angle, .. } => cosine >= (*outer_angle as f64).to_radians().cos(),
        _ => cosine > 0.0,
    };
    (to_light, 1.0, reached && inside)
}

/// What was found in a picture.
#[derive(Debug, Default, Clone, Copy)]
struct Count {
    pixels: usize,
    facing: usize,
    dark: usize,
    /// The triangle named is not the nearest that the exact ray hits, but one within [`SNAP`] of it, or at the same depth.
    beside: usize,
    /// The triangle named is neither.
    elsewhere: usize,
    /// Whether the surface faces the light is said wrongly, n · l farther from 0 than [`GRAZING`], or whether it reaches there.
    misfaced: usize,
    /// The shadow is wrong, though no other answer lies within [`TIE`].
    wrong: usize,
    /// Both answers lie within [`TIE`], and the renderer has the other one.
    ties: usize,
    /// Largest distance of the sample from its triangle's plane, in units of 2⁻²⁴ of its largest coordinate.
    off_plane: f64,
    /// Largest distance of the sample from where it belongs, pixels.
    off_sample: f64,
}

/// How far a rasteriser moves corners, pixels: half a 256th in x and in y, and some rounding.
const SNAP: f64 = 0.004;
/// How far a sample is moved to see whether another answer is as good, in terms of the scene's largest coordinate: about
/// eight times the rounding of a coordinate.
const TIE: f64 = 1e-6;
/// Cosine to the light below which the rounding of a normal decides.
const GRAZING: f64 = 2e-6;

/// Compares a picture with the reference, pixel by pixel.
fn compare(r: &mut Renderer, reference: &Reference, setup: &Setup) -> Count {
    r.render(setup, ask(setup)).unwrap();
    let truth = r.read_truth().unwrap();
    assert_eq!(truth, r.read_visibility().unwrap(), "the truth is rt-hard");
    let (mask, position, surface) = (r.read_mask().unwrap(), r.read_position().unwrap(), r.read_surface().unwrap());
    let pinhole = Pinhole::new(&setup.camera, setup.size);
    let pixel = |i: usize| {
        let at = DVec2::new((i % setup.size[0] as usize) as f64, (i / setup.size[0] as usize) as f64) + 0.5;
        let p = Vec3::from_slice(&position[i][..3]).as_dvec3();
        let named = (mask[i] != BACKGROUND).then_some(surface[i][3] as usize);
        judge(reference, &pinhole, setup, at, named, p, mask[i], truth[i] > 0.0)
    };
    (0..truth.len()).into_par_iter().map(pixel).reduce(Count::default, |a, b| Count {
        pixels: a.pixels + b.pixels,
        facing: a.facing + b.facing,
        dark: a.dark + b.dark,
        beside: a.beside + b.beside,
        elsewhere: a.elsewhere + b.elsewhere,
        misfaced: a.misfaced + b.misfaced,
        wrong: a.wrong + b.wrong,
        ties: a.ties + b.ties,
        off_plane: a.off_plane.max(b.off_plane),
        off_sample: a.off_sample.max(b.off_sample),
    })
}

/// One pixel: `named` and `p` are the triangle and the sample of the G-buffer.
#[allow(clippy::too_many_arguments)]
fn judge(
    reference: &Reference,
    pinhole: &Pinhole,
    setup: &Setup,
    at: DVec2,
    named: Option<usize>,
    p: DVec3,
    class: u32,
    lit: bool,
) -> Count {
    let mut count = Count { pixels: 1, ..Count::default() };
    let near = setup.camera.near as f64;
    let seen = |at: DVec2| reference.nearest(pinhole.eye, pinhole.ray(at), near).map(|n| n.0);
    let same = |a: Option<usize>, b: Option<usize>| a.map(|i| reference.surface[i]) == b.map(|i| reference.surface[i]);
    if !same(seen(at), named) {
        let around = |k: usize| {
            at + DVec2::from_angle(k as f64 * TAU / 16.0) * SNAP * if k.is_multiple_of(2) { 1.0 } else { 0.5 }
        };
        // Or both are equally far for the depth buffer.
        let nearest = reference.nearest(pinhole.eye, pinhole.ray(at), near);
        let depth = |i: usize| meet(&reference.triangles[i], pinhole.eye, pinhole.ray(at)).map_or(0.0, |m| m.t);
        let level = nearest.zip(named).is_some_and(|(n, i)| (depth(i) / n.1 - 1.0).abs() < 1e-5);
        let beside = level || (0..16).any(|k| same(seen(around(k)), named));
        count.beside += beside as usize;
        count.elsewhere += !beside as usize;
    }
    let Some(own) = named else { return count };
    let ray = pinhole.ray(at);
    if count.beside > 0 && reference.normal(own).dot(ray) > 0.0 {
        // The rim of a body: the rasteriser shows the back of a triangle that the ray does not meet.
        count.ties += 1;
        return count;
    }
    let sample = reference.sample(own, pinhole.eye, ray);
    let away = reference.normal(own);
    count.off_plane = away.dot(p - reference.triangles[own][0]).abs() / p.abs().max_element() * 2f64.powi(24);
    count.off_sample = pinhole.seen(p).distance(pinhole.seen(sample));
    let normal = if away.dot(ray) < 0.0 { away } else { -away };
    let (to_light, _, reached) = towards(&setup.light, sample);
    let facing = class == FACING || class == OUTSIDE;
    let cosine = normal.dot(to_light.normalize());
    if facing != (cosine > 0.0) {
        count.misfaced += (cosine.abs() > GRAZING) as usize;
        return count;
    }
    if !facing {
        return count;
    }
    let bound = TIE * reference.size;
    // The sample moved about on its triangle: whatever decides passes within the bound or not.
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let moved = |k: usize| {
        let (sin, cos) = (k as f64 * TAU / 16.0).sin_cos();
        let to = sample + (u * cos + v * sin) * bound * if k.is_multiple_of(2) { 1.0 } else { 0.5 };
        reference.sample(own, pinhole.eye, to - pinhole.eye)
    };
    if reached != (class == FACING) {
        count.misfaced += (0..16).all(|k| towards(&setup.light, moved(k)).2 == reached) as usize;
        return count;
    }
    if !reached {
        count.wrong += lit as usize;
        return count;
    }
    count.facing = 1;
    count.dark = !lit as usize;
    let answer = |p: DVec3| {
        let (to_light, far, _) = towards(&setup.light, p);
        reference.shadow(own, p, to_light, far, bound)
    };
    let exact = answer(sample);
    if exact != Shadow::Touches && lit == (exact == Shadow::Lit) {
        return count;
    }
    // Low light reaches far for what lies so much higher.
    let lifted = || answer(sample + normal * bound) != exact;
    let tie = exact == Shadow::Touches || lifted() || (0..16).any(|k| answer(moved(k)) != exact);
    count.ties += tie as usize;
    count.wrong += !tie as usize;
    count
}

/// An icosahedron whose faces are divided by four `times` and moved to the unit sphere, its radius then multiplied by `bulge`.
fn sphere(times: usize, bulge: impl Fn(DVec3) -> f64) -> Vec<[Vec3; 3]> {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let corners: Vec<DVec3> = (0..12)
        .map(|i| {
            let (x, y) = (if i & 1 == 0 { 1.0 } else { -1.0 }, if i & 2 == 0 { g } else { -g });
            [DVec3::new(x, y, 0.0), DVec3::new(0.0, x, y), DVec3::new(y, 0.0, x)][i / 4].normalize()
        })
        .collect();
    let mut faces = Vec::new();
    for (i, j, k) in (0..12).flat_map(|i| (i + 1..12).flat_map(move |j| (j + 1..12).map(move |k| (i, j, k)))) {
        let [a, b, c] = [corners[i], corners[j], corners[k]];
        let edge = 2.1 / (1.0 + g * g).sqrt();
        if a.distance(b).max(b.distance(c)).max(c.distance(a)) < edge {
            let outwards = (b - a).cross(c - a).dot(a) > 0.0;
            faces.push(if outwards { [a, b, c] } else { [a, c, b] });
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..times {
        faces = faces
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [x, y, z] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
            })
            .collect();
    }
    let place = |p: DVec3| (p * bulge(p)).as_vec3();
    faces.into_iter().map(|t| t.map(place)).collect()
}

/// A closed ring of n × m quads, each cut in two.
fn torus(n: usize, m: usize) -> Vec<[Vec3; 3]> {
    let p = |i: usize, j: usize| {
        let (u, v) = ((i % n) as f64 / n as f64 * TAU, (j % m) as f64 / m as f64 * TAU);
        let r = 1.0 + 0.4 * v.cos();
        DVec3::new(r * u.cos(), 0.4 * v.sin(), r * u.sin()).as_vec3()
    };
    let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [p(i, j), p(i, j + 1), p(i + 1, j + 1), p(i + 1, j)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// Lights of every kind around what lies within `radius` of `center`.
fn lights(center: Vec3, radius: f32) -> Vec<Light> {
    let at = |x: f32, y: f32, z: f32| center + radius * Vec3::new(x, y, z);
    let color = Vec3::splat(radius * radius);
    let range = 20.0 * radius;
    vec![
        sun(Vec3::new(0.5, 0.7, 0.6)),
        sun(Vec3::new(-1.0, 0.11, 0.35)),
        Light::Spot {
            position: at(1.5, 2.0, 0.7),
            direction: Vec3::new(-1.4, -2.0, -0.8),
            outer_angle: 24.0,
            range,
            radius: 0.0,
            color,
        },
        Light::Omni { position: at(-0.9, 1.1, 0.8), range, radius: 0.0, color },
        Light::Hemisphere { position: at(0.4, 0.7, 1.0), direction: Vec3::new(0.1, -1.0, -0.2), range, color },
    ]
}

/// A body alone, seen from nearby.
fn body(triangles: Vec<[Vec3; 3]>) -> Scene {
    let view = camera(Vec3::new(0.3, 0.8, 2.5), Vec3::ZERO);
    let material = Material { double_sided: false, ..material(Vec3::splat(0.7)) };
    scene(vec![mesh(&triangles, 0)], vec![material], view, sun(Vec3::Y))
}

/// Compares a scene under lights of every kind around `reach`, a centre and a radius. `most`: wrong pixels allowed, as a share
/// of those that face the light.
fn check(name: &str, scene: Scene, reach: (Vec3, f32), size: [u32; 2], most: f64) {
    let (mut renderer, mut setup) = start(scene, size);
    setup.select("rt-hard").unwrap();
    let reference = Reference::new(&renderer);
    for light in lights(reach.0, reach.1) {
        setup.light = light;
        let c = compare(&mut renderer, &reference, &setup);
        let name = format!("{name}, {}", light.kind());
        println!("{name}: {c:?}");
        assert!(c.facing * 50 > c.pixels, "{name} tests too little: {c:?}");
        assert!(c.wrong as f64 <= most * c.facing as f64, "{name}: the shadow is wrong: {c:?}");
        assert_eq!(c.misfaced, 0, "{name}: {c:?}");
        assert!(c.ties * 1000 <= c.pixels, "{name}: {c:?}");
        assert!(c.elsewhere * 100 <= c.pixels && c.beside * 50 <= c.pixels, "{name}: {c:?}");
        // Up to half an ulp in each coordinate, and once more in the sum it is made of.
        assert!(c.off_plane < 4.0 && c.off_sample < 0.05, "{name}: {c:?}");
    }
}

#[test]
fn convex_bodies() {
    for times in [0, 3, 5, 6] {
        let name = format!("sphere of {} triangles", 20 << (2 * times));
        check(&name, body(sphere(times, |_| 1.0)), (Vec3::ZERO, 1.0), [160, 120], 0.0);
    }
}

/// A convex body casts no shadow on itself: whatever faces the light is lit.
#[test]
fn a_convex_body_is_not_dark_where_it_faces_the_light() {
    for times in [5, 6] {
        let (mut r, mut setup) = start(body(sphere(times, |_| 1.0)), [400, 400]);
        let towards =
            [(0.5, 0.7, 0.6), (1.0, 0.2, 0.4), (-0.3, 0.9, 0.1), (-0.6, -0.5, 0.9), (0.1, 0.3, -0.2), (0.9, 1.0, -0.7)];
        for (x, y, z) in towards {
            setup.light = sun(Vec3::new(x, y, z));
            r.render(&setup, ask(&setup)).unwrap();
            let (mask, truth) = (r.read_mask().unwrap(), r.read_truth().unwrap());
            let facing = mask.iter().filter(|m| **m == FACING).count();
            let dark = mask.iter().zip(&truth).filter(|(m, t)| **m == FACING && **t < 1.0).count();
            assert!(facing > 5000, "{facing} pixels");
            assert_eq!(dark, 0, "{} triangles, sun {:?}: {dark} of {facing}", 20 << (2 * times), setup.light);
        }
    }
}

#[test]
fn closed_bodies() {
    let waves = |p: DVec3| 1.0 + 0.12 * (9.0 * p.x).sin() * (8.0 * p.y + 1.0).sin() * (7.0 * p.z).cos();
    for (name, triangles) in [
        ("torus", torus(160, 64)),
        ("coarse torus", torus(16, 8)),
        ("wavy body", sphere(5, waves)),
        ("coarse wavy body", sphere(3, waves)),
    ] {
        check(name, body(triangles), (Vec3::ZERO, 1.0), [160, 120], 0.0);
    }
}

#[test]
fn scenes() {
    // Those without masks, which the reference does not know.
    for name in ["bench", "blocks", "arches", "hall", "observatory", "pavilion", "cubes"] {
        let scene = builtin::build(name).unwrap();
        let view = scene.cameras[0].camera;
        check(name, scene, (view.target, view.position.distance(view.target) / 2.0), [128, 72], 2e-5);
    }
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::ZERO);
    let yard = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::splat(0.7))], view, sun(Vec3::Y));
    check("yard", yard, (Vec3::ZERO, 4.0), [128, 72], 2e-5);
}
