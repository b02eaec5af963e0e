//! Summed-area tables against sums on the CPU, and the soft shadows that they serve against closed forms.

use crate::common::*;
use crate::filters_pcf::{lamp, lit_floor, looked_up, penumbra, sheets, under_a_lid, wide_lights};
use crate::light_size::wide_sun;
use crate::moments::{leaks, probe, with_probe};
use glam::{Vec2, Vec3};
use shadowscope::frame::{Ask, MapLayer, Renderer};
use shadowscope::gpu::{Pass, Recorder, Resource, Timer, texture};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::params::{Value, Values};
use shadowscope::setup::Setup;
use shadowscope::techniques;
use shadowscope::truth::Samples;

/// Which moments are kept, for probes.
fn kind(name: &str) -> Values {
    Values::from([("soft_kind".into(), Value::Text(name.into())), ("max_box".into(), Value::Int(64))])
}

const CASTERS: &str = "//!include map/single.wgsl
//!include map/filter/prefiltered_soft.wgsl
//!include store/rgba32uint.wgsl

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&given) {
        // Depths in pairs with their shares.
        let d = given[id.x];
        let rest = 1.0 - d.y - d.w;
        let m = d.y * moments(d.x) + d.w * moments(d.z) + rest * moments(second[id.x].y);
        probed[id.x] = vec4f(casters_before(m, second[id.x].x), 0.0, 0.0);
    }
}
";

/// The mean depth of casters in one layer over a receiver is exact with four moments, and with two too near by the shape of
/// Chebyshev's inequality; with two layers of casters both are too near, four moments less.
#[test]
fn casters_have_the_mean_that_the_moments_tell() {
    // {0.3: 1/4, 0.8: 3/4}, and {0.2: 0.2, 0.6: 0.3, 0.8: 0.5}, both before 0.78.
    let given = [[0.3, 0.25, 0.8, 0.75], [0.2, 0.2, 0.6, 0.3]];
    let second = [[0.78, 0.8, 0.0, 0.0], [0.78, 0.8, 0.0, 0.0]];
    for (name, wanted) in [("mssm", [0.3, 0.346]), ("vssm", [0.229, 0.298])] {
        let found = probe(CASTERS, "prefiltered-soft", &kind(name), &given, &second);
        for (f, wanted) in found.iter().zip(wanted) {
            println!("{name}: share {}, mean depth {}, not {wanted}", f[0], f[1]);
            assert!((f[1] - wanted).abs() < 1e-3, "{name}: {f:?}, not {wanted}");
        }
    }
}

const SUMS: &str = "//!include map/single.wgsl
//!include map/filter/prefiltered_soft.wgsl
//!include store/rgba32uint.wgsl
var<storage, read_write> exact: array<vec4u>;

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&given) {
        let g = given[id.x];
        let side = i32(summed.side);
        let low = vec2i(floor(g.xy - g.zw));
        let high = vec2i(floor(g.xy + g.zw));
        exact[id.x] = sum_before(high, 0u, side) - sum_before(vec2i(low.x, high.y), 0u, side)
            - sum_before(vec2i(high.x, low.y), 0u, side) + sum_before(low, 0u, side);
        probed[id.x] = mean_of_box(g.xy, g.zw, 0u, f32(summed.side));
    }
}
";

