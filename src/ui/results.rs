//! The panel's figures: pass times and measurements.

use super::compare::short_name;
use super::controls::{Tip, steady};
use super::drawer::{self, line, progress};
use super::lamps;
use super::model::{Action, Model, ShotSeen};
use super::needs::{self, listed, main_values, percent, table, title};
use super::pictures::Picture;
use super::plotting::short;
use crate::chart::round_step;
use crate::frame::SHARED_PASSES;
use crate::measure::Record;
use crate::measure::causes::CAUSES;
use egui::{Button, Grid, RichText, Ui};
use egui_plot::{AxisHints, GridMark, Line, Plot, PlotPoints};

pub fn timings(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let side = m.side();
    if m.edited().is_none() {
        ui.label(
            RichText::new("The truth is traced once for all sides. Times are those of techniques.").small().weak(),
        );
        return;
    }
    // The first side's graph is the only one that is kept.
    let of = if m.setup.sides() > 1 { "; graph: A" } else { "" };
    let still = m.still;
    let passes = m.facts.passes_of(side).to_vec();
    let (several, names) = (m.setup.light_count() > 1, lamps::names(m));
    let (facts, shot) = (&m.facts, &mut m.shot);
    let own = facts.technique_ms(side);
    // Some passes run only now and then.
    steady(ui, "passes", still, |ui| {
        Grid::new("passes").num_columns(2).min_col_width(150.0).spacing([8.0, 2.0]).show(ui, |ui| {
            for (name, ms) in &passes {
                let shared = SHARED_PASSES.contains(name);
                let label = if shared { RichText::new(*name).weak() } else { RichText::new(*name) };
                ui.label(label).tip_ui(|ui| {
                    ui.label(about(name, shared));
                    wrote(ui, (side, name), shot, out);
                });
                ui.label(RichText::new(format!("{ms:9.3} ms")).monospace());
                ui.end_row();
            }
            ui.label(RichText::new("technique").strong()).tip("The technique's passes together.");
            ui.label(RichText::new(format!("{own:9.3} ms")).monospace().strong());
            ui.end_row();
            for l in facts.lights_of(side).iter().filter(|_| several) {
                let tip = "The technique's passes for this light, and the GPU memory that it holds for it.";
                ui.label(RichText::new(format!("  light {}", names.get(l.light).map_or("", |n| n))).weak()).tip(tip);
                let (ms, mib) = (l.ms, l.gpu_bytes as f64 / 1048576.0);
                ui.label(RichText::new(format!("{ms:9.3} ms {mib:8.2} MiB")).monospace()).tip(tip);
                ui.end_row();
            }
            let memory = "GPU memory that the technique holds, such as its shadow map.";
            ui.label(RichText::new("memory")).tip(memory);
            ui.label(RichText::new(format!("{:8.2} MiB", facts.bytes_of(side) as f64 / 1048576.0)).monospace());
            ui.end_row();
        });
    });
    let how = match (facts.wall_clock, facts.software) {
        (true, true) => "wall clock on a software adapter: good for ratios only",
        (true, false) => "wall clock, each pass waited for",
        _ => "GPU timestamps",
    };
    ui.label(RichText::new(format!("{how}{of}")).small().weak()).tip("How these times are taken.");
    let points: PlotPoints = facts.recent.iter().enumerate().map(|(i, ms)| [i as f64, *ms]).collect();
    // A wider row above makes no wider plot, whose newest frames would be cut off.
    let width = (ui.clip_rect().right() - ui.cursor().left() - 6.0).min(ui.available_width());
    let plot = Plot::new("technique time")
        .height(76.0)
        .width(width)
        .include_y(0.0)
        .show_x(false)
        .show_axes([false, true])
        .show_grid([false, true])
        .custom_y_axes(vec![
            // Every line of the grid has its number.
            AxisHints::new_y().label_spacing(1.0..=2.0).min_thickness(36.0).formatter(|mark, _| short(mark.value)),
        ])
        .y_grid_spacer(|g| marks(g.bounds.1))
        .set_margin_fraction(egui::vec2(0.0, 0.1))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .show_background(false);
    let color = ui.visuals().hyperlink_color;
    let shown = plot.show(ui, |plot| plot.line(Line::new("technique, ms", points).color(color)));
    shown
        .response
        .tip("The technique's time in milliseconds over the last frames at full resolution, the newest at the right.");
}

/// Zero and one to three round numbers up to a largest one: there is room for no more.
fn marks(most: f64) -> Vec<GridMark> {
    let step = round_step(0.0, most.max(1e-6), 2);
    let count = (most / step).floor().clamp(0.0, 3.0) as usize;
    (0..=count).map(|i| GridMark { value: i as f64 * step, step_size: step }).collect()
}

