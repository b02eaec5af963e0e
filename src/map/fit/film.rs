//! The light's film plane turned so that texels lie where pixels do (Chong 2003, chapter 3, and in three dimensions 4.2.1).
//!
//! A film plane is a homography of the light's image: turned about the light, with a rectangle on it. Which one is best is
//! told by a coarse look at what the camera sees. Lengths in the picture are in picture heights, so that nothing depends on
//! its pixels.

use super::hull::halved;
use super::{LightImage, Scope, hull, warped};
use crate::flatland::Metric;
use crate::flatland::split::total;
use crate::light::Light;
use crate::scene::geometry::Geometry;
use glam::{DMat2, DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// A receiver that the camera sees.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub point: DVec3,
    /// Its place in the light's image.
    pub place: DVec2,
    /// How that place moves in the picture: columns for a step of a picture height to the right, and up.
    pub moves: DMat2,
    /// Half the way to the next samples, to the right and up, picture heights.
    pub half: DVec2,
}

impl Sample {
    /// The corners of its part of the picture, in the light's image.
    fn corners(&self) -> [DVec2; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| self.place + self.moves * DVec2::new(x, y) * self.half)
    }
}

/// What the camera sees of what faces the light and lies within its cone and range, at `side` × `side` places of its picture; at twice or
/// four times as many along each side while fewer than a fourth of them do. Masked materials count as whole.
pub fn samples(scope: &Scope, image: &LightImage, geometry: &Geometry, side: usize) -> Vec<Sample> {
    let mut finer = side;
    loop {
        let found = samples_at(scope, image, geometry, finer);
        if found.is_empty() || found.len() >= side * side / 4 || finer >= 4 * side {
            return found;
        }
        finer *= 2;
    }
}

fn samples_at(scope: &Scope, image: &LightImage, geometry: &Geometry, side: usize) -> Vec<Sample> {
    let (eye, aspect) = (scope.eye(), scope.aspect as f64);
    let at = |i: usize| (2 * i + 1) as f64 / side as f64 - 1.0;
    let [right, up] = [eye.right * eye.tangent.x, eye.up * eye.tangent.y];
    let look = |i: usize| -> Option<Sample> {
        let (from, ray) = eye.ray(DVec2::new(at(i % side), at(i / side)));
        let (t, triangle) = geometry.seen(from, ray, eye.near)?;
        let point = from + ray * t;
        let [a, b, c] = geometry.corners(triangle).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        let normal = normal * -normal.dot(ray).signum();
        if !reached(scope, point, normal) {
            return None;
        }
        // On the triangle's plane.
        let along = |step: DVec3| (step - ray * (normal.dot(step) / normal.dot(ray))) * eye.scale(t);
        let place = image.at(point);
        let [x, y, w] = image.rows;
        let depth = w.dot(point.extend(1.0));
        let seen = |step: DVec3| {
            (DVec2::new(x.truncate().dot(step), y.truncate().dot(step)) - place * w.truncate().dot(step)) / depth
        };
        // A picture height is twice the unit of `at`, a width as many as the aspect says.
        let moves = DMat2::from_cols(seen(along(right)) * 2.0 / aspect, seen(along(up)) * 2.0);
        // Edge-on to the eye or the light there is no footprint.
        let wide = moves.x_axis.length() * moves.y_axis.length();
        let half = DVec2::new(0.5 * aspect, 0.5) / side as f64;
        (moves.determinant().abs() > 1e-9 * wide && wide.is_finite()).then_some(Sample { point, place, moves, half })
    };
    (0..side * side).into_par_iter().filter_map(look).collect()
}

/// Whether the light reaches a point, and the side of the surface that is seen.
fn reached(scope: &Scope, point: DVec3, normal: DVec3) -> bool {
    let to_light = scope.light.position().as_dvec3();
    match scope.light {
        Light::Directional { .. } => normal.dot(to_light) > 0.0,
        Light::Spot { outer_angle, range, .. } => {
            let way = to_light - point;
            let cosine = (outer_angle as f64).to_radians().cos();
            normal.dot(way) > 0.0
                && way.length() < range as f64
                && -way.normalize().dot(scope.light.axis().as_dvec3()) > cosine
        }
        _ => false,
    }
}

