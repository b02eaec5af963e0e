//! The depth maps of a frame, to be looked into: every texel's depth and samples, and every pixel's place in them.

use super::{Frame, Renderer, STORED};
use crate::gpu::{Buffer, Pass, Recorder, Resource, Slot, hold};
use crate::light::LightView;
use crate::map::filter::alone;
use crate::params::Group;
use anyhow::{Context, Result};
use glam::{DMat3, DVec2, DVec3, Mat2, Vec2, Vec4};
use wgpu::TextureFormat as Format;

/// The depth maps that a technique has drawn.
#[derive(Clone)]
pub(super) struct Offered {
    pub(super) layers: Vec<wgpu::TextureView>,
    /// As many as layers, one behind the other.
    pub(super) light_views: Buffer,
    /// Texels of each side.
    sides: Vec<u32>,
    /// The one that a view of depth shows.
    pub(super) shown: usize,
    warp: Option<Warp>,
    pub(super) teller: Option<Teller>,
}

/// What tells of single pixels how the maps are looked up: the shader of the look-up, and all that it reads.
#[derive(Clone)]
pub(super) struct Teller {
    pub(super) file: String,
    pub(super) groups: &'static [Group],
    pub(super) bound: Vec<(&'static str, Resource)>,
    /// The shader includes `map/look_up.wgsl`; else it has views alone.
    pub(super) looks_up: bool,
}

/// The warp of a map, on the GPU: a shader that includes `shaders/map/warp/warped.wgsl`, and what it reads.
#[derive(Clone)]
struct Warp {
    file: &'static str,
    groups: &'static [Group],
    bound: Vec<(&'static str, Resource)>,
}

/// Places of a warp along a side of the map, at which it is read back: two a texel, as far as that is not too many.
fn nodes(side: u32) -> u32 {
    2 * side.min(1024) + 1
}

/// A pixel's place in the maps, texels, and the number of the map; None: in none.
pub type Place = Option<([f32; 2], u32)>;

/// One of a technique's maps, read back.
pub struct MapLayer {
    /// Its number, and how many there are.
    pub layer: u32,
    pub layers: u32,
    /// Texels of each side.
    pub side: u32,
    /// Stored depths, reversed: 1 near, 0 far; rows from the top.
    pub depth: Vec<f32>,
    pub view: LightView,
    /// Samples per texel, where they could be counted.
    pub samples: Option<Vec<u32>>,
    /// Of each pixel of the picture its place in the maps, texels, and the number of the map; None: in none.
    pub places: Vec<Place>,
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Where the map lies in the light's image of the whole scene; None: the light has none.
    pub light_space: Option<LightSpace>,
}

/// How a map lies in the light's image of the whole scene: the box of a directional light, the cone's square of a spot.
/// Places in the image are shares of its sides, from its upper left corner.
pub struct LightSpace {
    /// Width of the image over its height.
    pub aspect: f32,
    /// From places in the image to places before the warp, shares of the map's sides; homogeneous.
    to_map: DMat3,
    from_map: DMat3,
    /// At [`nodes`] places along each side, rows from the top: where the warp takes them, and where it takes from.
    warp: Vec<Vec4>,
    /// Texels of a side of the map.
    side: f32,
}

impl LightSpace {
    /// `view`: the map's, before its warp.
    fn new(whole: &LightView, view: &LightView, warp: Vec<Vec4>) -> LightSpace {
        // Places before the projection's division are affine in places of the image, as both look along the same rays.
        let [x, y, z] = [whole.row_x, whole.row_y, whole.axis].map(Vec4::as_dvec4);
        let straight = whole.perspective == 0;
        let back = DMat3::from_cols(x.truncate(), y.truncate(), z.truncate()).transpose().inverse();
        let shifts = DVec3::new(x.w, y.w, z.w);
        let depth = 0.5 * f64::from(whole.near + whole.far);
        let clip = |at: DVec2| {
            let ndc = DVec2::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y) * if straight { 1.0 } else { depth };
            let position = back * (ndc.extend(depth) - shifts);
            let [x, y, w] = [view.row_x, view.row_y, view.row_w].map(|row| row.as_dvec4().dot(position.extend(1.0)));
            // As `light_texel` has it, over the map's sides.
            DVec3::new(0.5 * (w + x), 0.5 * (w - y), w)
        };
        let zero = clip(DVec2::ZERO);
        let to_map = DMat3::from_cols(clip(DVec2::X) - zero, clip(DVec2::Y) - zero, zero);
        let aspect = if straight { (y.truncate().length() / x.truncate().length()) as f32 } else { 1.0 };
        LightSpace { aspect, to_map, from_map: to_map.inverse(), warp, side: view.resolution }
    }