/// Sums of boxes are those of their texels, to the last bit, though the table's own sums do not fit it; and means count the texels
/// that a box cuts by their share, and 1 beyond the map.
#[test]
fn sums_of_boxes_are_exact() {
    // The map fills a part of its layer, and no whole number of threads' pieces.
    let (width, side, widest) = (256, 200_usize, 64);
    let one = (4_294_967_040.0_f32 / (widest * widest) as f32).floor() as u32;
    let mut random = Random(3);
    let texels: Vec<[u32; 4]> =
        (0..width * width).map(|_| [0; 4].map(|_| (random.next() * one as f32) as u32)).collect();
    let mut boxes: Vec<[f32; 4]> = (0..2000)
        .map(|_| {
            let [x, y] = [random.next(), random.next()].map(|x| x * side as f32);
            [x, y, 0.5 + 31.5 * random.next(), 0.5 + 31.5 * random.next()]
        })
        .collect();
    boxes.extend([[0.0, 0.0, 0.5, 0.5], [199.99, 0.2, 0.5, 32.0], [100.0, 100.0, 32.0, 32.0], [100.3, 99.7, 0.5, 0.5]]);

    let (gpu, _folder) = with_probe(SUMS);
    let groups = techniques::find("prefiltered-soft").unwrap().params;
    let usage =
        wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let made = |label| texture(&gpu, label, [width as u32, width as u32, 1], 1, wgpu::TextureFormat::Rgba32Uint, usage);
    let (table, scratch) = (made("table"), made("scratch"));
    gpu.queue.write_texture(
        table.as_image_copy(),
        bytemuck::cast_slice(&texels),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width as u32), rows_per_image: None },
        table.size(),
    );
    let view = |t: &wgpu::Texture, dimension| {
        t.create_view(&wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() })
    };
    let flat = |t| view(t, wgpu::TextureViewDimension::D2);
    let buffer = |bytes: &[u8]| gpu.buffer("probed", bytes, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let summed = [0_u32, 1].map(|down| {
        let words = [0, side as u32, down, 0];
        gpu.buffer("summed", bytemuck::cast_slice(&words), wgpu::BufferUsages::UNIFORM)
    });
    let (exact, probed) = (buffer(&vec![0; boxes.len() * 16]), buffer(&vec![0; boxes.len() * 16]));
    let sum = Pass::compute(&gpu, "sum", "probe.wgsl", "sum_up", groups).unwrap();
    let read = Pass::compute(&gpu, "probe", "probe.wgsl", "probe", groups).unwrap();
    let mut timer = Timer::new(&gpu);
    let mut recorder = Recorder::new(&gpu, &mut timer, false, [1, 1]);
    for group in groups {
        let words =
            gpu.buffer(group.name, bytemuck::cast_slice(&group.words(&kind("mssm"))), wgpu::BufferUsages::UNIFORM);
        recorder.set(group.name, &words);
    }
    for (uniform, from, to) in [(&summed[0], &table, &scratch), (&summed[1], &scratch, &table)] {
        let run = recorder.run(&sum).bind("summed", uniform).bind("unsummed", &flat(from));
        run.bind("moments_out", &flat(to)).dispatch(side as u32, 1, 1);
    }
    let bound: Vec<(&'static str, Resource)> = vec![
        ("summed", (&summed[0]).into()),
        ("sums_map", (&view(&table, wgpu::TextureViewDimension::D2Array)).into()),
        ("given", (&buffer(bytemuck::cast_slice(&boxes))).into()),
        ("exact", (&exact).into()),
        ("probed", (&probed).into()),
    ];
    recorder.run(&read).bind_all(&bound).dispatch((boxes.len() as u32).div_ceil(64), 1, 1);
    recorder.finish().unwrap();
    let exact: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&exact).unwrap());
    let means: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&probed).unwrap());

    let total: u64 = (0..side).flat_map(|y| &texels[y * width..y * width + side]).map(|t| u64::from(t[0])).sum();
    assert!(total > 4 << 32, "{total} would fit");
    // The basis of the four moments maps depth 1 to these.
    let beyond = probe(BEYOND, "prefiltered-soft", &kind("mssm"), &[[0.0; 4]], &[[0.0; 4]])[0];
    let mut outside = 0;
    for ((b, exact), mean) in boxes.iter().zip(&exact).zip(&means) {
        let [low, high] = [[b[0] - b[2], b[1] - b[3]], [b[0] + b[2], b[1] + b[3]]];
        let range = |a: usize| (low[a].floor() as i64, high[a].floor() as i64);
        let within = |x: i64| x.clamp(0, side as i64) as usize;
        let ((x0, x1), (y0, y1)) = (range(0), range(1));
        let (mut whole, mut cut, mut inside) = ([0_u64; 4], [0.0_f64; 4], 0.0_f64);
        for y in within(y0)..within(y1 + 1) {
            for x in within(x0)..within(x1 + 1) {
                let t = texels[y * width + x];
                let share = |a: usize, i: usize| {
                    let (low, high) = (f64::from(low[a]), f64::from(high[a]));
                    (high.min(i as f64 + 1.0) - low.max(i as f64)).max(0.0)
                };
                let share = share(0, x) * share(1, y);
                inside += share;
                for i in 0..4 {
                    whole[i] += u64::from(t[i]) * u64::from((x as i64) < x1 && (y as i64) < y1);
                    cut[i] += f64::from(t[i]) * share;
                }
            }
        }
        assert_eq!(whole.map(|w| u32::try_from(w).unwrap()), *exact, "{b:?}");
        let area = f64::from(high[0] - low[0]) * f64::from(high[1] - low[1]);
        outside += u32::from(inside < 0.99 * area);
        for i in 0..4 {
            let wanted = cut[i] / f64::from(one) / area + (1.0 - inside / area) * f64::from(beyond[i]);
            assert!((f64::from(mean[i]) - wanted).abs() < 1e-6, "{b:?}: {mean:?}, not {wanted}");
        }
    }
    assert!(outside > 200, "{outside} boxes reach over the border");
}

