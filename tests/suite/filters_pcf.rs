//! Percentage-closer filters against the same sums on the CPU, and penumbras of PCSS against closed forms.

use crate::common::*;
use crate::light_size::{crossing, places, share, wide_sun};
use glam::{DVec3, Vec2, Vec3, Vec4Swizzles};
use shadowscope::frame::{Ask, History, MapLayer, Renderer, Truth};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Camera;
use shadowscope::setup::Setup;
use shadowscope::truth::Samples;
use std::f64::consts::TAU;

/// Sheets float this far above one another; comparisons are far from both.
const GAP: f32 = 1.0;

/// A floor under two sheets whose edges lie across all texels.
pub fn sheets(light: Light) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    let turned = |at: Vec3, half: f32, angle: f32| {
        let (s, c) = angle.sin_cos();
        let (a, b) = (Vec3::new(c, 0.0, s) * half, Vec3::new(-s, 0.0, c) * half);
        [[at - a - b, at - a + b, at + a + b], [at - a - b, at + a + b, at + a - b]]
    };
    triangles.extend(turned(Vec3::new(0.3, GAP, -0.4), 1.3, 0.4));
    triangles.extend(turned(Vec3::new(0.7, 2.0 * GAP, 0.2), 0.6, 1.1));
    let view = camera(Vec3::new(0.5, 7.0, 4.5), Vec3::new(0.0, 0.0, 0.2));
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [96, 72])
}

pub fn high_sun() -> Light {
    sun(Vec3::new(0.2, 1.0, 0.1))
}

fn high_lamp() -> Light {
    spot(Vec3::new(0.6, 8.0, 0.5), Vec3::new(0.0, 0.0, 0.2), 38.0)
}

/// Maps, techniques that look them up, and what chooses them.
const FITS: [(&str, &[&str]); 3] = [
    ("pcf", &["fit=scene", "resolution=64"]),
    ("pcf", &["fit=receivers", "resolution=64"]),
    // The second layer's map is smaller than its layer.
    ("pssm", &["filter=pcf", "cascades=2", "resolution=96", "resolution_2=64", "blend=0", "fit=indep", "lambda=0.2"]),
];

/// A receiver as the look-up sees it.
pub struct Receiver {
    pub pixel: [u32; 2],
    pub visibility: f64,
    pub layer: usize,
    /// Its place in the map, texels, and its depth along the light's axis.
    pub texel: [f64; 2],
    pub depth: f64,
}

/// Draws a frame: its receivers at least so many texels inside their maps, and the maps.
pub fn looked_up(r: &mut Renderer, s: &Setup, inside: f64) -> (Vec<Receiver>, Vec<MapLayer>) {
    r.render(s, Ask { analysis: true, ..ask(s) }).unwrap();
    let mut maps = vec![r.read_layer(0).unwrap().unwrap()];
    for i in 1..maps[0].layers {
        maps.push(r.read_layer(i).unwrap().unwrap());
    }
    let (v, at, mask) = (r.read_visibility().unwrap(), r.read_position().unwrap(), r.read_mask().unwrap());
    let mut all = Vec::new();
    for i in (0..v.len()).filter(|i| mask[*i] == FACING) {
        let Some((texel, layer)) = maps[0].places[i] else { continue };
        let map = &maps[layer as usize];
        let texel = texel.map(|t| t as f64);
        if texel.iter().all(|t| *t > inside && *t < map.side as f64 - inside) {
            let depth = map.view.axis.as_dvec4().dot(Vec3::from_slice(&at[i]).as_dvec3().extend(1.0));
            let pixel = [i as u32 % s.size[0], i as u32 / s.size[0]];
            all.push(Receiver { pixel, visibility: v[i] as f64, layer: layer as usize, texel, depth });
        }
    }
    assert!(all.len() > 1500, "{}", all.len());
    (all, maps)
}

