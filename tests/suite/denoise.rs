//! A few rays a pixel and what the filter makes of them, against many.

use crate::common::*;
use crate::light_size::wide_sun;
use glam::{Mat4, Vec2, Vec3};
use shadowscope::frame::{Ask, History, Renderer, Truth};
use shadowscope::light::Light;
use shadowscope::measure;
use shadowscope::measure::metrics::FACING;
use shadowscope::scene::Camera;
use shadowscope::setup::Setup;
use shadowscope::truth::Samples;

const SIZE: [u32; 2] = [120, 90];

/// A sun 4° in radius, `turn` degrees on from where it starts.
pub fn sun_at(turn: f32) -> Light {
    let (sine, cosine) = (0.6 + turn.to_radians()).sin_cos();
    wide_sun(Vec3::new(cosine, 1.1, sine), 4.0)
}

/// The yard from near by, so that penumbras are some pixels wide.
fn near() -> Camera {
    Camera { fov: 45.0, ..camera(Vec3::new(-1.5, 4.0, 5.5), Vec3::new(-1.2, 0.3, -0.3)) }
}

pub fn in_the_yard(light: Light) -> (Renderer, Setup) {
    start(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], near(), light), SIZE)
}

/// A floor under a lid 2 m above it that covers x < 0, seen from between them; the sun, 4° in radius, `turn` degrees from the
/// zenith. The penumbra is some 25 pixels wide, and moves by 1.1 pixels for each 0.4°.
fn under_a_lid() -> (Renderer, Setup) {
    let mut triangles = floor(Vec2::splat(-20.0), Vec2::splat(20.0), 0.0);
    triangles.extend(floor(Vec2::splat(-20.0), Vec2::new(0.0, 20.0), 2.0));
    let view = camera(Vec3::new(0.0, 1.2, 0.3), Vec3::ZERO);
    start(scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, above(0.0)), SIZE)
}

fn above(turn: f32) -> Light {
    let (sine, cosine) = turn.to_radians().sin_cos();
    wide_sun(Vec3::new(sine, cosine, 0.0), 4.0)
}

/// A frame's visibility.
fn frame(r: &mut Renderer, s: &Setup, history: History) -> Vec<f32> {
    r.render(s, Ask { picture: false, truth: Truth::Off, history, ..ask(s) }).unwrap();
    r.read_visibility().unwrap()
}

/// The mean over many rays, and which pixels can be wrong.
fn many(r: &mut Renderer, s: &Setup, samples: u32) -> Vec<f32> {
    let mut s = s.clone();
    select(&mut s, "rt-soft", &[&format!("samples={samples}")]);
    frame(r, &s, History::Whole)
}

