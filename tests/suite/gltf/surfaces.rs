//! What textures' filters and vertices' colours do to surfaces and shadows, against closed forms.

use crate::common::{choose, gpu, lamp, start, sun};
use glam::{Vec2, Vec3};
use shadowscope::frame::{Ask, Renderer};
use shadowscope::light::Light;
use shadowscope::scene::{Camera, Filter, Material, Minified, Scene, Texture, Wrap, gltf::load};
use shadowscope::setup::Setup;
use shadowscope::techniques;
use std::path::Path;
use std::sync::Arc;

/// How a technique is drawn with a masked card over a floor, over all pixels of the floor that lie off the edges of its
/// shadow: all must have the light that `lit` says.
fn check(file: &str, lights: &[Light], lit: impl Fn(Vec2, Vec3) -> Option<bool>, there: impl Fn(Vec2) -> bool) {
    let scene = load(&Path::new("tests/data/gltf").join(file)).unwrap();
    let origin = scene.origin.as_vec3();
    let (mut r, mut s) = start(scene, [160, 120]);
    s.camera = Camera::new(Vec3::new(2.5, 6.0, 4.0) - origin, -origin, 40.0, 0.1, 50.0);
    for light in lights {
        s.light = *light;
        let to_light = match s.light {
            Light::Omni { ref mut position, .. } => {
                *position -= origin;
                *position + origin
            }
            _ => light.axis() * -1e6,
        };
        // Every way to draw casters, and rays.
        for (id, sets) in [
            ("rt-hard", &[][..]),
            ("shadow-map", &[]),
            ("pssm", &[]),
            ("rtw", &["raster=exact"]),
            ("rtw", &["raster=subdivide"]),
            ("lispsm", &[]),
            ("izb", &[]),
            ("csm-conservative", &[]),
            ("cube", &[]),
            ("dual-paraboloid", &[]),
            ("rtw-paraboloid", &[]),
        ] {
            let info = techniques::find(id).unwrap();
            if info.refuses(&s.light).is_some() {
                continue;
            }
            choose(&mut s, info, 1024, &sets.iter().map(|set| set.to_string()).collect::<Vec<_>>());
            r.render(&s, Ask::of(&s)).unwrap();
            let (visibility, position) = (r.read_visibility().unwrap(), r.read_position().unwrap());
            let mut seen = [0; 2];
            for (v, p) in visibility.iter().zip(&position).filter(|(_, p)| p[3] > 0.0) {
                let p = Vec3::new(p[0], p[1], p[2]) + origin;
                if p.y > 0.6 {
                    assert!(there(Vec2::new(p.x, p.z)), "{id}: the camera sees the card at {p}");
                } else if let Some(lit) = lit(Vec2::new(p.x, p.z), to_light) {
                    assert_eq!(*v > 0.5, lit, "{file}, {id} {sets:?}: visibility {v} at {p}");
                    seen[lit as usize] += 1;
                }
            }
            assert!(seen[0] > 60 && seen[1] > 1000, "{id}: {seen:?}");
        }
    }
}

/// Where light to the floor passes the card, at a height of 1.2.
fn crossing(floor: Vec2, to_light: Vec3) -> Vec2 {
    let way = (to_light - Vec3::new(floor.x, 0.0, floor.y)) / to_light.y;
    floor + Vec2::new(way.x, way.z) * 1.2
}

fn inside(p: Vec2, low: Vec2, high: Vec2) -> Option<bool> {
    let spare = (p - low).min(high - p).min_element();
    // Texels of maps and pixels are smaller.
    (spare.abs() > 0.05).then_some(spare > 0.0)
}

/// A texture of 2 × 2 texels, the first of them clear, under NEAREST: an L with sharp corners.
#[test]
fn nearest_filters_keep_masks_sharp() {
    let lit = |floor: Vec2, to_light: Vec3| {
        let p = crossing(floor, to_light);
        let card = inside(p, Vec2::NEG_ONE, Vec2::ONE)?;
        let hole = inside(p, Vec2::NEG_ONE, Vec2::ZERO)?;
        Some(!card || hole)
    };
    let there = |p: Vec2| p.x > -1e-3 || p.y > -1e-3;
    let lights = [sun(Vec3::new(-0.5, 1.0, 0.2)), lamp(Vec3::new(-1.5, 4.0, 0.5))];
    check("nearest-filter-mask.glb", &lights, lit, there);
}

/// Colours whose alpha falls from 1 to 0 towards +z, under a cutoff of a half.
#[test]
fn alpha_of_vertex_colours_counts_under_mask() {
    let lit = |floor: Vec2, to_light: Vec3| {
        inside(crossing(floor, to_light), Vec2::NEG_ONE, Vec2::new(1.0, 0.0)).map(|card| !card)
    };
    let lights = [sun(Vec3::new(-0.5, 1.0, 0.2)), lamp(Vec3::new(-1.5, 4.0, 0.5))];
    check("vertex-colour-alpha.glb", &lights, lit, |p| p.y < 2e-3);
}

/// A floor from (-1, -1) to (1, 1) seen from straight above, its texture over all of it.
fn floor_seen_from(height: f32, texture: Texture, colors: [glam::Vec4; 4]) -> (Renderer, Setup) {
    use crate::common::{floor, mesh, scene};
    let mut ground = mesh(&floor(Vec2::splat(-1.0), Vec2::splat(1.0), 0.0), 0);
    ground.uvs = ground.positions.iter().map(|p| (Vec2::new(p.x, p.z) + 1.0) / 2.0).collect();
    ground.colors = ground.positions.iter().map(|p| colors[(p.x > 0.0) as usize + 2 * (p.z > 0.0) as usize]).collect();
    let view = Camera::new(Vec3::Y * height, Vec3::ZERO, 60.0, 0.01, 1e4);
    let plain = Material { texture: Some(0), ..crate::common::material(Vec3::ONE) };
    let mut scene: Scene = scene(vec![ground], vec![plain], view, sun(Vec3::Y));
    scene.textures = vec![texture];
    let mut s = Setup::new("test", &scene).unwrap();
    s.size = [96, 96];
    let mut r = Renderer::new(gpu(), Arc::new(scene)).unwrap();
    r.render(&s, Ask::of(&s)).unwrap();
    (r, s)
}

