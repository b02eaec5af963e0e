//! What a wrong pixel's diagnosis makes of its evidence, on evidence made by hand: each finding on both sides of what decides it.

use super::common::*;
use glam::{Vec2, Vec3, Vec4};
use shadowscope::frame::{Looked, TAPS};
use shadowscope::measure::causes::{ACNE, Causes, DETACHMENT, Evidence, LEAK, MISSING};
use shadowscope::measure::diagnosis::{Diagnosis, diagnose};
use shadowscope::measure::metrics::{FACING, Pixels};
use shadowscope::measure::story::Seen;
use shadowscope::params::Value;
use shadowscope::setup::Setup;

const SIDE: usize = 65;
const MIDDLE: usize = SIDE / 2;
const I: usize = MIDDLE * SIDE + MIDDLE;
/// The plane of the surface lies this far from the light, and no map's step is larger than a micrometre.
const PLANE: f32 = 5.0;

/// A floor seen from ten metres, all lit and right, and a map that holds it.
struct Case {
    setup: Setup,
    seen: Seen,
    looked: Looked,
}

impl Case {
    fn new(technique: &str, sets: &[&str]) -> Case {
        let floor = mesh(&floor(Vec2::splat(-8.0), Vec2::splat(8.0), 0.0), 0);
        let view = camera(Vec3::new(0.0, 4.0, 9.0), Vec3::ZERO);
        let mut setup = Setup::new("test", &scene(vec![floor], vec![material(Vec3::ONE)], view, sun(Vec3::Y))).unwrap();
        select(&mut setup, technique, sets);
        let all = |value: f32| vec![value; SIDE * SIDE];
        let pixels = Pixels { visibility: all(1.0), hard: all(1.0), mean: all(1.0), mask: vec![FACING; SIDE * SIDE] };
        let seen = Seen {
            size: [SIDE as u32; 2],
            pixels,
            causes: Causes { classes: vec![0; SIDE * SIDE], ..Causes::default() },
            evidence: vec![Evidence::default(); SIDE * SIDE],
            aliasing: vec![[1.0; 4]; SIDE * SIDE],
            places: Vec::new(),
            position: vec![[0.0, 0.0, 0.0, 10.0]; SIDE * SIDE],
            triangles: vec![0; SIDE * SIDE],
            to: [all(f32::INFINITY), all(f32::INFINITY)],
        };
        let mut looked: Looked = bytemuck::Zeroable::zeroed();
        (looked.lit, looked.lit_next, looked.side, looked.fall, looked.spread) = (1.0, 1.0, 256.0, 1.0, 1.0);
        (looked.near, looked.far, looked.texel_size) = (0.1, 10.0, 0.1);
        (looked.depth, looked.compared, looked.held) = (PLANE, PLANE, PLANE);
        looked.taps = [Vec4::new(PLANE, PLANE, PLANE, 1.0); TAPS * TAPS];
        Case { setup, seen, looked }
    }

    /// Of a filter, under a light with a size.
    fn soft() -> Case {
        let mut case = Case::new("pcf", &[]);
        case.setup.light = plate(Vec3::Y * 5.0, Vec3::ZERO, 0.5);
        case
    }

    /// The truth of each pixel by its column and row, which the technique meets.
    fn truth(mut self, of: impl Fn(i32, i32) -> f32) -> Case {
        let p = &mut self.seen.pixels;
        p.mean = (0..SIDE * SIDE).map(|i| of((i % SIDE) as i32, (i / SIDE) as i32)).collect();
        p.hard = p.mean.iter().map(|v| (*v >= 0.5) as u32 as f32).collect();
        p.visibility = p.mean.clone();
        let hard = &p.hard;
        self.seen.to = [false, true].map(|lit| {
            // First along each row, then over all rows.
            let row = |x: usize, y: usize| {
                let there = (0..SIDE).filter(|u| (hard[y * SIDE + u] >= 0.5) == lit);
                there.map(|u| u.abs_diff(x).pow(2)).min()
            };
            let rows: Vec<Option<usize>> = (0..SIDE * SIDE).map(|i| row(i % SIDE, i / SIDE)).collect();
            let nearest = |i: usize| {
                let over = |y: usize| Some(rows[y * SIDE + i % SIDE]? + y.abs_diff(i / SIDE).pow(2));
                (0..SIDE).filter_map(over).min().map_or(f32::INFINITY, |d| (d as f32).sqrt())
            };
            (0..SIDE * SIDE).map(nearest).collect()
        });
        self
    }

