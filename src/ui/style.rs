//! The look: one calm dark theme, set once.

use egui::{Color32, CornerRadius, FontId, Stroke, TextStyle, Theme, vec2};

pub const PANEL: Color32 = Color32::from_rgb(28, 31, 36);
pub const FIELD: Color32 = Color32::from_rgb(19, 21, 25);
pub const BUTTON: Color32 = Color32::from_rgb(44, 49, 57);
pub const LINE: Color32 = Color32::from_rgb(52, 57, 66);
pub const TEXT: Color32 = Color32::from_rgb(208, 213, 221);
pub const WEAK: Color32 = Color32::from_rgb(150, 158, 170);
pub const ACCENT: Color32 = Color32::from_rgb(120, 174, 232);
pub const CHOSEN: Color32 = Color32::from_rgb(38, 78, 121);
pub const SUN: Color32 = Color32::from_rgb(250, 205, 100);
pub const ERROR: Color32 = Color32::from_rgb(240, 128, 112);

/// Sets the theme of a context.
pub fn apply(ctx: &egui::Context) {
    ctx.set_theme(Theme::Dark);
    ctx.all_styles_mut(|s| {
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
        space.scroll = egui::style::ScrollStyle::solid();
        space.scroll.bar_width = 8.0;
        s.interaction.tooltip_delay = 0.35;
        s.interaction.selectable_labels = false;

        let v = &mut s.visuals;
        *v = egui::Visuals::dark();
        v.panel_fill = PANEL;
        v.window_fill = PANEL;
        v.window_stroke = Stroke::new(1.0, LINE);
        v.extreme_bg_color = FIELD;
        v.faint_bg_color = Color32::from_rgb(33, 37, 43);
        v.hyperlink_color = ACCENT;
        v.error_fg_color = ERROR;
        v.warn_fg_color = SUN;
        v.weak_text_color = Some(WEAK);
        v.selection.bg_fill = CHOSEN;
        v.selection.stroke = Stroke::new(1.0, Color32::from_rgb(225, 236, 250));
        v.slider_trailing_fill = true;
        v.window_shadow = egui::Shadow { offset: [0, 4], blur: 16, spread: 0, color: Color32::from_black_alpha(110) };
        v.popup_shadow = v.window_shadow;
        let widgets = &mut v.widgets;
        for (w, fill, line, text) in [
            (&mut widgets.noninteractive, PANEL, LINE, TEXT),
            (&mut widgets.inactive, BUTTON, BUTTON, TEXT),
            (&mut widgets.hovered, Color32::from_rgb(56, 63, 74), Color32::from_rgb(84, 94, 110), Color32::WHITE),
            (&mut widgets.active, Color32::from_rgb(66, 75, 89), ACCENT, Color32::WHITE),
            (&mut widgets.open, Color32::from_rgb(50, 56, 66), LINE, TEXT),
        ] {
            w.bg_fill = fill;
            w.weak_bg_fill = fill;
            w.bg_stroke = Stroke::new(1.0, line);
            w.fg_stroke = Stroke::new(1.0, text);
            w.corner_radius = CornerRadius::same(4);
            w.expansion = 0.0;
        }
        widgets.inactive.bg_stroke = Stroke::NONE;
        // The unfilled part of a slider's rail.
        widgets.inactive.bg_fill = Color32::from_rgb(58, 64, 74);
    });
}
