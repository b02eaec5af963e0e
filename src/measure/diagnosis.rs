//! Why a pixel is wrong: the artefact that its numbers speak of, what they are, and which parameters would help.
//!
//! Nothing is told from the technique's name. What decides is, in this order: what rays say of the pixel and how far it is to the
//! true edge; what the map's texels around it hold, beside the surface's own plane and the true blocker; what the look-up compared
//! them with; and how visibility runs over the pixels around.

use super::causes::{ACNE, DETACHMENT, LEAK, MISSING};
use super::metrics::{FACING, TOLERANCE};
use super::softness;
use super::story::{Seen, metres, step};
use crate::chart::digits;
use crate::frame::{Ask, Looked, Renderer, TAPS, pixel_at};
use crate::params::{Kind, Spec, Value};
use crate::setup::Setup;
use crate::techniques::{self, Info};
use anyhow::Result;
use serde::Serialize;

/// A kind of error that has a name.
#[derive(Debug, PartialEq)]
pub struct Artefact {
    pub id: &'static str,
    pub title: &'static str,
    pub doc: &'static str,
    /// Parameters that help, by what they mean, the likeliest first.
    remedies: &'static [(&'static str, Change)],
}

/// How a parameter is changed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    Times(f64),
    Plus(f64),
    /// A flag, or an option of a choice.
    On,
    Off,
    Take(&'static str),
}

use Change::{Off, On, Plus, Take, Times};

