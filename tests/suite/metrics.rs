//! The measures on plain arrays: against their definitions and closed forms, and against what must not change them.

use crate::common::Random;
use glam::Vec2;
use shadowscope::measure::analysis::{Aliasing, Counts};
use shadowscope::measure::contour;
use shadowscope::measure::metrics::{self, AWAY, BACKGROUND, FACING};
use shadowscope::measure::{Column, Record};

/// m's mean, quantiles and shares equal their definitions.
#[test]
fn statistics_of_the_aliasing_error_equal_their_definitions() {
    let pixels: Vec<[f32; 4]> =
        (1..=200).map(|i| [i as f32 / 10.0, 2.0, i as f32 / 20.0, 1.0]).chain([[-1.0; 4]; 50]).collect();
    let m = Aliasing::of(&pixels).unwrap();
    let all: Vec<f64> = (1..=200).map(|i| i as f64 / 10.0).collect();
    assert!((m.mean - all.iter().sum::<f64>() / 200.0).abs() < 1e-6);
    assert!((m.rms - (all.iter().map(|x| x * x).sum::<f64>() / 200.0).sqrt()).abs() < 1e-5);
    let near = |a: f64, b: f64| (a - b).abs() < 0.11;
    assert!(near(m.p50, 10.0) && near(m.p95, 19.0) && near(m.p99, 19.8) && (m.max - 20.0).abs() < 1e-6);
    assert_eq!(m.over, [190.0 / 200.0, 180.0 / 200.0, 100.0 / 200.0]);
    assert!(near(m.perspective_p50, 2.0) && near(m.projection_p50, 5.0));
    // Of an area of 1 the shortest extent is 1 / m.
    let close = |[a, b]: [f64; 2], [c, d]: [f64; 2]| (a / c - 1.0).abs() < 1e-5 && (b / d - 1.0).abs() < 1e-5;
    assert!(close(m.area, [1.0, 1.0]) && close(m.anisotropy, [m.p50 * m.p50, m.p95 * m.p95]), "{m:?}");
    // The sum of squares is least at m = 1, where all are 2.
    let mut stretch: Vec<f64> = all.iter().map(|m| m * m + 1.0 / (m * m)).collect();
    stretch.sort_by(f64::total_cmp);
    let at = |q: f64| stretch[(199.0 * q).round() as usize];
    assert!(close(m.stretch, [at(0.5), at(0.95)]) && stretch[0] == 2.0, "{m:?}");
    assert_eq!(Aliasing::of(&[[-1.0; 4]; 9]), None);
}

