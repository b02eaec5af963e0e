//! How layers are looked up: a filter is a file in `shaders/map/filter/`, whatever fit or warp drew the layers.

use super::Maps;
use super::cascades::CascadeParams;
use super::noise::Noise;
use super::prefilter::{CURVE, Moments, Prefilter};
use super::sums::Sums;
use crate::frame::{ANALYSIS, Frame, MapSizes};
use crate::gpu::{Gpu, Pass, Resource, hold};
use crate::params::{Group, Params, Values};
use crate::view::View;
use anyhow::Result;

/// How far a filter's taps lie from the receiver: so much stays free at the borders of a fitted map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reach {
    /// Texels, on top of `metres`.
    pub texels: f32,
    /// Metres across the light, in filters that are as wide in every layer.
    pub metres: f32,
    /// The filter asks how far casters are: no layer may move any of them to its near plane.
    pub casters: bool,
}

/// Of filters that look for casters in the light's cone, up to so many texels off. How far the cone spreads before it meets one is known
/// only when the map is drawn. An eighth of the side at each border leaves the receivers 9/16 of the texels at least.
pub fn soft_reach(f: &Frame, most: f32) -> Reach {
    let side = CascadeParams::read(f.values).sides().into_iter().min().unwrap_or(0);
    Reach { texels: most.min(side as f32 / 8.0), casters: true, ..Reach::default() }
}

/// A way to look layers up.
pub struct Filter {
    /// Its name as `filter` of techniques that let it be chosen.
    pub id: &'static str,
    /// Its WGSL: `lit` and `inspect_filter`, as `shaders/map/look_up.wgsl` tells.
    pub file: &'static str,
    pub reach: fn(&Frame) -> Reach,
    /// What it keeps of depth, if maps are filtered or summed up before the look-up.
    pub moments: Option<fn(&Values) -> Moments>,
    /// If it includes `disk.wgsl`: whether its taps lie in a disk, so that [`super::noise::NoiseParams`] apply.
    pub turns: Option<fn(&Values) -> bool>,
    /// Whether it draws the penumbras of a light that has a size, and compares once where it has none.
    pub sized: fn(&Values) -> bool,
    /// Whether it aims at the mean visibility over a pixel, and not at that of one sample.
    pub smooth: fn(&Values) -> bool,
    /// How long a look-up takes at most, in full-screen passes ([`crate::gpu::Run::in_bands`]).
    pub cost: u32,
    /// What it shows of itself.
    pub views: &'static [View],
}

impl Filter {
    /// What most filters leave as it is.
    pub const PLAIN: Filter = Filter {
        id: "",
        file: "",
        reach: |_| Reach { texels: 0.0, metres: 0.0, casters: false },
        moments: None,
        turns: None,
        sized: |_| false,
        smooth: |_| true,
        cost: 8,
        views: &[],
    };
}

/// A technique's shader with the simplest filter, for its passes that look nothing up.
pub fn alone(file: &str) -> String {
    format!("{file} map/filter/nearest.wgsl")
}

/// A technique's shader with a filter, whose moments are kept so.
pub fn shader(file: &str, filter: &Filter, moments: Option<Moments>) -> String {
    let store = moments.map(|m| format!(" store/{:?}.wgsl", m.format)).unwrap_or_default();
    format!("{file} {}{}", filter.file, store.to_lowercase())
}

/// The passes that look maps up and show how: put together from a technique's shader and a filter's.
pub struct LookUp {
    file: &'static str,
    groups: &'static [Group],
    passes: Option<((&'static str, Option<Moments>), Passes)>,
    comparison: wgpu::Sampler,
}

struct Passes {
    resolve: Pass,
    /// What few frames ask for, made when one does: views, of filters that average first the chart of their reconstruction, and
    /// the analysis.
    inspect: Option<((), Pass)>,
    curve: Option<((), Pass)>,
    analyse: Option<((), Pass)>,
    prefilter: Option<Prefilter>,
    sums: Option<Sums>,
    /// Of filters whose taps can be turned.
    noise: Option<Noise>,
}

impl LookUp {
    /// `file`: the technique's shader, which says how layers are chosen, where surfaces lie in them, and what its own views
    /// show; `groups`: all of its parameters.
    pub fn new(gpu: &Gpu, file: &'static str, groups: &'static [Group]) -> LookUp {
        let comparison = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("depth comparison"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::GreaterEqual),
            ..Default::default()
        });
        LookUp { file, groups, passes: None, comparison }
    }

    /// Fills the frame's visibility from maps, and draws the view of them that is asked for. `bound`: what the technique's own
    /// views need beside, by name.
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn run(
        &mut self,
        f: &mut Frame,
        maps: &Maps,
        filter: &Filter,
        bound: &[(&'static str, Resource)],
    ) -> Result<()> {
        let (file, groups, gpu) = (self.file, self.groups, f.gpu);
        let moments = filter.moments.map(|moments| moments(f.values));
        let pass = |name, entry| Pass::compute(gpu, name, &shader(file, filter, moments), entry, groups);
        let passes = hold(&mut self.passes, (filter.id, moments), |_| {
            let file = shader(file, filter, moments);
            let (summed, averaged) = (moments.filter(|m| m.summed()), moments.filter(|m| !m.summed()));
            Ok(Passes {
                prefilter: averaged.map(|_| Prefilter::new(gpu, &file, groups)).transpose()?,
                sums: summed.map(|_| Sums::new(gpu, &file, groups)).transpose()?,
                resolve: pass("resolve", "resolve")?,
                inspect: None,
                curve: None,
                analyse: None,
                noise: filter.turns.map(|_| Noise::new(gpu)),
            })
        })?;
        let mut all = maps.bound.clone();
        all.extend_from_slice(bound);
        all.extend([
            ("shadow_maps", (&maps.layers.all).into()),
            ("light_views", (&maps.light_views).into()),
            ("compare_sampler", (&self.comparison).into()),
        ]);
        if let (Some(prefilter), Some(moments)) = (&mut passes.prefilter, moments) {
            all.extend(prefilter.run(f, maps, moments)?);
        }
        if let (Some(sums), Some(moments)) = (&mut passes.sums, moments) {
            all.extend(sums.run(f, maps, moments)?);
        }
        if let Some(noise) = &mut passes.noise {
            all.extend(noise.bound(f));
        }
        f.keep_table("light_views", &maps.light_views);
        f.offer_maps(&maps.layers.each, &maps.light_views, &maps.sides);
        f.offer_teller(|| shader(file, filter, moments), groups, &all, true);
        if f.wants_analysis() {
            let analyse = hold(&mut passes.analyse, (), |()| pass(ANALYSIS, "analyse"))?;
            f.analyse(analyse, MapSizes::of(&maps.sides), &all);
        }
        let resolve = |f: &mut Frame| f.run(&passes.resolve).in_bands(filter.cost).bind_all(&all).per_pixel();
        match (&mut passes.noise, filter.turns) {
            (Some(noise), Some(turns)) => noise.accumulate(f, turns(f.values), resolve)?,
            _ => resolve(f),
        }
        if f.wants_any_map() {
            let shown = match f.view == CURVE.id {
                true => hold(&mut passes.curve, (), |()| pass("inspect", "draw_curve"))?,
                false => hold(&mut passes.inspect, (), |()| pass("inspect", "inspect"))?,
            };
            f.run(shown).bind_all(&all).per_pixel();
        }
        Ok(())
    }
}
