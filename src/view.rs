//! What can be drawn of a frame, and what its colours mean.

use crate::contact;
use crate::map::filter::Filter;
use crate::measure::Errors;
use crate::measure::causes::CAUSES;
use crate::palette::{CAUSE_COLORS, FALSE_SHADOW, GREY, LABELS, LEAK, Palette, RAMP, Rgb};
use crate::params::{self, Kind, Spec};
use crate::techniques::{self, Info};
use anyhow::{Result, bail};

/// One way to look at a frame.
#[derive(Clone, Copy)]
pub struct View {
    pub id: &'static str,
    pub title: &'static str,
    /// What is seen, in a student's words.
    pub doc: &'static str,
    pub source: Source,
    pub group: Group,
    pub drawn: Drawn,
}

/// What a view is made of, beside what every frame has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Nothing.
    Frame,
    /// The ray-traced truth.
    Truth,
    /// The truth, which the CPU judges; `analysed`: with what the analysis found.
    Judged { analysed: bool },
    /// What the technique's pass `inspect` writes.
    Technique,
    /// The frame's analysis, and nothing else of the technique.
    Analysis,
}

/// What views are listed under.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    Look,
    Errors,
    Map,
    Aliasing,
    Scene,
}

impl Group {
    /// Those that differ from technique to technique come last, so that the others keep their place.
    pub const ALL: [Group; 5] = [Group::Look, Group::Errors, Group::Scene, Group::Map, Group::Aliasing];

    pub fn title(self) -> &'static str {
        match self {
            Group::Look => "Look",
            Group::Errors => "Errors",
            Group::Map => "Maps",
            Group::Aliasing => "Aliasing",
            Group::Scene => "Scene data",
        }
    }
}

/// How a view is drawn, from which its legend follows.
#[derive(Clone, Copy, Debug)]
pub enum Drawn {
    /// By code of its own in `shaders/shade.wgsl`.
    Common(Legend),
    /// A depth map and its light view, fitted into the picture.
    Depth,
    /// Values of `map_out` from dark to bright; negative ones show the scene.
    Ramp(Values),
    /// Values of `map_out`, columns and rows of cells (`shaders/lib/cells.wgsl`): a chequerboard over the scene.
    Cells,
    /// A channel of the analysis, in octaves around 1.
    Aliasing(u32),
    /// Samples per texel, as `shaders/counts.wgsl` leaves them in `map_out`.
    Counts,
    /// Labels of `map_out` (`shaders/lib/labels.wgsl`): colours over the scene, or a drawing.
    Labels(Legend),
    /// Of contact shadows, by code of its own in `shaders/shade.wgsl`.
    Contact(Legend),
    /// Strokes of `map_out` in colours of the ramp (`shaders/diagram.wgsl`).
    Diagram(Legend),
}

/// The values that a scale runs over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    pub what: &'static str,
    /// Empty: a plain number.
    pub unit: &'static str,
    pub range: [f32; 2],
    /// By the logarithm of one more, so that counts of all sizes can be told apart.
    pub log: bool,
}

