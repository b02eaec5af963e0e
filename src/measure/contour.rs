//! How far a technique's shadow contour runs from the true one.

use super::metrics::{FACING, distance_to};

/// Mean distance in pixels between the contours of two shadows, taken from each to the other: over the points of both,
/// the distance to the nearest point of the other. A contour's points lie halfway between neighbouring pixels, beside or
/// above one another, that can both be wrong and bear different labels. None where one of the two has no contour.
///
/// Both ways, since one way alone would find nothing wrong with a shadow that is missing, or with one that is false.
/// `mask` as for [`super::metrics::errors`], rows of `width`; visibility of at least one half is lit.
pub fn mean_distance(visibility: &[f32], truth: &[f32], mask: &[u32], width: usize) -> Option<f64> {
    distances(visibility, truth, mask, width).map(|(sum, number)| sum / number as f64)
}

/// The sum of these distances and how many there are; several frames' can be added up.
pub fn distances(visibility: &[f32], truth: &[f32], mask: &[u32], width: usize) -> Option<(f64, u64)> {
    // On a grid of half pixels, where the points between pixels have places of their own.
    let (height, wide) = (mask.len().checked_div(width)?, 2 * width - 1);
    let points = |of: &[f32]| {
        let mut marked = vec![false; wide * (2 * height).saturating_sub(1)];
        let differ = |i: usize, j: usize| mask[i] == FACING && mask[j] == FACING && (of[i] >= 0.5) != (of[j] >= 0.5);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let i = y * width + x;
            if x + 1 < width && differ(i, i + 1) {
                marked[2 * y * wide + 2 * x + 1] = true;
            }
            if y + 1 < height && differ(i, i + width) {
                marked[(2 * y + 1) * wide + 2 * x] = true;
            }
        }
        marked
    };
    let contours = [points(visibility), points(truth)];
    if contours.iter().any(|points| !points.contains(&true)) {
        return None;
    }
    let (mut sum, mut number) = (0.0, 0u64);
    for (from, to) in [(0, 1), (1, 0)] {
        let far = distance_to(&contours[to], wide);
        for (d, _) in far.iter().zip(&contours[from]).filter(|(_, marked)| **marked) {
            sum += 0.5 * *d as f64;
            number += 1;
        }
    }
    Some((sum, number))
}

#[cfg(test)]
mod tests {
    use super::super::metrics::AWAY;
    use super::*;

    const SIZE: (usize, usize) = (32, 8);

    /// Dark to the left of a column.
    fn edge(at: usize) -> Vec<f32> {
        (0..SIZE.0 * SIZE.1).map(|i| if i % SIZE.0 < at { 0.2 } else { 0.7 }).collect()
    }

    #[test]
    fn a_shifted_edge_is_off_by_its_shift() {
        let mut mask = vec![FACING; SIZE.0 * SIZE.1];
        let off = |a: &[f32], b: &[f32], mask: &[u32]| mean_distance(a, b, mask, SIZE.0);
        assert_eq!(off(&edge(13), &edge(10), &mask), Some(3.0));
        assert_eq!(off(&edge(10), &edge(10), &mask), Some(0.0));
        assert_eq!(off(&edge(0), &edge(10), &mask), None);
        // A false shadow of one pixel, with four points around it.
        let mut speck = edge(10);
        speck[3 * SIZE.0 + 20] = 0.0;
        let found = off(&speck, &edge(10), &mask).unwrap();
        let closed = |x: f64, y: f64| (x * x + y * y).sqrt();
        // From the edge at 9.5 to the points at 19.5, 20.5 and, half a pixel above and below row 3, twice 20.
        let sum = 10.0 + 11.0 + 2.0 * closed(10.5, 0.5);
        assert!((found - sum / (4.0 + 8.0 + 8.0)).abs() < 1e-6, "{found}");
        // A missing shadow counts as much as a false one.
        assert_eq!(off(&edge(10), &speck, &mask), Some(found));
        // No contour runs along what faces away.
        mask.iter_mut().enumerate().filter(|(i, _)| i % SIZE.0 == 10).for_each(|(_, m)| *m = AWAY);
        assert_eq!(off(&edge(13), &edge(10), &mask), None);
    }

    #[test]
    fn means_equal_brute_force() {
        let (w, h) = (19, 13);
        let mut seed = 11u32;
        let mut next = || {
            seed = seed.wrapping_mul(747796405).wrapping_add(2891336453);
            (seed >> 8) as f32 / 16777216.0
        };
        let [a, b]: [Vec<f32>; 2] = [0, 1].map(|_| (0..w * h).map(|_| if next() < 0.08 { 0.0 } else { 1.0 }).collect());
        let points = |of: &[f32]| {
            let mut out: Vec<(f64, f64)> = Vec::new();
            for i in 0..w * h {
                let (x, y) = ((i % w) as f64, (i / w) as f64);
                if i % w + 1 < w && of[i] != of[i + 1] {
                    out.push((x + 0.5, y));
                }
                if i + w < w * h && of[i] != of[i + w] {
                    out.push((x, y + 0.5));
                }
            }
            out
        };
        let (p, q) = (points(&a), points(&b));
        let nearest = |from: &(f64, f64), to: &[(f64, f64)]| {
            to.iter().map(|t| (t.0 - from.0).hypot(t.1 - from.1)).fold(f64::INFINITY, f64::min)
        };
        let sum: f64 = p.iter().map(|x| nearest(x, &q)).chain(q.iter().map(|x| nearest(x, &p))).sum();
        let found = mean_distance(&a, &b, &vec![FACING; w * h], w).unwrap();
        assert!((found - sum / (p.len() + q.len()) as f64).abs() < 1e-6, "{found}");
    }
}
