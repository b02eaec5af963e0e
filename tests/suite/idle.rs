//! What is not looked up costs nothing: layers around a light that no pixel needs, and triangles that no face may draw.

use crate::common::*;
use glam::Vec3;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::LightView;
use shadowscope::setup::Setup;

/// The yard under a lamp high above it: few faces are looked up.
fn yard_below(size: [u32; 2]) -> (Renderer, Setup) {
    let view = camera(Vec3::new(4.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, lamp(Vec3::new(0.0, 30.0, 0.0))), size)
}

/// Brightest value of red in each layer of a shot.
fn layers_of(r: &mut Renderer, s: &Setup, pass: &'static str) -> Vec<u8> {
    let shot = r.shot(s, 0, pass).unwrap().unwrap();
    let rows = shot.layers.div_ceil(shot.columns);
    let brightest = |layer: u32| {
        let (column, row) = (layer % shot.columns, layer / shot.columns);
        // Without the lines that part layers.
        let span = |i: u32, n: u32, whole: u32| i * whole / n + 3..(i + 1) * whole / n - 2;
        let pixels = span(row, rows, shot.size[1])
            .flat_map(|y| span(column, shot.columns, shot.size[0]).map(move |x| (x, y)))
            .map(|(x, y)| shot.rgba[4 * (y * shot.size[0] + x) as usize]);
        pixels.max().unwrap()
    };
    (0..shot.layers).map(brightest).collect()
}

/// Moments of a layer that nothing looks up are never written: they stay the zeros that the texture begins with.
#[test]
fn idle_layers_are_not_filtered() {
    let (mut r, mut s) = yard_below([96, 72]);
    // All of the yard lies in one octant, and in one face of a tetrahedron.
    s.light = lamp(Vec3::new(-25.0, 30.0, 25.0));
    for (id, solid) in [("cube", ""), ("omni-atlas", "solid=octahedron"), ("omni-atlas", "solid=tetrahedron")] {
        let mut sets = vec!["resolution=128", "filter=vsm", "blur_radius=0", "mipmaps=false"];
        sets.extend((!solid.is_empty()).then_some(solid));
        select(&mut s, id, &sets);
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        // Which layer each face lies in: the w of its axis, behind eight words.
        let table = r.analysis().table(&r.gpu, "faces").unwrap().unwrap();
        let words: Vec<f32> = bytemuck::pod_collect_to_vec(&table);
        let layer = |face: usize| words[8 + 4 * face + 3] as usize;
        let faces = r.known().unwrap().faces;
        let culled = layers_of(&mut r, &s, "moments");
        let mut used = vec![false; culled.len()];
        faces.iter().enumerate().for_each(|(i, face)| used[layer(i)] |= face.is_some());
        sets.push("culling=none");
        select(&mut s, id, &sets);
        let all = layers_of(&mut r, &s, "moments");
        println!("{id} {solid}: {used:?} {culled:?} {all:?}");
        for (i, used) in used.iter().enumerate() {
            assert_eq!(culled[i] > 0, *used, "{id} {solid}: layer {i}");
            assert!(all[i] > 0, "{id} {solid}: the shot shows nothing of layer {i}");
        }
        assert!(used.iter().any(|u| !u), "{id} {solid}: {used:?}");
    }
}

/// That changes no pixel, of averaged moments and of summed ones; nor as the camera turns to faces that lay idle before.
#[test]
fn idle_layers_leave_filtered_pictures() {
    let (mut r, mut s) = yard_below([80, 60]);
    for id in ["cube", "omni-atlas", "dual-paraboloid"] {
        for filter in ["evsm", "prefiltered-soft"] {
            for position in [Vec3::new(0.0, 30.0, 0.0), Vec3::new(-0.4, 2.5, 2.0)] {
                s.light = lamp(position);
                let mut pictures = ["none", "samples"].map(|culling| {
                    select(&mut s, id, &["resolution=128", &format!("filter={filter}"), &format!("culling={culling}")]);
                    r.render(&s, ask(&s)).unwrap();
                    r.read_visibility().unwrap()
                });
                let [none, samples] = &mut pictures;
                assert!(none == samples, "{id} {filter} {position}");
                assert!(none.iter().any(|v| *v < 0.5), "{id} {filter} {position}: no shadow");
            }
        }
    }
}

