//! How wide penumbrae are beside the true ones, and how coarse the grain of errors is.

use super::metrics::{FACING, Pixels};
use rayon::prelude::*;
use rustfft::{FftPlanner, num_complex::Complex};

/// The contour's points that are looked at: where there are more, every n-th.
const POINTS: usize = 2000;
/// Pixels on either side of the contour within which a penumbra must end.
const REACH: f32 = 128.0;
/// Pixels of a step along a line across the contour.
const STEP: f32 = 0.5;
/// Lines side by side whose mean is taken, a pixel apart, so that grain ends no penumbra: so many on either side of the middle.
const BESIDE: i32 = 2;
/// Pixels around a point that the direction of its line is fitted to.
const FITTED: i32 = 4;
/// Share of the inverse depth by which a pixel may be off the plane of the point and lie on the same surface.
const OFF_PLANE: f32 = 0.01;

/// What is known of a frame's pixels, in rows of `width`; `position` has the depth along the camera's axis last.
struct Picture<'a> {
    pixels: &'a Pixels,
    position: &'a [[f32; 4]],
    width: usize,
}

/// A point of the true contour: its place in pixels (centres lie at whole numbers), the direction from shadow to light, and the inverse
/// depth of its surface's plane with its slopes.
struct Point {
    at: [f32; 2],
    across: [f32; 2],
    plane: [f32; 3],
}

impl Picture<'_> {
    /// A pixel that can be wrong.
    fn inside(&self, x: i32, y: i32) -> Option<usize> {
        let height = self.pixels.mask.len() / self.width;
        let held = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < height;
        let i = y.max(0) as usize * self.width + x.max(0) as usize;
        (held && self.pixels.mask[i] == FACING).then_some(i)
    }

    fn nearness(&self, i: usize) -> f32 {
        1.0 / self.position[i][3]
    }

    /// The plane of a pixel's surface, if its neighbours lie on it too.
    fn plane(&self, x: i32, y: i32) -> Option<[f32; 3]> {
        let at = |x, y| self.inside(x, y).map(|i| self.nearness(i));
        let middle = at(x, y)?;
        let slope = |before: f32, after: f32| {
            ((before + after - 2.0 * middle).abs() < 1e-3 * middle).then_some((after - before) / 2.0)
        };
        Some([middle, slope(at(x - 1, y)?, at(x + 1, y)?)?, slope(at(x, y - 1)?, at(x, y + 1)?)?])
    }

    /// A pixel that can be wrong and lies on the plane of a point.
    fn on_plane(&self, p: &Point, x: i32, y: i32) -> Option<usize> {
        let i = self.inside(x, y)?;
        let there = p.plane[0] + p.plane[1] * (x as f32 - p.at[0]) + p.plane[2] * (y as f32 - p.at[1]);
        ((self.nearness(i) - there).abs() <= OFF_PLANE * p.plane[0]).then_some(i)
    }

    /// A point between a pixel and the next one on the right or below, if the true contour runs there over one surface.
    fn point(&self, x: i32, y: i32, dx: i32, dy: i32) -> Option<Point> {
        let (i, j) = (self.inside(x, y)?, self.inside(x + dx, y + dy)?);
        let [a, b] = [i, j].map(|i| self.pixels.mean[i]);
        if (a >= 0.5) == (b >= 0.5) {
            return None;
        }
        let along = (0.5 - a) / (b - a);
        let [middle, u, v] = self.plane(x, y)?;
        let step = [dx as f32 * along, dy as f32 * along];
        let mut p = Point {
            at: [x as f32 + step[0], y as f32 + step[1]],
            across: [0.0; 2],
            plane: [middle + u * step[0] + v * step[1], u, v],
        };
        self.on_plane(&p, x + dx, y + dy)?;
        // The slope of the plane that fits the truth around best.
        let mut m = [[0f64; 3]; 3];
        let mut sums = [0f64; 3];
        for (sx, sy) in (-FITTED..=FITTED).flat_map(|sy| (-FITTED..=FITTED).map(move |sx| (sx, sy))) {
            let Some(k) = self.on_plane(&p, x + sx, y + sy) else { continue };
            let weight = f64::from(-(sx * sx + sy * sy) as f32 / 8.0).exp();
            let terms = [1.0, f64::from(sx), f64::from(sy)];
            for r in 0..3 {
                sums[r] += weight * terms[r] * f64::from(self.pixels.mean[k]);
                (0..3).for_each(|c| m[r][c] += weight * terms[r] * terms[c]);
            }
        }
        let slope = glam::DMat3::from_cols_array_2d(&m).inverse() * glam::DVec3::from_array(sums);
        let direction = glam::DVec2::new(slope.y, slope.z).try_normalize()?;
        p.across = [direction.x as f32, direction.y as f32];
        Some(p)
    }

    /// The mean of values over the lines side by side, so far across the contour; None where they leave the surface.
    fn profile(&self, of: &[f32], p: &Point, t: f32) -> Option<f32> {
        let (mut sum, mut number) = (0.0, 0);
        for beside in -BESIDE..=BESIDE {
            let s = beside as f32;
            let [x, y] = [p.at[0] + t * p.across[0] - s * p.across[1], p.at[1] + t * p.across[1] + s * p.across[0]];
            let (left, top) = (x.floor(), y.floor());
            let (mut value, mut weights) = (0.0, 0.0);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let Some(i) = self.on_plane(p, left as i32 + dx, top as i32 + dy) else { continue };
                let [u, v] = [(x - left, dx), (y - top, dy)].map(|(part, d)| if d == 1 { part } else { 1.0 - part });
                (value, weights) = (value + u * v * of[i], weights + u * v);
            }
            if weights > 0.25 {
                (sum, number) = (sum + value / weights, number + 1);
            }
        }
        (number > BESIDE).then(|| sum / number as f32)
    }

    /// Where values first pass a level, going from a place across the contour towards the light (1) or the shadow (-1); None where they
    /// turn back before, or do not within reach.
    fn passes(&self, of: &[f32], p: &Point, begin: f32, way: f32, level: f32) -> Option<f32> {
        let (mut t, mut last) = (begin, self.profile(of, p, begin)?);
        loop {
            if (last - level) * way >= 0.0 {
                return Some(t);
            }
            let next = t + way * STEP;
            let value = self.profile(of, p, next).filter(|v| (v - 0.5) * way > -0.1 && next.abs() <= REACH)?;
            if (value - level) * way >= 0.0 {
                return Some(t + way * STEP * (level - last) / (value - last));
            }
            (t, last) = (next, value);
        }
    }

    /// How far values take from a tenth to nine tenths.
    fn width(&self, of: &[f32], p: &Point) -> Option<f32> {
        let way = if self.profile(of, p, 0.0)? < 0.5 { 1.0 } else { -1.0 };
        let mut middle = 0.0;
        // The technique's contour may run beside the true one.
        while (self.profile(of, p, middle)? - 0.5) * way < 0.0 {
            middle += way * STEP;
            if middle.abs() > REACH {
                return None;
            }
        }
        Some(self.passes(of, p, middle, 1.0, 0.9)? - self.passes(of, p, middle, -1.0, 0.1)?)
    }
}

