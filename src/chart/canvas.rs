//! The page that a chart is drawn on: SVG text, written by hand. (Plotters rounds to whole pixels and knows neither
//! millimetres nor where there is room for a label.)

use ab_glyph::{Font, FontRef};
use std::fmt::Write;
use std::sync::LazyLock;

/// Width of a column of a two-column page, and of every chart, millimetres.
pub const COLUMN_MM: f64 = 84.0;
/// Points of 1/72 inch a millimetre; a chart is drawn in points.
const PT_PER_MM: f64 = 72.0 / 25.4;
/// Width of the page, points.
pub const WIDTH: f64 = COLUMN_MM * PT_PER_MM;
/// Size of the text, and of titles.
pub const SMALL: f64 = 7.0;
pub const TITLE: f64 = 8.5;
/// Half the size of a marker, points.
pub const MARKER: f64 = 2.5;

const FAMILY: &str = "Helvetica, Arial, 'Liberation Sans', Ubuntu, sans-serif";
pub const BLACK: &str = "#222222";
pub const GREY: &str = "#555555";
const LIGHT: &str = "#e4e4e4";

/// Where a text starts, ends or has its middle.
#[derive(Clone, Copy)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Default)]
pub struct Canvas {
    out: String,
}

/// A drawn line's looks.
pub struct Stroke<'a> {
    pub color: &'a str,
    /// Points.
    pub width: f64,
    /// As `stroke-dasharray`; empty: solid.
    pub dash: &'a str,
}

impl Stroke<'_> {
    pub fn solid(color: &str, width: f64) -> Stroke<'_> {
        Stroke { color, width, dash: "" }
    }
}

impl Canvas {
    fn add(&mut self, text: std::fmt::Arguments) {
        // Writing to a String does not fail.
        let _ = self.out.write_fmt(text);
        self.out.push('\n');
    }

