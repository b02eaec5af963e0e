//! The techniques: the trait they implement and the registry they stand in.

mod dsm;
mod fem_grid;
mod lispsm;
mod logpsm;
mod notw;
mod pcf;
mod psm;
pub mod pssm;
mod rt_hard;
mod rtw;
mod sdsm;
mod shadow_map;
mod tsm;

use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::light::Light;
use crate::params::{Condition, Group, Spec, Values};
use crate::view::View;
use anyhow::{Context, Result, anyhow};

/// What is known of a technique before it is made.
pub struct Info {
    /// Name in set-ups and on the command line.
    pub id: &'static str,
    pub title: &'static str,
    /// Author and year.
    pub paper: &'static str,
    /// The heading that it stands under in the lists; techniques of one family follow one another in [`ALL`].
    pub family: &'static str,
    /// Number of its colour and marker in charts, which it keeps whatever comes beside it.
    pub mark: usize,
    /// What it does and where it fails, in a student's words.
    pub doc: &'static str,
    /// The light kinds it serves, by their names in [`crate::light::KINDS`].
    pub lights: &'static [&'static str],
    /// Whether it aims at the mean visibility over a pixel, as filters do, and not at that of one sample: views and the
    /// window then show the averaged truth beside it ([`crate::truth::Samples::Auto`]).
    pub filters: bool,
    /// Its parameters; names are unique across the groups.
    pub params: &'static [Group],
    /// The parameters that decide between speed and accuracy, with values worth trying as `sweep` writes them. A chart's
    /// line runs over the first.
    pub main: &'static [(&'static str, &'static str)],
    /// Views of its own, on top of [`crate::view::VIEWS`], list after list; see [`Info::maps`].
    pub maps: &'static [&'static [View]],
    pub make: fn(&Gpu) -> Result<Box<dyn Technique>>,
}

/// A shadow technique.
pub trait Technique {
    /// Fills the frame's visibility: the fraction of the light that each pixel sees.
    fn render(&mut self, f: &mut Frame) -> Result<()>;
}

pub(crate) use shadow_map::MAPS;

/// Every technique, in the order of the lists. The first is the default.
pub static ALL: &[&Info] = &[
    &shadow_map::INFO,
    &pcf::INFO,
    &pssm::INFO,
    &sdsm::INFO,
    &lispsm::INFO,
    &tsm::INFO,
    &psm::INFO,
    &logpsm::INFO,
    &rtw::INFO,
    &notw::INFO,
    &dsm::INFO,
    &fem_grid::INFO,
    &rt_hard::INFO,
];

/// The technique whose ray-traced result is the truth.
pub static TRUTH: &Info = &rt_hard::INFO;

impl Info {
    /// All parameters in panel order.
    pub fn specs(&self) -> impl Iterator<Item = &'static Spec> + use<> {
        self.params.iter().flat_map(|g| g.specs)
    }

    /// Whether a parameter means anything beside these values.
    pub fn applies(&self, spec: &Spec, values: &Values) -> bool {
        let holds = |c: &Condition| {
            self.specs()
                .find(|s| s.name == c.of)
                .is_some_and(|s| c.test.holds(values.get(c.of).unwrap_or(&s.default())) && self.applies(s, values))
        };
        spec.when.is_empty() || spec.when.iter().any(|all| all.iter().all(holds))
    }

    /// Views of its own; shaders know them by their places here.
    pub fn maps(&self) -> impl Iterator<Item = &'static View> + use<> {
        self.maps.iter().copied().flatten()
    }

    /// Fails with the reason if it cannot serve a light.
    pub fn serve(&self, light: &Light) -> Result<()> {
        self.refuses(light).map_or(Ok(()), |reason| Err(anyhow!(reason)))
    }

    /// Why it cannot serve a light, or None if it can.
    pub fn refuses(&self, light: &Light) -> Option<String> {
        let kind = light.kind();
        let lights = match self.lights {
            [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
            _ => self.lights.concat(),
        };
        (!self.lights.contains(&kind)).then(|| format!("{} serves {lights} light, not {kind}", self.title))
    }
}

/// A technique by id.
pub fn find(id: &str) -> Option<&'static Info> {
    ALL.iter().copied().find(|i| i.id == id)
}

/// A technique by id, or a sentence that names those there are.
pub fn find_or_say(id: &str) -> Result<&'static Info> {
    find(id).with_context(|| {
        let ids: Vec<&str> = ALL.iter().map(|i| i.id).collect();
        format!("technique = {id} is unknown; there are {}", ids.join(", "))
    })
}
