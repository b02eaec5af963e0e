//! Statistics of a frame's analysis: aliasing error over the pixels, view samples over the texels.

use rayon::prelude::*;

/// The aliasing error m over the pixels that a technique looks up, the medians of its two factors, and what else a
/// texel's footprint A in the picture says: median and 95th percentile each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aliasing {
    pub mean: f64,
    pub rms: f64,
    pub p50: f64,
    pub p95: f64,
    pub p99: f64,
    pub max: f64,
    /// Shares of the pixels with m above 1, 2, 10.
    pub over: [f64; 3],
    pub perspective_p50: f64,
    pub projection_p50: f64,
    /// |det A|, pixels².
    pub area: [f64; 2],
    /// trace(AᵀA), pixels²: the sum of the squares of its longest and its shortest extent.
    pub stretch: [f64; 2],
    /// The longest over the shortest extent.
    pub anisotropy: [f64; 2],
}

impl Aliasing {
    /// Of pixels as [`crate::frame::Analysis::aliasing`] gives them; None if none of them has a value.
    pub fn of(pixels: &[[f32; 4]]) -> Option<Aliasing> {
        let sorted = |of: fn(&[f32; 4]) -> f32| {
            let mut values: Vec<f32> = pixels.iter().filter(|p| p[0] > 0.0).map(of).collect();
            values.par_sort_unstable_by(f32::total_cmp);
            values
        };
        let m = sorted(|p| p[0]);
        let max = *m.last()?;
        let n = m.len() as f64;
        let at = |sorted: &[f32], q| super::metrics::quantile(sorted, q) as f64;
        let two = |of| [0.5, 0.95].map(|q| at(&sorted(of), q));
        Some(Aliasing {
            mean: m.iter().map(|x| *x as f64).sum::<f64>() / n,
            rms: (m.iter().map(|x| (*x as f64).powi(2)).sum::<f64>() / n).sqrt(),
            p50: at(&m, 0.5),
            p95: at(&m, 0.95),
            p99: at(&m, 0.99),
            max: max as f64,
            over: [1.0, 2.0, 10.0].map(|limit| (m.len() - m.partition_point(|x| *x <= limit)) as f64 / n),
            perspective_p50: at(&sorted(|p| p[1]), 0.5),
            projection_p50: at(&sorted(|p| p[2]), 0.5),
            area: two(|p| p[3]),
            // The shortest extent is the area over the longest.
            stretch: two(|p| p[0] * p[0] + (p[3] / p[0]).powi(2)),
            anisotropy: two(|p| p[0] / (p[3] / p[0])),
        })
    }
}

/// How view samples spread over the texels of a technique's maps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    pub texels: u64,
    /// Texels with a sample.
    pub covered: u64,
    /// Samples in all texels.
    pub samples: u64,
    /// Samples in the fullest texel.
    pub max: u64,
    /// Mean difference of any two texels over twice their mean (Gini 1912): 0 all alike, towards 1 all in one.
    pub gini: Option<f64>,
    /// Entropy of the spread over that of an even one, ln(texels).
    pub entropy: Option<f64>,
}

impl Counts {
    /// Of `texels` texels, whose counts other than 0 are given in any order.
    pub fn of(texels: u64, mut counts: Vec<u32>) -> Counts {
        counts.par_sort_unstable();
        let (n, covered) = (texels as f64, counts.len() as u64);
        let samples: u64 = counts.iter().map(|c| *c as u64).sum();
        let s = samples as f64;
        let empty = texels - covered;
        // Σ rank × count over all texels in ascending order; the empty ones come first and add nothing.
        let ranked: f64 = counts.iter().zip(empty + 1..).map(|(c, rank)| *c as f64 * rank as f64).sum();
        let entropy: f64 = counts.iter().map(|c| *c as f64 / s).map(|p| -p * p.ln()).sum();
        Counts {
            texels,
            covered,
            samples,
            max: counts.last().map_or(0, |c| *c as u64),
            gini: (samples > 0).then(|| 2.0 * ranked / (n * s) - (n + 1.0) / n),
            entropy: (samples > 0 && texels > 1).then(|| entropy / n.ln()),
        }
    }

    /// Samples a covered texel; None if none is.
    pub fn mean(&self) -> Option<f64> {
        (self.covered > 0).then(|| self.samples as f64 / self.covered as f64)
    }

    /// Covered texels over the most that could be: one for each sample, or all.
    pub fn utilisation(&self) -> Option<f64> {
        (self.samples > 0).then(|| self.covered as f64 / self.samples.min(self.texels) as f64)
    }
}
