//! Shadow maps in two dimensions against Chong's tables, closed forms and brute force.

use glam::DVec2;
use shadowscope::flatland::split::{Part, badness, shared, split, total};
use shadowscope::flatland::{Badness, Film, Flatland, Metric, scenes};

fn film(world: &Flatland) -> Film {
    world.film().expect("something is seen")
}

fn least(film: &Film) -> f64 {
    film.least(Metric::L1).normal
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
    for ((name, world), (best, common)) in scenes::chong().iter().zip(rows) {
        let film = film(world);
        let near = |b: Badness, row: [f64; 3]| {
            let all = [b.worst, b.mean, b.mean_sigma].into_iter().zip(row);
            all.into_iter().for_each(|(x, y)| assert!((x / y - 1.0).abs() < 0.01, "{name}: {b:?}, not {row:?}"));
        };
        near(film.badness(least(&film)), best);
        near(film.badness(film.half_angle()), common);
    }
}

/// Pixels a texel by differences: where the edges of a pixel fall on the film.
#[test]
fn badness_equals_differences() {
    for (name, world) in scenes::chong() {
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
    for (name, world) in scenes::chong() {
        let film = film(&world);
        let [low, high] = film.valid();
        let lowest = film.badness(least(&film)).mean;
        let brute =
            (1..20_000).map(|k| film.badness(low + (high - low) * k as f64 / 20_000.0).mean).fold(f64::MAX, f64::min);
        assert!(film.is_valid(least(&film)) && (lowest / brute - 1.0).abs() < 1e-3, "{name}: {lowest}, {brute}");
        let p = world.perspective(&film, 1.0).expect("a near line");
        for x in [p.near_line, p.texels] {
            let b = film.badness(x);
            assert!(film.is_valid(x) && b.mean >= lowest * (1.0 - 1e-9), "{name}: {b:?} beats {lowest}");
        }
    }
}

/// The film that stands for a perspective shadow map has its texels where the map has them.
#[test]
fn a_perspective_map_is_a_film() {
    // A lamp far off on the line through the eye across the view is parallel light there: on one plane all pixels get
    // equally many texels, whatever else is chosen.
    let [(_, mut world), ..] = scenes::chong();
    let side = DVec2::from_angle(world.gaze).perp();
    world.light = world.eye + side * 6.0 - DVec2::from_angle(world.gaze) * 1e-6;
    let film = film(&world);
    let b = film.badness(world.perspective(&film, 1.0).unwrap().texels);
    assert!(b.worst / b.mean < 1.001, "{b:?}");
    assert!((b.mean / film.badness(least(&film)).mean - 1.0).abs() < 1e-3, "{b:?}");
}

/// By each metric the film found is the best of all, in worlds that nobody chose, and Newton's method is there at once.
#[test]
fn the_best_films_are_the_best() {
    let mut slow = 0;
    for number in 0..1000 {
        let film = film(&scenes::random(number));
        let [low, high] = film.valid();
        for metric in Metric::ALL {
            let least = film.least(metric);
            assert!(film.is_valid(least.normal), "{number} {metric:?}");
            let own = film.error(metric, least.normal);
            for k in 1..400 {
                let brute = film.error(metric, low + (high - low) * k as f64 / 400.0);
                assert!(own <= brute * (1.0 + 1e-6), "{number} {metric:?}: {own} is above {brute}");
            }
            slow += (least.steps > 6) as usize;
        }
    }
    assert!(slow <= 50, "{slow} of 1000 took more than 6 steps");
}

/// Newton's method in the angle itself comes to the same film, where it comes to one.
#[test]
fn newtons_method_by_angle_agrees() {
    let mut found = 0;
    for number in 0..200 {
        let film = film(&scenes::random(number));
        if let Some((least, _)) = film.least_square_by_angle() {
            let [a, b] = [least.normal, film.least(Metric::L2).normal].map(|x| film.error(Metric::L2, x));
            assert!((a / b - 1.0).abs() < 1e-3, "{number}: {a}, {b}");
            found += 1;
        }
    }
    assert!(found > 190, "{found} of 200");
}

/// Chong's first theorem: parallel to the line from the light to where the plane meets the one through the eye across the view,
/// the film gives a plane the same pixels a texel everywhere.
#[test]
fn a_single_plane_has_a_film_of_its_own() {
    let mut tried = 0;
    for number in 0..300 {
        let world = scenes::random(number);
        let film = film(&world);
        for segment in 0..world.segments.len() {
            let normal = film.of_plane(&world, segment);
            let on: Vec<f64> = film
                .samples
                .iter()
                .zip(film.footprints(normal))
                .filter_map(|(s, b)| (s.segment == segment).then_some(b))
                .collect();
            if on.len() < 5 || !film.is_valid(normal) {
                continue;
            }
            let (low, high) = on.iter().fold((f64::MAX, 0f64), |(low, high), b| (low.min(*b), high.max(*b)));
            assert!(high / low < 1.001, "{number}, segment {segment}: {low} to {high}");
            tried += 1;
        }
    }
    assert!(tried > 200, "{tried} planes");
}

/// Chong's third proposition: with the light on the line through the eye across the view and the film parallel to it, every
/// polygon has its own constant; with the light elsewhere no film does that for all.
#[test]
fn a_miners_headlamp_is_constant_on_each_polygon() {
    let spread = |world: &Flatland, film: &Film, normal: f64| {
        let mut of = vec![[f64::MAX, 0f64]; world.segments.len()];
        for (s, b) in film.samples.iter().zip(film.footprints(normal)) {
            let [low, high] = &mut of[s.segment];
            (*low, *high) = (low.min(b), high.max(b));
        }
        of.into_iter().map(|[low, high]| if high > 0.0 { high / low } else { 1.0 }).fold(1.0, f64::max)
    };
    let mut tried = 0;
    for number in 0..100 {
        let mut world = scenes::random(number);
        world.light = world.eye + world.forward().perp() * 1.5;
        let Some(film) = world.film().filter(|film| film.is_valid(world.gaze)) else {
            continue;
        };
        assert!(spread(&world, &film, world.gaze) < 1.001, "{number}");
        tried += 1;
        world.light += world.forward() * 2.0;
        if let Some(film) = world.film().filter(|film| film.is_valid(world.gaze)) {
            assert!(spread(&world, &film, world.gaze) > 1.001, "{number}, moved");
        }
    }
    assert!(tried > 50, "{tried}");
}

/// Texels are shared out as well as by trying all ways, and a share of real numbers is never worse than one of whole ones.
#[test]
fn texels_go_where_they_help() {
    for number in 0..200u64 {
        let error = |k: u64| ((number * 7919 + k * 104_729) % 1000) as f64 / 100.0;
        let errors = [error(1), error(2), error(3)];
        for (metric, power) in [(Metric::L1, 1), (Metric::L2, 2)] {
            let of = |lexels: &[usize]| {
                errors
                    .iter()
                    .zip(lexels)
                    .filter(|(e, _)| **e > 0.0)
                    .map(|(e, x)| e / (*x as f64).powi(power))
                    .sum::<f64>()
            };
            let mine = shared(&errors, metric, 12);
            assert_eq!(mine.iter().sum::<usize>(), 12, "{errors:?}");
            assert!(errors.iter().zip(&mine).all(|(e, x)| (*e > 0.0) == (*x > 0)), "{errors:?}: {mine:?}");
            for a in 0..=12 {
                for b in 0..=12 - a {
                    let way = [a, b, 12 - a - b];
                    assert!(of(&mine) <= of(&way) * (1.0 + 1e-12), "{errors:?}: {mine:?} is worse than {way:?}");
                }
            }
            let real = total(power as f64, errors.into_iter()) / 12f64.powi(power);
            assert!(real <= of(&mine) * (1.0 + 1e-12), "{errors:?}: {real}");
        }
    }
}

/// Parts cover the light's directions once, in order, lose no pixel and keep to the texels there are; more of them help, most of all
/// where a panel points at the light.
#[test]
fn parts_share_the_light() {
    for (name, world) in scenes::chong() {
        let film = film(&world);
        for metric in [Metric::L1, Metric::L2] {
            let parts: Vec<Part> = split(&film, metric, 3, 16);
            assert!(parts.len() == 3 && parts[0].hull[0] == film.bottom && parts[2].hull[1] == film.top, "{name}");
            assert!(parts.windows(2).all(|two| two[0].hull[1] == two[1].hull[0]), "{name}");
            assert_eq!(parts.iter().map(|p| p.lexels).sum::<usize>(), world.lexels, "{name}");
            let seen: usize = parts.iter().filter_map(|p| film.part(p.hull)).map(|own| own.samples.len()).sum();
            assert_eq!(seen, film.samples.len(), "{name}");
        }
        let whole = split(&film, Metric::L1, 1, 1);
        assert!((badness(&film, &whole).mean / film.badness(least(&film)).mean - 1.0).abs() < 1e-9, "{name}");
    }
    let [.., (_, world)] = scenes::chong();
    let film = film(&world);
    let gain = film.badness(least(&film)).mean / badness(&film, &split(&film, Metric::L1, 2, 16)).mean;
    assert!((2.0..3.0).contains(&gain), "{gain}");
}

/// Where a part has a single pixel, at its very edge, its film is valid still and its error a number; and each part that a pixel looks at has a
/// texel.
#[test]
fn parts_of_single_pixels_have_films() {
    let worlds = (0..200).map(scenes::random).chain(scenes::chong().map(|(_, world)| world));
    for (number, world) in worlds.enumerate() {
        let film = film(&world);
        for metric in [Metric::L1, Metric::L2] {
            for part in split(&film, metric, 8, 16) {
                let Some(own) = film.part(part.hull) else {
                    assert_eq!((part.error, part.lexels), (0.0, 0));
                    continue;
                };
                assert!(own.is_valid(part.normal), "{number}: {part:?}");
                assert!(part.error.is_finite() && part.error > 0.0 && part.lexels > 0, "{number}: {part:?}");
            }
        }
    }
}

/// What the light sees edge-on spans no film; and there are no more parts than texels.
#[test]
fn worlds_without_room_for_a_film() {
    let [(_, mut world), ..] = scenes::chong();
    world.lexels = 2;
    assert_eq!(split(&film(&world), Metric::L1, 4, 16).iter().map(|p| p.lexels).sum::<usize>(), 2);
    (world.eye, world.light) = (DVec2::new(0.0, 5.0), DVec2::new(9.0, 10.0));
    world.segments = vec![[DVec2::ZERO, DVec2::new(9.0, 10.0)]];
    assert!(world.film().is_none());
}

/// What is written is read again, and what cannot be is told.
#[test]
fn worlds_are_files() {
    for (_, world) in scenes::chong() {
        let again = Flatland::from_toml(&world.to_toml().unwrap()).unwrap();
        assert_eq!((again.segments, again.light, again.pixels), (world.segments, world.light, world.pixels));
        assert!((again.gaze - world.gaze).abs() < 1e-9 && (again.fov - world.fov).abs() < 1e-9);
    }
    let good = "eye = [0, 2]\ngaze = -10\nfov = 40\nlight = [3, 9]\nsegments = [[-5, 0, 9, 0]]\n";
    assert!(Flatland::from_toml(good).is_ok());
    for (from, to, told) in [
        ("fov = 40", "fov = 180", "fov = 180: it goes from 1 to 170°"),
        ("light = [3, 9]", "light = [nan, 9]", "NaN is no place"),
        ("light = [3, 9]", "light = [3, 9]\nlexels = 0", "lexels = 0: it goes from 1 to 10000"),
        ("[[-5, 0, 9, 0]]", "[[-5, 0, 9]]", "4"),
        ("gaze = -10", "", "gaze"),
    ] {
        let error = Flatland::from_toml(&good.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(told) && !error.contains('\n'), "{error}");
    }
}

/// The command prints the tables of his scenes, of others and of files, and names what it cannot open.
#[test]
fn the_command_prints_tables() {
    let run = |args: &[&str]| {
        let out =
            std::process::Command::new(env!("CARGO_BIN_EXE_shadowscope")).arg("flatland").args(args).output().unwrap();
        (out.status.success(), String::from_utf8(out.stdout).unwrap(), String::from_utf8(out.stderr).unwrap())
    };
    let (done, text, _) = run(&[]);
    assert!(done && text.matches("\n| least average (L1) |").count() == 4, "{text}");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let [.., (_, world)] = scenes::chong();
    std::fs::write(&file, world.to_toml().unwrap()).unwrap();
    let (done, text, error) = run(&[file.to_str().unwrap(), "--json"]);
    assert!(done, "{error}");
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let average = json[0]["methods"][0]["average"].as_f64().unwrap();
    assert!((average / film(&world).badness(least(&film(&world))).mean - 1.0).abs() < 1e-9, "{average}");
    let (done, _, error) = run(&["nowhere"]);
    assert!(!done && error.contains("neither a scene of flatland"), "{error}");
    std::fs::write(&file, "eye = 3").unwrap();
    let (done, _, error) = run(&[file.to_str().unwrap()]);
    assert!(!done && error.contains("is no world of flatland"), "{error}");
}
