//! Several lights in a set-up: one picture, one figure each, and what they add up to.

use crate::common::{Random, ask, built_in, gpu, ok, select, shadowscope, spot, start, sun, yard};
use glam::Vec3;
use shadowscope::frame::{Ask, Renderer, Truth, technique_ms};
use shadowscope::light::Light;
use shadowscope::measure::{self, table};
use shadowscope::setup::{Lamp, MOST_LIGHTS, Setup};
use shadowscope::techniques;
use std::path::Path;
use std::sync::Arc;

const SIZE: [u32; 2] = [96, 72];

/// The yard under three lights of different colours: a sun, and two spots.
fn lit() -> (Renderer, Setup) {
    let view = crate::common::camera(Vec3::new(0.0, 5.0, 11.0), Vec3::new(0.0, 0.5, 0.0));
    let mesh = crate::common::mesh(&yard(), 0);
    let scene = crate::common::scene(vec![mesh], vec![crate::common::material(Vec3::splat(0.6))], view, coloured(0));
    let (renderer, mut setup) = start(scene, SIZE);
    select(&mut setup, "pcf", &["resolution=256"]);
    (1..3).for_each(|i| setup.add_light(coloured(i)).unwrap());
    (renderer, setup)
}

fn coloured(i: usize) -> Light {
    match i {
        0 => match sun(Vec3::new(0.4, 1.0, 0.3)) {
            Light::Directional { to_light, angular_radius, .. } => {
                Light::Directional { to_light, angular_radius, color: Vec3::new(0.5, 0.3, 0.1) }
            }
            other => other,
        },
        i => {
            let x = if i == 1 { -5.0 } else { 5.0 };
            let Light::Spot { position, direction, outer_angle, range, radius, .. } =
                spot(Vec3::new(x, 5.0, 3.0), Vec3::ZERO, 40.0)
            else {
                panic!()
            };
            let color = if i == 1 { Vec3::new(2.0, 9.0, 3.0) } else { Vec3::new(3.0, 2.0, 12.0) };
            Light::Spot { position, direction, outer_angle, range, radius, color }
        }
    }
}

/// The light at work alone.
fn alone(setup: &Setup, i: usize) -> Setup {
    let mut one = setup.clone();
    one.choose_light(i).unwrap();
    Setup { more_lights: Vec::new(), light_number: 1, ..one }
}

/// Linear radiance of a shaded picture's channels, from what shade.wgsl makes of it: c (1 + 0.1 c) / (1 + 0.6 c), encoded.
fn linear(picture: &[u8]) -> Vec<f64> {
    let decode = |b: &u8| {
        let x = f64::from(*b) / 255.0;
        let y = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        // The positive root of 0.1 c² + (1 - 0.6 y) c - y = 0.
        let half = 1.0 - 0.6 * y;
        (-half + (half * half + 0.4 * y).sqrt()) / 0.2
    };
    picture.chunks_exact(4).flat_map(|p| p[..3].iter().map(decode).collect::<Vec<_>>()).collect()
}

/// Light adds up: the shaded picture of three lights is the sum of what each alone adds to the ambient light, and each light's
/// visibility is that which it has alone.
#[test]
fn the_picture_is_the_sum_of_its_lights() {
    let (mut r, setup) = lit();
    let off = |r: &mut Renderer, s: &Setup| {
        r.render(s, ask(s)).unwrap();
        linear(&r.read_picture().unwrap())
    };
    let mut dark = setup.clone();
    (0..3).for_each(|i| dark.switch_light(i, false));
    let ambient = off(&mut r, &dark);
    let together = off(&mut r, &setup);
    let mut sum = ambient.clone();
    for i in 0..3 {
        let one = alone(&setup, i);
        let own = off(&mut r, &one);
        assert!(own.iter().zip(&ambient).filter(|(a, b)| **a > **b + 0.05).count() > 200, "light {i} lights little");
        sum.iter_mut().zip(own.iter().zip(&ambient)).for_each(|(s, (a, b))| *s += a - b);
        let visibility = r.read_visibility().unwrap();
        let mut chosen = Setup { view: "visibility".into(), ..setup.clone() };
        chosen.choose_light(i).unwrap();
        r.render(&chosen, ask(&chosen)).unwrap();
        assert!(r.read_visibility().unwrap() == visibility, "light {i}");
    }
    // A step of the encoded picture is the more light the brighter it is.
    let close = |(i, (a, b)): (usize, (&f64, &f64))| {
        assert!((a - b).abs() < 0.03 + 0.04 * b, "channel {i}: {a} together, {b} one by one");
    };
    together.iter().zip(&sum).enumerate().for_each(close);
    // Whichever is at work, the picture is the same.
    for i in 1..3 {
        let mut chosen = setup.clone();
        chosen.choose_light(i).unwrap();
        let other = off(&mut r, &chosen);
        together.iter().zip(&other).enumerate().for_each(close);
    }
}

