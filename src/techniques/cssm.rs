//! Cascaded soft shadow maps (Azri 2020): far from the camera fewer places of the light, and coarser maps from them.

use super::rt_soft::LIGHT_SAMPLES;
use super::{Info, MAPS, NEAREST, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, hold};
use crate::map::cascades::{self, Fitting};
use crate::map::filter::{Reach, alone};
use crate::map::peel::StoredParams;
use crate::map::places::{PENUMBRA, PlaceSet, PlacedMaps, PlacesFitParams, Spared, grid, on_light};
use crate::map::single::scope;
use crate::map::{BiasParams, CasterParams, HardwareParams, margin};
use crate::params::Params;
use crate::view::{self, View, map};
use anyhow::Result;
use bytemuck::Zeroable;
use glam::{DVec2, Vec2, dvec2};
use wgpu::BufferUsages as Use;

crate::params! {
    /// Where maps are drawn from, of which size, and for which depths.
    pub struct CssmParams {
        "Light samples" {
            /// Places along each side of the light for the near cascade, so that as many maps are drawn as this times itself.
            side: int(4, 1..=16, "places"),
            /// The same for the middle cascade.
            side_2: int(3, 1..=16, "places"),
            /// The same for the far cascade.
            side_3: int(2, 1..=16, "places"),
            /// Where they lie. Corners: evenly from edge to edge, as Azri has them: the fewer, the wider the penumbras, so that these change their width from cascade to cascade. Centers: in the middles of as many cells. Nested: those of a cascade with fewer places are some of the others', and spread so that their penumbras are as wide.
            placement: choice("corners", ["corners", "centers", "nested"]),
            /// Texels along each side of the window whose comparisons are averaged in each map (PCF): the bands of few places flow together.
            kernel: int(3, 1..=5, "texels", 2),
            /// Which pixels ask all maps. All: every one. Corners: those on which the four outermost places disagree; what all four miss is missed. Bounds: those between which and the light a caster, or a gap between two, may lie, by the nearest and farthest depths of one map.
            ask: choice("all", ["all", "corners", "bounds"]),
            /// Maps that are drawn into layers of one texture and looked up together. 1: each is added to the sum by itself (accumulation), which reads every pixel's surface again.
            layers: int(8, 1..=8, "maps"),
        }
        "Cascades" {
            /// Side of each map of the near cascade.
            resolution: int(1024, 64..=8192, "texels"),
            /// How many of its texels one of the middle cascade's maps takes along each side: 2 makes these half as large.
            coarser_2: int(2, 1..=16, "×"),
            /// The same for the far cascade.
            coarser_3: int(8, 1..=16, "×"),
            /// Where the near cascade ends, between the camera's near plane and the end of the scene.
            percent_1: float(10.0, 0.0..=100.0, "%"),
            /// Where the middle cascade ends.
            percent_2: float(35.0, 0.0..=100.0, "%"),
            /// The last part of each cascade's depth, in which the next one is blended in: the seam becomes a gradual change.
            blend: float(0.0, 0.0..=0.3, "× depth"),
        }
    }
}

/// How many maps a pixel asked.
const ASKED: View = map(
    "maps-asked",
    "Maps asked",
    "How many of the maps each pixel asked: those of its cascade, or fewer where it was spared them.",
    view::counts("maps", 300.0),
);

pub static INFO: Info = Info {
    id: "cssm",
    title: "Cascaded soft shadow maps",
    paper: "Azri 2020",
    family: "Soft shadows",
    mark: 43,
    doc: "Shadow maps from places all over the light, in three cascades: near the camera many and fine ones, far away few and coarse \
          ones, each blurred a little (PCF). Where cascades meet, bands and blur change.",
    lights: &["directional", "spot", "rect-area"],
    filter: Some(NEAREST),
    smooth: |_| false,
    params: &[
        PlacesFitParams::GROUP,
        CssmParams::GROUP,
        CasterParams::GROUP,
        BiasParams::GROUP,
        StoredParams::GROUP,
        HardwareParams::GROUP,
    ],
    main: &[("resolution", "256..2048*2"), ("placement", "corners,centers,nested"), ("ask", "all,bounds")],
    maps: &[&[LIGHT_SAMPLES, PENUMBRA, ASKED, cascades::MAPS[0], cascades::MAPS[2], cascades::MAPS[3]], MAPS],
    needs: |_| &[],
    make: |gpu, _| Ok(Box::new(Cssm::new(gpu)?)),
};

