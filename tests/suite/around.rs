//! Maps of lights that shine in all directions: the faces' geometry on the CPU, and what the GPU makes of them.

use crate::common::*;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::{Light, LightView};
use shadowscope::map::faces::frame_of;
use shadowscope::map::fit::faces::{Around, Face};
use shadowscope::setup::Setup;
use shadowscope::techniques;

fn around(side: f64, guard: f64) -> Around {
    Around { light: DVec3::new(0.3, -1.2, 2.0), near: 0.05, far: 30.0, side, guard, metres: 0.0 }
}

/// All solids, by name.
fn solids(a: &Around) -> Vec<(&'static str, Vec<Face>)> {
    let frame = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.4);
    let back = DMat3::from_cols(-frame.x_axis, frame.y_axis, -frame.z_axis);
    let skew = DMat3::from_rotation_y(0.6) * DMat3::from_rotation_x(-0.2);
    let mirrored = DMat3::from_cols(frame.x_axis, frame.y_axis, -frame.z_axis);
    let sides = |frames: [DMat3; 2], cut| (0..2).map(|i| a.paraboloid(frames[i], cut, i as u32)).collect::<Vec<_>>();
    vec![
        ("cube", a.cube()),
        ("octahedron", a.octahedron()),
        ("tetrahedron", a.tetrahedron()),
        ("paraboloids", sides([frame, back], DMat3::IDENTITY)),
        ("skewed paraboloids", sides([frame, mirrored], skew)),
    ]
}

/// The place of a direction from the light in a face's map, texels, and whether it lies before it; as `light_clip` and
/// `light_texel` in WGSL.
fn place(v: &LightView, light: DVec3, direction: DVec3) -> Option<DVec2> {
    let p = (light + direction).extend(1.0);
    let dot = |row: glam::Vec4| row.as_dvec4().dot(p);
    let clip = if v.perspective == LightView::PARABOLOID {
        let q = DVec3::new(dot(v.row_x), dot(v.row_y), dot(v.axis));
        let w = q.length() + q.z;
        let part = v.row_z.as_dvec4();
        DVec3::new((q.x - part.x * w) * part.z, (q.y - part.y * w) * part.w, w)
    } else {
        DVec3::new(dot(v.row_x), dot(v.row_y), dot(v.row_w))
    };
    let half = v.resolution as f64 / 2.0;
    (clip.z > 0.0).then(|| DVec2::new(half * (1.0 + clip.x / clip.z), half * (1.0 - clip.y / clip.z)))
}

fn directions(count: usize) -> Vec<DVec3> {
    let mut random = Random(11);
    let mut all = Vec::new();
    while all.len() < count {
        let p = random.point().as_dvec3();
        if (0.01..1.0).contains(&p.length_squared()) {
            all.push(p.normalize());
        }
    }
    all
}

fn face_of(faces: &[Face], direction: DVec3) -> &Face {
    faces.iter().max_by(|a, b| a.axis.dot(direction).total_cmp(&b.axis.dot(direction))).unwrap()
}

/// Every direction lies in its face's map and its part of the layer, a guard band away from the borders.
#[test]
fn every_direction_has_a_place() {
    for guard in [1.0, 7.0, 20.0] {
        let a = around(256.0, guard);
        for (name, faces) in solids(&a) {
            let mut nearest = f64::INFINITY;
            for direction in directions(20_000) {
                let face = face_of(&faces, direction);
                let at = place(&face.view, a.light, direction).unwrap_or_else(|| panic!("{name}: {direction}"));
                let mut free = at.min_element().min((DVec2::splat(a.side) - at).min_element());
                for e in face.region.iter().map(|e| e.as_dvec4()).filter(|e| e.x != 0.0) {
                    free = free.min((e.x * at.x + e.y * at.y + e.z) / DVec2::new(e.x, e.y).length());
                }
                nearest = nearest.min(free);
            }
            // Axes a hair off their faces' move halves of a tetrahedron's by a fraction of a texel.
            assert!(nearest > guard - 0.05, "{name}: {nearest} texels free of {guard}");
            // Not more than it needs, where faces meet.
            let most = if name == "tetrahedron" { 2.0 * guard + 3.0 } else { guard + 3.0 };
            assert!(nearest < most, "{name}: {nearest} texels free of {guard}");
        }
    }
}

