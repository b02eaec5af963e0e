//! Maps on the faces of a tetrahedron (Liao 2010) or an octahedron (Engelhardt, Dachsbacher 2008), two faces to a layer, as large as
//! the light is important (Doghramachi 2015).

use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::gpu::Buffer;
use crate::light::Light;
use crate::map::cascades::ANALYSED;
use crate::map::faces::{self, FaceParams, Faces, around};
use crate::map::filter::LookUp;
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams, HardwareParams};
use crate::params::Params;
use crate::scene::Camera;
use crate::setup::MOST_LIGHTS;
use crate::view::{Class, Drawn, Legend, View, map};
use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};

crate::params! {
    /// The solid's maps.
    pub struct AtlasParams {
        "Map" {
            /// The solid whose faces are drawn. Octahedron: eight faces in four layers; its texels differ least in area. Tetrahedron: four faces, one of each two cut in halves, in two layers; fewest draws, largest texels at its corners. Cube: six layers, for comparison.
            solid: choice("octahedron", ["cube", "octahedron", "tetrahedron"]),
            /// Side of each layer's square map; the largest one where it goes by importance.
            resolution: int(640, 16..=8192, "texels"),
            /// What sets the side. Fixed: the resolution. Importance: the size of the light's reach in the picture, so that each of many lights gets what it needs; by powers of two, and not below 32 texels. Atlas: the same, but all lights share the texels of one square; where these are too few, the largest maps are halved until all fit.
            sizing: choice("fixed", ["fixed", "importance", "atlas"]),
            /// Texels of a side for each pixel of the radius of the light's reach.
            importance: float(1.0, 0.25..=4.0, "texels/px") if sizing = ["importance", "atlas"],
            /// Side of each of the square layers that all lights share.
            atlas: choice("2048", ["512", "1024", "2048", "4096", "8192"]) if sizing = "atlas",
        }
    }
}

/// The colours of the lights' slots, in turn.
const OWNERS: [Class; 8] = [
    Class::label(0, "light 1, 9"),
    Class::label(1, "light 2, 10"),
    Class::label(2, "light 3, 11"),
    Class::label(3, "light 4, 12"),
    Class::label(4, "light 5, 13"),
    Class::label(5, "light 6, 14"),
    Class::label(6, "light 7, 15"),
    Class::label(7, "light 8, 16"),
];

const SLOTS: [View; 1] = [map(
    "atlas",
    "Atlas",
    "The square whose texels all lights share, and the slot of each light's maps in it, in the light's colour. The chosen light's slot \
     shows its first layer. All layers are laid out alike. Where the sides are not shared, the square is as large as it must be.",
    Drawn::Labels(Legend::Classes(&OWNERS)),
)];

pub static INFO: Info = Info {
    id: "omni-atlas",
    title: "Tetrahedral and octahedral shadow maps",
    paper: "Liao 2010; Engelhardt, Dachsbacher 2008",
    family: "All directions",
    mark: 24,
    doc: "Maps on the faces of other solids than the cube, which share layers so that no texel is lost. Edges stay straight in each, \
          unlike a paraboloid's. The octahedron's texels are the most even ones by area; the tetrahedron takes the fewest draws. \
          Each of many lights can have maps as large as it is important, cut from one atlas.",
    lights: faces::LIGHTS,
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[AtlasParams::GROUP, FaceParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP, HardwareParams::GROUP],
    ),
    main: &[("resolution", "128..2048*2"), ("solid", "cube,octahedron,tetrahedron"), ("culling", "none,samples")],
    maps: &[&faces::MAPS, &SLOTS, ANALYSED],
    needs: |_| &[],
    make: |gpu, info| {
        let slots = gpu.buffer("slots", &[0; size_of::<Slots>()], wgpu::BufferUsages::UNIFORM);
        let look_up = LookUp::new(gpu, "techniques/omni_atlas.wgsl", info.params);
        Ok(Box::new(OmniAtlas { faces: Faces::new(gpu)?, look_up, slots }))
    },
};

