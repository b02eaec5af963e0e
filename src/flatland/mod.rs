//! Flatland: shadow maps in a world of two dimensions, whose images have one (Chong 2003). What is left to choose there is
//! the angle of the light's film line alone, so that techniques can be compared with the best.
//!
//! Angles are radians counter-clockwise from +x; a film line is named by the direction of its normal.

pub mod file;
pub mod scenes;
pub mod split;
pub mod table;

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, PI};

/// A world with a camera and a spot light.
#[derive(Clone, Debug, PartialEq)]
pub struct Flatland {
    pub eye: DVec2,
    /// Direction of the view, radians.
    pub gaze: f64,
    /// Field of view, radians.
    pub fov: f64,
    pub light: DVec2,
    pub segments: Vec<[DVec2; 2]>,
    /// Pixels of the camera's image.
    pub pixels: usize,
    /// Texels of the light's.
    pub lexels: usize,
}

/// What a pixel sees.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub point: DVec2,
    /// The segment it lies on, by its place in [`Flatland::segments`].
    pub segment: usize,
    /// Its direction from the light, radians.
    pub angle: f64,
    /// Pixels a radian of that direction.
    pub density: f64,
}

/// What makes one film better than another, over all pixels that see something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// The mean of pixels a texel.
    L1,
    /// The mean of their squares.
    L2,
    /// The most pixels a texel.
    Max,
}

impl Metric {
    pub const ALL: [Metric; 3] = [Metric::L1, Metric::L2, Metric::Max];

    /// As tables and files name it.
    pub fn name(self) -> &'static str {
        match self {
            Metric::L1 => "L1",
            Metric::L2 => "L2",
            Metric::Max => "L∞",
        }
    }
}

/// The film lines that the light may have.
///
/// With the middle m of the directions, T the tangent of half their span and l = tan(θ - m)/T a pixel's place on the film
/// at right angles to m, from -1 to 1, the film whose normal is m + atan(tanh(s)/T) gives it g (cosh s + l sinh s)² pixels a
/// texel, where g is what that first film gives: the square of a sum of exponentials in s with coefficients that are not
/// negative. So every metric is convex in s and has one minimum, and all s stand for valid films.
#[derive(Clone, Debug)]
pub struct Film {
    pub samples: Vec<Sample>,
    /// Directions from the light between which all lies that the camera sees, radians.
    pub bottom: f64,
    pub top: f64,
    lexels: f64,
    /// Of each sample g and l.
    terms: Vec<[f64; 2]>,
}

/// The best film by one metric, and how it was found.
#[derive(Clone, Copy, Debug)]
pub struct Least {
    /// Direction of its normal, radians.
    pub normal: f64,
    /// Steps of Newton's method; 0 where a closed form serves.
    pub steps: usize,
}

/// Pixels a texel over an image: the largest, the mean, and the mean with a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Badness {
    pub worst: f64,
    pub mean: f64,
    pub mean_sigma: f64,
}

impl Badness {
    /// Of pixels a texel at each pixel.
    pub fn of(each: impl Iterator<Item = f64>) -> Badness {
        let (n, worst, sum, squares) =
            each.fold((0.0, 0f64, 0.0, 0.0), |(n, w, s, q), b| (n + 1.0, w.max(b), s + b, q + b * b));
        let mean = sum / n;
        Badness { worst, mean, mean_sigma: mean + (squares / n - mean * mean).max(0.0).sqrt() }
    }
}

/// The film lines that a perspective shadow map comes to, as directions of their normals.
#[derive(Clone, Copy, Debug)]
pub struct Perspective {
    /// The near line of the light's frustum in post-perspective space, taken back to the world (Chong 2003, 2.2.3).
    pub near_line: f64,
    /// The line whose texels lie as those of that frustum do. The two differ, since a perspective does not keep even
    /// spacing: this one is parallel to the line from the light to where the near line meets the one through the eye across
    /// the view, wherever the near line is put.
    pub texels: f64,
    /// The near line in the world: a point of it, and where it meets the line through the eye across the view.
    pub line: [DVec2; 2],
}

/// The camera's post-perspective space: the view's triangle becomes the square from -1 to 1, x across the view, y its depth.
#[derive(Clone, Copy, Debug)]
pub struct PostPerspective {
    eye: DVec2,
    forward: DVec2,
    tangent: f64,
    a: f64,
    b: f64,
}