fn rmse(r: &mut Renderer, seen: &[f32], truth: &[f32]) -> f64 {
    let mask = r.read_mask().unwrap();
    let squares = (seen.iter().zip(truth).zip(&mask)).filter(|(_, m)| **m == FACING);
    let squares: Vec<f64> = squares.map(|((v, t), _)| ((v - t) as f64).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// With a still camera errors fall from frame to frame and level off: without neighbours at what the newest frame's weight leaves of
/// its noise, with them at what they blur. One frame with neighbours is better than one without.
#[test]
fn errors_fall_to_a_floor() {
    let (mut r, mut s) = under_a_lid();
    let truth = many(&mut r, &s, 1024);
    let mut errors = |sets: &[&str]| {
        select(&mut s, "rt-denoise", sets);
        let mut all = Vec::new();
        for k in 0..64 {
            let seen = frame(&mut r, &s, if k == 0 { History::Starts } else { History::Goes });
            all.push(rmse(&mut r, &seen, &truth));
        }
        println!("{sets:?}: {:.4} {:.4} {:.4} {:.4}", all[0], all[3], all[15], all[63]);
        // Of blue noise from frame to frame some number's frames are better than others'.
        let floor = all[48..].iter().sum::<f64>() / 16.0;
        let settled = 64 - all.iter().rev().take_while(|e| **e < 1.1 * floor).count();
        println!("  floor {floor:.4}, below 1.1 of it from frame {} on", settled + 1);
        (all, floor)
    };
    let more = ["frames=64", "denoiser=off"];
    let (alone, alone_floor) = errors(&more);
    assert!(alone[3] < 0.6 * alone[0] && alone[15] < 0.7 * alone[3] && alone_floor < 0.2 * alone[0]);
    // Noise of white rays: of a frame with the weight 1/20 remains √(1/39).
    let (white, floor) = errors(&["frames=64", "denoiser=off", "sequence=white"]);
    assert!((floor / white[0] / (1.0f64 / 39.0).sqrt() - 1.0).abs() < 0.15, "{floor} of {}", white[0]);
    for denoiser in ["ffx", "svgf"] {
        let denoiser = format!("denoiser={denoiser}");
        let (with, floor) = errors(&["frames=64", &denoiser]);
        assert!(with[0] < 0.5 * alone[0], "one frame, {denoiser}");
        assert!(floor < 0.8 * with[0], "{denoiser}: {floor}");
    }
}

/// Each sequence, number of rays and number of frames comes to the mean over the light.
#[test]
fn frames_alone_come_to_the_mean() {
    let (mut r, mut s) = in_the_yard(sun_at(0.0));
    let truth = many(&mut r, &s, 1024);
    for sequence in ["white", "ign", "blue", "r2"] {
        for (rays, bound) in [(1, 0.25), (8, 0.12)] {
            let mut off = [1, 16].map(|frames| {
                let sets = [
                    format!("sequence={sequence}"),
                    format!("rays={rays}"),
                    format!("frames={frames}"),
                    "denoiser=off".into(),
                ];
                select(&mut s, "rt-denoise", &sets.each_ref().map(String::as_str));
                let seen = frame(&mut r, &s, History::Whole);
                rmse(&mut r, &seen, &truth)
            });
            println!("{sequence}, {rays} rays: {off:.4?}");
            off[1] *= 3.0;
            assert!(off[0] < bound && off[1] < off[0], "{sequence}, {rays} rays: {off:?}");
        }
    }
}

/// Without neighbours a light without a size gives the hard shadow, exactly, however many frames and rays.
#[test]
fn a_point_gives_the_hard_shadow() {
    for light in [sun(Vec3::new(0.5, 1.0, 0.3)), lamp(Vec3::new(-0.5, 3.0, 2.0))] {
        let (mut r, mut s) = in_the_yard(light);
        select(&mut s, "rt-hard", &[]);
        let hard = frame(&mut r, &s, History::Whole);
        for sets in [["denoiser=off", "frames=1"], ["denoiser=off", "frames=16"], ["denoiser=off", "rays=8"]] {
            select(&mut s, "rt-denoise", &sets);
            assert!(frame(&mut r, &s, History::Whole) == hard, "{sets:?}, {}", light.kind());
        }
    }
}

/// What is far from all penumbras is exactly lit or dark, its tiles are skipped, and they are most.
#[test]
fn what_is_all_lit_or_all_dark_stays() {
    let (mut r, mut s) = under_a_lid();
    s.light = wide_sun(Vec3::Y, 2.0);
    let truth = many(&mut r, &s, 256);
    // Along each row, how many pixels it is to the nearest penumbra.
    let [width, height] = SIZE.map(|s| s as usize);
    let partly = |i: usize| truth[i] > 0.0 && truth[i] < 1.0;
    let far = |i: usize, by: i32| {
        let [x, y] = [(i % width) as i32, (i / width) as i32];
        let near = |dx: i32, dy: i32| {
            let at = [x + dx, y + dy];
            let inside = at[0] >= 0 && at[1] >= 0 && at[0] < width as i32 && at[1] < height as i32;
            inside && partly(at[1] as usize * width + at[0] as usize)
        };
        !(-by..=by).any(|dx| (-by..=by).any(|dy| near(dx, dy)))
    };
    let mut skipped_by = Vec::new();
    for denoiser in ["ffx", "svgf"] {
        select(&mut s, "rt-denoise", &[&format!("denoiser={denoiser}"), "feedback=false"]);
        s.view = "tile-classes".into();
        let seen = frame(&mut r, &s, History::Whole);
        let kinds = r.read_map().unwrap();
        let (mut lit, mut dark, mut skipped) = (0, 0, 0);
        for i in 0..seen.len() {
            // 14 pixels: what svgf reaches.
            if far(i, 15) {
                assert_eq!(seen[i], truth[i], "{denoiser}, pixel {i}");
                *if seen[i] == 1.0 { &mut lit } else { &mut dark } += 1;
            }
            if kinds[i] as u32 != 2 {
                skipped += 1;
                assert!(seen[i] == (kinds[i] as u32 == 1) as u32 as f32, "{denoiser}, pixel {i}: {}", kinds[i]);
            }
        }
        assert!(lit > 1000 && dark > 1000, "{denoiser}: {lit} lit, {dark} dark");
        println!("{denoiser}: {skipped} of {} pixels skipped", seen.len());
        skipped_by.push(skipped);
    }
    assert!(skipped_by[0] > 3000 && skipped_by[1] == 0, "{skipped_by:?}");
}

/// Where a step of the camera reveals surfaces history starts anew, and goes on elsewhere.
#[test]
fn revealed_surfaces_start_anew() {
    let (mut r, mut s) = in_the_yard(sun_at(0.0));
    select(&mut s, "rt-denoise", &["denoiser=svgf"]);
    let here = s.camera;
    frame(&mut r, &s, History::Whole);
    let (old, aspect) = (r.read_position().unwrap(), SIZE[0] as f32 / SIZE[1] as f32);
    let project: Mat4 = here.projection(aspect) * here.view();
    s.camera.position += Vec3::new(0.5, 0.1, 0.0);
    s.view = "disocclusion".into();
    frame(&mut r, &s, History::Goes);
    let (map, mask, new) = (r.read_map().unwrap(), r.read_mask().unwrap(), r.read_position().unwrap());
    let (mut revealed, mut kept, mut wrong) = (0, 0, 0);
    for (i, p) in new.iter().enumerate().filter(|(i, _)| mask[*i] == FACING) {
        let p = Vec3::from_slice(p);
        let clip = project.project_point3(p);
        let place = (Vec2::new(clip.x, -clip.y) * 0.5 + 0.5) * Vec2::new(SIZE[0] as f32, SIZE[1] as f32) - 0.5;
        // Clearly hidden, or out of the picture: no pixel of 3 × 3 around is near. Clearly seen: all are.
        let (mut near, mut all) = (0, 0);
        for k in 0..9 {
            let at = place.round() + Vec2::new((k % 3) as f32 - 1.0, (k / 3) as f32 - 1.0);
            all += 1;
            if at.min_element() >= 0.0 && at.x < SIZE[0] as f32 && at.y < SIZE[1] as f32 {
                let q = &old[at.y as usize * SIZE[0] as usize + at.x as usize];
                let apart = (Vec3::from_slice(q) - p).length();
                near += (q[3] > 0.0 && apart < 0.35) as usize;
            }
        }
        let anew = map[i] as u32 == 0;
        if near == 0 {
            revealed += 1;
            wrong += !anew as usize;
        } else if near == all {
            kept += 1;
            wrong += anew as usize;
        }
    }
    println!("{revealed} revealed, {kept} kept, {wrong} wrong");
    assert!(revealed > 200 && kept > 5000, "{revealed} revealed, {kept} kept");
    assert!(wrong * 200 < revealed + kept, "{wrong} wrong");
    // At rest nothing is.
    frame(&mut r, &s, History::Goes);
    let map = r.read_map().unwrap();
    assert!(map.iter().zip(&mask).all(|(v, m)| *m != FACING || *v as u32 == 2));
}

/// History follows the camera: after steps through the yard the picture is not much worse than one at rest, and without neighbours
/// far better than a frame alone.
#[test]
fn history_follows_the_camera() {
    let (mut r, mut s) = in_the_yard(sun_at(0.0));
    let here = s.camera;
    let mut walk = |sets: &[&str]| {
        select(&mut s, "rt-denoise", sets);
        s.camera = here;
        frame(&mut r, &s, History::Whole);
        for _ in 0..8 {
            s.camera.position += Vec3::new(0.031, 0.013, -0.02);
            s.camera.target += Vec3::new(0.017, 0.0, 0.01);
            frame(&mut r, &s, History::Goes);
        }
        let seen = r.read_visibility().unwrap();
        let truth = many(&mut r, &s, 1024);
        let walked = rmse(&mut r, &seen, &truth);
        select(&mut s, "rt-denoise", sets);
        let seen = frame(&mut r, &s, History::Whole);
        let rested = rmse(&mut r, &seen, &truth);
        println!("{sets:?}: {walked:.4}, at rest {rested:.4}");
        [walked, rested]
    };
    let alone = walk(&["denoiser=off", "history=false"]);
    let [walked, _] = walk(&["denoiser=off"]);
    assert!(walked < 0.5 * alone[0], "{walked} of {alone:?}");
    for denoiser in ["denoiser=ffx", "denoiser=svgf"] {
        let [walked, rested] = walk(&[denoiser]);
        assert!(walked < 1.7 * rested, "{denoiser}: {walked}, at rest {rested}");
    }
}

/// Without history a frame knows nothing of those before, and with it it does. So many frames one by one are the picture at once,
/// and pictures repeat.
#[test]
fn history_goes_from_frame_to_frame() {
    let (mut r, mut s) = in_the_yard(sun_at(0.0));
    let [this, other] = [sun_at(0.0), sun_at(40.0)];
    for denoiser in ["off", "ffx", "svgf"] {
        let denoiser = format!("denoiser={denoiser}");
        let mut after = |light: Light, history: &str| {
            select(&mut s, "rt-denoise", &[&denoiser, history]);
            s.light = light;
            frame(&mut r, &s, History::Starts);
            s.light = this;
            frame(&mut r, &s, History::Goes)
        };
        assert!(after(this, "history=false") == after(other, "history=false"), "{denoiser}");
        assert!(after(this, "history=true") != after(other, "history=true"), "{denoiser}");
        select(&mut s, "rt-denoise", &[&denoiser, "frames=7"]);
        let whole = frame(&mut r, &s, History::Whole);
        assert!(frame(&mut r, &s, History::Whole) == whole, "{denoiser}");
        let mut one = frame(&mut r, &s, History::Starts);
        for _ in 1..7 {
            one = frame(&mut r, &s, History::Goes);
        }
        assert!(one == whole, "{denoiser}");
    }
}

/// Under a light that turns shadows lag behind, less where history is clamped more; and after a leap the picture settles.
#[test]
fn shadows_lag_behind_a_light_that_turns() {
    let (mut r, mut s) = under_a_lid();
    // Degrees a frame: 6 and 24 a second at 60 frames a second.
    for step in [0.1, 0.4] {
        let truths: Vec<Vec<f32>> = (0..=24)
            .map(|lag| {
                s.light = above(step * (40 - lag) as f32);
                many(&mut r, &s, 64)
            })
            .collect();
        let mut lag_of = |sets: &[&str]| {
            select(&mut s, "rt-denoise", sets);
            let mut seen = Vec::new();
            for k in 0..=40 {
                s.light = above(step * k as f32);
                seen = frame(&mut r, &s, if k == 0 { History::Starts } else { History::Goes });
            }
            let off: Vec<f64> = truths.iter().map(|t| rmse(&mut r, &seen, t)).collect();
            let lag = (0..off.len()).min_by(|a, b| off[*a].total_cmp(&off[*b])).unwrap();
            println!("{step}° a frame, {sets:?}: {lag} frames behind, rmse {:.4}, {:.4} there", off[0], off[lag]);
            (lag, off[0])
        };
        let alone = lag_of(&["denoiser=off"]);
        let svgf = lag_of(&["denoiser=svgf"]);
        let wide = lag_of(&["denoiser=ffx", "clamp_k=2.0"]);
        let ffx = lag_of(&["denoiser=ffx"]);
        let tight = lag_of(&["denoiser=ffx", "clamp_k=0.25"]);
        let none = lag_of(&["denoiser=ffx", "history=false"]);
        assert!(alone.0 >= 8 && svgf.0 >= 8, "{alone:?} {svgf:?}");
        assert!(none.0 <= 1 && tight.0 <= ffx.0 && ffx.0 <= wide.0 && ffx.0 < alone.0, "{tight:?} {ffx:?} {wide:?}");
    }
    // A leap: the frames until the error is near that at rest.
    let truth = {
        s.light = above(12.0);
        many(&mut r, &s, 1024)
    };
    select(&mut s, "rt-denoise", &["denoiser=ffx"]);
    s.light = above(0.0);
    frame(&mut r, &s, History::Whole);
    s.light = above(12.0);
    let all: Vec<f64> = (0..96)
        .map(|_| {
            let seen = frame(&mut r, &s, History::Goes);
            rmse(&mut r, &seen, &truth)
        })
        .collect();
    let floor = all[80..].iter().sum::<f64>() / 16.0;
    let settled = 97 - all.iter().rev().take_while(|e| **e < 1.1 * floor).count();
    println!("leap: {:.4}, then {floor:.4}; below 1.1 of it from frame {settled} on", all[0]);
    assert!(settled <= 16, "{settled}");
}

/// What is measured over time: rays alone are settled at once and not behind; frames that are averaged take longer and lag.
#[test]
fn settling_and_lag_are_measured() {
    let (mut r, mut s) = under_a_lid();
    s.size = [60, 45];
    s.truth_samples = Samples::Fixed(16);
    let more = measure::More { temporal: true, ..Default::default() };
    let mut of = |id: &str, sets: &[&str]| {
        let mut setup = s.clone();
        select(&mut setup, id, sets);
        let mut found = None;
        measure::run(&mut r, &setup, &[(0, setup.clone())], 1, more, &mut |step| {
            if let measure::Step::Row(row) = step {
                // Not at the end yet is later than all frames.
                found = Some([row.settle_frames.unwrap_or(65), row.lag_frames.unwrap()]);
            }
            true
        })
        .unwrap();
        found.unwrap()
    };
    let rays = of("rt-soft", &["samples=16"]);
    let [clamped, averaged] = ["denoiser=ffx", "denoiser=off"].map(|denoiser| of("rt-denoise", &[denoiser]));
    println!("settle, lag: rays {rays:?}, clamped {clamped:?}, averaged {averaged:?}");
    assert!(rays[1] == 0 && rays[0] <= 2, "{rays:?}");
    assert!(clamped[0] > 2 && averaged[0] > clamped[0], "{clamped:?} {averaged:?}");
    assert!(averaged[1] > clamped[1] && averaged[1] >= 8, "{clamped:?} {averaged:?}");
}

/// Seeds shift every sequence of rays, so that noise is told from bias.
#[test]
fn seeds_turn_every_sequence() {
    let (mut r, mut s) = under_a_lid();
    s.size = [48, 36];
    s.truth_samples = Samples::Fixed(16);
    let more = measure::More { seeds: 3, ..Default::default() };
    for sequence in ["blue", "ign", "white", "r2"] {
        let mut setup = s.clone();
        select(&mut setup, "rt-denoise", &["frames=1", &format!("sequence={sequence}")]);
        let mut noise = None;
        measure::run(&mut r, &setup, &[(0, setup.clone())], 1, more, &mut |step| {
            if let measure::Step::Row(row) = step {
                noise = row.seed_noise;
            }
            true
        })
        .unwrap();
        assert!(noise.unwrap() > 1e-3, "{sequence}: {noise:?}");
    }
}