const BEYOND: &str = "//!include map/single.wgsl
//!include map/filter/prefiltered_soft.wgsl
//!include store/rgba32uint.wgsl

@compute @workgroup_size(1)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    probed[id.x] = moments(1.0) + given[id.x] + second[id.x];
}
";

/// Under a straight edge the penumbra is as wide as similar triangles have it, by either kind of moments, in one map and in
/// others, and the views say so.
#[test]
fn penumbras_are_as_wide_as_the_closed_form() {
    let by_sun = |angle: f32, height: f32| 2.0 * angle.to_radians().tan() * height;
    let by_lamp = |lamp: f32, radius: f32, height: f32| 2.0 * radius * height / (lamp - height);
    for (light, height, width) in [
        (wide_sun(Vec3::Y, 3.0), 1.0, by_sun(3.0, 1.0)),
        (wide_sun(Vec3::Y, 3.0), 2.0, by_sun(3.0, 2.0)),
        (wide_sun(Vec3::Y, 1.5), 4.0, by_sun(1.5, 4.0)),
        (lamp(4.0, 0.15), 1.0, by_lamp(4.0, 0.15, 1.0)),
        (lamp(8.0, 0.1), 4.0, by_lamp(8.0, 0.1, 4.0)),
    ] {
        let (mut r, mut s) = under_a_lid(light, height);
        for name in ["mssm", "vssm"] {
            let soft_kind = format!("soft_kind={name}");
            let own = ["resolution=512", "soft_bleeding=0", &soft_kind];
            for (technique, sets) in [
                ("prefiltered-soft", &own[..]),
                ("pssm", &[&own[..], &["filter=prefiltered-soft", "cascades=2", "fit=stable"]].concat()),
                ("lispsm", &[&own[..], &["filter=prefiltered-soft", "strength=0.5"]].concat()),
            ] {
                select(&mut s, technique, sets);
                let measured = penumbra(&mut r, &s);
                println!("{technique} {name} {} {height}: {measured:.6}, {width:.6}", light.kind());
                let off = measured / f64::from(width) - 1.0;
                assert!(off.abs() < 0.025, "{technique} {name} {light:?}, {height} m: {measured} instead of {width}");
            }
            // Its views say the same in the middle.
            select(&mut s, "prefiltered-soft", &own);
            let middle = (s.size[1] / 2 * s.size[0] + s.size[0] / 2) as usize;
            s.view = "penumbra-width".into();
            r.render(&s, ask(&s)).unwrap();
            let shown = r.read_map().unwrap()[middle];
            assert!(
                (shown / width - 1.0).abs() < 0.01,
                "{name} {light:?}, {height} m: {shown} shown instead of {width}"
            );
            s.view = "blocker-depth".into();
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let shown = r.read_map().unwrap()[middle];
            let v = r.read_layer(0).unwrap().unwrap().view;
            let depth = v.axis.dot(Vec3::new(0.0, height, 0.0).extend(1.0));
            let depth = (depth - v.near) / (v.far - v.near);
            assert!((shown - depth).abs() < 5e-3, "{name} {light:?}: {shown}, not {depth}");
            s.view = "shaded".into();
        }
    }
}