    /// What the technique says of each pixel.
    fn says(mut self, of: impl Fn(i32, i32) -> f32) -> Case {
        self.seen.pixels.visibility = (0..SIDE * SIDE).map(|i| of((i % SIDE) as i32, (i / SIDE) as i32)).collect();
        self
    }

    /// What it says of the middle one.
    fn here(mut self, visibility: f32) -> Case {
        self.seen.pixels.visibility[I] = visibility;
        self
    }

    /// Metres from the middle pixel to what hides the light.
    fn blocker(mut self, distance: f32) -> Case {
        self.seen.evidence[I].own = distance.to_bits();
        self
    }

    /// Changes the map's look-up.
    fn map(mut self, change: impl Fn(&mut Looked)) -> Case {
        change(&mut self.looked);
        self
    }

    /// Depths before the plane that taps hold, by their places from the middle.
    fn holds(self, before: impl Fn(i32, i32) -> f32) -> Case {
        self.map(|l| {
            for i in 0..TAPS * TAPS {
                let half = (TAPS / 2) as i32;
                let t = &mut l.taps[i];
                t.x = t.z - before((i % TAPS) as i32 - half, (i / TAPS) as i32 - half);
            }
        })
    }

    /// Pixels that a texel is long, and its area.
    fn texel(mut self, longest: f32, area: f32) -> Case {
        self.seen.aliasing = vec![[longest, longest, 1.0, area]; SIDE * SIDE];
        self
    }

    fn told(&self) -> Option<Diagnosis> {
        diagnose(&self.setup, &self.seen, I, Some(&self.looked), [1, 1])
    }

    fn named(&self) -> &'static str {
        self.told().map_or("nothing", |d| d.artefact)
    }

    /// The same of a technique whose look-up cannot be asked.
    fn unasked(&self) -> &'static str {
        diagnose(&self.setup, &self.seen, I, None, [1, 1]).map_or("nothing", |d| d.artefact)
    }
}

/// All lit but what lies left of a column.
fn edge_at(column: i32) -> impl Fn(i32, i32) -> f32 {
    move |x, _| if x < column { 0.0 } else { 1.0 }
}

/// A lit pixel that is drawn dark, so many columns right of the true edge.
fn falsely_dark(away: i32) -> Case {
    Case::new("shadow-map", &[]).truth(edge_at(MIDDLE as i32 - away + 1)).here(0.0)
}

/// A pixel in the middle of a shadow of so many columns, 2 m below what casts it, that is drawn lit.
fn falsely_lit(columns: i32) -> Case {
    let from = MIDDLE as i32 - columns / 2;
    let dark = move |x: i32, _| if x >= from && x < from + columns { 0.0 } else { 1.0 };
    Case::new("shadow-map", &[]).truth(dark).here(1.0).blocker(2.0)
}

#[test]
fn what_is_right_has_no_diagnosis() {
    assert!(Case::new("shadow-map", &[]).told().is_none());
    let mut away = falsely_dark(20);
    away.seen.pixels.mask[I] = 1;
    assert!(away.told().is_none(), "what does not face the light cannot be wrong");
    // A technique that filters is held against the mean, and may be off by a little.
    let filtered = |visibility| Case::new("pcf", &[]).truth(|_, _| 0.75).here(visibility);
    assert!(filtered(0.75).told().is_none());
    assert!(filtered(0.55).told().is_some());
}

#[test]
fn frames_to_come_and_maps_that_disagree_come_first() {
    let wrong = falsely_dark(20);
    let of = |frames| diagnose(&wrong.setup, &wrong.seen, I, Some(&wrong.looked), frames).unwrap().artefact;
    assert_eq!(of([3, 8]), "lag");
    assert_ne!(of([8, 8]), "lag");
    let two = |share, other| falsely_dark(20).map(move |l| (l.share, l.lit, l.lit_next) = (share, other, 0.0)).named();
    assert_eq!(two(0.1, 1.0), "seam");
    assert_ne!(two(0.0, 1.0), "seam");
    assert_ne!(two(0.1, 0.4), "seam");
    assert_ne!(falsely_dark(20).map(|l| (l.share, l.lit, l.lit_next) = (0.1, 0.4, 0.3)).named(), "seam");
    let beside = |outside| falsely_dark(20).map(move |l| l.outside = outside).named();
    assert_eq!(beside(1), "outside-map");
    assert_ne!(beside(2), "outside-map");
}