/// The largest extent and the largest area of a texel seen from the light, on a sphere of radius 1.
fn largest(a: &Around, faces: &[Face]) -> [f64; 2] {
    let mut found = [0f64; 2];
    for direction in directions(60_000) {
        let view = &face_of(faces, direction).view;
        let t = direction.any_orthonormal_vector();
        let step = |t: DVec3| {
            let h = 1e-5;
            let at = |s: f64| place(view, a.light, (direction + t * s).normalize()).unwrap();
            (at(h) - at(-h)) / (2.0 * h)
        };
        let (x, y) = (step(t), step(direction.cross(t)));
        let area = 1.0 / (x.x * y.y - x.y * y.x).abs();
        let longest = 0.5 * ((x.x + y.y).hypot(x.y - y.x) + (x.x - y.y).hypot(x.y + y.x));
        found = [found[0].max(longest * area), found[1].max(area)];
    }
    found
}

/// Liao 2010, Engelhardt and Dachsbacher 2008, by closed form: at equal texels N the longest extent of a texel times √N is 4.90 rad on a
/// cube, 6.00 on an octahedron; the largest area over an even share 1.91, 1.65 and, on a tetrahedron, 3.31. A tetrahedron's texels
/// would be 6.45 long if they were square; in a square map they are stretched to 6.93.
#[test]
fn texels_are_as_large_as_published() {
    let a = around(4096.0, 0.0);
    let all = solids(&a);
    let even = |name: &str| {
        let faces = &all.iter().find(|s| s.0 == name).unwrap().1;
        let layers = faces.iter().map(|f| f.layer + 1).max().unwrap() as f64;
        let texels = layers * a.side * a.side;
        let [longest, area] = largest(&a, faces);
        println!("{name}: {} rad, {}", longest * texels.sqrt(), area * texels / (4.0 * std::f64::consts::PI));
        [longest * texels.sqrt(), area * texels / (4.0 * std::f64::consts::PI)]
    };
    for (name, longest, area) in
        [("cube", 4.90, 1.91), ("octahedron", 6.00, 1.65), ("tetrahedron", 6.93, 3.31), ("paraboloids", 5.66, 2.55)]
    {
        let [l, a] = even(name);
        assert!((l / longest - 1.0).abs() < 0.02 && (a / area - 1.0).abs() < 0.02, "{name}: {l}, {a}");
    }
    let [cube, octahedron, tetrahedron] = ["cube", "octahedron", "tetrahedron"].map(even);
    assert!(cube[0] < octahedron[0] && octahedron[0] < tetrahedron[0]);
    assert!(octahedron[1] < cube[1] && cube[1] < tetrahedron[1]);
}

/// No texel is seen under a larger angle than its face says, and one nearly is.
#[test]
fn texels_are_seen_under_the_angle_that_is_told() {
    let a = around(512.0, 4.0);
    for (name, faces) in solids(&a) {
        for face in &faces {
            let mut widest = 0f64;
            for direction in directions(6000).into_iter().filter(|d| face_of(&faces, *d).axis == face.axis) {
                let t = direction.any_orthonormal_vector();
                let step = |t: DVec3| {
                    let at = |s: f64| place(&face.view, a.light, (direction + t * s).normalize()).unwrap();
                    (at(1e-5) - at(-1e-5)) / 2e-5
                };
                let (x, y) = (step(t), step(direction.cross(t)));
                let longest = 0.5 * ((x.x + y.y).hypot(x.y - y.x) + (x.x - y.y).hypot(x.y + y.x));
                widest = widest.max(longest / (x.x * y.y - x.y * y.x).abs());
            }
            let told = face.texel_angle();
            assert!(widest < 1.001 * told && widest > 0.9 * told, "{name}: {widest} of {told}");
        }
    }
}