const FILE: &str = "techniques/cssm.wgsl";

/// Half planes that sets of points are judged by: directions, and offsets in each.
const EDGES: [usize; 2] = [16, 33];

/// The part of the square from -1 to 1 that lies before the line at `offset` along a unit vector.
fn part_before(direction: DVec2, offset: f64) -> f64 {
    // The sum of two even distributions, as wide as the square is along either side.
    let [a, b] = direction.abs().to_array().map(|wide| 2.0 * wide.max(1e-4));
    let from = |t: f64| t.max(0.0).powi(2);
    let t = offset + 0.5 * (a + b);
    ((from(t) - from(t - a) - from(t - b) + from(t - a - b)) / (2.0 * a * b)).clamp(0.0, 1.0)
}

/// Lines across the square, each with the part of it that lies before: by how many points of a set do, sets are judged.
struct Judge {
    edges: Vec<(DVec2, f64, f64)>,
}

impl Judge {
    fn new() -> Judge {
        let [directions, offsets] = EDGES;
        let edges = (0..directions * offsets).map(|i| {
            let direction = DVec2::from_angle((i / offsets) as f64 * std::f64::consts::PI / directions as f64);
            let offset = 1.4 * (2.0 * (i % offsets) as f64 / (offsets - 1) as f64 - 1.0);
            (direction, offset, part_before(direction, offset))
        });
        Judge { edges: edges.collect() }
    }

    /// Whether the point lies before each of the lines: 1 or 0.
    fn before(&self, p: DVec2) -> Vec<f64> {
        self.edges.iter().map(|(direction, offset, _)| (p.dot(*direction) < *offset) as u32 as f64).collect()
    }

    /// The sum of squared differences between the share of `n` points, given how many lie before each line, and the square's part.
    fn error(&self, counts: impl Iterator<Item = f64>, n: usize) -> f64 {
        self.edges.iter().zip(counts).map(|((_, _, part), count)| (count / n as f64 - part).powi(2)).sum()
    }

    /// A set of `size` points, as numbers, from those that it must have and another first one on, and its error. `before`: of each
    /// point that there is.
    fn grown(&self, before: &[Vec<f64>], kept: &[usize], first: usize, size: usize) -> (f64, Vec<usize>) {
        let mut set = kept.to_vec();
        set.push(first);
        let mut counts: Vec<f64> =
            (0..self.edges.len()).map(|edge| set.iter().map(|i| before[*i][edge]).sum()).collect();
        let best = |counts: &[f64], set: &[usize], n: usize| {
            let free = (0..before.len()).filter(|i| !set.contains(i));
            let errors = free.map(|i| (self.error(counts.iter().zip(&before[i]).map(|(c, b)| c + b), n), i));
            errors.min_by(|a, b| a.0.total_cmp(&b.0))
        };
        while set.len() < size {
            let Some((_, i)) = best(&counts, &set, set.len() + 1) else { break };
            counts.iter_mut().zip(&before[i]).for_each(|(count, before)| *count += before);
            set.push(i);
        }
        // Each in turn gives its place to the one that does best there, until none does better.
        let mut error = self.error(counts.iter().copied(), size);
        let (mut at, mut still) = (kept.len(), kept.len());
        while still < size {
            let less: Vec<f64> = counts.iter().zip(&before[set[at]]).map(|(c, b)| c - b).collect();
            still += 1;
            if let Some((found, other)) = best(&less, &set, size).filter(|(found, _)| *found < error - 1e-12) {
                counts = less.iter().zip(&before[other]).map(|(c, b)| c + b).collect();
                (set[at], error, still) = (other, found, kept.len());
            }
            at = if at + 1 < size { at + 1 } else { kept.len() };
        }
        (error, set)
    }
}