/// A texel is the surface's own as long as it lies off its plane by no more than a tenth of its size and a twentieth of its slope.
#[test]
fn acne_is_what_its_own_plane_shadows() {
    let sloped = |slope: [f32; 2], off: f32| {
        falsely_dark(20).map(move |l| (l.slope, l.radius) = (Vec2::from(slope), 1.0)).holds(move |_, _| off)
    };
    assert_eq!(sloped([0.001, 0.0], 0.0100).named(), "acne");
    assert_eq!(sloped([0.001, 0.0], 0.0101).named(), "misplaced");
    assert_eq!(sloped([0.1, -0.1], 0.0199).named(), "acne");
    assert_eq!(sloped([0.1, -0.1], 0.0201).named(), "misplaced");
    let told = sloped([0.1, -0.1], 0.0199).told().unwrap().because.join(" ");
    assert!(told.contains("9 of 9 texels") && told.contains("of which a texel spans 20 cm"), "{told}");
    assert!(told.contains("moved by 0"), "{told}");

    // Half of those that shadow it are enough; what lies beyond the filter's reach is not asked.
    let some = |own: i32, other: i32| {
        falsely_dark(20).map(|l| (l.radius, l.slope.x) = (1.0, 0.01)).holds(move |x, y| match (x + 1) + 3 * (y + 1) {
            _ if x.abs() > 1 || y.abs() > 1 => 0.005,
            k if k < own => 0.005,
            k if k < own + other => 1.0,
            _ => -0.005,
        })
    };
    assert_eq!(some(2, 2).named(), "acne");
    assert_eq!(some(2, 3).named(), "misplaced");
    assert_eq!(some(1, 0).named(), "acne");
    assert_eq!(some(0, 0).named(), "blur-wide", "nothing in reach shadows it");
    let told = some(2, 3).told().unwrap().because.join(" ");
    assert!(told.contains("5 of 9 texels in reach") && told.contains("the middle one 1 m before"), "{told}");
    let wider = some(2, 3).map(|l| l.spread = 2.0).told().unwrap().because.join(" ");
    assert!(wider.contains("1 of 1 texels in reach"), "{wider}");
    let empty = some(1, 4).map(|l| l.taps[TAPS * TAPS / 2].w = 0.0).told().unwrap().because.join(" ");
    assert!(empty.contains("4 of 9 texels") && !empty.contains("the middle one"), "{empty}");
}

/// Depths of 16 bits over ten metres are 0.15 mm apart: what lies off by less is theirs, where neither the slope nor a bias is larger.
#[test]
fn precision_is_named_where_steps_outweigh_slope_and_bias() {
    let step = 9.9 / 65536.0;
    let case = |format: &str, slope: f32, bias: f32| {
        let mut case = falsely_dark(20).holds(|_, _| 1e-4);
        select(&mut case.setup, "shadow-map", &[format]);
        case.map(move |l| (l.slope.x, l.bias.x) = (slope, bias)).named()
    };
    assert_eq!(case("format=16", 0.0, 0.0), "precision");
    assert_eq!(case("format=32f", 1e-4, 0.0), "acne");
    assert_eq!(case("format=16", step / 0.72, 0.0), "precision");
    assert_eq!(case("format=16", step / 0.68, 0.0), "acne");
    assert_eq!(case("format=16", step * 1.3, 0.0), "precision");
    assert_eq!(case("format=16", 0.0, 1.1 * step), "acne");
    assert_eq!(case("format=16", 0.0, 0.9 * step), "precision");
    // Four steps more than a texel leaves open are still its own plane.
    let off = |steps: f32| {
        let mut case = falsely_dark(20).map(|l| l.texel_size = 1e-3).holds(move |_, _| 1e-4 + steps * step);
        select(&mut case.setup, "shadow-map", &["format=16"]);
        case.named()
    };
    assert_eq!(off(3.9), "precision");
    assert_eq!(off(4.1), "misplaced");
}