    /// The place in the map, texels, of a place in the light's image; None: beyond the projection's horizon.
    pub fn to_texel(&self, at: [f32; 2]) -> Option<[f32; 2]> {
        let p = self.to_map * Vec2::from(at).as_dvec2().extend(1.0);
        let u = (p.z > 0.0).then(|| (p.truncate() / p.z).as_vec2())?;
        // As in WGSL, the warp goes on straight outside the map.
        let inner = u.clamp(Vec2::ZERO, Vec2::ONE);
        Some(((self.warped(inner, |n| Vec2::new(n.x, n.y)) + u - inner) * self.side).into())
    }

    /// The place in the light's image of a place in the map, texels.
    pub fn of_texel(&self, texel: [f32; 2]) -> [f32; 2] {
        let at = (Vec2::from(texel) / self.side).clamp(Vec2::ZERO, Vec2::ONE);
        let p = self.from_map * self.unwarped(at).as_dvec2().extend(1.0);
        (p.truncate() / p.z).as_vec2().into()
    }

    /// Between the four nodes around a place.
    fn warped(&self, at: Vec2, of: impl Fn(Vec4) -> Vec2) -> Vec2 {
        if self.warp.is_empty() {
            return at;
        }
        let nodes = nodes(self.side as u32) as usize;
        let place = at * (nodes - 1) as f32;
        let [x, y] = [place.x, place.y].map(|v| (v as usize).min(nodes - 2));
        let node = |i: usize, k: usize| of(self.warp[(y + k) * nodes + x + i]);
        let t = place - Vec2::new(x as f32, y as f32);
        node(0, 0).lerp(node(1, 0), t.x).lerp(node(0, 1).lerp(node(1, 1), t.x), t.y)
    }

    /// The place before the warp: what the nodes say, made better by Newton's method where the warp bends between them.
    fn unwarped(&self, at: Vec2) -> Vec2 {
        let forward = |u: Vec2| self.warped(u, |n| Vec2::new(n.x, n.y));
        let off = |u: Vec2| at - forward(u);
        let mut best = self.warped(at, |n| Vec2::new(n.z, n.w));
        let mut u = best;
        let step = 0.25 / self.side;
        for _ in 0..8 {
            let around = |by: Vec2| forward((u + by).min(Vec2::ONE)) - forward((u - by).max(Vec2::ZERO));
            let slope = Mat2::from_cols(around(Vec2::new(step, 0.0)), around(Vec2::new(0.0, step))) / (2.0 * step);
            if slope.determinant().abs() < 1e-12 {
                break;
            }
            u = (u + slope.inverse() * off(u)).clamp(Vec2::ZERO, Vec2::ONE);
            if off(u).length_squared() < off(best).length_squared() {
                best = u;
            }
        }
        best
    }
}

impl MapLayer {
    /// The depth of a texel in metres along the light's axis; None: no caster.
    pub fn metres(&self, texel: usize) -> Option<f32> {
        self.depth.get(texel).filter(|d| **d > 0.0).map(|d| self.view.linear_depth(*d))
    }
}

impl Frame<'_> {
    /// Offers the technique's depth maps to be looked at: a view and a side for each, and a buffer with their light views.
    pub fn offer_maps(&mut self, layers: &[wgpu::TextureView], light_views: &Buffer, sides: &[u32]) {
        let (layers, sides) = (layers.into(), sides.into());
        self.offered =
            Some(Offered { layers, light_views: light_views.clone(), sides, shown: 0, warp: None, teller: None });
    }

    /// Tells which of the maps offered last a view of depth shows, if not the first. All have the first one's depth range.
    pub fn show_map(&mut self, layer: usize) {
        if let Some(offered) = &mut self.offered {
            offered.shown = layer;
        }
    }