/// The base colours in the picture, with where on the floor they are.
fn albedos(r: &Renderer) -> Vec<(Vec2, [u8; 3])> {
    let (position, surface) = (r.read_position().unwrap(), r.read_surface().unwrap());
    let seen = position.iter().zip(&surface).filter(|(p, _)| p[3] > 0.0);
    seen.map(|(p, words)| {
        let [red, green, blue, _] = words[2].to_le_bytes();
        (Vec2::new(p[0], p[2]), [red, green, blue])
    })
    .collect()
}

/// Columns one texel wide of a large image: scaled down they would be grey.
#[test]
fn large_images_keep_their_texels() {
    let rgba = (0..2048 * 2048).flat_map(|i| [[0; 3], [255; 3]][i % 2].into_iter().chain([255]));
    let texture = Texture { width: 2048, height: 2048, rgba: rgba.collect(), ..Texture::default() };
    // A texel is four pixels wide.
    let (r, _) = floor_seen_from(0.02, texture, [glam::Vec4::ONE; 4]);
    assert_eq!(r.scene_note(), None);
    let mut seen = [0; 2];
    for (place, color) in albedos(&r) {
        let at = (place.x + 1.0) / 2.0 * 2048.0;
        if (at.fract() - 0.5).abs() < 0.15 {
            let white = at as usize % 2;
            assert_eq!(usize::from(color[0] > 130), white, "{color:?} at {at}");
            seen[white] += 1;
        }
    }
    assert!(seen.iter().all(|n| *n > 500), "{seen:?}");
}

#[test]
fn magnified_texels_are_squares_under_nearest() {
    // Three by five texels, no power of two, that wrap around in three ways.
    let rgba: Vec<u8> = (0..15).flat_map(|i| [i * 16, 255 - i * 16, 7 * i, 255]).collect();
    let filter = Filter { magnified_nearest: true, ..Filter::default() };
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let texture = Texture { width: 3, height: 5, rgba: rgba.clone(), wrap: [wrap; 2], filter };
        let (r, _) = floor_seen_from(1.5, texture, [glam::Vec4::ONE; 4]);
        let seen = albedos(&r);
        let mut checked = 0;
        for (place, color) in &seen {
            let at = (*place + 1.0) / 2.0 * Vec2::new(3.0, 5.0);
            if (at - at.round()).abs().min_element() < 0.02 {
                continue;
            }
            let i = at.y as usize * 3 + at.x as usize;
            let expected = &rgba[4 * i..][..3];
            assert!(color.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= 1), "{color:?} for {expected:?} at {at}");
            checked += 1;
        }
        assert!(checked > 2000, "{checked}");
    }
}

/// Black and white texels much smaller than a pixel: one or the other under NEAREST, grey otherwise.
#[test]
fn minified_texels_are_taken_as_the_sampler_says() {
    let rgba: Vec<u8> = (0..64 * 64).flat_map(|i| [if (i % 64 + i / 64) % 2 == 0 { 255 } else { 0 }; 4]).collect();
    for (minified, grey) in [
        (Minified::Nearest, false),
        (Minified::Mean, true),
        (Minified::NearestLevel, true),
        (Minified::MixedLevels, true),
    ] {
        let filter = Filter { magnified_nearest: true, minified };
        let texture = Texture { width: 64, height: 64, rgba: rgba.clone(), wrap: [Wrap::Repeat; 2], filter };
        // A pixel is three texels wide and more.
        let (r, _) = floor_seen_from(5.1, texture, [glam::Vec4::ONE; 4]);
        let seen = albedos(&r);
        let greys = seen.iter().filter(|(_, c)| (100..240).contains(&c[0])).count();
        assert!(seen.len() > 200);
        assert_eq!(greys * 10 > seen.len() * 9, grey, "{minified:?}: {greys} of {}", seen.len());
        assert_eq!(greys == 0, !grey, "{minified:?}: {greys} of {}", seen.len());
    }
}

/// Linear colours at the corners, mixed in between, times the texture's.
#[test]
fn vertex_colours_multiply_the_base_colour() {
    let colors = [[1.0, 1.0, 1.0, 1.0], [0.0, 1.0, 0.5, 1.0], [1.0, 0.04, 0.5, 0.0], [0.25, 0.5, 0.04, 1.0]];
    let colors = colors.map(glam::Vec4::from);
    let white = Texture { width: 1, height: 1, rgba: vec![255; 4], ..Texture::default() };
    let (r, _) = floor_seen_from(1.5, white, colors);
    let linear = |c: u8| {
        let c = c as f32 / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    let seen = albedos(&r);
    assert!(seen.len() > 5000);
    for (place, color) in seen {
        // On the edges of the floor, where one triangle of the two decides.
        let [x, z] = ((place + 1.0) / 2.0).to_array();
        let near = [(x < 0.02).then_some([0, 2, 1]), (z < 0.02).then_some([0, 1, 0])];
        for [from, to, along] in near.into_iter().flatten() {
            let t = if along == 1 { z } else { x };
            let expected = colors[from].lerp(colors[to], t);
            for k in 0..3 {
                assert!((linear(color[k]) - expected[k]).abs() < 0.03, "{color:?} for {expected} at {place}");
            }
        }
    }
}