#[test]
fn a_false_shadow_is_told_by_what_is_held_and_where_the_edge_is() {
    let other = |away: i32| falsely_dark(away).holds(|_, _| 1.0);
    // Within two pixels of the edge, or a texel and a half, or where rays have seen an edge.
    assert_eq!(other(2).named(), "stairs");
    assert_eq!(other(4).named(), "misplaced");
    assert_eq!(other(4).texel(2.0, 4.0).named(), "misplaced");
    assert_eq!(other(4).texel(2.5, 4.0).named(), "stairs");
    let mut seen = other(20);
    seen.seen.evidence[I].edge = 1;
    assert_eq!(seen.named(), "stairs");
    let told = other(4).texel(2.5, 4.0).told().unwrap().because.join(" ");
    assert!(told.contains("3.5 pixels away, 1.4 texels"), "{told}");
    assert!(told.contains("2.5 pixels long") && told.contains("mostly perspective aliasing"), "{told}");
    let told = other(2).told().unwrap().because.join(" ");
    assert!(told.contains("1 pixels long") && !told.contains("mostly"), "{told}");
    assert!(falsely_dark(20).truth(|_, _| 1.0).here(0.0).told().unwrap().text().contains("There is no true edge"));

    // A filter that reaches over the edge, some of its texels dark and some lit; with a tenth of either it is no filter's doing.
    let filtered = |away: i32, dark: i32| {
        falsely_dark(away)
            .map(|l| l.radius = 2.0)
            .holds(move |x, y| if (x + 2) + 5 * (y + 2) < dark { 1.0 } else { 0.0 })
    };
    assert_eq!(filtered(2, 13).named(), "blur-wide");
    assert_eq!(filtered(2, 2).named(), "stairs");
    assert_eq!(filtered(2, 3).named(), "blur-wide");
    assert_eq!(filtered(2, 22).named(), "blur-wide");
    assert_eq!(filtered(2, 23).named(), "stairs");
    // Of a technique that filters a pixel may be too dark with the right label: a filter's fault, not the map's.
    let too_dark = |visibility: f32| {
        let case = Case::new("pcf", &[]).truth(edge_at(MIDDLE as i32 - 1)).here(visibility).holds(|_, _| 1.0);
        case.map(|l| l.radius = 1.0).named()
    };
    assert_eq!(too_dark(0.4), "stairs");
    assert_eq!(too_dark(0.6), "blur-wide");
    assert!(filtered(2, 15).told().unwrap().text().contains("their mean: 0.4 of the light"));
    assert_eq!(filtered(4, 23).named(), "blur-wide", "the edge is in the filter's reach");
    assert_eq!(filtered(5, 23).named(), "misplaced");
}

/// What is thinner than a texel is met in three of nine texels at most, near the edge of a shadow narrower than the texel.
#[test]
fn thin_casters_are_met_by_chance() {
    let beside = |columns: i32, hits: i32, texel: [f32; 2]| {
        let from = MIDDLE as i32 - 1 - columns;
        Case::new("shadow-map", &[])
            .truth(move |x, _| if x >= from && x < from + columns { 0.0 } else { 1.0 })
            .here(0.0)
            .texel(texel[0], texel[1])
            .holds(move |x, y| if x.abs() <= 1 && y.abs() <= 1 && (x + 1) + 3 * (y + 1) < hits { 1.0 } else { -1.0 })
            .map(|l| l.radius = 1.0)
    };
    assert_eq!(beside(1, 3, [4.0, 16.0]).named(), "thin-caster");
    assert_eq!(beside(1, 4, [4.0, 16.0]).named(), "stairs");
    // As long, but half a pixel across.
    assert_eq!(beside(1, 3, [4.0, 2.0]).named(), "stairs");
    assert_eq!(beside(3, 3, [4.0, 16.0]).named(), "thin-caster");
    assert_eq!(beside(5, 3, [4.0, 16.0]).named(), "stairs");
    assert_eq!(beside(1, 3, [4.0, 16.0]).map(|l| l.radius = 1.4).named(), "stairs");
    let told = beside(1, 3, [4.0, 16.0]).told().unwrap().because.join(" ");
    assert!(told.contains("1 pixels wide, the texel 4:"), "{told}");

    // The same from within: a lit pixel of the shadow, which no texel or few hold.
    let within = |columns: i32, hits: i32, texel: [f32; 2]| {
        falsely_lit(columns).texel(texel[0], texel[1]).map(|l| l.radius = 1.0).holds(move |x, y| {
            let k = (x + 1) + 3 * (y + 1);
            if x.abs() <= 1 && y.abs() <= 1 && k < hits { 2.0 } else { 0.0 }
        })
    };
    assert_eq!(within(1, 3, [4.0, 16.0]).named(), "thin-caster");
    assert_eq!(within(1, 4, [4.0, 16.0]).named(), "stairs");
    assert_eq!(within(5, 3, [4.0, 16.0]).named(), "stairs");
    assert_eq!(within(1, 3, [4.0, 16.0]).map(|l| l.radius = 1.4).named(), "stairs");
}