/// Widths of penumbrae, the pixels in which visibility rises from a tenth to nine tenths, along lines across the true contour: a
/// technique's and the true one. Lines that leave the surface, or on which the technique has no penumbra, are left out.
/// `position` is the G-buffer's, with the depth along the camera's axis last; rows of `width`.
pub fn penumbrae(pixels: &Pixels, position: &[[f32; 4]], width: usize) -> Vec<[f32; 2]> {
    let picture = &Picture { pixels, position, width };
    let all: Vec<Point> = (0..pixels.mask.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            let (x, y) = ((i % width) as i32, (i / width) as i32);
            [(1, 0), (0, 1)].into_iter().filter_map(move |(dx, dy)| picture.point(x, y, dx, dy))
        })
        .collect();
    let every = all.len().div_ceil(POINTS).max(1);
    let chosen: Vec<&Point> = all.iter().step_by(every).collect();
    let both = |p: &&Point| Some([picture.width(&pixels.visibility, p)?, picture.width(&pixels.mean, p)?]);
    chosen.par_iter().filter_map(both).collect()
}

/// The same on the line across the point of the contour that lies nearest to a pixel, at most so many pixels off. The technique's is None
/// where that has none.
pub fn penumbra_near(
    pixels: &Pixels,
    position: &[[f32; 4]],
    width: usize,
    pixel: [u32; 2],
    most: i32,
) -> Option<(Option<f32>, f32)> {
    let picture = &Picture { pixels, position, width };
    let [x, y] = pixel.map(|c| c as i32);
    let mut around: Vec<[i32; 2]> = (-most..=most).flat_map(|dy| (-most..=most).map(move |dx| [dx, dy])).collect();
    around.sort_by_key(|[dx, dy]| dx * dx + dy * dy);
    let points = around.into_iter().flat_map(|[dx, dy]| [(1, 0), (0, 1)].map(|step| (x + dx, y + dy, step)));
    points
        .filter_map(|(x, y, (dx, dy))| picture.point(x, y, dx, dy))
        .find_map(|p| Some((picture.width(&pixels.visibility, &p), picture.width(&pixels.mean, &p)?)))
}

