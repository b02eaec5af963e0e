//! A frame's analysis and needs against closed forms and against counts made anew on the CPU.

use crate::common::*;
use glam::{DVec2, DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::analysis::Counts;
use shadowscope::measure::metrics::{self, FACING};
use shadowscope::scene::{Camera, Material};
use shadowscope::setup::Setup;
use shadowscope::truth::Samples;

const SIDE: f32 = 6.0;

/// A floor of 12 m × 12 m through the origin and nothing else.
fn plane(camera: Camera, light: Light, size: [u32; 2], sets: &[&str]) -> (Renderer, Setup) {
    hillside(Vec2::ZERO, camera, light, size, sets)
}

/// The same floor, rising by `slope` along x and z.
fn hillside(slope: Vec2, camera: Camera, light: Light, size: [u32; 2], sets: &[&str]) -> (Renderer, Setup) {
    let mut ground = floor(Vec2::splat(-SIDE), Vec2::splat(SIDE), 0.0);
    ground.iter_mut().flatten().for_each(|p| p.y = slope.dot(Vec2::new(p.x, p.z)));
    let (mut renderer, mut setup) =
        start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], camera, light), size);
    for set in sets {
        setup.set(set, &["shadow-map".into()]).unwrap();
    }
    renderer.render(&setup, analysed(&setup)).unwrap();
    (renderer, setup)
}

fn analysed(setup: &Setup) -> Ask {
    Ask { analysis: true, ..ask(setup) }
}

fn lamp(position: Vec3, target: Vec3, outer_angle: f32) -> Light {
    Light::Spot {
        position,
        direction: target - position,
        outer_angle,
        range: 60.0,
        radius: 0.0,
        color: Vec3::splat(40.0),
    }
}

/// Where a point lies in the map that covers what the light sees of the floor, 0 to 1 from its corner; in f64 and
/// from the definition alone. A sun's map is the box around the floor's bounds, a spot's the square around its cone.
fn uv(light: &Light, slope: Vec2, p: DVec3) -> DVec2 {
    let axis = light.axis().as_dvec3().normalize();
    let right = axis.cross(DVec3::Y).normalize();
    let up = right.cross(axis);
    let seen = |p: DVec3| DVec2::new(p.dot(right), -p.dot(up));
    if let Light::Spot { position, outer_angle, .. } = light {
        let d = p - position.as_dvec3();
        return 0.5 + 0.5 * seen(d) / (d.dot(axis) * (*outer_angle as f64).to_radians().tan());
    }
    let s = SIDE as f64;
    let h = s * (slope.x.abs() + slope.y.abs()) as f64;
    let corners = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| [-1.0, 1.0].map(|z| seen(DVec3::new(x * s, y * h, z * s)))));
    let low = corners.as_flattened().as_flattened().iter().fold(DVec2::INFINITY, |a, b| a.min(*b));
    let high = corners.as_flattened().as_flattened().iter().fold(DVec2::NEG_INFINITY, |a, b| a.max(*b));
    (seen(p) - low) / (high - low)
}

/// From `uv` to texels: the whole map, or the part of it that the visible receivers take with a texel to spare on
/// each side.
struct Map {
    light: Light,
    slope: Vec2,
    low: DVec2,
    side: DVec2,
    resolution: f64,
}

impl Map {
    fn of(setup: &Setup, slope: Vec2, positions: &[[f32; 4]]) -> Map {
        let values = setup.values();
        let resolution = values["resolution"].to_string().parse().unwrap();
        let mut map = Map { light: setup.light, slope, low: DVec2::ZERO, side: DVec2::ONE, resolution };
        if values["fit"].to_string() == "receivers" {
            let seen = positions.iter().filter(|p| reached(&setup.light, slope, p));
            let taken: Vec<DVec2> = seen.map(|p| uv(&setup.light, slope, point(p))).collect();
            let low = taken.iter().fold(DVec2::INFINITY, |a, b| a.min(*b));
            let high = taken.iter().fold(DVec2::NEG_INFINITY, |a, b| a.max(*b));
            let texel = (high - low) / (resolution - 2.0);
            (map.low, map.side) = (low - texel, high - low + 2.0 * texel);
        }
        map
    }

    fn texel(&self, p: DVec3) -> DVec2 {
        (uv(&self.light, self.slope, p) - self.low) / self.side * self.resolution
    }
}

