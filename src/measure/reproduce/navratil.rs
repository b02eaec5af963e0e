//! Navratil 2015: quality and cost of the techniques that warp one map.

use super::{Bench, picture, short};
use crate::capture::write_png;
use crate::frame::{Ask, Renderer};
use crate::light::Light;
use crate::measure::timing::{self, Times};
use crate::measure::{self, table};
use crate::scene::Camera;
use crate::setup::Setup;
use crate::techniques;
use crate::truth::Samples;
use anyhow::{Context, Result};
use glam::Vec3;

/// A row of his tables, or one of ours beside them.
struct Method {
    /// His name, or what it is called here.
    name: &'static str,
    technique: &'static str,
    sets: &'static [&'static str],
    /// His frame time in table 5.3, milliseconds.
    frame: Option<f64>,
    /// His times in table 5.1: conference room, Sponza, observatory.
    own: Option<[f64; 3]>,
}

const fn ours(name: &'static str, technique: &'static str, sets: &'static [&'static str]) -> Method {
    Method { name, technique, sets, frame: None, own: None }
}

/// In the order of his quality, then what he did not measure. What is not among the techniques yet is left out. Where a
/// technique has a resolution and its `sets` do not give one, it is [`RESOLUTION`].
#[expect(clippy::approx_constant, reason = "3.14 is one of his times")]
const METHODS: &[Method] = &[
    Method {
        name: "SM",
        technique: "shadow-map",
        sets: &["fit=scene"],
        frame: Some(1.596),
        own: Some([0.21, 0.40, 0.16]),
    },
    Method { name: "MIN-SM", technique: "shadow-map", sets: &["fit=msf"], frame: Some(1.700), own: None },
    // A plain map cropped to the view samples by reduction (section 4.2.5): nothing is counted, summed up or warped.
    Method { name: "NoTW-DV", technique: "shadow-map", sets: &["fit=receivers"], frame: Some(2.521), own: None },
    Method { name: "RTW", technique: "rtw", sets: &[], frame: Some(3.296), own: Some([3.14, 3.47, 3.02]) },
    Method { name: "NoTW", technique: "notw", sets: &[], frame: Some(4.708), own: Some([3.63, 3.84, 3.23]) },
    Method { name: "SV", technique: "shadow-volume", sets: &[], frame: Some(8.750), own: Some([9.64, 18.41, 14.96]) },
    ours("psm", "psm", &[]),
    ours("lispsm", "lispsm", &[]),
    ours("tsm", "tsm", &[]),
    ours("logpsm", "logpsm", &[]),
    // As many texels in all.
    ours("pssm, 4 × 256²", "pssm", &["cascades=4", "resolution=256"]),
    ours("sdsm, 4 × 256²", "sdsm", &["cascades=4", "resolution=256"]),
    ours("dsm", "dsm", &[]),
    ours("optimal-light-plane", "optimal-light-plane", &[]),
    ours("lixel-per-pixel", "lixel-per-pixel", &[]),
    ours("fem-grid", "fem-grid", &[]),
];

/// His order of quality, worse first: SM ≫ RTW ≥ NoTW, the crops between SM and RTW.
const ORDER: &[[&str; 2]] =
    &[["SM", "RTW"], ["RTW", "NoTW"], ["SM", "MIN-SM"], ["MIN-SM", "RTW"], ["SM", "NoTW-DV"], ["NoTW-DV", "RTW"]];

/// His image, and the side of his map.
const SIZE: [u32; 2] = [1024, 1024];
const RESOLUTION: u32 = 512;

impl Method {
    /// The set-up with this technique; None if it is not there, or does not serve the light.
    fn apply(&self, start: &Setup) -> Result<Option<Setup>> {
        let Some(info) = techniques::find(self.technique).filter(|i| i.refuses(&start.light).is_none()) else {
            return Ok(None);
        };
        let mut setup = Setup { size: SIZE, ..start.clone() };
        setup.select(self.technique)?;
        let selected = [self.technique.to_string()];
        if info.specs().any(|s| s.name == "resolution") {
            setup.set(&format!("resolution={RESOLUTION}"), &selected)?;
        }
        for set in self.sets {
            setup.set(set, &selected)?;
        }
        Ok(Some(setup))
    }
}

