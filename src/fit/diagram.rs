//! Line drawings of a warp: the light's image before it on the left, the map after it on the right.

use super::{hull, warped};
use crate::frame::Frame;
use crate::gpu::{Gpu, Pass};
use crate::view::View;
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec2};

/// A stroke, as `Stroke` in `shaders/diagram.wgsl`. Each half of the drawing is a square of side 1.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Stroke {
    pub from: [f32; 2],
    pub to: [f32; 2],
    /// Place on the colour ramp.
    pub value: f32,
    pub padding: f32,
}

/// The colours of the parts, as places on the ramp.
pub const GRID: f32 = 0.28;
pub const HULL: f32 = 0.6;
pub const MARK: f32 = 0.8;
pub const BORDER: f32 = 1.0;

/// The view that shows it.
pub const fn view(doc: &'static str) -> View {
    View { id: "warp", title: "Warp diagram", doc, truth: false }
}

/// A drawing in the making.
pub struct Diagram {
    strokes: Vec<Stroke>,
    h: DMat3,
    /// Shown of the light's image, and of the plane after the warp: middle and side.
    before: (DVec2, f64),
    after: (DVec2, DVec2),
}

/// Most strokes of a drawing.
const MOST: usize = 256;

impl Diagram {
    /// Draws the hull of the points that the map covers, the map's border and its grid, before and after the warp `h`.
    /// `also`: more points that the left half shall hold.
    pub fn new(h: &DMat3, points: &[DVec2], also: &[DVec2]) -> Diagram {
        let frame = |[low, high]: [DVec2; 2]| ((low + high) / 2.0, 1.15 * (high - low).max_element().max(1e-9));
        let covered = hull::extent(points.iter().map(|p| warped(h, *p).0));
        let after = ((covered[0] + covered[1]) / 2.0, 1.15 * (covered[1] - covered[0]));
        let inverse = h.inverse();
        let corner = |x: f64, y: f64| covered[0] + (covered[1] - covered[0]) * DVec2::new(x, y);
        let back = |x: f64, y: f64| warped(&inverse, corner(x, y)).0;
        let border = [back(0.0, 0.0), back(1.0, 0.0), back(1.0, 1.0), back(0.0, 1.0)];
        let shown = points.iter().chain(also).chain(&border).copied();
        let mut out = Diagram { strokes: Vec::new(), h: *h, before: frame(hull::extent(shown)), after };
        for i in 1..16 {
            let t = i as f64 / 16.0;
            out.place(0, back(t, 0.0), back(t, 1.0), GRID);
            out.place(0, back(0.0, t), back(1.0, t), GRID);
        }
        let around = hull::hull(points);
        for (i, p) in around.iter().enumerate() {
            out.line(*p, around[(i + 1) % around.len()], HULL);
        }
        for i in 0..4 {
            out.line(border[i], border[(i + 1) % 4], BORDER);
        }
        out
    }

    /// An empty drawing of two planes, both shown around `middle` up to half a `side` away.
    pub fn blank(middle: DVec2, side: f64) -> Diagram {
        Diagram { strokes: Vec::new(), h: DMat3::IDENTITY, before: (middle, side), after: (middle, DVec2::splat(side)) }
    }

    /// A line in the left (0) or right (1) plane.
    pub fn place(&mut self, half: usize, a: DVec2, b: DVec2, value: f32) {
        let (middle, side) = if half == 0 { (self.before.0, DVec2::splat(self.before.1)) } else { self.after };
        let at = |p: DVec2| DVec2::new(0.5 + half as f64, 0.5) + (p - middle) / side * DVec2::new(1.0, -1.0);
        self.stroke(at(a), at(b), value);
    }

    fn stroke(&mut self, a: DVec2, b: DVec2, value: f32) {
        if self.strokes.len() < MOST && a.is_finite() && b.is_finite() {
            self.strokes.push(Stroke { from: a.as_vec2().into(), to: b.as_vec2().into(), value, padding: 0.0 });
        }
    }

    /// A line in the light's image, and what the warp makes of it where both ends have a place.
    pub fn line(&mut self, a: DVec2, b: DVec2, value: f32) {
        self.place(0, a, b, value);
        let ((p, u), (q, v)) = (warped(&self.h, a), warped(&self.h, b));
        if u > 0.0 && v > 0.0 {
            self.place(1, p, q, value);
        }
    }

    /// A cross in the light's image.
    pub fn cross(&mut self, at: DVec2, value: f32) {
        let arm = 0.015 * self.before.1;
        for d in [DVec2::new(arm, arm), DVec2::new(arm, -arm)] {
            self.place(0, at - d, at + d, value);
        }
    }

    /// A number in the upper left corner, in the digits of a pocket calculator; `row` counts from the top.
    pub fn number(&mut self, row: usize, value: f64) {
        // Segments from the top, clockwise, the middle last; a small o twice for infinity.
        const DIGITS: [u8; 10] = [0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f];
        const ENDS: [[f64; 4]; 7] = [
            [0.0, 0.0, 1.0, 0.0],
            [1.0, 0.0, 1.0, 1.0],
            [1.0, 1.0, 1.0, 2.0],
            [0.0, 2.0, 1.0, 2.0],
            [0.0, 1.0, 0.0, 2.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 1.0, 1.0],
        ];
        let text = if value.is_finite() { format!("{value:.2}") } else { "oo".into() };
        let size = 0.016;
        let mut at = DVec2::new(0.03, 0.03 + 0.055 * row as f64);
        for c in text.chars() {
            if c == '.' {
                let dot = at + DVec2::new(0.0, 2.0) * size;
                self.stroke(dot, dot + DVec2::new(0.3 * size, 0.0), BORDER);
                at.x += 0.8 * size;
                continue;
            }
            let bits = c.to_digit(10).map_or(if c == '-' { 0x40 } else { 0x5c }, |d| DIGITS[d as usize]);
            for (_, [ax, ay, bx, by]) in ENDS.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1) {
                self.stroke(at + DVec2::new(*ax, *ay) * size, at + DVec2::new(*bx, *by) * size, BORDER);
            }
            at.x += 1.7 * size;
        }
    }
}

/// The pass that draws it.
pub struct Drawing {
    pass: Pass,
    strokes: wgpu::Buffer,
}

impl Drawing {
    pub fn new(gpu: &Gpu) -> Result<Drawing> {
        Ok(Drawing {
            pass: Pass::compute(gpu, "warp diagram", "diagram.wgsl", "draw_diagram", &[])?,
            strokes: gpu.buffer("strokes", &vec![0; MOST * size_of::<Stroke>()], wgpu::BufferUsages::STORAGE),
        })
    }

    /// Draws into the technique's map where the map `id` is asked for.
    pub fn show(&self, f: &mut Frame, id: &str, make: impl FnOnce() -> Option<Diagram>) {
        if f.setup.view != id {
            return;
        }
        let mut strokes = make().map(|d| d.strokes).unwrap_or_default();
        strokes.resize(MOST, Stroke::zeroed());
        f.gpu.queue.write_buffer(&self.strokes, 0, bytemuck::cast_slice(&strokes));
        f.run(&self.pass).bind("strokes", &self.strokes).per_pixel();
        f.show_ramp(id, [0.0, 1.0]);
    }
}
