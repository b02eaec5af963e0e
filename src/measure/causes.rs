//! What made each wrong pixel: told from measured quantities, never from the technique's name.

use super::metrics::{FACING, distance_to, quantile};
use std::collections::VecDeque;

/// A cause of wrong pixels.
pub struct Cause {
    pub id: &'static str,
    pub title: &'static str,
    pub doc: &'static str,
}

/// The causes, in the order of [`crate::palette::CAUSE_COLORS`]; class `i + 1` of [`Causes::classes`] is the `i`th of them.
pub const CAUSES: [Cause; 5] = [
    Cause { id: "acne", title: "acne", doc: "Dark though lit, away from every true edge: the surface shadows itself." },
    Cause {
        id: "detachment",
        title: "detachment",
        doc: "Lit though in shadow, between a caster's foot and where its shadow begins: peter-panning.",
    },
    Cause {
        id: "leak",
        title: "leak",
        doc: "Lit though in shadow, away from every true edge and from the caster: light passes through it.",
    },
    Cause {
        id: "missing_caster",
        title: "missing caster",
        doc: "Lit though in shadow, where nearly all of the caster's shadow is missing.",
    },
    Cause {
        id: "stairs",
        title: "stairs at an edge",
        doc: "Wrong within two pixels or two texels of a true edge: what resolution and filter do.",
    },
];

pub const ACNE: u8 = 1;
pub const DETACHMENT: u8 = 2;
pub const LEAK: u8 = 3;
pub const MISSING: u8 = 4;
pub const STAIRS: u8 = 5;

/// Pixels from a true edge within which an error is the edge's.
const NEAR_PX: f32 = 2.0;
/// A caster is missing if at least so much of its shadow is lit, of at least so many pixels.
const MISSING_SHARE: f32 = 0.9;
const MISSING_PIXELS: u32 = 16;

/// A gap may be deeper than 95 % of those that begin at a foot by this factor.
const SPARE: f32 = 1.1;

/// What a frame tells of a pixel, as `evidence_out` in `shaders/techniques/rt_hard.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Evidence {
    /// Of pixels in true shadow the bits of the metres to the nearest blocker, and its triangle. Of wrong ones that are lit
    /// in truth their own triangle, and one that stands beside them or their own again.
    pub own: u32,
    pub triangle: u32,
    /// Of wrong pixels: 1 if a true edge lies within two texels.
    pub edge: u32,
    /// Of wrong pixels: metres below which a blocker is near, two texels or two pixels.
    pub near: f32,
}

impl Evidence {
    /// Metres to the nearest blocker of a pixel in true shadow.
    pub fn distance(&self) -> f32 {
        f32::from_bits(self.own)
    }

    /// Whether something hides the light's centre, as it need not where a pixel is in the shadow of a light with a size.
    pub fn blocked(&self) -> bool {
        self.distance() > 0.0
    }
}

/// The wrong pixels of a frame by cause.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Causes {
    /// A number a pixel: 0 where nothing is wrong.
    pub classes: Vec<u8>,
    /// Pixels of each cause, in the order of [`CAUSES`].
    pub counts: [usize; CAUSES.len()],
    /// Metres to the nearest blocker of each pixel of detachment.
    pub gaps: Vec<f32>,
    /// Pixels that can be wrong.
    pub facing: usize,
}

impl Causes {
    /// Each cause's pixels as a share of those that can be wrong, 0 to 1.
    pub fn shares(&self) -> [f64; CAUSES.len()] {
        self.counts.map(|n| n as f64 / self.facing.max(1) as f64)
    }
}