impl PostPerspective {
    pub fn project(&self, p: DVec2) -> DVec2 {
        let z = (p - self.eye).dot(self.forward);
        DVec2::new((p - self.eye).dot(self.forward.perp()) / (z * self.tangent), self.a - self.b / z)
    }

    /// The point of the world that comes to lie there.
    pub fn unproject(&self, q: DVec2) -> DVec2 {
        let z = self.b / (self.a - q.y);
        self.eye + self.forward * z + self.forward.perp() * (q.x * z * self.tangent)
    }
}

impl Flatland {
    pub fn forward(&self) -> DVec2 {
        DVec2::from_angle(self.gaze)
    }

    /// The ray through a place of the image, 0 to [`Flatland::pixels`], one unit deep.
    pub fn ray(&self, p: f64) -> DVec2 {
        let slope = 2.0 * (self.fov / 2.0).tan() / self.pixels as f64;
        self.forward() + self.forward().perp() * (slope * (p - self.pixels as f64 / 2.0))
    }

    /// The place of the image at which a point is seen that lies before the eye.
    pub fn place(&self, point: DVec2) -> f64 {
        let (from, slope) = (point - self.eye, 2.0 * (self.fov / 2.0).tan() / self.pixels as f64);
        self.pixels as f64 / 2.0 + from.dot(self.forward().perp()) / from.dot(self.forward()) / slope
    }