#[test]
fn a_bias_beyond_the_blocker_detaches() {
    let case = |before: f32, moved: f32| {
        falsely_lit(21).holds(move |_, _| before).map(move |l| {
            l.bias = Vec4::new(0.5 * moved, 0.25 * moved, 0.25 * moved, 0.0);
            l.taps.iter_mut().for_each(|t| t.y -= moved);
        })
    };
    assert_eq!(case(2.0, 3.0).named(), "detachment");
    assert_eq!(case(2.0, 1.9).named(), "bleeding", "all texels say dark");
    // What lies less than half as far before the plane is something else.
    assert_eq!(case(1.01, 3.0).named(), "detachment");
    assert_eq!(case(0.99, 3.0).named(), "missing-caster");
    let told = case(2.0, 3.0).told().unwrap();
    assert!(told.text().contains("The blocker is 2 m away, 2 m of depth in the map."), "{}", told.text());
    assert!(told.text().contains("constant 1.5 m, slope 75 cm, normal 75 cm"), "{}", told.text());
    assert!(!told.text().contains("plane 0"), "{}", told.text());

    // Through a lamp's eyes a metre towards it may be less of depth.
    let far = case(1.01, 3.0).map(|l| l.fall = 0.4);
    assert!(far.told().unwrap().text().contains("80 cm of depth"), "{}", far.told().unwrap().text());
    assert_eq!(case(0.41, 3.0).map(|l| l.fall = 0.4).named(), "detachment");
    assert_eq!(case(0.39, 3.0).map(|l| l.fall = 0.4).named(), "missing-caster");

    // Where the format cannot tell blocker and surface apart, it is that.
    let close = |moved: f32, gap: f32| {
        let mut c = falsely_lit(21).blocker(gap).holds(move |_, _| 0.6 * gap);
        select(&mut c.setup, "shadow-map", &["format=16"]);
        c.map(move |l| {
            l.bias.x = moved;
            l.taps.iter_mut().for_each(|t| t.y -= gap);
        })
    };
    let step = 9.9 / 65536.0;
    assert_eq!(close(0.5 * step, 1.9 * step).named(), "precision");
    assert_eq!(close(0.5 * step, 2.1 * step).named(), "detachment");
    assert_eq!(close(1.1 * step, 1.9 * step).named(), "detachment");
}