/// As `Slots` in `shaders/techniques/omni_atlas.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Slots {
    count: u32,
    /// Texels.
    side: u32,
    /// The light that is drawn, by its place among the slots.
    own: u32,
    padding: u32,
    each: [[u32; 4]; MOST_LIGHTS],
}

struct OmniAtlas {
    faces: Faces,
    look_up: LookUp,
    slots: Buffer,
}

impl Technique for OmniAtlas {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = AtlasParams::read(f.values);
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        // A map must hold its guard bands and something beside them, whatever the light's importance.
        let powers = (5..).map(|bits| 1 << bits).take_while(|side| *side <= p.resolution);
        let least = powers.into_iter().find(|side| around(f, *side, reach).is_ok()).unwrap_or(32);
        let lamps: Vec<(usize, Light)> = f.lamps.iter().filter(|(_, l)| INFO.refuses(l).is_none()).copied().collect();
        let own = lamps.iter().position(|(i, _)| *i == f.lamp).unwrap_or(0);
        let sides: Vec<u32> = lamps.iter().map(|(_, light)| side(&p, light, &f.eye, f.size[1], least)).collect();
        let sides = if p.sizing == "atlas" { shared(sides, &p, least)? } else { sides };
        let around = around(f, sides[own], reach)?;
        let views = match p.solid.as_str() {
            "cube" => around.cube(),
            "tetrahedron" => around.tetrahedron(),
            _ => around.octahedron(),
        };
        self.faces.prepare(f, &around, &views);
        let maps = self.faces.draw(f, &around, &views)?;
        if f.view == SLOTS[0].id {
            let (places, whole) = placed(&sides);
            let mut slots = Slots { count: sides.len() as u32, side: whole, own: own as u32, ..Slots::zeroed() };
            if p.sizing == "atlas" {
                slots.side = p.atlas_side();
            }
            for (slot, (i, [x, y])) in slots.each.iter_mut().zip(places.into_iter().enumerate()) {
                *slot = [x, y, sides[i], lamps[i].0 as u32];
            }
            f.gpu.queue.write_buffer(&self.slots, 0, bytemuck::bytes_of(&slots));
        }
        self.look_up.run(f, &maps, filter, &[("slots", (&self.slots).into())])
    }
}

impl AtlasParams {
    fn atlas_side(&self) -> u32 {
        self.atlas.parse().unwrap_or(2048)
    }
}

/// Side of a light's layers, texels. By importance R = k · radius of the light's reach in the picture, pixels, down to a power of two;
/// the most that the resolution allows where the camera stands within reach. `rows`: of the picture.
fn side(p: &AtlasParams, light: &Light, camera: &Camera, rows: u32, least: u32) -> u32 {
    if p.sizing == "fixed" {
        return p.resolution;
    }
    let distance = (light.position() - camera.position).length();
    let reach = light.range();
    // Pixels to the metre; of a perspective camera at 1 m.
    let focal = rows as f32 / camera.height_at(1.0);
    let most = power(p.resolution);
    let wanted = match distance > reach {
        _ if camera.height.is_some() => p.importance * focal * reach,
        // The tangent cone of the sphere.
        true => p.importance * focal * reach / (distance * distance - reach * reach).sqrt(),
        false => f32::INFINITY,
    };
    power(wanted.min(most as f32) as u32).clamp(least.min(most), most)
}

/// The largest power of two that is not larger.
fn power(x: u32) -> u32 {
    1 << x.max(1).ilog2()
}

/// Sides whose squares fit into the atlas: the largest are halved as long as need be, the last of equal ones first. Powers of two in
/// a square of a power of two fit if their areas do.
fn shared(mut sides: Vec<u32>, p: &AtlasParams, least: u32) -> Result<Vec<u32>> {
    let atlas = p.atlas_side();
    let area = |sides: &[u32]| sides.iter().map(|s| u64::from(*s).pow(2)).sum::<u64>();
    while area(&sides) > u64::from(atlas).pow(2) {
        let largest = sides.iter().copied().max().unwrap_or(0);
        ensure!(
            largest > least,
            "the maps of {} lights, each of {least}² texels at least, do not fit into an atlas of {atlas}²; choose a larger one, fewer \
             lights, or a narrower filter",
            sides.len()
        );
        if let Some(last) = sides.iter_mut().rev().find(|s| **s == largest) {
            *last /= 2;
        }
    }
    Ok(sides)
}

