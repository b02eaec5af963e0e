//! Morais 2015: conservative shadow maps, without and with adjacency, and what they cost.

use super::morais::{CASES, RESOLUTIONS, SIZES, errors};
use super::{Bench, holds, with};
use crate::measure::timing::{self, Times};
use crate::measure::{Errors, table};
use crate::scene::Clock;
use crate::setup::{Setup, scene_camera};
use anyhow::Result;

/// One of his three cases, each for maps of 512² to 4096², per cent: of those that a map calls lit or shadowed, or of
/// those that end so.
struct Theirs {
    grown_light: [f64; 4],
    grown_shadow: [f64; 4],
    /// Without and with adjacency.
    shrunk_light: [[f64; 4]; 2],
    /// Pixels, with adjacency; without it there are none.
    shrunk_shadow: [usize; 4],
    ends_lit: [f64; 4],
    ends_shadow: [[f64; 4]; 2],
    /// Pixels that stay wrong with adjacency.
    left: [usize; 4],
    /// Milliseconds at 1920 × 1080: the standard map, both conservative ones; all rays, and those that are left. Where his rows repeat
    /// those of another table they say nothing of this one.
    maps: [[f64; 4]; 3],
    rays: Option<[[f64; 4]; 3]>,
}

const THEIRS: [Theirs; 3] = [
    Theirs {
        grown_light: [0.0; 4],
        grown_shadow: [11.00, 5.81, 3.07, 1.54],
        shrunk_light: [[21.83, 13.12, 7.26, 3.84], [8.74, 3.84, 1.91, 0.94]],
        shrunk_shadow: [0, 102, 26, 3],
        ends_lit: [7.82, 6.60, 3.37, 1.69],
        ends_shadow: [[48.95, 26.48, 13.72, 7.01], [16.79, 6.99, 3.42, 1.66]],
        left: [0; 4],
        maps: [[3.11, 3.05, 15.34, 3.34], [3.76, 3.59, 16.37, 3.91], [8.98, 9.13, 16.76, 10.65]],
        rays: None,
    },
    Theirs {
        grown_light: [0.02, 0.05, 0.06, 0.09],
        grown_shadow: [14.48, 9.07, 5.17, 2.79],
        shrunk_light: [[18.20, 12.15, 7.70, 5.09], [8.32, 6.09, 4.02, 3.01]],
        shrunk_shadow: [2, 49, 25, 3],
        ends_lit: [8.46, 7.85, 4.32, 2.37],
        ends_shadow: [[51.33, 31.91, 19.24, 12.30], [20.94, 14.94, 9.65, 7.10]],
        left: [0, 0, 84, 400],
        maps: [[3.32, 3.49, 16.26, 3.35], [4.05, 4.02, 16.42, 3.88], [9.70, 9.51, 16.80, 11.00]],
        rays: Some([[127.23, 128.75, 136.82, 128.36], [107.23, 60.40, 49.35, 41.77], [85.80, 54.59, 48.17, 44.73]]),
    },
    Theirs {
        grown_light: [0.01, 0.02, 0.02, 0.02],
        grown_shadow: [10.46, 6.06, 3.46, 1.91],
        shrunk_light: [[22.75, 15.36, 9.46, 5.68], [11.49, 8.26, 4.78, 2.87]],
        shrunk_shadow: [0, 63, 16, 21],
        ends_lit: [7.48, 6.47, 3.55, 2.01],
        ends_shadow: [[50.98, 31.42, 18.08, 10.42], [22.47, 15.58, 8.69, 5.12]],
        left: [0, 0, 1, 7],
        maps: [[3.21, 3.32, 3.29, 3.24], [3.91, 3.84, 4.04, 3.81], [9.41, 9.53, 10.17, 10.79]],
        rays: None,
    },
];

const ID: &str = "csm-conservative";

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

fn two(x: f64) -> String {
    format!("{x:.2}")
}