/// Navratil 2015, section 4.1.4: with a cut angle a the favoured rim has (1 + sin a) / (1 - sin a) times as many texels per solid angle
/// as a plain paraboloid's, and the opposite rim the inverse.
#[test]
fn a_skewed_cut_favours_its_rim() {
    for degrees in [0.0f64, 15.0, 30.0, 45.0, 60.0] {
        let a = around(2048.0, 0.0);
        let sine = degrees.to_radians().sin();
        let view = |cut: f64| a.paraboloid(DMat3::IDENTITY, DMat3::from_rotation_y(cut.to_radians()), 0).view;
        let density = |cut: f64, direction: DVec3| {
            let (view, h) = (view(cut), 1e-5);
            let at = |t: DVec3| place(&view, a.light, (direction + t * h).normalize()).unwrap();
            let step = |t: DVec3| (at(t) - at(-t)) / (2.0 * h);
            step(DVec3::Y).perp_dot(step(DVec3::Z)).abs()
        };
        let wanted = (1.0 + sine) / (1.0 - sine);
        for (direction, wanted) in [(DVec3::X, wanted), (DVec3::NEG_X, 1.0 / wanted)] {
            let found = density(degrees, direction) / density(0.0, direction);
            println!("{degrees}°, {direction}: {found} of {wanted}");
            assert!((found / wanted - 1.0).abs() < 0.01, "{degrees}°: {found}, {wanted}");
        }
    }
}

fn serving() -> impl Iterator<Item = &'static techniques::Info> {
    techniques::ALL.iter().copied().filter(|i| i.family == "All directions")
}

/// The yard under a lamp.
fn under(light: Light, size: [u32; 2]) -> (Renderer, Setup) {
    let view = camera(Vec3::new(4.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light), size)
}

/// What is culled changes nothing; and with each step fewer triangles are drawn.
#[test]
fn culling_leaves_the_picture() {
    let (mut r, mut s) = under(lamp(Vec3::new(-0.4, 2.5, 2.0)), [96, 72]);
    for info in serving().filter(|i| i.specs().any(|s| s.name == "culling")) {
        // Wide in texels, and wide in metres, so that taps go to other faces.
        let wide = [&["filter=pcf", "kernel=9", "resolution=96"][..], &["filter=pcf", "kernel=5", "blur=0.6"]];
        for sets in [&[][..], wide[0], wide[1]] {
            let mut seen: Option<Vec<f32>> = None;
            let mut drawn = Vec::new();
            for culling in ["none", "casters", "view", "samples"].into_iter() {
                let culling = format!("culling={culling}");
                select(&mut s, info.id, &[&["resolution=256", &culling], sets].concat());
                r.render(&s, ask(&s)).unwrap();
                let visibility = r.read_visibility().unwrap();
                let other =
                    seen.as_ref().map_or(0, |seen| seen.iter().zip(&visibility).filter(|(a, b)| a != b).count());
                assert_eq!(other, 0, "{} {sets:?} {culling}", info.id);
                seen = Some(visibility);
                let faces = r.known().unwrap().faces;
                drawn.push(faces.iter().flatten().map(|f| f[1]).sum::<u32>());
            }
            println!("{} {sets:?}: {drawn:?}", info.id);
            assert!(drawn.windows(2).all(|w| w[1] <= w[0]) && drawn.last() < drawn.first(), "{}: {drawn:?}", info.id);
        }
    }
}