    /// How far a ray goes, in its own lengths, and the segment that it meets first.
    pub fn first(&self, origin: DVec2, ray: DVec2) -> Option<(f64, usize)> {
        let hit = |(i, [a, b]): (usize, &[DVec2; 2])| {
            let across = ray.perp_dot(*b - *a);
            let depth = (*a - origin).perp_dot(*b - *a) / across;
            let place = (*a - origin).perp_dot(ray) / across;
            (depth > 1e-9 && (0.0..=1.0).contains(&place)).then_some((depth, i))
        };
        self.segments.iter().enumerate().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// What the camera sees at a place of its image, 0 to [`Flatland::pixels`]; None: nothing.
    pub fn sample(&self, p: f64) -> Option<Sample> {
        let ray = self.ray(p);
        let (depth, segment) = self.first(self.eye, ray)?;
        let [a, b] = self.segments[segment];
        let point = self.eye + ray * depth;
        // How the point moves from pixel to pixel.
        let moves = self.ray(p + 1.0) - ray;
        let step = moves * depth - ray * (depth * moves.perp_dot(b - a) / ray.perp_dot(b - a));
        let from = point - self.light;
        let turn = from.perp_dot(step) / from.length_squared();
        let sample = Sample { point, segment, angle: from.to_angle(), density: 1.0 / turn.abs() };
        // Where the segment lies along the light's ray a pixel takes no room on the film.
        sample.density.is_finite().then_some(sample)
    }

    /// The film lines for what the camera sees; None if it sees nothing, or all of it does not lie before the light.
    pub fn film(&self) -> Option<Film> {
        self.film_of(self.pixels, None)
    }

    /// The same as seen by an image of `count` pixels that covers the same view, so that `density` counts pixels of the whole
    /// one. `hull`: directions between which the film reaches, if not those of the samples.
    pub fn film_of(&self, count: usize, hull: Option<[f64; 2]>) -> Option<Film> {
        let place = |i: usize| (i as f64 + 0.5) * self.pixels as f64 / count as f64;
        let mut samples: Vec<Sample> = (0..count).filter_map(|i| self.sample(place(i))).collect();
        // The light's directions turn around the middle one, so that none is torn apart at ±180°.
        let middle = match hull {
            Some([bottom, top]) => (bottom + top) / 2.0,
            None => samples.iter().map(|s| DVec2::from_angle(s.angle)).sum::<DVec2>().to_angle(),
        };
        let around = |a: f64| middle + (a - middle + PI).rem_euclid(2.0 * PI) - PI;
        samples.iter_mut().for_each(|s| s.angle = around(s.angle));
        let angles = samples.iter().map(|s| s.angle);
        let own = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
        let (bottom, top) = hull.map_or(own, |[bottom, top]| (bottom, top));
        (!samples.is_empty() && top - bottom < PI && top - bottom > NARROWEST)
            .then(|| Film::new(samples, [bottom, top], self.lexels as f64))
    }

    /// The camera's post-perspective space, as deep as what it sees.
    pub fn post_perspective(&self, film: &Film) -> PostPerspective {
        let (eye, forward) = (self.eye, self.forward());
        let near = 1.0;
        let far = film.samples.iter().map(|s| (s.point - eye).dot(forward)).fold(2.0 * near, f64::max);
        let (a, b) = ((far + near) / (far - near), 2.0 * far * near / (far - near));
        PostPerspective { eye, forward, tangent: (self.fov / 2.0).tan(), a, b }
    }

    /// The film lines of a perspective shadow map. `push`: where the frustum's near line stands in post-perspective space, from
    /// 0 at the light to 1 at what the light meets first, where the method wants it.
    pub fn perspective(&self, film: &Film, push: f64) -> Option<Perspective> {
        let space = self.post_perspective(film);
        let (off, near) = (self.light - self.eye, 1e-9 * (self.light - self.eye).length());
        // In the view's plane itself its image lies at infinity: just before it, it is as good as there.
        let nudge = if off.dot(space.forward).abs() < near { near } else { 0.0 };
        let light = space.project(self.light + space.forward * nudge);
        let from = |p: DVec2| space.project(p) - light;
        // The frustum around the middle of the hull's directions.
        let towards = film.samples.iter().map(|s| from(s.point).normalize()).sum::<DVec2>().to_angle();
        let angles = film.samples.iter().map(|s| DVec2::from_angle(towards).angle_to(from(s.point)));
        let (low, high) = angles.fold((0.0, 0.0), |(low, high): (f64, f64), a| (low.min(a), high.max(a)));
        let axis = DVec2::from_angle(towards + (low + high) / 2.0);
        let along = axis.perp();
        // Where the near line's direction, a point at infinity there, lies in the world.
        let vanishing = self.eye - space.forward.perp() * (space.tangent * space.b * along.x / along.y);
        // A spot light behind the camera is a sink there: light comes from the far side.
        let turned = if nudge > 0.0 { 1.0 } else { off.dot(space.forward).signum() };
        let order = |p: DVec2| from(p).dot(axis) * turned;
        let first = film.samples.iter().min_by(|p, q| order(p.point).total_cmp(&order(q.point)))?;
        let point = match push {
            1.0 => first.point,
            _ => space.unproject(light + axis * (turned * push * order(first.point))),
        };
        let [near_line, texels] = [point, self.light].map(|p| film.facing((vanishing - p).perp().to_angle()));
        (near_line.is_finite() && texels.is_finite()).then_some(Perspective {
            near_line,
            texels,
            line: [point, vanishing],
        })
    }
}

impl Film {
    fn new(samples: Vec<Sample>, [bottom, top]: [f64; 2], lexels: f64) -> Film {
        let (middle, half) = ((bottom + top) / 2.0, ((top - bottom) / 2.0).tan());
        let term = |s: &Sample| {
            let turn = s.angle - middle;
            [s.density * turn.cos().powi(2) * 2.0 * half / lexels, (turn.tan() / half).clamp(-1.0, 1.0)]
        };
        let terms = samples.iter().map(term).collect();
        Film { samples, bottom, top, lexels, terms }
    }

    /// The part of the film between two directions, radians; None if no pixel lies there.
    pub fn part(&self, hull: [f64; 2]) -> Option<Film> {
        // A pixel on the border of two parts belongs to the upper one.
        let [low, high] = hull;
        let inside = self.samples.iter().filter(|s| low <= s.angle && (s.angle < high || high >= self.top));
        let samples: Vec<Sample> = inside.copied().collect();
        (!samples.is_empty()).then(|| Film::new(samples, hull, self.lexels))
    }

