//! What a technique uses of what it holds and renders, and numbers in words.

use super::controls::{Tip, shown_name, shown_value, suffix};
use super::model::{Action, Model};
use super::panel::grouped;
use super::words;
pub use crate::legend::percent;
use crate::measure::{Record, params_text};
use crate::params::Value;
use crate::setup::Setup;
use crate::techniques;
use egui::{Grid, RichText, Ui};

/// A name, a value and what it means.
pub type Row = (&'static str, String, &'static str);

/// What a measured configuration uses of what it renders; what does not apply is left out.
pub fn rows(r: &Record) -> Vec<Row> {
    let of = |part: u64, whole: u64| {
        let share = 100.0 * part as f64 / whole.max(1) as f64;
        let whole = grouped(whole as usize);
        // Two long numbers have no room beside each other.
        if whole.len() > 5 { format!("{share:.1} % of {whole}") } else { format!("{part} of {whole} ({share:.1} %)") }
    };
    let mut out: Vec<Row> = Vec::new();
    if let (Some(part), Some(whole)) = (r.texels_covered, r.texels) {
        out.push((
            "texels used",
            of(part, whole),
            "Texels of the maps that some pixel looks up, out of all that are held.",
        ));
    }
    if let (Some(part), Some(whole)) = (r.views_needed, r.views_rendered) {
        out.push((
            "views used",
            of(part, whole),
            "Maps, faces, cascades or light samples that some pixel looks up, out of all that are rendered.",
        ));
    }
    if let (Some(part), Some(whole)) = (r.triangles_drawn, r.triangles_submitted) {
        out.push((
            "triangles drawn",
            of(part, whole),
            "How many, at most, have a part inside one of the light's views, out of those sent to them.",
        ));
    }
    if let Some(n) = r.fragments.filter(|n| *n > 0) {
        out.push((
            "fragments",
            grouped(n as usize),
            "How often the fragment shader runs while the light's views are drawn.",
        ));
    }
    if let (Some(needed), Some(added)) = (r.triangles_needed, r.triangles_added) {
        let sign = if added < 0 { "-" } else { "+" };
        let value = format!("{} {sign} {}", grouped(needed as usize), grouped(added.unsigned_abs() as usize));
        out.push((
            "triangles, warped",
            value,
            "Triangles that some pixel needs, and how many more are drawn because the warp splits them; fewer where they \
             are too small for any texel.",
        ));
    }
    if r.rays > 0 {
        let tip = "Shadow rays traced in one frame, out of the pixels that face the light.";
        out.push(("rays", of(r.rays, r.facing as u64), tip));
    }
    out.push(("memory held", mebibytes(r.gpu_bytes), MEMORY));
    out
}

/// What [`rows`] may name, in its order.
const NAMES: [&str; 7] =
    ["texels used", "views used", "triangles drawn", "fragments", "triangles, warped", "rays", "memory held"];
/// What the panel's section is for.
pub const TIP: &str = "How much of what the technique holds and draws some pixel of the picture makes use of.";
const MEMORY: &str =
    "GPU memory that the technique holds for its maps, buffers and textures, whether pixels use them or not.";

/// Bytes in words.
pub fn mebibytes(bytes: u64) -> String {
    format!("{:.2} MiB", bytes as f64 / 1048576.0)
}

/// The values of the technique's main parameters: `resolution 1024, kernel 3`.
pub fn main_values(r: &Record) -> String {
    let main = techniques::find(&r.technique).map_or(&[][..], |i| i.main);
    let values = r.values();
    let one = |(name, _): &(&str, &str)| {
        let value = values.iter().find(|(n, _)| n == name)?.1;
        Some(format!("{} {value}", name.replace('_', " ")))
    };
    main.iter().filter_map(one).collect::<Vec<_>>().join(", ")
}

/// A row's parameters as the panel shows them, `slope bias 0.75 × texel`, each with whether it differs from its default.
pub fn shown_params(technique: &str, params: &str) -> Vec<(String, bool)> {
    let info = techniques::find(technique);
    let one = |(name, value): (&str, &str)| {
        let spec = info.and_then(|i| i.specs().find(|s| s.name == name));
        match spec.and_then(|s| Some((s, s.parse(name, value).ok()?))) {
            Some((spec, v)) => {
                let unit = if matches!(v, Value::Int(_) | Value::Float(_)) { suffix(spec.unit) } else { String::new() };
                (format!("{} {}{unit}", shown_name(spec), shown_value(&v)), v != spec.default())
            }
            None => (format!("{} {value}", name.replace('_', " ")), false),
        }
    };
    params.split(';').filter_map(|p| p.split_once('=')).map(one).collect()
}

/// All parameters of a row, a line each.
pub fn listed(r: &Record) -> String {
    let all: Vec<String> = shown_params(&r.technique, &r.params).into_iter().map(|p| p.0).collect();
    all.join("\n")
}

/// A technique's title; the id of one that is unknown.
pub fn title(technique: &str) -> &str {
    techniques::find(technique).map_or(technique, |i| i.title)
}

/// The panel's table for the present set-up.
pub fn show(ui: &mut Ui, m: &Model, out: &mut Vec<Action>) {
    let Some(info) = m.edited() else {
        ui.label(RichText::new("The truth holds no maps: it traces rays.").small().weak());
        return;
    };
    let setup = m.setup.side(m.side());
    let measured = m.rows.iter().rev().find(|r| is_of(r, &setup));
    let known = match measured {
        Some(r) => rows(r),
        None => vec![("memory held", mebibytes(m.facts.bytes_of(m.side())), MEMORY)],
    };
    // All rows stand there from the beginning: nothing moves when they become known.
    let missing = match measured {
        Some(_) => "It does not apply to this technique.",
        None => "It is known once this set-up is measured.",
    };
    let row = |name| known.iter().find(|r| r.0 == name).cloned().unwrap_or((name, "–".into(), missing));
    table(ui, "needs", &NAMES.map(row));
    ui.horizontal(|ui| {
        ui.set_min_height(ui.spacing().interact_size.y);
        let text =
            if measured.is_some() { "as measured with this set-up" } else { "the rest is known once it is measured" };
        ui.label(RichText::new(text).small().weak());
        let ready = m.measuring.is_none() && m.setup.refusal(info).is_none();
        if measured.is_none() && ready && ui.small_button("Measure now").tip("Measure this set-up.").clicked() {
            out.push(Action::Measure);
        }
    });
}

/// Two columns: names and values.
pub fn table(ui: &mut Ui, id: impl std::hash::Hash + std::fmt::Debug, rows: &[Row]) {
    Grid::new(id).num_columns(2).min_col_width(98.0).spacing([8.0, 1.0]).show(ui, |ui| {
        for (name, value, tip) in rows {
            ui.label(RichText::new(*name).small()).tip_ui(|ui| {
                ui.label(*tip);
                words::under(ui, name);
            });
            // The longest, such as `67 108 864 of 67 108 864 (100.0 %)`, fit beside the names.
            let size = if value.chars().count() > 29 { 10.0 } else { 11.5 };
            ui.label(RichText::new(value).monospace().size(size)).tip(*tip);
            ui.end_row();
        }
    });
}

/// Whether a row was measured at this set-up, whatever its view.
fn is_of(r: &Record, setup: &Setup) -> bool {
    if r.technique != setup.technique || r.scene != setup.scene || r.params != params_text(setup) {
        return false;
    }
    let seen = |s: &Setup| (s.camera, s.lamps(), s.size, s.time, s.animation, s.seed);
    r.setup().is_ok_and(|s| seen(&s) == seen(setup))
}
