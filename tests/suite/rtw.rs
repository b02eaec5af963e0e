//! Rectilinear texture warping against its tables computed in f64, the truth, and its own shortcomings.

use crate::common::*;
use glam::{DVec2, DVec3, Mat4, Vec2, Vec3, Vec4};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::{Light, LightView};
use shadowscope::measure::metrics::{BACKGROUND, FACING};
use shadowscope::scene::Camera;
use shadowscope::scene::builtin::cases;
use shadowscope::setup::Setup;

/// View samples in each column and in each row of the map, and the texels that have any.
struct Counts {
    columns: Vec<u64>,
    rows: Vec<u64>,
    used: u64,
    total: u64,
}

fn counts(r: &mut Renderer, s: &Setup, side: usize) -> Counts {
    r.render(s, Ask { analysis: true, picture: false, ..ask(s) }).unwrap();
    let mut c = Counts { columns: vec![0; side], rows: vec![0; side], used: 0, total: 0 };
    let each = |first: u64, part: &[u32]| {
        for (i, n) in part.iter().enumerate() {
            let at = first as usize + i;
            c.columns[at % side] += *n as u64;
            c.rows[at / side] += *n as u64;
            c.used += (*n > 0) as u64;
            c.total += *n as u64;
        }
    };
    r.analysis().counts(&r.gpu, each).unwrap();
    c
}

/// A view sample that the light reaches, as the technique sees it.
struct Sample {
    position: DVec3,
    normal: DVec3,
    /// How far the farthest of the four pixels around it lies off its plane, as a share of its depth; infinite beside the sky
    /// and where normals turn by more than 30°.
    off: f64,
}