/// What the colours of a view mean.
#[derive(Clone, Copy, Debug)]
pub enum Legend {
    /// It is a picture: nothing to explain.
    None,
    Scale(Palette, Values),
    /// Octaves from 2⁻⁴ to 2⁴ in colours of their own, times the number.
    Octaves(&'static str, f32),
    /// Depth along the camera's axis, logarithmic; depth from the light. Their ranges follow from camera, scene and light.
    EyeDepth,
    LightDepth,
    Classes(&'static [Class]),
    /// A class for each cascade, with its range of depths.
    Cascades,
    /// A class for each face of a light's maps, with the pixels that it is looked up by and the triangles drawn into it.
    Faces,
    /// A chart: its axes, and what is drawn in it.
    Chart(Area, Axis, Axis, &'static [Class]),
    /// The upright plane through the camera's axis: distances along it, and the cascades.
    Side,
    /// Two squares beside each other, and what is drawn in them.
    Squares([&'static str; 2], &'static [Class]),
    /// The same with curves over places from 0 to 1: what runs along the squares, and what upwards.
    Curves([&'static str; 2], [&'static str; 2], &'static [Class]),
}

/// The squares of a map before and after its warp.
pub const BEFORE_AFTER: [&str; 2] = ["light's image before the warp", "map"];

/// The part of the picture that a chart takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// All but a twentieth at each side.
    Margins,
    /// The largest square in the middle, less a little.
    Square,
}

/// A colour and what it stands for.
#[derive(Clone, Copy, Debug)]
pub struct Class {
    pub color: Rgb,
    pub what: &'static str,
    /// Its share of the pixels that can be wrong, where that is counted.
    pub share: Option<fn(&Errors) -> Option<f64>>,
}

impl Class {
    pub const fn new(color: Rgb, what: &'static str) -> Class {
        Class { color, what, share: None }
    }

    /// One of the colours that the shaders' labels have.
    pub const fn label(i: usize, what: &'static str) -> Class {
        Class::new(LABELS[i], what)
    }
}

/// An axis of a chart that is drawn into the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    pub what: &'static str,
    pub span: Span,
}

/// The values along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Span {
    /// From the one to the other.
    Linear(f32, f32),
    /// As far as 1; marks stand at the squares of even places.
    Root,
    /// Logarithmic between the first and the last split, metres.
    Splits,
    /// None, 1, and on in half octaves, so many bins.
    HalfOctaves(u32),
    /// Logarithmic around 1, so many octaves down and up.
    Octaves(i32),
    /// Faces of a light's maps, from the first to the last.
    Faces,
}

const fn common(
    id: &'static str,
    title: &'static str,
    group: Group,
    doc: &'static str,
    source: Source,
    legend: Legend,
) -> View {
    View { id, title, doc, source, group, drawn: Drawn::Common(legend) }
}

/// A map of a technique's own.
pub const fn map(id: &'static str, title: &'static str, doc: &'static str, drawn: Drawn) -> View {
    let source = if let Drawn::Aliasing(_) = drawn { Source::Analysis } else { Source::Technique };
    View { id, title, doc, source, group: Group::Map, drawn }
}

pub const VISIBILITY: Legend =
    Legend::Scale(GREY, Values { what: "visibility", unit: "", range: [0.0, 1.0], log: false });
const AXES: Legend = Legend::Classes(&[
    Class::new([1.0, 0.35, 0.3], "x"),
    Class::new([0.35, 0.9, 0.35], "y (up)"),
    Class::new([0.4, 0.5, 1.0], "z"),
]);

/// A view of how a technique's map meets the pixels.
pub const fn aliasing(id: &'static str, title: &'static str, doc: &'static str, drawn: Drawn) -> View {
    View { group: Group::Aliasing, ..map(id, title, doc, drawn) }
}

const fn cause(i: usize) -> Class {
    Class::new(CAUSE_COLORS[i], CAUSES[i].title)
}

fn caused(errors: &Errors, cause: usize) -> Option<f64> {
    Some(errors.causes?[cause] as f64 / errors.facing.max(1) as f64)
}

/// The views that every technique has; a technique's own maps come on top ([`Info::views`]).
pub const VIEWS: &[View] = &[
    common(
        "shaded",
        "Shaded",
        Group::Look,
        "The lit picture with the technique's shadow.",
        Source::Frame,
        Legend::None,
    ),
    common(
        "visibility",
        "Visibility",
        Group::Look,
        "How much of the light each pixel sees: white all of it, black none.",
        Source::Frame,
        VISIBILITY,
    ),
    common(
        "truth",
        "Truth",
        Group::Look,
        "The exact visibility, ray traced: at the pixel's centre, or the mean over as many samples of the pixel as the \
         set-up names.",
        Source::Truth,
        VISIBILITY,
    ),
    common(
        "error",
        "Error",
        Group::Errors,
        "Blue: lit but should be in shadow. Red: in shadow but should be lit. The rest is right.",
        Source::Truth,
        Legend::Classes(&[
            Class {
                color: LEAK,
                what: "lit, should be in shadow",
                share: Some(|e| Some(e.lit_incorrect as f64 / e.facing.max(1) as f64)),
            },
            Class {
                color: FALSE_SHADOW,
                what: "in shadow, should be lit",
                share: Some(|e| Some(e.shadow_incorrect as f64 / e.facing.max(1) as f64)),
            },
        ]),
    ),
    common(
        "difference",
        "Difference",
        Group::Errors,
        "Visibility of the first technique minus that of the second one it is compared with, or minus the truth where there \
         is no second. Blue: darker. Orange: brighter.",
        Source::Truth,
        Legend::Scale(
            crate::palette::DIVERGING,
            Values { what: "visibility, first minus second or truth", unit: "", range: [-1.0, 1.0], log: false },
        ),
    ),
    common(
        "causes",
        "Causes",
        Group::Errors,
        "What made each wrong pixel: acne, detachment (a gap at a caster's foot), a leak, a missing caster, or stairs at a \
         shadow's edge.",
        Source::Judged { analysed: true },
        Legend::Classes(&[
            Class { share: Some(|e| caused(e, 0)), ..cause(0) },
            Class { share: Some(|e| caused(e, 1)), ..cause(1) },
            Class { share: Some(|e| caused(e, 2)), ..cause(2) },
            Class { share: Some(|e| caused(e, 3)), ..cause(3) },
            Class { share: Some(|e| caused(e, 4)), ..cause(4) },
        ]),
    ),
    common(
        "error-density",
        "Error density",
        Group::Errors,
        "Share of wrong pixels among those that can be wrong, in a window around each pixel.",
        Source::Judged { analysed: false },
        Legend::Scale(RAMP, Values { what: "wrong pixels in the window", unit: "%", range: [0.0, 50.0], log: false }),
    ),
    common(
        "error-size",
        "Error size",
        Group::Errors,
        "How far visibility is off at each pixel: |V − truth|.",
        Source::Truth,
        Legend::Scale(RAMP, Values { what: "|V − truth|", unit: "", range: [0.0, 1.0], log: false }),
    ),
    common(
        "flip",
        "FLIP",
        Group::Errors,
        "How much a viewer notices when the shaded picture and the one with the true shadow alternate.",
        Source::Judged { analysed: false },
        Legend::Scale(RAMP, Values { what: "FLIP difference", unit: "", range: [0.0, 1.0], log: false }),
    ),
    common(
        "facing",
        "Facing",
        Group::Scene,
        "Green: the surface turns towards the light and can be wrong. Ochre: it does so outside the light's cone or \
         range. Grey: it turns away. Both are dark without any shadow technique.",
        Source::Frame,
        Legend::Classes(&[
            Class::new([0.45, 0.75, 0.45], "faces the light"),
            Class::new([0.60, 0.48, 0.25], "outside its cone or range"),
            Class::new([0.35; 3], "turned away"),
        ]),
    ),
    common(
        "normals",
        "Normals",
        Group::Scene,
        "The surface's direction as a colour: x red, y green, z blue.",
        Source::Frame,
        AXES,
    ),
    common("albedo", "Albedo", Group::Scene, "The surface's own colour, without light.", Source::Frame, Legend::None),
    common(
        "depth",
        "Eye depth",
        Group::Scene,
        "Distance from the camera along its axis, near dark, far bright.",
        Source::Frame,
        Legend::EyeDepth,
    ),
    common(
        "light-depth",
        "Light depth",
        Group::Scene,
        "Distance from the light (along its rays for the sun), near dark, far bright.",
        Source::Frame,
        Legend::LightDepth,
    ),
    common(
        "position",
        "Position",
        Group::Scene,
        "World position in metres, repeating every metre, as a colour.",
        Source::Frame,
        AXES,
    ),
    common(
        "triangles",
        "Triangles",
        Group::Scene,
        "Each triangle in a colour of its own.",
        Source::Frame,
        Legend::None,
    ),
];

/// The views' numbers for the shader: constants `view_shaded` and so on, and behind them `view_technique_map`.
pub const GROUP: params::Group = params::Group {
    name: "Views",
    specs: &[Spec { name: "view", ..Spec::blank("", Kind::Choice { default: "shaded", options: &IDS }) }],
    when: None,
};

const IDS: [&str; VIEWS.len() + 1] = {
    let mut ids = ["technique-map"; VIEWS.len() + 1];
    let mut i = 0;
    while i < VIEWS.len() {
        ids[i] = VIEWS[i].id;
        i += 1;
    }
    ids
};

/// Index of a view that every technique has, as the shader numbers it.
pub fn index(id: &str) -> Option<usize> {
    VIEWS.iter().position(|v| v.id == id)
}

/// A view of this technique with these values.
pub fn find(id: &str, info: &Info, values: &params::Values) -> Option<&'static View> {
    VIEWS.iter().chain(info.views(values)).find(|v| v.id == id)
}

/// Whether a view needs the truth.
pub fn needs_truth(id: &str) -> bool {
    VIEWS.iter().chain(contact::VIEWS).any(|v| v.id == id && v.needs_truth())
}

/// Refuses a view that the technique does not have.
pub fn check(id: &str, info: &Info, values: &params::Values) -> Result<()> {
    if find(id, info, values).is_none() {
        let of = |f: &&&'static Filter| f.views.iter().any(|v| v.id == id);
        if let Some(filter) = techniques::FILTERS.iter().find(of).filter(|_| info.all_views().any(|v| v.id == id)) {
            bail!("view = {id} needs filter = {}", filter.id);
        }
        if contact::VIEWS.iter().any(|v| v.id == id) {
            bail!("view = {id} needs contact = march or contact = sweep");
        }
        let all: Vec<&str> = VIEWS.iter().chain(info.views(values)).map(|v| v.id).collect();
        bail!("view = {id} is unknown; {} has {}", info.id, all.join(", "));
    }
    Ok(())
}

impl View {
    /// It needs the ray-traced truth.
    pub fn needs_truth(&self) -> bool {
        self.source == Source::Truth || self.is_judged()
    }