/// Shows what a pass wrote, asking for it first.
fn wrote(ui: &mut Ui, of: (usize, &'static str), shot: &mut Option<ShotSeen>, out: &mut Vec<Action>) {
    match shot {
        Some(seen) if (seen.side, seen.pass) == of => match &seen.picture {
            Picture::Drawn(texture) => {
                ui.image(texture);
                ui.label(RichText::new(&seen.told).small().weak());
            }
            Picture::Failed(why) => _ = ui.label(RichText::new(why).small().weak()),
            Picture::Waiting => _ = ui.spinner(),
        },
        _ => {
            let (side, pass) = of;
            out.push(Action::Shot(side, pass));
            *shot = Some(ShotSeen { side, pass, picture: Picture::Waiting, told: String::new() });
        }
    }
}

/// What a pass does.
fn about(pass: &str, shared: bool) -> &'static str {
    match pass.trim_end_matches(" (masked)") {
        "G-buffer" => "Draws the scene as the camera sees it: position, normal, albedo and triangle of each pixel.",
        "shading" => "Colours the picture of the chosen view.",
        "shadow camera's G-buffer" => {
            "Draws the scene as the frozen camera sees it, for the passes that decide where maps look."
        }
        "outlines" => "Draws what maps cover as lines.",
        "analysis" => {
            "Finds the place of each pixel in the maps, which is what is shown, and its aliasing error; counts the samples \
             of each texel."
        }
        "light sum" => "Adds up what the lights beside the chosen one give the surfaces.",
        "count map" => "Draws how many pixels look into each texel.",
        "error map (CPU)" => {
            "Judges the pixels against the truth, for the views of errors that need their surroundings."
        }
        "truth" => "Traces exact shadow rays for the truth; only while it is not complete.",
        "shadow map" | "shadow maps" | "plain map" => "Draws the casters' depth as the light sees it.",
        "resolve" => "Looks up the visibility of every pixel.",
        "inspect" => "Fills the technique's own view; only while one is shown.",
        "fit: receivers" | "fit: samples" => "Finds where in the light's image the surfaces lie that the camera sees.",
        "fit: narrow" | "fit: boxes" => "Narrows the light's view down to those surfaces.",
        "caster culling" => "Leaves out triangles that cast no shadow into a cascade, or cover no texel there.",
        "depth range" => "Finds the nearest and the farthest surface in the picture.",
        "depth histogram" => "Counts how many pixels lie at which depth.",
        "splits" => "Places the depths at which the cascades meet.",
        "importance" | "cell errors" => "Finds which parts of the map matter, and how much.",
        "needed texels" => "Marks the texels that some pixel looks up.",
        "texels' rays" => "Sends those texels' rays back through the warp.",
        "rays meet casters" => "Finds the nearest triangle on each of those rays.",
        _ if shared => "Part of every frame, whatever the technique.",
        _ => "One of the technique's own passes.",
    }
}

pub fn measure(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    let still = m.still;
    steady(ui, "start", still, |ui| match &m.measuring {
        Some(job) => progress(ui, job, out),
        None => {
            ui.horizontal(|ui| {
                let size = m.setup.size;
                let ready = m.edited().is_some_and(|i| m.setup.refusal(i).is_none());
                let title = match m.setup.sides() {
                    1 => "Measure this set-up".into(),
                    _ => format!("Measure {}", short_name(&m.setup, m.side())),
                };
                let start = ui.add_enabled(ready, Button::new(title));
                let tip = format!(
                    "Counts right and wrong pixels against the truth and times the technique, at {} × {} pixels. The picture waits meanwhile, so that it does not disturb the times.",
                    size[0], size[1]
                );
                if start.tip(tip).clicked() {
                    out.push(Action::Measure);
                }
                let clear = ui.add_enabled(!m.rows.is_empty(), Button::new("Clear"));
                if clear.tip("Remove these figures, and the chart's points with them.").clicked() {
                    m.clear_rows();
                }
            });
            drawer::size(ui, m);
            // As high as what shows the progress.
            let text = match m.rows.len() {
                0 => String::new(),
                n if n > SHOWN => format!("the newest {SHOWN} of {n}; each is a point of the chart (F2)"),
                _ => "each is a point of the chart (F2)".into(),
            };
            line(ui, &text);
        }
    });
    for (i, r) in m.rows.iter().rev().take(SHOWN).enumerate() {
        egui::Frame::group(ui.style()).show(ui, |ui| measured(ui, i, r));
    }
}

