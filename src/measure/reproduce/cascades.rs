//! Navratil 2015, section 3.2.2: what cascades cover, and where they meet.

use super::kenzel::SIZE;
use super::{Bench, holds, short, with};
use crate::frame::Ask;
use crate::measure::metrics::{FACING, TOLERANCE};
use crate::measure::{self, Record, table};
use crate::scene::Camera;
use crate::setup::{Overlay, Setup};
use anyhow::{Context, Result};
use glam::Vec3;

/// Figure 3.8: maps that cover their parts of the view, and only what there can cast and receive shadows.
pub fn fits(b: &mut Bench) -> Result<String> {
    const SCENES: [&str; 3] = ["observatory", "cubes", "blocks"];
    const PARTS: usize = 3;
    const FITS: [&str; 2] = ["indep", "crop"];
    let mut head = vec!["scene".to_string(), "part".into()];
    head.extend(["independent, m", "dependent, m", "dependent / independent, area"].map(String::from));
    let mut sides = vec![head];
    let head = ["scene", "wrong, %: independent", "dependent", "missing casters, %: independent", "dependent"];
    let mut errors = vec![head.map(String::from).to_vec()];
    let (mut smaller, mut better, mut shown) = (true, true, String::new());
    for (i, scene) in SCENES.into_iter().enumerate() {
        let mut boxes = [[[0.0; 2]; PARTS]; 2];
        let (mut records, mut setups): (Vec<Record>, Vec<Setup>) = (Vec::new(), Vec::new());
        for (k, fit) in FITS.into_iter().enumerate() {
            b.done(2 * i + k, 2 * SCENES.len());
            let (renderer, start) = b.open(scene)?;
            let start = Setup { size: SIZE, ..start };
            let sets = ["resolution=512", &format!("cascades={PARTS}"), &format!("fit={fit}")];
            let setup = with(&start, "pssm", &sets)?;
            records.push(measure::accuracy(renderer, &setup, 0)?);
            for (part, of) in boxes[k].iter_mut().enumerate() {
                let view = renderer.read_layer(part as u32)?.context("pssm has maps")?.view;
                *of = [view.row_x, view.row_y].map(|row| 2.0 / row.truncate().length() as f64);
            }
            setups.push(Setup { view: "side".into(), ..setup });
        }
        for part in 0..PARTS {
            let [indep, crop] = boxes.map(|of| of[part]);
            let ratio = crop[0] * crop[1] / (indep[0] * indep[1]);
            smaller &= ratio < 1.001;
            let metres = |[x, y]: [f64; 2]| format!("{x:.1} × {y:.1}");
            let cells = [scene.into(), (part + 1).to_string(), metres(indep), metres(crop), format!("{ratio:.2}")];
            sides.push(cells.to_vec());
        }
        better &= records[1].error_share <= records[0].error_share;
        let of = |value: fn(&Record) -> f64| [0, 1].map(|k| short(100.0 * value(&records[k])));
        let cells = [of(|r| r.error_share), of(|r| r.missing_caster_share)].concat();
        errors.push([vec![scene.to_string()], cells].concat());
        if i == 0 {
            let says = format!("{scene} from the side: left the independent maps, right the dependent ones");
            shown = b.panes("navratil-3.8.png", &says, &setups)?;
        }
    }
    Ok(format!(
        "Three parts, maps of 512², {} × {} pixels, each scene's first view and light. Independent of the scene is `fit = indep`,\n\
         the box around a part along the light's axes; dependent is `fit = crop`. Sides of the maps:\n\n{}\n{}\n\
         - No map that depends on the scene covers more: {}.\n\
         - Results are best with it: no more wrong pixels in any scene, {}.\n\n{shown}",
        SIZE[0],
        SIZE[1],
        table::markdown(&sides),
        table::markdown(&errors),
        holds(smaller),
        holds(better),
    ))
}

/// The wall of `st-seam` with the shadow of a long bar.
const WALL: Camera = Camera::new(Vec3::new(1.2, 1.4, -0.3), Vec3::new(-2.0, 1.1, -2.2), 54.0, 0.1, 90.0);
/// Where the first cascade ends, and the strip around that in which both are looked up, metres from the camera.
const SEAM: f32 = 3.7;
const STRIP: [f32; 2] = [3.3, 4.1];