fn point(p: &[f32; 4]) -> DVec3 {
    DVec3::new(p[0] as f64, p[1] as f64, p[2] as f64)
}

/// Whether the floor's point faces the light and lies in its cone.
fn reached(light: &Light, slope: Vec2, p: &[f32; 4]) -> bool {
    let position = light.position().as_dvec3();
    let towards = if light.kind() == "spot" { position - point(p) } else { position };
    match light {
        _ if p[3] <= 0.0 || towards.dot(normal(slope)) <= 0.0 => false,
        Light::Spot { outer_angle, .. } => {
            let d = point(p) - position;
            d.normalize().dot(light.axis().as_dvec3().normalize()) >= (*outer_angle as f64).to_radians().cos()
        }
        _ => true,
    }
}

fn normal(slope: Vec2) -> DVec3 {
    DVec3::new(-slope.x as f64, 1.0, -slope.y as f64).normalize()
}

/// Where the ray through a place of the picture, pixels from its upper left corner, meets the floor.
fn on_floor(slope: Vec2, camera: &Camera, size: [u32; 2], at: DVec2) -> DVec3 {
    let eye = camera.position.as_dvec3();
    let forward = (camera.target.as_dvec3() - eye).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let size = DVec2::new(size[0] as f64, size[1] as f64);
    let tangent = (camera.fov as f64 / 2.0).to_radians().tan();
    let ndc = (at / size * 2.0 - 1.0) * DVec2::new(tangent * size.x / size.y, -tangent);
    let ray = forward + right * ndc.x + up * ndc.y;
    eye - ray * (eye.dot(normal(slope)) / ray.dot(normal(slope)))
}

/// Longest extent and area of a texel in the picture, from the homography's Jacobian by central differences.
fn closed_form(map: &Map, camera: &Camera, size: [u32; 2], at: DVec2) -> (f64, f64) {
    let h = 1e-4;
    let texel = |d: DVec2| map.texel(on_floor(map.slope, camera, size, at + d));
    let jx = (texel(DVec2::X * h) - texel(DVec2::X * -h)) / (2.0 * h);
    let jy = (texel(DVec2::Y * h) - texel(DVec2::Y * -h)) / (2.0 * h);
    longest(jx, jy)
}

/// Largest singular value and determinant of the inverse of the matrix with these columns.
fn longest(jx: DVec2, jy: DVec2) -> (f64, f64) {
    let determinant = jx.x * jy.y - jx.y * jy.x;
    // A = J⁻¹; the largest eigenvalue of AᵀA is its largest singular value squared.
    let (a, b) = (DVec2::new(jy.y, -jx.y) / determinant, DVec2::new(-jy.x, jx.x) / determinant);
    let (p, q, r) = (a.dot(a), b.dot(b), a.dot(b));
    let largest = 0.5 * (p + q) + (0.25 * (p - q) * (p - q) + r * r).sqrt();
    (largest.sqrt(), 1.0 / determinant.abs())
}

/// Longest extent in metres of the texel at a point, seen across the light's beam.
fn facing_texel(map: &Map, p: DVec3) -> f64 {
    let light = map.light.position().as_dvec3();
    let beam = if map.light.kind() == "spot" { (light - p).normalize() } else { light };
    let u = beam.any_orthonormal_vector();
    let h = 1e-4;
    let along = |d: DVec3| (map.texel(p + d * h) - map.texel(p - d * h)) / (2.0 * h);
    longest(along(u), along(beam.cross(u))).0
}

