//! Line drawings of a warp: the light's image before it on the left, the map after it on the right.

use super::lispsm::Lispsm;
use super::{hull, warped};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::palette::RAMP;
use crate::view::{self, Class, Drawn, Legend, View};
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

const fn class(place: f32, what: &'static str) -> Class {
    Class::new(RAMP.at(place), what)
}

/// What the colours stand for.
const CLASSES: &[Class] = &[
    class(BORDER, "border of the map, figures"),
    class(HULL, "what the camera sees"),
    class(MARK, "centre and direction of the warp"),
    class(GRID, "sixteenths of the map"),
];
/// The same in post-perspective space.
pub const SPACE_CLASSES: &[Class] =
    &[class(GRID, "the camera's frustum"), class(HULL, "what the camera sees"), class(MARK, "the light and its rays")];

/// The view that shows it.
pub const fn view(doc: &'static str) -> View {
    view::map("warp", "Warp diagram", doc, Drawn::Diagram(Legend::Squares(["light's image", "map"], CLASSES)))
}

/// A drawing in the making.
pub struct Diagram {
    strokes: Vec<Stroke>,
    h: DMat3,
    /// Shown of the light's image, and of the plane after the warp: middle and side.
    before: (DVec2, f64),
    after: (DVec2, DVec2),
    /// After `h`, a logarithm along y.
    logarithm: Option<Logarithm>,
}

/// ln(s/n) / ln(f/n) along y after a perspective, as shares of the map; from the far end on, as there places crowd.
#[derive(Clone, Copy)]
struct Logarithm {
    /// f/n - 1.
    k: f64,
    /// The map's extent along y.
    low: f64,
    high: f64,
}

impl Logarithm {
    fn after(&self, y: f64) -> f64 {
        let share = (self.high - y) / (self.high - self.low);
        self.high - (self.high - self.low) * (self.k * share).ln_1p() / self.k.ln_1p()
    }

    fn before(&self, y: f64) -> f64 {
        let share = (self.high - y) / (self.high - self.low);
        self.high - (self.high - self.low) * (share * self.k.ln_1p()).exp_m1() / self.k
    }
}

/// Most strokes of a drawing.
const MOST: usize = 256;

impl Diagram {
    /// Draws the hull of the points that the map covers, the map's border and its grid, before and after the warp `h`.
    /// `also`: more points that the left half shall hold.
    pub fn new(h: &DMat3, points: &[DVec2], also: &[DVec2]) -> Diagram {
        Diagram::covering(h, points, also, false)
    }

    /// The perspective of a light space perspective map over `points`, with n and γ; `logarithm`: under a logarithm.
    pub fn of_perspective(l: &Lispsm, points: &[DVec2], logarithm: bool) -> Diagram {
        // On the middle line, at the near face and n before it.
        let face = l.middle + l.direction * (l.near - l.middle.dot(l.direction));
        let center = if l.n.is_finite() { face - l.direction * l.n } else { face };
        let far = face + l.direction * (l.far - l.near);
        let shown = if (face - center).length() < 3.0 * (far - face).length() { center } else { face };
        let mut d = Diagram::covering(&l.warp, points, &[shown, face], logarithm);
        d.line(face, far, MARK);
        d.place(0, shown, face, MARK);
        d.cross(shown, MARK);
        d.number(0, l.n);
        d.number(1, l.gamma.to_degrees());
        d
    }

    fn covering(h: &DMat3, points: &[DVec2], also: &[DVec2], bent: bool) -> Diagram {
        let frame = |[low, high]: [DVec2; 2]| ((low + high) / 2.0, 1.15 * (high - low).max_element().max(1e-9));
        let covered = hull::extent(points.iter().map(|p| warped(h, *p).0));
        let after = ((covered[0] + covered[1]) / 2.0, 1.15 * (covered[1] - covered[0]));
        let inverse = h.inverse();
        let corner = |x: f64, y: f64| covered[0] + (covered[1] - covered[0]) * DVec2::new(x, y);
        // w is proportional to the distance from the perspective's centre.
        let [least, most] = hull::extent(points.iter().map(|p| DVec2::splat(warped(h, *p).1))).map(|w| w.x);
        let logarithm = Logarithm { k: most / least - 1.0, low: covered[0].y, high: covered[1].y };
        let logarithm = Some(logarithm).filter(|l| bent && l.k > 1e-9 && l.k.is_finite());
        let back = |x: f64, y: f64| {
            let p = corner(x, y);
            warped(&inverse, DVec2::new(p.x, logarithm.map_or(p.y, |l| l.before(p.y)))).0
        };
        let border = [back(0.0, 0.0), back(1.0, 0.0), back(1.0, 1.0), back(0.0, 1.0)];
        let shown = points.iter().chain(also).chain(&border).copied();
        let mut out = Diagram { strokes: Vec::new(), h: *h, before: frame(hull::extent(shown)), after, logarithm };
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
        Diagram {
            strokes: Vec::new(),
            h: DMat3::IDENTITY,
            before: (middle, side),
            after: (middle, DVec2::splat(side)),
            logarithm: None,
        }
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
        let after = |p: DVec2| {
            let (at, w) = warped(&self.h, p);
            (w > 0.0).then(|| DVec2::new(at.x, self.logarithm.map_or(at.y, |l| l.after(at.y))))
        };
        // What is straight before a logarithm is a curve after it: in parts between which w grows evenly many times.
        let (start, end) = (warped(&self.h, a).1, warped(&self.h, b).1);
        let grows = self.logarithm.is_some() && start > 0.0 && end > 0.0 && (end / start).ln().abs() > 1e-6;
        let parts = if grows { 8 } else { 1 };
        let share = |i: i32| match i as f64 / parts as f64 {
            t if grows => ((end / start).powf(t) - 1.0) / (end / start - 1.0),
            t => t,
        };
        let places: Vec<_> = (0..=parts).map(|i| after(a.lerp(b, share(i)))).collect();
        for part in places.windows(2) {
            if let [Some(p), Some(q)] = part {
                self.place(1, *p, *q, value);
            }
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
    strokes: Buffer,
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
        if f.view != id {
            return;
        }
        let mut strokes = make().map(|d| d.strokes).unwrap_or_default();
        strokes.resize(MOST, Stroke::zeroed());
        f.gpu.queue.write_buffer(&self.strokes, 0, bytemuck::cast_slice(&strokes));
        f.run(&self.pass).bind("strokes", &self.strokes).per_pixel();
    }
}