/// With the truth as a technique the picture equals that shaded with the truth of every light.
#[test]
fn the_true_picture_is_lit_by_every_truth() {
    let (mut r, mut setup) = lit();
    select(&mut setup, "rt-hard", &[]);
    r.render(&setup, ask(&setup)).unwrap();
    let (picture, exact) = (r.read_picture().unwrap(), r.read_truth_picture(&setup).unwrap());
    assert!(picture == exact, "the truth is not the truth");
    select(&mut setup, "shadow-map", &["resolution=64"]);
    r.render(&setup, ask(&setup)).unwrap();
    assert!(r.read_picture().unwrap() != exact, "a coarse map is right");
    assert!(r.read_truth_picture(&setup).unwrap() == exact, "the truth depends on the technique");
    // A side of a comparison that is the truth shows it too, and so does FLIP.
    setup.against = vec![shadowscope::setup::Side::new("truth").unwrap()];
    setup.arrange = shadowscope::setup::Arrange::Flicker;
    setup.front = 1;
    r.draw(&setup, ask(&setup)).unwrap();
    assert!(r.read_picture().unwrap() == exact, "the side of the truth is lit otherwise");
    // Traced little by little it comes to the same.
    let some = Ask { truth: Truth::Some(500), ..ask(&setup) };
    setup.light = match setup.light {
        Light::Directional { angular_radius, color, .. } => {
            Light::Directional { to_light: Vec3::new(-0.2, 1.0, 0.3), angular_radius, color }
        }
        other => other,
    };
    let mut told = r.draw(&setup, some).unwrap().truth;
    for _ in 0..200 {
        if told.done >= 1.0 {
            break;
        }
        told = r.trace(900).unwrap();
    }
    assert_eq!((told.done, told.covered), (1.0, 1.0));
    r.draw(&setup, ask(&setup)).unwrap();
    let little = r.read_picture().unwrap();
    let mut anew = Renderer::new(gpu(), r.scene().clone()).unwrap();
    anew.draw(&setup, ask(&setup)).unwrap();
    assert!(anew.read_picture().unwrap() == little, "traced little by little it is another truth");
}

/// With the only light nothing is drawn that was not drawn before, an off one and those that the view does not show are not
/// drawn at all, and hold no memory.
#[test]
fn what_is_not_shown_costs_nothing() {
    let (mut r, setup) = lit();
    let passes = |r: &mut Renderer, s: &Setup| {
        let told = r.render(s, Ask { timed: true, truth: Truth::Off, ..ask(s) }).unwrap();
        r.collect_times(true).unwrap();
        let mut names: Vec<&str> = r.timer.latest.iter().map(|p| p.0).collect();
        names.sort_unstable();
        (names, told)
    };
    let one = alone(&setup, 0);
    let (single, told_single) = passes(&mut r, &one);
    assert!(!single.contains(&"light sum"), "{single:?}");
    let mut off = setup.clone();
    off.switch_light(1, false);
    off.switch_light(2, false);
    let (names, told) = passes(&mut r, &off);
    assert_eq!((names, told.gpu_bytes, told.lights.len()), (single.clone(), told_single.gpu_bytes, 1));
    let view = Setup { view: "visibility".into(), ..setup.clone() };
    assert_eq!(passes(&mut r, &view).0, single);
    // All three: three times the technique's passes, one G-buffer, two that add.
    let (names, told) = passes(&mut r, &setup);
    let times = |names: &[&str], name: &str| names.iter().filter(|n| **n == name).count();
    for name in ["G-buffer", "shading"] {
        assert_eq!(times(&names, name), 1, "{name} in {names:?}");
    }
    assert_eq!(times(&names, "light sum"), 2);
    assert_eq!(times(&names, "shadow map"), 3 * times(&single, "shadow map"));
    let memory: u64 = told.lights.iter().map(|l| l.gpu_bytes).sum();
    assert_eq!((memory, told.lights.len()), (told.gpu_bytes, 3));
    assert!(told.lights.iter().all(|l| l.gpu_bytes >= 256 * 256 * 4), "{:?}", told.lights);
    // Their times add up to the technique's.
    let mut lights = told.lights.clone();
    r.time_lights(&mut lights);
    let sum: f64 = lights.iter().map(|l| l.ms).sum();
    let all = technique_ms(&r.timer.by_name());
    assert!(lights.iter().all(|l| l.ms > 0.0) && (sum / all - 1.0).abs() < 1e-9, "{sum} of {all}");
    // Off at work: nothing of the technique, but its shadow can be looked at.
    let mut dark = one.clone();
    dark.light_on = false;
    let (names, told) = passes(&mut r, &dark);
    assert!(!names.contains(&"shadow map") && told.gpu_bytes == 0, "{names:?}");
    let seen = Setup { view: "visibility".into(), ..dark };
    assert!(passes(&mut r, &seen).0.contains(&"shadow map"));
}

