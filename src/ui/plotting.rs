//! What the window's charts have in common: a technique's colour and marker, logarithmic axes, labels.

pub use crate::chart::short;
use crate::chart::{COLORS, mark, round_step};
use egui::{Align2, Color32, FontId, Pos2, Rect, Ui, Vec2, pos2, vec2};
use egui_plot::{GridMark, MarkerShape};

/// A technique's colour, lightened for the dark ground.
pub fn color(technique: &str) -> Color32 {
    let [r, g, b] = COLORS[mark(technique) % COLORS.len()];
    Color32::from_rgb(r, g, b).lerp_to_gamma(Color32::WHITE, 0.22)
}

/// A technique's marker.
pub fn marker(technique: &str) -> MarkerShape {
    use MarkerShape::{Circle, Diamond, Down, Left, Plus, Right, Square, Up};
    [Circle, Square, Up, Diamond, Down, Plus, Left, Right][mark(technique) % 8]
}

/// A logarithmic axis on which zero has a place of its own, below the decade of the smallest value.
#[derive(Clone, Copy)]
pub struct LogAxis {
    /// Where zero stands, as an exponent; None: no value is zero.
    zero: Option<f64>,
}

impl LogAxis {
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> LogAxis {
        let least = values.clone().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
        let zero = values.clone().any(|v| v <= 0.0);
        let below = if least.is_finite() { (least.log10() - 0.4).floor() } else { -1.0 };
        LogAxis { zero: zero.then_some(below) }
    }

    /// Where a value stands.
    pub fn at(self, value: f64) -> f64 {
        if value > 0.0 { value.log10() } else { self.zero.unwrap_or(-1.0) }
    }

    /// The grid: 1, 2 and 5 of each decade, and zero.
    pub fn marks(self, (low, high): (f64, f64)) -> Vec<GridMark> {
        let mut out = Vec::new();
        let least = self.zero.map_or(low, |z| low.max(z + 0.2));
        // Within one decade more numbers are needed.
        let fine: &[(f64, f64)] = match high - low {
            span if span < 0.5 => {
                &[1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0].map(|m| (m, 0.05))
            }
            span if span < 1.2 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0].map(|m| (m, 0.15)),
            _ => &[(1.0, 1.0), (2.0, 0.3), (5.0, 0.3)],
        };
        // None so near the right or upper end that its number would be cut.
        let high = high - 0.02 * (high - low);
        let (first, last) = (low.floor().max(-30.0) as i32, high.ceil().min(30.0) as i32);
        for decade in first..=last {
            for (mantissa, step_size) in fine {
                let value = decade as f64 + mantissa.log10();
                if value >= least && value <= high {
                    out.push(GridMark { value, step_size: *step_size });
                }
            }
        }
        if out.len() < 2 && high > least {
            // So narrow that only a linear scale has two round numbers there.
            let [from, to] = [least, high].map(|v| 10f64.powf(v));
            let step = round_step(from, to, 4);
            let values = (from / step).ceil() as i64..=(to / step).floor() as i64;
            let mark = |i: i64| GridMark { value: (i as f64 * step).log10(), step_size: (high - least) / 4.0 };
            out = values.filter(|i| *i > 0).map(mark).collect();
        }
        out.extend(self.zero.map(|value| GridMark { value, step_size: 1.0 }));
        out
    }

    /// What is written beside a mark.
    pub fn text(self, mark: GridMark) -> String {
        if self.zero == Some(mark.value) { "0".into() } else { short(10f64.powf(mark.value)) }
    }
}

/// Writes into a chart's frame, on a ground that keeps it readable over what is drawn there.
pub fn say(ui: &Ui, frame: Rect, (align, at): (Align2, Pos2), text: String, font: FontId, color: Color32) {
    if text.is_empty() {
        return;
    }
    let galley = ui.painter().layout(text, font, color, frame.width() - 16.0);
    let place = align.anchor_size(at, galley.size());
    let painter = ui.painter().with_clip_rect(frame);
    painter.rect_filled(place.expand2(vec2(4.0, 2.0)), 3.0, ui.visuals().extreme_bg_color.gamma_multiply(0.85));
    painter.galley(place.min, galley, color);
}

/// Labels that keep out of each other's way.
pub struct Labels {
    inside: Rect,
    placed: Vec<Rect>,
    markers: Vec<Rect>,
    lines: Vec<[Pos2; 2]>,
}

impl Labels {
    pub fn new(inside: Rect) -> Labels {
        Labels { inside, placed: Vec::new(), markers: Vec::new(), lines: Vec::new() }
    }

    /// Markers that labels keep off where there is other room.
    pub fn keep_clear(&mut self, markers: impl Iterator<Item = Pos2>) {
        self.markers.extend(markers.map(|at| Rect::from_center_size(at, Vec2::splat(10.0))));
    }

    /// Lines that labels keep off where there is other room.
    pub fn keep_off(&mut self, lines: impl Iterator<Item = [Pos2; 2]>) {
        self.lines.extend(lines);
    }

    /// Writes beside the first of some points, or above it, or on the next side that is free there or at another of them;
    /// not at all where none is.
    pub fn write(&mut self, ui: &Ui, points: &[Pos2], text: &str, color: Color32, above: bool) {
        let painter = ui.painter().with_clip_rect(self.inside);
        let galley = painter.layout_no_wrap(text.into(), FontId::proportional(11.5), color);
        let mut sides = [
            (Align2::LEFT_CENTER, vec2(12.0, 0.0)),
            (Align2::RIGHT_CENTER, vec2(-12.0, 0.0)),
            (Align2::CENTER_BOTTOM, vec2(0.0, -10.0)),
            (Align2::CENTER_TOP, vec2(0.0, 10.0)),
            (Align2::LEFT_BOTTOM, vec2(8.0, -8.0)),
            (Align2::LEFT_TOP, vec2(8.0, 8.0)),
        ];
        if above {
            sides.swap(0, 2);
        }
        // First beside all lines, if a little farther away, then over them, and over markers only at last.
        for (over, reach) in [(0, 1.0), (0, 1.7), (0, 2.6), (1, 1.0), (1, 1.7), (1, 2.6), (2, 1.0)] {
            for (at, (align, offset)) in points.iter().flat_map(|at| sides.map(|side| (*at, side))) {
                let rect = align.anchor_size(at + offset * reach, galley.size());
                let free = |r: &Rect| !r.expand2(vec2(3.0, 0.0)).intersects(rect);
                let crossed = match self.markers.iter().all(free) {
                    true => self.lines.iter().any(|line| crosses(rect, *line)) as u32,
                    false => 2,
                };
                if crossed <= over && self.inside.contains_rect(rect) && self.placed.iter().all(free) {
                    if crossed > 0 {
                        let ground = ui.visuals().extreme_bg_color.gamma_multiply(0.7);
                        painter.rect_filled(rect.expand2(vec2(2.0, 0.0)), 2.0, ground);
                    }
                    painter.galley(pos2(rect.left(), rect.top()), galley, color);
                    self.placed.push(rect);
                    return;
                }
            }
        }
    }
}

/// Whether a line passes through a rectangle.
fn crosses(rect: Rect, [a, b]: [Pos2; 2]) -> bool {
    crate::chart::inside(&[rect.left(), rect.top(), rect.right(), rect.bottom()].map(f64::from), pair(a), pair(b)) > 0.0
}

fn pair(p: Pos2) -> (f64, f64) {
    (p.x.into(), p.y.into())
}