/// m of a single plane is that of the homography from picture to map, in every direction of light and gaze.
#[test]
fn aliasing_error_of_a_plane_is_the_homographys() {
    let size = [96, 72];
    let suns = [Vec3::new(0.3, 1.0, 0.2), Vec3::new(-1.0, 0.4, 0.5), Vec3::new(0.2, 0.15, -1.0)];
    let lamps = [
        lamp(Vec3::new(-2.0, 4.0, 1.0), Vec3::ZERO, 40.0),
        lamp(Vec3::new(4.0, 1.5, -3.0), Vec3::new(0.0, 0.0, 0.5), 25.0),
    ];
    let views =
        [camera(Vec3::new(0.5, 5.0, 4.0), Vec3::ZERO), camera(Vec3::new(-4.0, 0.8, 2.0), Vec3::new(0.0, 0.0, 0.3))];
    for light in suns.map(sun).into_iter().chain(lamps) {
        for (view, slope) in views.into_iter().zip([Vec2::ZERO, Vec2::new(0.1, 0.12)]) {
            for fit in ["fit=scene", "fit=receivers"] {
                let (r, s) = hillside(slope, view, light, size, &["resolution=512", fit]);
                let (found, positions) = (r.analysis().aliasing(&r.gpu).unwrap().unwrap(), r.read_position().unwrap());
                let map = Map::of(&s, slope, &positions);
                let name = format!("{} {fit} from {}", light.kind(), view.position);
                let mut checked = 0;
                for (i, [m, perspective, projection, area]) in found.iter().map(|p| p.map(f64::from)).enumerate() {
                    if m < 0.0 {
                        continue;
                    }
                    let at = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
                    let (exact, exact_area) = closed_form(&map, &view, size, at);
                    assert!((m / exact - 1.0).abs() < 0.01, "{name}: m at {at} is {m}, not {exact}");
                    assert!((area / exact_area - 1.0).abs() < 0.01, "{name}: area at {at}: {area}, not {exact_area}");
                    // The same for a surface that faces the light, in pixels of the camera's at that depth.
                    let p = point(&positions[i]);
                    let tangent = (view.fov as f64 / 2.0).to_radians().tan();
                    let pixel = 2.0 * positions[i][3] as f64 * tangent / 72.0;
                    let parts = facing_texel(&map, p) / pixel;
                    assert!((perspective / parts - 1.0).abs() < 0.01, "{name}: perspective {perspective}, not {parts}");
                    assert!((perspective * projection / m - 1.0).abs() < 1e-5, "{name}: the parts make up m");
                    checked += 1;
                }
                assert!(checked > 500, "{name}: only {checked} pixels");
            }
        }
    }
}

/// In flatland m is w_l cos θ_i / (w_i cos θ_l) (Navratil 2015, equation 3.2): on the axes of a camera and a spot that
/// look at one point, in one plane with its normal.
#[test]
fn aliasing_error_of_flatland() {
    let at = |degrees: f32, distance: f32| {
        let a = degrees.to_radians();
        Vec3::new(0.0, a.cos(), a.sin()) * distance
    };
    let size = [65, 65];
    let mut stretched = 0;
    for (theta_i, d_i) in [(10.0f32, 4.0f32), (45.0, 2.0), (70.0, 6.0), (-60.0, 3.0)] {
        for (theta_l, d_l) in [(0.5f32, 5.0f32), (30.0, 3.0), (65.0, 8.0), (-75.0, 4.0), (80.0, 5.0)] {
            let view = camera(at(theta_i, d_i), Vec3::ZERO);
            let (r, _) = plane(view, lamp(at(theta_l, d_l), Vec3::ZERO, 20.0), size, &["resolution=512", "fit=scene"]);
            let found = r.analysis().aliasing(&r.gpu).unwrap().unwrap()[32 * 65 + 32].map(f64::from);
            let w_i = 2.0 * d_i as f64 * 25f64.to_radians().tan() / 65.0;
            let w_l = 2.0 * d_l as f64 * 20f64.to_radians().tan() / 512.0;
            let slopes = (theta_i as f64).to_radians().cos() / (theta_l as f64).to_radians().cos();
            // Across that plane nothing is stretched: that is the longer extent where the slopes shorten a texel.
            let projection = slopes.max(1.0);
            stretched += (slopes > 1.0) as u32;
            let exact = [w_l / w_i * projection, w_l / w_i, projection, (w_l / w_i).powi(2) * slopes];
            for (name, (found, exact)) in ["m", "perspective", "projection", "area"].iter().zip(found.iter().zip(exact))
            {
                assert!((found / exact - 1.0).abs() < 0.01, "{theta_i}°, {theta_l}°: {name} {found}, not {exact}");
            }
        }
    }
    assert!(stretched >= 5, "{stretched}");
}

/// All counts of the last frame's maps.
fn counts(r: &Renderer) -> Vec<u32> {
    let mut all = vec![u32::MAX; r.analysis().maps().unwrap().texels() as usize];
    let take = |first: u64, part: &[u32]| all[first as usize..first as usize + part.len()].copy_from_slice(part);
    assert!(r.analysis().counts(&r.gpu, take).unwrap());
    all
}