/// All of them.
pub static ARTEFACTS: [Artefact; 17] = [
    Artefact {
        id: "acne",
        title: "acne",
        doc: "The surface shadows itself: what its texels hold is its own plane, met elsewhere within the texel.",
        remedies: &[
            ("slope_limit", Times(4.0)),
            ("slope_bias", Plus(0.75)),
            ("bias_kind", Take("slope")),
            ("bias_kind", Take("ray-plane")),
            ("bias", Times(4.0)),
            ("epsilon", Times(4.0)),
            ("normal_offset", Plus(1.0)),
            ("self_plane", On),
        ],
    },
    Artefact {
        id: "precision",
        title: "depth precision",
        doc: "Depths that the map's format cannot tell apart decide.",
        remedies: &[("format", Take("32f")), ("precision", Take("32")), ("near", Times(4.0)), ("bias", Times(4.0))],
    },
    Artefact {
        id: "detachment",
        title: "detachment (peter-panning)",
        doc: "The map holds the blocker, but the comparison was moved beyond it towards the light.",
        remedies: &[
            ("bias", Times(0.25)),
            ("slope_bias", Times(0.5)),
            ("normal_offset", Times(0.5)),
            ("epsilon", Times(0.25)),
            ("dual_limit", Times(0.5)),
            ("resolution", Times(2.0)),
            ("contact", Take("march")),
        ],
    },
    Artefact {
        id: "leak",
        title: "light leak",
        doc: "The filter's taps reach past a blocker that is narrower than they are wide.",
        remedies: &[
            ("kernel", Plus(-2.0)),
            ("radius", Times(0.5)),
            ("blur_radius", Times(0.5)),
            ("resolution", Times(2.0)),
        ],
    },
    Artefact {
        id: "bleeding",
        title: "light bleeding",
        doc: "The map's depths say dark, yet what was reconstructed of their distribution says lit.",
        remedies: &[
            ("bleed_reduction", Plus(0.2)),
            ("soft_bleeding", Plus(0.2)),
            ("exponent", Times(1.5)),
            ("far_exponent", Times(1.5)),
            ("terms", Times(2.0)),
            ("blur_radius", Times(0.5)),
            ("resolution", Times(2.0)),
        ],
    },
    Artefact {
        id: "stairs",
        title: "stairs",
        doc: "The true edge runs through the texel, or the next one: it is as coarse as the map.",
        remedies: &[
            ("resolution", Times(2.0)),
            ("cascades", Plus(1.0)),
            ("lambda", Plus(0.2)),
            ("fit", Take("receivers")),
            ("crop", Take("dv")),
            ("filter", Take("pcf")),
        ],
    },
    Artefact {
        id: "thin-caster",
        title: "caster thinner than a texel",
        doc: "The true shadow is narrower than a texel: what casts it is met by chance, and then drawn a texel wide, or lost.",
        remedies: &[
            ("resolution", Times(2.0)),
            ("cascades", Plus(1.0)),
            ("lambda", Plus(0.2)),
            ("window", Plus(1.0)),
            ("fit", Take("receivers")),
        ],
    },
    Artefact {
        id: "missing-caster",
        title: "missing caster",
        doc: "No texel around holds the blocker, though its shadow is wider than they are: it was not drawn, clipped, or drawn elsewhere.",
        remedies: &[
            ("culling", Take("none")),
            ("cull", Take("none")),
            ("casters", Take("both")),
            ("push_near", On),
            ("depths", Take("scene")),
            ("fit", Take("scene")),
            ("raster", Take("exact")),
            ("resolution", Times(2.0)),
        ],
    },
    Artefact {
        id: "outside-map",
        title: "outside the map",
        doc: "The surface lies beside the map: nothing says what hides the light.",
        remedies: &[
            ("fit", Take("receivers")),
            ("range", Take("scene")),
            ("distance", Times(2.0)),
            ("widest", Plus(20.0)),
        ],
    },
    Artefact {
        id: "misplaced",
        title: "misplaced caster",
        doc: "The texels hold a blocker whose true shadow does not fall near: the map shows it elsewhere than rays do.",
        remedies: &[
            ("raster", Take("exact")),
            ("tolerance", Times(0.5)),
            ("strength", Times(0.5)),
            ("stored", Take("nearest")),
            ("resolution", Times(2.0)),
        ],
    },
    Artefact {
        id: "blur-wide",
        title: "penumbra too wide",
        doc: "Visibility changes over more pixels than the truth does.",
        remedies: &[
            ("kernel", Plus(-2.0)),
            ("radius", Times(0.5)),
            ("blur_radius", Times(0.5)),
            ("blur", Times(0.5)),
            ("softness", Times(0.5)),
            ("passes", Plus(-1.0)),
            ("resolution", Times(2.0)),
        ],
    },
    Artefact {
        id: "blur-narrow",
        title: "penumbra too narrow",
        doc: "Visibility changes over fewer pixels than the truth does.",
        remedies: &[
            ("filter", Take("pcss")),
            ("max_radius", Times(2.0)),
            ("search_taps", Times(2.0)),
            ("kernel", Plus(2.0)),
            ("radius", Times(2.0)),
            ("blur_radius", Times(2.0)),
            ("softness", Plus(1.0)),
        ],
    },
    Artefact {
        id: "penumbra-off",
        title: "penumbra misplaced",
        doc: "As wide as the true one, but lighter or darker: of the light's places others are taken to be hidden.",
        remedies: &[
            ("side", Plus(2.0)),
            ("gap_fill", On),
            ("maps", Take("4")),
            ("filter_taps", Times(2.0)),
            ("max_radius", Times(2.0)),
            ("resolution", Times(2.0)),
        ],
    },
    Artefact {
        id: "noise",
        title: "noise",
        doc: "Visibility is off by amounts that neighbouring pixels do not share.",
        remedies: &[
            ("samples", Times(4.0)),
            ("filter_taps", Times(2.0)),
            ("search_taps", Times(2.0)),
            ("rays", Times(2.0)),
            ("accumulate", Times(8.0)),
            ("passes", Plus(1.0)),
            ("rotate", Off),
        ],
    },
    Artefact {
        id: "banding",
        title: "banding",
        doc: "A few levels stand where the truth runs evenly: too few samples.",
        remedies: &[
            ("side", Plus(2.0)),
            ("samples", Times(4.0)),
            ("filter_taps", Times(2.0)),
            ("side_2", Plus(2.0)),
            ("side_3", Plus(2.0)),
            ("gap", Times(0.5)),
            ("rotate", On),
        ],
    },
    Artefact {
        id: "lag",
        title: "temporal lag",
        doc: "The light is averaged over frames of which some are still to come, or come from before something moved.",
        remedies: &[
            ("clamp_history", On),
            ("blend_factor", Times(2.0)),
            ("min_blend", Times(2.0)),
            ("history", Off),
            ("accumulate", Times(0.5)),
        ],
    },
    Artefact {
        id: "seam",
        title: "seam between maps",
        doc: "Two maps overlap here and say different things.",
        remedies: &[("blend", Plus(0.1)), ("resolution", Times(2.0)), ("cascades", Plus(1.0)), ("focus", Off)],
    },
];

/// An artefact by its id.
pub fn find(id: &str) -> Option<&'static Artefact> {
    ARTEFACTS.iter().find(|a| a.id == id)
}

/// A change of a parameter that would help.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remedy {
    pub name: &'static str,
    pub from: Value,
    pub to: Value,
    /// Its unit, for words.
    pub unit: &'static str,
}