/// Under two sheets the mean depth of the casters in the search's box, of the view, is nearer to that of the texels by four moments
/// than by two.
#[test]
fn four_moments_tell_depths_better() {
    let angle = 3.0_f32;
    let (mut r, mut s) = sheets(wide_sun(Vec3::new(0.2, 1.0, 0.1), angle));
    s.view = "blocker-depth".into();
    let off = ["vssm", "mssm"].map(|name| {
        select(&mut s, "prefiltered-soft", &[&format!("soft_kind={name}"), "box_bias=1", "resolution=256"]);
        let (all, maps) = looked_up(&mut r, &s, 40.0);
        let (shown, map) = (r.read_map().unwrap(), &maps[0]);
        let v = &map.view;
        let length = |row: glam::Vec4| f64::from(row.truncate().length());
        let density = [v.row_x, v.row_y].map(|row| 0.5 * f64::from(map.side) * length(row));
        let (mut n, mut sum) = (0.0, 0.0);
        for p in &all {
            let share = shown[(p.pixel[1] * s.size[0] + p.pixel[0]) as usize];
            // A square as large as the disc that the sun takes of the near plane.
            let radius = f64::from(angle.to_radians().tan()) * (p.depth - f64::from(v.near));
            let half = density.map(|d| 0.5 * std::f64::consts::PI.sqrt() * radius * d);
            let (mut casters, mut depth) = (0.0, 0.0);
            let range = |a: usize| (p.texel[a] - half[a]).floor() as i64..=(p.texel[a] + half[a]).floor() as i64;
            for y in range(1) {
                for x in range(0) {
                    let share = |a: usize, i: i64| {
                        (p.texel[a] + half[a]).min(i as f64 + 1.0) - (p.texel[a] - half[a]).max(i as f64)
                    };
                    if let Some(z) = p.caster(map, [x, y]) {
                        casters += share(0, x) * share(1, y);
                        depth += share(0, x) * share(1, y) * z;
                    }
                }
            }
            // Where there is enough to tell a mean of.
            if casters > 0.1 * 4.0 * half[0] * half[1] && share >= 0.0 {
                let metres = f64::from(v.near) + f64::from(share) * f64::from(v.far - v.near);
                n += 1.0;
                sum += (metres - depth / casters).powi(2);
            }
        }
        println!("{name}: {} m off over {n} pixels", f64::sqrt(sum / n));
        assert!(n > 150.0, "{n}");
        f64::sqrt(sum / n)
    });
    assert!(off[1] < 0.5 * off[0] && off[1] < 0.1, "{off:?}");
}

/// Through two lattices four moments let less light than two.
#[test]
fn four_moments_leak_less_than_two() {
    let (mut r, mut s) = built_in("st-fence", [400, 250]);
    for angle in [0.25, 1.0] {
        s.light = wide_sun(Vec3::new(-0.51, 0.848, 0.14), angle);
        let [two, four] = ["vssm", "mssm"].map(|name| {
            select(&mut s, "prefiltered-soft", &[&format!("soft_kind={name}"), "resolution=2048"]);
            leaks(&s, &mut r)
        });
        println!("{angle}: {two:?}, {four:?}");
        assert!(four.0 < two.0 && four.1 < two.1, "{angle}°: {two:?}, {four:?}");
    }
}

/// A floor alone stays lit, though wide boxes reach over much of its slope.
#[test]
fn a_floor_stays_lit() {
    let narrow = wide_sun(Vec3::new(0.9, 1.0, 0.3), 1.0);
    for light in [narrow].into_iter().chain(wide_lights()) {
        let (mut r, mut s) = lit_floor(light);
        for (technique, set) in [
            ("prefiltered-soft", "soft_kind=vssm"),
            ("prefiltered-soft", "soft_kind=mssm"),
            ("pssm", "filter=prefiltered-soft"),
        ] {
            for plane in ["receiver_plane=false", "receiver_plane=true"] {
                select(&mut s, technique, &[set, plane]);
                r.render(&s, ask(&s)).unwrap();
                let (v, mask) = (r.read_visibility().unwrap(), r.read_mask().unwrap());
                let lit: Vec<f32> = v.iter().zip(&mask).filter(|(_, m)| **m == FACING).map(|(v, _)| *v).collect();
                let least = lit.iter().copied().fold(1.0, f32::min);
                let mean = lit.iter().sum::<f32>() / lit.len() as f32;
                println!("{technique} {set} {plane}: {mean:.5}, least {least:.3} {light:?}");
                assert!(
                    mean > 0.998 && least > 0.95,
                    "{technique} {set} {plane} {light:?}: {mean} lit, down to {least}"
                );
            }
        }
    }
}

/// A table over a floor, half of it under a sheet: the boxes of what lies near the table's border hold the floor far behind.
fn table(light: Light) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    triangles.extend(floor(Vec2::splat(-1.2), Vec2::splat(1.2), 2.0));
    triangles.extend(floor(Vec2::new(-3.0, -3.0), Vec2::new(0.1, 3.0), 3.0));
    let view = camera(Vec3::new(5.0, 6.0, 4.0), Vec3::new(0.3, 1.0, 0.0));
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [96, 72])
}

/// Depths from 0 to 1 of the texels of a box, and the shares of the box that they take.
fn texels_of_box(map: &MapLayer, centre: [f64; 2], half: f64) -> Vec<(f64, f64)> {
    let [low, high] = [-half, half].map(|to| centre.map(|c| c + to));
    let range = |a: usize| low[a].floor() as i64..=high[a].floor() as i64;
    let (near, far) = (f64::from(map.view.near), f64::from(map.view.far));
    let mut all = Vec::new();
    for y in range(1) {
        for x in range(0) {
            let share = |a: usize, i: i64| (high[a].min(i as f64 + 1.0) - low[a].max(i as f64)).max(0.0);
            // What is empty lies at the far plane.
            let metres = map.metres((y * i64::from(map.side) + x) as usize).map_or(far, f64::from);
            all.push(((metres - near) / (far - near), share(0, x) * share(1, y) / (4.0 * half * half)));
        }
    }
    all
}