/// A picture turned over or with its pixels in another order has the same numbers.
#[test]
fn order_and_mirror_change_no_number() {
    let (w, h) = (67, 41);
    let mut random = Random(5);
    let noise = |random: &mut Random, steps: f32| (0..w * h).map(|_| (random.next() * steps).round() / steps).collect();
    // Shadows with edges, a penumbra, noise, and every class.
    let disc = |i: usize, x: f32, y: f32, r: f32| {
        let d = Vec2::new((i % w) as f32 - x, (i / w) as f32 - y).length();
        ((d - r) * 0.4 + 0.5).clamp(0.0, 1.0)
    };
    let truth: Vec<f32> = (0..w * h).map(|i| disc(i, 25.0, 18.0, 12.0)).collect();
    let jitter: Vec<f32> = noise(&mut random, 4.0);
    let seen: Vec<f32> = (0..w * h).map(|i| if jitter[i] > 0.9 { 0.0 } else { disc(i, 27.0, 19.0, 13.0) }).collect();
    let class: Vec<f32> = noise(&mut random, 8.0);
    let classes = |c: f32| [AWAY, BACKGROUND, FACING][(c * 8.0).min(2.0) as usize];
    let mask: Vec<u32> = class.iter().map(|c| classes(*c)).collect();
    let picture = |v: &[f32]| v.iter().flat_map(|v| [*v, v * 0.5, v * v, 1.0].map(|x| (x * 255.0) as u8)).collect();
    let [a, b]: [Vec<u8>; 2] = [picture(&truth), picture(&seen)];
    let size = [w as u32, h as u32];
    let e = metrics::errors(&seen, &truth, &truth, &mask, w);
    let (rmse, flip) = (metrics::rmse_image(&a, &b), metrics::flip(&a, &b, size));
    let contour = contour::mean_distance(&seen, &truth, &mask, w).unwrap();
    assert!(e.boundary.is_some() && e.rmse_penumbra.is_some() && flip > 0.01, "{e:?} {flip}");

    let mut shuffled: Vec<usize> = (0..w * h).collect();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, (random.next() * (i + 1) as f32) as usize);
    }
    let left_right = (0..w * h).map(|i| i / w * w + w - 1 - i % w).collect();
    let up_down = (0..w * h).map(|i| (h - 1 - i / w) * w + i % w).collect();
    let orders: [(Vec<usize>, bool); 3] = [(left_right, true), (up_down, true), (shuffled, false)];
    for (order, neighbours) in orders {
        let [v, t]: [Vec<f32>; 2] = [&seen, &truth].map(|x| order.iter().map(|i| x[*i]).collect());
        let m: Vec<u32> = order.iter().map(|i| mask[*i]).collect();
        let mut other = metrics::errors(&v, &t, &t, &m, w);
        if !neighbours {
            // Where the edge lies depends on who stands beside whom.
            other.boundary = e.boundary;
        }
        assert!((other.rmse - e.rmse).abs() < 1e-12);
        assert!((other.rmse_penumbra.unwrap() - e.rmse_penumbra.unwrap()).abs() < 1e-12);
        assert!((other.mae - e.mae).abs() < 1e-12);
        assert_eq!(other.rmse_hard, other.rmse, "both truths are the same here");
        (other.rmse, other.rmse_hard, other.rmse_penumbra, other.mae) = (e.rmse, e.rmse_hard, e.rmse_penumbra, e.mae);
        assert_eq!(other, e);
        if neighbours {
            let other = contour::mean_distance(&v, &t, &m, w).unwrap();
            assert!(contour > 0.5 && (other - contour).abs() < 1e-9, "{other} {contour}");
        }
        let [c, d]: [Vec<u8>; 2] = [&a, &b].map(|x| order.iter().flat_map(|i| x[i * 4..i * 4 + 4].to_vec()).collect());
        assert!((metrics::rmse_image(&c, &d) - rmse).abs() < 1e-12);
        if neighbours {
            let other = metrics::flip(&c, &d, size);
            assert!((other - flip).abs() < 1e-4, "{other} {flip}");
        }
        let values: Vec<[f32; 4]> = seen.iter().zip(&truth).map(|(v, t)| [v - 0.2, *t, *v, 1.0]).collect();
        let moved: Vec<[f32; 4]> = order.iter().map(|i| values[*i]).collect();
        assert_eq!(Aliasing::of(&moved), Aliasing::of(&values));
        let filled = |order: &[usize]| order.iter().map(|i| 1 + (jitter[*i] * 9.0) as u32).collect();
        let straight: Vec<usize> = (0..w * h).collect();
        assert_eq!(Counts::of(9000, filled(&order)), Counts::of(9000, filled(&straight)));
    }
}