/// What widths of penumbrae come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Penumbrae {
    /// Means of the technique's and of the true widths, and of how far the one is off the other, pixels.
    pub width: f64,
    pub truth: f64,
    pub off: f64,
    /// How much the technique's widths grow where the true ones do, by least squares: 1 as they should, 0 where a filter is as wide
    /// everywhere. None where the true ones are all about as wide.
    pub slope: Option<f64>,
}

impl Penumbrae {
    /// None: no line crosses a penumbra of both.
    pub fn of(widths: &[[f32; 2]]) -> Option<Penumbrae> {
        let n = widths.len() as f64;
        let mean = |of: &dyn Fn(&[f32; 2]) -> f64| widths.iter().map(of).sum::<f64>() / n;
        let width = mean(&|w| w[0].into());
        let truth = mean(&|w| w[1].into());
        let spread = mean(&|w| (f64::from(w[1]) - truth).powi(2));
        let along = mean(&|w| (f64::from(w[0]) - width) * (f64::from(w[1]) - truth));
        (!widths.is_empty()).then(|| Penumbrae {
            width,
            truth,
            off: mean(&|w| f64::from(w[0] - w[1]).abs()),
            slope: (spread.sqrt() > 0.1 * truth).then(|| along / spread),
        })
    }
}

/// Power of visibility minus truth over the pixels that can be wrong, by the wavelength: above 16 pixels, 8 to 16, 4 to 8 and below 4.
/// Fine grain lies in the last, bands, blotches and whatever is wrong on average in the first. Add frames up, then divide by the sum.
pub fn spectrum(pixels: &Pixels, width: usize) -> [f64; 4] {
    let height = pixels.mask.len() / width;
    let off = |i: usize| if pixels.mask[i] == FACING { pixels.visibility[i] - pixels.mean[i] } else { 0.0 };
    let mut planner = FftPlanner::<f32>::new();
    let rows = planner.plan_fft_forward(width);
    let columns = planner.plan_fft_forward(height);
    let mut grid: Vec<Complex<f32>> = (0..width * height).map(|i| Complex::new(off(i), 0.0)).collect();
    grid.par_chunks_mut(width).for_each(|row| rows.process(row));
    let mut turned: Vec<Complex<f32>> = (0..width * height).map(|i| grid[i % height * width + i / height]).collect();
    turned.par_chunks_mut(height).for_each(|column| columns.process(column));
    let mut power = [0.0; 4];
    for (i, value) in turned.iter().enumerate() {
        // Cycles a pixel along either axis.
        let cycles = |k: usize, n: usize| k.min(n - k) as f64 / n as f64;
        let frequency = cycles(i / height, width).hypot(cycles(i % height, height));
        let octave = [1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0].iter().filter(|limit| frequency > **limit).count();
        power[octave] += f64::from(value.norm_sqr());
    }
    power
}

#[cfg(test)]
mod tests {
    use super::super::metrics::BACKGROUND;
    use super::*;

    const SIZE: (usize, usize) = (120, 80);

    /// A floor seen at an angle whose light rises along the rows by this much a pixel.
    fn ramp(rise: impl Fn(usize) -> f32, angle: f32) -> Vec<f32> {
        let value = |i: usize| {
            let (x, y) = ((i % SIZE.0) as f32 - 60.0, (i / SIZE.0) as f32 - 40.0);
            (0.5 + (x * angle.cos() + y * angle.sin()) * rise(i / SIZE.0)).clamp(0.0, 1.0)
        };
        (0..SIZE.0 * SIZE.1).map(value).collect()
    }

    fn floor() -> Vec<[f32; 4]> {
        (0..SIZE.0 * SIZE.1).map(|i| [0.0, 0.0, 0.0, 1.0 / (0.1 + 0.001 * (i / SIZE.0) as f32)]).collect()
    }

    fn pixels(visibility: Vec<f32>, mean: Vec<f32>) -> Pixels {
        Pixels { mask: vec![FACING; mean.len()], hard: Vec::new(), visibility, mean }
    }

    #[test]
    fn widths_are_those_of_ramps() {
        for angle in [0.0, 0.6, 2.5] {
            // The whole ramp is 40 and 20 pixels wide: from a tenth to nine tenths 32 and 16.
            let held = pixels(ramp(|_| 1.0 / 20.0, angle), ramp(|_| 1.0 / 40.0, angle));
            let found = Penumbrae::of(&penumbrae(&held, &floor(), SIZE.0)).unwrap();
            assert!((found.width - 16.0).abs() < 0.3 && (found.truth - 32.0).abs() < 0.3, "{angle}: {found:?}");
            assert!((found.off - 16.0).abs() < 0.5, "{angle}: {found:?}");
        }
    }

