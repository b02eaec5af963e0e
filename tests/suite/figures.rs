//! Figures of several techniques, overlays, legends, and maps read back.

use crate::common::*;
use glam::{Vec2, Vec3};
use shadowscope::capture;
use shadowscope::frame::{Ask, Renderer, Truth, panes};
use shadowscope::legend::{self, Key, Known, Part};
use shadowscope::light::LightView;
use shadowscope::palette::{self, OCTAVES};
use shadowscope::setup::{Arrange, Base, Overlay, Setup, Side};
use shadowscope::techniques::ALL;
use shadowscope::truth::Samples;

const SIZE: [u32; 2] = [96, 72];

/// The yard under a low sun, by a coarse map.
fn yard_setup() -> (Renderer, Setup) {
    let view = camera(Vec3::new(4.0, 5.0, 9.0), Vec3::new(0.0, 0.3, 0.0));
    let scene = scene(vec![mesh(&yard(), 0)], vec![material(Vec3::splat(0.8))], view, sun(Vec3::new(0.5, 0.7, 0.3)));
    let (r, mut s) = start(scene, SIZE);
    s.truth_samples = Samples::Fixed(1);
    s.set("resolution=96", &["shadow-map".into()]).unwrap();
    (r, s)
}

fn whole(setup: &Setup) -> Ask {
    Ask { timed: true, ..Ask::of(setup) }
}

/// The picture of a set-up, a colour a pixel.
fn picture(r: &mut Renderer, s: &Setup) -> Vec<[u8; 4]> {
    s.check().unwrap();
    r.draw(s, whole(s)).unwrap();
    bytemuck::pod_collect_to_vec(&r.read_picture().unwrap())
}

/// Beside these sides, with small maps.
fn against(s: &Setup, sides: &[&str]) -> Setup {
    let mut figure = Setup { against: sides.iter().map(|t| Side::parse(t).unwrap()).collect(), ..s.clone() };
    figure.complete();
    for side in sides {
        let technique = side.split(':').next().unwrap_or_default();
        if ["pcf", "pssm", "lispsm"].contains(&technique) {
            figure.set("resolution=128", &[technique.into()]).unwrap();
        }
    }
    figure
}

fn at(x: u32, y: u32) -> usize {
    (y * SIZE[0] + x) as usize
}

/// Left of the line the first, right of it the second, as each is alone; with the truth what `rt-hard` draws.
#[test]
fn a_swipe_shows_both_sides_as_they_are_alone() {
    let (mut r, s) = yard_setup();
    let alone = picture(&mut r, &s);
    for other in ["pcf:kernel=5", "pssm", "truth"] {
        let swipe = Setup { split: 0.4, ..against(&s, &[other]) };
        let both = picture(&mut r, &swipe);
        let mut second = swipe.side(1);
        if other == "truth" {
            second.select("rt-hard").unwrap();
        }
        let second = picture(&mut r, &second);
        assert_ne!(alone, second, "{other}");
        let line = (0.4 * SIZE[0] as f32).round() as u32;
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let expected = if x < line { &alone } else { &second };
                assert_eq!(both[at(x, y)], expected[at(x, y)], "{other} at {x}, {y}");
            }
        }
        // Only the arrangement changes: no new frame.
        r.redraw(&Setup { split: 1.0, ..swipe.clone() }).unwrap();
        r.draw(&swipe, whole(&swipe)).unwrap();
        r.redraw(&Setup { split: 1.0, ..swipe.clone() }).unwrap();
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(&r.read_picture().unwrap()), alone);
        r.redraw(&Setup { arrange: Arrange::Flicker, front: 1, ..swipe.clone() }).unwrap();
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(&r.read_picture().unwrap()), second);
    }
}