/// The methods that are there and that `of` picks, with their set-ups.
fn methods(start: &Setup, of: impl Fn(&Method) -> bool) -> Result<Vec<(&'static Method, Setup)>> {
    let mut found = Vec::new();
    for method in METHODS.iter().filter(|m| of(m)) {
        found.extend(method.apply(start)?.map(|setup| (method, setup)));
    }
    Ok(found)
}

/// A number, bold where it is to be noted.
fn noted(text: String, note: bool) -> String {
    if note { format!("**{text}**") } else { text }
}

/// Wrong pixels of all methods on four scenes.
pub fn quality(b: &mut Bench) -> Result<String> {
    const SCENES: [&str; 5] = ["observatory", "arches", "hall", "bench", "terrain"];
    let mut shares: Vec<Vec<(&Method, f64)>> = Vec::new();
    for (i, scene) in SCENES.into_iter().enumerate() {
        let (_, start) = b.open(scene)?;
        let all = methods(&start, |_| true)?;
        let mut column = Vec::new();
        for (k, (method, setup)) in all.iter().enumerate() {
            b.done(i * all.len() + k, SCENES.len() * all.len());
            let (renderer, _) = b.open(scene)?;
            column.push((*method, 100.0 * measure::errors(renderer, setup)?.share()));
        }
        shares.push(column);
    }
    let of = |scene: usize, name: &str| shares[scene].iter().find(|(m, _)| m.name == name).map(|(_, x)| *x);
    let head = |first: &str| [&[first.to_string()][..], &SCENES.map(String::from)].concat();
    let mut lines = vec![head("wrong pixels, %")];
    for method in METHODS {
        let cells: Vec<Option<f64>> = (0..SCENES.len()).map(|s| of(s, method.name)).collect();
        if cells.iter().any(Option::is_some) {
            let cells = cells.into_iter().map(|x| x.map_or("-".into(), short));
            lines.push([vec![method.name.to_string()], cells.collect()].concat());
        }
    }
    let mut order = vec![head("errors of one over the other's")];
    let mut against = Vec::new();
    for [worse, better] in ORDER {
        let ratios: Vec<Option<f64>> =
            (0..SCENES.len()).map(|s| Some(of(s, worse)? / of(s, better)?.max(1e-9))).collect();
        if ratios.iter().all(Option::is_none) {
            continue;
        }
        let cells = ratios.iter().map(|r| r.map_or("-".into(), |r| noted(format!("{r:.2}"), r < 1.0)));
        order.push([vec![format!("{worse} / {better}")], cells.collect()].concat());
        for (scene, ratio) in SCENES.iter().zip(&ratios) {
            if let Some(ratio) = ratio.filter(|r| *r < 1.0) {
                against.push(format!("on {scene} {better} makes {:.2} times the errors of {worse}", 1.0 / ratio));
            }
        }
    }
    let holds = if order.len() == 1 {
        String::new()
    } else if against.is_empty() {
        "His order holds wherever both are there: no ratio is below 1.\n".into()
    } else {
        format!("His order does not hold (bold) in {} places: {}.\n", against.len(), against.join("; "))
    };
    let mut sorted = String::new();
    for (scene, column) in SCENES.iter().zip(&shares) {
        let mut column: Vec<(&str, f64)> = column.iter().map(|(m, x)| (m.name, *x)).collect();
        column.sort_by(|a, b| a.1.total_cmp(&b.1));
        let names: Vec<&str> = column.into_iter().map(|(name, _)| name).collect();
        sorted += &format!("- {scene}: {}\n", names.join("; "));
    }
    let (_, start) = b.open(SCENES[0])?;
    let all = methods(&start, |m| m.frame.is_some() || m.sets.is_empty())?;
    let says = format!("A detail of {}, wrong pixels red where dark, blue where lit", SCENES[0]);
    let mut shown = sheet(b, SCENES[0], &all, "error", "navratil-5.2.png", &says)?;
    if !shown.is_empty() {
        let names = all.iter().map(|(m, _)| m.name).collect::<Vec<_>>().join("; ");
        shown += &format!("\n{says}. Row by row: {names}.\n");
    }
    let [w, h] = SIZE;
    Ok(format!(
        "Images of {w} × {h} pixels, maps of {RESOLUTION}², shares of the pixels that face the light. SM covers the whole\n\
         scene, as his does. NoTW-DV is the map of NoTW cropped to the view samples and not warped, which is `shadow-map` with\n\
         its default fit. Four cascades have as many texels in all.\n\n{}\nFewest wrong pixels first:\n\n{sorted}\n\
         His order of quality is SM ≫ RTW ≥ NoTW, with MIN-SM and NoTW-DV between SM and RTW unless the view is small:\n\n\
         {}\n{holds}\n{shown}",
        table::markdown(&lines),
        table::markdown(&order),
    ))
}

