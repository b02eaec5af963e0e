//! Non-orthogonal texture warping against a reference on the CPU, and the raster that all warped maps share.

use crate::common::*;
use glam::{Vec2, Vec3, Vec4};
use shadowscope::capture;
use shadowscope::frame::{Ask, PieceCount, Renderer};
use shadowscope::gpu::{self, Gpu};
use shadowscope::light::{Light, LightView};
use shadowscope::measure::metrics::FACING;
use shadowscope::measure::{self};
use shadowscope::scene::builtin::cases;
use shadowscope::scene::{Clock, Mesh};
use shadowscope::setup::{Setup, parse_camera, parse_light};
use std::sync::Arc;

/// Renders with the analysis; what the casters became.
fn analysed(r: &mut Renderer, s: &Setup) -> PieceCount {
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    r.analysis().pieces(&r.gpu).unwrap().unwrap()
}

fn table<T: bytemuck::Pod>(r: &Renderer, name: &str) -> Vec<T> {
    bytemuck::pod_collect_to_vec(&r.analysis().table(&r.gpu, name).unwrap().unwrap())
}

fn counted(r: &Renderer) -> u64 {
    let mut sum = 0;
    r.analysis().counts(&r.gpu, |_, part| sum += part.iter().map(|c| *c as u64).sum::<u64>()).unwrap();
    sum
}

/// Places before the warp of the pixels that face the light, shares of the map's sides.
fn places(r: &mut Renderer) -> Vec<[f64; 2]> {
    let view: LightView = bytemuck::pod_read_unaligned(
        &r.analysis().table(&r.gpu, "light_views").unwrap().unwrap()[..size_of::<LightView>()],
    );
    let (mask, at) = (r.read_mask().unwrap(), r.read_position().unwrap());
    let facing = mask.iter().zip(at).filter(|(m, _)| **m == FACING).map(|(_, p)| p);
    let place = |p: [f32; 4]| {
        let row = |r: Vec4| r.as_dvec4().dot(Vec4::new(p[0], p[1], p[2], 1.0).as_dvec4());
        let w = row(view.row_w);
        [0.5 + 0.5 * row(view.row_x) / w, 0.5 - 0.5 * row(view.row_y) / w]
    };
    facing.map(place).collect()
}

/// What smoothing over `reach` lines to each side makes of the lines' sums: Navratil 2015, equations 4.6 to 4.8, with a
/// floor, weighted by the lines' samples or not.
fn smoothed(sums: &[f32], weights: &[f32], reach: i64, counts: bool, floor: f64) -> Vec<f64> {
    let side = weights.len();
    let total: f64 = weights.iter().map(|w| *w as f64).sum();
    let spare = floor * total / (side * side) as f64;
    let mut out = Vec::new();
    for line in 0..side as i64 {
        for edge in 0..=side {
            let (mut sum, mut all) = (0.0, 0.0);
            for k in (line - reach).max(0)..=(line + reach).min(side as i64 - 1) {
                let n = weights[k as usize] as f64;
                if n > 0.0 {
                    let own =
                        (sums[k as usize * (side + 1) + edge] as f64 + spare * edge as f64) / (n + spare * side as f64);
                    let w = if counts { n } else { 1.0 };
                    sum += w * own;
                    all += w;
                }
            }
            out.push(if all > 0.0 { sum / all } else { edge as f64 / side as f64 });
        }
    }
    out
}

/// Equation 4.9 with lines mixed between their middles, in f64.
fn warp(rows: &[f32], columns: &[f32], side: usize, u: [f64; 2]) -> [f64; 2] {
    let line = |lines: &[f32], along: f64, across: f64| {
        let at = (across * side as f64 - 0.5).clamp(0.0, side as f64 - 1.0);
        let (first, t) = (at as usize, at.fract());
        let i = ((along * side as f64) as usize).min(side - 1);
        let g = along * side as f64 - i as f64;
        let own = |l: usize| {
            let at = |e: usize| lines[l.min(side - 1) * (side + 1) + e] as f64;
            at(i) + (at(i + 1) - at(i)) * g
        };
        own(first) + (own(first + 1) - own(first)) * t
    };
    let x = line(rows, u[0], u[1]);
    [x, line(columns, u[1], x)]
}