/// The geometric normal of a pixel's surface words.
fn octahedral(words: [u32; 4]) -> DVec3 {
    let at = |word: u32| ((word << 8) as i32 >> 8) as f64 / 8388607.0;
    let (x, y) = (at(words[0]), at(words[0] >> 24 | words[1] >> 24 << 8 | words[2] >> 24 << 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = |a: f64| a - (-z).max(0.0) * if a >= 0.0 { 1.0 } else { -1.0 };
    DVec3::new(fold(x), fold(y), z).normalize()
}

/// The last frame's view samples; `size`: its pixels.
fn samples(r: &mut Renderer, light: &Light, size: [u32; 2]) -> Vec<Sample> {
    let (mask, at, surface) = (r.read_mask().unwrap(), r.read_position().unwrap(), r.read_surface().unwrap());
    let reached = |p: DVec3| match light {
        Light::Spot { position, outer_angle, .. } => {
            let way = (p - position.as_dvec3()).normalize();
            way.dot(light.axis().as_dvec3()) >= (*outer_angle as f64).to_radians().cos()
        }
        _ => true,
    };
    let size = size.map(|n| n as i64);
    let position = |i: usize| DVec3::new(at[i][0] as f64, at[i][1] as f64, at[i][2] as f64);
    let off = |i: usize| {
        let (x, y) = (i as i64 % size[0], i as i64 / size[0]);
        let normal = octahedral(surface[i]);
        let around = [[-1, 0], [1, 0], [0, -1], [0, 1]].map(|[dx, dy]| [x + dx, y + dy]);
        let inside = around.into_iter().filter(|p| (0..2).all(|k| (0..size[k]).contains(&p[k])));
        let each = inside.map(|[x, y]| {
            let j = (y * size[0] + x) as usize;
            let turned = mask[j] == BACKGROUND || normal.dot(octahedral(surface[j])) < 0.866;
            if turned { f64::INFINITY } else { normal.dot(position(j) - position(i)).abs() / at[i][3] as f64 }
        });
        each.fold(0.0, f64::max)
    };
    (0..mask.len())
        .filter(|i| mask[*i] == FACING)
        .map(|i| Sample { position: position(i), normal: octahedral(surface[i]), off: off(i) })
        .filter(|s| reached(s.position))
        .collect()
}

/// Where the whole scene's view puts a point, shares of its sides.
fn place(v: &LightView, p: DVec3) -> DVec2 {
    let row = |r: Vec4| r.as_dvec4().dot(p.extend(1.0));
    (DVec2::new(row(v.row_x), -row(v.row_y)) / row(v.row_w) + 1.0) * 0.5
}

/// Warps of x and y from an importance map, in f64.
fn warps(importance: &[f64], bins: usize, sigma: f64, floor: f64) -> [Vec<f64>; 2] {
    [true, false].map(|columns| {
        let at = |line: usize, i: usize| importance[if columns { i * bins + line } else { line * bins + i }];
        let profile: Vec<f64> = (0..bins).map(|line| (0..bins).map(|i| at(line, i)).fold(0.0, f64::max)).collect();
        let weight = |d: f64| if sigma > 0.0 { (-0.5 * (d / sigma).powi(2)).exp() } else { (d == 0.0) as u32 as f64 };
        let blurred: Vec<f64> = (0..bins)
            .map(|i| {
                let near = (0..bins).filter(|j| (i.abs_diff(*j) as f64) <= (3.0 * sigma).ceil());
                let (sum, all) = near.fold((0.0, 0.0), |(sum, all), j| {
                    let w = weight(i.abs_diff(j) as f64);
                    (sum + w * profile[j], all + w)
                });
                sum / all
            })
            .collect();
        let peak = blurred.iter().copied().fold(0.0, f64::max);
        let widths: Vec<f64> = blurred.iter().map(|v| v + floor.max(1e-6 * bins as f64) * peak).collect();
        let all: f64 = widths.iter().sum();
        let mut edges = vec![0.0];
        for w in &widths {
            edges.push(edges[edges.len() - 1] + w / all);
        }
        edges
    })
}

fn warped(edges: &[f64], x: f64) -> f64 {
    let at = x.clamp(0.0, 1.0) * (edges.len() - 1) as f64;
    let i = (at as usize).min(edges.len() - 2);
    edges[i] + (at - i as f64) * (edges[i + 1] - edges[i])
}

/// A buffer of the last frame, which was analysed.
fn table<T: bytemuck::Pod>(r: &Renderer, name: &str) -> Vec<T> {
    bytemuck::pod_collect_to_vec(&r.analysis().table(&r.gpu, name).unwrap().expect("an analysed frame"))
}

/// The warps, which must be those of the reference, rise everywhere, and lead back from each texel's centre.
fn assert_tables(r: &mut Renderer, s: &Setup, reference: &[Vec<f64>; 2], side: usize, what: &str) {
    // With the map in view there is a ray for each texel: where its centre lies before the warp, and its number.
    let s = Setup { view: "shadow-map".into(), ..s.clone() };
    r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
    let words: Vec<f32> = table(r, "warps");
    let rays: Vec<[u32; 4]> = table(r, "rays");
    assert_eq!(rays.len(), side * side, "{what}");
    for (axis, edges) in words.chunks_exact(words.len() / 2).enumerate() {
        assert_eq!(edges.len(), reference[axis].len(), "{what}");
        assert!(edges[0] == 0.0 && edges[edges.len() - 1] == 1.0, "{what}");
        assert!(edges.windows(2).all(|w| w[1] > w[0]), "{what}: axis {axis} folds");
        let off = edges.iter().zip(&reference[axis]).map(|(a, b)| (*a as f64 - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-3, "{what}: an edge of axis {axis} is off by {off} of the map's side");
        let edges: Vec<f64> = edges.iter().map(|e| *e as f64).collect();
        for ray in &rays {
            let centre = [ray[2] as usize % side, ray[2] as usize / side][axis] as f64 + 0.5;
            let again = warped(&edges, f32::from_bits(ray[axis]) as f64) * side as f64;
            assert!((again - centre).abs() < 4e-3, "{what}: axis {axis}: the ray of {centre} lands at {again}");
        }
    }
}

/// Asserts that the map's columns and rows hold the samples that these warps send there; how many samples plain rows and
/// columns would have elsewhere.
fn assert_follows(found: &Counts, at: &[DVec2], warps: &[Vec<f64>; 2], what: &str) -> f64 {
    let side = found.columns.len();
    let histogram = |axis: usize, move_it: bool| {
        let mut sums = vec![0u64; side];
        for p in at {
            let x = if move_it { warped(&warps[axis], p[axis]) } else { p[axis] };
            sums[((x * side as f64) as usize).min(side - 1)] += 1;
        }
        sums
    };
    let off = |a: &[u64], b: &[u64]| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).sum::<u64>() as f64 / 2.0;
    let total = at.len() as f64;
    assert_eq!(found.total, at.len() as u64, "{what}");
    let mut plain = 0.0;
    for (axis, sums) in [&found.columns, &found.rows].into_iter().enumerate() {
        assert!(warps[axis].windows(2).all(|w| w[1] > w[0]), "{what}: axis {axis} folds");
        assert!((warps[axis][warps[axis].len() - 1] - 1.0).abs() < 1e-9);
        let wrong = off(sums, &histogram(axis, true)) / total;
        assert!(wrong < 0.004, "{what}: {wrong} of the samples lie in other lines of axis {axis}");
        plain += off(sums, &histogram(axis, false)) / total;
    }
    plain
}

/// Backward analysis: profiles, blur, floor, sums and look-up are those of f64, for a sun and a spot.
#[test]
fn tables_follow_the_reference() {
    let lamp = Light::Spot {
        position: Vec3::new(3.0, 9.0, 2.0),
        direction: Vec3::new(-0.3, -1.0, -0.2),
        outer_angle: 40.0,
        range: 60.0,
        radius: 0.0,
        color: Vec3::splat(40.0),
    };
    let (mut r, mut s) = built_in("bench", [160, 120]);
    let sun = s.light;
    for light in [sun, lamp] {
        s.light = light;
        for (sets, bins, sigma, floor) in [
            (vec![], 256, 4.0, 0.02),
            (vec!["importance_bins=64", "profile_blur=0", "floor=0", "power=3", "distance_to_eye=false"], 64, 0.0, 0.0),
            (
                vec![
                    "importance_bins=100",
                    "profile_blur=9.5",
                    "floor=0.1",
                    "surface_normal=true",
                    "normal_weight=4",
                    "combine=sum",
                ],
                100,
                9.5,
                0.1,
            ),
            (
                vec![
                    "importance_bins=64",
                    "shadow_edge=true",
                    "edge_weight=3",
                    "edge_threshold=0.02",
                    "profile_blur=2",
                ],
                64,
                2.0,
                0.02,
            ),
            (vec!["combine=max", "falloff=inverse", "desired_view=false", "profile_blur=1"], 256, 1.0, 0.02),
        ] {
            let what = format!("{} {sets:?}", light.kind());
            let on = |set: &str, default: bool| {
                sets.iter().find_map(|s| s.strip_prefix(&format!("{set}="))).map_or(default, |v| v == "true")
            };
            select(&mut s, "rtw", &[&["resolution=256"], sets.as_slice()].concat());
            let found = counts(&mut r, &s, 256);
            let bounds = r.geometry().bounds;
            let view = LightView::whole(&light, bounds, 256, 1.0).unwrap();
            let (eye, p) = (s.camera.position.as_dvec3(), if sets.contains(&"power=3") { 3 } else { 1 });
            let [low, high] = bounds.map(|b| (b.as_dvec3() - eye).abs());
            let corner = DVec2::new(160.0 / 120.0, 1.0) * (s.camera.fov as f64 / 2.0).to_radians().tan();
            let farthest = low.max(high).length().min(corner.extend(1.0).length() * s.camera.far as f64);
            let mut importance = vec![0f64; bins * bins];
            let seen = samples(&mut r, &light, s.size);
            let at: Vec<DVec2> = seen.iter().map(|s| place(&view, s.position)).collect();
            let mut bent = 0;
            for (sample, u) in seen.iter().zip(&at) {
                let d = sample.position.distance(eye);
                let mut terms = Vec::new();
                if on("desired_view", true) {
                    terms.push(1.0);
                }
                if on("distance_to_eye", true) {
                    let inverse = sets.contains(&"falloff=inverse");
                    terms.push(if inverse { s.camera.near as f64 / d } else { 1.0 - (d / farthest).min(1.0).powi(p) });
                }
                if on("surface_normal", false) {
                    terms.push(1.0 + 4.0 * sample.normal.dot((eye - sample.position).normalize()).max(0.0));
                }
                if on("shadow_edge", false) {
                    terms.push(if sample.off > 0.02 { 4.0 } else { 1.0 });
                    bent += (sample.off > 0.02) as u32;
                }
                let value: f64 = match sets.iter().find_map(|s| s.strip_prefix("combine=")) {
                    Some("sum") => terms.iter().sum(),
                    Some("max") => terms.iter().copied().fold(0.0, f64::max),
                    _ => terms.iter().product(),
                };
                let bin = (*u * bins as f64).min(DVec2::splat(bins as f64 - 1.0));
                let cell = &mut importance[bin.y as usize * bins + bin.x as usize];
                *cell = cell.max(value);
            }
            if on("shadow_edge", false) {
                assert!(bent as usize > seen.len() / 50 && (bent as usize) < seen.len() / 2, "{what}: {bent} edges");
            }
            let reference = warps(&importance, bins, sigma, floor);
            assert_tables(&mut r, &s, &reference, 256, &what);
            let moved = assert_follows(&found, &at, &reference, &what);
            assert!(moved > 0.1, "{what}: plain lines hold the same samples");
        }
    }
}

/// A plate over a floor, lit from the zenith: forward and hybrid analysis know where its edges and the camera's frustum lie.
#[test]
fn light_side_analysis_follows_the_reference() {
    let mut triangles = floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0);
    triangles.extend(floor(Vec2::new(-2.0, -3.0), Vec2::new(2.0, 3.0), 1.0));
    let light = sun(Vec3::Y);
    let above = |height: f32| Camera { fov: 30.0, ..camera(Vec3::new(1.0, height, 0.5), Vec3::new(1.0, 0.0, 0.4)) };
    for (height, sets) in [
        (40.0, vec!["analysis=forward", "shadow_edge=true", "desired_view=false", "distance_to_eye=false"]),
        (40.0, vec!["analysis=hybrid", "shadow_edge=true", "desired_view=false", "distance_to_eye=false"]),
        (12.0, vec!["analysis=forward"]),
        (12.0, vec!["analysis=forward", "distance_to_eye=false", "surface_normal=true"]),
        (40.0, vec!["analysis=hybrid", "shadow_edge=true", "distance_to_eye=false"]),
    ] {
        let (mut r, mut s) =
            start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], above(height), light), [200, 200]);
        let common =
            ["resolution=256", "importance_bins=64", "profile_blur=0", "edge_weight=8", "normal_weight=2", "power=1"];
        select(&mut s, "rtw", &[&common[..], sets.as_slice()].concat());
        let found = counts(&mut r, &s, 256);
        let view = LightView::whole(&light, r.geometry().bounds, 256, 1.0).unwrap();
        let at: Vec<DVec2> = samples(&mut r, &light, s.size).iter().map(|s| place(&view, s.position)).collect();
        let flag = |set: &str, default: bool| {
            sets.iter().find_map(|s| s.strip_prefix(&format!("{set}="))).map_or(default, |v| v == "true")
        };
        let clip: Mat4 = s.camera.projection(1.0) * s.camera.view();
        let eye = s.camera.position.as_dvec3();
        // Bins of a quarter metre; x and z grow with the bins, as the zenith's view has −z up.
        let plate = |i: i32, j: i32| (24..40).contains(&i) && (20..44).contains(&j);
        let mut importance = vec![0f64; 64 * 64];
        for (k, cell) in importance.iter_mut().enumerate() {
            let (i, j) = (k as i32 % 64, k as i32 / 64);
            let y = plate(i, j) as u32 as f64;
            let p = DVec3::new((i as f64 + 0.5) / 4.0 - 8.0, y, (j as f64 + 0.5) / 4.0 - 8.0);
            assert!((place(&view, p) * 64.0 - DVec2::new(i as f64 + 0.5, j as f64 + 0.5)).length() < 1e-3);
            let c = clip * p.as_vec3().extend(1.0);
            let inside = c.w > 0.0 && c.x.abs() <= c.w && c.y.abs() <= c.w;
            let near = (0..9).any(|m| plate(i + m % 3 - 1, j + m / 3 - 1) != plate(i, j));
            let mut value = 1.0;
            if flag("desired_view", true) && !inside {
                value = 0.0;
            }
            let farthest =
                [-8.0, 8.0].map(|x| [0.0, 1.0].map(|y| [-8.0, 8.0].map(|z| DVec3::new(x, y, z).distance(eye))));
            let farthest = farthest.as_flattened().as_flattened().iter().copied().fold(0.0, f64::max);
            if flag("distance_to_eye", true) {
                value *= 1.0 - p.distance(eye) / farthest;
            }
            if flag("surface_normal", false) {
                value *= 1.0 + 2.0 * ((eye - p).normalize().y).max(0.0);
            }
            if flag("shadow_edge", false) && near {
                value *= 9.0;
            }
            *cell = value;
        }
        let (reference, what) = (warps(&importance, 64, 0.0, 0.02), format!("{sets:?}"));
        assert_tables(&mut r, &s, &reference, 256, &what);
        let moved = assert_follows(&found, &at, &reference, &what);
        assert!(moved > 0.02, "{sets:?}: {moved}");
    }
}