    /// The direction of a line's normal, turned towards what the camera sees.
    fn facing(&self, normal: f64) -> f64 {
        let middle = (self.bottom + self.top) / 2.0;
        middle + (normal - middle + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2
    }

    /// Between these directions of its normal the film line crosses all rays of the light.
    pub fn valid(&self) -> [f64; 2] {
        [self.top - FRAC_PI_2, self.bottom + FRAC_PI_2]
    }

    pub fn is_valid(&self, normal: f64) -> bool {
        let [low, high] = self.valid();
        low < normal && normal < high
    }

    /// Normal along the middle of what the camera sees: the common shadow map.
    pub fn half_angle(&self) -> f64 {
        (self.bottom + self.top) / 2.0
    }

    /// The film that makes pixels a texel the same all over one segment (Chong 2003, theorem 1): parallel to the line from the
    /// light to where the segment's line meets the one through the eye across the view. `world`: which the film is of.
    pub fn of_plane(&self, world: &Flatland, segment: usize) -> f64 {
        let ([a, b], side) = (world.segments[segment], world.forward().perp());
        let along = b - a;
        // Where both are parallel they meet at infinity, in their own direction.
        let meets = (a - world.eye).perp_dot(along) / side.perp_dot(along);
        let line = if meets.is_finite() { world.eye + side * meets - world.light } else { side };
        self.facing(line.perp().to_angle())
    }

    /// Direction from the light to a place on the film, 0 to 1 from bottom to top, where its normal has that direction.
    pub fn direction(&self, normal: f64, place: f64) -> f64 {
        let [low, high] = [self.bottom, self.top].map(|a| (a - normal).tan());
        normal + (low + (high - low) * place).atan()
    }

    /// Pixels a texel at each pixel, where the film's normal has this direction.
    pub fn footprints(&self, normal: f64) -> impl Iterator<Item = f64> + '_ {
        let width = (self.top - normal).tan() - (self.bottom - normal).tan();
        self.samples.iter().map(move |s| s.density * width * (s.angle - normal).cos().powi(2) / self.lexels)
    }

    /// Pixels a texel where the film's normal has this direction.
    pub fn badness(&self, normal: f64) -> Badness {
        Badness::of(self.footprints(normal))
    }

    /// What the metric says of a film.
    pub fn error(&self, metric: Metric, normal: f64) -> f64 {
        let n = self.samples.len() as f64;
        match metric {
            Metric::L1 => self.footprints(normal).sum::<f64>() / n,
            Metric::L2 => self.footprints(normal).map(|b| b * b).sum::<f64>() / n,
            Metric::Max => self.footprints(normal).fold(0.0, f64::max),
        }
    }

    /// The normal of the film that s stands for.
    pub fn normal(&self, s: f64) -> f64 {
        self.half_angle() + (s.tanh() / ((self.top - self.bottom) / 2.0).tan()).atan()
    }

    /// The s that stands for the film with this normal.
    pub fn stretched(&self, normal: f64) -> f64 {
        ((normal - self.half_angle()).tan() * ((self.top - self.bottom) / 2.0).tan()).atanh()
    }

    /// The film with the least error.
    pub fn least(&self, metric: Metric) -> Least {
        let (s, steps) = self.least_turn(metric);
        Least { normal: self.normal(s), steps }
    }

    /// The s that stands for it, and the steps.
    fn least_turn(&self, metric: Metric) -> (f64, usize) {
        match metric {
            Metric::L1 => (self.least_mean(), 0),
            Metric::L2 => self.least_square(),
            Metric::Max => (self.least_worst(), 0),
        }
    }

    /// Pixels a texel on the film that s stands for: where that leans to the last valid angles, better than by the angle itself.
    fn turned(&self, s: f64) -> impl Iterator<Item = f64> + '_ {
        let (sin, cos) = (s.sinh(), s.cosh());
        self.terms.iter().map(move |[g, l]| g * (cos + l * sin).powi(2))
    }

    /// The least mean, in closed form: A e^2s + B + C e^-2s is least where e^4s = C/A.
    fn least_mean(&self) -> f64 {
        let sum = |side: f64| self.terms.iter().map(|[g, l]| g * (1.0 + side * l).powi(2)).sum::<f64>();
        ((sum(-1.0) / sum(1.0)).ln() / 4.0).clamp(-FARTHEST, FARTHEST)
    }

