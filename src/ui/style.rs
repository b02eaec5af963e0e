//! The look: one calm theme, dark or light as the system has it or the user chooses, set once.

use egui::{Color32, CornerRadius, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, Theme, vec2};

const fn rgb(r: u8, g: u8, b: u8) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// What is written and drawn over the picture, in both themes.
pub const TEXT: Color32 = rgb(208, 213, 221);
pub const ACCENT: Color32 = rgb(120, 174, 232);
pub const SUN: Color32 = rgb(250, 205, 100);

/// Colours that differ between the themes.
struct Palette {
    panel: Color32,
    field: Color32,
    faint: Color32,
    button: Color32,
    hovered: Color32,
    active: Color32,
    open: Color32,
    /// The unfilled part of a slider's rail.
    rail: Color32,
    line: Color32,
    edge: Color32,
    text: Color32,
    weak: Color32,
    strong: Color32,
    accent: Color32,
    chosen: Color32,
    on_chosen: Color32,
    warning: Color32,
    error: Color32,
}

const DARK: Palette = Palette {
    panel: rgb(28, 31, 36),
    field: rgb(19, 21, 25),
    faint: rgb(33, 37, 43),
    button: rgb(44, 49, 57),
    hovered: rgb(56, 63, 74),
    active: rgb(66, 75, 89),
    open: rgb(50, 56, 66),
    rail: rgb(58, 64, 74),
    line: rgb(52, 57, 66),
    edge: rgb(84, 94, 110),
    text: TEXT,
    weak: rgb(150, 158, 170),
    strong: Color32::WHITE,
    accent: ACCENT,
    chosen: rgb(38, 78, 121),
    on_chosen: rgb(225, 236, 250),
    warning: SUN,
    error: rgb(240, 128, 112),
};

const LIGHT: Palette = Palette {
    panel: rgb(243, 244, 246),
    field: Color32::WHITE,
    faint: rgb(234, 236, 240),
    button: rgb(222, 225, 230),
    hovered: rgb(208, 213, 221),
    active: rgb(190, 198, 210),
    open: rgb(213, 218, 226),
    rail: rgb(200, 205, 214),
    line: rgb(205, 209, 216),
    edge: rgb(140, 149, 163),
    text: rgb(38, 43, 51),
    weak: rgb(92, 100, 112),
    strong: Color32::BLACK,
    accent: rgb(24, 98, 176),
    chosen: rgb(187, 214, 243),
    on_chosen: rgb(12, 44, 82),
    warning: rgb(150, 92, 0),
    error: rgb(178, 40, 28),
};

/// Sets both themes of a context; which of them shows, egui knows.
pub fn apply(ctx: &egui::Context) {
    // The text's own font has no arrows; the other one that is there has.
    let mut fonts = FontDefinitions::default();
    fonts.families.entry(FontFamily::Proportional).or_default().push("Hack".into());
    ctx.set_fonts(fonts);
    for (theme, palette, visuals) in
        [(Theme::Dark, DARK, egui::Visuals::dark()), (Theme::Light, LIGHT, egui::Visuals::light())]
    {
        ctx.style_mut_of(theme, |s| {
            s.visuals = visuals.clone();
            set(s, &palette);
        });
    }
}

fn set(s: &mut egui::Style, p: &Palette) {
    s.text_styles = [
        (TextStyle::Small, FontId::proportional(11.5)),
        (TextStyle::Body, FontId::proportional(13.5)),
        (TextStyle::Button, FontId::proportional(13.5)),
        (TextStyle::Heading, FontId::proportional(15.0)),
        (TextStyle::Monospace, FontId::monospace(12.5)),
    ]
    .into();
    let space = &mut s.spacing;
    space.item_spacing = vec2(6.0, 5.0);
    space.button_padding = vec2(7.0, 2.0);
    space.interact_size = vec2(36.0, 21.0);
    space.combo_width = 130.0;
    space.indent = 12.0;
    space.tooltip_width = 320.0;
    // More than any window has: a list may be as high as that.
    space.default_area_size.y = 1e4;
    space.scroll = egui::style::ScrollStyle::solid();
    space.scroll.bar_width = 8.0;
    s.interaction.tooltip_delay = 0.35;
    s.interaction.selectable_labels = false;

    let v = &mut s.visuals;
    v.panel_fill = p.panel;
    v.window_fill = p.panel;
    v.window_stroke = Stroke::new(1.0, p.line);
    v.extreme_bg_color = p.field;
    v.faint_bg_color = p.faint;
    v.hyperlink_color = p.accent;
    v.error_fg_color = p.error;
    v.warn_fg_color = p.warning;
    v.weak_text_color = Some(p.weak);
    v.selection.bg_fill = p.chosen;
    v.selection.stroke = Stroke::new(1.0, p.on_chosen);
    v.slider_trailing_fill = true;
    v.window_shadow = egui::Shadow { offset: [0, 4], blur: 16, spread: 0, color: Color32::from_black_alpha(110) };
    v.popup_shadow = v.window_shadow;
    let widgets = &mut v.widgets;
    for (w, fill, line, text) in [
        (&mut widgets.noninteractive, p.panel, p.line, p.text),
        (&mut widgets.inactive, p.button, p.button, p.text),
        (&mut widgets.hovered, p.hovered, p.edge, p.strong),
        (&mut widgets.active, p.active, p.accent, p.strong),
        (&mut widgets.open, p.open, p.line, p.text),
    ] {
        w.bg_fill = fill;
        w.weak_bg_fill = fill;
        w.bg_stroke = Stroke::new(1.0, line);
        w.fg_stroke = Stroke::new(1.0, text);
        w.corner_radius = CornerRadius::same(4);
        w.expansion = 0.0;
    }
    widgets.inactive.bg_stroke = Stroke::NONE;
    widgets.inactive.bg_fill = p.rail;
}