/// Figure 5.10: the crops alone beside the warps, on a view of much of the scene.
pub fn crops(b: &mut Bench) -> Result<String> {
    let scene = "observatory";
    let (_, start) = b.open(scene)?;
    let all = methods(&start, |m| ["MIN-SM", "NoTW-DV", "RTW", "NoTW"].contains(&m.name))?;
    let mut lines = vec![["", "wrong pixels, %"].map(String::from).to_vec()];
    let mut shares = Vec::new();
    for (i, (method, setup)) in all.iter().enumerate() {
        b.done(i, all.len());
        let (renderer, _) = b.open(scene)?;
        shares.push(100.0 * measure::errors(renderer, setup)?.share());
        lines.push(vec![method.name.to_string(), short(shares[i])]);
    }
    let says = format!("A detail of {scene}: MIN-SM, NoTW-DV, RTW, NoTW");
    let shown = sheet(b, scene, &all, "shaded", "navratil-5.10.png", &says)?;
    let holds = match shares[..] {
        [_, dv, _, notw] if dv > notw => "The crop alone errs more than with the warps, as he shows",
        _ => "The crop alone errs no more than with the warps, against what he shows",
    };
    Ok(format!("{}\n{shown}\n{holds}.\n", table::markdown(&lines)))
}

/// Side of a detail, pixels.
const DETAIL: u32 = 256;
/// Space between two.
const GAP: u32 = 8;

/// Details in a row.
const COLUMNS: u32 = 4;

/// Writes the details as a picture, if there is a folder for it; Markdown that shows it.
fn sheet(b: &mut Bench, scene: &str, all: &[(&Method, Setup)], view: &str, name: &str, says: &str) -> Result<String> {
    if b.folder.is_none() {
        return Ok(String::new());
    }
    let folder = b.folder;
    let (renderer, _) = b.open(scene)?;
    let sheet = details(renderer, all, view)?;
    picture(folder, name, says, |path| write_png(path, sheet.dimensions().into(), &sheet, None))
}

/// A view of each method where the first is wrong most, in rows.
fn details(renderer: &mut Renderer, all: &[(&Method, Setup)], view: &str) -> Result<image::RgbaImage> {
    let mut corner: Option<[u32; 2]> = None;
    let side = |n: u32| n * (DETAIL + GAP) - GAP;
    let count = all.len() as u32;
    let size = [side(count.clamp(1, COLUMNS)), side(count.div_ceil(COLUMNS).max(1))];
    let mut sheet = image::RgbaImage::from_pixel(size[0], size[1], image::Rgba([255; 4]));
    for (i, (_, setup)) in (0..).zip(all) {
        let shown = Setup { view: view.into(), ..setup.clone() };
        renderer.render(&shown, Ask { size: SIZE, ..Ask::of(&shown) })?;
        let corner = match corner {
            Some(corner) => corner,
            None => *corner.insert(worst_detail(&renderer.read_visibility()?, &renderer.read_truth()?)),
        };
        let picture = image::RgbaImage::from_raw(SIZE[0], SIZE[1], renderer.read_picture()?);
        let picture = picture.context("the picture's size does not match")?;
        let part = image::imageops::crop_imm(&picture, corner[0], corner[1], DETAIL, DETAIL).to_image();
        let at = [i % COLUMNS, i / COLUMNS].map(|k| (k * (DETAIL + GAP)) as i64);
        image::imageops::replace(&mut sheet, &part, at[0], at[1]);
    }
    Ok(sheet)
}