/// Sums count the view samples, the smoothed warps are those of a reference in f64, and they rise strictly from 0 to 1.
#[test]
fn offsets_match_a_reference() {
    let side = 64;
    let (mut r, mut s) = built_in("arches", [160, 120]);
    for (sets, reach, counts, floor) in [
        (vec![], 2, true, 0.01),
        (vec!["window=0.125", "weighting=plain", "floor=0.1", "crop=none"], 8, false, 0.1),
        (vec!["window=0", "floor=0.001"], 0, true, 1e-3),
        (vec!["window=0.1", "crop=msf"], 6, true, 0.01),
    ] {
        select(&mut s, "notw", &[&["resolution=64"], sets.as_slice()].concat());
        analysed(&mut r, &s);
        let all = places(&mut r);
        let mut exact = vec![0i64; side * side];
        let cell = |x: f64| ((x * side as f64) as usize).min(side - 1);
        all.iter().for_each(|u| exact[cell(u[1]) * side + cell(u[0])] += 1);
        // All of a line's samples lie before its last edge.
        let weights_of = |sums: &[f32]| Vec::from_iter(sums.iter().skip(side).step_by(side + 1).copied());
        let sums: Vec<f32> = table(&r, "row_sums");
        let weights = weights_of(&sums);
        // Rounding may move a sample to the next texel.
        let mut off = 0;
        for (line, n) in weights.iter().enumerate().filter(|(_, n)| **n > 0.0) {
            let mut before = 0;
            for edge in 0..=side {
                off = off.max((sums[line * (side + 1) + edge] as i64 - before).abs());
                before += exact[line * side + edge.min(side - 1)] * (edge < side) as i64;
            }
            off = off.max((*n as i64 - before).abs());
        }
        assert!(off <= 3, "{sets:?}: {off} samples are counted elsewhere");
        assert_eq!(weights.iter().sum::<f32>() as usize, all.len(), "{sets:?}");
        for (lines, sums) in [("rows", "row_sums"), ("columns", "column_sums")] {
            let found: Vec<f32> = table(&r, lines);
            let sums: Vec<f32> = table(&r, sums);
            let exact = smoothed(&sums, &weights_of(&sums), reach, counts, floor);
            for (k, (a, b)) in found.iter().zip(&exact).enumerate() {
                assert!((*a as f64 - b).abs() < 2e-6, "{sets:?} {lines} {k}: {a}, not {b}");
            }
            for line in found.chunks_exact(side + 1) {
                assert!(
                    line[0] == 0.0 && line[side] == 1.0 && line.windows(2).all(|w| w[0] < w[1]),
                    "{sets:?} {line:?}"
                );
            }
        }
        // The inverse, which the raster takes each texel's ray from.
        let (rows, columns): (Vec<f32>, Vec<f32>) = (table(&r, "rows"), table(&r, "columns"));
        s.view = "shadow-map".into();
        analysed(&mut r, &s);
        s.view = "error".into();
        let mut rays: Vec<[u32; 4]> = table(&r, "rays");
        rays.sort_by_key(|ray| ray[2]);
        assert_eq!(rays.len(), side * side);
        for (k, ray) in rays.iter().enumerate() {
            assert_eq!(ray[2] as usize, k, "{sets:?}: a texel has no ray");
            let place = [ray[0], ray[1]].map(|bits| f32::from_bits(bits) as f64);
            let [x, y] = warp(&rows, &columns, side, place).map(|v| v * side as f64);
            let [cx, cy] = [(k % side) as f64 + 0.5, (k / side) as f64 + 0.5];
            assert!((x - cx).abs().max((y - cy).abs()) < 1e-3, "{sets:?}: the ray of {cx}, {cy} lands at {x}, {y}");
        }
    }
    // A tent and a window along the lines keep what makes them warps.
    for sets in
        [["kernel=tent", "window_along=0"], ["kernel=tent", "window_along=0.06"], ["kernel=box", "window_along=0.1"]]
    {
        select(&mut s, "notw", &[&["resolution=64", "window=0.1"], sets.as_slice()].concat());
        analysed(&mut r, &s);
        for lines in ["rows", "columns"] {
            for line in table::<f32>(&r, lines).chunks_exact(side + 1) {
                assert!(
                    line[0] == 0.0 && line[side] == 1.0 && line.windows(2).all(|w| w[0] < w[1]),
                    "{sets:?} {line:?}"
                );
            }
        }
    }
}