/// A film plane: the homography of the light's image, in which the film's rectangle lies along the axes.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    pub warp: DMat3,
    /// The rectangle around the samples.
    pub extent: [DVec2; 2],
    /// The sum of what the metric counts over the samples, if the map has a single texel.
    pub error: f64,
}

/// Film planes for some samples.
pub struct Films<'a> {
    samples: &'a [Sample],
    /// Around the samples' places.
    hull: Vec<DVec2>,
    /// Around all that may be looked up: it stays before every film's horizon.
    outline: &'a [DVec2],
    metric: Metric,
    /// Columns: two directions across the middle one, and that, in the light's frame; None under the sun, whose image no turn of the
    /// film changes.
    frame: Option<DMat3>,
}

/// Where a film stands is told by two numbers: (tanh |s|)/r, in the direction of s, is how far its normal leans from the
/// middle direction, where r is as far as it may lean that way before what may be looked up reaches the film's horizon. So all numbers
/// stand for films, as in [`crate::flatland::Film`].
pub type Lean = DVec2;

/// Cosine of the angle from a film's normal up to which its middle may see, 85°.
const LEVEL: f64 = 0.087;
/// |s| beyond which no film leans: the horizon is then a five-hundredth as far as the middle.
const FARTHEST: f64 = 3.5;

impl<'a> Films<'a> {
    /// None if the samples span no area. `outline`: around all that may be looked up, in the light's image.
    pub fn new(samples: &'a [Sample], outline: &'a [DVec2], metric: Metric, lamp: bool) -> Option<Films<'a>> {
        let hull = around(samples);
        hull::least_rectangle(&hull)?;
        let frame = lamp.then(|| {
            let seen = middle(&hull);
            // In a wide cone all that may be looked up need not lie before the film across the middle of what is seen.
            let before = |p: &DVec2| p.extend(1.0).normalize().dot(seen) > LEVEL;
            let middle = if outline.iter().all(before) { seen } else { middle(outline) };
            let (across, other) = middle.any_orthonormal_pair();
            DMat3::from_cols(across, other, middle)
        });
        Some(Films { samples, hull, outline, metric, frame })
    }

    /// The film at right angles to the middle of what is seen, as a common shadow map has it.
    pub fn half_angle(&self) -> Option<Film> {
        self.film(Lean::ZERO)
    }

    /// The film with the least error: the best of 81 coarse ones, made better by Nelder and Mead's simplex.
    pub fn least(&self) -> Option<Film> {
        if self.frame.is_none() {
            return self.half_angle();
        }
        let error = |lean: Lean| self.film(lean).map_or(f64::INFINITY, |film| film.error);
        let coarse = (0..16).flat_map(|k| {
            let towards = DVec2::from_angle(k as f64 * std::f64::consts::TAU / 16.0);
            [0.3, 0.7, 1.2, 1.8, 2.6].map(|far| towards * far)
        });
        let best = coarse.chain([Lean::ZERO]).map(|lean| (error(lean), lean)).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
        self.film(simplex(best, 0.2, error))
    }

    /// The film that leans so; None where what may be looked up does not lie before it.
    pub fn film(&self, lean: Lean) -> Option<Film> {
        let turn = match self.frame {
            None => DMat3::IDENTITY,
            Some(frame) => self.turned(&frame, lean),
        };
        if self.hull.iter().chain(self.outline).any(|p| warped(&turn, *p).1 <= 0.0) {
            return None;
        }
        let turned: Vec<DVec2> = self.hull.iter().map(|p| warped(&turn, *p).0).collect();
        let along = hull::least_rectangle(&hull::hull(&turned))?;
        let roll = DMat3::from_cols(DVec3::new(along.x, -along.y, 0.0), DVec3::new(along.y, along.x, 0.0), DVec3::Z);
        let warp = roll * turn;
        let extent = hull::extent(self.hull.iter().map(|p| warped(&warp, *p).0));
        let error = error(self.samples, self.metric, &warp, extent[1] - extent[0]);
        error.is_finite().then_some(Film { warp, extent, error })
    }

    /// The homography that turns the film's plane so.
    fn turned(&self, frame: &DMat3, lean: Lean) -> DMat3 {
        let places = self.hull.iter().chain(self.outline).map(|p| {
            let q = frame.transpose() * p.extend(1.0);
            q.truncate() / q.z
        });
        let towards = lean.normalize_or_zero();
        // The farthest place against that direction is the first to reach the horizon.
        let room = places.map(|p| -towards.dot(p)).fold(0.0, f64::max).max(1e-9);
        let lean = towards * (lean.length().min(FARTHEST).tanh() / room);
        let normal = (frame.z_axis + frame.x_axis * lean.x + frame.y_axis * lean.y).normalize();
        let (across, other) = normal.any_orthonormal_pair();
        DMat3::from_cols(across, other, normal).transpose()
    }
}