/// A warp is made for those layers alone that some pixel looks up.
#[test]
fn idle_layers_have_no_warp() {
    let (mut r, mut s) = yard_below([96, 72]);
    for analysis in ["backward", "hybrid"] {
        select(&mut s, "rtw-cube", &["resolution=128", "importance_bins=64", &format!("analysis={analysis}")]);
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        let warps: Vec<f32> = bytemuck::pod_collect_to_vec(&r.analysis().table(&r.gpu, "warps").unwrap().unwrap());
        let faces = r.known().unwrap().faces;
        assert!(faces.iter().any(|f| f.is_none()), "{faces:?}");
        for (i, (face, edges)) in faces.iter().zip(warps.chunks(2 * 65)).enumerate() {
            assert_eq!(face.is_some(), edges.iter().any(|e| *e != 0.0), "{analysis} {i}: {face:?}");
        }
    }
}

/// Faces leave whole clusters out, and not one triangle with them that their maps need.
#[test]
fn clusters_leave_the_picture() {
    let (mut r, mut s) = built_in("blocks", [96, 72]);
    let light = shadowscope::light::Light::Omni {
        position: Vec3::new(-1.6, 2.6, 1.5),
        range: 16.0,
        radius: 0.0,
        color: Vec3::ONE,
    };
    s.light = light;
    for (id, solid) in [
        ("cube", ""),
        ("omni-atlas", "solid=octahedron"),
        ("omni-atlas", "solid=tetrahedron"),
        ("dual-paraboloid", "raster=linear"),
    ] {
        let mut seen: Option<Vec<f32>> = None;
        let mut asked = Vec::new();
        for culling in ["none", "casters", "view", "samples"] {
            let culling = format!("culling={culling}");
            let mut sets = vec!["resolution=256", culling.as_str()];
            sets.extend((!solid.is_empty()).then_some(solid));
            select(&mut s, id, &sets);
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let visibility = r.read_visibility().unwrap();
            assert!(seen.as_ref().is_none_or(|seen| *seen == visibility), "{id} {solid} {culling}");
            seen = Some(visibility);
            // Where nothing is culled nothing is listed: each face asks for all.
            let Some(list) = r.analysis().table(&r.gpu, "listed_clusters").unwrap() else {
                let clusters = r.geometry().triangles.len().div_ceil(64) as u32;
                asked.push(clusters * r.known().unwrap().faces.len() as u32);
                continue;
            };
            let list: Vec<u32> = bytemuck::pod_collect_to_vec(&list);
            // Of each cluster that is listed the faces, a bit each.
            asked.push((0..list[3] as usize).map(|k| list[5 + 2 * k].count_ones()).sum::<u32>());
        }
        println!("{id} {solid}: {asked:?} clusters asked by faces");
        assert!(4 * asked[1] < 3 * asked[0] && asked[3] <= asked[1], "{id} {solid}: {asked:?}");
    }
}

/// Of the light views in use how much of a face or side each holds: the scale of its image in x.
fn scales(r: &mut Renderer, s: &Setup) -> Vec<f32> {
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    let views = r.analysis().table(&r.gpu, "light_views").unwrap().unwrap();
    let faces = r.known().unwrap().faces;
    let scale = |v: &LightView| match v.perspective {
        LightView::PARABOLOID => v.row_z.z,
        _ => (v.row_x - v.row_w * v.row_x.truncate().dot(v.row_w.truncate()) / v.row_w.truncate().length_squared())
            .truncate()
            .length(),
    };
    let views: Vec<LightView> = bytemuck::pod_collect_to_vec(&views);
    views.iter().zip(&faces).filter(|(_, face)| face.is_some()).map(|(v, _)| scale(v)).collect()
}