/// The counts add up to the pixels that look something up, and lie where the CPU projects them.
#[test]
fn counts_equal_projected_positions() {
    let view = camera(Vec3::new(0.5, 4.0, 5.0), Vec3::ZERO);
    for light in [sun(Vec3::new(0.4, 1.0, 0.3)), lamp(Vec3::new(-2.0, 4.0, 1.0), Vec3::ZERO, 40.0)] {
        // 64: many samples per texel; 8192: more texels than some adapters bind at once.
        for (resolution, fit) in [(64, "scene"), (256, "receivers"), (8192, "scene")] {
            let sets = [format!("resolution={resolution}"), format!("fit={fit}")];
            let (mut r, s) = plane(view, light, [160, 120], &[&sets[0], &sets[1]]);
            let name = format!("{} {sets:?}", light.kind());
            let (found, positions) = (counts(&r), r.read_position().unwrap());
            let map = Map::of(&s, Vec2::ZERO, &positions);
            let mut exact = vec![0u32; found.len()];
            let mut samples = 0;
            for p in positions.iter().filter(|p| reached(&light, Vec2::ZERO, p)) {
                let t = map.texel(point(p)).floor().clamp(DVec2::ZERO, DVec2::splat(resolution as f64 - 1.0));
                exact[t.y as usize * resolution + t.x as usize] += 1;
                samples += 1;
            }
            let sum: u32 = found.iter().sum();
            let facing = r.read_mask().unwrap().iter().filter(|m| **m == FACING).count() as u32;
            // A pixel on the very edge of a spot's cone may fall to either side.
            let edge = if light.kind() == "directional" { 0 } else { 3 };
            assert!(
                sum.abs_diff(facing) <= edge && sum.abs_diff(samples) <= edge,
                "{name}: {sum}, {samples}, {facing}"
            );
            // A sample on the border of two texels may fall into either.
            let moved: u32 = found.iter().zip(&exact).map(|(a, b)| a.abs_diff(*b)).sum();
            assert!(moved as f64 <= 0.01 * samples as f64 + 8.0, "{name}: {moved} of {samples} lie elsewhere");
            let pixels = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
            assert_eq!(pixels.iter().filter(|p| p[0] > 0.0).count() as u32, sum, "{name}: one sample, one m");
        }
    }
}

/// The statistics of the counts equal their definitions, computed the long way.
#[test]
fn statistics_of_counts_equal_their_definitions() {
    let view = camera(Vec3::new(0.5, 4.0, 5.0), Vec3::ZERO);
    let (mut r, s) = plane(view, sun(Vec3::new(0.4, 1.0, 0.3)), [96, 72], &["resolution=64", "fit=scene"]);
    let all: Vec<f64> = counts(&r).iter().map(|c| *c as f64).collect();
    let (n, sum) = (all.len() as f64, all.iter().sum::<f64>());
    let row = measure::accuracy(&mut r, &s, 0).unwrap();
    let covered = all.iter().filter(|c| **c > 0.0).count();
    assert_eq!((row.texels, row.texels_covered), (Some(4096), Some(covered as u64)));
    assert_eq!((row.views_rendered, row.views_needed), (Some(1), Some(1)));
    assert_eq!(row.count_max.unwrap() as f64, all.iter().copied().fold(0.0, f64::max));
    assert!((row.count_mean.unwrap() - sum / covered as f64).abs() < 1e-9);
    assert!((row.utilisation.unwrap() - covered as f64 / n.min(sum)).abs() < 1e-12);
    let differences: f64 = all.iter().flat_map(|a| all.iter().map(move |b| (a - b).abs())).sum();
    assert!((row.count_gini.unwrap() - differences / (2.0 * n * sum)).abs() < 1e-9);
    let entropy: f64 = all.iter().filter(|c| **c > 0.0).map(|c| -(c / sum) * (c / sum).ln()).sum();
    assert!((row.count_entropy.unwrap() - entropy / n.ln()).abs() < 1e-9);
    // The ends of the scale.
    let even = Counts::of(100, vec![3; 100]);
    assert!(even.gini.unwrap().abs() < 1e-12 && (even.entropy.unwrap() - 1.0).abs() < 1e-12);
    let one = Counts::of(100, vec![7]);
    assert!((one.gini.unwrap() - 0.99).abs() < 1e-12 && one.entropy.unwrap().abs() < 1e-12);
    let none = Counts::of(100, vec![]);
    assert_eq!((none.covered, none.gini, none.entropy, none.mean(), none.utilisation()), (0, None, None, None, None));
}