/// Parts side by side are pictures of their size with the same camera, and each side's visibility can be read.
#[test]
fn sides_beside_each_other_are_pictures_of_their_size() {
    let (mut r, s) = yard_setup();
    let grid = Setup { arrange: Arrange::SideBySide, ..against(&s, &["pcf", "pssm", "truth"]) };
    let all = picture(&mut r, &grid);
    let visible: Vec<Vec<f32>> = (0..3).map(|side| r.read_side(side).unwrap()).collect();
    assert_eq!(panes(&grid, SIZE).len(), 4);
    for pane in panes(&grid, SIZE) {
        let mut one = Setup { size: pane.size, ..grid.side(pane.side) };
        if grid.is_truth(pane.side) {
            one.select("rt-hard").unwrap();
        }
        let alone = picture(&mut r, &one);
        for (i, color) in alone.iter().enumerate() {
            let (x, y) = (i as u32 % pane.size[0], i as u32 / pane.size[0]);
            assert_eq!(all[at(pane.at[0] + x, pane.at[1] + y)], *color, "side {} at {x}, {y}", pane.side);
        }
        if pane.side < 3 {
            assert_eq!(r.read_visibility().unwrap(), visible[pane.side]);
        }
    }
}

/// The truth is drawn in each common view, and under each overlay, as a technique is that is always right; it has no maps.
#[test]
fn the_truth_is_a_technique_that_is_always_right() {
    let (mut r, s) = yard_setup();
    let figure = |s: Setup| Setup { arrange: Arrange::Flicker, front: 1, ..against(&s, &["truth"]) };
    let right = |s: &Setup| {
        let mut s = s.clone();
        s.select("rt-hard").unwrap();
        s
    };
    for view in shadowscope::view::VIEWS.iter().filter(|v| v.id != "difference") {
        // Growing errors have nothing to grow from.
        let s = Setup { view: view.id.into(), error_dilation: 1, ..s.clone() };
        let expected = picture(&mut r, &right(&s));
        let value = r.value_at([30, 40]).unwrap().map(|text| format!("B: {text}"));
        assert!(picture(&mut r, &figure(s)) == expected, "{}", view.id);
        assert_eq!(r.value_at([30, 40]).unwrap(), value, "{}", view.id);
    }
    let shaded = picture(&mut r, &right(&s));
    for view in ["shadow-map", "aliasing"] {
        assert!(picture(&mut r, &figure(Setup { view: view.into(), ..s.clone() })) == shaded, "{view}");
    }
    for (view, inset) in [("visibility", false), ("error-size", false), ("normals", true), ("aliasing", false)] {
        let overlay = Some(Overlay { view: view.into(), opacity: 0.5, inset });
        let s = Setup { overlay, ..s.clone() };
        let expected = if view == "aliasing" { shaded.clone() } else { picture(&mut r, &right(&s)) };
        assert!(picture(&mut r, &figure(s)) == expected, "{view} over the truth");
    }
}

/// The value under the pointer is that of the side which lies there, as that side alone has it, and says which side it is.
#[test]
fn values_are_of_the_side_under_the_pointer() {
    let (mut r, s) = yard_setup();
    let flicker = |front| Setup { arrange: Arrange::Flicker, front, ..s.clone() };
    let grid = Setup { arrange: Arrange::SideBySide, ..s.clone() };
    let swipe = Setup { split: 0.4, ..s.clone() };
    for (arranged, others) in [
        (&swipe, &["pcf:kernel=5"][..]),
        (&grid, &["pcf:kernel=5"]),
        (&grid, &["pcf:kernel=5", "lispsm", "pssm"]),
        (&flicker(0), &["pssm", "pcf:kernel=5"]),
        (&flicker(2), &["pssm", "pcf:kernel=5"]),
    ] {
        let views = ["visibility", "error", "counts", "aliasing", "error-density", "flip", "bias"];
        // All of them once, and for each arrangement those that read differently.
        for view in &views[..if arranged.arrange == Arrange::Swipe { 7 } else { 3 }] {
            let figure = Setup { view: (*view).into(), ..against(arranged, others) };
            picture(&mut r, &figure);
            let all: Vec<_> = (0..SIZE[1] * SIZE[0]).map(|i| [i % SIZE[0], i / SIZE[0]]).step_by(37).collect();
            let shown: Vec<_> = all.iter().map(|at| r.value_at(*at).unwrap()).collect();
            let mut values = 0;
            for pane in panes(&figure, SIZE) {
                let alone = Setup { size: pane.size, ..figure.side(pane.side) };
                r.render(&alone, whole(&alone)).unwrap();
                for ([x, y], shown) in all.iter().zip(&shown) {
                    let [x, y] = [x.wrapping_sub(pane.at[0]), y.wrapping_sub(pane.at[1])];
                    if x < pane.part[2] && y < pane.part[3] {
                        let alone = r.value_at([x + pane.part[0], y + pane.part[1]]).unwrap();
                        let alone = alone.map(|text| format!("{}: {text}", legend::letter(pane.side)));
                        assert_eq!(*shown, alone, "{view} of {others:?} at {x}, {y}");
                        values += alone.is_some() as usize;
                    }
                }
            }
            assert!(values > 3, "{view} of {others:?}: {values}");
        }
    }
    for other in ["pcf:kernel=5", "truth"] {
        let figure = Setup { view: "difference".into(), ..against(&s, &[other]) };
        picture(&mut r, &figure);
        let second = if other == "truth" { r.read_truth().unwrap() } else { r.read_side(1).unwrap() };
        let first = r.read_visibility().unwrap();
        let differing = (0..first.len()).find(|i| first[*i] < second[*i]).unwrap();
        let text = r.value_at([differing as u32 % SIZE[0], differing as u32 / SIZE[0]]).unwrap().unwrap();
        let numbers: Vec<f32> = text.replace('−', "-").split(' ').flat_map(|t| t.parse().ok()).collect();
        let [a, b] = [first[differing], second[differing]];
        let near = numbers.iter().zip([a, b, a - b]).all(|(n, exact)| (n - exact).abs() < 0.01);
        assert!(near && numbers.len() == 3 && text.starts_with("A ") && text.contains(" − B "), "{text}: {a}, {b}");
    }
}