    /// It needs the frame's analysis.
    pub fn needs_analysis(&self) -> bool {
        matches!(self.source, Source::Analysis | Source::Judged { analysed: true })
    }

    /// The CPU makes its values.
    pub fn is_judged(&self) -> bool {
        matches!(self.source, Source::Judged { .. })
    }

    /// It counts the picture's pixels, as charts do too: at fewer of them it would tell something else.
    pub fn counts_pixels(&self) -> bool {
        let counts = matches!(self.drawn, Drawn::Counts | Drawn::Labels(Legend::Chart(..) | Legend::Curves(..)));
        counts || self.is_judged()
    }

    /// It is a picture of light and surfaces, whose pixels may be averaged.
    pub fn is_picture(&self) -> bool {
        ["shaded", "albedo"].contains(&self.id)
    }

    /// It says of surfaces what holds there at any number of pixels: laid over a picture, it leaves one.
    pub fn lies_on_surfaces(&self) -> bool {
        let lies = match self.drawn {
            Drawn::Common(_) | Drawn::Cells | Drawn::Contact(_) => true,
            // The tap pattern is a ramp that is no picture of the scene.
            Drawn::Ramp(_) => self.id != "taps",
            Drawn::Labels(legend) => {
                matches!(legend, Legend::None | Legend::Classes(_) | Legend::Cascades | Legend::Faces)
            }
            Drawn::Depth | Drawn::Aliasing(_) | Drawn::Counts | Drawn::Diagram(_) => false,
        };
        lies && !self.counts_pixels()
    }