impl Receiver {
    /// The depth of the caster that a texel holds before this receiver, metres.
    pub fn caster(&self, map: &MapLayer, [x, y]: [i64; 2]) -> Option<f64> {
        let texel = (y * map.side as i64 + x) as usize;
        map.metres(texel).map(f64::from).filter(|z| *z < self.depth - 0.5 * GAP as f64)
    }
}

/// The folded tents are the kernels that they are made of, texel by texel, blended by the receiver's place between texels.
#[test]
fn folded_tents_are_their_kernels() {
    const KERNELS: [(&str, &[f64]); 3] = [
        ("tent3", &[1.0, 2.0, 1.0]),
        ("tent5", &[1.0, 3.0, 4.0, 3.0, 1.0]),
        ("tent7", &[1.0, 5.0, 12.0, 16.0, 12.0, 5.0, 1.0]),
    ];
    for light in [high_sun(), high_lamp()] {
        let (mut r, mut s) = sheets(light);
        for (technique, fit) in FITS {
            for (mode, kernel) in KERNELS {
                select(&mut s, technique, &[fit, &[&format!("mode={mode}")]].concat());
                let (all, maps) = looked_up(&mut r, &s, 5.0);
                let sum = |kernel: &[f64], p: &Receiver| {
                    let half = (kernel.len() / 2) as i64;
                    let weight = |place: f64, i: i64| {
                        let base = (place + 0.5).floor();
                        let at = |offset: i64| kernel.get((offset + half) as usize).copied().unwrap_or(0.0);
                        let s = place + 0.5 - base;
                        ((1.0 - s) * at(i - (base as i64 - 1)) + s * at(i - base as i64)) / kernel.iter().sum::<f64>()
                    };
                    let around = |place: f64| (place as i64 - half - 2..=place as i64 + half + 2).collect::<Vec<_>>();
                    let mut sum = 0.0;
                    for y in around(p.texel[1]) {
                        for x in around(p.texel[0]) {
                            let w = weight(p.texel[0], x) * weight(p.texel[1], y);
                            if w > 0.0 && p.caster(&maps[p.layer], [x, y]).is_none() {
                                sum += w;
                            }
                        }
                    }
                    sum
                };
                let (mut soft, mut told) = (0, 0);
                for p in &all {
                    let expected = sum(kernel, p);
                    soft += (expected > 0.02 && expected < 0.98) as u32;
                    // The sampler blends by fractions of eight bits.
                    let off = (p.visibility - expected).abs();
                    assert!(off < 1.0 / 255.0 + 5e-4, "{technique} {fit:?} {mode} at {:?}: {off}", p.pixel);
                    // Another kernel would not do.
                    let box_like = sum(&vec![1.0; kernel.len()], p);
                    told += ((p.visibility - box_like).abs() > 0.01) as u32;
                }
                assert!(soft > 200 && told > 80, "{technique} {fit:?} {mode}: {soft}, {told}");
                assert!(
                    maps.iter().enumerate().all(|(i, _)| all.iter().any(|p| p.layer == i)),
                    "{technique}: a layer unseen"
                );
            }
        }
    }
}

/// The tap of a spiral, texels from its middle.
fn vogel(i: usize, n: usize, radius: f64, turn: f64) -> [f64; 2] {
    let r = radius * ((i as f64 + 0.5) / n as f64).sqrt();
    let angle = i as f64 * 2.3999632 + turn;
    [r * angle.cos(), r * angle.sin()]
}

