//! Kenzel 2013: what goes wrong in a shadow map, and what a filter does about it.

use super::{Bench, holds, short, with};
use crate::measure::{self, Record, table};
use crate::scene::Camera;
use crate::setup::{Setup, scene_camera, scene_light};
use anyhow::Result;
use glam::Vec3;

/// A pane of the figures.
pub const SIZE: [u32; 2] = [240, 150];

/// Acne does not compress.
const SMALL: [u32; 2] = [200, 125];

/// The blocks, in the place of his jenga, under one of their lights.
fn blocks(b: &mut Bench, light: &str) -> Result<Setup> {
    let (renderer, mut setup) = b.open("blocks")?;
    setup.camera = scene_camera(renderer.scene(), "fallen")?;
    setup.light = scene_light(renderer.scene(), light)?;
    setup.size = SIZE;
    Ok(setup)
}

/// Measures set-ups of one scene.
fn measured(b: &mut Bench, setups: &[Setup]) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    for (i, setup) in setups.iter().enumerate() {
        b.done(i, setups.len());
        let (renderer, _) = b.open(&setup.scene)?;
        records.push(measure::accuracy(renderer, setup, 0)?);
    }
    Ok(records)
}

/// What a bias is called here, and its parameters.
type Bias = (&'static str, &'static [&'static str]);

/// Biases to compare under a light: none at all, at two precisions of the map; constants; those that follow the slope.
struct Biases {
    light: &'static str,
    says: &'static str,
    none: [Bias; 2],
    constant: [Bias; 6],
    /// The rasteriser's; the look-up's, in two precisions.
    slope: [Bias; 3],
}

const BIASES: [Biases; 2] = [
    Biases {
        light: "sun",
        says: "The sun, 32 bits of linear depth, constants along its rays:",
        none: [("none", &["bias_kind=none"]), ("none, 16 bits", &["bias_kind=none", "format=16"])],
        constant: [
            ("0.005 m", &["slope_bias=0", "bias=0.005"]),
            ("0.02 m", &["slope_bias=0", "bias=0.02"]),
            ("0.05 m", &["slope_bias=0", "bias=0.05"]),
            ("0.1 m", &["slope_bias=0", "bias=0.1"]),
            ("0.2 m", &["slope_bias=0", "bias=0.2"]),
            ("0.5 m", &["slope_bias=0", "bias=0.5"]),
        ],
        slope: [
            ("slope, rasteriser", &["bias_kind=none", "hardware_slope=2"]),
            ("slope, look-up", &[]),
            ("slope, look-up, 16 bits", &["format=16"]),
        ],
    },
    Biases {
        light: "spot",
        says: "The spot, 24 bits of hyperbolic depth, constants in steps of it, by the rasteriser:",
        none: [("none", &["bias_kind=none", "format=24"]), ("none, 16 bits", &["bias_kind=none", "format=16"])],
        constant: [
            ("32 steps", &["bias_kind=none", "format=24", "hardware_bias=32"]),
            ("64 steps", &["bias_kind=none", "format=24", "hardware_bias=64"]),
            ("128 steps", &["bias_kind=none", "format=24", "hardware_bias=128"]),
            ("256 steps", &["bias_kind=none", "format=24", "hardware_bias=256"]),
            ("512 steps", &["bias_kind=none", "format=24", "hardware_bias=512"]),
            ("1024 steps", &["bias_kind=none", "format=24", "hardware_bias=1024"]),
        ],
        slope: [
            ("slope, rasteriser", &["bias_kind=none", "format=24", "hardware_slope=2"]),
            ("slope, look-up", &["format=24"]),
            ("slope, look-up, 16 bits", &["format=16"]),
        ],
    },
];

/// Figures 1.5 and 1.6: no bias, constant ones, and one that follows the slope.
pub fn bias(b: &mut Bench) -> Result<String> {
    /// Far less is taken as a tenth, more as twice.
    const FAR_LESS: f64 = 0.1;
    const MORE: f64 = 2.0;
    let mut out = format!(
        "The blocks, camera `fallen`, {} × {} pixels, a map of 1024². Shares of the pixels that face the light, by\n\
         [cause](measures.md#causes-of-errors); peter-panning is detachment and missing casters.\n",
        SIZE[0], SIZE[1]
    );
    for Biases { light, says, none, constant, slope } in &BIASES {
        let rows = [&none[..], constant, slope].concat();
        let start = blocks(b, light)?;
        let setups: Vec<Setup> =
            rows.iter().map(|(_, sets)| with(&start, "shadow-map", sets)).collect::<Result<_>>()?;
        let records = measured(b, &setups)?;
        let parts = |r: &Record| [r.acne_share, r.detachment_share + r.missing_caster_share].map(|x| 100.0 * x);
        let both = |r: &Record| parts(r).iter().sum::<f64>();
        let head = ["bias", "acne, %", "peter-panning, %", "both, %", "all wrong, %"];
        let mut lines = vec![head.map(String::from).to_vec()];
        for ((name, _), r) in rows.iter().zip(&records) {
            let [acne, gap] = parts(r);
            let cells = [acne, gap, both(r), 100.0 * r.error_share].map(short);
            lines.push([vec![name.to_string()], cells.to_vec()].concat());
        }
        let (bare, rest) = records.split_at(none.len());
        let (constants, slopes) = rest.split_at(constant.len());
        let best = (0..constants.len()).min_by(|i, k| both(&constants[*i]).total_cmp(&both(&constants[*k])));
        let best = best.unwrap_or_default();
        let [acne, _] = parts(&bare[0]);
        let [_, gap] = parts(&constants[constants.len() - 1]);
        let [acne_left, gap_left] = parts(&slopes[1]);
        out += &format!(
            "\n{says}\n\n{}\n\
             - Figures 1.5 and 2.16, acne without a bias and far less with a slope bias: {} against {} %, {}.\n\
             - Figures 1.6 and 2.16, peter-panning from a large constant and far less with a slope bias: {} against\n  {} %, {}.\n\
             - No constant strikes the balance that the slope bias does: the best, {}, leaves {} % of both, the slope bias of\n  \
             the look-up {} %, {}, that of the rasteriser {} %, {}.\n\
             - Acne comes from the precision of depth, so that a map of 16 bits has more of it: without a bias {} % become\n  \
             {} %, {}; with the slope bias {} % become {} %, {}.\n",
            table::markdown(&lines),
            short(acne),
            short(acne_left),
            holds(acne_left < FAR_LESS * acne),
            short(gap),
            short(gap_left),
            holds(gap_left < FAR_LESS * gap),
            constant[best].0,
            short(both(&constants[best])),
            short(both(&slopes[1])),
            holds(both(&slopes[1]) < both(&constants[best])),
            short(both(&slopes[0])),
            holds(both(&slopes[0]) < both(&constants[best])),
            short(acne),
            short(parts(&bare[1])[0]),
            holds(parts(&bare[1])[0] > MORE * acne),
            short(acne_left),
            short(parts(&slopes[2])[0]),
            holds(parts(&slopes[2])[0] > MORE * acne_left),
        );
    }
    let start = blocks(b, "sun")?;
    let [bare, large] = [BIASES[0].none[0], BIASES[0].constant[5]];
    for (figure, (name, sets), size) in [("1.5", bare, SMALL), ("1.6", large, SIZE)] {
        let start = Setup { size, ..start.clone() };
        let panes = [with(&start, "shadow-map", sets)?, with(&start, "shadow-map", &[])?];
        let says = format!("Figure {figure}, the sun: left {name}, right the slope bias");
        out += &format!("\n{}", b.panes(&format!("kenzel-{figure}.png"), &says, &panes)?);
    }
    Ok(out)
}

/// Figure 1.7: maps of several sizes beside rays.
pub fn stairs(b: &mut Bench) -> Result<String> {
    const MAPS: [u32; 4] = [512, 1024, 2048, 4096];
    let start = blocks(b, "sun")?;
    let map = |side: &u32| with(&start, "shadow-map", &[&format!("resolution={side}")]);
    let mut setups: Vec<Setup> = MAPS.iter().map(map).collect::<Result<_>>()?;
    setups.push(with(&start, "rt-hard", &[])?);
    let records = measured(b, &setups)?;
    let head = ["", "m, pixels per texel", "wrong at edges, %", "all wrong, %", "contour off by, pixels"];
    let mut lines = vec![head.map(String::from).to_vec()];
    let names = MAPS.iter().map(|side| format!("map of {side}²")).chain(["rays".into()]);
    for (name, r) in names.zip(&records) {
        let number = |x: Option<f64>| x.map_or("-".into(), short);
        let shares = [r.stairs_share, r.error_share].map(|x| short(100.0 * x));
        lines.push([vec![name, number(r.m_p50)], shares.to_vec(), vec![number(r.contour_mean_px)]].concat());
    }
    let (exact, maps) = (&records[MAPS.len()], &records[..MAPS.len()]);
    let off = |r: &Record| r.contour_mean_px.unwrap_or(f64::INFINITY);
    let shown =
        b.panes("kenzel-1.7.png", "A map of 512², and rays", &[setups[0].clone(), setups[MAPS.len()].clone()])?;
    Ok(format!(
        "The blocks, camera `fallen`, the sun, {} × {} pixels.\n\n{}\n\
         - Most of what a map gets wrong lies at edges: at least {:.0} %, {}.\n\
         - Undersampling is the cause, the error falls with m: {}.\n\
         - The other method's edges are exact: off by {} pixels, {}.\n\n{shown}",
        SIZE[0],
        SIZE[1],
        table::markdown(&lines),
        100.0 * maps.iter().map(|r| r.stairs_share / r.error_share).fold(1.0, f64::min),
        holds(maps.iter().all(|r| r.stairs_share > 0.5 * r.error_share)),
        holds(maps.windows(2).all(|w| off(&w[1]) < off(&w[0]) && w[1].stairs_share < w[0].stairs_share)),
        short(off(exact)),
        holds(off(exact) == 0.0),
    ))
}

/// A wall with a corner, boxes and plates on the floor of `st-contact`.
pub const CORNER: Camera =
    Camera { position: Vec3::new(0.1, 0.9, 1.7), target: Vec3::new(0.3, 0.0, 0.3), fov: 46.0, near: 0.05, far: 20.0 };

/// Figure 5.5 without EDSM: one comparison, the hardware's four and a wide filter of them, in ever finer maps.
pub fn coarse(b: &mut Bench) -> Result<String> {
    const MAPS: [u32; 6] = [64, 128, 256, 512, 1024, 2048];
    const LOOK_UPS: [(&str, &str, &[&str]); 3] = [
        ("SSM", "shadow-map", &[]),
        ("PCF, 2 × 2", "pcf", &["mode=hw2x2", "kernel=1"]),
        ("PCF, 4 × 4", "pcf", &["mode=hw2x2", "kernel=3"]),
    ];
    let (_, start) = b.open("st-contact")?;
    let start = Setup { camera: CORNER, size: SIZE, ..start };
    let mut setups = Vec::new();
    for side in MAPS {
        for (_, technique, sets) in LOOK_UPS {
            let map = format!("resolution={side}");
            setups.push(with(&start, technique, &[&[&*map, "bias_kind=ray-plane"], sets].concat())?);
        }
    }
    setups.push(with(&start, "rt-hard", &[])?);
    let records = measured(b, &setups)?;
    let (exact, maps) = (&records[setups.len() - 1], &records[..setups.len() - 1]);
    let mut head = vec!["map".to_string(), "m, pixels per texel".into()];
    head.extend(LOOK_UPS.iter().flat_map(|(name, ..)| [format!("{name}: RMSE"), "contour off by, pixels".into()]));
    let mut lines = vec![head];
    let off = |r: &Record| r.contour_mean_px.unwrap_or(f64::INFINITY);
    let m = |r: &Record| r.m_p50.unwrap_or_default();
    let rows: Vec<&[Record]> = maps.chunks(LOOK_UPS.len()).collect();
    for (side, row) in MAPS.iter().zip(&rows) {
        let cells = row.iter().flat_map(|r| [short(r.rmse), r.contour_mean_px.map_or("none".into(), short)]);
        lines.push([vec![format!("{side}²"), short(m(&row[0]))], cells.collect()].concat());
    }
    let falls = |i: usize, rows: &[&[Record]]| rows.windows(2).all(|w| w[1][i].rmse < w[0][i].rmse);
    // Whatever has more than a pixel a texel is undersampled.
    let under = rows.iter().take_while(|row| m(&row[0]) > 1.0).count();
    let jagged = rows[..under].iter().map(|row| off(&row[1]) / off(&row[0])).fold(f64::INFINITY, f64::min);
    let shown = b.panes(
        "kenzel-5.5.png",
        "A map of 64², row by row: SSM; PCF, 2 × 2; PCF, 4 × 4; rays",
        &[setups[0].clone(), setups[1].clone(), setups[2].clone(), setups[setups.len() - 1].clone()],
    )?;
    Ok(format!(
        "`st-contact` from close by, {} × {} pixels, `bias_kind = \"ray-plane\"`. PCF is one bilinear comparison, as hardware\n\
         has it, or nine of them around it. RMSE is against the truth averaged over 16 samples a pixel, of which one ray\n\
         has {}.\n\n{}\n\
         - In an extreme case both SSM and PCF are badly jagged: at 64² texels their contours are off by {} and {} pixels, more\n  \
         than one, {}.\n\
         - PCF does not straighten edges: as long as a texel takes more than a pixel, its contour is off by more than half as\n  \
         much as SSM's: by at least {:.2} times, {}.\n\
         - Its error falls with each doubling of an undersampled map, {}; of all of them, {}.\n\n{shown}",
        SIZE[0],
        SIZE[1],
        short(exact.rmse),
        table::markdown(&lines),
        short(off(&rows[0][0])),
        short(off(&rows[0][1])),
        holds(off(&rows[0][0]).min(off(&rows[0][1])) > 1.0),
        jagged,
        holds(jagged > 0.5),
        holds(falls(1, &rows[..under])),
        holds(falls(1, &rows)),
    ))
}