impl Remedy {
    pub fn text(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        format!("{}: {} → {}{unit}", self.name, plain(&self.from), plain(&self.to))
    }

    /// The set-up with it applied to its technique.
    pub fn applied(&self, setup: &Setup) -> Setup {
        let mut setup = setup.clone();
        setup.params.entry(setup.technique.clone()).or_default().insert(self.name.into(), self.to.clone());
        setup
    }
}

/// A value in words; numbers to three digits.
pub fn plain(value: &Value) -> String {
    match value {
        Value::Float(v) => digits(*v),
        other => other.to_string(),
    }
}

/// The likely artefact of a wrong pixel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The id of one of [`ARTEFACTS`].
    pub artefact: &'static str,
    pub title: &'static str,
    pub doc: &'static str,
    /// What speaks for it, sentences with numbers.
    pub because: Vec<String>,
    pub remedies: Vec<Remedy>,
}

impl Diagnosis {
    pub fn text(&self) -> String {
        let mut out = format!("Why it is wrong: {}. {}\n", self.title, self.doc);
        self.because.iter().for_each(|b| out += &format!("  {b}\n"));
        if !self.remedies.is_empty() {
            out += "What would help\n";
            self.remedies.iter().for_each(|r| out += &format!("  {}\n", r.text()));
        }
        out
    }
}

/// Most remedies that are named.
const MOST: usize = 3;
/// Texels from the true edge within which an error is the edge's.
const NEAR: f32 = 1.5;
/// Texels of 3 × 3 that a caster thinner than one is met in, at most.
const FEW: usize = 3;
/// Pixels around that show how visibility runs.
const AROUND: i32 = 4;

fn n(x: f32) -> String {
    digits(x.into()).replace('-', "−")
}

/// What the taps around a pixel hold.
struct Taps<'a> {
    looked: &'a Looked,
    /// Depth towards the light at which the blocker that rays find lies before the surface's plane; none of lit pixels.
    gap: Option<f32>,
    /// How far off the surface's plane what is held may lie to be the surface itself.
    own: f32,
    step: f32,
}

impl Taps<'_> {
    const MIDDLE: usize = TAPS * TAPS / 2;

    /// Whether a tap is within so many texels, along the longer side.
    fn within(&self, i: usize, reach: f32) -> bool {
        let away = |k: usize| (k as f32 - (TAPS / 2) as f32).abs() * self.looked.spread;
        away(i % TAPS).max(away(i / TAPS)) <= reach + 0.01
    }

    fn held(&self, i: usize) -> bool {
        self.looked.taps[i].w == 1.0
    }

    /// The comparison says shadow.
    fn dark(&self, i: usize) -> bool {
        let t = self.looked.taps[i];
        self.held(i) && t.y > t.x
    }

    /// What is held is the surface itself: its own plane, within what a texel and its slope leave open.
    fn is_own(&self, i: usize) -> bool {
        let t = self.looked.taps[i];
        self.held(i) && (t.z - t.x).abs() <= self.own
    }

    /// It is something at least half as far before the surface's plane as the true blocker.
    fn holds_blocker(&self, i: usize) -> bool {
        let t = self.looked.taps[i];
        self.held(i) && self.gap.is_some_and(|gap| t.x < t.z - 0.5 * gap)
    }

    fn count(&self, reach: f32, of: impl Fn(&Self, usize) -> bool) -> (usize, usize) {
        let all: Vec<usize> = (0..TAPS * TAPS).filter(|i| self.within(*i, reach)).collect();
        (all.iter().filter(|i| of(self, **i)).count(), all.len())
    }
}

/// A pixel whose error is looked into.
struct Patient<'a> {
    setup: &'a Setup,
    info: &'static Info,
    seen: &'a Seen,
    i: usize,
    looked: Option<&'a Looked>,
    frames: [u32; 2],
    /// What the technique is held against there, and by how much it is off.
    truth: f32,
    off: f32,
    because: Vec<String>,
}