/// Tables 10 to 24 of one case.
pub fn certainty(b: &mut Bench, case: usize) -> Result<String> {
    let (theirs, camera) = (&THEIRS[case], CASES[case].camera);
    let head = ["map", "grown: lit wrong, %: theirs", "ours", "shadow wrong, %: theirs", "ours"];
    let mut grown_lines = vec![head.map(String::from).to_vec()];
    let head = [
        "map",
        "shrunk, plain: lit wrong, %: theirs",
        "ours",
        "adjacency: theirs",
        "ours",
        "fan: ours",
        "shadow wrong, pixels: theirs",
        "ours",
    ];
    let mut shrunk_lines = vec![head.map(String::from).to_vec()];
    let head = [
        "map",
        "uncertain, ends lit, % of lit: theirs",
        "ours",
        "with `self_plane`",
        "ends in shadow, % of shadow, plain: theirs",
        "ours",
        "adjacency: theirs",
        "ours",
        "fan: ours",
        "plain / adjacency: theirs",
        "ours",
        "plain / fan: ours",
        "wrong at the end, pixels: theirs",
        "ours",
    ];
    let mut uncertain_lines = vec![head.map(String::from).to_vec()];
    let (mut reduces, mut better, mut right, mut fewer) = (Vec::new(), true, true, Vec::new());
    let mut plainer = true;
    for (i, resolution) in RESOLUTIONS.into_iter().enumerate() {
        let mut measured = |step: usize, sets: &[&str]| -> Result<Errors> {
            b.done(6 * i + step, 6 * RESOLUTIONS.len());
            let mut all = vec![format!("resolution={resolution}"), "shift=worst".into()];
            all.extend(sets.iter().map(|s| s.to_string()));
            errors(b, camera, SIZES[2], ID, &all)
        };
        let grown = measured(0, &["rays=false", "mode=none"])?;
        let own_plane = measured(1, &["rays=false", "mode=none", "self_plane=true"])?;
        let mut shrunk = Vec::new();
        for (k, mode) in ["mode=none", "mode=adjacency", "mode=fan"].into_iter().enumerate() {
            shrunk.push(measured(2 + k, &["rays=false", "uses=shrunk", mode])?);
        }
        let both = measured(5, &["mode=adjacency"])?;
        let wrong_lit = |e: &Errors| percent(e.lit_incorrect, e.lit_correct + e.lit_incorrect);
        let map = format!("{resolution}²");
        grown_lines.push(vec![
            map.clone(),
            two(theirs.grown_light[i]),
            two(wrong_lit(&grown)),
            two(theirs.grown_shadow[i]),
            two(percent(grown.shadow_incorrect, grown.shadow_correct + grown.shadow_incorrect)),
        ]);
        let wrong_shadow: usize = shrunk.iter().map(|e| e.shadow_incorrect).sum();
        shrunk_lines.push(vec![
            map.clone(),
            two(theirs.shrunk_light[0][i]),
            two(wrong_lit(&shrunk[0])),
            two(theirs.shrunk_light[1][i]),
            two(wrong_lit(&shrunk[1])),
            two(wrong_lit(&shrunk[2])),
            theirs.shrunk_shadow[i].to_string(),
            wrong_shadow.to_string(),
        ]);
        let (lit, shadowed) = (grown.lit_correct + grown.shadow_incorrect, grown.shadow_correct + grown.lit_incorrect);
        let ends: Vec<f64> = shrunk.iter().map(|e| percent(e.lit_incorrect, shadowed)).collect();
        let [plain, adjacency] = [0, 1].map(|k| theirs.ends_shadow[k][i]);
        let ratio = [1, 2].map(|k| ends[0] / ends[k].max(1e-9));
        let wrong = both.lit_incorrect + both.shadow_incorrect;
        uncertain_lines.push(vec![
            map,
            two(theirs.ends_lit[i]),
            two(percent(grown.shadow_incorrect, lit)),
            two(percent(own_plane.shadow_incorrect, lit)),
            two(plain),
            two(ends[0]),
            two(adjacency),
            two(ends[1]),
            two(ends[2]),
            two(plain / adjacency),
            two(ratio[0]),
            two(ratio[1]),
            theirs.left[i].to_string(),
            wrong.to_string(),
        ]);
        if ratio[0] >= plain / adjacency {
            reduces.push(format!("{resolution}²"));
        }
        if ends[1] <= adjacency {
            fewer.push(format!("{resolution}²"));
        }
        better &= ends[2] < ends[1];
        plainer &= ends[0] <= plain;
        right &= grown.lit_incorrect + wrong_shadow + wrong == 0;
    }
    Ok(format!(
        "{}\n{}\n{}\n\
         - No certain answer is wrong: {}.\n\
         - With adjacency a smaller part of the shadow is uncertain than in his, with maps of {}; plain, {}.\n\
         - Adjacency takes away at least as large a part of what is uncertain without it as in his, with maps of {}.\n\
         - Corners that stay where casters meet all around (`fan`) take away more: {}.\n",
        table::markdown(&grown_lines),
        table::markdown(&shrunk_lines),
        table::markdown(&uncertain_lines),
        holds(right),
        list(&fewer),
        if plainer { "with all" } else { "not with all" },
        list(&reduces),
        holds(better),
    ))
}