/// Where squares lie in one, texels, and the side of the smallest that holds them: in the order of a quadtree, the largest first (a
/// buddy allocation without holes). Sides are powers of two, or all equal.
fn placed(sides: &[u32]) -> (Vec<[u32; 2]>, u32) {
    let mut order: Vec<usize> = (0..sides.len()).collect();
    order.sort_by_key(|i| std::cmp::Reverse(sides[*i]));
    let (mut places, mut taken, mut whole) = (vec![[0; 2]; sides.len()], 0u64, 0);
    for i in order {
        let side = u64::from(sides[i]);
        let cell = taken / (side * side);
        // Its bits take turns: those of x, and those of y.
        let part = |first: u32| (0..16).map(|bit| (cell >> (2 * bit + first) & 1) << bit).sum::<u64>();
        places[i] = [0, 1].map(|first| (part(first) * side) as u32);
        whole = places[i].iter().fold(whole, |whole, at| whole.max(at + sides[i]));
        taken += side * side;
    }
    (places, whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(resolution: u32, atlas: &str) -> AtlasParams {
        AtlasParams {
            solid: "octahedron".into(),
            resolution,
            sizing: "atlas".into(),
            importance: 1.0,
            atlas: atlas.into(),
        }
    }

    /// Slots lie in the atlas and apart from each other, whatever their sizes; nobody gets less than he asks for without need, and
    /// nobody whose map is smaller than another's is cut.
    #[test]
    fn slots_fit_and_lie_apart() {
        let mut seed = 7u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed >> 16
        };
        let mut cut = 0;
        for _ in 0..500 {
            let wanted: Vec<u32> = (0..1 + random() % 16).map(|_| 32 << (random() % 6)).collect();
            let sides = shared(wanted.clone(), &params(1024, "1024"), 32).unwrap();
            let area: u32 = sides.iter().map(|s| s * s).sum();
            assert!(area <= 1024 * 1024, "{sides:?}");
            let largest = *sides.iter().max().unwrap();
            for (side, wanted) in sides.iter().zip(&wanted) {
                assert!(side == wanted || 2 * side >= largest, "{wanted} became {side}, beside {largest}");
            }
            if sides != wanted {
                cut += 1;
                assert!(area * 4 > 1024 * 1024, "{wanted:?} became {sides:?}");
            }
            let (places, whole) = placed(&sides);
            assert!(whole <= 1024, "{sides:?} take {whole}");
            for i in 0..sides.len() {
                for j in 0..i {
                    let apart =
                        |k: usize| places[i][k] >= places[j][k] + sides[j] || places[j][k] >= places[i][k] + sides[i];
                    assert!(apart(0) || apart(1), "{sides:?}: {i} at {:?}, {j} at {:?}", places[i], places[j]);
                }
            }
        }
        assert!(cut > 50 && cut < 450, "{cut} of 500 were cut");
        assert!(shared(vec![256; 16], &params(1024, "512"), 256).is_err());
    }

    /// The side follows the angle that the light's reach takes: halved, the map is.
    #[test]
    fn maps_are_as_large_as_their_reach_is_seen() {
        let camera = crate::scene::builtin::build("hall").unwrap().cameras[0].camera;
        let at = |distance: f32, range: f32, fov: f32| {
            let position = camera.position + distance * glam::Vec3::X;
            let light = Light::Omni { position, range, radius: 0.0, color: glam::Vec3::ONE };
            side(&params(1024, "2048"), &light, &Camera { fov, ..camera }, 1080, 32)
        };
        // The focal length is 540 pixels: 540 · 5 / √(20² - 5²) = 139.4, and half as far off 311.8.
        assert_eq!((at(20.0, 5.0, 90.0), at(10.0, 5.0, 90.0), at(4.0, 5.0, 90.0)), (128, 256, 1024));
        assert_eq!((at(1e4, 5.0, 90.0), at(20.0, 5.0, 40.0)), (32, 256));
    }
}
