//! How the views of errors are drawn.

use super::controls::{Tip, row};
use super::model::Model;
use crate::setup::{Base, MAX_DILATION, MAX_WINDOW};
use egui::{Button, DragValue, Ui};

/// The views that mark wrong or differing pixels, and those that draw them over the picture in greys of one's choice.
const MARKED: [&str; 4] = ["error", "causes", "error-size", "difference"];
const OVER_GREY: [&str; 5] = ["error", "causes", "error-size", "error-density", "flip"];

/// Rows for the options that the view shown has; nothing for other views.
pub fn error_options(ui: &mut Ui, m: &mut Model) {
    let s = &mut m.setup;
    let view = s.overlay.as_ref().map_or(s.view.as_str(), |o| o.view.as_str());
    let (marked, over_grey, dense) = (MARKED.contains(&view), OVER_GREY.contains(&view), view == "error-density");
    if marked {
        let tip = "Pixels by which each wrong one grows in the picture, so that single ones are seen on paper and on a \
                   projector. Figures stay.";
        row(ui, "dilation", tip, |ui, _| {
            for n in 0..=MAX_DILATION {
                if ui.add(Button::selectable(s.error_dilation == n, format!("{n} px"))).tip(tip).clicked() {
                    s.error_dilation = n;
                }
            }
        });
    }
    if over_grey && s.overlay.is_none() {
        let tip = "The greys below the errors: dark for the screen, light for print and projectors.";
        row(ui, "base", tip, |ui, _| {
            for (base, text) in [(Base::Dark, "dark"), (Base::Light, "light")] {
                if ui.add(Button::selectable(s.error_base == base, text)).tip(tip).clicked() {
                    s.error_base = base;
                }
            }
        });
    }
    if dense {
        let tip = "Side of the square around each pixel in which wrong pixels are counted.";
        row(ui, "window", tip, |ui, label| {
            let drag = DragValue::new(&mut s.error_window).range(1..=MAX_WINDOW).speed(0.2).suffix(" px");
            if ui.add(drag).labelled_by(label.id).tip(tip).changed() {
                // Odd, so that it has a middle.
                s.error_window |= 1;
            }
        });
    }
    if view == "curve" {
        let tip = "The place in the picture that the chart is of, in shares of its width and height from the upper left corner.";
        row(ui, "probe", tip, |ui, label| {
            for share in &mut s.probe {
                let drag = DragValue::new(share).range(0.0..=1.0).speed(0.002).max_decimals(3);
                ui.add(drag).labelled_by(label.id).tip(tip);
            }
        });
    }
}
