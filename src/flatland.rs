//! Flatland: shadow maps in a world of two dimensions, whose images have one (Chong 2003). What is left to choose there is
//! the angle of the light's film line alone, so that techniques can be compared with the best.

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, PI};

/// A world with a camera and a spot light.
#[derive(Clone, Debug)]
pub struct Flatland {
    pub eye: DVec2,
    /// Direction of the view, radians counter-clockwise from +x.
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
    /// Its direction from the light, radians as the camera's.
    pub angle: f64,
    /// Pixels a radian of that direction.
    pub density: f64,
}

/// The film lines that the light may have.
#[derive(Clone, Debug)]
pub struct Film {
    samples: Vec<Sample>,
    /// Directions from the light between which all lies that the camera sees, radians.
    pub bottom: f64,
    pub top: f64,
    lexels: f64,
}

/// Pixels a texel over an image: the largest, the mean, and the mean with a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Badness {
    pub worst: f64,
    pub mean: f64,
    pub mean_sigma: f64,
}

impl Flatland {
    fn forward(&self) -> DVec2 {
        DVec2::from_angle(self.gaze)
    }

    /// What the camera sees at a place of its image, 0 to [`Flatland::pixels`]; None: nothing.
    pub fn sample(&self, p: f64) -> Option<Sample> {
        let (forward, side) = (self.forward(), self.forward().perp());
        let slope = 2.0 * (self.fov / 2.0).tan() / self.pixels as f64;
        let ray = forward + side * (slope * (p - self.pixels as f64 / 2.0));
        let hit = |[a, b]: &[DVec2; 2]| {
            let (along, across) = (*b - *a, ray.perp_dot(*b - *a));
            let depth = (*a - self.eye).perp_dot(along) / across;
            let place = (*a - self.eye).perp_dot(ray) / across;
            (depth > 1e-9 && (0.0..=1.0).contains(&place)).then_some((depth, along))
        };
        let (depth, along) = self.segments.iter().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let point = self.eye + ray * depth;
        // How the point moves from pixel to pixel.
        let moves = side * slope;
        let step = moves * depth - ray * (depth * moves.perp_dot(along) / ray.perp_dot(along));
        let from = point - self.light;
        let turn = from.perp_dot(step) / from.length_squared();
        Some(Sample { point, angle: from.to_angle(), density: 1.0 / turn.abs() })
    }

    /// What each pixel sees at its middle.
    fn samples(&self) -> Vec<Sample> {
        (0..self.pixels).filter_map(|i| self.sample(i as f64 + 0.5)).collect()
    }

    /// The film lines for what the camera sees; None if it sees nothing, or all of it does not lie before the light.
    pub fn film(&self) -> Option<Film> {
        let mut samples = self.samples();
        // The light's directions turn around the middle one, so that none is torn apart at ±180°.
        let middle = samples.iter().map(|s| DVec2::from_angle(s.angle)).sum::<DVec2>().to_angle();
        let around = |a: f64| middle + (a - middle + PI).rem_euclid(2.0 * PI) - PI;
        samples.iter_mut().for_each(|s| s.angle = around(s.angle));
        let angles = samples.iter().map(|s| s.angle);
        let (bottom, top) = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
        (top - bottom < PI && bottom < top).then_some(Film { samples, bottom, top, lexels: self.lexels as f64 })
    }

    /// The film lines that a perspective shadow map comes to, as directions of their normals: first as Chong 2003 reads
    /// it, the near line of the light's frustum in post-perspective space, pushed to what the light meets first and taken
    /// back to the world; then the one whose texels lie as those of that frustum do. The two differ, since a perspective
    /// does not keep even spacing: the second is parallel to the line from the light to where the near line meets the one
    /// through the eye across the view.
    pub fn perspective(&self, film: &Film) -> Option<[f64; 2]> {
        let (forward, side, tangent) = (self.forward(), self.forward().perp(), (self.fov / 2.0).tan());
        let depth = |p: DVec2| (p - self.eye).dot(forward);
        let near = 1.0;
        let far = film.samples.iter().map(|s| depth(s.point)).fold(2.0 * near, f64::max);
        let (a, b) = ((far + near) / (far - near), 2.0 * far * near / (far - near));
        // Into the square from -1 to 1: x across the view, y its depth.
        let project = |p: DVec2| {
            let z = depth(p);
            DVec2::new((p - self.eye).dot(side) / (z * tangent), a - b / z)
        };
        let light = project(self.light);
        let from = |p: DVec2| project(p) - light;
        // The frustum around the middle of the hull's directions.
        let towards = film.samples.iter().map(|s| from(s.point).normalize()).sum::<DVec2>().to_angle();
        let angles = film.samples.iter().map(|s| DVec2::from_angle(towards).angle_to(from(s.point)));
        let (low, high) = angles.fold((0.0, 0.0), |(low, high): (f64, f64), a| (low.min(a), high.max(a)));
        let axis = DVec2::from_angle(towards + (low + high) / 2.0);
        let along = axis.perp();
        // Where the near line's direction, a point at infinity there, lies in the world.
        let vanishing = self.eye - side * (tangent * b * along.x / along.y);
        // A spot light behind the camera is a sink there: light comes from the far side.
        let order = |p: DVec2| from(p).dot(axis) * depth(self.light).signum();
        let first = film.samples.iter().min_by(|p, q| order(p.point).total_cmp(&order(q.point)))?;
        Some([first.point, self.light].map(|from| film.facing((vanishing - from).perp().to_angle())))
    }
}

