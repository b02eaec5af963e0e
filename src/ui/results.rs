//! The panel's figures: pass times and measurements.

use super::model::{Action, Facts, Model};
use super::style::{ACCENT, WEAK};
use crate::frame::SHARED_PASSES;
use crate::measure::Record;
use egui::{Button, Grid, ProgressBar, RichText, Ui};
use egui_plot::{Line, Plot, PlotPoints};

pub fn timings(ui: &mut Ui, facts: &Facts) {
    let own = facts.technique_ms();
    Grid::new("passes").num_columns(2).min_col_width(150.0).spacing([8.0, 2.0]).show(ui, |ui| {
        for (name, ms) in &facts.passes {
            let shared = SHARED_PASSES.contains(name);
            let name = if shared { RichText::new(*name).color(WEAK) } else { RichText::new(*name) };
            let tip = if shared { "Part of every frame, whatever the technique." } else { "A pass of the technique." };
            ui.label(name).on_hover_text(tip);
            ui.label(RichText::new(format!("{ms:9.3} ms")).monospace());
            ui.end_row();
        }
        ui.label(RichText::new("technique").strong()).on_hover_text("The technique's passes together.");
        ui.label(RichText::new(format!("{own:9.3} ms")).monospace().strong());
        ui.end_row();
        let memory = "GPU memory that the technique holds, such as its shadow map.";
        ui.label(RichText::new("memory")).on_hover_text(memory);
        ui.label(RichText::new(format!("{:8.2} MiB", facts.told.gpu_bytes as f64 / 1048576.0)).monospace());
        ui.end_row();
    });
    let how = match (facts.wall_clock, facts.software) {
        (true, true) => "wall clock on a software adapter: good for ratios only",
        (true, false) => "wall clock, each pass waited for",
        _ => "GPU timestamps",
    };
    ui.label(RichText::new(how).small().color(WEAK)).on_hover_text("How these times are taken.");
    let points: PlotPoints = facts.recent.iter().enumerate().map(|(i, ms)| [i as f64, *ms]).collect();
    let plot = Plot::new("technique time")
        .height(76.0)
        .include_y(0.0)
        .show_x(false)
        .show_axes([false, true])
        .show_grid([false, true])
        .y_axis_min_width(36.0)
        .set_margin_fraction(egui::vec2(0.0, 0.1))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .show_background(false);
    let shown = plot.show(ui, |plot| plot.line(Line::new("technique, ms", points).color(ACCENT)));
    shown.response.on_hover_text("The technique's time in ms over the last frames at full resolution.");
}

pub fn measure(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    match &m.measuring {
        Some(job) => {
            ui.horizontal(|ui| {
                let bar = ProgressBar::new(job.done).desired_width(ui.available_width() - 70.0);
                ui.add(bar.text(format!("{} {:3.0} %", job.what, job.done * 100.0)));
                if ui.button("Cancel").on_hover_text("Stop and throw the figures away.").clicked() {
                    out.push(Action::CancelMeasuring);
                }
            });
        }
        None => {
            ui.horizontal(|ui| {
                let size = m.setup.size;
                let ready = m.info().refuses(&m.setup.light).is_none();
                let start = ui.add_enabled(ready, Button::new("Measure this set-up"));
                let tip = format!(
                    "Counts right and wrong pixels against the exact shadow and times the technique, at {} × {} pixels (set under Capture). The picture waits meanwhile, so that it does not disturb the times.",
                    size[0], size[1]
                );
                if start.on_hover_text(tip).clicked() {
                    out.push(Action::Measure);
                }
                let clear = ui.add_enabled(!m.rows.is_empty(), Button::new("Clear"));
                if clear.on_hover_text("Remove the figures below.").clicked() {
                    m.rows.clear();
                }
            });
        }
    }
    for (i, r) in m.rows.iter().enumerate() {
        egui::Frame::group(ui.style()).show(ui, |ui| measured(ui, i, r));
    }
}

fn measured(ui: &mut Ui, i: usize, r: &Record) {
    let title = crate::techniques::find(&r.technique).map_or(r.technique.as_str(), |t| t.title);
    ui.label(RichText::new(title).strong()).on_hover_text(r.params.replace(';', "\n"));
    let share = |n: usize| format!("{n:>9}  {:6.3} %", 100.0 * n as f64 / r.facing.max(1) as f64);
    let edge = match (r.boundary_median_px, r.boundary_p95_px, r.boundary_max_px) {
        (Some(median), Some(p95), Some(max)) => format!("{median:.1} / {p95:.1} / {max:.1} px"),
        _ => "none".into(),
    };
    let rows = [
        (
            "facing the light",
            format!("{:>9}  pixels", r.facing),
            "Pixels whose surface turns towards the light: those that count.",
        ),
        ("lit, right", share(r.lit_correct), "Called lit, and lit."),
        ("lit, wrong", share(r.lit_incorrect), "Called lit, but in shadow: leaks."),
        ("shadow, right", share(r.shadow_correct), "Called shadow, and in shadow."),
        ("shadow, wrong", share(r.shadow_incorrect), "Called shadow, but lit: acne and stairs."),
        (
            "wrong together",
            share(r.lit_incorrect + r.shadow_incorrect),
            "Wrong pixels as a share of those facing the light.",
        ),
        ("RMSE", format!("{:.5}", r.rmse), "Root mean square of visibility minus truth: counts soft errors too."),
        ("edge error", edge, "Distance of wrong pixels from the true shadow edge: median, 95th percentile, greatest."),
        ("GPU time", format!("{:.3} ms", r.gpu_ms), "Median of the technique's time."),
        (
            "quartiles",
            format!("{:.3} to {:.3} ms", r.gpu_ms_q1, r.gpu_ms_q3),
            "The middle half of the frames lies between these.",
        ),
        ("frames", r.frames.to_string(), "Frames that were timed, after some to warm up."),
        ("CPU time", format!("{:.3} ms", r.cpu_ms), "Recording the technique's passes."),
        ("memory", format!("{:.2} MiB", r.gpu_bytes as f64 / 1048576.0), "GPU memory that the technique holds."),
    ];
    Grid::new(("measured", i)).num_columns(2).min_col_width(110.0).spacing([8.0, 1.0]).show(ui, |ui| {
        for (name, value, tip) in rows {
            ui.label(RichText::new(name).small()).on_hover_text(tip);
            ui.label(RichText::new(value).monospace().size(11.5)).on_hover_text(tip);
            ui.end_row();
        }
    });
    if r.wall_clock {
        ui.label(RichText::new("times are wall clock").small().color(WEAK));
    }
    if !r.notes.is_empty() {
        ui.label(RichText::new(&r.notes).small().color(ui.visuals().warn_fg_color));
    }
}
