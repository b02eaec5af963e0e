//! Shadow maps in two dimensions against Chong's tables, closed forms and brute force.

use shadowscope::flatland::{Badness, Film, Flatland, scenes};

fn film(world: &Flatland) -> Film {
    world.film().expect("something is seen")
}

/// The rows for which the scenes were made: worst, mean, mean and deviation of the best film and the common one.
#[test]
fn the_scenes_give_the_tables_rows() {
    let rows = [
        ([0.99, 0.99, 0.99], [2.07, 1.18, 1.65]),
        ([1.56, 1.10, 1.42], [1.54, 1.10, 1.42]),
        ([8.13, 2.53, 4.08], [72.6, 45.9, 65.3]),
        ([69.0, 18.2, 46.0], [84.8, 22.1, 56.7]),
    ];
    for ((name, world), (best, common)) in scenes().iter().zip(rows) {
        let film = film(world);
        let near = |b: Badness, row: [f64; 3]| {
            let all = [b.worst, b.mean, b.mean_sigma].into_iter().zip(row);
            all.into_iter().for_each(|(x, y)| assert!((x / y - 1.0).abs() < 0.01, "{name}: {b:?}, not {row:?}"));
        };
        near(film.badness(film.least_mean()), best);
        near(film.badness(film.half_angle()), common);
    }
}

/// Pixels a texel by differences: where the edges of a pixel fall on the film.
#[test]
fn badness_equals_differences() {
    for (name, world) in scenes() {
        let film = film(&world);
        let [low, high] = film.valid();
        for x in [0.1, 0.4, 0.7].map(|t| low + (high - low) * t) {
            let (top, bottom) = ((film.top - x).tan(), (film.bottom - x).tan());
            // In texels of the whole film.
            let place = |p: f64| {
                let sample = world.sample(p)?;
                Some(((sample.angle - x).tan() - bottom) / (top - bottom) * world.lexels as f64)
            };
            let each = |i: usize| {
                let (p, e) = (i as f64 + 0.5, 1e-5);
                Some(2.0 * e / (place(p + e)? - place(p - e)?).abs())
            };
            let all: Vec<f64> = (0..world.pixels).filter_map(each).collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            let b = film.badness(x);
            assert!((mean / b.mean - 1.0).abs() < 1e-4, "{name} at {x}: {mean}, {b:?}");
        }
    }
}

/// The closed form finds the least mean of all films, and no perspective shadow map is better.
#[test]
fn nothing_beats_the_closed_form() {
    for (name, world) in scenes() {
        let film = film(&world);
        let [low, high] = film.valid();
        let least = film.badness(film.least_mean()).mean;
        let brute =
            (1..20_000).map(|k| film.badness(low + (high - low) * k as f64 / 20_000.0).mean).fold(f64::MAX, f64::min);
        assert!(film.is_valid(film.least_mean()) && (least / brute - 1.0).abs() < 1e-3, "{name}: {least}, {brute}");
        for x in world.perspective(&film).expect("a near line") {
            let b = film.badness(x);
            assert!(film.is_valid(x) && b.mean >= least * (1.0 - 1e-9), "{name}: {b:?} beats {least}");
        }
    }
}

/// The film that stands for a perspective shadow map has its texels where the map has them.
#[test]
fn a_perspective_map_is_a_film() {
    // A lamp far off on the line through the eye across the view is parallel light there: on one plane all pixels get
    // equally many texels, whatever else is chosen.
    let [(_, mut world), ..] = scenes();
    let side = glam::DVec2::from_angle(world.gaze).perp();
    world.light = world.eye + side * 6.0 - glam::DVec2::from_angle(world.gaze) * 1e-6;
    let film = film(&world);
    let [_, exact] = world.perspective(&film).unwrap();
    let b = film.badness(exact);
    assert!(b.worst / b.mean < 1.001, "{b:?}");
    assert!((b.mean / film.badness(film.least_mean()).mean - 1.0).abs() < 1e-3, "{b:?}");
}