/// A shot renders the first side alone once more; nothing of the figure changes by it.
#[test]
fn a_shot_leaves_the_figure_as_it_was() {
    let (mut r, s) = yard_setup();
    let overlay = Some(Overlay { view: "error".into(), opacity: 0.5, inset: false });
    let s = Setup { overlay, truth_samples: Samples::Auto, ..against(&s, &["pcf:kernel=5", "truth"]) };
    let grid = Setup { arrange: Arrange::SideBySide, ..s };
    let before = picture(&mut r, &grid);
    let all = |r: &Renderer| (r.value_at([20, 20]).unwrap(), r.value_at([70, 20]).unwrap(), r.read_truth().unwrap());
    let values = all(&r);
    for (side, pass) in
        [(0, "shadow map"), (0, "truth"), (1, "resolve"), (0, "analysis"), (1, "shadow map"), (0, "shading")]
    {
        assert!(r.shot(&grid, side, pass).unwrap().is_some(), "{pass}");
        r.redraw(&grid).unwrap();
        assert!(bytemuck::pod_collect_to_vec::<u8, [u8; 4]>(&r.read_picture().unwrap()) == before, "{pass}");
        assert!(all(&r) == values, "{pass}");
    }
}

/// A view that only the second side has is drawn there; the first one is shaded, as an overlay leaves it too.
#[test]
fn a_side_without_the_view_is_shaded() {
    let (mut r, s) = yard_setup();
    let shaded = against(&s, &["pssm"]);
    let before = picture(&mut r, &shaded);
    let own = Setup { view: "cascades".into(), ..shaded.clone() };
    own.check().unwrap();
    let overlay = Some(Overlay { view: "cascades".into(), opacity: 0.5, inset: false });
    let over = Setup { overlay, ..shaded };
    over.check().unwrap();
    for setup in [own, over] {
        let now = picture(&mut r, &setup);
        let [width, height] = setup.size.map(|n| n as usize);
        let differs = |x: std::ops::Range<usize>| {
            (0..height).flat_map(|y| x.clone().map(move |x| y * width + x)).filter(|i| before[*i] != now[*i]).count()
        };
        assert_eq!(differs(0..width / 2 - 1), 0);
        assert!(differs(width / 2 + 1..width) > 500);
    }
    assert!(Setup { view: "cascades".into(), ..s }.check().is_err());
}

/// Times come for each side that is a technique.
#[test]
fn each_side_is_timed() {
    let (mut r, s) = yard_setup();
    let setup = against(&s, &["pssm", "truth"]);
    let told = r.draw(&setup, whole(&setup)).unwrap();
    let passes: Vec<Vec<&str>> = told.sides.iter().map(|s| s.passes.iter().map(|p| p.0).collect()).collect();
    assert!(passes[0].contains(&"shadow map") && passes[1].contains(&"shadow maps"), "{passes:?}");
    assert!(passes[2].is_empty());
    let bytes: Vec<u64> = told.sides.iter().map(|s| s.gpu_bytes).collect();
    assert!(bytes[0] > 0 && bytes[1] > bytes[0] && bytes[2] == 0, "{bytes:?}");
}