/// What the camera can see of the hull is at most the whole face, and holds all view samples.
#[test]
fn crops_around_a_lamp_are_nested() {
    let (mut r, mut s) = yard_below([96, 72]);
    for position in [Vec3::new(0.0, 30.0, 0.0), Vec3::new(1.5, 2.5, 1.0), Vec3::new(3.0, 1.0, 7.0)] {
        s.light = lamp(position);
        for id in ["notw-cube", "notw-paraboloid"] {
            let [none, msf, dv] = ["none", "msf", "dv"].map(|crop| {
                select(&mut s, id, &["resolution=64", "strength=0", &format!("crop={crop}")]);
                scales(&mut r, &s)
            });
            println!("{id} {position}: {none:?} {msf:?} {dv:?}");
            let holds = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| *a <= 1.001 * b);
            assert!(none.len() == msf.len() && none.len() == dv.len() && !none.is_empty());
            assert!(holds(&none, &msf) && holds(&msf, &dv), "{id} {position}: {none:?} {msf:?} {dv:?}");
            assert!(position.y < 30.0 || msf[0] > 2.0 * none[0], "{id} {position}: {none:?} {msf:?}");
        }
    }
}

/// Forward analysis finds what the light sees, in each layer only what is looked up there: where view samples are lit it agrees with
/// the backward one. Hybrid analysis adds the shadows' edges.
#[test]
fn importance_is_found_in_the_lights_own_maps() {
    let (mut r, mut s) = yard_below([160, 120]);
    s.light = lamp(Vec3::new(1.5, 2.5, 1.0));
    let bins = 64usize;
    for id in ["rtw-cube", "rtw-paraboloid"] {
        let mut importance = |sets: &[&str]| {
            let mut all = vec!["resolution=64", "importance_bins=64", "distance_to_eye=false"];
            all.extend(sets);
            select(&mut s, id, &all);
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let table = r.analysis().table(&r.gpu, "importance_map").unwrap().unwrap();
            bytemuck::pod_collect_to_vec::<u8, f32>(&table)
        };
        let [backward, forward, hybrid] = [
            importance(&["analysis=backward"]),
            importance(&["analysis=forward"]),
            importance(&["analysis=hybrid", "shadow_edge=true", "edge_weight=2"]),
        ];
        let count = |of: &dyn Fn(usize) -> bool| (0..backward.len()).filter(|i| of(*i)).count();
        let found = count(&|i| backward[i] > 0.0);
        let both = count(&|i| backward[i] > 0.0 && forward[i] > 0.0);
        let more = count(&|i| forward[i] > 0.0 && backward[i] == 0.0);
        let edges = count(&|i| hybrid[i] > 2.0);
        println!("{id}: {found} bins backward, {both} of them forward, {more} more; {edges} at edges");
        assert!(both as f64 > 0.7 * found as f64 && more > 0, "{id}: {both} of {found}");
        assert!((0..backward.len()).all(|i| (hybrid[i] > 0.0) == (backward[i] > 0.0)), "{id}");
        assert!(edges > 10 && edges < found, "{id}: {edges} of {found}");
        // A side ends at the circle of its rim: beyond it lies the other one's.
        let views: Vec<LightView> =
            bytemuck::pod_collect_to_vec(&r.analysis().table(&r.gpu, "light_views").unwrap().unwrap());
        if views[0].perspective == LightView::PARABOLOID {
            for (i, v) in forward.iter().enumerate().filter(|(_, v)| **v > 0.0) {
                let [x, y, z, w] = views[i / (bins * bins)].row_z.to_array();
                let at = [i % bins, i % (bins * bins) / bins].map(|k| 2.0 * (k as f32 + 0.5) / bins as f32 - 1.0);
                let (a, b) = (at[0] / z + x, -at[1] / w + y);
                assert!(a.hypot(b) < 1.01, "{id}: importance {v} at {a}, {b}");
            }
        }
    }
}