/// Figure 3.9: what looking up one cascade instead of the next changes where they meet.
pub fn seam(b: &mut Bench) -> Result<String> {
    const LOOK_UPS: [(&str, &[&str]); 4] = [
        ("one comparison", &[]),
        ("PCF, 3 × 3 texels", &["filter=pcf", "kernel=3"]),
        ("PCF, 0.1 m", &["filter=pcf", "kernel=9", "blur=0.1"]),
        ("PCF, 0.2 m", &["filter=pcf", "kernel=9", "blur=0.2"]),
    ];
    let (_, start) = b.open("st-seam")?;
    let start = Setup { camera: WALL, size: SIZE, ..start };
    let head =
        ["look-up", "step, root mean square", "one comparison = 1", "largest", "pixels with more than a tenth, %"];
    let mut lines = vec![head.map(String::from).to_vec()];
    let (mut steps, mut setups, mut jump) = (Vec::new(), Vec::new(), 0.0);
    for (i, (name, sets)) in LOOK_UPS.into_iter().enumerate() {
        b.done(i, LOOK_UPS.len());
        let split = |z: f32| {
            let percent = |z: f32| 100.0 * (z - WALL.near) / (WALL.far - WALL.near);
            let [first, second] = [z, 20.0].map(percent);
            let ends = [format!("percent_1={first}"), format!("percent_2={second}")];
            let common = ["cascades=3", "range=camera", "scheme=percent", "fit=indep", "resolution=512", "blend=0"];
            let [first, second] = [&*ends[0], &*ends[1]];
            with(&start, "pssm", &[&common[..], &["bias_kind=ray-plane", first, second], sets].concat())
        };
        // Split behind the strip, it is in the near map; split before it, in the far one.
        let (mut texels, mut seen, mut inside) = (Vec::new(), Vec::new(), Vec::new());
        for z in [STRIP[1], STRIP[0]] {
            let (renderer, _) = b.open(&start.scene)?;
            let at = split(z)?;
            renderer.render(&at, Ask { analysis: true, picture: false, ..Ask::of(&at) })?;
            let m = renderer.analysis().aliasing(&renderer.gpu)?.context("pssm has maps")?;
            let (mask, points) = (renderer.read_mask()?, renderer.read_position()?);
            inside = (0..mask.len())
                .filter(|i| mask[*i] == FACING && (STRIP[0]..STRIP[1]).contains(&points[*i][3]))
                .collect();
            texels.push(m);
            seen.push(renderer.read_visibility()?);
        }
        let count = inside.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| inside.iter().map(|i| of(*i)).sum::<f64>() / count;
        let step = |i: usize| (seen[0][i] - seen[1][i]).abs() as f64;
        let rms = mean(&|i| step(i).powi(2)).sqrt();
        let most = inside.iter().map(|i| step(*i)).fold(0.0, f64::max);
        let seen_share = mean(&|i| (step(i) > TOLERANCE as f64) as u32 as f64);
        if i == 0 {
            jump = mean(&|i| (texels[1][i][3] / texels[0][i][3]).sqrt() as f64);
        }
        steps.push((rms, seen_share));
        let cells = [short(rms), format!("{:.2}", rms / steps[0].0), short(most), short(100.0 * seen_share)];
        lines.push([vec![name.to_string()], cells.to_vec()].concat());
        let overlay = Some(Overlay { view: "cascades".into(), opacity: 0.15, inset: false });
        setups.push(Setup { overlay, ..split(SEAM)? });
    }
    let says = "Row by row: one comparison; PCF of 3 × 3 texels, 0.1 m and 0.2 m; the cascades are tinted";
    let shown = b.panes("navratil-3.9.png", says, &setups)?;
    Ok(format!(
        "The wall of `st-seam`, {} × {} pixels, three maps of 512², no blending. The strip between {} and {} m is looked\n\
         up twice: in the first cascade, which then ends behind it, and in the second, which then begins before it. Texels of the second are\n\
         {jump:.2} times as long there. What changes is the step that is seen at a seam.\n\n{}\n\
         - Different resolutions show at the boundary: {} % of the strip changes by more than a tenth of the light, {}.\n\
         - PCF makes the step smaller, in all three widths: {}.\n\
         - PCF mends it, so that no pixel changes by more than a tenth: {}.\n\n{shown}",
        SIZE[0],
        SIZE[1],
        STRIP[0],
        STRIP[1],
        table::markdown(&lines),
        short(100.0 * steps[0].1),
        holds(steps[0].1 > 0.0),
        holds(steps[1..].iter().all(|s| s.0 < steps[0].0)),
        holds(steps[1..].iter().all(|s| s.1 == 0.0)),
    ))
}