    /// Tells by which shader the maps offered last are looked up, and what that needs, by name. `looks_up`: it includes
    /// `map/look_up.wgsl`. Only frames that are analysed keep it.
    pub(crate) fn offer_teller(
        &mut self,
        file: impl FnOnce() -> String,
        groups: &'static [Group],
        bound: &[(&'static str, Resource)],
        looks_up: bool,
    ) {
        let analysed = self.wants_analysis();
        if let Some(offered) = self.offered.as_mut().filter(|_| analysed) {
            // With what the technique made known by the way.
            let mut all = self.recorder.known();
            all.extend_from_slice(bound);
            offered.teller = Some(Teller { file: file(), groups, bound: all, looks_up });
        }
    }

    /// Tells by which warp the maps offered last are bent. `bound`: what its shader needs, by name.
    pub(crate) fn offer_warp(
        &mut self,
        file: &'static str,
        groups: &'static [Group],
        bound: &[(&'static str, Resource)],
    ) {
        if let Some(offered) = &mut self.offered {
            offered.warp = Some(Warp { file, groups, bound: bound.into() });
        }
    }
}

impl Renderer {
    /// Reads one of the last frame's maps back, the last one if there are fewer; None: there are none. That frame must have
    /// been analysed.
    pub fn read_layer(&mut self, layer: u32) -> Result<Option<MapLayer>> {
        let Some(Offered { layers, light_views, sides, warp, .. }) = self.offered.clone() else { return Ok(None) };
        let layer = (layer as usize).min(layers.len() - 1);
        let (gpu, side) = (self.gpu.clone(), sides[layer]);
        if self.read_map.is_none() {
            self.read_map = Some(Pass::compute(&gpu, "map to numbers", "read_map.wgsl", "copy_map", &[])?);
        }
        let mut values = Slot::default();
        let out = values.get(&gpu, "map as numbers", [side; 2], Format::R32Float, STORED);
        let mut recorder = Recorder::new(&gpu, &mut self.timer, false, [side; 2]);
        if let Some(pass) = &self.read_map {
            recorder.run(pass).bind("shown", &layers[layer]).bind("values", &out).per_pixel();
            recorder.finish()?;
            pass.forget();
        }
        let depth = match values.texture() {
            Some(texture) => bytemuck::pod_collect_to_vec(&gpu.read_texture(texture)?),
            None => Vec::new(),
        };
        let size = size_of::<LightView>() as u64;
        let view = bytemuck::pod_read_unaligned(&gpu.read_range(&light_views, layer as u64 * size, size)?);
        let samples = self.layer_samples(layer, side)?;
        let places = self.analysis.places(&gpu)?;
        let size = self.targets.size()?;
        let light = self.light.context(super::NO_FRAME)?;
        let light_space = match LightView::whole(&light, self.scene_gpu.bounds, side, 0.0) {
            Some(whole) => {
                let warp = warp.map_or(Ok(Vec::new()), |warp| self.read_warp(&warp, nodes(side)))?;
                Some(LightSpace::new(&whole, &view, warp))
            }
            None => None,
        };
        Ok(Some(MapLayer {
            layer: layer as u32,
            layers: layers.len() as u32,
            side,
            depth,
            view,
            samples,
            places,
            size,
            light_space,
        }))
    }

    /// The nodes of [`LightSpace`], so many along each side.
    fn read_warp(&mut self, warp: &Warp, nodes: u32) -> Result<Vec<Vec4>> {
        let gpu = self.gpu.clone();
        let pass = hold(&mut self.read_warp, warp.file, |file| {
            Pass::compute(&gpu, "warp to numbers", &alone(file), "tabulate", warp.groups)
        })?;
        let mut values = Slot::default();
        let out = values.get(&gpu, "warp as numbers", [nodes; 2], Format::Rgba32Float, STORED);
        let mut recorder = Recorder::new(&gpu, &mut self.timer, false, [nodes; 2]);
        for (name, (_, buffer)) in self.made.iter().flat_map(|made| &made.params) {
            recorder.set(name, buffer);
        }
        recorder.run(pass).bind_all(&warp.bound).bind("warp_nodes", &out).per_pixel();
        recorder.finish()?;
        pass.forget();
        let texture = values.texture().context(super::NO_FRAME)?;
        Ok(bytemuck::pod_collect_to_vec(&gpu.read_texture(texture)?))
    }

    fn layer_samples(&self, layer: usize, side: u32) -> Result<Option<Vec<u32>>> {
        let Some(maps) = self.analysis.maps() else { return Ok(None) };
        let (width, first) = (maps.size[0] as u64, layer as u64 * maps.layer());
        let mut samples = vec![0; side as usize * side as usize];
        let counted = self.analysis.counts(&self.gpu, |at, counts| {
            for (i, count) in counts.iter().enumerate() {
                let Some(texel) = (at + i as u64).checked_sub(first).filter(|t| *t < maps.layer()) else { continue };
                let (x, y) = (texel % width, texel / width);
                if x < side as u64 && y < side as u64 {
                    samples[(y * side as u64 + x) as usize] = *count;
                }
            }
        })?;
        Ok(counted.then_some(samples))
    }
}