/// The upper left corner of the detail with the most wrong pixels.
fn worst_detail(visibility: &[f32], truth: &[f32]) -> [u32; 2] {
    let step = DETAIL / 4;
    let wrong = |x: u32, y: u32| {
        let i = (y * SIZE[0] + x) as usize;
        ((visibility[i] < 0.5) != (truth[i] < 0.5)) as u32
    };
    let cells = |side: u32| (0..=(side - DETAIL) / step).map(move |k| k * step);
    let all = cells(SIZE[1]).flat_map(|y| cells(SIZE[0]).map(move |x| [x, y]));
    let count = |[x, y]: [u32; 2]| {
        (y..y + DETAIL).flat_map(|v| (x..x + DETAIL).map(move |u| (u, v))).map(|(u, v)| wrong(u, v)).sum::<u32>()
    };
    all.max_by_key(|c| count(*c)).unwrap_or_default()
}

/// What is said of times.
fn adapter(b: &Bench, times: &[Times]) -> String {
    let frames = times.iter().map(|t| t.gpu.frames).min().unwrap_or(0);
    let mut text = format!(
        "{} × {} pixels, maps of {RESOLUTION}², {}; medians of {frames} frames or more, taking turns.",
        SIZE[0], SIZE[1], b.gpu.info.name
    );
    if times.iter().any(|t| t.wall_clock) {
        text += " Wall clock, each pass submitted alone.";
    }
    if b.gpu.software() {
        text += " Software: compare ratios only; they say little of a GPU.";
    }
    text + "\n"
}

fn g_buffer(t: &Times) -> f64 {
    t.passes.iter().filter(|(name, _)| name == "G-buffer").map(|(_, q)| q.median).sum()
}

/// Table 5.3: the whole frame.
pub fn frame_times(b: &mut Bench) -> Result<String> {
    b.done(0, 1);
    let (renderer, start) = b.open("observatory")?;
    let all = methods(&start, |_| true)?;
    let setups: Vec<Setup> = all.iter().map(|(_, s)| s.clone()).collect();
    let times = timing::time(renderer, &setups, &mut |_| true)?;
    let frame = |t: &Times| t.gpu.median + g_buffer(t);
    let head = ["method", "frame, ms: his", "ours", "SM = 1: his", "ours", "own passes, ms: ours", "SM = 1: ours"];
    let mut lines = vec![head.map(String::from).to_vec()];
    let sm = times.first().context("nothing was timed")?;
    for ((method, _), t) in all.iter().zip(&times) {
        lines.push(vec![
            method.name.into(),
            method.frame.map_or("-".into(), |ms| format!("{ms:.3}")),
            short(frame(t)),
            method.frame.map_or("-".into(), |ms| format!("{:.2}", ms / 1.596)),
            format!("{:.2}", frame(t) / frame(sm)),
            short(t.gpu.median),
            format!("{:.2}", t.gpu.median / sm.gpu.median),
        ]);
    }
    Ok(format!(
        "{}A frame is the G-buffer and the technique's own passes.\n\n{}",
        adapter(b, &times),
        table::markdown(&lines)
    ))
}

/// His scenes of table 5.1 and ours in their place.
const ROOMS: [[&str; 2]; 3] = [["conference room", "hall"], ["Sponza", "arches"], ["observatory", "observatory"]];
/// His G-buffers, milliseconds.
const G_BUFFERS: [f64; 3] = [2.16, 2.229, 1.84];