/// Names the likely artefact of a pixel; None where nothing is wrong. `looked`: what the technique's look-up did there; `frames`:
/// of how many the light is averaged, and of how many it is to be.
pub fn diagnose(setup: &Setup, seen: &Seen, i: usize, looked: Option<&Looked>, frames: [u32; 2]) -> Option<Diagnosis> {
    let p = &seen.pixels;
    let info = techniques::find(&setup.technique).filter(|_| p.mask[i] == FACING)?;
    let soft = info.filters(setup.values()) || setup.light.has_size();
    let truth = if soft { p.mean[i] } else { p.hard[i] };
    let off = p.visibility[i] - truth;
    if !seen.wrong(i) && off.abs() <= TOLERANCE {
        return None;
    }
    let mut patient = Patient { setup, info, seen, i, looked, frames, truth, off, because: Vec::new() };
    let artefact = find(patient.name())?;
    let remedies = patient.remedies(artefact);
    let Artefact { id, title, doc, .. } = artefact;
    Some(Diagnosis { artefact: id, title, doc, because: patient.because, remedies })
}

impl Patient<'_> {
    fn say(&mut self, text: String) {
        self.because.push(text);
    }

    /// The artefact's id, with what speaks for it said.
    fn name(&mut self) -> &'static str {
        let p = &self.seen.pixels;
        let told = format!("Visibility is {}, truth {}", n(p.visibility[self.i]), n(self.truth));
        let [averaged, wanted] = self.frames;
        if averaged < wanted {
            self.say(format!("{told}; {averaged} of {wanted} frames are averaged so far."));
            return "lag";
        }
        let looked = self.looked;
        if let Some(l) = looked.filter(|l| l.share > 0.0 && (l.lit - l.lit_next).abs() > 0.5) {
            self.say(format!(
                "{told}: map {} says {}, map {}, which takes over by {:.0} %, says {}.",
                l.layer,
                n(l.lit),
                l.next,
                100.0 * l.share,
                n(l.lit_next)
            ));
            return "seam";
        }
        self.say(format!("{told}."));
        if let Some(named) = self.soft() {
            return named;
        }
        let found = match looked {
            Some(l) if l.outside == 1 => {
                self.say(format!("It lies at texel {}, {} of a map of {}.", n(l.looked.x), n(l.looked.y), n(l.side)));
                "outside-map"
            }
            Some(l) if self.off < 0.0 => self.false_shadow(l),
            Some(l) => self.missing_shadow(l),
            None => self.by_cause(),
        };
        if found == "stairs" || found == "thin-caster" {
            self.say_aliasing();
        }
        found
    }

    /// Pixels to the true edge, and the same in texels.
    fn edge(&self) -> (f32, f32) {
        let other = (self.seen.pixels.hard[self.i] < 0.5) as usize;
        let px = (self.seen.to[other][self.i] - 0.5).max(0.0);
        (px, px / self.texel())
    }

    /// Longest extent of a texel in the picture, pixels; 1 where there is none.
    fn texel(&self) -> f32 {
        self.seen.aliasing.get(self.i).map_or(1.0, |a| if a[0] > 0.0 { a[0] } else { 1.0 })
    }

    fn say_aliasing(&mut self) {
        let Some([m, perspective, projection, _]) = self.seen.aliasing.get(self.i).copied().filter(|a| a[0] > 0.0)
        else {
            return;
        };
        let most = if perspective >= projection { "perspective aliasing" } else { "projection aliasing" };
        let which = if m > 1.0 { format!(", mostly {most}") } else { String::new() };
        self.say(format!(
            "A texel is up to {} pixels long here: perspective {} × projection {}{which}.",
            n(m),
            n(perspective),
            n(projection)
        ));
    }

    /// Whether the truth's edge is near: within two pixels, or as many texels as edges are blurred by.
    fn near_edge(&self) -> bool {
        let (px, texels) = self.edge();
        px <= 2.0 || texels <= NEAR || self.seen.evidence[self.i].edge == 1
    }

    fn say_edge(&mut self) {
        let (px, texels) = self.edge();
        let told = match px.is_finite() {
            true if self.looked.is_some() => format!("The true edge is {} pixels away, {} texels.", n(px), n(texels)),
            true => format!("The true edge is {} pixels away.", n(px)),
            false => "There is no true edge in the picture.".into(),
        };
        self.say(told);
    }

    fn taps<'l>(&self, looked: &'l Looked) -> Taps<'l> {
        let e = &self.seen.evidence[self.i];
        let dark = self.seen.pixels.hard[self.i] < 0.5 && e.blocked();
        let gap = dark.then(|| e.distance() * looked.fall);
        let step = step(looked, self.setup);
        let slope = looked.slope.x.abs() + looked.slope.y.abs();
        Taps { looked, gap, own: 0.05 * slope + 0.1 * looked.texel_size + 4.0 * step, step }
    }

    /// Dark though lit.
    fn false_shadow(&mut self, l: &Looked) -> &'static str {
        let taps = self.taps(l);
        let (dark, all) = taps.count(l.radius, Taps::dark);
        let (own, _) = taps.count(l.radius, |t, i| t.dark(i) && t.is_own(i));
        let middle = l.taps[Taps::MIDDLE];
        let slope = l.slope.x.abs() + l.slope.y.abs();
        if dark > 0 && 2 * own >= dark {
            self.say(format!(
                "{own} of {dark} texels that shadow it hold its own surface: the middle one lies {} off its plane, of which a texel spans {}.",
                metres((middle.z - middle.x).abs()),
                metres(slope)
            ));
            self.say(format!("The comparison is moved by {} towards the light.", metres(l.bias.element_sum())));
            if taps.step > 0.7 * slope.max(1e-9) && taps.step > l.bias.element_sum() {
                self.say(format!("Depth is told apart in steps of {}.", metres(taps.step)));
                return "precision";
            }
            return "acne";
        }
        let (_, texels) = self.edge();
        if dark > 0 {
            let there = if taps.held(Taps::MIDDLE) {
                format!(", the middle one {} before its plane", metres(middle.z - middle.x))
            } else {
                String::new()
            };
            self.say(format!("{dark} of {all} texels in reach hold another surface before it{there}."));
        } else {
            self.say(format!("None of {all} texels in reach shadows it alone."));
        }
        // A row of texels that a thin caster was met in by chance.
        let (hits, _) = taps.count(l.spread, |t, i| t.dark(i) && !t.is_own(i));
        if l.radius <= 1.0 && hits <= FEW && self.near_edge() && self.is_thin() {
            return "thin-caster";
        }
        self.say_edge();
        match () {
            _ if l.radius > NEAR && texels <= l.radius && self.mixed(dark, all) => "blur-wide",
            _ if self.near_edge() && self.seen.wrong(self.i) => "stairs",
            _ if self.near_edge() || texels <= l.radius + NEAR || dark == 0 => "blur-wide",
            _ => "misplaced",
        }
    }

    /// Some of a filter's texels see the light, and some do not.
    fn mixed(&mut self, dark: usize, all: usize) -> bool {
        let mixed = 10 * dark > all && 10 * dark < 9 * all;
        if mixed {
            self.say(format!("The filter takes their mean: {} of the light.", n(1.0 - dark as f32 / all as f32)));
        }
        mixed
    }

    /// Whether the true shadow is narrower than the texel's shorter side, here or at the nearest pixel that is truly dark; if so it is said.
    fn is_thin(&mut self) -> bool {
        let seen = self.seen;
        let reach = (seen.to[0][self.i].min(48.0)).ceil() as i32;
        let dark = self.around(reach).filter(|j| seen.pixels.hard[*j] < 0.5);
        let [x, y] = seen.pixel(self.i).map(|c| c as i32);
        let away = |j: &usize| {
            let [u, v] = seen.pixel(*j).map(|c| c as i32);
            (u - x).pow(2) + (v - y).pow(2)
        };
        let Some(nearest) = dark.min_by_key(away) else { return false };
        let width = self.shadow_width(nearest);
        let [longest, area] = seen.aliasing.get(self.i).map_or([1.0; 2], |a| [a[0], a[3]]);
        let shorter = if longest > 0.0 { area / longest } else { 1.0 };
        let thin = width < shorter;
        if thin {
            self.say(format!(
                "The true shadow is {} pixels wide, the texel {}: it is met by chance.",
                n(width),
                n(shorter)
            ));
        }
        thin
    }

    /// Lit though in shadow.
    fn missing_shadow(&mut self, l: &Looked) -> &'static str {
        let taps = self.taps(l);
        let Some(gap) = taps.gap else {
            self.say_edge();
            return if self.near_edge() { "stairs" } else { "blur-wide" };
        };
        let moved = l.bias.element_sum();
        let distance = self.seen.evidence[self.i].distance();
        self.say(format!("The blocker is {} away, {} of depth in the map.", metres(distance), metres(gap)));
        let middle = l.taps[Taps::MIDDLE];
        if taps.holds_blocker(Taps::MIDDLE) {
            self.say(format!("The texel holds it, {} before the surface's plane.", metres(middle.z - middle.x)));
            if !taps.dark(Taps::MIDDLE) {
                self.say(format!("The comparison is moved by {} towards the light: {}.", metres(moved), self.parts(l)));
                if taps.step > 0.5 * gap && taps.step > moved {
                    self.say(format!("Depth is told apart in steps of {}.", metres(taps.step)));
                    return "precision";
                }
                return "detachment";
            }
            let (dark, all) = taps.count(l.radius.max(1.0), Taps::dark);
            self.say(format!("{dark} of {all} texels around say shadow."));
            let width = self.shadow_width(self.i) / self.texel();
            // What the texels' comparisons let through, no filter can be blamed for.
            let through = 1.0 - dark as f32 / all.max(1) as f32;
            if 5 * dark >= 4 * all && self.seen.pixels.visibility[self.i] > through + 0.1 {
                return "bleeding";
            }
            if l.radius > NEAR && width < l.radius {
                self.say(format!(
                    "The true shadow is {} texels wide, and the filter reaches {}.",
                    n(width),
                    n(l.radius)
                ));
                return "leak";
            }
            self.say_edge();
            return if l.radius > NEAR && self.mixed(dark, all) { "blur-wide" } else { "stairs" };
        }
        let (holding, all) = taps.count(l.spread, Taps::holds_blocker);
        self.say(format!("The texel does not hold it; {holding} of {all} around do."));
        if l.radius <= 1.0 && holding <= FEW && self.is_thin() {
            return "thin-caster";
        }
        self.say_edge();
        if l.radius > NEAR {
            let (dark, all) = taps.count(l.radius, Taps::dark);
            if self.mixed(dark, all) {
                return "blur-wide";
            }
        }
        if holding > 0 || self.near_edge() {
            return "stairs";
        }
        let (anywhere, _) = taps.count(f32::INFINITY, Taps::holds_blocker);
        if anywhere > 0 && l.before.distance(l.texel) > 0.01 { "misplaced" } else { "missing-caster" }
    }

    fn parts(&self, l: &Looked) -> String {
        let names = ["constant", "slope", "normal", "plane"];
        let parts: Vec<String> = (l.bias.to_array().iter().zip(names))
            .filter(|(m, _)| m.abs() > 1e-7)
            .map(|(m, name)| format!("{name} {}", metres(*m)))
            .collect();
        if parts.is_empty() { "not at all".into() } else { parts.join(", ") }
    }

    /// Pixels across the true shadow that a dark pixel lies in: twice the way to the light from its middle, which is found by going
    /// from pixel to pixel away from the light.
    fn shadow_width(&self, i: usize) -> f32 {
        let lit = &self.seen.to[1];
        let mut at = i;
        for _ in 0..64 {
            let inner = self.near(at, 1).filter(|j| self.seen.pixels.hard[*j] < 0.5 && lit[*j] > lit[at]);
            match inner.max_by(|a, b| lit[*a].total_cmp(&lit[*b])) {
                Some(inner) => at = inner,
                None => break,
            }
        }
        2.0 * lit[at] - 1.0
    }

    /// The pixels around that can be wrong and lie about as deep.
    fn around(&self, reach: i32) -> impl Iterator<Item = usize> + use<'_> {
        self.near(self.i, reach)
    }

    /// The same of another pixel.
    fn near(&self, i: usize, reach: i32) -> impl Iterator<Item = usize> + use<'_> {
        let seen = self.seen;
        let [x, y] = seen.pixel(i).map(|c| c as i32);
        let [width, height] = seen.size.map(|c| c as i32);
        let depth = seen.position[i][3];
        (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| [x + dx, y + dy])).filter_map(
            move |[x, y]| {
                let held = x >= 0 && y >= 0 && x < width && y < height;
                let j = seen.index([x.max(0), y.max(0)].map(|c| c as u32));
                (held && seen.pixels.mask[j] == FACING && (seen.position[j][3] - depth).abs() < 0.1 * depth)
                    .then_some(j)
            },
        )
    }

    /// What is off in a penumbra, whether of the light's or of what a technique spreads by chance.
    fn soft(&mut self) -> Option<&'static str> {
        let (p, width) = (&self.seen.pixels, self.seen.width());
        let partly = |v: f32| v > 0.02 && v < 0.98;
        let window: Vec<usize> = self.around(AROUND).collect();
        // How much of what visibility and truth are its neighbours do not share: their difference from the mean of the four beside.
        let truth = if self.soft_truth() { &p.mean } else { &p.hard };
        let (mut rough, mut power, mut pixels, mut grained) = ([0.0f32; 2], 0.0, 0, 0);
        for j in window.iter().copied() {
            let beside = [j.wrapping_sub(1), j + 1, j.wrapping_sub(width), j + width];
            if beside.iter().all(|k| window.contains(k)) {
                let apart = |of: &[f32]| of[j] - beside.iter().map(|k| of[*k]).sum::<f32>() / 4.0;
                let [own, true_] = [apart(&p.visibility), apart(truth)];
                rough[0] += own.powi(2) / 1.25;
                rough[1] += true_.powi(2) / 1.25;
                grained += (own.abs() > 0.05) as usize;
                power += (p.visibility[j] - truth[j]).powi(2);
                pixels += 1;
            }
        }
        // An edge is rough too, but along one line of pixels.
        let all_over = 10 * grained > 4 * pixels;
        let mut levels: Vec<u32> =
            window.iter().map(|j| p.visibility[*j]).filter(|v| partly(*v)).map(|v| (v * 256.0) as u32).collect();
        levels.sort_unstable();
        levels.dedup();
        let [rms, own, true_rms] = [power, rough[0], rough[1]].map(|sum| (sum / pixels.max(1) as f32).sqrt());
        let many = levels.len() >= 4 || levels.len() >= 2 && all_over;
        if pixels >= 6 && many && own > 0.05 && own > 2.0 * true_rms && own > 0.5 * rms {
            self.say(format!(
                "From a pixel to the next visibility changes by {} on average beyond what the pixels around share, the truth by {}.",
                n(own),
                n(true_rms)
            ));
            return Some("noise");
        }
        if !self.soft_truth() || !window.iter().any(|j| partly(p.mean[*j])) {
            return None;
        }
        let sized = self.setup.light.has_size();
        let partial: Vec<usize> = window.iter().copied().filter(|j| partly(p.mean[*j])).collect();
        // Of a light without a size only the pixel's own width is averaged.
        if !sized {
            return None;
        }
        let near = softness::penumbra_near(p, &self.seen.position, width, self.seen.pixel(self.i), 24);
        let mut range: Vec<f32> = partial.iter().map(|j| p.mean[*j]).collect();
        range.sort_unstable_by(f32::total_cmp);
        let span = range.last()? - range.first()?;
        let mut seen: Vec<u32> = partial.iter().map(|j| (p.visibility[*j] * 256.0) as u32).collect();
        seen.sort_unstable();
        seen.dedup();
        let banded = partial.len() >= 40 && seen.len() >= 2 && seen.len() <= 4 && span > 0.15;
        let levels = format!(
            "Of {} pixels around in which the truth runs over {}, visibility takes {} levels.",
            partial.len(),
            n(span),
            seen.len()
        );
        let width = near.map(|(own, truth)| (own.unwrap_or(0.0), truth));
        if let Some((own, truth)) = width {
            self.say(format!("Across the nearest edge visibility takes {} pixels, the truth {}.", n(own), n(truth)));
        }
        // Where one of the two has no end within reach, how far each runs over the pixels around.
        let ratio = width.map(|(own, truth)| own / truth.max(1.0)).or_else(|| {
            let over = |of: &[f32]| {
                let all = window.iter().map(|j| of[*j]);
                all.clone().fold(0.0f32, f32::max) - all.fold(1.0f32, f32::min)
            };
            let [own, truth] = [over(&p.visibility), over(&p.mean)];
            (own.max(truth) > 0.1).then(|| {
                self.say(format!(
                    "Over the pixels around visibility runs over {}, the truth over {}.",
                    n(own),
                    n(truth)
                ));
                truth / own.max(0.01)
            })
        });
        match ratio {
            Some(ratio) if ratio < 0.77 => Some("blur-narrow"),
            _ if banded => {
                self.say(levels);
                Some("banding")
            }
            Some(ratio) if ratio > 1.3 => Some("blur-wide"),
            Some(_) => Some("penumbra-off"),
            None => partly(p.mean[self.i]).then_some("penumbra-off"),
        }
    }

    fn soft_truth(&self) -> bool {
        self.info.filters(self.setup.values()) || self.setup.light.has_size()
    }

    /// Without a look-up that can be asked: as the causes have it.
    fn by_cause(&mut self) -> &'static str {
        self.say_edge();
        let e = self.seen.evidence[self.i];
        if self.seen.pixels.hard[self.i] < 0.5 && e.blocked() {
            self.say(format!("The blocker is {} away.", metres(e.distance())));
        }
        match self.seen.causes.classes[self.i] {
            ACNE => "acne",
            DETACHMENT => "detachment",
            LEAK => "leak",
            MISSING => "missing-caster",
            _ if self.off.abs() <= 0.5 && self.soft_truth() => "penumbra-off",
            _ => "stairs",
        }
    }

    /// Changes of the technique's own parameters that help, of those that mean something now.
    fn remedies(&self, artefact: &Artefact) -> Vec<Remedy> {
        let values = self.setup.values();
        let mut found: Vec<Remedy> = Vec::new();
        for (name, change) in artefact.remedies {
            let spec = self.info.specs().find(|s| s.name == *name && self.info.applies(s, values));
            let Some(spec) = spec.filter(|s| found.iter().all(|f| f.name != s.name)) else { continue };
            let from = values.get(spec.name).cloned().unwrap_or_else(|| spec.default());
            found.extend(changed(spec, &from, *change).filter(|to| *to != from).map(|to| Remedy {
                name: spec.name,
                from,
                to,
                unit: spec.unit,
            }));
        }
        // Of biases the one that moves most comes first.
        if let (Some(l), "detachment") = (self.looked, artefact.id) {
            let weight = |r: &Remedy| match r.name {
                "bias" | "epsilon" => l.bias.x,
                "slope_bias" => l.bias.y,
                "normal_offset" => l.bias.z,
                _ => 0.0,
            };
            found.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
            let biases = ["bias", "epsilon", "slope_bias", "normal_offset"];
            let least = 0.1 * l.bias.element_sum();
            found.retain(|r| !biases.contains(&r.name) || weight(r) >= least);
        }
        // A limit that the plane does not reach limits nothing.
        if let (Some(l), "acne") = (self.looked, artefact.id) {
            let steep = l.slope.length() / l.texel_size.max(1e-9);
            let limit = match values.get("slope_limit") {
                Some(Value::Float(limit)) => *limit as f32,
                _ => f32::INFINITY,
            };
            if steep < limit {
                found.retain(|r| r.name != "slope_limit");
            }
        }
        found.truncate(MOST);
        found
    }
}