/// A face without view samples draws nothing; those of a lamp far outside the view are few.
#[test]
fn unseen_faces_are_not_drawn() {
    let (mut r, mut s) = under(lamp(Vec3::new(0.0, 30.0, 0.0)), [96, 72]);
    for info in serving() {
        select(&mut s, info.id, &["resolution=256"]);
        r.render(&s, ask(&s)).unwrap();
        let faces = r.known().unwrap().faces;
        let facing = facing(&mut r);
        let samples: u32 = faces.iter().flatten().map(|f| f[0]).sum();
        assert_eq!(samples as u64, facing, "{}: {faces:?}", info.id);
        assert!(faces.iter().flatten().all(|f| f[0] > 0), "{}: {faces:?}", info.id);
        // The skewed ones' border passes through what is seen.
        let all = faces.len() == 1 || info.id == "skewed-paraboloid";
        assert!(all || faces.iter().any(|f| f.is_none()), "{}: {faces:?}", info.id);
    }
}

/// Filters look across the seams: beside them they err no more than elsewhere. The lamp stands so that seams cross the shadows.
#[test]
fn filters_cross_seams() {
    let (mut r, mut s) = under(lamp(Vec3::new(0.0, 3.0, 1.0)), [160, 120]);
    for info in serving() {
        for filter in crate::laws::filters(info) {
            select(&mut s, info.id, &["resolution=512", &format!("filter={}", filter.id)]);
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let layer = r.read_layer(0).unwrap().unwrap();
            let [width, height] = s.size.map(|n| n as usize);
            let face = |x: usize, y: usize| layer.places[y * width + x].map(|p| p.1);
            let errors: Vec<f32> = {
                let seen = r.read_visibility().unwrap();
                let truth = r.read_truth().unwrap();
                seen.iter().zip(&truth).map(|(a, b)| (a - b).abs()).collect()
            };
            let (mut beside, mut elsewhere) = ([0.0f64; 2], [0.0f64; 2]);
            for y in 3..height - 3 {
                for x in 3..width - 3 {
                    let Some(own) = face(x, y) else { continue };
                    let around = (0..49).filter_map(|k| face(x + k % 7 - 3, y + k / 7 - 3));
                    let sum = if around.into_iter().any(|f| f != own) { &mut beside } else { &mut elsewhere };
                    sum[0] += errors[y * width + x] as f64;
                    sum[1] += 1.0;
                }
            }
            if beside[1] < 100.0 {
                continue;
            }
            let [b, e] = [beside, elsewhere].map(|s| s[0] / s[1]);
            println!("{} {}: {b:.4} beside seams, {e:.4} elsewhere, {} pixels", info.id, filter.id, beside[1]);
            assert!(b < 1.6 * e + 0.02, "{} {}: {b:.4} beside seams, {e:.4} elsewhere", info.id, filter.id);
        }
    }
}

/// The exact raster, and triangles split, put long straight casters where they belong; corners alone do not.
#[test]
fn paraboloids_bend_what_is_not_split() {
    let (mut r, mut s) = built_in("st-longtri", [160, 120]);
    s.light = lamp(Vec3::new(0.5, 3.0, 0.0));
    let mut share = |technique: &str, sets: &[&str]| {
        let e = errors(&mut r, &mut s, technique, sets);
        (e.lit_incorrect + e.shadow_incorrect) as f64 / e.facing as f64
    };
    for technique in ["dual-paraboloid", "skewed-paraboloid"] {
        let [linear, split, exact] =
            ["linear", "subdivide", "exact"].map(|r| share(technique, &["resolution=1024", &format!("raster={r}")]));
        let cube = share("cube", &["resolution=1024"]);
        println!("{technique}: linear {linear:.4}, split {split:.4}, exact {exact:.4}; cube {cube:.4}");
        assert!(linear > 2.0 * exact && split < 1.3 * exact + 0.002, "{technique}: {linear} {split} {exact}");
    }
}

