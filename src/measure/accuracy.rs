//! How wrong a configuration is, and what its frame needs: everything of a [`Record`] but times.

use super::analysis::{Aliasing, Counts};
use super::causes::CAUSES;
use super::columns::Column;
use super::contour;
use super::metrics::{self, Errors, Pixels};
use super::record::{LightRow, Record, params_text};
use super::softness::{self, Penumbrae};
use super::sweep::{self, More, Step};
use crate::contact::{self, Found};
use crate::frame::{Ask, PieceCount, Renderer, Told, Truth};
use crate::gpu::Draws;
use crate::setup::Setup;
use crate::techniques;
use crate::truth::Samples;
use anyhow::{Context, Result, anyhow, ensure};

/// The errors of the set-up's technique at the set-up's full size, against the hard truth alone: one sample per pixel. Of
/// several lights over the pixels of all of them that can be wrong.
///
/// # Errors
/// A light that the technique or the truth does not serve, all lights off, or what the device reports.
pub fn errors(renderer: &mut Renderer, setup: &Setup) -> Result<Errors> {
    let setup = Setup { truth_samples: Samples::Fixed(1), ..setup.clone() };
    let mut frames = Vec::new();
    for one in served(&setup)? {
        frames.push(compare(renderer, &one, false)?.0);
    }
    Ok(metrics::pooled(&frames, setup.size[0] as usize))
}

/// A set-up for each light that is on and that technique and truth serve.
pub(super) fn served(setup: &Setup) -> Result<Vec<Setup>> {
    let both = [techniques::find_or_say(&setup.technique)?, techniques::TRUTH];
    for info in both {
        setup.unmeasurable(info).map_or(Ok(()), |reason| Err(anyhow!(reason)))?;
    }
    let mut all = setup.each_light()?;
    all.retain(|one| both.iter().all(|info| info.refuses(&one.light).is_none()));
    ensure!(!all.is_empty(), "no light that is on is served by {} and by the truth", both[0].title);
    Ok(all)
}

/// Renders technique and truth of the light at work; with `all` also the picture and the analysis.
pub(super) fn compare(renderer: &mut Renderer, setup: &Setup, all: bool) -> Result<(Pixels, Told)> {
    let ask = Ask { analysis: all, picture: all, ..Ask::of(setup) };
    let told = renderer.render(setup, ask)?;
    let mask = renderer.read_mask()?;
    let (hard, mean) = (renderer.read_labels()?, renderer.read_truth()?);
    Ok((Pixels { visibility: renderer.read_visibility()?, hard, mean, mask }, told))
}

/// What changes with the seed, and what does not.
pub struct Spread {
    /// Standard deviation of visibility over seeds, root mean square over the pixels that can be wrong.
    pub noise: f64,
    /// What the mean over seeds is off by, root mean square: less the noise that so few seeds leave in their mean.
    pub bias: f64,
}

/// Draws with so many seeds, from the set-up's own on.
///
/// # Errors
/// As [`errors`].
pub fn over_seeds(renderer: &mut Renderer, setup: &Setup, seeds: u32) -> Result<Spread> {
    let samples = setup.truth_samples.measured(&setup.light);
    let base = Setup { truth_samples: Samples::Fixed(samples), ..setup.measured() };
    let n = f64::from(seeds);
    let (mut variance, mut squares, mut facing) = (0.0, 0.0, 0usize);
    for one in served(&base)? {
        let (first, _) = compare(renderer, &one, false)?;
        let own = first.visibility.iter().map(|v| f64::from(*v));
        let mut sums: Vec<[f64; 2]> = own.map(|v| [v, v * v]).collect();
        for k in 1..seeds {
            let other = Setup { seed: setup.seed.wrapping_add(k), ..one.clone() };
            let ask = Ask { truth: Truth::Off, analysis: false, picture: false, ..Ask::of(&other) };
            renderer.render(&other, ask)?;
            for (sum, v) in sums.iter_mut().zip(renderer.read_visibility()?) {
                let v = f64::from(v);
                (sum[0], sum[1]) = (sum[0] + v, sum[1] + v * v);
            }
        }
        for (i, [sum, square]) in sums.into_iter().enumerate().filter(|(i, _)| first.mask[*i] == metrics::FACING) {
            let mean = sum / n;
            variance += (square - sum * mean).max(0.0) / (n - 1.0);
            squares += (mean - f64::from(first.mean[i])).powi(2);
            facing += 1;
        }
    }
    let facing = facing.max(1) as f64;
    let (variance, squares) = (variance / facing, squares / facing);
    Ok(Spread { noise: variance.sqrt(), bias: (squares - variance / n).max(0.0).sqrt() })
}