/// Of the biases the one that moves most comes first, and one that hardly moves is not named.
#[test]
fn remedies_are_those_that_count() {
    let moved = |bias: [f32; 4]| {
        let case = falsely_lit(21).holds(|_, _| 2.0).map(move |l| {
            l.bias = Vec4::from(bias);
            l.taps.iter_mut().for_each(|t| t.y -= 3.0);
        });
        let remedies = case.told().unwrap().remedies;
        remedies.iter().map(|r| r.name).collect::<Vec<_>>()
    };
    assert_eq!(moved([2.0, 1.0, 0.0, 0.0])[..2], ["bias", "slope_bias"]);
    assert_eq!(moved([1.0, 2.0, 0.0, 0.0])[..2], ["slope_bias", "bias"]);
    assert!(!moved([2.9, 0.1, 0.0, 0.0]).contains(&"slope_bias"));
    assert!(moved([2.0, 0.3, 0.0, 0.0]).contains(&"slope_bias"));
    assert!(!moved([0.1, 2.9, 0.0, 0.0]).contains(&"bias"));

    // A slope limit is raised only where the plane is steeper than it.
    let steep = |slope: f32| {
        let mut case = falsely_dark(20).map(move |l| l.slope.x = slope * l.texel_size);
        select(&mut case.setup, "shadow-map", &["slope_limit=4"]);
        let case = case.holds(|_, _| 0.001);
        case.told().unwrap().remedies
    };
    let limit = |slope: f32| steep(slope).iter().find(|r| r.name == "slope_limit").map(|r| r.to.clone());
    assert_eq!(limit(3.9), None);
    assert_eq!(limit(4.1), Some(Value::Float(16.0)));
    assert!(steep(4.1).len() <= 3);
    let applied = steep(4.1).iter().find(|r| r.name == "slope_limit").unwrap().applied(&falsely_dark(20).setup);
    assert_eq!(applied.values().get("slope_limit"), Some(&Value::Float(16.0)));
}

/// Numbers are multiplied or moved within their range, choices and flags are set, and what would change nothing is left out.
#[test]
fn remedies_say_from_what_to_what() {
    let texts = |case: &Case| case.told().unwrap().remedies.iter().map(|r| r.text()).collect::<Vec<_>>();
    let detached = |sets: &[&str]| {
        let mut case = falsely_lit(21).holds(|_, _| 2.0).map(|l| {
            l.bias = Vec4::new(1.5, 1.5, 0.0, 0.0);
            l.taps.iter_mut().for_each(|t| t.y -= 3.0);
        });
        select(&mut case.setup, "shadow-map", sets);
        texts(&case)
    };
    let told = detached(&["bias=0.04", "slope_bias=3", "resolution=1024"]);
    assert_eq!(told, ["bias: 0.04 → 0.01 m", "slope_bias: 3 → 1.5 × texel", "resolution: 1024 → 2048 texels"]);
    let told = detached(&["bias=0.04", "slope_bias=3", "resolution=8192"]);
    assert!(told.iter().all(|t| !t.contains("resolution: 8192 → 16384")), "{told:?}");

    let mut leak =
        falsely_lit(1).here(0.9).map(|l| l.radius = 2.0).holds(|x, y| if y == 2 && x != 0 { 0.0 } else { 2.0 });
    select(&mut leak.setup, "pcf", &["kernel=9"]);
    leak.seen.pixels.visibility[I] = 0.2;
    leak.seen.pixels.mean[I] = 0.0;
    assert!(leak.named() == "leak" && texts(&leak)[0] == "kernel: 9 → 7 texels", "{}", leak.told().unwrap().text());

    let mut missing = falsely_lit(21);
    select(&mut missing.setup, "shadow-map", &["fit=receivers"]);
    let told = texts(&missing);
    assert!(told.contains(&"fit: receivers → scene".into()), "{told:?}");
    select(&mut missing.setup, "shadow-map", &["fit=scene"]);
    assert!(texts(&missing).iter().all(|t| !t.starts_with("fit")), "{:?}", texts(&missing));
    assert!(missing.told().unwrap().text().contains("What would help\n"));
    assert!(!Case::new("rt-hard", &[]).truth(edge_at(5)).here(0.0).told().unwrap().text().contains("What would help"));
}