/// Depths of the casters that the taps of a disk meet; None: a tap lies so close to a texel's border that rounding decides.
fn met(p: &Receiver, map: &MapLayer, n: usize, radius: f64, turn: f64) -> Option<Vec<f64>> {
    let mut casters = Vec::new();
    for i in 0..n {
        let [dx, dy] = vogel(i, n, radius, turn);
        let at = [p.texel[0] + dx, p.texel[1] + dy];
        let near = at.iter().any(|t| (t - t.round()).abs() < 4e-3);
        let texel = at.map(|t| t.floor() as i64);
        let around = [-1, 0, 1].map(|x| [-1, 0, 1].map(|y| p.caster(map, [texel[0] + x, texel[1] + y]).is_some()));
        if near && around.as_flattened().iter().any(|c| *c != around[1][1]) {
            return None;
        }
        casters.extend(p.caster(map, texel));
    }
    Some(casters)
}

/// The disk turns by interleaved gradient noise as its formula says, whatever the seed; white noise turns it otherwise.
#[test]
fn the_disk_turns_by_interleaved_gradient_noise() {
    let (n, radius) = (9, 3.5);
    for light in [high_sun(), high_lamp()] {
        let (mut r, mut s) = sheets(light);
        for (technique, fit) in FITS {
            let sets = ["mode=disk", "samples=9", "radius=3.5", "rotate=true", "noise=ign"];
            select(&mut s, technique, &[fit, &sets].concat());
            s.seed = 1;
            let (all, maps) = looked_up(&mut r, &s, 5.0);
            let (mut sure, mut soft, mut still) = (0, 0, 0);
            for p in &all {
                let [x, y] = p.pixel.map(|x| x as f32);
                let phase = (52.982_918 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract();
                let seen = |turn| met(p, &maps[p.layer], n, radius, turn).map(|c| 1.0 - c.len() as f64 / n as f64);
                let Some(expected) = seen(phase as f64 * TAU) else { continue };
                sure += 1;
                soft += (expected > 0.0 && expected < 1.0) as u32;
                let off = (p.visibility - expected).abs();
                assert!(off < 1e-4, "{technique} {fit:?} at {:?}: {} and not {expected}", p.pixel, p.visibility);
                still += (seen(0.0).is_some_and(|v| v != expected)) as u32;
            }
            assert!(sure * 10 > all.len() * 6 && soft > 60 && still > 30, "{sure} of {}, {soft}, {still}", all.len());
            let before = r.read_visibility().unwrap();
            s.seed = 2;
            r.render(&s, ask(&s)).unwrap();
            assert_eq!(r.read_visibility().unwrap(), before, "the seed is white noise's");
            s.set("noise=white", &[technique.into()]).unwrap();
            r.render(&s, ask(&s)).unwrap();
            let white = r.read_visibility().unwrap();
            assert!(white.iter().zip(&before).filter(|(a, b)| a != b).count() > 60);
        }
    }
}

/// Root mean squares of what visibility in a transition is off by: at each pixel, and of its means over 3 × 3 and 7 × 7.
fn left(v: &[f32], smooth: &[f32], [w, h]: [usize; 2]) -> [f64; 3] {
    let off: Vec<f64> = v.iter().zip(smooth).map(|(v, smooth)| (v - smooth) as f64).collect();
    let (mut n, mut sums) = (0.0, [0.0; 3]);
    for (x, y) in (3..h - 3).flat_map(|y| (3..w - 3).map(move |x| (x, y))) {
        if smooth[y * w + x] > 0.1 && smooth[y * w + x] < 0.9 {
            n += 1.0;
            for (sum, reach) in sums.iter_mut().zip([0, 1, 3]) {
                let rows = y - reach..=y + reach;
                let all: f64 = rows.map(|y| off[y * w + x - reach..=y * w + x + reach].iter().sum::<f64>()).sum();
                *sum += (all / ((2 * reach + 1) * (2 * reach + 1)) as f64).powi(2);
            }
        }
    }
    assert!(n > 2000.0, "{n}");
    sums.map(|sum| (sum / n).sqrt())
}

const DISK: [&str; 4] = ["mode=disk", "fit=scene", "resolution=2048", "blur=0.3"];

/// The three noises are as large at each pixel. Gradient noise leaves less than white noise in the means of 3 × 3, and blue noise
/// the least in those of 7 × 7.
#[test]
fn noises_are_as_fine_as_their_names_say() {
    let (mut r, mut s) = under_a_lid(sun(Vec3::new(0.05, 1.0, 0.02)), 1.0);
    let mut seen = |sets: &[&str]| {
        select(&mut s, "pcf", &[&DISK, sets].concat());
        r.render(&s, Ask { truth: Truth::Off, ..ask(&s) }).unwrap();
        r.read_visibility().unwrap()
    };
    let smooth = seen(&["samples=64"]);
    let mut of = |noise: &str| left(&seen(&["samples=8", "rotate=true", noise]), &smooth, [216, 162]);
    let [white, gradient, blue] = [of("noise=white"), of("noise=ign"), of("noise=blue")];
    println!("each pixel, 3 × 3, 7 × 7: white {white:?}, gradient {gradient:?}, blue {blue:?}");
    for (noise, finer) in [(gradient, 0.85), (blue, 0.92)] {
        assert!((noise[0] / white[0] - 1.0).abs() < 0.15, "{noise:?}, {white:?}");
        assert!(noise[1] < finer * white[1], "{noise:?}, {white:?}");
    }
    assert!(blue[2] < gradient[2] && gradient[2] < 0.95 * white[2], "{blue:?}, {gradient:?}, {white:?}");
}

/// Frames drawn one by one come to what a capture draws at once, which is the same every time and comes nearer to the smooth
/// filter the more frames there are; filters of both families do.
#[test]
fn frames_are_averaged() {
    let (mut r, mut s) = under_a_lid(wide_sun(Vec3::new(0.05, 1.0, 0.02), 4.0), 1.0);
    let mut seen = |s: &Setup, history| {
        let told = r.render(s, Ask { truth: Truth::Off, history, ..ask(s) }).unwrap();
        (r.read_visibility().unwrap(), told.frames)
    };
    let soft = ["search_taps=64", "filter_taps=8", "fit=scene", "resolution=1024"];
    for (technique, sets) in [("pcf", &[&DISK[..], &["samples=8"]].concat()), ("pcss", &soft.to_vec())] {
        select(&mut s, technique, sets);
        let set = |s: &mut Setup, noise: &str, k: u32| {
            let sets = [
                &format!("noise={noise}"),
                &format!("accumulate={k}"),
                "rotate=true",
                "blend_factor=0",
                "clamp_history=false",
            ];
            sets.iter().for_each(|set| s.set(set, &[technique.into()]).unwrap());
        };
        let taps = |s: &mut Setup, n: u32| {
            let name = if technique == "pcf" { "samples" } else { "filter_taps" };
            s.set(&format!("{name}={n}"), &[technique.into()]).unwrap();
        };
        taps(&mut s, 64);
        let (_, frames) = seen(&s, History::Whole);
        assert_eq!(frames, [1, 1]);
        set(&mut s, "ign", 16);
        let (smooth, _) = seen(&s, History::Whole);
        taps(&mut s, 8);
        let mut before = f64::MAX;
        for noise in ["white", "ign", "blue"] {
            let mut off = Vec::new();
            for k in [1, 4, 16] {
                set(&mut s, noise, k);
                let (whole, frames) = seen(&s, History::Whole);
                assert_eq!(frames, [k, k]);
                assert!(seen(&s, History::Whole).0 == whole, "another time {technique}, {noise} is another");
                for i in 1..=k {
                    let one = seen(&s, if i == 1 { History::Starts } else { History::Goes });
                    assert_eq!(one.1, [i, k]);
                    assert_eq!(one.0 == whole, i == k, "{technique}, {noise}: frame {i} of {k}");
                }
                off.push(left(&whole, &smooth, [216, 162])[0]);
            }
            println!("{technique}, {noise}: off by {off:?} after 1, 4 and 16 frames");
            assert!(off[1] < 0.65 * off[0] && off[2] < 0.65 * off[1], "{technique}, {noise}: {off:?}");
            before = before.min(off[2]);
        }
        assert!(before < 0.02, "{technique}: {before}");
    }
}

/// What earlier frames saw goes along with the surface as the camera moves. As the light moves it stays behind, a ghost, unless it is held
/// within what the pixels around see now.
#[test]
fn history_follows_surfaces_and_not_shadows() {
    let (mut r, mut s) = under_a_lid(sun(Vec3::new(0.05, 1.0, 0.02)), 1.0);
    let set = |s: &mut Setup, sets: &[&str]| select(s, "pcf", &[&DISK[..], &["samples=8", "noise=ign"], sets].concat());
    let averaged = ["rotate=true", "accumulate=16", "blend_factor=0", "clamp_history=false"];
    let mut seen = |s: &Setup, history| {
        r.render(s, Ask { truth: Truth::Off, history, ..ask(s) }).unwrap();
        r.read_visibility().unwrap()
    };
    let (from, sun_at) = (s.camera, s.light);
    for (clamp, blend) in [(false, 0.0), (true, 0.1)] {
        let held = [&format!("clamp_history={clamp}"), &*format!("blend_factor={blend}")];
        set(&mut s, &[&averaged[..], &held].concat());
        seen(&s, History::Whole);
        // Pixels and a half, sideways and forwards.
        let by = Vec3::new(0.011, 0.0, -0.02);
        s.camera = Camera { position: from.position + by, target: from.target + by, ..from };
        let followed = seen(&s, History::Goes);
        let one = seen(&s, History::Starts);
        set(&mut s, &["samples=64"]);
        let smooth = seen(&s, History::Whole);
        let [followed, one] = [&followed, &one].map(|v| left(v, &smooth, [216, 162])[0]);
        println!("camera moved, clamp {clamp}: off by {followed}, without the frames before {one}");
        assert!(followed < 0.5 * one, "{followed}, {one}");
        // A shadow's edge moves by half a metre.
        s.camera = from;
        set(&mut s, &[&averaged[..], &held].concat());
        seen(&s, History::Whole);
        s.light = sun(Vec3::new(0.55, 1.0, 0.02));
        let ghost = seen(&s, History::Goes);
        set(&mut s, &["samples=64"]);
        let now = seen(&s, History::Whole);
        let stayed = ghost.iter().zip(&now).filter(|(g, n)| (**g - **n).abs() > 0.5).count();
        println!("light moved, clamp {clamp}: {stayed} pixels of the ghost");
        assert_eq!(stayed > 1000, !clamp, "{stayed} of {}", now.len());
        s.light = sun_at;
    }
}

/// DPCF mixes the share of the disk that is seen with its hardened form, by how far off the casters are.
#[test]
fn dpcf_hardens_where_casters_are_close() {
    let (n, radius) = (12, 4.0);
    for light in [high_sun(), high_lamp()] {
        let (mut r, mut s) = sheets(light);
        for (technique, fit) in FITS {
            for scale in [0.25, 1.5] {
                let sets = ["mode=dpcf", "samples=12", "radius=4", &format!("ratio_scale={scale}")];
                select(&mut s, technique, &[fit, &sets[..]].concat());
                let (all, maps) = looked_up(&mut r, &s, 5.0);
                let (mut soft, mut hardened) = (0, 0);
                for p in &all {
                    let map = &maps[p.layer];
                    let Some(casters) = met(p, map, n, radius, 0.0) else { continue };
                    let share = casters.len() as f64 / n as f64;
                    let mut expected = 1.0;
                    if share > 0.0 {
                        let z = casters.iter().sum::<f64>() / casters.len() as f64;
                        // Under the sun from the corner of the scene's box that it meets first.
                        let axis = map.view.axis.as_dvec4();
                        let corners = [0.0, 2.0 * GAP as f64].map(|y| {
                            [(-4.0, -4.0), (-4.0, 4.0), (4.0, -4.0), (4.0, 4.0)]
                                .map(|(x, z)| axis.xyz().dot(DVec3::new(x, y, z)) + axis.w)
                        });
                        let first = corners.as_flattened().iter().copied().fold(f64::MAX, f64::min);
                        let first = if light.kind() == "spot" { 0.0 } else { first };
                        let q = (scale * (p.depth - z) / (z - first)).clamp(0.0, 1.0);
                        let y = 2.0 * share - 1.0;
                        let steep = 0.5 + 0.5 * y.signum() * (1.0 - (1.0 - y.abs()).powi(3));
                        expected = 1.0 - (steep + (share - steep) * q);
                        soft += (share < 1.0) as u32;
                        hardened += ((expected - (1.0 - share)).abs() > 0.02) as u32;
                    }
                    let off = (p.visibility - expected).abs();
                    assert!(off < 1e-3, "{technique} {fit:?} at {:?}: {} and not {expected}", p.pixel, p.visibility);
                }
                assert!(soft > 60 && (scale > 1.0 || hardened > 30), "{technique} {fit:?}: {soft}, {hardened}");
            }
        }
    }
}

/// A floor under a lid with one straight edge above x = 0, seen from below the lid.
pub fn under_a_lid(light: Light, height: f32) -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-20.0), Vec2::splat(20.0), 0.0);
    triangles.extend(floor(Vec2::splat(-20.0), Vec2::new(0.0, 20.0), height));
    let view = camera(Vec3::new(0.0, 0.9, 0.2), Vec3::ZERO);
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, light), [216, 162])
}

