//! The techniques: the trait they implement and the registry they stand in.

mod area_adaptive;
mod area_uniform;
mod backprojection;
mod csm_conservative;
mod csm_convolution;
mod cssm;
mod cube;
mod dsm;
mod dual_paraboloid;
mod edsm;
mod esm;
mod evsm;
mod fem_grid;
mod hybrid_area;
mod hybrid_pcf;
mod imperfect_sm;
mod ipsm;
mod izb;
mod lispsm;
pub mod lixel_per_pixel;
mod logpsm;
mod msm;
mod notw;
mod omni_atlas;
mod optimal_light_plane;
mod pcf;
mod pcss;
mod prefiltered_soft;
mod psm;
pub mod pssm;
mod psv;
mod rbsm;
mod rt_denoise;
mod rt_hard;
mod rt_soft;
mod rtw;
mod sdsm;
mod shadow_map;
mod shadow_volume;
mod skewed_paraboloid;
mod sssm;
mod tsm;
mod vsm;

use crate::contact;
use crate::frame::Frame;
use crate::gpu::{Abilities, Gpu, Need};
use crate::light::Light;
use crate::map::MOST;
use crate::map::faces;
use crate::map::filter::Filter;
use crate::map::noise::NoiseParams;
use crate::map::prefilter::PrefilterParams;
use crate::params::{Condition, Group, Kind, Params, Spec, Value, Values};
use crate::view::View;
use anyhow::{Context, Result, anyhow, ensure};
use std::sync::{LazyLock, OnceLock};

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
    /// How it looks its maps up, where that is not for `filter` to say.
    pub filter: Option<&'static Filter>,
    /// Whether it aims at the mean visibility over a pixel, as some filters do ([`Filter::smooth`]), without one.
    pub smooth: fn(&Values) -> bool,
    /// Its own parameters; names are unique across the groups.
    pub params: &'static [Group],
    /// The parameters that decide between speed and accuracy, with values worth trying as `sweep` writes them. A chart's
    /// line runs over the first.
    pub main: &'static [(&'static str, &'static str)],
    /// Views of its own, on top of [`crate::view::VIEWS`] and its filter's, list after list; see [`Info::views`].
    pub maps: &'static [&'static [View]],
    /// What it needs with these values of the adapter, beyond what all others do with.
    pub needs: fn(&Values) -> &'static [Need],
    pub make: fn(&Gpu, &'static Info) -> Result<Box<dyn Technique>>,
}

/// A shadow technique.
pub trait Technique {
    /// Fills the frame's visibility: the fraction of the light that each pixel sees.
    fn render(&mut self, f: &mut Frame) -> Result<()>;
}

pub(crate) use shadow_map::MAPS;

/// The filters, each declared with the technique that looks a single map up by it.
pub const FILTERS: &[&Filter] = &[
    NEAREST,
    &pcf::FILTER,
    &pcss::FILTER,
    &vsm::FILTER,
    &esm::FILTER,
    &evsm::FILTER,
    &csm_convolution::FILTER,
    &msm::FILTER,
    &prefiltered_soft::FILTER,
    &rbsm::FILTER,
];
pub const NEAREST: &Filter = &shadow_map::FILTER;

/// Their names.
const IDS: [&str; FILTERS.len()] = {
    let mut ids = [""; FILTERS.len()];
    let mut i = 0;
    while i < ids.len() {
        ids[i] = FILTERS[i].id;
        i += 1;
    }
    ids
};

crate::params! {
    /// How a technique's maps are looked up.
    pub struct FilterParams {
        "Filter" {
            /// How the maps are looked up. Nearest: one comparison. The others are the techniques of these names, with their parameters.
            filter: choice("nearest", IDS),
        }
    }
}

/// The choice of a filter, and the parameters of each.
pub const FILTERING: &[Group] = &[
    FilterParams::GROUP,
    pcf::PcfParams::GROUP.when("filter", &["pcf"]),
    pcss::PcssParams::GROUP.when("filter", &["pcss"]),
    NoiseParams::GROUP.when("filter", &["pcf", "pcss"]),
    PrefilterParams::GROUP.when("filter", &["vsm", "esm", "evsm", "csm-convolution", "msm"]),
    vsm::ChebyshevParams::GROUP.when("filter", &["vsm", "evsm"]),
    vsm::VsmParams::GROUP.when("filter", &["vsm"]),
    esm::EsmParams::GROUP.when("filter", &["esm"]),
    evsm::EvsmParams::GROUP.when("filter", &["evsm"]),
    csm_convolution::CsmConvolutionParams::GROUP.when("filter", &["csm-convolution"]),
    msm::MsmParams::GROUP.when("filter", &["msm"]),
    prefiltered_soft::PrefilteredSoftParams::GROUP.when("filter", &["prefiltered-soft"]),
    rbsm::RbsmParams::GROUP.when("filter", &["rbsm"]),
];