/// The difference is drawn where visibilities differ, orange where the first is lighter, blue where the second is.
#[test]
fn the_difference_is_that_of_the_visibilities() {
    let (mut r, s) = yard_setup();
    for other in ["pcf", "truth"] {
        let setup = Setup { view: "difference".into(), ..against(&s, &[other]) };
        let drawn = picture(&mut r, &setup);
        let second = if other == "truth" { r.read_truth().unwrap() } else { r.read_side(1).unwrap() };
        let (first, mask) = (r.read_visibility().unwrap(), r.read_mask().unwrap());
        let (mut more, mut less) = (0, 0);
        for i in 0..first.len() {
            let [red, _, blue, _] = drawn[i].map(i32::from);
            let d = if mask[i] == shadowscope::measure::metrics::FACING { first[i] - second[i] } else { 0.0 };
            if d.abs() > 0.3 {
                assert_eq!(red > blue, d > 0.0, "{other}: {d} is {:?}", drawn[i]);
                if d > 0.0 { more += 1 } else { less += 1 }
            } else if d == 0.0 {
                assert!((red - blue).abs() < 16, "{other}: no difference is {:?}", drawn[i]);
            }
        }
        assert!(more > 0 && less > 0 && more + less > 20, "{more} lighter, {less} darker");
    }
}

/// Pixels that differ grow over those that do not, and look like the one nearby that differs most.
#[test]
fn differing_pixels_grow() {
    let (mut r, s) = yard_setup();
    let setup = |dilation| Setup {
        view: "difference".into(),
        error_dilation: dilation,
        error_base: Base::Light,
        ..against(&s, &["pcf:kernel=5"])
    };
    let plain = picture(&mut r, &setup(0));
    let grown = picture(&mut r, &setup(2));
    let (first, second, mask) = (r.read_visibility().unwrap(), r.read_side(1).unwrap(), r.read_mask().unwrap());
    let off = |i: usize| {
        let d = if mask[i] == shadowscope::measure::metrics::FACING { first[i] - second[i] } else { 0.0 };
        if d.abs() < 1.0 / 255.0 { 0.0 } else { d }
    };
    let (mut more, mut same) = (0, 0);
    for (x, y) in (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))) {
        let near = |c: u32, end: u32| c.saturating_sub(2)..(c + 3).min(end);
        let around = near(x, SIZE[0]).flat_map(|x| near(y, SIZE[1]).map(move |y| at(x, y)));
        let around: Vec<f32> = around.map(off).collect();
        let most = around.iter().fold(0.0f32, |a, b| if b.abs() > a.abs() { *b } else { a });
        let i = at(x, y);
        if off(i) != 0.0 || most == 0.0 {
            assert_eq!(grown[i], plain[i], "{x}, {y}");
            same += 1;
        } else if most.abs() > 0.3 && !around.contains(&-most) {
            let [red, _, blue, _] = grown[i].map(i32::from);
            assert!((red - blue) * most.signum() as i32 > 10, "{x}, {y}: {most} is {:?}", grown[i]);
            more += 1;
        }
    }
    assert!(more > 100 && same > 1000, "{more} grown, {same} as they were");
}

/// An overlay is mixed in where its view shows data, and an inset leaves the rest as it is.
#[test]
fn an_overlay_is_blended_over_the_shaded_picture() {
    let (mut r, s) = yard_setup();
    let shaded = picture(&mut r, &s);
    let aliasing = picture(&mut r, &Setup { view: "aliasing".into(), ..s.clone() });
    let m = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
    let over = |opacity, inset| Setup {
        overlay: Some(Overlay { view: "aliasing".into(), opacity, inset }),
        view: "shaded".into(),
        ..s.clone()
    };
    assert_eq!(picture(&mut r, &over(0.0, false)), shaded);
    let half = picture(&mut r, &over(0.5, false));
    for i in 0..shaded.len() {
        for c in 0..3 {
            let mixed =
                if m[i][0] > 0.0 { (shaded[i][c] as i32 + aliasing[i][c] as i32) / 2 } else { shaded[i][c] as i32 };
            assert!(
                (half[i][c] as i32 - mixed).abs() <= 1,
                "{i}: {:?} of {:?} and {:?}",
                half[i],
                shaded[i],
                aliasing[i]
            );
        }
    }
    let inset = picture(&mut r, &over(1.0, true));
    let same = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).filter(|(x, y)| *x < 60 || *y > 28);
    same.for_each(|(x, y)| assert_eq!(inset[at(x, y)], shaded[at(x, y)], "{x}, {y}"));
    assert_ne!(inset[at(80, 12)], shaded[at(80, 12)]);
}