/// Milliseconds of passes with these names.
fn passes(t: &Times, of: impl Fn(&str) -> bool) -> f64 {
    t.passes.iter().filter(|(name, _)| of(name)).map(|(_, q)| q.median).sum()
}

fn is_rays(name: &str) -> bool {
    ["shadow rays", "list of rays"].contains(&name)
}

/// Tables 25 to 30.
pub fn times(b: &mut Bench) -> Result<String> {
    let head = [
        "case",
        "map",
        "maps / standard map, plain: theirs",
        "ours",
        "adjacency: theirs",
        "ours",
        "fan: ours",
        "rays / all rays, plain: theirs",
        "ours",
        "adjacency: theirs",
        "ours",
        "fan: ours",
        "maps and rays / all rays, adjacency: theirs",
        "all passes / all rays: plain, ours",
        "adjacency: ours",
        "fan: ours",
    ];
    let mut lines = vec![head.map(String::from).to_vec()];
    let (mut falls, mut least) = (true, f64::INFINITY);
    let mut finest = Vec::new();
    for (case, theirs) in THEIRS.iter().enumerate() {
        let mut before = f64::INFINITY;
        for (i, resolution) in RESOLUTIONS.into_iter().enumerate() {
            b.done(case * RESOLUTIONS.len() + i, THEIRS.len() * RESOLUTIONS.len());
            let (renderer, start) = b.open("bench")?;
            let camera = scene_camera(renderer.scene(), CASES[case].camera, Clock::default())?;
            let start = Setup { camera, size: SIZES[2], ..start };
            let resolution_set = format!("resolution={resolution}");
            let mut setups = vec![with(&start, "rt-hard", &[])?, with(&start, "shadow-map", &[&resolution_set])?];
            for mode in ["mode=none", "mode=adjacency", "mode=fan"] {
                setups.push(with(&start, ID, &[&resolution_set, mode, "shift=worst"])?);
            }
            let times = timing::briefly(renderer, &setups, 3)?;
            let all = times[0].gpu.median;
            let standard = passes(&times[1], |name| name != "resolve" && name != "G-buffer");
            let maps = |k: usize| passes(&times[k], |n| !is_rays(n) && n != "classify" && n != "G-buffer") / standard;
            let rays = |k: usize| passes(&times[k], is_rays) / all;
            let whole = [2, 3, 4].map(|k| times[k].gpu.median / all);
            let his_maps = |k: usize| two(theirs.maps[k][i] / theirs.maps[0][i]);
            let none = || "–".to_string();
            let his_rays = |k: usize| theirs.rays.map_or_else(none, |r| two(r[k][i] / r[0][i]));
            let his_whole = theirs.rays.map_or_else(none, |r| two((theirs.maps[2][i] + r[2][i]) / r[0][i]));
            lines.push(vec![
                CASES[case].camera.into(),
                format!("{resolution}²"),
                his_maps(1),
                two(maps(2)),
                his_maps(2),
                two(maps(3)),
                two(maps(4)),
                his_rays(1),
                two(rays(2)),
                his_rays(2),
                two(rays(3)),
                two(rays(4)),
                his_whole,
                two(whole[0]),
                two(whole[1]),
                two(whole[2]),
            ]);
            falls &= rays(3) <= before;
            before = rays(3);
            least = least.min(whole[1]);
            if i == RESOLUTIONS.len() - 1 {
                finest.push(whole[1]);
            }
        }
    }
    let finest: Vec<String> = finest.into_iter().map(two).collect();
    Ok(format!(
        "From 1024² on all three tables of ray times print the same hybrid times; here they stand at Against-Flowers only.\n\
         \"All passes\" are fit, maps, classification and rays.\n\n{}\n\
         - The finer the map, the fewer rays: their time falls with each doubling, {}.\n\
         - At 4096² all of it takes {} of the time of all rays; at the best resolution {}.\n",
        table::markdown(&lines),
        holds(falls),
        finest.join(", "),
        two(least),
    ))
}