/// A box over a floor, so that something is in shadow.
fn with_box(light: Light) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-SIDE), Vec2::splat(SIDE), 0.0);
    triangles.extend(floor(Vec2::splat(-1.0), Vec2::splat(1.0), 1.5));
    let view = camera(Vec3::new(1.0, 6.0, 7.0), Vec3::ZERO);
    let (r, s) = start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::splat(0.7))], view, light), [160, 120]);
    // Judged by one sample, rays have no error.
    (r, Setup { truth_samples: Samples::Fixed(1), ..s })
}

fn row(r: &mut Renderer, s: &mut Setup, technique: &str, sets: &[&str]) -> measure::Record {
    s.select(technique).unwrap();
    for set in sets {
        s.set(set, &[technique.into()]).unwrap();
    }
    measure::accuracy(r, s, 0).unwrap()
}

/// What a frame needs and takes: rays, triangles, texels, views.
#[test]
fn needs_are_counted() {
    for light in [sun(Vec3::new(0.4, 1.0, 0.3)), lamp(Vec3::new(-2.0, 6.0, 1.0), Vec3::ZERO, 35.0)] {
        let (mut r, mut s) = with_box(light);
        let (rays, map) = (row(&mut r, &mut s, "rt-hard", &[]), row(&mut r, &mut s, "shadow-map", &["fit=scene"]));
        assert_eq!((rays.rmse, rays.rmse_image, rays.flip, rays.rmse_penumbra), (0.0, 0.0, 0.0, None));
        assert_eq!((rays.texels, rays.views_rendered, rays.triangles_submitted, rays.m_p50), (None, None, None, None));
        // Each sample of the map's is one ray's.
        let samples = (map.count_mean.unwrap() * map.texels_covered.unwrap() as f64).round() as u64;
        assert_eq!(rays.rays, samples, "{}", light.kind());
        assert_eq!(rays.rays, rays.facing as u64, "{}", light.kind());
        for (technique, rows) in [("shadow-map", 128), ("pcf", 64)] {
            let set = format!("resolution={rows}");
            let row = row(&mut r, &mut s, technique, &[&set, "fit=scene"]);
            assert_eq!((row.texels, row.rays), (Some(rows * rows), 0));
            assert_eq!((row.views_rendered, row.views_needed), (Some(1), Some(1)));
            if r.gpu.abilities.features.contains(wgpu::Features::PIPELINE_STATISTICS_QUERY) {
                assert_eq!(row.triangles_submitted, Some(4));
                // Timing may submit every pass alone; the count stays.
                r.render(&s, Ask { timed: true, ..analysed(&s) }).unwrap();
                let draws = r.analysis().draws(&r.gpu).unwrap().unwrap();
                assert_eq!((Some(draws.sent), Some(draws.drawn)), (row.triangles_submitted, row.triangles_drawn));
                // The sun's map holds all four; so does the spot's, though its frustum cuts the floor's two into more.
                assert_eq!((row.triangles_drawn, row.fragments), (Some(4), Some(draws.fragments)));
            }
            assert!(row.rmse_image > 0.0 && row.flip > 0.0 && row.flip < 0.2, "{row:?}");
            assert!(row.gpu_bytes >= rows * rows * 4);
        }
    }
}

/// Fragments are those that the draws make: one for each texel covered. Where no shader is needed none may count.
#[test]
fn fragments_are_counted() {
    let ground = floor(Vec2::splat(-SIDE), Vec2::splat(SIDE), 0.0);
    for cutoff in [None, Some(0.5)] {
        let masked = Material { alpha_cutoff: cutoff, ..material(Vec3::ONE) };
        let view = camera(Vec3::new(1.0, 6.0, 7.0), Vec3::ZERO);
        let (mut r, mut s) = start(scene(vec![mesh(&ground, 0)], vec![masked], view, sun(Vec3::Y)), [64, 48]);
        let row = row(&mut r, &mut s, "shadow-map", &["resolution=64", "fit=scene"]);
        if r.gpu.abilities.features.contains(wgpu::Features::PIPELINE_STATISTICS_QUERY) {
            // The floor fills the map but for what is spared around it; rasterisers work in blocks.
            let fragments = row.fragments.unwrap();
            let covered = (60 * 60..=70 * 70).contains(&fragments);
            assert!(covered || (fragments == 0 && cutoff.is_none()), "{fragments} with {cutoff:?}");
        }
    }
}

