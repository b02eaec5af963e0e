//! Worlds and settings to begin with: figures of Chong 2003, his scenes, worlds by chance.

use super::{Charted, Choice, Origin, Show, Spans, State};
use crate::flatland::{Flatland, Metric, scenes};
use glam::DVec2;

/// A state of the lab with a name, and what is to be seen in it.
pub struct Figure {
    pub name: &'static str,
    pub text: &'static str,
    make: fn() -> State,
}

impl Figure {
    pub fn state(&self) -> State {
        let number = FIGURES.iter().position(|f| f.name == self.name);
        State { origin: number.map_or(Origin::Own, Origin::Figure), ..(self.make)() }
    }
}

/// A floor without end.
const FLOOR: [f64; 4] = [-1e6, 0.0, 1e6, 0.0];

fn world(gaze: f64, fov: f64, light: [f64; 2], segments: &[[f64; 4]]) -> Flatland {
    Flatland {
        eye: DVec2::new(0.0, 2.0),
        gaze: gaze.to_radians(),
        fov: fov.to_radians(),
        light: light.into(),
        segments: segments.iter().map(|[a, b, c, d]| [DVec2::new(*a, *b), DVec2::new(*c, *d)]).collect(),
        pixels: 100,
        lexels: 100,
    }
}

/// One of Chong's scenes with its best film.
fn scene(number: usize) -> State {
    State::of(scenes::chong()[number].1.clone())
}

/// A world by chance.
pub fn random(number: u64) -> State {
    State { origin: Origin::Chance(number), ..State::of(scenes::random(number)) }
}

pub const FIGURES: [Figure; 9] = [
    Figure {
        name: "1.5: the angle decides where lexels fall",
        text: "Even steps on the film line are uneven steps on the floor. Turn the line by its round handle: lexels crowd \
               where the line reaches away from the light.",
        make: || {
            let mut s = State::of(world(-24.0, 36.0, [8.0, 9.0], &[FLOOR]));
            s.film = Choice::Hand;
            s.normal = -60f64.to_radians();
            s.show.spans = Spans::Lexels;
            s.show.all_films = false;
            s
        },
    },
    Figure {
        name: "2.1: the best film for one plane",
        text: "Dashed: from the eye across the view to the floor's line, and from there to the light. A film parallel to that \
               gives all pixels of the floor equal lexels. Drag light or eye: it stays so.",
        make: || {
            let mut s = State::of(world(-24.0, 36.0, [4.0, 8.0], &[FLOOR]));
            s.film = Choice::Plane(0);
            s
        },
    },
    Figure {
        name: "2.2: a light in the view's plane",
        text: "This light lies across the view: after the perspective its rays run parallel. Each polygon has even lexels, but \
               what faces the eye gets few. Uncheck Post-perspective to turn the film.",
        make: || {
            let segments =
                [[3.0, 0.5, 9.0, 0.5], [9.0, 0.5, 11.5, 2.2], [11.5, 2.2, 15.0, 2.2], [15.0, 2.2, 15.3, 8.5]];
            let mut s = State::of(world(0.0, 50.0, [0.0, 9.0], &segments));
            s.film = Choice::Plane(0);
            s.show.post = true;
            s
        },
    },
    Figure {
        name: "2.3: the near line of a perspective map",
        text: "Move push: the near line stays parallel here, but in the world it turns, about a point across from the eye. The \
               map's own texels do not: compare both rows below.",
        make: || {
            let segments = [[-1e6, 0.0, 14.0, 0.0], [14.0, 0.0, 14.0, 5.0]];
            let mut s = State::of(world(-20.0, 40.0, [10.0, 6.0], &segments));
            s.film = Choice::NearLine;
            s.push = 0.6;
            s.show.post = true;
            s
        },
    },
    Figure {
        name: "4.1: a film from few samples",
        text: "The film is chosen from 10 of 1000 pixels. The chart on the right says what that adds to the error; drag its line. \
               Try L2, and other scenes.",
        make: || {
            let mut s = scene(2);
            s.world.pixels = 1000;
            s.few = Some(10);
            s.show.chart = Charted::Added;
            s
        },
    },
    Figure {
        name: "scene: single plane",
        text: "A floor alone. The best film makes all pixels alike (theorem 1); the common one gives the far floor what the near \
               floor lacks.",
        make: || scene(0),
    },
    Figure {
        name: "scene: simple geometry",
        text: "A floor and a wall, lit from above the camera. The common film is nearly as good as the best; the near line of a \
               perspective map is not.",
        make: || scene(1),
    },
    Figure {
        name: "scene: light from top",
        text: "The wall fills the picture but few of the light's directions. The best film is close to the last valid angle: \
               stretch the chart's axis to see it.",
        make: || scene(2),
    },
    Figure {
        name: "scene: projection aliasing",
        text: "Two walls lie nearly along the light's rays. No film serves them and the floor: give the light two frusta.",
        make: || scene(3),
    },
];

impl State {
    /// A world with its best film by L1.
    pub fn of(world: Flatland) -> State {
        State {
            world,
            film: Choice::Least(Metric::L1),
            normal: 0.0,
            push: 1.0,
            few: None,
            frusta: 1,
            first: crate::flatland::table::FIRST,
            show: Show {
                pixel_rays: true,
                lexel_rays: true,
                spans: Spans::Pixels,
                all_films: true,
                post: false,
                stretched: false,
                chart: Charted::Footprints,
            },
            origin: Origin::Own,
        }
    }
}