/// Width of the penumbra on the floor.
pub fn penumbra(r: &mut Renderer, s: &Setup) -> f64 {
    r.render(s, Ask { truth: Truth::Off, ..ask(s) }).unwrap();
    let seen = r.read_visibility().unwrap();
    let places = places(r, &seen);
    let at = |level| crossing(&places, 0.01, level);
    (at(share(0.8)) - at(share(-0.8))) / 0.8
}

pub fn lamp(height: f32, radius: f32) -> Light {
    Light::Spot {
        position: Vec3::new(0.0, height, 0.0),
        direction: Vec3::NEG_Y,
        outer_angle: 60.0,
        range: 30.0,
        radius,
        color: Vec3::splat(20.0),
    }
}

/// Under a straight edge PCSS is as wide as similar triangles have it, in one map and in cascades, also where the caster is
/// far before what a cascade covers.
#[test]
fn pcss_is_as_wide_as_the_closed_form() {
    let by_sun = |angle: f32, height: f32| 2.0 * angle.to_radians().tan() * height;
    let by_lamp = |lamp: f32, radius: f32, height: f32| 2.0 * radius * height / (lamp - height);
    for (light, height, width) in [
        (wide_sun(Vec3::Y, 3.0), 1.0, by_sun(3.0, 1.0)),
        (wide_sun(Vec3::Y, 3.0), 2.0, by_sun(3.0, 2.0)),
        (wide_sun(Vec3::Y, 1.5), 4.0, by_sun(1.5, 4.0)),
        (wide_sun(Vec3::Y, 0.5), 12.0, by_sun(0.5, 12.0)),
        (lamp(4.0, 0.15), 1.0, by_lamp(4.0, 0.15, 1.0)),
        (lamp(4.0, 0.1), 2.0, by_lamp(4.0, 0.1, 2.0)),
        (lamp(8.0, 0.1), 4.0, by_lamp(8.0, 0.1, 4.0)),
    ] {
        let (mut r, mut s) = under_a_lid(light, height);
        for (technique, sets) in [
            ("pcss", &["resolution=512"][..]),
            ("pcss", &["resolution=512", "rotate=true", "noise=ign"]),
            // Maps that cover so little that the widest radius is less than the penumbra would cut it.
            ("pssm", &["filter=pcss", "resolution=512", "cascades=2", "fit=stable"]),
            ("pssm", &["filter=pcss", "resolution=512", "cascades=2", "fit=indep"]),
            ("sdsm", &["filter=pcss", "resolution=512", "cascades=1"]),
            ("lispsm", &["filter=pcss", "resolution=512"]),
        ] {
            select(&mut s, technique, sets);
            let measured = penumbra(&mut r, &s);
            println!("{technique} {sets:?} {} {height}: {measured:.4}, {width:.4}", light.kind());
            assert!(
                (measured / width as f64 - 1.0).abs() < 0.05,
                "{technique} {sets:?}, {light:?}, {height} m: {measured} wide instead of {width}"
            );
        }
        // Its view says the same in the middle.
        select(&mut s, "pcss", &["resolution=512"]);
        s.view = "penumbra-width".into();
        r.render(&s, ask(&s)).unwrap();
        let middle = r.read_map().unwrap()[(s.size[1] / 2 * s.size[0] + s.size[0] / 2) as usize];
        assert!((middle / width - 1.0).abs() < 0.02, "{light:?}, {height} m: {middle} shown instead of {width}");
        s.view = "blocker-depth".into();
        r.render(&s, Ask { analysis: true, ..ask(&s) }).unwrap();
        let share = r.read_map().unwrap()[(s.size[1] / 2 * s.size[0] + s.size[0] / 2) as usize];
        let v = r.read_layer(0).unwrap().unwrap().view;
        let depth = v.axis.dot(Vec3::new(0.0, height, 0.0).extend(1.0));
        assert!((share - (depth - v.near) / (v.far - v.near)).abs() < 2e-3, "{light:?}: {share}");
    }
}