/// A light that the technique does not serve shines without a shadow beside the others.
#[test]
fn a_light_that_is_not_served_has_no_shadow() {
    let (mut r, setup) = lit();
    let mut one = alone(&setup, 0);
    let omni = Light::Omni { position: Vec3::new(0.0, 4.0, 2.0), range: 30.0, radius: 0.0, color: Vec3::splat(8.0) };
    one.add_light(omni).unwrap();
    let info = techniques::find("pcf").unwrap();
    assert!(info.refuses(&omni).is_some(), "this test needs a light that is not served");
    assert!(one.refusal(info).unwrap().contains("light 2"));
    r.render(&one, ask(&one)).unwrap();
    let with = linear(&r.read_picture().unwrap());
    one.switch_light(1, false);
    r.render(&one, ask(&one)).unwrap();
    let without = linear(&r.read_picture().unwrap());
    let brighter = with.iter().zip(&without).filter(|(a, b)| **a > **b + 0.02).count();
    assert!(brighter > with.len() / 3, "{brighter} of {}", with.len());
    // So it is where figures are made: what the other light lacks is told, and its pixels do not count.
    let sun = measure::accuracy(&mut r, &one, 0).unwrap();
    one.switch_light(1, true);
    let both = measure::accuracy(&mut r, &one, 0).unwrap();
    assert_eq!((both.facing, both.lit_incorrect, both.lights), (sun.facing, sun.lit_incorrect, 1));
    assert!(
        sun.notes.is_empty() && both.notes.contains("Light 2 has no shadow") && both.notes.contains("not measured")
    );
    assert_eq!(both.per_light().len(), 1);
    assert!(both.rmse_image != sun.rmse_image, "the picture has both lights");
    // The light at work is asked for.
    one.choose_light(1).unwrap();
    assert!(measure::accuracy(&mut r, &one, 0).unwrap_err().to_string().contains("not omni"));
}

