//! The figures of a frame on a path, each a line over it.

use super::stability::Point;

/// What can be charted along a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Figure {
    #[default]
    Error,
    Flicker,
    Passes,
    Layers,
    Triangles,
    Time,
}

impl Figure {
    pub const ALL: [Figure; 6] =
        [Figure::Error, Figure::Flicker, Figure::Passes, Figure::Layers, Figure::Triangles, Figure::Time];

    /// A word for it; also part of the names of files.
    pub fn name(self) -> &'static str {
        match self {
            Figure::Error => "error",
            Figure::Flicker => "flicker",
            Figure::Passes => "passes",
            Figure::Layers => "layers",
            Figure::Triangles => "triangles",
            Figure::Time => "time",
        }
    }

    /// The unit of its numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Figure::Error | Figure::Flicker => "%",
            Figure::Passes | Figure::Layers | Figure::Triangles => "",
            Figure::Time => "ms",
        }
    }

    /// What it says, a sentence.
    pub fn doc(self) -> &'static str {
        match self {
            Figure::Error => "Wrong pixels as a share of those that face the light, within its cone and range.",
            Figure::Flicker => {
                "How much visibility changes between neighbouring frames beyond the truth's change: mean over the pixels seen \
                 in both."
            }
            Figure::Passes => "Passes that the technique records for a frame.",
            Figure::Layers => {
                "Layers of depth maps (cascades, faces, sides) into which at least one triangle is drawn."
            }
            Figure::Triangles => "Triangles drawn into the maps, all layers together.",
            Figure::Time => "Milliseconds of the technique's passes: the median of three frames.",
        }
    }

    /// The heading of its axis, with the unit.
    pub fn axis(self, software: bool) -> &'static str {
        match self {
            Figure::Error => "wrong pixels, % of those facing the light",
            Figure::Flicker => "flicker, mean change per frame beyond the truth's, %",
            Figure::Passes => "passes per frame",
            Figure::Layers => "layers with a triangle drawn",
            Figure::Triangles => "triangles drawn into maps",
            Figure::Time if software => "technique, ms (software: compare as ratios only)",
            Figure::Time => "technique, ms",
        }
    }

    /// Whether it is there only where costs were asked for.
    pub fn is_cost(self) -> bool {
        !matches!(self, Figure::Error | Figure::Flicker)
    }

    /// Its number in a frame, in its unit. None: not known there.
    pub fn of(self, p: &Point) -> Option<f64> {
        match self {
            Figure::Error => Some(100.0 * p.error_share),
            Figure::Flicker => p.flicker().map(|f| 100.0 * f),
            Figure::Passes => p.cost.map(|c| c.passes.into()),
            Figure::Layers => p.cost?.layers.map(|l| l.layers_drawn.into()),
            Figure::Triangles => p.cost?.triangles.map(|n| n as f64),
            Figure::Time => p.cost.map(|c| c.ms),
        }
    }
}