/// Tells the causes of the wrong pixels apart. Arguments as for [`super::metrics::errors`]; `casters` has a number a
/// triangle, alike for those that hang together.
pub fn split(
    visibility: &[f32],
    hard: &[f32],
    mask: &[u32],
    evidence: &[Evidence],
    casters: &[u32],
    width: usize,
) -> Causes {
    let facing = |i: usize| mask[i] == FACING;
    let wrong = |i: usize| facing(i) && (visibility[i] >= 0.5) != (hard[i] >= 0.5);
    let caster = |i: usize| casters[evidence[i].triangle as usize] as usize;
    let all = 0..mask.len();
    // Pixels of each caster's true shadow, and those of them that are lit.
    let mut shadows = vec![[0u32; 2]; casters.iter().max().map_or(0, |c| *c as usize + 1)];
    for i in all.clone().filter(|i| facing(*i) && hard[*i] < 0.5 && evidence[*i].distance() > 0.0) {
        let shadow = &mut shadows[caster(i)];
        shadow[0] += 1;
        shadow[1] += wrong(i) as u32;
    }
    let missing = |i: usize| {
        let [pixels, lit] = shadows[caster(i)];
        evidence[i].blocked() && pixels >= MISSING_PIXELS && lit as f32 >= MISSING_SHARE * pixels as f32
    };
    // The true contour runs half a pixel before the nearest pixel of the other label.
    let to = [false, true].map(|lit| {
        let marked: Vec<bool> = all.clone().map(|i| facing(i) && (hard[i] >= 0.5) == lit).collect();
        distance_to(&marked, width)
    });
    let mut classes = vec![0; mask.len()];
    // Lit though in shadow, and no edge's: a gap or a leak.
    let mut open = vec![false; mask.len()];
    let mut gap = VecDeque::new();
    for i in all.clone().filter(|i| wrong(*i)) {
        let lit = hard[i] >= 0.5;
        let e = &evidence[i];
        let beside = lit && casters[e.own as usize] != casters[e.triangle as usize];
        let edge = e.edge == 1 || beside || to[!lit as usize][i] - 0.5 <= NEAR_PX;
        classes[i] = match (lit, edge) {
            (true, false) => ACNE,
            (true, true) => STAIRS,
            _ if missing(i) => MISSING,
            _ if e.blocked() && e.distance() < e.near => {
                gap.push_back(i);
                DETACHMENT
            }
            (false, true) => STAIRS,
            (false, false) => {
                open[i] = true;
                LEAK
            }
        };
    }
    // The gap goes on from the foot as far as the same caster's shadow is lit without a break.
    let height = mask.len() / width;
    let mut depths: Vec<f32> = Vec::new();
    while let Some(i) = gap.pop_front() {
        depths.push(evidence[i].distance());
        let (x, y) = (i % width, i / width);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for j in (x.saturating_sub(1)..(x + 2).min(width)).map(|x| y * width + x) {
                if open[j] && caster(j) == caster(i) {
                    open[j] = false;
                    classes[j] = DETACHMENT;
                    gap.push_back(j);
                }
            }
        }
    }
    // Elsewhere a foot may be hidden, or so deep a gap take the whole shadow.
    if !depths.is_empty() {
        depths.sort_unstable_by(f32::total_cmp);
        let depth = SPARE * quantile(&depths, 0.95);
        let in_gap = |i: usize| evidence[i].blocked() && evidence[i].distance() <= depth;
        // Of a caster that seems to be missing most of the shadow must lie so near.
        let mut eaten = vec![[0u32; 2]; shadows.len()];
        for i in all.clone().filter(|i| classes[*i] == MISSING) {
            eaten[caster(i)][in_gap(i) as usize] += 1;
        }
        for i in all.clone() {
            let gap = match classes[i] {
                MISSING => eaten[caster(i)][1] > eaten[caster(i)][0],
                LEAK => in_gap(i),
                _ => false,
            };
            if gap {
                classes[i] = DETACHMENT;
            }
        }
    }
    let mut counts = [0; CAUSES.len()];
    classes.iter().filter(|c| **c > 0).for_each(|c| counts[*c as usize - 1] += 1);
    let gaps = all.clone().filter(|i| classes[*i] == DETACHMENT).map(|i| evidence[i].distance()).collect();
    Causes { classes, counts, gaps, facing: all.filter(|i| facing(*i)).count() }
}