/// Of triangles that face the light, or do not, all ways to draw them into a paraboloid leave out the same; also where a side's frame is
/// mirrored, as the second of a skewed paraboloid is.
#[test]
fn paraboloids_leave_out_faces_alike() {
    // Two sheets over a floor that lies in both sides: cut so finely that straight edges are good enough.
    let tiles = |x: f32, up: bool| {
        let at = move |i: usize| Vec2::new(x + 0.1 * (i % 20) as f32, -1.0 + 0.1 * (i / 20) as f32);
        (0..400)
            .flat_map(move |i| floor(at(i), at(i) + 0.1, 1.0))
            .map(move |[a, b, c]| if up { [a, b, c] } else { [a, c, b] })
    };
    let ground = (0..1600).flat_map(|i| {
        let at = Vec2::new(-4.0 + 0.2 * (i % 40) as f32, -4.0 + 0.2 * (i / 40) as f32);
        floor(at, at + 0.2, 0.0)
    });
    let all: Vec<[Vec3; 3]> = tiles(-2.5, true).chain(tiles(0.5, false)).chain(ground).collect();
    let view = camera(Vec3::new(0.0, 7.0, 4.0), Vec3::ZERO);
    let lamp = lamp(Vec3::new(0.0, 2.2, 0.1));
    let (mut r, mut s) = start(scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, lamp), [96, 72]);
    for technique in ["dual-paraboloid", "skewed-paraboloid"] {
        let mut dark = Vec::new();
        for cull in ["none", "front", "back"] {
            let mut seen = |raster: &str| {
                let sets = format!("resolution=256 orientation=fixed cull={cull} raster={raster}");
                select(&mut s, technique, &sets.split(' ').collect::<Vec<_>>());
                r.render(&s, ask(&s)).unwrap();
                r.read_visibility().unwrap()
            };
            let [exact, linear] = ["exact", "linear"].map(&mut seen);
            // Nor does it matter which triangles are not even drawn.
            assert!(seen("linear culling=none") == linear, "{technique} {cull}: culling changes the picture");
            let apart = exact.iter().zip(&linear).filter(|(a, b)| a != b).count();
            dark.push(exact.iter().filter(|v| **v < 0.5).count());
            assert!(apart * 100 < exact.len(), "{technique} {cull}: {apart} pixels apart, {dark:?} dark");
        }
        println!("{technique}: {dark:?} pixels dark");
        assert!(dark[1].abs_diff(dark[2]) * 3 < dark[0] && dark[1] * 10 > dark[0] * 3, "{technique}: {dark:?}");
    }
}

/// Lamps where no map can look well: inside a caster, on the floor, without a range, with an endless one.
#[test]
fn awkward_lamps() {
    let (mut r, mut s) = under(lamp(Vec3::ZERO), [48, 36]);
    let at = |x: f32, y: f32, z: f32, range: f32| Light::Omni {
        position: Vec3::new(x, y, z),
        range,
        radius: 0.0,
        color: Vec3::ONE,
    };
    let view = s.camera.position;
    let lamps = [
        at(-1.3, 0.6, -0.3, 60.0),
        at(0.0, 0.0, 0.0, 60.0),
        at(0.0, 3.0, 0.0, 0.0),
        at(0.0, 3.0, 0.0, 1e30),
        at(0.0, 3.0, 0.0, 1e-3),
        at(view.x, view.y, view.z, 60.0),
        at(0.0, 1e4, 0.0, 1e9),
    ];
    for (k, light) in lamps.into_iter().enumerate() {
        s.light = light;
        // Every other lamp each, and the others.
        for info in serving().filter(|info| (info.mark + k) % 2 == 0) {
            select(&mut s, info.id, &["resolution=128"]);
            r.render(&s, ask(&s)).unwrap_or_else(|e| panic!("{} {light:?}: {e:#}", info.id));
            let visibility = r.read_visibility().unwrap();
            assert!(visibility.iter().all(|v| (0.0..=1.0).contains(v)), "{} {light:?}", info.id);
        }
    }
}

/// A filter that reaches farther than a face is large is refused with what to do.
#[test]
fn too_wide_a_filter_is_refused() {
    let (mut r, mut s) = under(lamp(Vec3::new(0.0, 3.0, 0.0)), [32, 32]);
    select(&mut s, "cube", &["resolution=64", "filter=pcf", "mode=disk", "radius=12"]);
    let error = r.render(&s, ask(&s)).unwrap_err().to_string();
    assert!(error.contains("choose a higher resolution or a narrower filter"), "{error}");
}