/// Without a size PCSS is the single comparison, bit for bit; with one it softens, in every fit.
#[test]
fn pcss_of_a_point_is_a_single_comparison() {
    let sizes: [fn(f32) -> Light; 2] = [
        |size| wide_sun(Vec3::new(0.6, 1.0, 0.3), 4.0 * size),
        |size| match spot(Vec3::new(-2.0, 6.0, 2.0), Vec3::ZERO, 45.0) {
            Light::Spot { position, direction, outer_angle, range, color, .. } => {
                Light::Spot { position, direction, outer_angle, range, color, radius: 0.3 * size }
            }
            other => other,
        },
    ];
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    for light in sizes {
        let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light(0.0));
        let (mut r, mut s) = start(made, [96, 72]);
        let mut seen = |technique: &str, sets: &[&str], size: f32| {
            select(&mut s, technique, sets);
            s.light = light(size);
            r.render(&s, ask(&s)).unwrap();
            r.read_visibility().unwrap()
        };
        for (technique, nearest, soft) in [
            ("pcss", ("shadow-map", &[][..]), &[][..]),
            ("pssm", ("pssm", &["resolution_2=512"]), &["filter=pcss", "resolution_2=512"]),
            ("sdsm", ("sdsm", &[]), &["filter=pcss"]),
            ("lispsm", ("lispsm", &[]), &["filter=pcss"]),
            ("tsm", ("tsm", &[]), &["filter=pcss"]),
            ("psm", ("psm", &[]), &["filter=pcss"]),
        ] {
            let point = seen(technique, soft, 0.0);
            assert_eq!(point, seen(nearest.0, nearest.1, 0.0), "{technique} under a {}", light(0.0).kind());
            assert!(point.iter().all(|v| *v == 0.0 || *v == 1.0));
            let sized = seen(technique, soft, 1.0);
            assert!(sized.iter().all(|v| (0.0..=1.0).contains(v)), "{technique}");
            let soft = sized.iter().filter(|v| **v > 0.05 && **v < 0.95).count();
            assert!(soft > 40, "{technique} under a {}: {soft}", light(1.0).kind());
        }
    }
}