/// Times of methods in the three rooms.
fn rooms(b: &mut Bench, of: fn(&Method) -> bool) -> Result<Vec<(Vec<&'static Method>, Vec<Times>)>> {
    let mut found = Vec::new();
    for (i, [_, scene]) in ROOMS.into_iter().enumerate() {
        b.done(i, ROOMS.len());
        let (renderer, start) = b.open(scene)?;
        let all = methods(&start, of)?;
        let setups: Vec<Setup> = all.iter().map(|(_, s)| s.clone()).collect();
        found.push((all.iter().map(|(m, _)| *m).collect(), timing::time(renderer, &setups, &mut |_| true)?));
    }
    Ok(found)
}

/// Table 5.1: the techniques' own passes.
pub fn own_times(b: &mut Bench) -> Result<String> {
    let found = rooms(b, |m| m.own.is_some())?;
    let mut head = vec!["ms".to_string()];
    head.extend(ROOMS.iter().flat_map(|[his, ours]| [format!("{his}: his"), format!("{ours}: ours")]));
    let mut lines = vec![head];
    let mut row = vec!["G-buffer".to_string()];
    for (ms, (_, times)) in G_BUFFERS.iter().zip(&found) {
        row.extend([format!("{ms:.2}"), times.first().map_or("-".into(), |t| short(g_buffer(t)))]);
    }
    lines.push(row);
    let mut ratios = vec![lines[0].clone()];
    ratios[0][0] = "SM = 1".into();
    let first = METHODS[0].own.context("SM stands first")?;
    for method in METHODS {
        let Some(own) = method.own else { continue };
        let (mut row, mut ratio) = (vec![method.name.to_string()], vec![method.name.to_string()]);
        let mut there = false;
        for (i, (methods, times)) in found.iter().enumerate() {
            let ours = methods.iter().position(|m| m.name == method.name).map(|k| times[k].gpu.median);
            let sm = times.first().map_or(f64::NAN, |t| t.gpu.median);
            row.extend([format!("{:.2}", own[i]), ours.map_or("-".into(), short)]);
            ratio
                .extend([format!("{:.1}", own[i] / first[i]), ours.map_or("-".into(), |ms| format!("{:.2}", ms / sm))]);
            there |= ours.is_some();
        }
        if there {
            lines.push(row);
            ratios.push(ratio);
        }
    }
    let mut row = vec!["NoTW / RTW".to_string()];
    let [rtw, notw] = ["RTW", "NoTW"].map(|name| METHODS.iter().find(|m| m.name == name).and_then(|m| m.own));
    for (i, (methods, times)) in found.iter().enumerate() {
        let ours = |name: &str| methods.iter().position(|m| m.name == name).map(|k| times[k].gpu.median);
        let ratio = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or("-".into(), |(a, b)| format!("{:.2}", a / b));
        row.extend([ratio(notw.map(|t| t[i]), rtw.map(|t| t[i])), ratio(ours("NoTW"), ours("RTW"))]);
    }
    ratios.push(row);
    let all: Vec<Times> = found.into_iter().flat_map(|f| f.1).collect();
    Ok(format!("{}\n{}\n{}", adapter(b, &all), table::markdown(&lines), table::markdown(&ratios)))
}

/// Figure 5.6: what share of its time each pass of a method takes.
pub fn shares(b: &mut Bench) -> Result<String> {
    let found = rooms(b, |m| m.frame.is_some())?;
    let mut lines = vec![
        [&["method".to_string(), "pass, % of its own time".into()][..], &ROOMS.map(|r| r[1].to_string())].concat(),
    ];
    for method in METHODS {
        // Of each room this method's times.
        let times: Vec<Option<&Times>> =
            found.iter().map(|(m, t)| m.iter().position(|m| m.name == method.name).map(|k| &t[k])).collect();
        let Some(first) = times.iter().flatten().next() else { continue };
        for (pass, _) in first.passes.iter().filter(|(name, _)| name != "G-buffer") {
            let share = |t: &Times| {
                let ms: f64 = t.passes.iter().filter(|(name, _)| name == pass).map(|(_, q)| q.median).sum();
                format!("{:.0}", 100.0 * ms / t.gpu.median)
            };
            let cells = times.iter().map(|t| t.map_or("-".into(), share));
            lines.push([vec![method.name.to_string(), pass.clone()], cells.collect()].concat());
        }
    }
    let all: Vec<Times> = found.into_iter().flat_map(|f| f.1).collect();
    Ok(format!("{}\n{}", adapter(b, &all), table::markdown(&lines)))
}