/// What is measured of each light adds up to what is measured of all, and is what the light has alone.
#[test]
fn figures_of_lights_add_up() {
    let (mut r, mut setup) = lit();
    select(&mut setup, "shadow-map", &["resolution=64"]);
    setup.truth_samples = shadowscope::truth::Samples::Fixed(1);
    setup.add_light(coloured(1)).unwrap();
    setup.switch_light(3, false);
    let mut rows = Vec::new();
    measure::run(&mut r, &setup, &[(0, setup.clone())], 1, measure::More::default(), &mut |step| {
        if let measure::Step::Row(row) = step {
            rows.push(*row);
        }
        true
    })
    .unwrap();
    let row = &rows[0];
    let lights = row.per_light();
    assert_eq!((lights.len(), row.lights), (3, 3));
    let (mut squares, mut rays) = (0.0, 0);
    for (i, l) in lights.iter().enumerate() {
        let alone = measure::accuracy(&mut r, &alone(&setup, i), 0).unwrap();
        assert!(alone.per_light.is_empty());
        let wrong = (alone.lit_incorrect + alone.shadow_incorrect) as u64;
        assert_eq!((l.number, l.facing, l.wrong), (i as u64 + 1, alone.facing as u64, wrong), "{l:?}");
        assert!((l.rmse - alone.rmse).abs() < 1e-6 && l.gpu_bytes == alone.gpu_bytes && l.gpu_ms > 0.0, "{l:?}");
        squares += alone.rmse.powi(2) * alone.facing as f64;
        rays += alone.texels_covered.unwrap();
    }
    let sum = |of: fn(&measure::LightRow) -> u64| lights.iter().map(of).sum::<u64>();
    assert_eq!(sum(|l| l.facing), row.facing as u64);
    assert_eq!(sum(|l| l.wrong), (row.lit_incorrect + row.shadow_incorrect) as u64);
    assert_eq!(sum(|l| l.gpu_bytes), row.gpu_bytes);
    assert_eq!(Some(rays), row.texels_covered);
    assert!(row.error_share > 0.0 && (row.rmse - (squares / row.facing as f64).sqrt()).abs() < 1e-9, "{}", row.rmse);
    let times: f64 = lights.iter().map(|l| l.gpu_ms).sum();
    assert!((times / row.gpu_ms - 1.0).abs() < 0.5, "medians of {times} ms together, {} ms", row.gpu_ms);
    assert_eq!(measure::errors(&mut r, &setup).unwrap().share(), row.error_share);
    assert!(row.flip > 0.0 && row.rmse_image > 0.0);
    // As people and files have it.
    let text = table::text(&rows);
    for word in ["1 directional", "2 spot", "3 spot", " all "] {
        assert!(text.contains(word), "{word} is not in\n{text}");
    }
    let mut csv = Vec::new();
    measure::write_csv(&rows, &mut csv).unwrap();
    assert_eq!(measure::read_csv(&csv[..]).unwrap()[0].per_light(), lights);
    // None is measured where all are off.
    (0..4).for_each(|i| setup.switch_light(i, false));
    assert!(measure::accuracy(&mut r, &setup, 0).unwrap_err().to_string().contains("off"));
}

/// Choosing, adding, removing and switching keep each light's number and what is set of it.
#[test]
fn the_list_keeps_its_order() {
    let (_, setup) = lit();
    let start = setup.lamps();
    let mut random = Random(5);
    for _ in 0..20 {
        let mut s = setup.clone();
        for _ in 0..4 {
            let at = ((random.next().abs() * 3.0) as usize).min(2);
            s.choose_light(at).unwrap();
            assert_eq!((s.at_work(), s.light), (at, start[at].light));
            assert_eq!(s.lamps(), start);
        }
        s.switch_light(1, false);
        let on: Vec<bool> = s.lamps().iter().map(|l| l.on).collect();
        assert_eq!(on, [true, false, true]);
        let work = s.light;
        let at = s.at_work();
        s.remove_light((at + 1) % 3);
        assert_eq!((s.light, s.light_count()), (work, 2));
        s.remove_light(s.at_work());
        s.remove_light(0);
        assert_eq!(s.light_count(), 1, "the last one stays");
        s.check().unwrap();
    }
    assert!(setup.clone().choose_light(3).is_err());
}

/// Files, rows and captures hold all lights, wherever the scene's origin lies; files without any stay as they were.
#[test]
fn lights_survive_files() {
    let read = |text: &str| Setup::from_toml(text, Path::new("x.toml")).map(|(setup, _)| setup);
    let (mut setup, scene) = Setup::open("bench").unwrap();
    let plain = setup.to_toml(Path::new("x.toml")).unwrap();
    assert!(!plain.contains("more_lights") && !plain.contains("light_"), "{plain}");
    setup.add_light(coloured(1)).unwrap();
    setup.add_all_lights(&scene).unwrap();
    setup.choose_light(1).unwrap();
    setup.switch_light(0, false);
    setup.switch_light(1, false);
    let text = setup.to_toml(Path::new("x.toml")).unwrap();
    assert_eq!(read(&text).unwrap(), setup, "{text}");
    let row = serde_json::to_string(&setup).unwrap();
    assert_eq!(serde_json::from_str::<Setup>(&row).unwrap(), setup, "{row}");
    // Far from zero, through the file's own coordinates.
    let mut far = setup.clone();
    far.origin = glam::DVec3::new(1e7, -3.0, 5e6);
    let row = serde_json::to_string(&far).unwrap();
    assert_eq!(serde_json::from_str::<Setup>(&row).unwrap(), far, "{row}");
    assert!(row.contains("9999995") || row.contains("10000005"), "{row}");
    far.count_from(glam::DVec3::new(1e7, -3.0, 5e6 - 8.0));
    let [a, b] = [&far, &setup].map(|s| s.lamps()[1].light.position());
    assert_eq!(a, b + Vec3::new(0.0, 0.0, 8.0));
    // Names will do.
    let named = read("scene = \"bench\"\nmore_lights = [\"spot\"]\n").unwrap();
    let preset = scene.lights.iter().find(|l| l.name == "spot").unwrap().light;
    assert_eq!(named.more_lights, [Lamp { on: true, light: preset }]);
}

