//! Errors of a visibility buffer against the truth.

use rayon::prelude::*;

/// Background: no surface.
pub const BACKGROUND: u32 = 0;
/// A surface turned away from the light (n·l ≤ 0): dark whatever the technique does.
pub const AWAY: u32 = 1;
/// A surface that faces the light and is reached by it: what can be wrong.
pub const FACING: u32 = 2;
/// A surface that faces the light, but lies outside its cone or beyond its range: dark like [`AWAY`].
pub const OUTSIDE: u32 = 3;

/// A visibility that is off by more counts in [`Errors::beyond_tolerance`]. A tenth of the light: three times what the mean
/// over 16 samples is off by on average at a straight edge, and less than one of nine comparisons of a filter.
pub const TOLERANCE: f32 = 0.1;

/// Distances of wrong pixels from the true shadow boundary, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boundary {
    pub median: f32,
    pub p95: f32,
    pub max: f32,
}

/// Pixel counts after Morais 2015, section 5, against the hard truth, and sizes of the errors against the averaged one.
/// A visibility of at least one half counts as lit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Pixels that face the light and are reached by it: the four counts below add up to it.
    pub facing: usize,
    pub lit_correct: usize,
    /// Called lit, but in shadow.
    pub lit_incorrect: usize,
    pub shadow_correct: usize,
    /// Called shadow, but lit.
    pub shadow_incorrect: usize,
    /// Pixels that face away from the light.
    pub away: usize,
    /// Pixels that face the light outside its cone or range.
    pub outside: usize,
    pub background: usize,
    /// Of visibility minus truth over the pixels that can be wrong: root mean square, mean of the absolute value, its
    /// largest, and the share of pixels where it is above [`TOLERANCE`].
    pub rmse: f64,
    pub mae: f64,
    pub max_error: f64,
    pub beyond_tolerance: f64,
    /// Root mean square of visibility minus the hard truth.
    pub rmse_hard: f64,
    /// Root mean square over those whose truth lies between 0 and 1; None if there is no such penumbra.
    pub rmse_penumbra: Option<f64>,
    /// None: no wrong pixel, or no true boundary in the picture.
    pub boundary: Option<Boundary>,
    /// The wrong pixels by cause ([`super::causes::CAUSES`]), where they were told apart.
    pub causes: Option<[usize; 5]>,
}

impl Errors {
    /// Wrong pixels as a share of those that can be wrong, 0 to 1.
    pub fn share(&self) -> f64 {
        (self.lit_incorrect + self.shadow_incorrect) as f64 / self.facing.max(1) as f64
    }
}

/// What a frame's errors are counted in, a number per pixel.
pub struct Pixels {
    pub visibility: Vec<f32>,
    pub hard: Vec<f32>,
    pub mean: Vec<f32>,
    pub mask: Vec<u32>,
}

/// Compares visibility with the `hard` truth in labels and with the truth `mean` in size, all a number per pixel in rows of
/// `width`; `mask` holds [`BACKGROUND`], [`AWAY`], [`FACING`] or [`OUTSIDE`].
pub fn errors(visibility: &[f32], hard: &[f32], mean: &[f32], mask: &[u32], width: usize) -> Errors {
    let mut sums = Sums::default();
    sums.add(visibility, hard, mean, mask, width);
    sums.errors()
}

/// The errors of several frames of the same pixels, of a light each, as of one that has all their pixels.
pub fn pooled(frames: &[Pixels], width: usize) -> Errors {
    let mut sums = Sums::default();
    frames.iter().for_each(|f| sums.add(&f.visibility, &f.hard, &f.mean, &f.mask, width));
    sums.errors()
}

/// What the truth is itself off by, root mean square over the pixels that can be wrong, as if its samples were at random: those that
/// are spread evenly are off by less.
pub fn truth_error(frames: &[Pixels], samples: u32) -> f64 {
    let (mut variance, mut facing) = (0.0, 0);
    for f in frames {
        for (mean, _) in f.mean.iter().zip(&f.mask).filter(|(_, m)| **m == FACING) {
            variance += f64::from(mean * (1.0 - mean)) / f64::from(samples);
            facing += 1;
        }
    }
    (variance / f64::from(facing.max(1))).sqrt()
}