/// What the metric counts, summed over samples, on a film of one texel: the longest extent of the texel in the picture, or its geometric
/// stretch, the trace of the metric tensor (Sander et al. 2001).
fn error(samples: &[Sample], metric: Metric, warp: &DMat3, size: DVec2) -> f64 {
    let each = |s: &Sample| {
        let (place, w) = warped(warp, s.place);
        let row = DVec2::new(warp.x_axis.z, warp.y_axis.z);
        let bent = |step: DVec2| {
            (DMat2::from_cols(warp.x_axis.truncate(), warp.y_axis.truncate()) * step - place * row.dot(step)) / w
        };
        let moves = DMat2::from_cols(bent(s.moves.x_axis), bent(s.moves.y_axis));
        // Picture heights for the whole side of the film, along either side.
        let texel = moves.inverse() * DMat2::from_diagonal(size);
        let stretch = texel.x_axis.length_squared() + texel.y_axis.length_squared();
        match metric {
            Metric::L2 => stretch,
            _ => {
                let area = texel.determinant();
                ((stretch + (stretch * stretch - 4.0 * area * area).max(0.0).sqrt()) / 2.0).sqrt()
            }
        }
    };
    samples.iter().map(each).sum()
}

/// The hull of what samples stand for. Where the light grazes a surface a part of the picture may reach far: no farther than to the other
/// samples' hull and half as far again.
fn around(samples: &[Sample]) -> Vec<DVec2> {
    let [low, high] = hull::extent(samples.iter().map(|s| s.place));
    let (middle, reach) = ((low + high) / 2.0, 0.75 * (high - low));
    let kept = |p: DVec2| p.clamp(middle - reach, middle + reach);
    hull::hull(&samples.iter().flat_map(|s| s.corners().map(kept)).collect::<Vec<_>>())
}

/// The middle of the smallest cone around directions (x, y, 1), by steps towards the farthest (Bădoiu, Clarkson 2003).
fn middle(hull: &[DVec2]) -> DVec3 {
    let directions: Vec<DVec3> = hull.iter().map(|p| p.extend(1.0).normalize()).collect();
    let mut middle = directions.iter().sum::<DVec3>().normalize();
    for k in 1..200 {
        let farthest = directions.iter().min_by(|a, b| a.dot(middle).total_cmp(&b.dot(middle)));
        middle = (middle + (farthest.copied().unwrap_or(middle) - middle) / (k + 1) as f64).normalize();
    }
    middle
}