#[test]
fn wrong_lights_are_refused_in_a_sentence() {
    let refusal = |text: &str| {
        let error = Setup::from_toml(&format!("scene = \"cubes\"\n{text}"), Path::new("x.toml"));
        let message = format!("{:#}", error.map(|_| ()).expect_err(text));
        assert!(!message.contains('\n'), "{message}");
        message
    };
    let many = |n: usize| format!("more_lights = [{}]", vec!["\"sun\""; n].join(", "));
    assert!(Setup::from_toml(&format!("scene = \"cubes\"\n{}", many(15)), Path::new("x.toml")).is_ok());
    for (text, words) in [
        (many(16), ["17 lights", "16"]),
        ("light_number = 2\n".into(), ["light_number", "1 to 1"]),
        ("light_on = 3\n".into(), ["light_on", "true or false"]),
        ("more_lights = [\"moon\"]\n".into(), ["moon", "sun"]),
        ("more_lights = 3\n".into(), ["more_lights", "list"]),
        ("[[more_lights]]\nkind = \"omni\"\n".into(), ["more_lights", "position"]),
        ("[[more_lights]]\nkind = \"omni\"\nposition = [0,1,0]\nrange = -1\n".into(), ["more_lights.range", "-1"]),
        (
            "[[more_lights]]\non = 1\nkind = \"omni\"\nposition = [0,1,0]\nrange = 1\n".into(),
            ["more_lights.on", "true"],
        ),
    ] {
        let message = refusal(&text);
        words.iter().for_each(|w| assert!(message.contains(w), "{w} is not in {message}"));
    }
    let (mut setup, _) = Setup::open("cubes").unwrap();
    (1..MOST_LIGHTS).for_each(|_| setup.add_light(sun(Vec3::Y)).unwrap());
    assert!(setup.add_light(sun(Vec3::Y)).unwrap_err().to_string().contains("16"));
    assert_eq!(setup.light_count(), MOST_LIGHTS);
    setup.check().unwrap();
}