/// The filter that `filter` names.
pub fn chosen(values: &Values) -> &'static Filter {
    let name = FilterParams::read(values).filter;
    FILTERS.iter().find(|f| f.id == name).copied().unwrap_or(NEAREST)
}

/// The ids of all techniques' own views, each once.
static MAP_IDS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    let mut ids = Vec::new();
    for view in ALL.iter().flat_map(|info| info.all_views()) {
        if !ids.contains(&view.id) {
            ids.push(view.id);
        }
    }
    ids
});

/// The number by which shaders know a technique's own view, as `shows_texels` in WGSL; of other views one that none has.
pub fn map_number(id: &str) -> u32 {
    MAP_IDS.iter().position(|other| *other == id).unwrap_or(u32::MAX as usize) as u32
}

/// What WGSL must know of Rust's numbers: `constants.wgsl`.
pub fn wgsl() -> String {
    let mut text = format!("const most_layers = {MOST}u;\n");
    for (i, id) in MAP_IDS.iter().enumerate() {
        text += &format!("const shows_{} = {i}u;\n", id.replace('-', "_"));
    }
    text
}

/// A technique that a program brings along on top of ours (`examples/planar_shadow.rs`).
pub struct Own {
    pub info: &'static Info,
    /// Its shaders: their names, as [`crate::gpu::Pass`] is given them, and their text.
    pub shaders: &'static [(&'static str, &'static str)],
}

static OWN: OnceLock<&'static [Own]> = OnceLock::new();

/// Adds a program's own techniques to all lists, before anything asks for these.
///
/// # Errors
/// An id that is taken, or a second call.
pub fn add(own: &'static [Own]) -> Result<()> {
    for (i, Own { info, .. }) in own.iter().enumerate() {
        let others = BUILT_IN.iter().copied().chain(own[..i].iter().map(|o| o.info));
        ensure!(others.into_iter().all(|o| o.id != info.id), "there already is a technique called {}", info.id);
    }
    OWN.set(own).map_err(|_| anyhow!("techniques can be added once"))
}

/// The techniques that the program has brought along.
pub(crate) fn own() -> &'static [Own] {
    OWN.get().copied().unwrap_or_default()
}

/// Every technique, in the order of the lists. The first is the default.
pub static ALL: LazyLock<Vec<&'static Info>> =
    LazyLock::new(|| BUILT_IN.iter().copied().chain(own().iter().map(|o| o.info)).collect());

/// Those of this house.
static BUILT_IN: &[&Info] = &[
    &shadow_map::INFO,
    &pcf::INFO,
    &pcss::INFO,
    &vsm::INFO,
    &esm::INFO,
    &evsm::INFO,
    &csm_convolution::INFO,
    &msm::INFO,
    &prefiltered_soft::INFO,
    &pssm::INFO,
    &sdsm::INFO,
    &lispsm::INFO,
    &tsm::INFO,
    &psm::INFO,
    &logpsm::INFO,
    &optimal_light_plane::INFO,
    &rtw::INFO,
    &notw::INFO,
    &dsm::INFO,
    &fem_grid::INFO,
    &lixel_per_pixel::INFO,
    &cube::INFO,
    &dual_paraboloid::INFO,
    &ipsm::INFO,
    &skewed_paraboloid::INFO,
    &omni_atlas::INFO,
    &notw::CUBE,
    &notw::PARABOLOID,
    &rtw::CUBE,
    &rtw::PARABOLOID,
    &imperfect_sm::INFO,
    &edsm::INFO,
    &sssm::INFO,
    &rbsm::INFO,
    &shadow_volume::INFO,
    &shadow_volume::TRIANGLES,
    &psv::INFO,
    &izb::INFO,
    &csm_conservative::INFO,
    &hybrid_pcf::INFO,
    &hybrid_area::INFO,
    &backprojection::INFO,
    &area_uniform::INFO,
    &area_adaptive::INFO,
    &cssm::INFO,
    &rt_hard::INFO,
    &rt_soft::INFO,
    &rt_denoise::INFO,
];

/// The technique whose ray-traced result is the truth.
pub static TRUTH: &Info = &rt_hard::INFO;