    /// It is drawn over the scene: what stands there can be pointed at.
    pub fn shows_scene(&self) -> bool {
        !matches!(self.drawn, Drawn::Depth | Drawn::Counts | Drawn::Labels(Legend::Chart(..)))
    }
}

/// The ramp over these values.
pub const fn ramp(what: &'static str, unit: &'static str, range: [f32; 2]) -> Drawn {
    Drawn::Ramp(Values { what, unit, range, log: false })
}

/// The ramp over counts, up to so many.
pub const fn counts(what: &'static str, most: f32) -> Drawn {
    Drawn::Ramp(Values { what, unit: "", range: [0.0, most], log: true })
}

const CELLS: &[Class] = &[
    Class::new([0.25, 0.45, 0.75], "a texel"),
    Class::new([0.95, 0.75, 0.35], "the next one; faded where about a pixel wide"),
];

impl Drawn {
    /// The scale that explains its colours, if it is one.
    pub fn legend(&self) -> Legend {
        match self {
            Drawn::Common(legend) | Drawn::Labels(legend) | Drawn::Contact(legend) | Drawn::Diagram(legend) => *legend,
            Drawn::Ramp(values) => Legend::Scale(RAMP, *values),
            Drawn::Depth => Legend::Scale(
                GREY,
                Values { what: "depth along the light's axis", unit: "far … near", range: [0.0, 1.0], log: false },
            ),
            Drawn::Cells => Legend::Classes(CELLS),
            Drawn::Aliasing(_) => Legend::Octaves("aliasing error, pixels per texel", 1.0),
            // A texel with n samples is about √n pixels wide.
            Drawn::Counts => Legend::Octaves("samples per texel", 2.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// What a view needs follows from its declaration.
    #[test]
    fn views_tell_what_they_need() {
        let ids = |needs: fn(&View) -> bool| {
            let maps = techniques::ALL.iter().flat_map(|info| info.all_views());
            let all: BTreeSet<&str> = VIEWS.iter().chain(maps).filter(|v| needs(v)).map(|v| v.id).collect();
            Vec::from_iter(all).join(" ")
        };
        assert_eq!(
            ids(View::needs_truth),
            "causes contact-gain contact-hits difference error error-density error-size flip truth"
        );
        assert_eq!(ids(View::needs_analysis), "aliasing causes counts perspective-aliasing projection-aliasing");
        assert_eq!(ids(View::is_judged), "causes error-density flip");
        let counts = "causes counts counts-before counts-between curve energy error-density face-load \
             flip histogram light-cells light-samples occupancy profiles texel-angle texel-rectangles";
        assert_eq!(ids(View::counts_pixels), counts);
    }
}