/// Summed-area variance shadow maps bound the light by the moments of the box that is asked for; boxes whose mean lies behind the
/// receiver are cut, and come closer to what comparisons of their texels give.
#[test]
fn cut_boxes_are_closer_to_their_texels() {
    let (width, widest) = (24.0, 64);
    let least = 1.0 / (4_294_967_040.0 / f64::from(widest * widest)).floor();
    let bound = |texels: &[(f64, f64)], t: f64| {
        let [mean, square] = [1, 2].map(|n| texels.iter().map(|(z, w)| z.powi(n) * w).sum::<f64>());
        let variance = (square - mean * mean).max(least);
        (mean, if t <= mean { 1.0 } else { variance / (variance + (t - mean).powi(2)) })
    };
    let (mut r, mut s) = table(sun(Vec3::Y));
    let off = [1_u32, 2, 4].map(|k| {
        let sets = [
            "soft_kind=savsm",
            "bias_kind=none",
            "fit=scene",
            "resolution=96",
            &format!("box_width={width}"),
            &format!("max_box={widest}"),
            &format!("subdivision={k}"),
        ];
        select(&mut s, "prefiltered-soft", &sets);
        let (all, maps) = looked_up(&mut r, &s, 0.5 * width + 1.0);
        let (mut sum, mut cut) = (0.0, 0);
        for p in &all {
            let map = &maps[p.layer];
            let (near, far) = (f64::from(map.view.near), f64::from(map.view.far));
            let t = (p.depth - near) / (far - near);
            let texels = texels_of_box(map, p.texel, 0.5 * width);
            let (mean, whole) = bound(&texels, t);
            // Flat receivers come out the same either way.
            if (mean - t).abs() < 1e-5 {
                continue;
            }
            let parts = (0..k * k).map(|i| {
                let at = [i % k, i / k].map(|c| (2.0 * f64::from(c) + 1.0) / f64::from(k) - 1.0);
                let centre = [0, 1].map(|a| p.texel[a] + 0.5 * width * at[a]);
                bound(&texels_of_box(map, centre, 0.5 * width / f64::from(k)), t).1
            });
            let wanted = if mean > t { parts.sum::<f64>() / f64::from(k * k) } else { whole };
            assert!((p.visibility - wanted).abs() < 2e-3, "{k}: {} at {:?}, not {wanted}", p.visibility, p.texel);
            if mean > t {
                let compared: f64 = texels.iter().filter(|(z, _)| *z > t - 0.01).map(|(_, w)| w).sum();
                sum += (p.visibility - compared).powi(2);
                cut += 1;
            }
        }
        println!("{k}: {} over {cut} pixels", f64::sqrt(sum / f64::from(cut)));
        assert!(cut > 100, "{cut}");
        f64::sqrt(sum / f64::from(cut))
    });
    assert!(off[1] < 0.7 * off[0] && off[2] < 0.5 * off[0], "{off:?}");
}

/// On a scene of many surfaces, whose boxes often have a mean behind the receiver, cutting them brings either kind closer to the truth.
#[test]
fn cut_boxes_err_less() {
    let (mut r, mut s) = built_in("bench", [112, 63]);
    s.camera = r.scene().cameras.iter().find(|c| c.name == "bench-side").unwrap().camera;
    s.light = wide_sun(Vec3::new(-0.744, 0.408, -0.527), 1.0);
    s.truth_samples = Samples::Fixed(16);
    for name in ["vssm", "mssm"] {
        let [whole, cut] = [1, 4].map(|k| {
            let sets = [format!("soft_kind={name}"), format!("subdivision={k}")];
            select(&mut s, "prefiltered-soft", &sets.each_ref().map(String::as_str));
            r.render(&s, ask(&s)).unwrap();
            let (v, truth, mask) = (r.read_visibility().unwrap(), r.read_truth().unwrap(), r.read_mask().unwrap());
            let facing: Vec<usize> = (0..v.len()).filter(|i| mask[*i] == FACING).collect();
            (facing.iter().map(|i| (v[*i] - truth[*i]).powi(2)).sum::<f32>() / facing.len() as f32).sqrt()
        });
        println!("{name}: {whole}, cut {cut}");
        assert!(cut < 0.98 * whole, "{name}: {cut}, whole {whole}");
    }
}