impl Film {
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

    /// Pixels a texel where the film's normal has this direction.
    pub fn badness(&self, normal: f64) -> Badness {
        let width = (self.top - normal).tan() - (self.bottom - normal).tan();
        let each = |s: &Sample| s.density * width * (s.angle - normal).cos().powi(2) / self.lexels;
        let n = self.samples.len() as f64;
        let (worst, sum, squares) =
            self.samples.iter().map(each).fold((0f64, 0.0, 0.0), |(w, s, q), b| (w.max(b), s + b, q + b * b));
        let mean = sum / n;
        Badness { worst, mean, mean_sigma: mean + (squares / n - mean * mean).max(0.0).sqrt() }
    }

    /// The direction of the normal with the least mean badness, in closed form: the mean is
    /// (A + B cos 2x + C sin 2x) / (cos(2x - S) + cos D), which has two critical points.
    pub fn least_mean(&self) -> f64 {
        let sum = |f: fn(f64) -> f64| self.samples.iter().map(|s| s.density * f(2.0 * s.angle)).sum::<f64>();
        let (a, b, c) = (sum(|_| 1.0), sum(f64::cos), sum(f64::sin));
        let ((sin_s, cos_s), cos_d) = ((self.top + self.bottom).sin_cos(), (self.top - self.bottom).cos());
        let (alpha, beta, gamma) = (c * cos_s - b * sin_s, c * cos_d - a * sin_s, a * cos_s - b * cos_d);
        let spread = (-alpha / beta.hypot(gamma)).clamp(-1.0, 1.0).acos();
        let critical = [-spread, spread].map(|d| self.facing((gamma.atan2(beta) + d) / 2.0));
        let valid = critical.into_iter().filter(|x| self.is_valid(*x));
        valid
            .min_by(|x, y| self.badness(*x).mean.total_cmp(&self.badness(*y).mean))
            .unwrap_or_else(|| self.half_angle())
    }
}

/// Chong's four scenes by name. He printed no coordinates: these were found by search, so that the rows of his tables for
/// his own method and the common shadow map come out.
pub fn scenes() -> [(&'static str, Flatland); 4] {
    let scene = |gaze: f64, fov: f64, light: [f64; 2], segments: &[[f64; 4]]| Flatland {
        eye: DVec2::new(0.0, 2.0),
        gaze: gaze.to_radians(),
        fov: fov.to_radians(),
        light: light.into(),
        segments: segments.iter().map(|[a, b, c, d]| [DVec2::new(*a, *b), DVec2::new(*c, *d)]).collect(),
        pixels: 100,
        lexels: 100,
    };
    // A floor without end.
    let endless = 1e6;
    [
        ("single plane", scene(-14.32, 27.64, [0.01, 8.10], &[[-endless, 0.0, endless, 0.0]])),
        (
            "simple geometry",
            scene(-16.49, 34.56, [-0.47, 5.77], &[[-endless, 0.0, 15.75, 0.0], [15.75, 0.0, 15.75, 6.69]]),
        ),
        (
            "light from top",
            scene(-1.148, 42.19, [6.212, 12.687], &[[-endless, 0.0, 6.209, 0.0], [6.209, 0.0, 6.232, 5.913]]),
        ),
        (
            "projection aliasing",
            scene(
                -11.105,
                30.281,
                [11.233, 33.94],
                &[[-endless, 0.0, 15.033, 0.0], [12.299, 0.195, 12.280, 1.779], [15.033, 0.0, 15.145, 2.978]],
            ),
        ),
    ]
}