/// Area, stretch and anisotropy of a texel on a plane are those of the homography.
#[test]
fn texels_of_a_plane_are_the_homographys() {
    let (size, slope) = ([96, 72], Vec2::new(0.1, 0.12));
    let view = camera(Vec3::new(-4.0, 0.8, 2.0), Vec3::new(0.0, 0.0, 0.3));
    for light in [sun(Vec3::new(-1.0, 0.4, 0.5)), lamp(Vec3::new(4.0, 1.5, -3.0), Vec3::new(0.0, 0.0, 0.5), 25.0)] {
        let (mut r, s) = hillside(slope, view, light, size, &["resolution=512", "fit=scene"]);
        let positions = r.read_position().unwrap();
        let map = Map::of(&s, slope, &positions);
        let exact = positions
            .iter()
            .enumerate()
            .filter(|(_, p)| reached(&light, slope, p))
            .map(|(i, _)| closed_form(&map, &view, size, DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5)));
        let exact: Vec<(f64, f64)> = exact.collect();
        let row = measure::accuracy(&mut r, &s, 0).unwrap();
        let sorted = |of: fn(&(f64, f64)) -> f64| {
            let mut all: Vec<f64> = exact.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            [0.5, 0.95].map(|q| all[((all.len() - 1) as f64 * q).round() as usize])
        };
        for (name, found, exact) in [
            ("area", [row.texel_area_p50, row.texel_area_p95], sorted(|(_, area)| *area)),
            ("stretch", [row.stretch_p50, row.stretch_p95], sorted(|(m, area)| m * m + (area / m) * (area / m))),
            ("anisotropy", [row.anisotropy_p50, row.anisotropy_p95], sorted(|(m, area)| m * m / area)),
        ] {
            for (found, exact) in found.into_iter().zip(exact) {
                let found = found.unwrap();
                assert!((found / exact - 1.0).abs() < 0.02, "{}: {name} {found}, not {exact}", light.kind());
            }
        }
        assert_eq!(row.folds, Some(0));
    }
}

/// A camera that looks away from the floor: nothing is looked up, so no view is needed.
#[test]
fn a_map_that_nobody_looks_into_is_not_needed() {
    let (mut r, mut s) = with_box(sun(Vec3::Y));
    s.camera = camera(Vec3::new(0.0, 3.0, 0.0), Vec3::new(0.0, 9.0, 1.0));
    let row = row(&mut r, &mut s, "shadow-map", &[]);
    assert_eq!((row.facing, row.views_rendered, row.views_needed), (0, Some(1), Some(0)));
    assert_eq!((row.texels_covered, row.count_max, row.m_max, row.utilisation), (Some(0), Some(0), None, None));
}

/// Only what is facing and lit wrongly changes the picture: its error is that of the shaded colours.
#[test]
fn the_pictures_error_is_that_of_the_pictures() {
    let (mut r, mut s) = with_box(sun(Vec3::new(0.4, 1.0, 0.3)));
    s.view = "depth".into();
    let row = row(&mut r, &mut s, "shadow-map", &["resolution=64"]);
    s.view = "shaded".into();
    r.render(&s, ask(&s)).unwrap();
    let picture = r.read_picture().unwrap();
    let exact = r.read_truth_picture(&s).unwrap();
    s.select("rt-hard").unwrap();
    r.render(&s, ask(&s)).unwrap();
    assert_eq!(r.read_picture().unwrap(), exact, "the truth's picture is the reference's");
    let differing = picture.chunks_exact(4).zip(exact.chunks_exact(4)).filter(|(a, b)| a != b).count();
    assert_eq!(differing, row.lit_incorrect + row.shadow_incorrect);
    assert_eq!(row.rmse_image, metrics::rmse_image(&picture, &exact));
    assert_eq!(row.flip, metrics::flip(&exact, &picture, s.size));
}