/// Rows that the panel shows.
const SHOWN: usize = 6;

fn measured(ui: &mut Ui, i: usize, r: &Record) {
    ui.label(RichText::new(title(&r.technique)).strong()).tip(listed(r));
    let main = main_values(r);
    if !main.is_empty() {
        ui.label(RichText::new(main).small().weak());
    }
    let share = |n: usize| format!("{n:>9}  {:6.3} %", 100.0 * n as f64 / r.facing.max(1) as f64);
    let pixels = |values: [(&'static str, Option<f64>); 3], tip: &'static str| {
        values.into_iter().filter_map(move |(name, px)| Some((name, format!("{:.1} px", px?), tip)))
    };
    let counts = [
        (
            "facing the light",
            format!("{:>9}  pixels", r.facing),
            "Pixels whose surface turns towards the light, within its cone and range: those that can be wrong.",
        ),
        ("lit, right", share(r.lit_correct), "Called lit, and lit."),
        ("lit, wrong", share(r.lit_incorrect), "Called lit, but in shadow: leaks."),
        ("shadow, right", share(r.shadow_correct), "Called shadow, and in shadow."),
        ("shadow, wrong", share(r.shadow_incorrect), "Called shadow, but lit: acne and stairs."),
        (
            "wrong together",
            share(r.lit_incorrect + r.shadow_incorrect),
            "Wrong pixels as a share of those that can be wrong, against one sample per pixel: for hard techniques.",
        ),
    ];
    let tip = "Pixels that were counted. The status bar counts those of the window, against as many samples as the view takes: its figures differ.";
    let mut rows = vec![("picture", format!("{} × {}", r.width, r.height), tip)];
    rows.extend(counts);
    let causes = [r.acne_share, r.detachment_share, r.leak_share, r.missing_caster_share, r.stairs_share];
    let caused = CAUSES.iter().zip(causes).filter(|(_, share)| *share > 0.0);
    rows.extend(caused.map(|(cause, share)| (cause.title, percent(share), cause.doc)));
    let tip =
        "Samples a pixel of the truth that the sizes of errors below are against; the counts above are against one.";
    rows.push(("truth samples", r.truth_samples.to_string(), tip));
    let tip = "Root mean square of visibility minus the averaged truth: fair to filters.";
    let own = r.truth_error.map_or(String::new(), |e| format!(" (truth ±{e:.4})"));
    let tip = if own.is_empty() {
        tip
    } else {
        "Root mean square of visibility minus the averaged truth: fair to filters. Behind it what the truth's own samples leave open at most."
    };
    rows.push(("RMSE", format!("{:.5}{own}", r.rmse), tip));
    let tip = "Root mean square of visibility minus the averaged truth, over pixels whose truth lies between 0 and 1.";
    rows.extend(r.rmse_penumbra.map(|e| ("RMSE, penumbra", format!("{e:.5}"), tip)));
    let tip = "Mean of the absolute value of visibility minus the averaged truth, and its largest.";
    rows.push(("MAE, largest", format!("{:.5}, {:.3}", r.mae, r.max_error), tip));
    let tip = "Pixels whose visibility is off by more than 0.1, as a share of those that can be wrong.";
    rows.push(("off by over 0.1", percent(r.beyond_tolerance), tip));
    let tip = "Root mean square difference of the shaded picture from the one shaded with the truth.";
    rows.push(("RMSE of the picture", format!("{:.5}", r.rmse_image), tip));
    let tip = "How different the shaded picture looks from the true one to a human eye: 0 the same, 1 utterly.";
    rows.push(("FLIP", format!("{:.5}", r.flip), tip));
    let tip =
        "Quality of the shaded picture beside the true one by ColorVideoVDP: 10 JOD where nobody sees a difference.";
    rows.extend(r.jod.map(|jod| ("quality", format!("{jod:.3} JOD"), tip)));
    if let (Some(width), Some(truth)) = (r.penumbra_px, r.penumbra_true_px) {
        let tip = "Pixels from a tenth to nine tenths of the light across the true shadow's edge, on average.";
        rows.push(("penumbra", format!("{width:.1} px (true {truth:.1})"), tip));
    }
    let tip =
        "How much penumbrae widen where the true ones do: 1 as they should, 0 where a filter is as wide everywhere.";
    rows.extend(r.penumbra_slope.map(|slope| ("penumbra's slope", format!("{slope:.2}"), tip)));
    if let (Some(coarse), Some(fine)) = (r.power_16px, r.power_2px) {
        let tip = "Of the error's power, wavelengths above 16 pixels (bands, blotches, wrong on average) and below 4 (grain, stairs).";
        rows.push(("error, coarse, fine", format!("{:.0} %, {:.0} %", 100.0 * coarse, 100.0 * fine), tip));
    }
    let tip = "How far the blocker is from pixels that are lit at a caster's foot: 95 % of them are nearer.";
    rows.extend(r.gap_p95_m.map(|m| ("contact gap, 95 %", format!("{m:.3} m"), tip)));
    let tip =
        "Distance of wrong pixels from the true shadow edge: half of them, 95 % of them, all of them lie within it.";
    let edge = [
        ("edge error, median", r.boundary_median_px),
        ("edge error, 95 %", r.boundary_p95_px),
        ("edge error, worst", r.boundary_max_px),
    ];
    rows.extend(pixels(edge, tip));
    let tip = "Mean distance between the shadow's edges and the true ones, whether it is wrong there or not.";
    rows.extend(r.contour_mean_px.map(|px| ("edges apart", format!("{px:.2} px"), tip)));
    let tip = "Aliasing error m, the longest extent of a pixel's texel in the picture: at most this at half of the pixels, at 95 % of \
               them, at all of them.";
    let texel = [("texel, median", r.m_p50), ("texel, 95 %", r.m_p95), ("texel, worst", r.m_max)];
    rows.extend(pixels(texel, tip));
    let tip = "A texel's area in the picture, and its longest over its shortest extent: 95th percentiles.";
    rows.extend(r.texel_area_p95.map(|area| ("texel's area, 95 %", format!("{area:.1} px²"), tip)));
    rows.extend(r.anisotropy_p95.map(|long| ("long : short, 95 %", format!("{long:.1}"), tip)));
    let tip = "Texels' worth of the light's image that the warp turns over.";
    rows.extend(r.folds.filter(|n| *n > 0).map(|n| ("folds", n.to_string(), tip)));
    let tip =
        "How much visibility changes between neighbouring frames beyond the truth's change, mean over the pixels.";
    rows.extend(r.flicker.map(|f| ("flicker", percent(f), tip)));
    let tip = "Labels that change between neighbouring frames though the truth's do not, as a share of pixels.";
    rows.extend(r.label_flicker.map(|f| ("flicker of labels", percent(f), tip)));
    let lights = r.per_light();
    if !lights.is_empty() {
        let tip = "The errors above are over the pixels of all lights that can be wrong; times and memory are those of all together.";
        rows.push(("lights", lights.len().to_string(), tip));
    }
    rows.extend(lights.iter().map(|l| {
        let (error, mib) = (percent(l.error_share()), l.gpu_bytes as f64 / 1048576.0);
        let text = format!("{}: {error}, {:.2} ms, {mib:.2} MiB", l.number, l.gpu_ms);
        (
            "light",
            text,
            "Wrong pixels of those that can be wrong for this light, and the technique's time and memory for it.",
        )
    }));
    let (name, tip) = match r.wall_clock {
        true => ("time", "Median of the technique's time by the clock, each pass waited for."),
        false => ("GPU time", "Median of the technique's time by GPU timestamps."),
    };
    rows.push((name, format!("{:.3} ms", r.gpu_ms), tip));
    let quartiles = format!("{:.3} to {:.3} ms", r.gpu_ms_q1, r.gpu_ms_q3);
    rows.push(("quartiles", quartiles, "The middle half of the frames lies between these."));
    let tip = "Time as a multiple of the plain map's (shadow-map, around a lamp cube) of the same resolution, measured in the same run, and what that took.";
    let base = |ms: Option<f64>| ms.map_or(String::new(), |ms| format!(" (1: {} ms)", short(ms)));
    rows.extend(r.ratio.map(|x| ("× same resolution", format!("{x:.2}{}", base(r.ratio_base_ms())), tip)));
    let tip = "Time as a multiple of that of the plain map as the set-up has it, and what that took: comparable across all rows.";
    rows.extend(r.cost.map(|x| ("× set-up's map", format!("{x:.2}{}", base(r.cost_base_ms())), tip)));
    rows.push(("frames", r.frames.to_string(), "Frames that were timed, after some to warm up."));
    rows.push(("CPU time", format!("{:.3} ms", r.cpu_ms), "Recording the technique's passes."));
    table(ui, ("measured", i), &rows);
    ui.add_space(3.0);
    table(ui, ("needs of", i), &needs::rows(r));
    if r.wall_clock {
        ui.label(RichText::new("times are wall clock").small().weak());
    }
    if !r.notes.is_empty() {
        ui.label(RichText::new(&r.notes).small().color(ui.visuals().warn_fg_color));
    }
}
