//! The panel's part on what is shown: views in groups, an overlay, the legend, the truth's samples.

use super::controls::{Tip, chips, row, slide, steady};
use super::errors::error_options;
use super::lamps;
use super::model::Model;
use super::words;
use crate::legend::letter;
use crate::setup::{Overlay, Setup};
use crate::truth::{COUNTS, Samples};
use crate::view::{self, Group, View};
use egui::{ComboBox, RichText, Ui};

const TRUTH_TIP: &str = "Samples per pixel of the truth, which is the exact shadow, traced by rays. One, at the pixel's centre: \
     what a hard technique aims at. More: the mean over the pixel, and over a light that has a size, which a filter aims at \
     and an eye sees. Auto: one or 16, whichever suits the technique; measurements then take 16, so that all techniques \
     share one truth.";

pub fn show(ui: &mut Ui, m: &mut Model) {
    let (side, own) = whose(m);
    let now = m.setup.view.clone();
    for group in Group::ALL {
        let of = |v: &&View| v.group == group;
        let views: Vec<&View> = view::VIEWS.iter().chain(own.iter().copied()).filter(of).collect();
        if views.is_empty() {
            continue;
        }
        let own = m.setup.sides() > 1 && views.iter().any(|v| view::index(v.id).is_none());
        let title = if own { format!("{} of {}", group.title(), letter(side)) } else { group.title().into() };
        ui.label(RichText::new(title).small().weak());
        let tip = |v: &View| {
            let own = match view::index(v.id) {
                Some(i) if i < 9 => format!("{} (key {})", v.doc, i + 1),
                _ => format!("{}{}", v.doc, lacking(&m.setup, v)),
            };
            own + &words::said(v.title)
        };
        if let Some(i) = chips(ui, views.iter().map(|v| (v.title, v.id == now, tip(v)))) {
            m.setup.view = views[i].id.into();
            m.setup.overlay = None;
        }
        ui.add_space(2.0);
    }
    lamps::of_which(ui, m);
    let tip =
        "What the colours of the picture mean, at its lower edge. Captures have it where that is ticked under Capture.";
    row(ui, "legend", tip, |ui, label| {
        ui.checkbox(&mut m.show_legend, "").labelled_by(label.id).tip(tip);
    });
    row(ui, "truth samples", TRUTH_TIP, |ui, label| {
        let all = [Samples::Auto].into_iter().chain(COUNTS.map(Samples::Fixed));
        let text = match m.setup.truth_samples {
            Samples::Auto => format!("auto: {}", m.setup.shown_samples()),
            fixed => fixed.to_string(),
        };
        let combo = ComboBox::from_id_salt("truth samples").selected_text(text).width(ui.available_width());
        let shown = combo.show_ui(ui, |ui| {
            for samples in all {
                ui.selectable_value(&mut m.setup.truth_samples, samples, samples.to_string());
            }
        });
        shown.response.labelled_by(label.id).tip(TRUTH_TIP);
    });
    // Last, what comes and goes with what is chosen above.
    overlay(ui, m);
    steady(ui, "options", m.still, |ui| {
        overlay_options(ui, m);
        error_options(ui, m);
    });
}

/// The side whose technique's own views are offered, and those views: the one that is edited, or the first in place of the
/// truth.
fn whose(m: &Model) -> (usize, Vec<&'static View>) {
    let (side, info) = m.edited().map_or((0, m.info()), |info| (m.side(), info));
    let values = side.checked_sub(1).map_or(m.setup.values(), |i| &m.setup.against[i].params);
    (side, info.views(values).collect())
}

/// Which sides of a comparison do not have a view, in words; nothing where all have it.
fn lacking(setup: &Setup, v: &View) -> String {
    let has = |side: usize| setup.view_of(side, v.id).is_some();
    let without: Vec<&str> = (0..setup.sides()).filter(|side| !has(*side)).map(letter).collect();
    match without.len() {
        0 => String::new(),
        1 => format!("\n{} has no such view and is shaded.", without[0]),
        _ => format!("\n{} have no such view and are shaded.", without.join(", ")),
    }
}

/// Which view lies over the shaded picture.
fn overlay(ui: &mut Ui, m: &mut Model) {
    let tip = "A view blended over the shaded picture, or small in its corner.";
    let (_, own) = whose(m);
    row(ui, "overlay", tip, |ui, label| {
        let id = m.setup.overlay.as_ref().map(|o| o.view.clone());
        let title = id.as_deref().and_then(|id| m.setup.find_view(id)).map_or("none", |v| v.title);
        let combo = ComboBox::from_id_salt("overlay").selected_text(title).width(ui.available_width()).truncate();
        let shown = combo.show_ui(ui, |ui| {
            if ui.selectable_label(id.is_none(), "none").clicked() {
                m.setup.overlay = None;
            }
            let alone = m.setup.sides() == 1;
            let offered = |v: &&View| v.id != "shaded" && (alone || v.id != "difference");
            for v in view::VIEWS.iter().chain(own).filter(offered) {
                let chosen = id.as_deref() == Some(v.id);
                if ui.selectable_label(chosen, v.title).tip(v.doc).clicked() {
                    let (opacity, inset) =
                        m.setup.overlay.as_ref().map_or((0.5, !v.shows_scene()), |o| (o.opacity, o.inset));
                    m.setup.overlay = Some(Overlay { view: v.id.into(), opacity, inset });
                }
            }
        });
        shown.response.labelled_by(label.id).tip(tip);
    });
}

/// How it lies there.
fn overlay_options(ui: &mut Ui, m: &mut Model) {
    let Some(o) = &mut m.setup.overlay else { return };
    let tip = "Small in the upper right corner instead of all over.";
    row(ui, "inset", tip, |ui, label| {
        ui.checkbox(&mut o.inset, "").labelled_by(label.id).tip(tip);
    });
    if !o.inset {
        let mut percent = o.opacity * 100.0;
        if slide(ui, "opacity", "0: not seen. 100: hides what is below.", &mut percent, 0.0..=100.0, false, "%") {
            o.opacity = percent / 100.0;
        }
    }
}