/// The middles of the parts of the square from -1 to 1, cut into as many along each side as the largest of these numbers, in such an
/// order that the first so many of each number's square are scattered as evenly as can be, from the smallest on.
fn nested(mut sides: [u32; 3]) -> Vec<Vec2> {
    sides.sort();
    let k = sides[2];
    let along = |i: u32| (2 * i + 1) as f64 / k as f64 - 1.0;
    let points: Vec<DVec2> = (0..k * k).map(|i| dvec2(along(i % k), along(i / k))).collect();
    let judge = Judge::new();
    let before: Vec<Vec<f64>> = points.iter().map(|p| judge.before(*p)).collect();
    let mut order: Vec<usize> = Vec::new();
    for size in sides.map(|side| (side * side) as usize) {
        let free = (0..points.len()).filter(|i| order.len() < size && !order.contains(i));
        let free = free.step_by(if points.len() > 64 { points.len() } else { points.len().div_ceil(16) });
        let found = free.map(|first| judge.grown(&before, &order, first, size)).min_by(|a, b| a.0.total_cmp(&b.0));
        order = found.map_or(order, |(_, grown)| grown);
    }
    order.into_iter().map(|i| points[i].as_vec2()).collect()
}

struct Cssm {
    maps: PlacedMaps,
    mean: Pass,
    nested: Option<([u32; 3], Vec<Vec2>)>,
    places: Option<(Vec<Vec2>, Buffer)>,
    fitting: Option<(Vec<u8>, Buffer)>,
    splits: Option<([f32; 12], Buffer)>,
    /// What the outlines of cascades ask that leave out those without samples; here all have a map.
    draws: Buffer,
}

impl Cssm {
    fn new(gpu: &Gpu) -> Result<Cssm> {
        let file = alone(FILE);
        Ok(Cssm {
            mean: Pass::compute(gpu, "mean over maps", &file, "mean", INFO.params)?,
            maps: PlacedMaps::new(gpu, file, INFO.params)?,
            nested: None,
            places: None,
            fitting: None,
            splits: None,
            draws: gpu.buffer("cascades' draws", &[0; 120], Use::STORAGE),
        })
    }

    /// The places of each cascade; those that decide for a pixel last.
    fn sets(&mut self, f: &Frame, p: &CssmParams) -> Result<Vec<Vec<Vec2>>> {
        let sides = [p.side, p.side_2, p.side_3];
        if !f.light.has_size() {
            return Ok(vec![vec![Vec2::ZERO]; 3]);
        }
        let scattered = hold(&mut self.nested, sides, |sides| Ok(nested(*sides)))?;
        let all = sides.map(|k| match p.placement.as_str() {
            "nested" => scattered[..(k * k) as usize].iter().map(|place| on_light(&f.light, *place)).collect(),
            placement => grid(&f.light, k, placement == "corners"),
        });
        let ordered = all.into_iter().map(|mut places: Vec<Vec2>| {
            let outwards = |place: &Vec2| (place.x * place.y).abs() + 0.1 * place.length();
            places.sort_by(|a, b| outwards(a).total_cmp(&outwards(b)));
            if p.ask == "bounds" {
                places.reverse();
            }
            places
        });
        Ok(ordered.collect())
    }
}