/// What errors are made of.
#[derive(Default)]
struct Sums {
    counts: Errors,
    squares: f64,
    sum: f64,
    beyond: usize,
    penumbra: usize,
    soft_squares: f64,
    hard_squares: f64,
    /// Distances of wrong pixels from the true boundary, pixels.
    far: Vec<f32>,
}

impl Sums {
    fn add(&mut self, visibility: &[f32], hard: &[f32], mean: &[f32], mask: &[u32], width: usize) {
        let e = &mut self.counts;
        let mut wrong = Vec::new();
        for (i, m) in mask.iter().enumerate() {
            match *m {
                BACKGROUND => e.background += 1,
                AWAY => e.away += 1,
                OUTSIDE => e.outside += 1,
                _ => {
                    e.facing += 1;
                    let off = (visibility[i] - mean[i]).abs();
                    self.beyond += (off > TOLERANCE) as usize;
                    let off = off as f64;
                    self.sum += off;
                    self.squares += off * off;
                    self.hard_squares += ((visibility[i] - hard[i]) as f64).powi(2);
                    e.max_error = e.max_error.max(off);
                    if mean[i] > 0.0 && mean[i] < 1.0 {
                        self.penumbra += 1;
                        self.soft_squares += off * off;
                    }
                    match (visibility[i] >= 0.5, hard[i] >= 0.5) {
                        (true, true) => e.lit_correct += 1,
                        (true, false) => e.lit_incorrect += 1,
                        (false, false) => e.shadow_correct += 1,
                        (false, true) => e.shadow_incorrect += 1,
                    }
                    if (visibility[i] >= 0.5) != (hard[i] >= 0.5) {
                        wrong.push(i);
                    }
                }
            }
        }
        if !wrong.is_empty() {
            // The true contour runs half a pixel before the nearest pixel of the other label.
            let to = [false, true].map(|lit| {
                let marked: Vec<bool> = (0..mask.len()).map(|i| mask[i] == FACING && (hard[i] >= 0.5) == lit).collect();
                distance_to(&marked, width)
            });
            let off = |i: &usize| to[(hard[*i] < 0.5) as usize][*i] - 0.5;
            self.far.extend(wrong.iter().map(off).filter(|d| d.is_finite()));
        }
    }

    fn errors(self) -> Errors {
        let Sums { counts: mut e, squares, sum, beyond, penumbra, soft_squares, hard_squares, mut far } = self;
        let facing = e.facing.max(1) as f64;
        e.rmse = (squares / facing).sqrt();
        e.rmse_hard = (hard_squares / facing).sqrt();
        e.mae = sum / facing;
        e.beyond_tolerance = beyond as f64 / facing;
        e.rmse_penumbra = (penumbra > 0).then(|| (soft_squares / penumbra as f64).sqrt());
        far.sort_by(f32::total_cmp);
        if let Some(max) = far.last() {
            e.boundary = Some(Boundary { median: quantile(&far, 0.5), p95: quantile(&far, 0.95), max: *max });
        }
        e
    }
}

/// Share of wrong labels among the pixels that can be wrong in a square of `window` pixels around each, 0 to 1; -1 where none
/// can, and around pixels that cannot. Arguments as for [`errors`].
pub fn density(visibility: &[f32], hard: &[f32], mask: &[u32], width: usize, window: usize) -> Vec<f32> {
    let height = mask.len() / width;
    // Sums over all pixels above and to the left.
    let mut sums = vec![[0u32; 2]; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = [0; 2];
        for x in 0..width {
            let i = y * width + x;
            let facing = mask[i] == FACING;
            row[0] += facing as u32;
            row[1] += (facing && (visibility[i] >= 0.5) != (hard[i] >= 0.5)) as u32;
            let above = sums[y * (width + 1) + x + 1];
            sums[(y + 1) * (width + 1) + x + 1] = [above[0] + row[0], above[1] + row[1]];
        }
    }
    let half = window / 2;
    let share = |i: usize| {
        let (x, y) = (i % width, i / width);
        let [left, right] = [x.saturating_sub(half), (x + half + 1).min(width)];
        let [top, bottom] = [y.saturating_sub(half), (y + half + 1).min(height)];
        let at = |x: usize, y: usize| sums[y * (width + 1) + x];
        let (a, b, c, d) = (at(left, top), at(right, top), at(left, bottom), at(right, bottom));
        let [facing, wrong] = [0, 1].map(|k| a[k] + d[k] - b[k] - c[k]);
        if mask[i] == FACING { wrong as f32 / facing as f32 } else { -1.0 }
    };
    (0..mask.len()).into_par_iter().map(share).collect()
}