    /// A line through points.
    pub fn line(&mut self, class: &str, points: &[(f64, f64)], s: &Stroke) {
        let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.2} {y:.2}")).collect();
        let dash = if s.dash.is_empty() { String::new() } else { format!(r#" stroke-dasharray="{}""#, s.dash) };
        self.add(format_args!(
            r#"<path class="{class}" d="M{}" fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round"{dash}/>"#,
            path.join("L"),
            s.color,
            s.width
        ));
    }

    /// A technique's marker; `told` is shown where a mouse rests on it.
    pub fn marker(&mut self, class: &str, place: usize, (x, y): (f64, f64), told: &str) {
        self.add(format_args!(
            r##"<path class="{class}" transform="translate({x:.2} {y:.2})" d="{}" fill="{}" stroke="#ffffff" stroke-width="0.5"><title>{}</title></path>"##,
            shape(place),
            color(place),
            escape(told)
        ));
    }

    /// What stays in the background.
    pub fn faint(&mut self, draw: impl FnOnce(&mut Canvas)) {
        self.add(format_args!(r#"<g opacity="0.4">"#));
        draw(self);
        self.add(format_args!("</g>"));
    }

    /// A text on its base line.
    pub fn text(&mut self, class: &str, (x, y): (f64, f64), anchor: Anchor, size: f64, color: &str, text: &str) {
        self.rich(class, (x, y), anchor, size, color, &escape(text));
    }

    /// As [`Canvas::text`], with an exponent behind it.
    pub fn power(&mut self, class: &str, at: (f64, f64), anchor: Anchor, text: &str, exponent: Option<i32>) {
        let raised = exponent.map_or(String::new(), |e| {
            let e = e.to_string().replace('-', "−");
            format!(r#"<tspan dy="{:.2}" font-size="{:.2}">{e}</tspan>"#, -SMALL * 0.36, SMALL * EXPONENT)
        });
        self.rich(class, at, anchor, SMALL, BLACK, &(escape(text) + &raised));
    }

    fn rich(&mut self, class: &str, (x, y): (f64, f64), anchor: Anchor, size: f64, color: &str, inside: &str) {
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => r#" text-anchor="middle""#,
            Anchor::End => r#" text-anchor="end""#,
        };
        self.add(format_args!(
            r#"<text class="{class}" x="{x:.2}" y="{y:.2}" font-size="{size}" fill="{color}"{anchor}>{inside}</text>"#
        ));
    }

    /// A white sheet that text is written on, so that lines below do not cross it.
    pub fn sheet(&mut self, [x0, y0, x1, y1]: [f64; 4]) {
        self.add(format_args!(
            r##"<rect x="{x0:.2}" y="{y0:.2}" width="{:.2}" height="{:.2}" fill="#ffffff" fill-opacity="0.8"/>"##,
            x1 - x0,
            y1 - y0
        ));
    }

    /// A line of the grid.
    pub fn grid(&mut self, from: (f64, f64), to: (f64, f64)) {
        self.line("grid", &[from, to], &Stroke::solid(LIGHT, 0.5));
    }

    /// The two strokes that break an axis at a place; `along` is the axis' direction.
    pub fn broken(&mut self, (x, y): (f64, f64), along: (f64, f64)) {
        self.line("gap", &[(x - along.0, y - along.1), (x + along.0, y + along.1)], &Stroke::solid("#ffffff", 2.0));
        for side in [-1.0, 1.0] {
            let (x, y) = (x + side * along.0, y + side * along.1);
            let slant = (2.5 * along.1.abs() + 0.8 * along.0, 0.8 * along.1.abs() + 2.5 * along.0);
            let ends = [(x - slant.0, y + slant.1), (x + slant.0, y - slant.1)];
            self.line("gap", &ends, &Stroke::solid(BLACK, 0.6));
        }
    }

    /// The whole file.
    pub fn finish(self, title: &str, height: f64) -> String {
        format!(
            r##"<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{COLUMN_MM}mm" height="{:.3}mm" viewBox="0 0 {WIDTH:.3} {height:.3}" font-family="{FAMILY}" role="img">
<title>{}</title>
<rect width="100%" height="100%" fill="#ffffff"/>
{}</svg>
"##,
            height / PT_PER_MM,
            escape(title),
            self.out
        )
    }
}

/// Size of an exponent beside its base.
const EXPONENT: f64 = 0.74;

static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok());

/// Width of a text, points: a little more than in common sans-serif fonts.
pub fn text_width(text: &str, size: f64) -> f64 {
    let units = match &*FONT {
        Some(font) => {
            let of = |c| font.h_advance_unscaled(font.glyph_id(c)) as f64;
            text.chars().map(of).sum::<f64>() / font.units_per_em().unwrap_or(1000.0) as f64
        }
        None => 0.6 * text.chars().count() as f64,
    };
    units * size * 1.06
}

/// Width of a text with an exponent.
pub fn power_width(text: &str, exponent: Option<i32>) -> f64 {
    text_width(text, SMALL) + exponent.map_or(0.0, |e| text_width(&e.to_string(), SMALL * EXPONENT))
}

/// Breaks a text between words into lines of at most a width; a longer word has a line for itself.
pub fn wrap(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), size) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

/// Text for XML and HTML; what they cannot hold becomes a space.
pub fn escape(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push('\n'),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Colour of the n-th technique.
pub fn color(place: usize) -> String {
    let [r, g, b] = super::COLORS[place % super::COLORS.len()];
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The same colour, dark enough to be read as text on white: a contrast of 4.5 to 1 (WCAG 2, relative luminance).
pub fn ink(place: usize) -> String {
    let mut rgb = super::COLORS[place % super::COLORS.len()].map(|c| c as f64);
    let linear = |c: f64| if c <= 10.0 { c / 255.0 / 12.92 } else { ((c / 255.0 + 0.055) / 1.055).powf(2.4) };
    while 0.2126 * linear(rgb[0]) + 0.7152 * linear(rgb[1]) + 0.0722 * linear(rgb[2]) > 1.05 / 4.5 - 0.05 {
        rgb = rgb.map(|c| c * 0.95);
    }
    let [r, g, b] = rgb.map(|c| c as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Dashes of the n-th line of one technique.
pub fn dash(nth: usize) -> &'static str {
    ["", "4 1.6", "1.4 1.4", "5 1.4 1.4 1.4", "7 2"][nth % 5]
}

/// Marker of the n-th technique. There are eight and seven colours, so that 56 techniques differ in one of the two.
fn shape(place: usize) -> String {
    let polygon = |corners: usize, turn: f64, radius: f64| {
        let corner = |i: usize| {
            let angle = (turn + i as f64 / corners as f64) * std::f64::consts::TAU;
            format!("{:.2} {:.2}", radius * angle.sin(), -radius * angle.cos())
        };
        format!("M{}Z", (0..corners).map(corner).collect::<Vec<_>>().join("L"))
    };
    let r = MARKER;
    // Arms of a cross, half their width against their length.
    let (a, b) = (0.36 * r, 1.15 * r);
    match place % 8 {
        0 => format!("M{r} 0A{r} {r} 0 1 1 -{r} 0A{r} {r} 0 1 1 {r} 0Z"),
        1 => polygon(4, 0.125, r * 1.25),
        2 => polygon(3, 0.0, r * 1.35),
        3 => polygon(4, 0.0, r * 1.3),
        4 => polygon(3, 0.5, r * 1.35),
        5 => format!(
            "M-{a:.2} -{b:.2}H{a:.2}V-{a:.2}H{b:.2}V{a:.2}H{a:.2}V{b:.2}H-{a:.2}V{a:.2}H-{b:.2}V-{a:.2}H-{a:.2}Z"
        ),
        6 => polygon(5, 0.0, r * 1.2),
        _ => polygon(6, 0.0, r * 1.15),
    }
}