/// Without any term nothing is important, and without importance nothing is warped.
#[test]
fn no_importance_is_no_warp() {
    let (mut r, mut s) = built_in("arches", [96, 96]);
    select(&mut s, "shadow-map", &["resolution=256", "fit=scene"]);
    let plain = counts(&mut r, &s, 256);
    for analysis in ["analysis=backward", "analysis=forward", "analysis=hybrid"] {
        select(&mut s, "rtw", &["resolution=256", analysis, "desired_view=false", "distance_to_eye=false"]);
        let found = counts(&mut r, &s, 256);
        let off: u64 = found.columns.iter().zip(&plain.columns).map(|(a, b)| a.abs_diff(*b)).sum();
        assert!(off < plain.total / 200, "{analysis}: {off} of {}", plain.total);
    }
}

/// A warp errs less than an unfitted map, whatever the analysis; and a texel is found where it was drawn: exactly drawn and
/// finely split casters agree, though one inverts the warp and the other does not.
#[test]
fn it_pays_and_its_inverse_is_one() {
    for name in ["bench", "terrain"] {
        let (mut r, mut s) = built_in(name, [160, 160]);
        let whole = errors(&mut r, &mut s, "shadow-map", &["resolution=256", "fit=scene"]).share();
        for sets in [["analysis=backward", "floor=0.02"], ["analysis=forward", "shadow_edge=true"]] {
            let e = errors(&mut r, &mut s, "rtw", &[&["resolution=256"], &sets[..]].concat());
            assert!(e.share() < 0.9 * whole, "{name} {sets:?}: {} against {whole}", e.share());
        }
    }
    let (mut r, mut s) = built_in("st-contact", [128, 128]);
    let mut seen = |sets: &[&str]| {
        errors(&mut r, &mut s, "rtw", &[&["resolution=256"], sets].concat());
        r.read_visibility().unwrap()
    };
    let split = seen(&["raster=subdivide", "tolerance=0.05"]);
    let exact = seen(&["raster=exact"]);
    let differ = split.iter().zip(&exact).filter(|(a, b)| a != b).count();
    assert!(differ < split.len() / 200, "{differ} of {} pixels differ", split.len());
}