/// The least of a function of two variables near a place (Nelder, Mead 1965). `side`: of the first triangle.
fn simplex(from: DVec2, side: f64, f: impl Fn(DVec2) -> f64) -> DVec2 {
    let mut corners = [from, from + DVec2::new(side, 0.0), from + DVec2::new(0.0, side)].map(|p| (f(p), p));
    for _ in 0..60 {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [best, second, worst] = corners;
        if (worst.1 - best.1).length() < 1e-3 {
            break;
        }
        let middle = (best.1 + second.1) / 2.0;
        let at = |t: f64| {
            let p = middle + (middle - worst.1) * t;
            (f(p), p)
        };
        let mirrored = at(1.0);
        corners[2] = if mirrored.0 < best.0 {
            let farther = at(2.0);
            if farther.0 < mirrored.0 { farther } else { mirrored }
        } else if mirrored.0 < second.0 {
            mirrored
        } else {
            let nearer = if mirrored.0 < worst.0 { at(0.5) } else { at(-0.5) };
            if nearer.0 < worst.0 {
                nearer
            } else {
                let drawn = |p: DVec2| best.1 + (p - best.1) / 2.0;
                corners[1] = (f(drawn(second.1)), drawn(second.1));
                (f(drawn(worst.1)), drawn(worst.1))
            }
        };
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    corners[0].1
}

/// A part of the whole film's rectangle, with a film of its own.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its box after [`Parts::whole`]; sides on the rectangle's border reach without end.
    pub cell: [DVec2; 2],
    pub film: Film,
    /// Around all that may be looked up in it, in the light's image.
    pub outline: Vec<DVec2>,
    /// Its share of all texels.
    pub share: f64,
}

/// The light's image in parts.
#[derive(Clone, Debug)]
pub struct Parts {
    /// The homography in whose image the parts are boxes.
    pub whole: DMat3,
    /// The middle of what is seen, in the light's image.
    pub middle: DVec2,
    pub parts: Vec<Part>,
}

/// The film of all samples, quartered at its middle as long as there are fewer than `most` parts: always the one whose quarters
/// lower the error most once all texels are shared out anew (Chong 2003, 3.2, where parts of a line are merged). `best`: films of
/// least error, else those of half the angle. `outline`: around all that may be looked up, in the light's image. None without samples that
/// span an area.
pub fn parts(
    samples: &[Sample],
    outline: &[DVec2],
    metric: Metric,
    lamp: bool,
    best: bool,
    most: usize,
) -> Option<Parts> {
    // A texel's extent goes by the root of its map's texels.
    let power = if metric == Metric::L2 { 1.0 } else { 0.5 };
    let least = |samples: &[Sample], outline: &[DVec2]| {
        let films = Films::new(samples, outline, metric, lamp)?;
        if best { films.least() } else { films.half_angle() }
    };
    let film = least(samples, outline)?;
    let whole = film.warp;
    let back = whole.inverse();
    let [low, high] = film.extent;
    // What lies beyond the samples belongs to the part at whose side it lies.
    let beyond = |x: f64, low: f64, high: f64| {
        if x <= low {
            -FAR
        } else if x >= high {
            FAR
        } else {
            x
        }
    };
    let end = |p: DVec2| DVec2::new(beyond(p.x, low.x, high.x), beyond(p.y, low.y, high.y));
    let within = |cell: [DVec2; 2]| -> Vec<DVec2> {
        let [low, high] = cell.map(end);
        let mut around: Vec<DVec2> = outline.iter().map(|p| warped(&whole, *p).0).collect();
        around = halved(&around, |p| p.x - low.x);
        around = halved(&around, |p| p.y - low.y);
        around = halved(&around, |p| high.x - p.x);
        around = halved(&around, |p| high.y - p.y);
        around.into_iter().map(|p| warped(&back, p).0).collect()
    };
    struct Open {
        cell: [DVec2; 2],
        film: Film,
        outline: Vec<DVec2>,
        samples: Vec<Sample>,
    }
    // Of a cell without a film of its own: all that the whole film shows of it.
    let open = |cell: [DVec2; 2], samples: Vec<Sample>| {
        let outline = within(cell);
        let film = least(&samples, &outline).unwrap_or_else(|| Film {
            warp: whole,
            extent: cell,
            error: error(&samples, metric, &whole, cell[1] - cell[0]),
        });
        Open { cell, film, outline, samples }
    };
    let quarters = |of: &Open| -> Vec<Open> {
        let [low, high] = of.cell;
        let middle = (low + high) / 2.0;
        let cells = [0, 1, 2, 3].map(|k| {
            let side = |bit: usize, axis: usize| match k >> bit & 1 {
                0 => (low[axis], middle[axis]),
                _ => (middle[axis], high[axis]),
            };
            let ((x0, x1), (y0, y1)) = (side(0, 0), side(1, 1));
            [DVec2::new(x0, y0), DVec2::new(x1, y1)]
        });
        let mut all = [const { Vec::new() }; 4];
        for s in &of.samples {
            let at = warped(&whole, s.place).0;
            all[(at.x >= middle.x) as usize + 2 * (at.y >= middle.y) as usize].push(*s);
        }
        cells.into_iter().zip(all).map(|(cell, samples)| open(cell, samples)).collect()
    };
    let mut all = vec![Open { cell: film.extent, film, outline: outline.to_vec(), samples: samples.to_vec() }];
    while all.len() + 3 <= most {
        let split: Vec<Vec<Open>> = all.iter().map(quarters).collect();
        let cost = |i: usize| {
            let rest = all.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, open)| open.film.error);
            total(power, rest.chain(split[i].iter().map(|open| open.film.error)))
        };
        let Some(i) = (0..all.len()).min_by(|a, b| cost(*a).total_cmp(&cost(*b))) else {
            break;
        };
        let four = split.into_iter().nth(i).unwrap_or_default();
        all.splice(i..=i, four);
    }
    let weight = |open: &Open| open.film.error.powf(1.0 / (power + 1.0));
    let sum: f64 = all.iter().map(weight).sum();
    let part = |o: Open| Part { cell: o.cell.map(end), film: o.film, share: weight(&o) / sum, outline: o.outline };
    let parts = all.into_iter().map(part).collect();
    let middle = middle(&around(samples));
    Some(Parts { whole, middle: middle.truncate() / middle.z, parts })
}