/// The warp makes texels equally busy, no facing pixel loses its texel, and without strength it is the fitted map.
#[test]
fn the_warp_evens_the_counts_out() {
    for name in ["bench", "terrain"] {
        let (mut r, mut s) = built_in(name, [160, 160]);
        let mut covered = Vec::new();
        for strength in ["strength=0", "strength=1"] {
            select(&mut s, "notw", &["resolution=128", strength]);
            let row = measure::accuracy(&mut r, &s, 0).unwrap();
            assert_eq!(counted(&r), row.facing as u64, "{name} {strength}");
            covered.push(row.covered_share.unwrap());
        }
        assert!(covered[1] > 1.5 * covered[0], "{name}: {covered:?}");
        // Exact raster draws an unwarped map as the rasteriser does.
        select(&mut s, "shadow-map", &["resolution=128"]);
        r.render(&s, ask(&s)).unwrap();
        let fitted = r.read_visibility().unwrap();
        for raster in ["raster=exact", "raster=subdivide", "raster=linear"] {
            select(&mut s, "notw", &["resolution=128", "strength=0", raster]);
            r.render(&s, ask(&s)).unwrap();
            let differ = r.read_visibility().unwrap().iter().zip(&fitted).filter(|(a, b)| a != b).count();
            assert!(differ < fitted.len() / 500, "{name} {raster}: {differ} of {} pixels differ", fitted.len());
        }
        let whole = errors(&mut r, &mut s, "shadow-map", &["resolution=128", "fit=scene"]).share();
        let warped = errors(&mut r, &mut s, "notw", &["resolution=128"]).share();
        assert!(warped < 0.8 * whole, "{name}: {warped} against {whole}");
    }
}

/// Straight edges fail where triangles are long and the warp is strong; splitting or meeting them exactly does not.
#[test]
fn long_triangles_need_more_than_corners() {
    let (mut r, mut s) = built_in("st-longtri", [192, 192]);
    let case = cases::find("st-longtri").unwrap();
    (case.place)(&mut s, 0.5);
    let mut found = Vec::new();
    for raster in ["raster=linear", "raster=subdivide", "raster=exact"] {
        let e = errors(&mut r, &mut s, "notw", &["resolution=256", raster]).share();
        found.push((e, analysed(&mut r, &s)));
    }
    println!("{found:?}");
    let [(linear, plain), (split, parts), (exact, boxes)] = found[..] else { unreachable!() };
    assert!(linear > 3.0 * split && split < 2.0 * exact + 0.002, "{linear} {split} {exact}");
    assert!(
        plain.folds + parts.folds + boxes.folds == 0,
        "the warp itself folds nothing: {plain:?} {parts:?} {boxes:?}"
    );
    assert!(plain.folded > 0 && boxes.folded == 0 && parts.drawn > plain.drawn, "{plain:?} {parts:?} {boxes:?}");
    assert!(plain.unserved + boxes.unserved == 0 && parts.unserved < parts.drawn / 20);
}

/// No light falls through the seams of a plate of unequal triangles.
#[test]
fn splitting_leaves_no_cracks() {
    let mut random = Random(5);
    let n = 12;
    let mut corners = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            let inner = i > 0 && i < n && j > 0 && j < n;
            let shift = if inner { Vec2::new(random.next() - 0.5, random.next() - 0.5) * 0.9 } else { Vec2::ZERO };
            let p = (Vec2::new(i as f32, j as f32) + shift) * 2.0 - n as f32;
            corners.push(Vec3::new(p.x, 2.0 + 0.3 * random.next(), p.y));
        }
    }
    let mut plate = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let [a, b, c, d] = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|(i, j)| corners[i * (n + 1) + j]);
            plate.extend([[a, b, c], [a, c, d]]);
        }
    }
    let ground = floor(Vec2::splat(-10.0), Vec2::splat(10.0), 0.0);
    let view = camera(Vec3::new(0.3, 1.2, 9.0), Vec3::new(0.0, 0.0, 0.0));
    let light = sun(Vec3::new(0.1, 1.0, 0.05));
    let scene = scene(vec![mesh(&ground, 0), mesh(&plate, 0)], vec![material(Vec3::ONE)], view, light);
    let (mut r, mut s) = start(scene, [200, 150]);
    for raster in ["raster=subdivide", "raster=exact"] {
        select(&mut s, "notw", &["resolution=256", raster]);
        r.render(&s, ask(&s)).unwrap();
        let (v, truth, mask, at) =
            (r.read_visibility().unwrap(), r.read_truth().unwrap(), r.read_mask().unwrap(), r.read_position().unwrap());
        let below = |i: &usize| mask[*i] == FACING && at[*i][1] < 0.5 && at[*i][0].abs().max(at[*i][2].abs()) < 9.0;
        let seen: Vec<usize> = (0..v.len()).filter(below).collect();
        assert!(seen.len() > 5000 && seen.iter().all(|i| truth[*i] == 0.0), "{}", seen.len());
        let leaks = seen.iter().filter(|i| v[**i] > 0.0).count();
        let pieces = analysed(&mut r, &s);
        assert_eq!(leaks, 0, "{raster}, {pieces:?}");
    }
}

