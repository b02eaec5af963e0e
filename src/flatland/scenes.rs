//! Worlds to try things on.

use super::Flatland;
use crate::scene::builtin::builder::random::Rng;
use glam::DVec2;

/// A floor without end.
const ENDLESS: f64 = 1e6;

/// Chong's four scenes by name. He printed no coordinates: these were found by search, so that the rows of his tables for
/// his own method and the common shadow map come out.
pub fn chong() -> [(&'static str, Flatland); 4] {
    let scene = |gaze: f64, fov: f64, light: [f64; 2], segments: &[[f64; 4]]| Flatland {
        eye: DVec2::new(0.0, 2.0),
        gaze: gaze.to_radians(),
        fov: fov.to_radians(),
        light: light.into(),
        segments: segments.iter().map(|[a, b, c, d]| [DVec2::new(*a, *b), DVec2::new(*c, *d)]).collect(),
        pixels: 100,
        lexels: 100,
    };
    [
        ("single plane", scene(-14.32, 27.64, [0.01, 8.10], &[[-ENDLESS, 0.0, ENDLESS, 0.0]])),
        (
            "simple geometry",
            scene(-16.49, 34.56, [-0.47, 5.77], &[[-ENDLESS, 0.0, 15.75, 0.0], [15.75, 0.0, 15.75, 6.69]]),
        ),
        (
            "light from top",
            scene(-1.148, 42.19, [6.212, 12.687], &[[-ENDLESS, 0.0, 6.209, 0.0], [6.209, 0.0, 6.232, 5.913]]),
        ),
        (
            "projection aliasing",
            scene(
                -11.105,
                30.281,
                [11.233, 33.94],
                &[[-ENDLESS, 0.0, 15.033, 0.0], [12.299, 0.195, 12.280, 1.779], [15.033, 0.0, 15.145, 2.978]],
            ),
        ),
    ]
}

/// A world that nobody chose, the same for a number at every run: a floor, walls and slopes in view, a lamp above or beside. At
/// least half of the image sees something, and all of that lies before the light.
pub fn random(number: u64) -> Flatland {
    let mut rng = Rng::new(number);
    loop {
        let mut range = |low: f32, high: f32| rng.range(low, high) as f64;
        let mut world = Flatland {
            eye: DVec2::new(0.0, 2.0),
            gaze: range(-35.0, 10.0).to_radians(),
            fov: range(20.0, 75.0).to_radians(),
            light: DVec2::new(range(-6.0, 25.0), range(2.5, 30.0)),
            segments: vec![[DVec2::new(-ENDLESS, 0.0), DVec2::new(range(8.0, 40.0), 0.0)]],
            pixels: 100,
            lexels: 100,
        };
        for _ in 0..range(0.0, 6.0) as usize {
            let from = DVec2::new(range(3.0, 30.0), range(0.0, 6.0));
            let along = DVec2::from_angle(range(-180.0, 180.0).to_radians()) * range(0.5, 8.0);
            world.segments.push([from, from + along]);
        }
        // An end within reach, so that rays near the horizon do not decide everything.
        let wall = world.segments[0][1];
        world.segments.push([wall, wall + DVec2::Y * range(1.0, 15.0)]);
        if world.film().is_some_and(|film| film.samples.len() * 2 >= world.pixels && film.top - film.bottom < 3.0) {
            return world;
        }
    }
}