/// Under lights with a size PCSS is nearer to the mean over pixel and light than PCF of any one width.
#[test]
fn pcss_beats_one_width() {
    let view = camera(Vec3::new(3.0, 4.0, 8.0), Vec3::new(0.0, 0.5, 0.0));
    let lamp = Light::Spot {
        position: Vec3::new(-2.0, 6.0, 2.0),
        direction: Vec3::new(2.0, -6.0, -2.0),
        outer_angle: 45.0,
        range: 40.0,
        radius: 0.3,
        color: Vec3::splat(40.0),
    };
    for light in [wide_sun(Vec3::new(0.6, 1.0, 0.3), 4.0), lamp] {
        let made = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, light);
        let (mut r, mut s) = start(made, [160, 120]);
        let mut rmse = |technique: &str, sets: &[&str]| {
            select(&mut s, technique, sets);
            let e = measure::accuracy(&mut r, &Setup { truth_samples: Samples::Fixed(64), ..s.clone() }, 0).unwrap();
            println!("{technique} {sets:?} {}: {:.4}", light.kind(), e.rmse);
            e.rmse
        };
        let soft = rmse("pcss", &[]);
        for blur in ["blur=0", "blur=0.05", "blur=0.1", "blur=0.2", "blur=0.4"] {
            let sets = ["mode=disk", "samples=64", "receiver_plane=true", blur];
            let even = rmse("pcf", &sets);
            assert!(soft < 0.9 * even, "{} {blur}: {soft}, pcf {even}", light.kind());
        }
    }
}