/// Root mean square of the difference of two visibilities over the pixels that can be wrong.
pub fn rms(a: &[f32], b: &[f32], mask: &[u32]) -> f64 {
    let facing = (0..mask.len()).filter(|i| mask[*i] == FACING);
    let (sum, n) = facing.fold((0.0, 0), |(sum, n), i| (sum + (f64::from(a[i]) - f64::from(b[i])).powi(2), n + 1));
    (sum / f64::from(n.max(1))).sqrt()
}

/// Root mean square difference of two pictures of four bytes per pixel over red, green and blue, each 0 to 1 as encoded.
pub fn rmse_image(a: &[u8], b: &[u8]) -> f64 {
    let square = |(a, b): (&u8, &u8)| (*a as f64 - *b as f64).powi(2);
    let pixels = a.chunks_exact(4).zip(b.chunks_exact(4));
    let sum: f64 = pixels.flat_map(|(a, b)| a[..3].iter().zip(&b[..3])).map(square).sum();
    (sum / (a.len() / 4 * 3).max(1) as f64).sqrt() / 255.0
}

/// Mean FLIP difference of two sRGB pictures of four bytes per pixel and equal size (Andersson et al. 2020), 0 to 1, seen
/// from where 67 pixels span a degree: a 0.7 m wide monitor of 3840 pixels from 0.7 m.
pub fn flip(reference: &[u8], test: &[u8], size: [u32; 2]) -> f64 {
    let map = flip_map(reference, test, size);
    map.iter().map(|x| *x as f64).sum::<f64>() / map.len().max(1) as f64
}