/// More pieces than there is room for: none of a level is split further, whichever thread comes first; and rays need no
/// room for pieces.
#[test]
fn a_full_list_is_no_chance() {
    let (mut r, mut s) = built_in("st-duel", [96, 96]);
    (cases::find("st-duel").unwrap().place)(&mut s, 0.75);
    select(&mut s, "notw", &["resolution=1024", "raster=subdivide"]);
    let mut seen = Vec::new();
    for _ in 0..3 {
        r.render(&s, Ask { analysis: true, fresh: true, ..ask(&s) }).unwrap();
        let pieces = r.analysis().pieces(&r.gpu).unwrap().unwrap();
        assert!(pieces.unserved > 1000, "{pieces:?}");
        seen.push((pieces, r.read_visibility().unwrap()));
    }
    assert!(seen[0] == seen[1] && seen[0] == seen[2]);
    let folder = tempfile::tempdir().unwrap();
    let notes = capture::capture(&mut r, &s, &folder.path().join("a.png")).unwrap();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].starts_with(&format!("{} parts of triangles were not split", seen[0].0.unserved)), "{notes:?}");
    let split = errors(&mut r, &mut s, "notw", &["resolution=1024", "raster=subdivide"]).share();
    let exact = errors(&mut r, &mut s, "notw", &["resolution=1024", "raster=exact"]).share();
    assert!(exact < 0.02 && exact < 0.2 * split, "{exact} against {split}");
    assert_eq!(analysed(&mut r, &s).unserved, 0);
}

/// The adapter of the tests with less room: no more than so many bytes are bound at once.
fn small_gpu(bytes: u64) -> Arc<Gpu> {
    let limits = |f, l: wgpu::Limits| (f, wgpu::Limits { max_storage_buffer_binding_size: bytes, ..l });
    Arc::new(strict(Gpu::within(&gpu::instance(), None, None, limits).unwrap()))
}

/// More rays than there is room for: the map is made in bands, the same each time, and the same as at once.
#[test]
fn rays_without_room_go_in_bands() {
    let view = camera(Vec3::new(0.0, 4.0, 9.0), Vec3::new(0.0, 0.0, 0.5));
    let scene = || scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.4, 1.0, 0.3)));
    let (mut whole, mut s) = start(scene(), [240, 180]);
    let mut banded = Renderer::new(small_gpu(1 << 17), Arc::new(scene())).unwrap();
    for technique in ["notw", "rtw"] {
        select(&mut s, technique, &["resolution=128"]);
        for view in ["visibility", "shadow-map"] {
            s.view = view.into();
            let exact = analysed(&mut whole, &s);
            let visibility = whole.read_visibility().unwrap();
            for _ in 0..4 {
                // Some triangle is needed by texels of two bands, and counts once.
                assert_eq!(analysed(&mut banded, &s), exact, "{technique} {view}");
                assert!(banded.read_visibility().unwrap() == visibility, "{technique} {view}");
            }
            let room = table::<[u32; 4]>(&banded, "rays").len();
            let mut needed = 0;
            banded.analysis().counts(&banded.gpu, |_, part| needed += part.iter().filter(|c| **c > 0).count()).unwrap();
            assert!(room == 8192 && needed > if technique == "notw" { room } else { 0 }, "{needed} in {room}");
        }
        let dark = whole.read_visibility().unwrap().iter().filter(|v| **v == 0.0).count();
        assert!(dark > 300, "{dark}");
    }
}

/// A hill 20 km from the origin, drawn from near by: the same picture each time, and the right one.
#[test]
fn far_rays_find_room() {
    let (mut s, scene) = Setup::open("tests/data/notw-20km.glb").unwrap();
    s.camera = parse_camera(&scene, "-19994,312,5012:-20000,300,5000:50", Clock::default()).unwrap();
    s.light = parse_light(&scene, "directional:to_light=0.5,1,0.3", Clock::default()).unwrap();
    s.size = [160, 160];
    select(&mut s, "notw", &[]);
    let mut r = Renderer::new(gpu(), Arc::new(scene)).unwrap();
    let mut seen = Vec::new();
    for _ in 0..6 {
        r.render(&s, Ask { fresh: true, ..ask(&s) }).unwrap();
        let (v, truth) = (r.read_visibility().unwrap(), r.read_truth().unwrap());
        let mask = r.read_mask().unwrap();
        let facing = |of: &dyn Fn(usize) -> bool| (0..v.len()).filter(|i| mask[*i] == FACING && of(*i)).count();
        let (dark, wrong) = (facing(&|i| truth[i] == 0.0), facing(&|i| v[i] != truth[i]));
        assert!(dark > 300 && wrong <= 6, "{wrong} wrong, {dark} dark");
        seen.push(v);
    }
    assert!(seen.iter().all(|v| *v == seen[0]));
}