/// Figures 3.4 to 3.6: the sun and a lamp across, ahead of and behind the camera, in the space after its perspective.
pub fn post_perspective(b: &mut Bench) -> Result<String> {
    let camera = Camera::new(Vec3::new(0.0, 1.5, 9.0), Vec3::new(0.0, 1.0, 0.0), 45.0, 1.0, 40.0);
    let forward = camera.forward();
    let up = Vec3::X.cross(forward);
    let sun = |up_by: f32, ahead: f32| Light::Directional {
        to_light: up * up_by + forward * ahead,
        angular_radius: 0.0,
        color: Vec3::ONE,
    };
    let lamp = |up_by: f32, ahead: f32, direction: Vec3| Light::Spot {
        position: camera.position + up * up_by + forward * ahead,
        direction,
        radius: 0.0,
        color: Vec3::ONE,
        outer_angle: 60.0,
        range: 60.0,
    };
    let down = Vec3::new(0.0, -1.0, -0.3);
    let ahead = Vec3::new(0.0, -0.6, -1.0);
    let lights = [
        ("3.5-1", "The sun across the view becomes parallel light", sun(1.0, 0.0)),
        ("3.5-2", "The sun ahead of the camera becomes a point before which all lies", sun(1.0, 2.0)),
        ("3.5-3", "The sun behind the camera becomes a sink that light runs into", sun(1.0, -2.0)),
        ("3.6-1", "A lamp ahead of the camera stays a point", lamp(3.0, 7.0, down)),
        ("3.6-2", "A lamp above the camera, in its plane, becomes parallel light", lamp(3.0, 0.0, ahead)),
        ("3.6-3", "A lamp behind the camera becomes a sink", lamp(2.5, -5.0, ahead)),
    ];
    let (mut out, count) = (String::new(), lights.len());
    for (i, (figure, says, light)) in lights.into_iter().enumerate() {
        b.done(i, count);
        let (_, mut setup) = b.open("cubes")?;
        (setup.camera, setup.size, setup.light) = (camera, [1280, 640], light);
        setup.select("psm")?;
        if light.kind() == "spot" {
            // An eye slid back has another plane.
            setup.set("slide=fixed", &["psm".into()])?;
            setup.set("slide_back=0", &["psm".into()])?;
        }
        setup.view = "pps".into();
        out += &format!("{says}.\n{}", b.capture(&format!("navratil-{figure}.png"), says, &setup)?);
    }
    Ok(out)
}

/// A picture of one of a technique's views on a scene, beside measures of it.
struct Shot {
    name: &'static str,
    says: &'static str,
    technique: &'static str,
    sets: &'static [&'static str],
    view: &'static str,
}

/// Captures views of a scene, 512² pixels and texels, and what their maps use.
fn shots(b: &mut Bench, scene: &str, all: &[Shot]) -> Result<[String; 2]> {
    let head = ["", "texels with view samples, %", "samples per texel, largest", "inequality (Gini)"];
    let mut lines = vec![head.map(String::from).to_vec()];
    let mut shown = String::new();
    for (i, shot) in all.iter().enumerate() {
        b.done(i, all.len());
        let (renderer, start) = b.open(scene)?;
        let once = Samples::Fixed(1);
        let mut setup = Setup { size: [RESOLUTION; 2], view: shot.view.into(), truth_samples: once, ..start };
        setup.select(shot.technique)?;
        let selected = [shot.technique.to_string()];
        for set in [&[&*format!("resolution={RESOLUTION}")][..], shot.sets].concat() {
            setup.set(set, &selected)?;
        }
        let measured = measure::accuracy(renderer, &setup, 0)?;
        let percent = measured.covered_share.map(|x| 100.0 * x);
        lines.push(vec![
            shot.says.to_string(),
            percent.map_or("-".into(), short),
            measured.count_max.map_or("-".into(), |n| n.to_string()),
            measured.count_gini.map_or("-".into(), short),
        ]);
        shown += &b.capture(&format!("{}.png", shot.name), shot.says, &setup)?;
    }
    Ok([table::markdown(&lines), shown])
}

