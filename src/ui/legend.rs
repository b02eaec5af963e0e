//! The legend over the picture: a strip at its lower edge, and the axes of charts.

use super::model::Model;
use crate::legend::{self, Anchor, Key, Mark, Part};
use crate::palette::bytes;
use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, pos2, vec2};

/// Size of the text, points.
const SIZE: f32 = 12.5;
const INK: Color32 = Color32::from_rgb(240, 240, 240);
const GROUND: Color32 = Color32::from_rgba_premultiplied(14, 16, 20, 214);

/// Paints the axes of what is shown, and its legend if that is wanted; the part of the viewport that its strip leaves free.
pub fn show(ui: &Ui, rect: Rect, m: &Model) -> Rect {
    let mut key = Key::new(&m.setup, m.bounds, &m.facts.known);
    // The sides of a comparison have their titles in the picture.
    key.parts.retain(|p| !matches!(p, Part::Text(_)));
    let painter = ui.painter().with_clip_rect(rect);
    let (height, marks) = legend::strip(&key, rect.width(), SIZE);
    // A viewport that is hardly higher is better seen than explained.
    let shown = m.show_legend && !key.is_empty() && height <= 0.4 * rect.height();
    let strip = rect.with_min_y(rect.bottom() - if shown { height } else { 0.0 });
    for mark in legend::axes(&key, [rect.width(), rect.height()], strip.top() - rect.top(), SIZE) {
        paint(&painter, rect.min, &mark);
    }
    if shown {
        painter.rect_filled(strip, 0.0, GROUND);
        marks.iter().for_each(|mark| paint(&painter, strip.min, mark));
    }
    rect.with_max_y(strip.top() - key.lower_axis(SIZE))
}

fn color([r, g, b]: [f32; 3]) -> Color32 {
    let [r, g, b] = bytes([r, g, b]);
    Color32::from_rgb(r, g, b)
}

fn paint(painter: &Painter, from: Pos2, mark: &Mark) {
    let at = |[x, y]: [f32; 2]| from + vec2(x, y);
    let boxed = |[l, t, r, b]: [f32; 4]| Rect::from_min_max(at([l, t]), at([r, b]));
    let line = Stroke::new(1.0, Color32::from_gray(136));
    match mark {
        Mark::Fill(rect, c) => {
            painter.rect(boxed(*rect), 0.0, color(*c), line, StrokeKind::Inside);
        }
        Mark::Scale(rect, palette) => {
            let rect = boxed(*rect);
            let mut mesh = Mesh::default();
            let last = palette.stops.len() - 1;
            for (i, stop) in palette.stops.iter().enumerate() {
                let x = rect.left() + rect.width() * i as f32 / last as f32;
                mesh.colored_vertex(pos2(x, rect.top()), color(*stop));
                mesh.colored_vertex(pos2(x, rect.bottom()), color(*stop));
                if i > 0 {
                    let v = 2 * i as u32;
                    mesh.add_triangle(v - 2, v - 1, v);
                    mesh.add_triangle(v - 1, v, v + 1);
                }
            }
            painter.add(Shape::mesh(mesh));
            painter.rect_stroke(rect, 0.0, line, StrokeKind::Outside);
        }
        Mark::Line(a, b) => {
            painter.line_segment([at(*a), at(*b)], Stroke::new(1.0, INK));
        }
        Mark::Text { at: place, anchor, size, text, strong, ground } => {
            let align = match anchor {
                Anchor::Start => Align2::LEFT_CENTER,
                Anchor::Middle => Align2::CENTER_CENTER,
                Anchor::End => Align2::RIGHT_CENTER,
            };
            if *ground {
                painter.rect_filled(
                    boxed(legend::text_box(*place, *anchor, *size, text)),
                    2.0,
                    Color32::from_black_alpha(150),
                );
            }
            let ink = if *strong { Color32::WHITE } else { INK };
            painter.text(at(*place), align, text, FontId::proportional(*size), ink);
        }
    }
}