/// Long triangles go astray unless they are split or drawn exactly.
#[test]
fn exact_casters_err_least_where_triangles_are_long() {
    let (mut r, mut s) = built_in("st-longtri", [128, 128]);
    let share = |r: &mut Renderer, s: &mut Setup, raster: &str| {
        errors(r, s, "rtw", &["resolution=256", "importance_bins=128", raster]).share()
    };
    let linear = share(&mut r, &mut s, "raster=linear");
    let split = share(&mut r, &mut s, "raster=subdivide");
    let exact = share(&mut r, &mut s, "raster=exact");
    assert!(exact < 0.7 * linear && split < 0.7 * linear, "linear {linear}, split {split}, exact {exact}");
}

/// Two islands on a diagonal of the map: their rows and columns cross twice more, where nothing is. On an axis they
/// share their columns, and lines of their own for all (notw) waste less on both.
#[test]
fn a_diagonal_wastes_two_corners() {
    let (mut r, mut s) = built_in("st-diagonal", [384, 384]);
    let case = cases::find("st-diagonal").unwrap();
    let mut covered = |technique: &str, t: f32| {
        (case.place)(&mut s, t);
        select(&mut s, technique, &["resolution=64"]);
        counts(&mut r, &s, 64).used as f64 / (64.0 * 64.0)
    };
    let [diagonal, axis] = [0.0, 0.5].map(|t| covered("rtw", t));
    let lines = covered("notw", 0.0);
    assert!(diagonal < 0.9 * axis, "{diagonal} on the diagonal, {axis} on an axis");
    assert!(lines > 2.0 * diagonal, "notw {lines}, rtw {diagonal}");
}