/// The value under the cursor is what the buffers hold, and a frame that was not asked for analysis has none.
#[test]
fn the_value_under_the_cursor() {
    let (mut r, mut s) = with_box(sun(Vec3::new(0.4, 1.0, 0.3)));
    s.set("resolution=250", &["shadow-map".into()]).unwrap();
    let mut show = |r: &mut Renderer, view: &str| {
        s.view = view.into();
        r.render(&s, Ask { truth: Truth::All, ..ask(&s) }).unwrap();
    };
    let sky = [1, 1];
    show(&mut r, "aliasing");
    let pixels = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
    let floor_pixel = [80, 100];
    let [m, perspective, projection, _] = pixels[100 * 160 + 80];
    let text = r.value_at(floor_pixel).unwrap().unwrap();
    let numbers: Vec<f32> =
        text.split(|c: char| !c.is_ascii_digit() && c != '.').flat_map(|t| t.parse().ok()).collect();
    assert!(numbers.len() == 3, "{text}");
    for (text, exact) in numbers.iter().zip([m, perspective, projection]) {
        assert!((text / exact - 1.0).abs() < 0.006, "{numbers:?} {exact}");
    }
    assert_eq!(r.value_at(sky).unwrap(), None);
    assert_eq!(r.value_at([9999, 0]).unwrap(), None);

    show(&mut r, "counts");
    let all = counts(&r);
    // The square map is fitted into 160 × 120 pixels.
    let mut seen = 0;
    for y in (0..120).step_by(7) {
        for x in (0..160).step_by(7) {
            let Some(text) = r.value_at([x, y]).unwrap() else {
                assert!(!(20..140).contains(&x), "{x}, {y}");
                continue;
            };
            let n: Vec<usize> = text.split(|c: char| !c.is_ascii_digit()).flat_map(|t| t.parse().ok()).collect();
            assert_eq!(all[n[1] * 250 + n[0]] as usize, n[2], "{text}");
            let at = |p: u32, middle: f32| ((p as f32 + 0.5 - middle) * 250.0 / 120.0 + 125.0) as usize;
            assert_eq!((n[0], n[1]), (at(x, 80.0), at(y, 60.0)), "{text}");
            seen += n[2];
        }
    }
    assert!(seen > 20, "{seen}");

    show(&mut r, "texels");
    let text = r.value_at(floor_pixel).unwrap().unwrap();
    assert!(text.starts_with("texel ") && r.value_at(sky).unwrap().is_none(), "{text}");
    assert!(r.analysis().maps().is_none() && r.analysis().aliasing(&r.gpu).unwrap().is_none());
    assert!(!r.analysis().counts(&r.gpu, |_, _| panic!("no counts")).unwrap());

    let mut show = |r: &mut Renderer, view: &str, technique: &str| {
        s.select(technique).unwrap();
        s.view = view.into();
        r.render(&s, ask(&s)).unwrap();
        r.value_at(floor_pixel).unwrap()
    };
    let bias = show(&mut r, "bias", "shadow-map").unwrap();
    assert!(bias.strip_prefix("bias: ").unwrap().parse::<f32>().unwrap() > 0.0, "{bias}");
    let visits = show(&mut r, "visits", "rt-hard").unwrap();
    assert!(visits.strip_prefix("node visits: ").unwrap().parse::<f32>().unwrap() >= 1.0, "{visits}");
    assert_eq!(show(&mut r, "visibility", "rt-hard").unwrap(), "visibility 1");
    assert_eq!(show(&mut r, "error", "rt-hard").unwrap(), "visibility 1, truth 1");
    assert_eq!(show(&mut r, "shaded", "rt-hard"), None);
}

/// The picture of the counts is white where a texel has no sample, and coloured where it has some.
#[test]
fn the_count_maps_picture_tells_none_from_one() {
    let (mut r, mut s) = with_box(sun(Vec3::new(0.4, 1.0, 0.3)));
    s.view = "counts".into();
    s.set("resolution=100", &["shadow-map".into()]).unwrap();
    r.render(&s, ask(&s)).unwrap();
    let (picture, all) = (r.read_picture().unwrap(), counts(&r));
    let mut kinds = [0; 3];
    for (i, p) in picture.chunks_exact(4).enumerate() {
        let at = [(i % 160) as f32 + 0.5 - 80.0, (i / 160) as f32 + 0.5 - 60.0].map(|x| x * (100.0 / 120.0) + 50.0);
        if at.iter().any(|x| *x < 0.0 || *x >= 100.0) {
            assert!(p[0] < 40, "beside the map: {p:?}");
            continue;
        }
        let count = all[at[1] as usize * 100 + at[0] as usize];
        kinds[count.min(2) as usize] += 1;
        match count {
            0 => assert!(p[..3].iter().all(|c| *c > 240), "{p:?}"),
            1 => assert!(p[1] > p[0] + 30 && p[1] > p[2] + 30, "{p:?}"),
            _ => assert!(p[0] > p[2] + 20 && p[0] < 240, "{count}: {p:?}"),
        }
    }
    assert!(kinds.iter().all(|n| *n > 100), "{kinds:?}");
}