/// The command line adds, switches and chooses lights; what it captures reopens as the same picture.
#[test]
fn captures_with_lights_reopen() {
    let folder = std::env::temp_dir().join(format!("shadowscope-lights-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let capture = |args: &[&str], file: &str| {
        ok(&folder, &[&["capture"], args, &["--size", "64x48", "-o", file]].concat());
    };
    let file = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let (first, again) = (file("a.png"), file("b.png"));
    let lamp = "spot:position=0,9,3;direction=0,-1,-0.2;outer_angle=35;range=60;color=40,20,10";
    let args = ["bench", "--add-light", lamp, "--add-light", "spot", "--lights-off", "3", "--choose-light", "2"];
    capture(&args, &first);
    let (setup, _) = Setup::open(&first).unwrap();
    assert_eq!((setup.light_count(), setup.at_work()), (3, 1));
    assert_eq!(setup.lamps().iter().map(|l| l.on).collect::<Vec<_>>(), [true, true, false]);
    capture(&[&first], &again);
    assert!(std::fs::read(&first).unwrap() == std::fs::read(&again).unwrap(), "the capture reopens as another picture");
    let refused = shadowscope(&folder, &["capture", "bench", "--lights-off", "2", "-o", &again]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("--lights-off 2") && said.contains("1 to 1"), "{said}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Techniques that keep things from frame to frame keep them for each light.
#[test]
fn each_light_has_an_instance_of_its_own() {
    let (mut r, mut setup) = built_in("cubes", SIZE);
    setup
        .add_light(match setup.light {
            Light::Directional { angular_radius, color, .. } => {
                Light::Directional { to_light: Vec3::new(-0.6, 0.8, 0.2), angular_radius, color }
            }
            _ => panic!("a sun"),
        })
        .unwrap();
    for technique in ["shadow-map", "pssm", "rtw", "msm"] {
        select(&mut setup, technique, &[]);
        r.render(&setup, ask(&setup)).unwrap();
        let first = r.read_picture().unwrap();
        // A second frame takes over what it may, and is the same.
        r.render(&setup, ask(&setup)).unwrap();
        assert!(r.read_picture().unwrap() == first, "{technique}");
        let mut anew = Renderer::new(gpu(), Arc::clone(r.scene())).unwrap();
        anew.render(&setup, ask(&setup)).unwrap();
        assert!(anew.read_picture().unwrap() == first, "{technique}");
    }
}

/// Eight lamps at once, each with maps of its own, are shadowed nearly as the truth has it, and the better the finer the maps. From an
/// atlas each takes as much as it is important, and all together no more than there is.
#[test]
fn eight_lamps_share_an_atlas() {
    let view = crate::common::camera(Vec3::new(0.0, 5.0, 11.0), Vec3::new(0.0, 0.5, 0.0));
    let lamp = |i: usize| {
        let turn = std::f32::consts::TAU * i as f32 / 8.0;
        let (position, range) = (Vec3::new(5.0 * turn.cos(), 1.8, 4.0 * turn.sin()), [9.0, 3.0][i % 2]);
        Light::Omni { position, range, radius: 0.0, color: Vec3::splat(5.0) }
    };
    let mesh = crate::common::mesh(&yard(), 0);
    let scene = crate::common::scene(vec![mesh], vec![crate::common::material(Vec3::splat(0.6))], view, lamp(0));
    let (mut r, mut setup) = start(scene, SIZE);
    (1..8).for_each(|i| setup.add_light(lamp(i)).unwrap());
    let mut drawn = |technique: &str, sets: &[&str]| {
        select(&mut setup, technique, sets);
        let told = r.render(&setup, ask(&setup)).unwrap();
        let [picture, exact] = [r.read_picture().unwrap(), r.read_truth_picture(&setup).unwrap()];
        let off =
            picture.iter().zip(&exact).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / picture.len() as f64;
        (off, told.lights)
    };
    let [coarse, fine] = ["64", "256"].map(|side| drawn("cube", &[&format!("resolution={side}")]).0);
    assert!(fine < 0.6 * coarse && fine < 0.6, "{coarse} to {fine}");
    let texels = |lights: &[shadowscope::frame::ToldLight]| lights.iter().map(|l| l.gpu_bytes / 16).collect::<Vec<_>>();
    let sizes =
        |sizing: &str| [format!("sizing={sizing}"), "resolution=512".into(), "importance=4".into(), "atlas=512".into()];
    let [fixed, important, shared] = ["fixed", "importance", "atlas"].map(|sizing| {
        let sets = sizes(sizing);
        let given: &[String] = match sizing {
            "fixed" => &sets[..2],
            "importance" => &sets[..3],
            _ => &sets,
        };
        let (off, lights) = drawn("omni-atlas", &given.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(lights.len() == 8 && off < 1.0, "{sizing}: {off}");
        texels(&lights)
    });
    // What is no map is the same for all.
    let least = fixed[0] - 512 * 512;
    assert!(fixed.iter().all(|t| *t == fixed[0]) && least < 40_000, "{fixed:?}");
    let map = |lights: &[u64]| lights.iter().map(|t| t - least).collect::<Vec<_>>();
    let (important, shared) = (map(&important), map(&shared));
    assert!(important.iter().all(|t| t.isqrt().is_power_of_two() && t.isqrt().pow(2) == *t), "{important:?}");
    assert!(important[0] > important[1] && important[2] > important[3], "{important:?}");
    assert!(shared.iter().sum::<u64>() <= 512 * 512 && shared[0] >= shared[1], "{shared:?}");
    assert!(important.iter().sum::<u64>() > 512 * 512, "the atlas is large enough for all: {important:?}");
}
