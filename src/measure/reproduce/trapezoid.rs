//! Morais 2015, 3.1: the trapezoid around the view frustum, and what it spends its texels on.

use super::{Bench, axis, short};
use crate::map::fit::tsm::{self, Tsm};
use crate::map::fit::{LightImage, Scope, hull, msf, warped};
use crate::measure::table;
use crate::scene::Clock;
use crate::setup::{Setup, scene_camera};
use anyhow::{Context, Result};
use glam::{DMat3, DVec2};

const SIZE: [u32; 2] = [1280, 640];
/// Where the point in focus lies, as a share of the frustum's length, and the share of the map that it gets.
const FOCUS: f64 = 0.2;
const RULE: f64 = 0.8;

/// Area of a convex polygon.
fn area(polygon: &[DVec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(p, q)| p.perp_dot(*q)).sum::<f64>().abs() / 2.0
}

/// Shares of the map that warp `h` of the light's image makes: the parts of the frustum before the point in focus, along
/// the centre line and by area, and what no part of the frustum takes.
fn shares(h: &DMat3, scope: &Scope, image: &LightImage) -> [f64; 3] {
    let eye = scope.eye();
    let ends = [eye.near, eye.near + FOCUS * (eye.far - eye.near), eye.far];
    let face = |z: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| {
            let at = eye.position + (eye.forward + eye.right * (x * eye.tangent.x) + eye.up * (y * eye.tangent.y)) * z;
            warped(h, image.at(at)).0
        })
    };
    let [near, middle, far] = ends.map(face);
    let whole = [near, far].concat();
    let [low, high] = hull::extent(whole.iter().copied());
    let map = (high - low).element_product();
    let center = |corner: f64| warped(h, image.at(eye.position + eye.forward * corner)).0;
    let along = center(ends[2]) - center(ends[0]);
    let axis = along.normalize();
    // From the line that touches the near side to the point in focus, over the way to the one on the far side.
    let reach = |points: &[DVec2]| hull::extent(points.iter().map(|p| DVec2::splat(p.dot(axis)))).map(|e| e.x);
    let [top, base] = reach(&whole);
    let focus = (center(ends[1]).dot(axis) - top) / (base - top);
    let before = area(&hull::hull(&[near, middle].concat())) / map;
    [focus, before, 1.0 - area(&hull::hull(&whole)) / map]
}

/// Distances from the trapezoid's top line to its base, to the point in focus and up to the vanishing point.
fn distances(t: &Tsm) -> Option<[f64; 3]> {
    let [base, _, top, _] = t.trapezoid?;
    let along = |p: DVec2| (p - top).dot(t.axis);
    Some([along(base), along(t.focus), -along(t.q)])
}

/// The parameter `p` of tsm that can be drawn.
const DRAWN: std::ops::RangeInclusive<f64> = 0.5..=0.95;

pub fn run(b: &mut Bench) -> Result<String> {
    let (renderer, mut trees) = b.open("bench")?;
    trees.camera = scene_camera(renderer.scene(), "trees-side", Clock::default())?;
    let (_, mut floor) = b.open("st-single-plane")?;
    (floor.camera, floor.light) = (axis::CAMERA, axis::zenith());
    let views = [("Side-Trees", "trees", trees), ("A level view over a floor, the sun in the zenith", "floor", floor)];
    let mut out = format!(
        "Pictures are {} × {} pixels. In focus: the first {:.0} % of the view's length.\n",
        SIZE[0],
        SIZE[1],
        100.0 * FOCUS
    );
    for (i, (name, file, setup)) in views.into_iter().enumerate() {
        b.done(i, 2);
        let setup = Setup { size: SIZE, ..setup };
        out += &view(b, name, file, &setup)?;
    }
    Ok(out)
}

fn view(b: &mut Bench, name: &str, file: &str, setup: &Setup) -> Result<String> {
    let (renderer, _) = b.open(&setup.scene)?;
    let bounds = renderer.geometry().bounds;
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let scope = Scope { camera: setup.camera, light: setup.light, bounds, aspect, resolution: 1024, margin: 0.0 };
    let (image, eye) = (scope.image(), scope.eye());
    let none = "there is no trapezoid around this view";
    let rule = tsm::fit(&scope, &image, RULE, FOCUS);
    let [lambda, delta, eta] = distances(&rule).context(none)?;
    // Every trapezoid between the two lines has some share of the map before the point in focus: try them all.
    let all = (1..1000).map(|k| (k as f64 / 1000.0, tsm::fit(&scope, &image, k as f64 / 1000.0, FOCUS)));
    let sized = all.filter_map(|(p, t)| Some((t.trapezoid.map(|t| area(&t))?, p, t)));
    let (_, naive_share, naive) = sized.min_by(|a, b| a.0.total_cmp(&b.0)).context(none)?;

    let turned = msf::turned(&rule.hull).unwrap_or(DMat3::IDENTITY);
    let fits = [
        ("box along the light's axes", None, DMat3::IDENTITY),
        ("box of least area", None, turned),
        ("naive trapezoid", distances(&naive), naive.warp),
        ("trapezoid, 80 % rule", distances(&rule), rule.warp),
    ];
    let head = ["fit", "η, m", "in focus, % of the map's height", "of its area", "wasted, %"];
    let mut lines = vec![head.map(String::from).to_vec()];
    for (fit, distances, h) in &fits {
        let mut line = vec![fit.to_string(), distances.map_or("-".into(), |d| short(d[2]))];
        line.extend(shares(h, &scope, &image).map(|s| format!("{:.1}", 100.0 * s)));
        lines.push(line);
    }
    // Equation 12.
    let closed = 0.4 * lambda * delta / (1.6 * lambda - 2.0 * delta);
    let at = |p: DVec2| warped(&rule.warp, p).0.y;
    let top = rule.q + rule.axis * eta;
    let mut out = format!(
        "\n{name}, {} to {} m: λ = {} m from the top line to the base, δ' = {} m from the top line to the point\n\
         in focus. Equation 12 gives η = {} m from the top line to the vanishing point q; ours is {} m. The 1D homography\n\
         takes the top line to {:.3}, the point in focus to {:.3} and the base to {:.3} (figure 13: 1, -0.6, -1).\n\n{}\n",
        short(eye.near),
        short(eye.far),
        short(lambda),
        short(delta),
        short(closed),
        short(eta),
        at(top),
        at(rule.focus),
        at(top + rule.axis * lambda),
        table::markdown(&lines)
    );
    let naive = DRAWN.contains(&naive_share).then_some(("naive trapezoid", "naive", naive_share));
    for (what, ending, p) in [Some(("80 % rule", "rule", RULE)), naive].into_iter().flatten() {
        let mut drawn = setup.clone();
        drawn.select("tsm")?;
        drawn.set(&format!("focus_share={p}"), &["tsm".into()])?;
        drawn.set(&format!("focus={FOCUS}"), &["tsm".into()])?;
        drawn.view = "warp".into();
        let says = format!("{name}, {what}: left the light's image, right the map");
        out += &b.capture(&format!("morais-15-{file}-{ending}.png"), &says, &drawn)?;
    }
    Ok(out)
}