/// Beyond all places of a film.
const FAR: f64 = 1e30;

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(place: DVec2, moves: DMat2) -> Sample {
        Sample { point: DVec3::ZERO, place, moves, half: DVec2::splat(0.01) }
    }

    /// A film leans so far that of all that is seen the nearest to its horizon is left 1 - tanh |s| of what the middle has; one that does
    /// not lean stands at right angles to the middle.
    #[test]
    fn films_lean_as_far_as_told() {
        let places = [(-0.4, -0.1), (0.9, 0.2), (0.3, 1.1), (0.1, -0.5), (0.5, 0.3)];
        let samples = places.map(|p| sample(p.into(), DMat2::IDENTITY));
        let films = Films::new(&samples, &[], Metric::L2, true).unwrap();
        let seen = middle(&films.hull);
        for lean in [DVec2::ZERO, DVec2::new(0.8, 0.0), DVec2::new(-0.3, 0.5), DVec2::new(0.0, -1.5)] {
            let film = films.film(lean).unwrap();
            let normal = DVec3::new(film.warp.x_axis.z, film.warp.y_axis.z, film.warp.z_axis.z);
            let near = films.hull.iter().map(|p| p.extend(1.0)).map(|p| normal.dot(p) / p.dot(seen) / normal.dot(seen));
            let (near, told) = (near.fold(f64::INFINITY, f64::min), 1.0 - lean.length().tanh());
            assert!((near - told).abs() < 1e-6, "{lean}: {near} for {told}");
            if lean == DVec2::ZERO {
                assert!(normal.normalize().dot(seen) > 1.0 - 1e-12, "{normal} beside {seen}");
            }
        }
    }

    /// Where a step in the picture moves a texel's place by a and b along its sides, a texel is 1/a by 1/b in the picture.
    #[test]
    fn metrics_are_those_of_a_stretched_texel() {
        let samples = [sample(DVec2::ZERO, DMat2::from_diagonal(DVec2::new(0.5, 4.0)))];
        let of = |metric| error(&samples, metric, &DMat3::IDENTITY, DVec2::ONE);
        assert!((of(Metric::L2) - (4.0 + 0.0625)).abs() < 1e-12);
        assert!((of(Metric::Max) - 2.0).abs() < 1e-12);
    }
}
