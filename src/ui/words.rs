//! The glossary in the window: terms in texts and tooltips, and a window to search.

use super::model::Model;
use crate::glossary::{self, Piece, Term};
use egui::{Align2, Context, Key, Label, Response, RichText, ScrollArea, Sense, TextEdit, Ui, vec2};

/// The glossary's window while it is open.
#[derive(Default)]
pub struct Words {
    pub search: String,
    /// The field has had the focus.
    drawn: bool,
}

impl Words {
    /// Opened at a term.
    pub fn at(term: &str) -> Words {
        Words { search: term.into(), drawn: false }
    }
}

/// Lays a text out, whose terms explain themselves; the one that was clicked.
pub fn prose(ui: &mut Ui, text: &str) -> Option<&'static str> {
    let mut clicked = None;
    for (i, paragraph) in text.split("\n\n").enumerate() {
        if i > 0 {
            ui.add_space(4.0);
        }
        let paragraph = paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
        ui.horizontal_wrapped(|ui| {
            // Lines of text, no rows of buttons.
            ui.spacing_mut().item_spacing = vec2(0.0, 2.0);
            ui.spacing_mut().interact_size.y = 0.0;
            for piece in glossary::pieces(&paragraph) {
                match piece {
                    Piece::Text(text) => _ = ui.label(text),
                    // As the panel calls it.
                    Piece::Code(code) => _ = ui.label(RichText::new(code.replace('_', " ")).strong()),
                    Piece::Term(word, term) => {
                        let text = RichText::new(word).underline().color(ui.visuals().hyperlink_color);
                        let label = ui.add(Label::new(text).sense(Sense::click()));
                        if explained(label, glossary::find(term)).clicked() {
                            clicked = Some(term);
                        }
                    }
                }
            }
        });
    }
    clicked
}

fn explained(r: Response, term: Option<&Term>) -> Response {
    match term {
        Some(term) => r.on_hover_ui(|ui| {
            ui.set_max_width(ui.spacing().tooltip_width);
            entry(ui, term);
        }),
        None => r,
    }
}

fn entry(ui: &mut Ui, term: &Term) {
    ui.label(RichText::new(&term.term).strong());
    ui.label(term.text.trim());
}

/// The terms that a name uses.
fn terms(name: &str) -> impl Iterator<Item = &'static Term> {
    glossary::pieces(name).into_iter().filter_map(|piece| match piece {
        Piece::Term(_, term) => glossary::find(term),
        _ => None,
    })
}

/// What the glossary says of the words of a name that stands in the panel; for its tooltip, under what the name itself means.
pub fn under(ui: &mut Ui, name: &str) {
    for term in terms(name) {
        ui.separator();
        entry(ui, term);
    }
}

/// The same as text.
pub fn said(name: &str) -> String {
    terms(name).map(|t| format!("\n\n{}: {}", t.term, t.text.trim())).collect()
}

/// Draws the window, if it is open.
pub fn show(ctx: &Context, m: &mut Model) {
    let Some(words) = &mut m.words else { return };
    let mut open = true;
    let room = ctx.content_rect().size();
    let window = egui::Window::new("Glossary").open(&mut open).collapsible(false).resizable(false);
    let size = vec2((room.x - 60.0).clamp(200.0, 520.0), (room.y - 160.0).clamp(80.0, 560.0));
    window.fixed_size(size).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0)).show(ctx, |ui| {
        let edit = TextEdit::singleline(&mut words.search).hint_text("search").desired_width(f32::INFINITY);
        let edit = ui.add(edit);
        edit.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "search the glossary"));
        if !std::mem::replace(&mut words.drawn, true) {
            edit.request_focus();
        }
        let wanted = words.search.trim().to_lowercase();
        let mut found: Vec<&Term> = glossary::all().iter().filter(|t| glossary::matches(t, &wanted)).collect();
        // What is called so comes first.
        found.sort_by_key(|t| glossary::find(&wanted).is_none_or(|named| named.term != t.term));
        ui.add_space(4.0);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            if found.is_empty() {
                ui.label(RichText::new("No term is called that.").weak());
            }
            for term in found {
                ui.label(RichText::new(&term.term).strong());
                if !term.also.is_empty() {
                    ui.label(RichText::new(format!("also: {}", term.also.join(", "))).small().weak());
                }
                ui.label(term.text.trim());
                if !term.read.is_empty() {
                    let pages: Vec<String> = term.read.iter().map(|page| format!("docs/{page}")).collect();
                    ui.label(RichText::new(format!("Read on: {}", pages.join(", "))).small().weak());
                }
                ui.add_space(8.0);
            }
        });
    });
    if !open || ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, Key::Escape)) {
        m.words = None;
    }
}