impl Info {
    /// All parameters in panel order: its own, then those of contact shadows on top of it.
    pub fn specs(&self) -> impl Iterator<Item = &'static Spec> + use<> {
        self.groups().flat_map(|g| g.specs)
    }

    /// Fills in the defaults of what has no value, where so many metres stand for one.
    pub fn fill(&self, values: &mut Values, unit: f64) {
        for spec in self.specs() {
            values.entry(spec.name.into()).or_insert_with(|| spec.default_in(unit));
        }
    }

    fn groups(&self) -> impl Iterator<Item = &'static Group> + use<> {
        self.params.iter().chain([&contact::GROUP])
    }

    /// Whether a parameter means anything beside these values.
    pub fn applies(&self, spec: &Spec, values: &Values) -> bool {
        let holds = |c: &Condition| {
            self.specs()
                .find(|s| s.name == c.of)
                .is_some_and(|s| c.test.holds(values.get(c.of).unwrap_or(&s.default())) && self.applies(s, values))
        };
        let group = self.group(spec).when;
        group.iter().all(holds) && (spec.when.is_empty() || spec.when.iter().any(|all| all.iter().all(holds)))
    }

    /// The group that declares a parameter of this technique.
    pub fn group(&self, spec: &Spec) -> &'static Group {
        let declares = |g: &&Group| g.specs.iter().any(|s| s.name == spec.name);
        self.groups().find(declares).expect("a parameter of this technique")
    }

    /// How it looks its maps up with these values; None of techniques without maps.
    pub fn filter(&self, values: &Values) -> Option<&'static Filter> {
        let choice = self.specs().any(|s| s.name == "filter");
        self.filter.or_else(|| choice.then(|| chosen(values)))
    }

    /// Whether it aims at the mean visibility over a pixel, as filters do, and not at that of one sample: views and the
    /// window then show the averaged truth beside it ([`crate::truth::Samples::Auto`]).
    pub fn filters(&self, values: &Values) -> bool {
        (self.smooth)(values) || self.filter(values).is_some_and(|f| (f.smooth)(values))
    }

    /// Views of its own with these values: its maps', then its filter's, then those of contact shadows.
    pub fn views(&self, values: &Values) -> impl Iterator<Item = &'static View> + use<> {
        let contact = if contact::wanted(values) { contact::VIEWS } else { &[] };
        let own = self.maps.iter().copied().flatten().chain(self.filter(values).map_or(&[][..], |f| f.views));
        own.chain(contact)
    }

    /// The filters that it lets be chosen.
    pub fn choosable(&self) -> impl Iterator<Item = &'static Filter> + use<> {
        let options: &[&str] = match self.specs().find(|s| s.name == "filter").map(|s| s.kind) {
            Some(Kind::Choice { options, .. }) => options,
            _ => &[],
        };
        FILTERS.iter().copied().filter(move |f| options.contains(&f.id))
    }

    /// Views of its own with any values.
    pub fn all_views(&self) -> impl Iterator<Item = &'static View> + use<> {
        let filters = self.filter.into_iter().chain(self.choosable());
        self.maps.iter().copied().flatten().chain(filters.flat_map(|f| f.views)).chain(contact::VIEWS)
    }

    /// Why an adapter cannot run it with these values, or None if it can.
    pub fn lacks(&self, values: &Values, on: &Abilities) -> Option<String> {
        let own = (self.needs)(values).iter().find_map(|need| on.lacks(*need));
        let moments = || self.filter(values)?.moments.and_then(|of| on.cannot_average(of(values).format));
        own.or_else(moments)
    }

    /// Why an adapter cannot run it, whatever one of its choices is set to; else None.
    pub fn cannot_run(&self, on: &Abilities) -> Option<String> {
        let mut values = Values::new();
        self.fill(&mut values, 1.0);
        self.lacks_all_the_same(&values, on, |_| true)
    }

    /// Why one of its choices cannot take an option beside these values, or None if it can. Choices that come with the option are
    /// left to be made.
    pub fn cannot_take(&self, values: &Values, name: &str, option: &str, on: &Abilities) -> Option<String> {
        let mut with = values.clone();
        with.insert(name.into(), Value::Text(option.into()));
        self.lacks_all_the_same(&with, on, |spec| !self.applies(spec, values) && self.applies(spec, &with))
    }

    /// As [`Info::lacks`], where no option of the choices that `may` change helps.
    fn lacks_all_the_same(&self, values: &Values, on: &Abilities, may: impl Fn(&Spec) -> bool) -> Option<String> {
        let why = self.lacks(values, on)?;
        let helps = |name: &str, option: &str| {
            let mut other = values.clone();
            other.insert(name.into(), Value::Text(option.into()));
            self.lacks(&other, on).is_none()
        };
        let helped = self.specs().filter(|spec| may(spec)).any(|spec| match spec.kind {
            Kind::Choice { options, .. } => options.iter().any(|option| helps(spec.name, option)),
            _ => false,
        });
        (!helped).then_some(why)
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
        (!self.lights.contains(&kind)).then(|| {
            let all_around = faces::LIGHTS.contains(&kind) && FILTERS.iter().any(|f| f.id == self.id);
            let instead =
                if all_around { format!("; cube with filter = {} serves that", self.id) } else { String::new() };
            format!("{}: for {lights} light, not {kind}{instead}", self.title)
        })
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