/// The texel grid's squares are the texels that the points of the floor lie in.
#[test]
fn the_texel_under_the_cursor() {
    let view = camera(Vec3::new(0.5, 4.0, 5.0), Vec3::ZERO);
    for resolution in [64, 8192] {
        let sets = [&*format!("resolution={resolution}"), "fit=scene"];
        let (mut r, mut s) = plane(view, sun(Vec3::new(0.4, 1.0, 0.3)), [96, 72], &sets);
        s.view = "texels".into();
        r.render(&s, ask(&s)).unwrap();
        let positions = r.read_position().unwrap();
        let map = Map::of(&s, Vec2::ZERO, &positions);
        let mut checked = 0;
        for (x, y) in (0..96).step_by(9).flat_map(|x| (0..72).step_by(5).map(move |y| (x, y))) {
            let p = &positions[y * 96 + x];
            let text = r.value_at([x as u32, y as u32]).unwrap();
            assert_eq!(text.is_some(), p[3] > 0.0);
            let Some(text) = text else { continue };
            let exact = map.texel(point(p));
            let (a, b) = text.strip_prefix("texel ").and_then(|t| t.split_once(", ")).expect("a texel");
            let found = DVec2::new(a.parse().unwrap(), b.parse().unwrap());
            assert!((found + 0.5 - exact).abs().max_element() < 0.52, "{text} instead of {exact}");
            checked += 1;
        }
        assert!(checked > 80, "{checked}");
    }
}

/// The picture of the aliasing error is green at 1, warm above and cool below; lightness falls all the way.
#[test]
fn colours_tell_under_from_oversampling() {
    let view = camera(Vec3::new(0.5, 4.0, 5.0), Vec3::ZERO);
    let mut last = f32::INFINITY;
    for resolution in [4096, 1024, 256, 64] {
        let (mut r, mut s) =
            plane(view, sun(Vec3::new(0.4, 1.0, 0.3)), [96, 72], &[&format!("resolution={resolution}")]);
        s.view = "aliasing".into();
        r.render(&s, ask(&s)).unwrap();
        let (picture, m) = (r.read_picture().unwrap(), r.analysis().aliasing(&r.gpu).unwrap().unwrap());
        for (p, m) in picture.chunks_exact(4).zip(&m).filter(|(_, m)| m[0] > 0.0) {
            let [red, green, blue] = [p[0], p[1], p[2]].map(i32::from);
            match m[0] {
                m if m < 0.5 => assert!(blue > red + 20, "m {m}: {p:?}"),
                m if (0.95..1.05).contains(&m) => assert!(green > red + 30 && green > blue + 30, "m {m}: {p:?}"),
                m if m > 2.0 => assert!(red > blue + 20 && red > green + 20, "m {m}: {p:?}"),
                _ => {}
            }
        }
        let lightness: f32 = picture.chunks_exact(4).map(|p| 0.2 * p[0] as f32 + 0.7 * p[1] as f32).sum();
        assert!(lightness < last, "{resolution}: {lightness} after {last}");
        last = lightness;
    }
}

/// Every column of a measured row is described.
#[test]
fn every_column_is_documented() {
    let mut csv = Vec::new();
    measure::write_csv(&[measure::Record::default()], &mut csv).unwrap();
    let text = String::from_utf8(csv).unwrap();
    let doc = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/measures.md")).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert!(names.len() > 50, "{names:?}");
    let missing: Vec<&&str> = names.iter().filter(|n| !doc.contains(&format!("`{n}`"))).collect();
    assert!(missing.is_empty(), "docs/measures.md lacks {missing:?}");
}