const fn shot(
    name: &'static str,
    says: &'static str,
    technique: &'static str,
    sets: &'static [&'static str],
    view: &'static str,
) -> Shot {
    Shot { name, says, technique, sets, view }
}

/// Figures 4.11 and 4.12: the samples before, between and after the warps.
pub fn steps(b: &mut Bench) -> Result<String> {
    let all = [
        shot("navratil-4.12-before", "Samples before the warps", "notw", &[], "counts-before"),
        shot("navratil-4.11", "Row offsets before and after smoothing", "notw", &[], "row-offsets"),
        shot("navratil-4.12-between", "Samples after the rows' warps", "notw", &[], "counts-between"),
        shot("navratil-4.12-after", "Samples after both warps", "notw", &[], "counts"),
    ];
    let [_, shown] = shots(b, "observatory", &all)?;
    Ok(shown)
}

/// Figure 5.11: the maps themselves.
pub fn maps(b: &mut Bench) -> Result<String> {
    let all = [
        shot("navratil-5.11-sm", "Shadow map of the whole scene", "shadow-map", &["fit=scene"], "shadow-map"),
        shot("navratil-5.11-dv", "NoTW, cropped only", "shadow-map", &[], "shadow-map"),
        shot("navratil-5.11-rtw", "RTW", "rtw", &[], "shadow-map"),
        shot("navratil-5.11-notw", "NoTW", "notw", &[], "shadow-map"),
    ];
    Ok(shots(b, "observatory", &all)?.join("\n"))
}

/// Figure 5.12: the grid of springs that folds, and the one of least energy that does not.
pub fn grids(b: &mut Bench) -> Result<String> {
    const SEED: &[&str] = &["variant=seed-stiffness", "raster=subdivide"];
    const ENERGY: &[&str] = &["variant=energy", "raster=subdivide"];
    let all = [
        shot("navratil-5.12-seed", "Springs, solved at once", "fem-grid", SEED, "nodes"),
        shot("navratil-5.12-energy", "Least energy", "fem-grid", ENERGY, "nodes"),
    ];
    Ok(shots(b, "bench", &all)?.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;

    #[test]
    fn methods_that_are_there_have_their_parameters() {
        let start = Setup::new("cubes", &builtin::build("cubes").unwrap()).unwrap();
        let all = methods(&start, |_| true).unwrap();
        assert_eq!((all[0].0.name, all[1].0.name), ("SM", "MIN-SM"));
        for (method, setup) in &all {
            setup.check().unwrap_or_else(|e| panic!("{}: {e:#}", method.name));
        }
        for pair in ORDER.iter().flatten() {
            assert!(METHODS.iter().any(|m| m.name == *pair), "{pair}");
        }
        let names: std::collections::BTreeSet<&str> = METHODS.iter().map(|m| m.name).collect();
        assert_eq!(names.len(), METHODS.len());
    }

    #[test]
    fn the_detail_is_where_most_is_wrong() {
        let mut visibility = vec![1.0; (SIZE[0] * SIZE[1]) as usize];
        let truth = visibility.clone();
        (500..600).for_each(|x| visibility[(700 * SIZE[0] + x) as usize] = 0.0);
        let [x, y] = worst_detail(&visibility, &truth);
        assert!(x <= 500 && x + DETAIL >= 600 && y <= 700 && y + DETAIL > 700, "{x} {y}");
    }
}