    /// The least mean square, by Newton's method on the logarithm of a sum of five exponentials, which is convex. Also the steps.
    fn least_square(&self) -> (f64, usize) {
        // Of e^(2k - 4)s.
        let mut of = [0.0; 5];
        for [g, l] in &self.terms {
            let (up, down) = ((1.0 + l) / 2.0, (1.0 - l) / 2.0);
            for (k, (sum, times)) in of.iter_mut().zip([1.0, 4.0, 6.0, 4.0, 1.0]).enumerate() {
                *sum += g * g * times * up.powi(k as i32) * down.powi(4 - k as i32);
            }
        }
        // Slope and curvature are mean and variance of the exponents.
        let slope = |s: f64| {
            let weights: [f64; 5] = std::array::from_fn(|k| of[k] * (s * (2.0 * k as f64 - 4.0)).exp());
            let sum: f64 = weights.iter().sum();
            let moment = |power: i32| {
                weights.iter().enumerate().map(|(k, w)| w * (2.0 * k as f64 - 4.0).powi(power)).sum::<f64>() / sum
            };
            (moment(1), moment(2) - moment(1).powi(2))
        };
        let (mut s, mut steps) = (self.least_mean(), 0);
        let (mut low, mut high) = (-FARTHEST, FARTHEST);
        while steps < 50 {
            let (first, second) = slope(s);
            // The minimum lies downhill; a step that leaves what is left is replaced by half of it.
            if first > 0.0 {
                high = s
            } else {
                low = s
            }
            let next = s - first / second;
            let next = if next > low && next < high { next } else { (low + high) / 2.0 };
            let moved = (next - s).abs();
            s = next;
            steps += 1;
            if moved < 1e-7 {
                break;
            }
        }
        (s, steps)
    }

    /// The least of the largest: the upper envelope of convex curves is convex, so that thirds close in on it.
    fn least_worst(&self) -> f64 {
        let worst = |s: f64| self.turned(s).fold(0.0, f64::max);
        let (mut low, mut high) = (-FARTHEST, FARTHEST);
        for _ in 0..120 {
            let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if worst(left) < worst(right) { high = right } else { low = left }
        }
        (low + high) / 2.0
    }

    /// Newton's method as Chong 2003 runs it, in the angle itself and on the derivative of the L2 error, from the common shadow
    /// map's: the normal, the steps of the last try until the angle moves by less than 0.01°, and how many tries ended outside
    /// the valid angles. None after 100 tries.
    pub fn least_square_by_angle(&self) -> Option<(Least, usize)> {
        let slopes = |x: f64| {
            // (N / D²)' = 0 where N' D = 2 N D'.
            let (mut n, mut n1, mut n2) = (0.0, 0.0, 0.0);
            for s in &self.samples {
                let ((sin, cos), w) = ((s.angle - x).sin_cos(), s.density * s.density);
                n += w * cos.powi(4);
                n1 += w * 4.0 * cos.powi(3) * sin;
                n2 += w * (12.0 * cos * cos * sin * sin - 4.0 * cos.powi(4));
            }
            let (d, turn) = ((self.top - x).cos() * (self.bottom - x).cos(), self.top + self.bottom - 2.0 * x);
            let (d1, d2) = (turn.sin(), -2.0 * turn.cos());
            let first = (n1 * d - 2.0 * n * d1) / d.powi(3);
            let second = (n2 * d - n1 * d1 - 2.0 * n * d2) / d.powi(3) - 3.0 * first * d1 / d;
            (first, second)
        };
        for tried in 0..100 {
            // Offsets that spread evenly, in place of his random ones.
            let mut x =
                self.half_angle() + PI * ((tried as f64 * 0.618_033_988_75).fract() - 0.5) * (tried > 0) as u8 as f64;
            for steps in 1..=50 {
                let (first, second) = slopes(x);
                let moved = first / second;
                x -= moved;
                if !x.is_finite() || moved.abs() > 1e3 {
                    break;
                }
                if moved.abs().to_degrees() < 0.01 {
                    let normal = self.facing(x);
                    // A saddle or a maximum is none of his solutions either.
                    if self.is_valid(normal) && slopes(normal).1 > 0.0 {
                        return Some((Least { normal, steps }, tried));
                    }
                    break;
                }
            }
        }
        None
    }
}

/// Span of directions, radians, below which rounding decides.
const NARROWEST: f64 = 1e-9;

/// |s| beyond which no film is looked for: its angle is then as near to the last valid one as f64 tells apart from it.
const FARTHEST: f64 = 15.0;