#[test]
fn a_missing_shadow_is_told_by_who_holds_the_blocker() {
    let none = falsely_lit(21);
    assert_eq!(none.named(), "missing-caster");
    let told = none.told().unwrap().text();
    assert!(told.contains("does not hold it; 0 of 9 around"), "{told}");
    let beside = falsely_lit(21).holds(|x, _| if x == 1 { 2.0 } else { 0.0 });
    assert_eq!(beside.named(), "stairs");
    // Two texels off it is only drawn elsewhere where a warp has moved it.
    let off =
        |warped: f32| falsely_lit(21).holds(|x, _| if x == 2 { 2.0 } else { 0.0 }).map(move |l| l.texel.x = warped);
    assert_eq!(off(0.0).named(), "missing-caster");
    assert_eq!(off(0.02).named(), "misplaced");
    assert_eq!(falsely_lit(21).map(|l| l.texel.x = 0.02).named(), "missing-caster");
    assert_eq!(falsely_lit(3).named(), "stairs", "the edge is near");
    // Of a light with a size, its middle may be in sight.
    let unblocked = |columns| falsely_lit(columns).blocker(0.0).named();
    assert_eq!(unblocked(3), "stairs");
    assert_eq!(unblocked(21), "blur-wide");

    // What the texels' comparisons say is what a filter leaves: more light than that bleeds.
    let filtered = |dark: i32, visibility: f32, radius: f32, columns: i32| {
        falsely_lit(columns).here(visibility).map(move |l| l.radius = radius).holds(move |x, y| {
            // The middle first, then row by row.
            let k = (x + 2) + 5 * (y + 2);
            if (x, y) == (0, 0) || k < dark - (k <= 12) as i32 { 2.0 } else { 0.0 }
        })
    };
    let told = filtered(21, 0.5, 2.0, 21).told().unwrap().text();
    assert!(told.contains("21 of 25 texels around say shadow"), "{told}");
    assert_eq!(filtered(21, 0.5, 2.0, 21).named(), "bleeding");
    assert_eq!(filtered(20, 0.5, 2.0, 21).named(), "bleeding");
    assert_eq!(filtered(18, 0.5, 2.0, 21).named(), "blur-wide");
    assert_eq!(filtered(18, 0.5, 2.0, 1).named(), "leak");
    assert_eq!(filtered(18, 0.5, 2.0, 3).named(), "blur-wide", "the shadow is wider than the filter reaches");
    assert_eq!(filtered(2, 0.9, 2.0, 21).named(), "stairs");
    assert_eq!(filtered(2, 0.9, 1.0, 1).named(), "stairs");
}

#[test]
fn what_no_look_up_tells_is_told_by_causes() {
    let of = |class: u8| {
        let mut case = Case::new("rt-hard", &[]).truth(edge_at(MIDDLE as i32 - 20)).here(0.0);
        case.seen.causes.classes[I] = class;
        case.unasked()
    };
    assert_eq!(of(ACNE), "acne");
    assert_eq!(of(DETACHMENT), "detachment");
    assert_eq!(of(LEAK), "leak");
    assert_eq!(of(MISSING), "missing-caster");
    assert_eq!(of(0), "stairs");
    let lit = falsely_lit(21);
    let told = diagnose(&lit.setup, &lit.seen, I, None, [1, 1]).unwrap().text();
    assert!(told.contains("The true edge is 10.5 pixels away.") && told.contains("The blocker is 2 m away."), "{told}");
}

/// A pixel that differs from those beside it more than the truth does is noise, where four levels are there or it is all over.
#[test]
fn noise_is_what_neighbours_do_not_share() {
    // Sixteen levels by place that look like chance, around a mean.
    let grain = |x: i32, y: i32| ((x * 7 + y * 13 + x * y * 5).rem_euclid(16)) as f32 / 16.0;
    let case =
        |amount: f32| Case::soft().truth(|_, _| 0.6).says(move |x, y| 0.6 + amount * (grain(x, y) - 0.5)).here(0.3);
    assert_eq!(case(0.5).named(), "noise");
    assert_ne!(case(0.0).named(), "noise");
    // Grain that the truth has as well is none.
    let mut shared = case(0.5);
    shared.seen.pixels.mean = shared.seen.pixels.visibility.clone();
    shared.seen.pixels.mean[I] = 0.6;
    assert_ne!(shared.named(), "noise");
    let told = case(0.5).told().unwrap().text();
    assert!(told.contains("on average beyond what the pixels around share, the truth by 0"), "{told}");
}