/// Lights so wide, high and low, that filters reach over much of a floor's slope.
pub fn wide_lights() -> [Light; 3] {
    [
        wide_sun(Vec3::new(0.9, 1.0, 0.3), 5.0),
        wide_sun(Vec3::new(1.0, 0.2, 0.0), 10.0),
        Light::Spot {
            position: Vec3::new(-3.0, 4.0, 2.0),
            direction: Vec3::new(0.6, -1.0, -0.3),
            outer_angle: 35.0,
            range: 40.0,
            radius: 1.0,
            color: Vec3::splat(50.0),
        },
    ]
}

/// A floor alone.
pub fn lit_floor(light: Light) -> (Renderer, Setup) {
    let ground = floor(Vec2::splat(-5.0), Vec2::splat(5.0), 0.0);
    let view = camera(Vec3::new(0.0, 3.0, 5.0), Vec3::ZERO);
    start(scene(vec![mesh(&ground, 0)], vec![material(Vec3::ONE)], view, light), [160, 120])
}

/// A floor alone stays lit however wide the search or the kernel is.
#[test]
fn a_floor_stays_lit() {
    for light in wide_lights() {
        let (mut r, mut s) = lit_floor(light);
        for (technique, sets) in [
            ("pcss", &["max_radius=128"][..]),
            ("pssm", &["filter=pcss"]),
            ("sdsm", &["filter=pcss"]),
            ("pcf", &["mode=tent3"]),
            ("pcf", &["mode=tent5"]),
            ("pcf", &["mode=tent7"]),
            ("pssm", &["filter=pcf", "mode=tent7", "resolution_2=256"]),
            ("pcf", &["mode=dpcf", "radius=16"]),
            ("pssm", &["filter=pcf", "mode=dpcf", "blur=0.5"]),
        ] {
            for plane in ["receiver_plane=false", "receiver_plane=true"] {
                select(&mut s, technique, &[sets, &[plane]].concat());
                r.render(&s, ask(&s)).unwrap();
                let (v, mask) = (r.read_visibility().unwrap(), r.read_mask().unwrap());
                let dark = v.iter().zip(&mask).filter(|(v, m)| **m == FACING && **v < 1.0).count();
                assert_eq!(dark, 0, "{technique} {plane} {light:?}");
            }
        }
    }
}