/// FLIP of constant greys has a closed form (Andersson et al. 2020): the distance of their lightnesses to the
/// power 0.7, rescaled by that of green and blue.
#[test]
fn flip_of_greys_is_its_closed_form() {
    let size = [24, 16];
    let flat = |level: u8| [level, level, level, 255].repeat(24 * 16);
    let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    let bent = |t: f64| if t > 216.0 / 24389.0 { t.cbrt() } else { (t * 24389.0 / 27.0 + 16.0) / 116.0 };
    let lightness = |level: u8| 116.0 * bent(linear(level as f64 / 255.0)) - 16.0;
    // L*a*b* of a linear sRGB primary, a* and b* after Hunt's adjustment, against the white of D65.
    let lab = |x: f64, y: f64, z: f64| {
        let (x, y, z) = (bent(x / 0.950428545), bent(y), bent(z / 1.088900371));
        let l = 116.0 * y - 16.0;
        [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
    };
    let green = lab(0.357575811, 0.715151622, 0.119191937);
    let blue = lab(0.180437460, 0.072174984, 0.950303949);
    let chroma = (green[1] - blue[1]).hypot(green[2] - blue[2]);
    let most = ((green[0] - blue[0]).abs() + chroma).powf(0.7);
    for (a, b) in [(0, 255), (100, 110), (40, 200), (128, 129), (90, 90)] {
        let distance = (lightness(a) - lightness(b)).abs().powf(0.7);
        let knee = 0.4 * most;
        let exact =
            if distance < knee { 0.95 / knee * distance } else { 0.95 + (distance - knee) / (most - knee) * 0.05 };
        let found = metrics::flip(&flat(a), &flat(b), size);
        assert!((found - exact).abs() < 2e-3, "{a} to {b}: {found} instead of {exact}");
    }
    // A stronger difference is never less.
    let mut last = 0.0;
    for step in [0u8, 8, 16, 32, 64, 96] {
        let spotted: Vec<u8> = (0..24 * 16)
            .flat_map(|i| {
                let level = if i % 5 == 0 { 128 + step } else { 128 };
                [level, level, level, 255]
            })
            .collect();
        let found = metrics::flip(&flat(128), &spotted, size);
        assert!(if step == 0 { found == 0.0 } else { found > last }, "{step}: {found} after {last}");
        last = found;
    }
}

/// Shares of a row are shown in percent, memory in MiB, and of nothing there is no share.
#[test]
fn columns_show_shares_in_percent() {
    let shown = |id: &str, row: &Record| (Column::find(id).unwrap().get)(row);
    let row = Record {
        error_share: 0.25,
        acne_share: 0.25,
        detachment_share: 0.25,
        leak_share: 0.25,
        missing_caster_share: 0.25,
        stairs_share: 0.25,
        beyond_tolerance: 0.25,
        power_16px: Some(0.25),
        power_8px: Some(0.25),
        power_4px: Some(0.25),
        power_2px: Some(0.25),
        flicker: Some(0.25),
        label_flicker: Some(0.25),
        covered_share: Some(0.25),
        utilisation: Some(0.25),
        contact_right: Some(1),
        contact_hits: Some(4),
        contact_repaired: Some(2),
        contact_detached: Some(8),
        gpu_bytes: 3 << 20,
        ..Record::default()
    };
    let columns = [
        "error_share",
        "acne_share",
        "detachment_share",
        "leak_share",
        "missing_caster_share",
        "stairs_share",
        "beyond_tolerance",
        "power_16px",
        "power_8px",
        "power_4px",
        "power_2px",
        "flicker",
        "label_flicker",
        "covered_share",
        "utilisation",
        "contact_right",
        "contact_repaired",
    ];
    for id in columns {
        assert_eq!(shown(id, &row), Some(25.0), "{id}");
        assert_eq!(Column::find(id).unwrap().unit(), "%", "{id}");
    }
    assert_eq!(shown("gpu_bytes", &row), Some(3.0));
    let none = Record { contact_right: Some(0), contact_hits: Some(0), contact_detached: Some(3), ..row };
    assert_eq!(shown("contact_right", &none), None);
    assert_eq!(shown("contact_repaired", &Record { contact_repaired: None, ..none }), None);
}

/// The root mean square over the pixels that face the light.
#[test]
fn differences_are_averaged_where_pixels_can_be_wrong() {
    let mask = [FACING, AWAY, FACING, BACKGROUND, FACING, FACING];
    let found = metrics::rms(&[1.0, 1.0, 0.5, 1.0, 0.0, 0.25], &[0.0, 0.0, 0.5, 0.0, 0.5, 0.25], &mask);
    assert!((found - (1.25f64 / 4.0).sqrt()).abs() < 1e-12, "{found}");
    assert_eq!(metrics::rms(&[1.0], &[0.0], &[AWAY]), 0.0);
}