/// A hemisphere light's shadow is what an omni light's is in front of it, and all techniques find it.
#[test]
fn hemispheres_are_half_of_all_directions() {
    let position = Vec3::new(0.0, 5.0, 0.0);
    let (mut r, mut s) = under(lamp(position), [96, 72]);
    let direction = Vec3::new(0.3, -1.0, 0.1);
    for info in serving() {
        s.light = Light::Hemisphere { position, direction, range: 60.0, color: Vec3::ONE };
        let half = errors(&mut r, &mut s, info.id, &["resolution=512"]);
        println!("{}: {} of {} wrong", info.id, half.lit_incorrect + half.shadow_incorrect, half.facing);
        assert!((half.lit_incorrect + half.shadow_incorrect) as f64 <= 0.02 * half.facing as f64, "{}", info.id);
        assert!(half.shadow_correct > 50, "{}", info.id);
    }
}

/// What is asked of [`place`] is what WGSL draws: a picture's places in the maps agree with the CPU's.
#[test]
fn cpu_and_gpu_agree_on_places() {
    let light = Vec3::new(-0.4, 2.5, 2.0);
    let (mut r, mut s) = under(lamp(light), [64, 48]);
    for (technique, sets) in [
        ("cube", "near=0.05"),
        ("omni-atlas", "solid=octahedron"),
        ("omni-atlas", "solid=tetrahedron"),
        ("dual-paraboloid", "orientation=fixed"),
    ] {
        select(&mut s, technique, &["resolution=256", sets]);
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        let layer = r.read_layer(0).unwrap().unwrap();
        let positions = r.read_position().unwrap();
        let a = Around { light: light.as_dvec3(), near: 0.05, far: 30.0, side: 256.0, guard: 1.0, metres: 0.0 };
        let down = frame_of(DVec3::NEG_Y);
        let faces = match sets {
            "solid=octahedron" => a.octahedron(),
            "solid=tetrahedron" => a.tetrahedron(),
            "near=0.05" => a.cube(),
            _ => [down, DMat3::from_cols(-down.x_axis, down.y_axis, -down.z_axis)]
                .into_iter()
                .enumerate()
                .map(|(i, frame)| a.paraboloid(frame, DMat3::IDENTITY, i as u32))
                .collect(),
        };
        let mut compared = 0;
        for (at, p) in layer.places.iter().zip(&positions) {
            let Some((texel, number)) = at else { continue };
            let direction = DVec3::new(p[0] as f64, p[1] as f64, p[2] as f64) - a.light;
            let mut dots: Vec<f64> = faces.iter().map(|f| f.axis.dot(direction.normalize())).collect();
            dots.sort_by(f64::total_cmp);
            if dots[dots.len() - 1] - dots[dots.len() - 2] < 3e-6 {
                continue;
            }
            let face = face_of(&faces, direction);
            let there = place(&face.view, a.light, direction).unwrap();
            let off = (there - DVec2::new(texel[0] as f64, texel[1] as f64)).length();
            assert!(off < 0.02 && face.layer == *number, "{technique} {sets}: {texel:?} in {number}, {there} {off}");
            compared += 1;
        }
        assert!(compared > 500, "{technique}: {compared}");
    }
}