/// What contact shadows do to the light at work, if the set-up has them.
fn contact(renderer: &mut Renderer, setup: &Setup) -> Result<Option<Found>> {
    if !contact::wanted(setup.values()) {
        return Ok(None);
    }
    // Its map is the visibility that they alone leave.
    let shown = Setup { view: "contact-visibility".into(), ..setup.clone() };
    renderer.render(&shown, Ask { analysis: true, picture: false, ..Ask::of(&shown) })?;
    let Some((visibility, causes)) = renderer.read_without_contact()? else { return Ok(None) };
    let (mask, hard) = (renderer.read_mask()?, renderer.read_labels()?);
    let pixels = Pixels { visibility, mean: Vec::new(), hard, mask };
    Ok(Some(Found::count(&pixels, &causes, &renderer.read_map()?)))
}

/// What is gathered of the frames of each light.
#[derive(Default)]
struct Gathered {
    frames: Vec<Pixels>,
    contours: Option<(f64, u64)>,
    causes: [usize; CAUSES.len()],
    /// Metres to the blockers of detached pixels.
    gaps: Vec<f32>,
    penumbrae: Vec<[f32; 2]>,
    spectrum: [f64; 4],
    aliasing: Vec<[f32; 4]>,
    /// Layers, texels, and whether all of these were counted.
    maps: Option<(u64, u64, bool)>,
    counts: Vec<u32>,
    views_needed: u64,
    draws: Option<Draws>,
    pieces: Option<PieceCount>,
    rays: u64,
    notes: Vec<String>,
    contact: Option<Found>,
    lights: Vec<LightRow>,
}