/// Triangles that do not all find room are not split: which ones were would be chance.
#[test]
fn too_many_triangles_are_not_split() {
    let n = 24;
    let mut ground = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            ground.positions.push(Vec3::new(i as f32, 0.0, j as f32) * 0.5 - Vec3::new(6.0, 0.0, 6.0));
            ground.normals.push(Vec3::Y);
            ground.uvs.push(Vec2::ZERO);
            if i < n && j < n {
                let [a, b, c, d] =
                    [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|(i, j)| (i * (n + 1) + j) as u32);
                ground.indices.extend([a, b, c, a, c, d]);
            }
        }
    }
    let view = camera(Vec3::new(0.0, 4.0, 9.0), Vec3::ZERO);
    let lamp = spot(Vec3::new(0.0, 6.0, 0.0), Vec3::ZERO, 40.0);
    let (_, mut s) = start(scene(vec![ground.clone()], vec![material(Vec3::ONE)], view, lamp), [64, 64]);
    let scene = scene(vec![ground], vec![material(Vec3::ONE)], view, lamp);
    let mut r = Renderer::new(small_gpu(1 << 17), Arc::new(scene)).unwrap();
    select(&mut s, "notw", &["resolution=64", "raster=subdivide"]);
    let error = r.render(&s, ask(&s)).unwrap_err().to_string();
    assert!(error.contains("1152 triangles") && error.contains("choose raster = exact"), "{error}");
    select(&mut s, "notw", &["resolution=64", "raster=exact"]);
    r.render(&s, ask(&s)).unwrap();
    // The sun cuts no triangle in two.
    s.light = sun(Vec3::Y);
    select(&mut s, "notw", &["resolution=64", "raster=subdivide"]);
    r.render(&s, ask(&s)).unwrap();
}

/// What does not change is not made again; what is timed is.
#[test]
fn warps_are_made_when_something_changed() {
    let (mut r, mut s) = built_in("bench", [64, 64]);
    select(&mut s, "notw", &["resolution=64"]);
    let passes = |r: &mut Renderer, s: &Setup, fresh| -> Vec<&'static str> {
        r.render(s, Ask { timed: true, fresh, ..ask(s) }).unwrap();
        r.collect_times(true).unwrap();
        r.timer.latest.iter().map(|p| p.0).collect()
    };
    let made = |p: &[&str]| ["prefix sums", "shadow map", "fit: receivers"].map(|n| p.contains(&n));
    assert_eq!(made(&passes(&mut r, &s, false)), [true; 3]);
    let before = r.read_visibility().unwrap();
    let kept = passes(&mut r, &s, false);
    assert!(made(&kept) == [false; 3] && kept.contains(&"resolve"), "{kept:?}");
    assert_eq!(r.read_visibility().unwrap(), before);
    // To look at the map it is drawn whole, which changes no shadow.
    s.view = "shadow-map".into();
    assert_eq!(made(&passes(&mut r, &s, false)), [true; 3]);
    assert_eq!(r.read_visibility().unwrap(), before);
    s.view = "error".into();
    assert_eq!(made(&passes(&mut r, &s, false)), [true; 3]);
    assert_eq!(r.read_visibility().unwrap(), before);
    s.set("bias=0.05", &["notw".into()]).unwrap();
    assert_eq!(made(&passes(&mut r, &s, false)), [false; 3]);
    assert_eq!(made(&passes(&mut r, &s, true)), [true; 3]);
    s.set("window=0.05", &["notw".into()]).unwrap();
    assert_eq!(made(&passes(&mut r, &s, false)), [true; 3]);
    s.camera.position.x += 0.01;
    assert_eq!(made(&passes(&mut r, &s, false)), [true; 3]);
    let Light::Directional { to_light, .. } = &mut s.light else { panic!() };
    to_light.x += 0.01;
    assert_eq!(made(&passes(&mut r, &s, false)), [true; 3]);
}
