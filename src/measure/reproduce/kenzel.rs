//! Kenzel 2013: what goes wrong in a shadow map, and what a filter and the silhouette do about it.

use super::{Bench, holds, short, with};
use crate::measure::{self, Record, table, timing};
use crate::scene::{Camera, Clock};
use crate::setup::{Setup, scene_camera, scene_light};
use crate::techniques;
use anyhow::Result;
use glam::Vec3;

/// A pane of the figures.
pub const SIZE: [u32; 2] = [240, 150];

/// Acne does not compress.
const SMALL: [u32; 2] = [200, 125];

/// The blocks, in the place of his jenga, under one of their lights.
fn blocks(b: &mut Bench, light: &str) -> Result<Setup> {
    let (renderer, mut setup) = b.open("blocks")?;
    setup.camera = scene_camera(renderer.scene(), "fallen", Clock::default())?;
    setup.light = scene_light(renderer.scene(), light, Clock::default())?;
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
pub const CORNER: Camera = Camera::new(Vec3::new(0.1, 0.9, 1.7), Vec3::new(0.3, 0.0, 0.3), 46.0, 0.05, 20.0);

/// Figure 5.5: one comparison, the hardware's four, a wide filter of them and the distance from edges, in ever finer maps.
pub fn coarse(b: &mut Bench) -> Result<String> {
    const MAPS: [u32; 6] = [64, 128, 256, 512, 1024, 2048];
    const LOOK_UPS: [(&str, &str, &[&str]); 4] = [
        ("SSM", "shadow-map", &[]),
        ("PCF, 2 × 2", "pcf", &["mode=hw2x2", "kernel=1"]),
        ("PCF, 4 × 4", "pcf", &["mode=hw2x2", "kernel=3"]),
        ("EDSM", "edsm", &["check=false"]),
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
        "A map of 64², row by row: SSM; PCF, 2 × 2; EDSM; rays",
        &[setups[0].clone(), setups[1].clone(), setups[3].clone(), setups[setups.len() - 1].clone()],
    )?;
    Ok(format!(
        "`st-contact` from close by, {} × {} pixels, `bias_kind = \"ray-plane\"`. PCF is one bilinear comparison, as hardware\n\
         has it, or nine of them around it. RMSE is against the truth averaged over 16 samples a pixel, of which one ray\n\
         has {}.\n\n{}\n\
         - In an extreme case both SSM and PCF are badly jagged: at 64² texels their contours are off by {} and {} pixels, more\n  \
         than one, {}.\n\
         - PCF does not straighten edges: as long as a texel takes more than a pixel, its contour is off by more than half as\n  \
         much as SSM's: by at least {:.2} times, {}.\n\
         - Its error falls with each doubling of an undersampled map, {}; of all of them, {}.\n\
         - EDSM still reconstructs edges there, a corner apart: at 64² texels its error is {} of SSM's and {} of PCF's, less than\n  \
         three quarters, {}.\n\n{shown}",
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
        short(rows[0][3].rmse / rows[0][0].rmse),
        short(rows[0][3].rmse / rows[0][1].rmse),
        holds(rows[0][3].rmse < 0.75 * rows[0][0].rmse.min(rows[0][1].rmse)),
    ))
}

/// The methods of figures 5.2 to 5.4; what is not there is left out.
const METHODS: [(&str, &str, &[&str]); 5] = [
    ("SSM", "shadow-map", &[]),
    ("EDSM", "edsm", &["check=false"]),
    ("EDSM, exact corners", "edsm", &["corners=exact"]),
    ("SSSM", "sssm", &[]),
    ("SV", "shadow-volume", &[]),
];

/// Figures 5.2 to 5.4: time, primitives and fragments.
pub fn cost(b: &mut Bench) -> Result<String> {
    const SIDE: &str = "resolution=1024";
    const ROUNDS: usize = 5;
    let there: Vec<_> = METHODS.iter().filter(|(_, id, _)| techniques::find(id).is_some()).collect();
    let mut out = String::from(
        "Pictures of 480 × 300 pixels, maps of 1024², the scenes' first cameras and suns. Primitives are the triangles that all\n\
         passes of a method send, fragments those that its raster passes shade.\n",
    );
    for (scene, his) in [("blocks", "jenga"), ("pavilion", "phaeno")] {
        let (_, start) = b.open(scene)?;
        let start = Setup { size: [480, 300], ..start };
        let sets = |id: &str, sets: &[&'static str]| {
            let map = techniques::find(id).is_some_and(|i| i.specs().any(|s| s.name == "resolution"));
            [sets, if map { &[SIDE][..] } else { &[] }].concat()
        };
        let setups: Vec<Setup> =
            there.iter().map(|(_, id, own)| with(&start, id, &sets(id, own))).collect::<Result<_>>()?;
        let records = measured(b, &setups)?;
        let (renderer, _) = b.open(scene)?;
        let times = timing::briefly(renderer, &setups, ROUNDS)?;
        let count = |x: Option<u64>| x.map_or("-".into(), |x| x.to_string());
        let head = ["", "ms", "primitives", "fragments", "wrong, %"];
        let mut lines = vec![head.map(String::from).to_vec()];
        for (((name, ..), r), t) in there.iter().zip(&records).zip(&times) {
            let wrong = short(100.0 * r.error_share);
            let cells = [short(t.gpu.median), count(r.triangles_submitted), count(r.fragments), wrong];
            lines.push([vec![name.to_string()], cells.to_vec()].concat());
        }
        let ms = |name: &str| there.iter().position(|m| m.0 == name).map(|i| times[i].gpu.median);
        let [ssm, edsm, sssm] = ["SSM", "EDSM", "SSSM"].map(|name| ms(name).unwrap_or(f64::NAN));
        out += &format!(
            "\n`{scene}`, in the place of his {his}{}:\n\n{}\n\
             - SSM is the fastest: {}.\n\
             - EDSM and SSSM take about the same, within a third: {:.2} times, {}.\n",
            if times[0].wall_clock { ", by the wall clock" } else { "" },
            table::markdown(&lines),
            holds(ssm < edsm && ssm < sssm),
            edsm / sssm,
            holds((0.75..1.34).contains(&(edsm / sssm))),
        );
        if let Some(sv) = ms("SV") {
            let primitives = |name: &str| {
                let at = there.iter().position(|m| m.0 == name);
                at.and_then(|i| records[i].triangles_submitted).unwrap_or_default()
            };
            out += &format!(
                "- SV is by far the slowest, at least twice as slow as the others: {}.\n\
                 - SV has the most primitives: {}.\n",
                holds(sv > 2.0 * edsm.max(sssm)),
                holds(primitives("SV") > primitives("EDSM").max(primitives("SSSM"))),
            );
        }
    }
    Ok(out)
}

/// Figures 3.6, 3.7 and 5.6 to 5.8: each artefact beside what is free of it.
pub fn artefacts(b: &mut Bench) -> Result<String> {
    type Mode = (&'static str, &'static str, &'static [&'static str]);
    let rows: [(&str, &str, Option<&str>, &[Mode]); 4] = [
        (
            "3.6, 3.7",
            "st-corner",
            None,
            &[
                ("stream order", "edsm", &["resolution=256", "check=false", "priority=order"]),
                ("smallest distance", "edsm", &["resolution=256", "check=false", "priority=min"]),
                ("the function of (3.8)", "edsm", &["resolution=256", "check=false", "priority=seed"]),
                ("nearest segment", "edsm", &["resolution=256", "check=false"]),
            ],
        ),
        (
            "5.6",
            "blocks",
            Some("spot"),
            &[
                ("quads before the projection", "edsm", &["resolution=512", "check=false", "quads_in=world"]),
                ("quads after it", "edsm", &["resolution=512", "check=false"]),
            ],
        ),
        (
            "5.7",
            "st-corner",
            None,
            &[
                ("one distance a texel", "edsm", &["resolution=128"]),
                ("two edges, each by itself", "edsm", &["resolution=128", "corners=exact"]),
            ],
        ),
        (
            "5.8",
            "st-fence",
            None,
            &[
                ("one distance a texel", "edsm", &["resolution=256", "check=false"]),
                ("the same where it agrees with the map", "edsm", &["resolution=256"]),
                ("two edges, each by itself", "edsm", &["resolution=256", "corners=exact"]),
                ("SSSM", "sssm", &["resolution=256"]),
            ],
        ),
    ];
    let mut out = format!("Pictures of {} × {} pixels, the scenes' first cameras.\n", SIZE[0], SIZE[1]);
    for (figure, scene, light, modes) in rows {
        let (renderer, mut start) = b.open(scene)?;
        if let Some(light) = light {
            start.light = scene_light(renderer.scene(), light, Clock::default())?;
        }
        start.size = SIZE;
        let mut setups: Vec<Setup> = modes.iter().map(|(_, id, sets)| with(&start, id, sets)).collect::<Result<_>>()?;
        let map = modes[0].2[0];
        setups.push(with(&start, "shadow-map", &[map])?);
        let records = measured(b, &setups)?;
        setups.pop();
        let mut lines = vec![["", "wrong, %", "at edges, %"].map(String::from).to_vec()];
        let names = modes.iter().map(|m| m.0).chain(["the plain map"]);
        for (name, r) in names.zip(&records) {
            let shares = [r.error_share, r.stairs_share].map(|x| short(100.0 * x));
            lines.push([vec![name.to_string()], shares.to_vec()].concat());
        }
        let wrong: Vec<f64> = records.iter().map(|r| r.error_share).collect();
        let falls = match figure {
            "5.8" => wrong[1] < wrong[0] && wrong[2] < wrong[1],
            _ => wrong[..modes.len()].windows(2).all(|w| w[1] < w[0]),
        };
        for setup in &mut setups {
            setup.view = "error".into();
        }
        let says: Vec<&str> = modes.iter().map(|m| m.0).collect();
        let says = format!("Figure {figure}, errors, row by row: {}", says.join("; "));
        let file = format!("kenzel-{}.png", figure.split(',').next().unwrap_or(figure));
        out += &format!(
            "\nFigure {figure}, `{scene}`, {}²:\n\n{}\n- Each is better than the one before it: {}.\n\n{}",
            map.trim_start_matches("resolution="),
            table::markdown(&lines),
            holds(falls),
            b.panes(&file, &says, &setups)?,
        );
    }
    Ok(out)
}