impl Gathered {
    /// Takes in the frame of a light, whose errors are these.
    fn take(&mut self, renderer: &mut Renderer, setup: &Setup, (pixels, told): (Pixels, Told)) -> Result<()> {
        let width = setup.size[0] as usize;
        if let Some((sum, number)) = contour::distances(&pixels.visibility, &pixels.hard, &pixels.mask, width) {
            let held = self.contours.get_or_insert((0.0, 0));
            (held.0, held.1) = (held.0 + sum, held.1 + number);
        }
        let causes = renderer.read_causes()?;
        self.causes.iter_mut().zip(causes.counts).for_each(|(sum, n)| *sum += n);
        self.gaps.extend(causes.gaps);
        self.penumbrae.extend(softness::penumbrae(&pixels, &renderer.read_position()?, width));
        self.spectrum.iter_mut().zip(softness::spectrum(&pixels, width)).for_each(|(sum, p)| *sum += p);
        // Of faces around a light only some are drawn.
        let faces = renderer.known()?.faces;
        let drawn = (!faces.is_empty()).then(|| faces.iter().flatten().count());
        let (gpu, analysis) = (&renderer.gpu, renderer.analysis());
        let maps = analysis.maps();
        self.aliasing.extend(analysis.aliasing(gpu)?.into_iter().flatten());
        let one_by_one = analysis.maps_drawn(gpu)?;
        let drawn = drawn.map_or(maps.map_or(0, |m| m.layers as u64), |drawn| drawn as u64);
        let drawn = one_by_one.unwrap_or(drawn);
        let mut needed = maps.map_or(Vec::new(), |m| vec![false; m.layers as usize]);
        let filled = &mut self.counts;
        let counted = analysis.counts(gpu, |first, counts| {
            for (i, count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
                filled.push(*count);
                let layer = (first + i as u64) / maps.map_or(1, |m| m.layer());
                needed[layer as usize] = true;
            }
        })?;
        if let Some(m) = maps {
            let held = self.maps.get_or_insert((0, 0, true));
            *held = (held.0 + drawn, held.1 + m.texels(), held.2 && counted);
        }
        let needed = match faces.is_empty() {
            true => needed.iter().filter(|n| **n).count(),
            false => faces.iter().flatten().filter(|face| face[0] > 0).count(),
        };
        self.views_needed += one_by_one.unwrap_or(needed as u64);
        if let Some(d) = analysis.draws(gpu)? {
            let held = self.draws.get_or_insert_default();
            held.sent += d.sent;
            held.drawn += d.drawn;
            held.fragments += d.fragments;
        }
        if let Some(p) = analysis.pieces(gpu)? {
            let held = self.pieces.get_or_insert_default();
            held.kept += p.kept;
            held.drawn += p.drawn;
            held.folded += p.folded;
            held.folds += p.folds;
        }
        self.rays += renderer.read_rays()? as u64;
        for note in renderer.notes()? {
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
        let e = metrics::errors(&pixels.visibility, &pixels.hard, &pixels.mean, &pixels.mask, width);
        let light = setup.at_work();
        self.lights.push(LightRow {
            number: light as u64 + 1,
            kind: setup.light.kind().into(),
            facing: e.facing as u64,
            wrong: (e.lit_incorrect + e.shadow_incorrect) as u64,
            rmse: e.rmse,
            gpu_ms: 0.0,
            gpu_bytes: told.lights.iter().find(|l| l.light == light).map_or(0, |l| l.gpu_bytes),
        });
        self.frames.push(pixels);
        Ok(())
    }
}

/// Measures what these columns need and no more: against one sample per pixel where none is of the averaged truth, times and
/// flicker where they are asked for.
///
/// # Errors
/// As [`errors`].
pub fn figures(renderer: &mut Renderer, setup: &Setup, columns: &[&Column]) -> Result<Record> {
    let mut setup = setup.measured();
    let auto = setup.truth_samples == Samples::Auto && !setup.light.has_size();
    if auto && columns.iter().all(|c| c.is_of_labels()) {
        setup.truth_samples = Samples::Fixed(1);
    }
    asked(renderer, &setup, columns, &mut |_| true)
}

/// Measures a set-up as it is, with times and flicker where these columns ask for them. `tick` is told the share done, and stops
/// the work by saying no.
///
/// # Errors
/// As [`errors`], or that it was stopped.
pub fn asked(
    renderer: &mut Renderer,
    setup: &Setup,
    columns: &[&Column],
    tick: &mut dyn FnMut(f32) -> bool,
) -> Result<Record> {
    let flicker = columns.iter().any(|c| ["flicker", "label_flicker"].contains(&c.id));
    let timed = columns.iter().any(|c| c.is_time() || c.is_multiple() || c.id == "frames");
    if !flicker && !timed {
        return accuracy(renderer, setup, 0);
    }
    let mut found = Err(anyhow!("it was cancelled"));
    let more = More { flicker, ..More::default() };
    sweep::run(renderer, setup, &[(0, setup.clone())], 1, more, &mut |step| {
        match step {
            Step::Working(done, _) => return tick(done),
            Step::Row(row) => found = Ok(*row),
            Step::Failed(why) => found = Err(why),
        }
        true
    })?;
    found
}

/// Measures what does not depend on speed. `index` is the configuration's place in its sweep. Of several lights each is measured
/// alone: errors are over the pixels of all of them that can be wrong, and what is counted is added up.
///
/// # Errors
/// As [`errors`].
pub fn accuracy(renderer: &mut Renderer, setup: &Setup, index: u64) -> Result<Record> {
    let samples = setup.truth_samples.measured(&setup.light);
    // Another view would change the picture, and a technique's own trace rays of its own.
    let shaded = Setup { truth_samples: Samples::Fixed(samples), ..setup.measured() };
    let lights = served(&shaded)?;
    let mut g = Gathered::default();
    for one in &lights {
        let found = contact(renderer, one)?;
        g.contact = g.contact.into_iter().chain(found).reduce(Found::and);
        let seen = compare(renderer, one, true)?;
        g.take(renderer, one, seen)?;
    }
    let e = metrics::pooled(&g.frames, setup.size[0] as usize);
    let truth_error = (samples > 1).then(|| metrics::truth_error(&g.frames, samples));
    g.frames.clear();
    if lights[0] != shaded {
        renderer.render(&shaded, Ask::of(&shaded))?;
    }
    let picture = renderer.read_picture()?;
    let exact = renderer.read_truth_picture(&shaded)?;
    let share = |n| n as f64 / e.facing.max(1) as f64;
    let penumbrae = Penumbrae::of(&g.penumbrae);
    let power: f64 = g.spectrum.iter().sum();
    let [power_16px, power_8px, power_4px, power_2px] = g.spectrum.map(|p| (power > 0.0).then(|| p / power));
    g.gaps.sort_unstable_by(f32::total_cmp);
    let gaps = Some(&g.gaps).filter(|gaps| !gaps.is_empty());
    let [acne_share, detachment_share, leak_share, missing_caster_share, stairs_share] = g.causes.map(share);
    let m = Aliasing::of(&g.aliasing);
    let counted = g.maps.is_some_and(|(_, _, counted)| counted);
    let texels = g.maps.map(|(_, texels, _)| texels);
    let counts = texels.filter(|_| counted).map(|texels| Counts::of(texels, g.counts));
    let (draws, pieces, mut notes) = (g.draws, g.pieces, g.notes);
    let left_out = setup.unshadowed(techniques::find_or_say(&setup.technique)?);
    notes.extend(left_out.into_iter().map(|note| format!("{note} It is not measured.")));
    let gpu_bytes = g.lights.iter().map(|l| l.gpu_bytes).sum();
    let per_light = if lights[0] == shaded { String::new() } else { LightRow::text(&g.lights) };
    if e.facing == 0 {
        notes.push("No pixel faces the light within its cone and range: nothing can be wrong.".into());
    }
    if let Some(texels) = texels.filter(|_| !counted) {
        notes.push(format!("Samples per texel are not counted: {texels} texels are too many."));
    }
    Ok(Record {
        index,
        technique: setup.technique.clone(),
        params: params_text(setup),
        scene: setup.scene.clone(),
        width: setup.size[0],
        height: setup.size[1],
        facing: e.facing,
        lit_correct: e.lit_correct,
        lit_incorrect: e.lit_incorrect,
        shadow_correct: e.shadow_correct,
        shadow_incorrect: e.shadow_incorrect,
        away: e.away,
        outside: e.outside,
        background: e.background,
        error_share: e.share(),
        acne_share,
        detachment_share,
        leak_share,
        missing_caster_share,
        stairs_share,
        truth_samples: samples,
        rmse: e.rmse,
        mae: e.mae,
        max_error: e.max_error,
        beyond_tolerance: e.beyond_tolerance,
        rmse_hard: Some(e.rmse_hard),
        rmse_penumbra: e.rmse_penumbra,
        rmse_image: metrics::rmse_image(&picture, &exact),
        truth_error,
        penumbra_px: penumbrae.map(|p| p.width),
        penumbra_true_px: penumbrae.map(|p| p.truth),
        penumbra_off_px: penumbrae.map(|p| p.off),
        penumbra_slope: penumbrae.and_then(|p| p.slope),
        power_16px,
        power_8px,
        power_4px,
        power_2px,
        gap_mean_m: gaps.map(|gaps| gaps.iter().map(|m| f64::from(*m)).sum::<f64>() / gaps.len() as f64),
        gap_p95_m: gaps.map(|gaps| metrics::quantile(gaps, 0.95).into()),
        flip: metrics::flip(&exact, &picture, setup.size),
        jod: metrics::jod(&exact, &picture, setup.size),
        boundary_median_px: e.boundary.map(|b| b.median as f64),
        boundary_p95_px: e.boundary.map(|b| b.p95 as f64),
        boundary_max_px: e.boundary.map(|b| b.max as f64),
        contour_mean_px: g.contours.map(|(sum, number)| sum / number as f64),
        m_mean: m.map(|m| m.mean),
        m_rms: m.map(|m| m.rms),
        m_p50: m.map(|m| m.p50),
        m_p95: m.map(|m| m.p95),
        m_p99: m.map(|m| m.p99),
        m_max: m.map(|m| m.max),
        m_over_1: m.map(|m| m.over[0]),
        m_over_2: m.map(|m| m.over[1]),
        m_over_10: m.map(|m| m.over[2]),
        perspective_p50: m.map(|m| m.perspective_p50),
        projection_p50: m.map(|m| m.projection_p50),
        texel_area_p50: m.map(|m| m.area[0]),
        texel_area_p95: m.map(|m| m.area[1]),
        stretch_p50: m.map(|m| m.stretch[0]),
        stretch_p95: m.map(|m| m.stretch[1]),
        anisotropy_p50: m.map(|m| m.anisotropy[0]),
        anisotropy_p95: m.map(|m| m.anisotropy[1]),
        // A projection by a matrix turns nothing over.
        folds: texels.map(|_| pieces.map_or(0, |p| p.folds)),
        texels,
        texels_covered: counts.map(|c| c.covered),
        covered_share: counts.zip(texels).map(|(c, texels)| c.covered as f64 / texels as f64),
        utilisation: counts.and_then(|c| c.utilisation()),
        count_mean: counts.and_then(|c| c.mean()),
        count_max: counts.map(|c| c.max),
        count_gini: counts.and_then(|c| c.gini),
        count_entropy: counts.and_then(|c| c.entropy),
        views_rendered: g.maps.map(|(layers, ..)| layers),
        views_needed: counts.map(|_| g.views_needed),
        triangles_submitted: draws.map(|d| d.sent),
        triangles_drawn: draws.map(|d| d.drawn),
        fragments: draws.map(|d| d.fragments),
        triangles_needed: pieces.map(|p| p.kept),
        triangles_added: pieces.map(|p| p.drawn as i64 - p.kept as i64),
        triangles_folded: pieces.map(|p| p.folded),
        rays: g.rays,
        contact_hits: g.contact.map(|c| c.hits),
        contact_right: g.contact.map(|c| c.right),
        contact_detached: g.contact.map(|c| c.detached),
        contact_repaired: g.contact.map(|c| c.repaired),
        contact_gained: g.contact.map(|c| c.gained),
        contact_lost: g.contact.map(|c| c.lost),
        gpu_bytes,
        lights: lights.len() as u32,
        per_light,
        adapter: renderer.gpu.info.name.clone(),
        driver: renderer.gpu.info.driver_info.clone(),
        software: renderer.gpu.software(),
        notes: notes.join(" "),
        // A shadow camera had no part in it, nor had a path.
        setup: serde_json::to_string(&Setup { shadow_camera: None, outlines: false, path: None, ..setup.clone() })
            .context("the set-up cannot be written as JSON")?,
        ..Record::default()
    })
}