impl Technique for Cssm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let gpu = f.gpu;
        let p = CssmParams::read(f.values);
        if !f.light.has_size() {
            f.tell_note("The light has no size: one map is drawn for each cascade, from its centre.".into());
        }
        let reach = Reach { texels: 0.5 * (p.kernel - 1) as f32, ..Reach::default() };
        let eye = scope(f, reach).eye();
        let mut depths = [eye.near as f32, eye.far as f32];
        if eye.orthographic {
            // How far before the scene such a camera stands means nothing.
            depths = f.camera.depths(f.scene.bounds);
        }
        let [near, far] = depths;
        let at = |percent: f32| near + (far - near) * percent / 100.0;
        let first = at(p.percent_1);
        let ends = [near, first, at(p.percent_2).max(first), far];
        let sides = [1, p.coarser_2, p.coarser_3].map(|coarser| p.resolution / coarser);
        let places = self.sets(f, &p)?;
        let sets: Vec<PlaceSet> = (0..3)
            .map(|c| PlaceSet {
                places: places[c].clone(),
                side: sides[c],
                depths: match c {
                    0 => [0.0, 0.0, ends[1]],
                    _ => {
                        let last = if c == 2 { f32::MAX } else { ends[c + 1] };
                        [ends[c] - p.blend * (ends[c] - ends[c - 1]), ends[c], last]
                    }
                },
            })
            .collect();
        let spared = match p.ask.as_str() {
            "corners" => Spared::ByFour,
            "bounds" => Spared::ByBounds,
            _ => Spared::None,
        };
        let slots = if p.blend > 0.0 { 2 } else { 1 };
        let mut padded = [[0; 4]; 2];
        padded[0][..3].copy_from_slice(&sides);
        let fitting =
            Fitting { count: 3, blend: p.blend, margin: margin(f) + reach.texels, sides: padded, ..Fitting::zeroed() };
        let words = bytemuck::bytes_of(&fitting).to_vec();
        let fitting = hold(&mut self.fitting, words, |words| Ok(gpu.buffer("fitting", words, Use::UNIFORM)))?.clone();
        let mut meet = [0.0; 12];
        meet[..4].copy_from_slice(&ends);
        let usage = Use::UNIFORM | Use::STORAGE | Use::COPY_SRC;
        let splits = hold(&mut self.splits, meet, |meet| Ok(gpu.buffer("splits", bytemuck::bytes_of(meet), usage)))?;
        let splits = splits.clone();
        let made = |all: &Vec<Vec2>| Ok(gpu.buffer("places on the light", bytemuck::cast_slice(all), Use::STORAGE));
        let places = hold(&mut self.places, places.concat(), made)?.clone();

        let maps = self.maps.draw(f, &sets, p.layers, spared, slots, reach)?;
        f.keep_table("splits", &splits);
        let outlined = [
            ("fitting", (&fitting).into()),
            ("splits", (&splits).into()),
            ("light_views", (&maps.light_views).into()),
            ("cascade_draws", (&self.draws).into()),
        ];
        f.outline_cascades(3, outlined.into());
        f.tell_splits(&splits, 3);
        let bound =
            vec![("light_places", (&places).into()), ("fitting", (&fitting).into()), ("splits", (&splits).into())];
        self.maps.resolve(f, &self.mean, &maps, bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fewer places are some of the others', lie about the same middle, and spread a penumbra as wide along both sides.
    #[test]
    fn coarser_sets_are_part_of_finer_ones() {
        let all = nested([4, 3, 2]);
        for (n, off, wide) in [(16, 1e-6, 0.05), (9, 0.05, 0.1), (4, 1e-6, 0.05)] {
            let set = &all[..n];
            let mean = set.iter().sum::<Vec2>() / n as f32;
            let spread = (set.iter().map(|p| (*p - mean) * (*p - mean)).sum::<Vec2>() / n as f32 * 3.0).map(f32::sqrt);
            println!("{n}: middle {mean}, width {spread}");
            assert!(mean.abs().max_element() <= off, "{n}: {mean}");
            assert!((spread - 1.0).abs().max_element() <= wide, "{n}: {spread}");
        }
        assert_eq!(nested([1; 3]), [Vec2::ZERO]);
        // Of a square's half all half planes through the middle hold a half.
        assert!((part_before(dvec2(0.6, 0.8), 0.0) - 0.5).abs() < 1e-9);
        assert!((part_before(DVec2::X, 0.5) - 0.75).abs() < 1e-3);
    }
}