/// The legend's colours are the shader's.
#[test]
fn the_legend_has_the_colours_of_the_picture() {
    let (mut r, s) = yard_setup();
    let drawn = picture(&mut r, &Setup { view: "aliasing".into(), ..s });
    let m = r.analysis().aliasing(&r.gpu).unwrap().unwrap();
    let mut seen = 0;
    for (i, m) in m.iter().enumerate().filter(|(_, m)| m[0] > 0.0) {
        let expected = palette::bytes(OCTAVES.at(m[0].log2() / 8.0 + 0.5));
        let near = (0..3).all(|c| (drawn[i][c] as i32 - expected[c] as i32).abs() <= 1);
        assert!(near, "m = {}: {:?}, expected {expected:?}", m[0], drawn[i]);
        seen += 1;
    }
    assert!(seen > 1000);
}

/// Every view of every technique has a legend that fits below a small picture; those with colours have parts.
#[test]
fn every_view_has_its_legend() {
    let (mut r, s) = yard_setup();
    let plain = ["shaded", "albedo", "triangles"];
    for info in shadowscope::techniques::ALL.iter() {
        let mut s = s.clone();
        choose(&mut s, info, 64, &[]);
        let center = Vec3::new(-0.5, 3.0, 2.0);
        let [half_u, half_v] = [Vec3::X, Vec3::Z].map(|way| 0.5 * way);
        let others = [
            lamp(center),
            shadowscope::light::Light::RectArea { center, half_u, half_v, range: 20.0, color: Vec3::ONE },
        ];
        s.light = [s.light].into_iter().chain(others).find(|light| info.refuses(light).is_none()).unwrap();
        // The common ones are the same of all.
        let common = if info.id == "shadow-map" { shadowscope::view::VIEWS } else { &[] };
        for view in common.iter().chain(info.views(&Default::default())) {
            s.view = view.id.into();
            r.draw(&s, Ask { truth: Truth::Off, timed: false, ..whole(&s) }).unwrap();
            let key = Key::new(&s, r.geometry().bounds, &r.known().unwrap());
            assert_eq!(key.is_empty(), plain.contains(&view.id), "{} {}", info.id, view.id);
            assert!(key.title.contains(view.title) && key.title.contains(info.title), "{}", key.title);
            for part in &key.parts {
                if let Part::Scale(_, what, ticks) = part {
                    assert!(!what.is_empty() && ticks.len() >= 2, "{} {}: {what} {ticks:?}", info.id, view.id);
                    assert!(ticks.iter().all(|t| (-0.01..=1.01).contains(&t.0)), "{} {}: {ticks:?}", info.id, view.id);
                }
            }
        }
    }
}

/// A capture's legend lies below the picture, which but for a chart's axes stays as it is.
#[test]
fn a_legend_lies_below_the_picture() {
    let (mut r, s) = yard_setup();
    let s = Setup { view: "error".into(), size: [320, 180], ..s };
    r.draw(&s, whole(&s)).unwrap();
    let plain = r.read_picture().unwrap();
    let key = Key::new(&s, r.geometry().bounds, &Known::default());
    let (size, with) = legend::below(&key, s.size, plain.clone()).unwrap();
    assert!(size[0] == 320 && size[1] > 190 && size[1] < 260, "{size:?}");
    assert_eq!(with.len(), (size[0] * size[1] * 4) as usize);
    assert_eq!(with[..plain.len()], plain[..]);
    // Both classes' colours are in the strip.
    for color in [palette::LEAK, palette::FALSE_SHADOW].map(palette::bytes) {
        let found = with[plain.len()..].chunks_exact(4).filter(|p| p[..3] == color).count();
        assert!(found > 20, "{color:?}: {found}");
    }
}