/// Of pixels that alternate by 0.15 above and below the truth each is 0.3 off the mean of the four beside; of independent noise that
/// would be √1.25 times its deviation. Two levels are noise where four in ten pixels are so, four levels anyway.
#[test]
fn grain_is_measured_and_counted() {
    let rows = |number: i32, second: f32| {
        let case = Case::soft().truth(|_, _| 0.6).says(move |x, y| {
            let (row, sign) = (y - MIDDLE as i32, if (x + y) % 2 == 0 { 1.0 } else { -1.0 });
            match row {
                _ if row.abs() > number / 2 || row == number / 2 && number % 2 == 0 => 0.6,
                0 => 0.6 - 0.15 * sign,
                _ => 0.6 - second * sign,
            }
        });
        case.here(0.45)
    };
    let told = rows(99, 0.15).told().unwrap();
    assert_eq!(told.artefact, "noise");
    assert!(told.text().contains("changes by 0.268 on average"), "{}", told.text());
    assert!(told.text().contains("the truth by 0."), "{}", told.text());
    assert_eq!(rows(3, 0.15).named(), "noise");
    assert_ne!(rows(2, 0.15).named(), "noise");
    assert_eq!(rows(2, 0.14).named(), "noise");
    // What the truth shares is half as rough as what is drawn, or rougher.
    let shared = |part: f32| {
        let mut case = rows(99, 0.15);
        let p = &mut case.seen.pixels;
        p.mean = p.visibility.iter().map(|v| 0.6 + part * (v - 0.6)).collect();
        p.mean[I] = 0.6;
        case.named()
    };
    assert_eq!(shared(0.45), "noise");
    assert_ne!(shared(0.55), "noise");
}

/// Where no edge of the truth is near, penumbrae are told by how far both run over the pixels around: nine across.
#[test]
fn slopes_tell_penumbrae_without_an_edge() {
    let case = |truth: f32, own: f32| {
        let from = |x: i32| (x - MIDDLE as i32) as f32;
        Case::soft()
            .truth(move |x, _| (0.8 + truth * from(x)).clamp(0.6, 0.95))
            .says(move |x, _| (0.65 + own * from(x)).clamp(0.55, 0.95))
    };
    assert_eq!(case(0.02, 0.01).named(), "blur-wide");
    assert_eq!(case(0.01, 0.02).named(), "blur-narrow");
    assert_eq!(case(0.02, 0.02).named(), "penumbra-off");
    assert_eq!(case(0.005, 0.001).named(), "penumbra-off", "neither runs over a tenth");
    let told = case(0.02, 0.01).told().unwrap().text();
    assert!(told.contains("visibility runs over 0.08, the truth over 0.16."), "{told}");
    let flat = case(0.02, 0.0).told().unwrap();
    assert_eq!(flat.artefact, "blur-wide", "{}", flat.text());
}

/// Ramps of one width beside a truth of another.
#[test]
fn penumbrae_are_told_by_their_widths() {
    let ramp = |width: f32, shift: f32| {
        let middle = MIDDLE as f32 - 2.3 + shift;
        move |x: i32, _: i32| ((x as f32 - middle) / width + 0.5).clamp(0.0, 1.0)
    };
    // The truth's is 16 pixels wide.
    let truth = ramp(16.0, 0.0);
    let case = |own: f32, shift: f32| Case::soft().truth(truth).says(ramp(own, shift));
    assert_eq!(case(24.0, 2.0).named(), "blur-wide");
    assert_eq!(case(9.0, 2.0).named(), "blur-narrow");
    assert_eq!(case(16.0, 3.0).named(), "penumbra-off");
    // A tenth to nine tenths of a ramp are four fifths of it.
    let told = case(16.0, 3.0).told().unwrap().text();
    assert!(told.contains("visibility takes 12.8 pixels, the truth 12.8"), "{told}");
    // Between 0.77 and 1.3 times as wide it counts as as wide.
    let widths = [(1.25, "penumbra-off"), (1.35, "blur-wide"), (0.8, "penumbra-off"), (0.73, "blur-narrow")];
    for (ratio, named) in widths {
        assert_eq!(case(16.0 * ratio, 3.0).named(), named, "{ratio}");
    }

    // Three levels where the truth runs evenly.
    let banded = |levels: f32| Case::soft().truth(truth).says(move |x, y| (truth(x, y) * levels).floor() / levels);
    assert_eq!(banded(4.0).named(), "banding");
    assert_ne!(banded(16.0).named(), "banding");
    let told = banded(4.0).told().unwrap().text();
    assert!(told.contains("visibility takes") && told.contains("levels."), "{told}");
}