/// A parameter's value after a change, within its range; None where the change is not for it.
fn changed(spec: &Spec, from: &Value, change: Change) -> Option<Value> {
    let number = |x: f64| match change {
        Times(by) => Some(x * by),
        Plus(by) => Some(x + by),
        _ => None,
    };
    match (spec.kind, from) {
        (Kind::Flag { .. }, Value::Bool(_)) => match change {
            On => Some(Value::Bool(true)),
            Off => Some(Value::Bool(false)),
            _ => None,
        },
        (Kind::Int { min, max, step, .. }, Value::Int(v)) => {
            let to = number(*v as f64)?.round() as i64;
            Some(Value::Int((min + (to - min) / step * step).clamp(min, max)))
        }
        (Kind::Float { min, max, .. }, Value::Float(v)) => Some(Value::Float(number(*v)?.clamp(min, max))),
        (Kind::Choice { options, .. }, Value::Text(_)) => match change {
            Take(option) => options.contains(&option).then(|| Value::Text(option.into())),
            _ => None,
        },
        _ => None,
    }
}

/// What a change did: the errors of the whole picture, and of the pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Wrong pixels as a share of those that can be wrong.
    pub share: f64,
    pub rmse: f64,
    /// Of the pixel: how far visibility is off, and whether its label is wrong.
    pub off: f32,
    pub wrong: bool,
}

/// Measures a set-up's errors at a size, and those of the pixel at a place of the picture.
///
/// # Errors
/// As [`Seen::draw`].
pub fn measure(renderer: &mut Renderer, setup: &Setup, size: [u32; 2], place: [f32; 2]) -> Result<Errors> {
    let setup = Setup { size, ..super::story::judged(setup) };
    renderer.render(&setup, Ask { picture: false, ..Ask::of(&setup) })?;
    let (visibility, mask) = (renderer.read_visibility()?, renderer.read_mask()?);
    let (hard, mean) = (renderer.read_labels()?, renderer.read_truth()?);
    let e = super::metrics::errors(&visibility, &hard, &mean, &mask, size[0] as usize);
    let [x, y] = pixel_at(place, size);
    let i = (y * size[0] + x) as usize;
    Ok(Errors {
        share: e.share(),
        rmse: e.rmse,
        off: visibility[i] - mean[i],
        wrong: mask[i] == FACING && (visibility[i] >= 0.5) != (hard[i] >= 0.5),
    })
}