/// A lamp in the very plane of a ceiling lights the room below: neither the truth nor any map takes the ceiling, seen edge-on, for
/// something in the way. An edge that passes closely over it, from before a paraboloid's side to behind it, darkens what it should.
#[test]
fn lamps_in_the_plane_of_a_ceiling() {
    let view = camera(Vec3::new(0.0, 1.5, 8.0), Vec3::new(0.0, 0.6, 0.0));
    let mut room = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    room.extend(floor(Vec2::splat(-6.0), Vec2::splat(6.0), 3.0));
    room.push([Vec3::new(-6.1, -1.0, -7.0), Vec3::new(-6.1, -1.0, 7.0), Vec3::new(-6.1, 9.0, 0.3)]);
    // Straight over the lamp's axis, from half a metre below it to a metre above.
    let lid = [Vec3::new(5.0, 1.5, 0.0), Vec3::new(-5.0, 3.0, 0.0), Vec3::new(0.0, 4.0, 6.0)];
    let under = [floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0), vec![lid]].concat();
    for (triangles, position, raster) in [
        (under, Vec3::new(0.0, 2.0, 0.0), "raster=subdivide"),
        (room.clone(), Vec3::new(0.3, 3.0, -0.4), "raster=exact"),
        // On a wall, in coordinates that rounding moves.
        (room, Vec3::new(-6.1, 1.3, 0.7), "raster=exact"),
    ] {
        let (mut r, mut s) =
            start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, lamp(position)), [96, 72]);
        for info in serving() {
            // A warp's triangles are split by another rule.
            let warped = info.id.contains("tw-");
            let raster = if warped { "raster=exact" } else { raster };
            let raster = info.specs().any(|s| s.name == "raster").then_some(raster);
            let fixed = info.specs().any(|s| s.name == "orientation").then_some("orientation=fixed");
            let sets: Vec<&str> = ["resolution=256"].into_iter().chain(raster).chain(fixed).collect();
            let e = errors(&mut r, &mut s, info.id, &sets);
            println!("{} {raster:?}: {e:?}", info.id);
            assert!(e.lit_correct > 400, "{}: {e:?}", info.id);
            assert!((e.lit_incorrect + e.shadow_incorrect) * 50 <= e.facing, "{} {raster:?}: {e:?}", info.id);
        }
    }
}

/// Views of depth show the face that the camera's target lies in, whatever holds the cube.
#[test]
fn the_face_that_is_looked_at_is_shown() {
    let at = Vec3::new(0.4, 0.6, 0.3);
    let ways = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    // A room, with a box on each side of the lamp, each farther off than the last.
    let mut all = crate::edges::box_of(Vec3::splat(-6.0), Vec3::splat(6.0));
    for (i, way) in ways.into_iter().enumerate() {
        let middle = at + (1.5 + 0.5 * i as f32) * way;
        all.extend(crate::edges::box_of(middle - 0.3, middle + 0.3));
    }
    let lamp = lamp(at);
    let view = camera(Vec3::new(0.0, 0.0, 1.0), Vec3::ZERO);
    let (mut r, mut s) = start(scene(vec![mesh(&all, 0)], vec![material(Vec3::ONE)], view, lamp), [64, 48]);
    for (id, view, set) in [
        ("edsm", "shadow-map", ""),
        ("sssm", "shadow-map", ""),
        ("imperfect-sm", "shadow-map", "shown=direct"),
        ("hybrid-pcf", "shadow-map", ""),
        ("csm-conservative", "grown-others", "casters=both"),
    ] {
        for (face, way) in ways.into_iter().enumerate() {
            select(&mut s, id, &["resolution=64"]);
            if !set.is_empty() {
                s.set(set, &[id.into()]).unwrap();
            }
            s.view = view.into();
            s.camera.position = lamp.position() - 0.1 * way + Vec3::new(0.03, 0.02, 0.01);
            s.camera.target = lamp.position() + way;
            r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
            let map = r.read_layer(face as u32).unwrap().unwrap();
            let middle = (map.side / 2 * map.side + map.side / 2) as usize;
            let held = map.metres(middle).unwrap_or_else(|| panic!("{id} {way}: no caster"));
            let share = (map.view.far - held) / (map.view.far - map.view.near);
            let shown = r.read_picture().unwrap()[4 * (24 * 64 + 32)];
            assert!((f32::from(shown) - 255.0 * share).abs() < 3.0, "{id} {way}: {shown} {share}");
        }
    }
}
