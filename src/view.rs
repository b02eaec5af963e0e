//! What can be drawn of a frame.

use crate::params::{Group, Kind, Spec};
use crate::techniques::Info;
use anyhow::{Result, bail};

/// One way to look at a frame.
#[derive(Clone, Copy)]
pub struct View {
    pub id: &'static str,
    pub title: &'static str,
    /// What is seen, in a student's words.
    pub doc: &'static str,
    /// Needs the ray-traced truth.
    pub truth: bool,
}

const fn view(id: &'static str, title: &'static str, doc: &'static str, truth: bool) -> View {
    View { id, title, doc, truth }
}

/// The views that every technique has; a technique's own maps come on top ([`Info::maps`]).
pub const VIEWS: &[View] = &[
    view("shaded", "Shaded", "The lit picture with the technique's shadow.", false),
    view("split", "Split", "Left of the line the technique's shadow, right of it the exact one.", true),
    view("visibility", "Visibility", "How much of the light each pixel sees: white all of it, black none.", false),
    view(
        "truth",
        "Truth",
        "The exact visibility, ray traced: at the pixel's centre, or the mean over as many samples of the pixel as the \
         set-up names.",
        true,
    ),
    view(
        "error",
        "Error",
        "Blue: lit but should be in shadow. Red: in shadow but should be lit. The rest is right.",
        true,
    ),
    view(
        "acne",
        "Acne",
        "Only the false shadow, in yellow: what should be lit but is dark. Specks on lit faces are acne.",
        true,
    ),
    view(
        "detachment",
        "Detachment",
        "Only the missing shadow, in cyan: what should be dark but is lit. A gap at a caster's foot is detachment.",
        true,
    ),
    view(
        "facing",
        "Facing",
        "Green: the surface turns towards the light and can be wrong. Ochre: it does so outside the light's cone or \
         range. Grey: it turns away. Both are dark without any shadow technique.",
        false,
    ),
    view("normals", "Normals", "The surface's direction as a colour: x red, y green, z blue.", false),
    view("albedo", "Albedo", "The surface's own colour, without light.", false),
    view("depth", "Eye depth", "Distance from the camera along its axis, near dark, far bright.", false),
    view(
        "light-depth",
        "Light depth",
        "Distance from the light (along its rays for the sun), near dark, far bright.",
        false,
    ),
    view("position", "Position", "World position in metres, repeating every metre, as a colour.", false),
    view("triangles", "Triangles", "Each triangle in a colour of its own.", false),
];

/// The views' numbers for the shader: constants `view_shaded` and so on, and behind them `view_technique_map`.
pub const GROUP: Group = Group {
    name: "Views",
    specs: &[Spec { name: "view", ..Spec::blank("", Kind::Choice { default: "shaded", options: &IDS }) }],
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

/// Whether a view needs the truth.
pub fn needs_truth(id: &str) -> bool {
    VIEWS.iter().any(|v| v.id == id && v.truth)
}

/// The maps that show a channel of the analysis: the aliasing error and its two parts, in that order.
pub const ALIASING: [&str; 3] = ["aliasing", "perspective-aliasing", "projection-aliasing"];

/// Whether a map needs the frame's analysis, and nothing else of the technique.
pub fn needs_analysis(id: &str) -> bool {
    id == "counts" || ALIASING.contains(&id)
}

/// Refuses a view that the technique does not have.
pub fn check(id: &str, info: &Info) -> Result<()> {
    if index(id).is_none() && !info.maps().any(|m| m.id == id) {
        let all: Vec<&str> = VIEWS.iter().chain(info.maps()).map(|v| v.id).collect();
        bail!("view = {id} is unknown; {} has {}", info.id, all.join(", "));
    }
    Ok(())
}