/// A figure's file has exactly the size asked for, legend and all, and its set-up captures the same file again.
#[test]
fn a_figure_with_its_legend_has_the_size_asked_for() {
    let (mut r, s) = yard_setup();
    let folder = std::env::temp_dir().join(format!("shadowscope-figure-{}", std::process::id()));
    for (view, sides, size) in
        [("error", &[][..], [320, 180]), ("shaded", &["pcf", "truth"][..], [321, 203]), ("depth", &[][..], [480, 270])]
    {
        let s = Setup { view: view.into(), scene: "cubes".into(), ..against(&s, sides) };
        let [first, again] = ["first.png", "again.png"].map(|name| folder.join(name));
        capture::figure(&mut r, &s, size, &first).unwrap();
        let read = |path: &std::path::Path| image::open(path).unwrap().into_rgba8();
        assert_eq!(read(&first).dimensions(), (size[0], size[1]), "{view}");
        let (inside, _) = Setup::from_toml(&capture::read_setup(&first).unwrap(), &first).unwrap();
        assert!(inside.legend && inside.size[0] == size[0] && inside.size[1] < size[1], "{:?}", inside.size);
        capture::capture(&mut r, &inside, &again).unwrap();
        assert!(read(&first) == read(&again), "{view}: the set-up inside draws another figure");
    }
    let none = capture::figure(&mut r, &s, [320, 8], &folder.join("none.png")).unwrap_err().to_string();
    assert!(none.contains("no room for the legend"), "{none}");
    assert!(capture::figure(&mut r, &s, [320, 180], &folder.join("raw.exr")).is_err());
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A set-up's comparison and overlay survive being written and read; an older file's split view is one with the truth.
#[test]
fn comparisons_are_written_and_read() {
    let (_, s) = yard_setup();
    let s = Setup {
        scene: "cubes".into(),
        arrange: Arrange::SideBySide,
        overlay: Some(Overlay { view: "aliasing".into(), opacity: 0.25, inset: false }),
        legend: true,
        ..against(&s, &["pssm:lambda=0.75;cascades=3", "truth"])
    };
    let text = s.to_toml(std::path::Path::new("x.toml")).unwrap();
    let (back, _) = Setup::from_toml(&text, std::path::Path::new("x.toml")).unwrap();
    assert_eq!((&back.against, back.arrange, &back.overlay, back.legend), (&s.against, s.arrange, &s.overlay, true));
    let old = "scene = \"cubes\"\nview = \"split\"\nsplit = 0.3\n";
    let (old, _) = Setup::from_toml(old, std::path::Path::new("x.toml")).unwrap();
    assert_eq!((old.view.as_str(), old.split, old.is_truth(1)), ("shaded", 0.3, true));
    assert!(old.needs_truth());
    for (bad, said) in [
        ("[[against]]\ntechnique = \"nothing\"\n", "nothing"),
        ("[[against]]\nparams = {}\n", "technique"),
        ("[[against]]\ntechnique = \"truth\"\nparams = { lambda = 1.0 }\n", "no parameters"),
        ("arrange = \"around\"\n", "swipe"),
        ("[overlay]\nview = \"nothing\"\n", "nothing"),
        ("[overlay]\nview = \"error\"\nopacity = 2.0\n", "0 to 1"),
    ] {
        let text = format!("scene = \"cubes\"\n{bad}");
        let e = format!("{:#}", Setup::from_toml(&text, std::path::Path::new("x.toml")).unwrap_err());
        assert!(e.contains(said), "{bad}: {e}");
    }
}

/// Every sample has its texel: places and counts tell the same, and depths are those of the casters.
#[test]
fn maps_are_read_back_with_their_samples() {
    let (mut r, mut s) = yard_setup();
    for id in ["shadow-map", "pcf", "pssm", "lispsm", "rtw"] {
        s.select(id).unwrap();
        s.set("resolution=128", &[id.into()]).unwrap();
        r.render(&s, Ask { analysis: true, ..whole(&s) }).unwrap();
        let first = r.read_layer(0).unwrap().unwrap();
        let layers = if id == "pssm" { 4 } else { 1 };
        assert_eq!((first.layers, first.side, first.size), (layers, 128, SIZE), "{id}");
        let mut total = 0;
        for layer in 0..layers {
            let map = r.read_layer(layer).unwrap().unwrap();
            let mut counted = vec![0; 128 * 128];
            for (texel, l) in map.places.iter().flatten() {
                if *l == layer {
                    let [x, y] = texel.map(|t| (t.max(0.0) as usize).min(127));
                    counted[y * 128 + x] += 1;
                }
            }
            total += counted.iter().sum::<u32>();
            assert_eq!(map.samples.unwrap(), counted, "{id} {layer}");
        }
        assert!(total > 1500, "{id}: {total}");
        // Where a place is lit the map holds the surface itself, to within a texel's slope.
        let visible = r.read_visibility().unwrap();
        let (at, mut off, mut lit) = (r.read_position().unwrap(), 0, 0);
        for (i, place) in first.places.iter().enumerate() {
            let Some(([x, y], 0)) = *place else { continue };
            let texel = (y.max(0.0) as usize).min(127) * 128 + (x.max(0.0) as usize).min(127);
            if visible[i] < 1.0 || (id == "rtw" && first.depth[texel] == 0.0) {
                continue;
            }
            let p = Vec3::new(at[i][0], at[i][1], at[i][2]);
            let depth = first.view.axis.dot(p.extend(1.0));
            lit += 1;
            off += first.metres(texel).is_none_or(|d| (d - depth).abs() > 0.6) as usize;
        }
        assert!(lit > 300 && off * 20 < lit, "{id}: {off} of {lit} lit pixels are far from what the map holds");
    }
    s.select("rt-hard").unwrap();
    r.render(&s, Ask { analysis: true, ..whole(&s) }).unwrap();
    assert!(r.read_layer(0).unwrap().is_none());
}

/// Every pixel's place in the light's image is that of its texel, both ways, whatever the fit and the warp.
#[test]
fn maps_lie_in_the_lights_image_where_they_look() {
    let (mut r, mut s) = yard_setup();
    let sun = s.light;
    let lamp = spot(Vec3::new(4.0, 9.0, 3.0), Vec3::ZERO, 40.0);
    for info in ALL.iter().filter(|t| t.views(&Default::default()).any(|v| v.id.starts_with("shadow-map"))) {
        for light in [sun, lamp] {
            if info.refuses(&light).is_some() {
                continue;
            }
            s.select(info.id).unwrap();
            s.light = light;
            s.set("resolution=128", &[info.id.into()]).unwrap();
            r.render(&s, Ask { analysis: true, ..whole(&s) }).unwrap();
            let at = r.read_position().unwrap();
            let whole = LightView::whole(&light, r.geometry().bounds, 128, 0.0).unwrap();
            let (mut there, mut back) = (Vec::new(), Vec::new());
            for layer in 0..r.read_layer(0).unwrap().unwrap().layers {
                let map = r.read_layer(layer).unwrap().unwrap();
                let space = map.light_space.unwrap();
                for (place, p) in map.places.iter().zip(&at) {
                    let Some((texel, _)) = place.filter(|(_, l)| *l == layer) else { continue };
                    let p = Vec3::new(p[0], p[1], p[2]).extend(1.0);
                    let clip = Vec2::new(whole.row_x.dot(p), whole.row_y.dot(p)) / whole.row_w.dot(p);
                    let image = (Vec2::ONE + Vec2::new(clip.x, -clip.y)) / 2.0;
                    there.push(Vec2::from(space.to_texel(image.into()).unwrap()).distance(texel.into()));
                    back.push(128.0 * Vec2::from(space.of_texel(texel)).distance(image));
                }
            }
            // Both in texels, of the map and of the light's image.
            for off in [&mut there, &mut back] {
                off.sort_unstable_by(f32::total_cmp);
                // Lines of this warp bend it within a texel more often than it is read back.
                let [most, all] = if info.id == "notw" { [0.5, f32::INFINITY] } else { [0.003, 0.01] };
                let usual = off[off.len() * 9 / 10];
                assert!(off.len() > 500, "{}: {} pixels", info.id, off.len());
                assert!(usual < most && *off.last().unwrap() < all, "{} {}: {usual}", info.id, light.kind());
            }
        }
    }
}