/// The same difference of each pixel.
pub fn flip_map(reference: &[u8], test: &[u8], size: [u32; 2]) -> Vec<f32> {
    let rgb = |bytes: &[u8]| bytes.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect::<Vec<u8>>();
    let image = |bytes: &[u8]| nv_flip::FlipImageRgb8::with_data(size[0], size[1], &rgb(bytes));
    nv_flip::flip(image(reference), image(test), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

/// Quality of a picture beside the true one in JOD, as ColorVideoVDP judges two stills (Mantiuk et al. 2024): 10 where nobody sees a
/// difference; of two pictures 1 JOD apart three in four people prefer the better. sRGB, four bytes a pixel, on a desktop screen of
/// 200 cd/m² in an office, as far away as for [`flip`]. None where the pictures are too small for it.
pub fn jod(reference: &[u8], test: &[u8], size: [u32; 2]) -> Option<f64> {
    use colorvideovdp::{Color, Cvvdp, DisplayModel, Geometry, Image, Options};
    let [width, height] = size.map(|n| n as usize);
    let image = |bytes: &[u8]| {
        let values = bytes.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).map(|byte| f32::from(byte) / 255.0);
        Image::new(width, height, 3, values.collect())
    };
    let screen = DisplayModel::from_name("standard_4k").ok()?;
    let geometry = Geometry::from_ppd(screen.geometry.resolution(), nv_flip::DEFAULT_PIXELS_PER_DEGREE.into()).ok()?;
    let screen = DisplayModel::new("desktop", screen.photometry, geometry, screen.color_space).ok()?;
    // It refuses by an estimate of what it needs; the picture itself was drawn.
    let options = Options::default().with_memory_limit_bytes(usize::MAX);
    let found =
        Cvvdp::new(screen, options).ok()?.predict_image(&image(test).ok()?, &image(reference).ok()?, Color::Srgb);
    Some(found.ok()?.jod.into())
}

/// A quantile of ascending values, by the nearest rank.
pub(super) fn quantile(sorted: &[f32], q: f64) -> f32 {
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

/// Euclidean distance of every pixel from the nearest marked one, pixels; infinite if none is marked.
/// Exact, by lower envelopes of parabolas, columns then rows (Felzenszwalb, Huttenlocher 2012).
pub(super) fn distance_to(marked: &[bool], width: usize) -> Vec<f32> {
    let height = marked.len() / width;
    let columns: Vec<Vec<f64>> = (0..width)
        .into_par_iter()
        .map(|x| envelope((0..height).map(|y| if marked[y * width + x] { 0.0 } else { f64::INFINITY })))
        .collect();
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| envelope((0..width).map(|x| columns[x][y])).into_iter().map(|d| d.sqrt() as f32))
        .collect()
}

/// For each place x the minimum over all q of f(q) + (x - q)².
fn envelope(f: impl ExactSizeIterator<Item = f64>) -> Vec<f64> {
    let n = f.len();
    // Parabolas of the envelope: where they stand, how high, and from where on they are lowest.
    let mut hull: Vec<(f64, f64, f64)> = Vec::new();
    for (q, height) in f.enumerate().filter(|(_, h)| h.is_finite()) {
        let q = q as f64;
        let mut from = f64::NEG_INFINITY;
        while let Some((p, h, start)) = hull.last() {
            from = ((height + q * q) - (h + p * p)) / (2.0 * (q - p));
            if from > *start {
                break;
            }
            hull.pop();
            from = f64::NEG_INFINITY;
        }
        hull.push((q, height, from));
    }
    let mut out = vec![f64::INFINITY; n];
    let mut k = 0;
    for (x, out) in out.iter_mut().enumerate() {
        let x = x as f64;
        while k + 1 < hull.len() && hull[k + 1].2 <= x {
            k += 1;
        }
        if let Some((q, height, _)) = hull.get(k) {
            *out = height + (x - q) * (x - q);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole numbers below 256 that look random.
    fn bytes(mut seed: u32) -> impl FnMut() -> u32 {
        move || {
            seed = seed.wrapping_mul(747796405).wrapping_add(2891336453);
            seed >> 24
        }
    }

    #[test]
    fn distances_equal_brute_force() {
        let (w, h) = (23, 17);
        let mut byte = bytes(7);
        let marked: Vec<bool> = (0..w * h).map(|_| byte() < 12).collect();
        let fast = distance_to(&marked, w);
        for (i, fast) in fast.into_iter().enumerate() {
            let near = (0..w * h).filter(|j| marked[*j]).map(|j| {
                let (dx, dy) = ((i % w).abs_diff(j % w), (i / w).abs_diff(j / w));
                ((dx * dx + dy * dy) as f32).sqrt()
            });
            let exact = near.fold(f32::INFINITY, f32::min);
            assert!((fast - exact).abs() < 1e-4, "pixel {i}: {fast} instead of {exact}");
        }
        assert!(distance_to(&[false; 4], 2).iter().all(|d| d.is_infinite()));
    }

    /// A chequer of darker squares on ramps: what the authors' own program (0.5.7) says of it.
    #[test]
    fn quality_is_that_of_the_authors_program() {
        let size = [128, 96];
        let picture = |darker: u32| -> Vec<u8> {
            let pixel = |i: u32| {
                let (x, y) = (i % size[0], i / size[0]);
                let less = if (x / 8 + y / 8) % 2 == 0 { darker } else { 0 };
                let value = |v: u32| (v % 256).saturating_sub(less) as u8;
                [value(2 * x), value(2 * y), value(x + y), 255]
            };
            (0..size[0] * size[1]).flat_map(pixel).collect()
        };
        let quality = jod(&picture(0), &picture(20), size).unwrap();
        assert!((quality - 5.833317).abs() < 1e-4, "{quality}");
        assert_eq!(jod(&picture(0), &picture(0), size), Some(10.0));
        assert!(jod(&picture(0), &picture(5), size).unwrap() > quality);
    }

    #[test]
    fn counts_and_boundary_of_a_shifted_edge() {
        // The true shadow covers x < 10; the technique's x < 13: three columns of each row are wrong.
        let (w, h) = (32, 8);
        let edge = |at: usize| (0..w * h).map(|i| if i % w < at { 0.0 } else { 1.0 }).collect::<Vec<f32>>();
        let mut mask = vec![FACING; w * h];
        mask[0] = AWAY;
        mask[31] = BACKGROUND;
        let e = errors(&edge(13), &edge(10), &edge(10), &mask, w);
        assert_eq!((e.facing, e.away, e.background, e.outside), (w * h - 2, 1, 1, 0));
        assert_eq!((e.shadow_incorrect, e.lit_incorrect), (3 * h, 0));
        assert_eq!(e.shadow_correct, 10 * h - 1);
        assert_eq!(e.lit_correct, 19 * h - 1);
        assert!((e.rmse - (24.0f64 / 254.0).sqrt()).abs() < 1e-9);
        assert_eq!(e.boundary, Some(Boundary { median: 1.5, p95: 2.5, max: 2.5 }));
        let share = 24.0 / 254.0;
        assert!((e.mae - share).abs() < 1e-9 && (e.beyond_tolerance - share).abs() < 1e-9 && e.max_error == 1.0);
        assert_eq!(errors(&edge(10), &edge(10), &edge(10), &mask, w).boundary, None);
        // What the light does not reach counts as a class of its own.
        mask[10] = OUTSIDE;
        let e = errors(&edge(13), &edge(10), &edge(10), &mask, w);
        assert_eq!((e.facing, e.outside, e.shadow_incorrect), (w * h - 3, 1, 3 * h - 1));
    }

    /// Of independent samples a mean m of n is off by √(m(1−m)/n).
    #[test]
    fn the_truth_is_off_as_binomial_shares_are() {
        let frame = |mean: [f32; 4]| Pixels {
            mean: mean.to_vec(),
            mask: vec![FACING, FACING, FACING, AWAY],
            visibility: vec![0.0; 4],
            hard: vec![0.0; 4],
        };
        let frames = [frame([0.5, 0.0, 1.0, 0.5]), frame([0.25, 1.0, 0.0, 0.5])];
        let exact = ((0.25f64 + 0.1875) / 16.0 / 6.0).sqrt();
        assert!((truth_error(&frames, 16) - exact).abs() < 1e-9);
        assert_eq!(truth_error(&[], 16), 0.0);
    }

    /// Sums over squares are what counting in each square gives, at the picture's edges too.
    #[test]
    fn density_equals_brute_force() {
        let (w, h) = (23usize, 9);
        let mut byte = bytes(3);
        let mask: Vec<u32> = (0..w * h).map(|_| if byte() < 85 { AWAY } else { FACING }).collect();
        let [seen, hard] = [0; 2].map(|_| (0..w * h).map(|_| (byte() % 2) as f32).collect::<Vec<f32>>());
        for window in [1, 3, 8] {
            let found = density(&seen, &hard, &mask, w, window);
            for i in 0..w * h {
                let near = |j: &usize| {
                    (i % w).abs_diff(j % w).max((i / w).abs_diff(j / w)) <= window / 2 && mask[*j] == FACING
                };
                let near: Vec<usize> = (0..w * h).filter(near).collect();
                let wrong = near.iter().filter(|j| seen[**j] != hard[**j]).count();
                let exact = if mask[i] == FACING { wrong as f32 / near.len() as f32 } else { -1.0 };
                assert_eq!(found[i], exact, "pixel {i}, window {window}");
            }
        }
    }

    /// Labels are judged by the hard truth, sizes by the mean.
    #[test]
    fn sizes_are_of_the_mean() {
        let visibility = [1.0, 0.5, 0.25, 0.0];
        let e = errors(&visibility, &[1.0, 0.0, 0.0, 0.0], &[1.0, 0.5, 0.5, 0.05], &[FACING; 4], 4);
        assert_eq!((e.lit_correct, e.lit_incorrect, e.shadow_correct), (1, 1, 2));
        assert!((e.rmse - ((0.25f64.powi(2) + 0.05f64.powi(2)) / 4.0).sqrt()).abs() < 1e-8, "{e:?}");
        assert!((e.mae - 0.3 / 4.0).abs() < 1e-8 && e.max_error == 0.25 && e.beyond_tolerance == 0.25, "{e:?}");
        let penumbra = ((0.25f64.powi(2) + 0.05f64.powi(2)) / 3.0).sqrt();
        assert!((e.rmse_penumbra.unwrap_or(0.0) - penumbra).abs() < 1e-8, "{e:?}");
    }
}