    /// Points lie where the true ramp passes through a half, between pixels, and look from dark to light.
    #[test]
    fn points_lie_where_half_is_lit() {
        let (mean, position) = (ramp(|_| 1.0 / 40.0, 0.3), floor());
        let held = pixels(mean.clone(), mean);
        let picture = Picture { pixels: &held, position: &position, width: SIZE.0 };
        let found: Vec<Point> = (0..SIZE.0 * SIZE.1)
            .filter_map(|i| picture.point((i % SIZE.0) as i32, (i / SIZE.0) as i32, 1, 0))
            .collect();
        assert!(found.len() > 60, "{}", found.len());
        let (sin, cos) = 0.3f32.sin_cos();
        for p in found {
            let off = (p.at[0] - 60.0) * cos + (p.at[1] - 40.0) * sin;
            assert!(off.abs() < 1e-3, "{:?} lies {off} pixels aside", p.at);
            assert!((p.across[0] - cos).abs() < 1e-3 && (p.across[1] - sin).abs() < 1e-3, "{:?}", p.across);
            let there = 0.1 + 0.001 * p.at[1];
            assert!((p.plane[0] - there).abs() < 1e-5, "{} for {there}", p.plane[0]);
        }
    }

    #[test]
    fn hardening_is_told_from_one_blur() {
        let growing = |y: usize| 1.0 / (10.0 + 0.3 * y as f32);
        let same = pixels(ramp(growing, 0.0), ramp(growing, 0.0));
        let blur = pixels(ramp(|_| 1.0 / 20.0, 0.0), ramp(growing, 0.0));
        let slope = |held: &Pixels| Penumbrae::of(&penumbrae(held, &floor(), SIZE.0)).unwrap().slope.unwrap();
        assert!((slope(&same) - 1.0).abs() < 1e-6 && slope(&blur).abs() < 0.05, "{} {}", slope(&same), slope(&blur));
    }

    /// Near a pixel the widths are those on the line across the contour's nearest point.
    #[test]
    fn widths_near_a_pixel_are_those_beside_it() {
        // The true ramp is 10 + 0.3 y pixels wide, the technique's half of that.
        let wide = |y: usize| 10.0 + 0.3 * y as f32;
        let held = pixels(ramp(|y| 2.0 / wide(y), 0.0), ramp(|y| 1.0 / wide(y), 0.0));
        for y in [20, 40, 60] {
            let found = penumbra_near(&held, &floor(), SIZE.0, [62, y], 6);
            let Some((Some(width), truth)) = found else { panic!("{found:?}") };
            let exact = 0.8 * wide(y as usize);
            assert!((truth - exact).abs() < 0.2 && (width - exact / 2.0).abs() < 0.2, "{y}: {width} {truth} {exact}");
        }
        // No farther off than told: there the contour lies between two pixels of the row.
        assert!([59, 60].iter().any(|x| penumbra_near(&held, &floor(), SIZE.0, [*x, 40], 0).is_some()));
        assert_eq!(penumbra_near(&held, &floor(), SIZE.0, [70, 40], 6), None);
    }

    #[test]
    fn no_line_leaves_its_surface() {
        // The right half lies far behind: the left one's penumbra ends where it does.
        let mut position = floor();
        (0..position.len()).filter(|i| i % SIZE.0 >= 64).for_each(|i| position[i][3] *= 3.0);
        let held = pixels(ramp(|_| 1.0 / 40.0, 0.0), ramp(|_| 1.0 / 40.0, 0.0));
        assert_eq!(penumbrae(&held, &position, SIZE.0), Vec::<[f32; 2]>::new());
        let mut hidden = pixels(ramp(|_| 1.0 / 40.0, 0.0), ramp(|_| 1.0 / 40.0, 0.0));
        hidden.mask = vec![BACKGROUND; hidden.mask.len()];
        assert_eq!(Penumbrae::of(&penumbrae(&hidden, &floor(), SIZE.0)), None);
    }

    /// A wave of one length lies in one octave, and all power is there (Parseval).
    #[test]
    fn waves_lie_in_their_octaves() {
        for (octave, length) in [(0, 40.0), (1, 12.0), (2, 5.0), (3, 3.0)] {
            let wave = |i: usize| 0.5 + 0.25 * ((i % SIZE.0) as f32 / length * std::f32::consts::TAU).sin();
            let held = pixels((0..SIZE.0 * SIZE.1).map(wave).collect(), vec![0.5; SIZE.0 * SIZE.1]);
            let power = spectrum(&held, SIZE.0);
            let sum: f64 = power.iter().sum();
            assert!(power[octave] > 0.999 * sum, "{length}: {power:?}");
            let squares: f64 = held.visibility.iter().map(|v| f64::from(v - 0.5).powi(2)).sum();
            assert!((sum / (SIZE.0 * SIZE.1) as f64 / squares - 1.0).abs() < 1e-4);
        }
    }
}
