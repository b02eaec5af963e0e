//! Shadow maps whose film plane is turned so that texels lie where pixels do (Chong 2003).

use super::{FILTERING, Info, Technique, chosen};
use crate::flatland::Metric;
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu};
use crate::light::LightView;
use crate::map::cascades::ANALYSED;
use crate::map::casters::{Casters, Target, Triangles};
use crate::map::filter::LookUp;
use crate::map::fit::diagram::{self, Diagram, Drawing};
use crate::map::fit::film::{self, Parts};
use crate::map::fit::{Kept, Scope, casting, warped};
use crate::map::peel::{Depths, Held, StoredParams};
use crate::map::single::{Fit, scope};
use crate::map::{BiasParams, CasterParams, MOST, MapParams, Maps, light_views, whole};
use crate::params::Params;
use crate::view::{self, Class, Drawn, Legend, View, map};
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec4};
use wgpu::BufferUsages as Use;

crate::params! {
    /// How the film is turned.
    pub struct FilmParams {
        "Film" {
            /// Where the light's film plane stands. Best: where texels lie as pixels do, as far as one plane can do that. Half-angle: at right angles to the middle of what is seen, as a common shadow map has it. The sun has no choice: parallel rays fall evenly on any plane.
            plane: choice("best", ["best", "half-angle"]),
            /// How many maps share the texels of one: the whole film in quarters, and the quarter that gains most in quarters again, each with its own plane and as many texels as it needs.
            maps: choice("1", ["1", "4", "7"]),
            /// What makes a plane good. L1: the mean extent of texels in the picture. L2: the mean square, by geometric stretch; texels that are stretched most then count most, which light that grazes a surface stretches on any plane.
            metric: choice("L1", ["L1", "L2"]) if plane = "best" or maps = "4" or maps = "7",
            /// Places along each side of the picture at which the scene is looked at to choose the plane; for several maps twice as many.
            view_samples: int(32, 8..=128, "per side"),
        }
    }
}

/// Most parts.
const PARTS: usize = 7;

const OWN: &[Class] = &[
    Class::label(0, "part 1"),
    Class::label(1, "2"),
    Class::label(2, "3"),
    Class::label(3, "4"),
    Class::label(4, "5"),
    Class::label(5, "6"),
    Class::label(6, "7"),
];

const SHOWN: &[View] = &[
    map(
        "parts",
        "Parts of the film",
        "The maps that pixels look up, each in a colour of its own.",
        Drawn::Labels(Legend::Classes(OWN)),
    ),
    map(
        "shadow-maps",
        "Shadow maps",
        "All maps side by side, framed in their parts' colours: near the light bright, far dark.",
        Drawn::Labels(Legend::Classes(OWN)),
    ),
    view::aliasing(
        "texels",
        "Texel grid",
        "Each map texel's footprint on the scene, as a chequerboard. Large squares: blocky shadows.",
        Drawn::Cells,
    ),
    map(
        "bias",
        "Bias",
        "How far the comparison is moved along the light's axis at each pixel, all biases together, in texels of its map.",
        view::ramp("bias", "texels", [0.0, 4.0]),
    ),
];

pub static INFO: Info = Info {
    id: "optimal-light-plane",
    title: "Optimal light plane",
    paper: "Chong 2003",
    family: "Warping",
    mark: 46,
    doc: "A lamp's map can be drawn on any plane before it: texels crowd where the plane comes close to the lamp. This one is turned \
          until they crowd where pixels do, by a coarse look at what the camera sees. What all other warps of a lamp's map come to is \
          a choice of that plane too. It may be split into parts with planes of their own.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[FilmParams::GROUP, MapParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "256..8192*2"), ("maps", "1,4,7")],
    maps: &[
        SHOWN,
        ANALYSED,
        &[diagram::view(
            "Left the light's image, right the film: what the camera sees (green), the film's border (yellow) and every sixteenth of its \
             texels. The cross is the middle of what is seen. Of several maps, that of all together.",
        )],
    ],
    needs: |_| &[],
    make: |gpu, info| Ok(Box::new(LightPlane::new(gpu, info)?)),
};

/// The parts' boxes, as `FilmParts` in `shaders/map/film_parts.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct FilmParts {
    /// From (X, 1) in world space to the whole film.
    rows: [Vec4; 3],
    count: u32,
    padding: [u32; 3],
    /// Lowest and highest x and y.
    boxes: [Vec4; MOST],
}

struct LightPlane {
    fit: Fit,
    boxes: Buffer,
    fitted: Buffer,
    /// The light view of each part alone, for drawing.
    single: Vec<Buffer>,
    layers: Held,
    casters: Casters,
    look_up: LookUp,
    drawing: Drawing,
    kept: Kept<Option<Fitted>>,
}

/// A fit and what it was made of.
struct Fitted {
    parts: Parts,
    /// Where in the light's image the samples lie.
    places: Vec<DVec2>,
    boxes: FilmParts,
    views: Vec<LightView>,
    sides: Vec<u32>,
}

/// None if the camera sees nothing that the light reaches.
fn fitted(scope: &Scope, f: &Frame, p: &FilmParams) -> Option<Fitted> {
    let image = scope.image();
    let lamp = scope.light.view_tangent().is_some();
    let several = if p.maps == "1" { 1 } else { 2 };
    let samples = film::samples(scope, &image, f.geometry, several * p.view_samples as usize);
    let metric = if p.metric == "L2" { Metric::L2 } else { Metric::L1 };
    let most = p.maps.parse().unwrap_or(1);
    let outline = casting::outline(scope, &image, f.geometry);
    let parts = film::parts(&samples, &outline, metric, lamp, p.plane == "best", most)?;
    let places: Vec<DVec2> = samples.iter().map(|s| s.place).collect();
    let deepest = scope.deepest(&image, &scope.seen());
    let shares: Vec<f64> = parts.parts.iter().map(|part| part.share).collect();
    let sides = sides(&shares, scope.resolution);
    let (mut views, mut boxes) = (Vec::new(), [Vec4::ZERO; MOST]);
    for ((part, side), to) in parts.parts.iter().zip(&sides).zip(&mut boxes) {
        // As far as any receiver may lie; which of it is covered is found from the receivers.
        let points = if part.outline.is_empty() { &outline } else { &part.outline };
        let before = |p: &&DVec2| warped(&part.film.warp, **p).1 > 0.0;
        let points: Vec<DVec2> = points.iter().filter(before).copied().collect();
        let own = Scope { resolution: *side, ..*scope };
        views.push(own.view(&image, &part.film.warp, &points, deepest)?);
        *to = Vec4::new(part.cell[0].x as f32, part.cell[0].y as f32, part.cell[1].x as f32, part.cell[1].y as f32);
    }
    let row = |i: usize| {
        let r: DVec3 = parts.whole.row(i);
        (image.rows[0] * r.x + image.rows[1] * r.y + image.rows[2] * r.z).as_vec4()
    };
    let boxes = FilmParts { rows: [row(0), row(1), row(2)], count: views.len() as u32, padding: [0; 3], boxes };
    Some(Fitted { parts, places, boxes, views, sides })
}

/// Sides of maps with these shares of the texels of one. A part that no sample lies in may still be looked up by some pixel between them:
/// what such parts take at least, the others go without.
fn sides(shares: &[f64], resolution: u32) -> Vec<u32> {
    if let [_] = shares {
        return vec![resolution];
    }
    let least = (resolution / 8).clamp(16, 64);
    let mut texels = f64::from(resolution).powi(2);
    let mut sides = vec![0; shares.len()];
    loop {
        let rest: f64 = shares.iter().zip(&sides).filter(|(_, side)| **side == 0).map(|(share, _)| share).sum();
        let of = |share: f64| ((share / rest * texels).sqrt() / 8.0) as u32 * 8;
        let small = (0..shares.len()).find(|i| sides[*i] == 0 && (rest == 0.0 || of(shares[*i]) < least));
        let Some(small) = small else {
            let open = shares.iter().zip(&mut sides).filter(|(_, side)| **side == 0);
            open.for_each(|(share, side)| *side = of(*share));
            return sides;
        };
        sides[small] = least;
        texels -= f64::from(least).powi(2);
    }
}

impl LightPlane {
    fn new(gpu: &Gpu, info: &Info) -> Result<LightPlane> {
        let one = || gpu.buffer("light view", &[0; size_of::<LightView>()], Use::UNIFORM);
        Ok(LightPlane {
            fit: Fit::of(gpu, "map/narrow_parts.wgsl", &[])?,
            boxes: gpu.buffer("parts of the film", &[0; size_of::<FilmParts>()], Use::STORAGE),
            fitted: light_views(gpu, "light views"),
            single: (0..PARTS).map(|_| one()).collect(),
            layers: Held::default(),
            casters: Casters::named(["shadow maps", "shadow maps (masked)"]),
            look_up: LookUp::new(gpu, "techniques/optimal_light_plane.wgsl", info.params),
            drawing: Drawing::new(gpu)?,
            kept: Kept::default(),
        })
    }
}

impl Technique for LightPlane {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = FilmParams::read(f.values);
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        let scope = scope(f, reach);
        let made = self.kept.get(f, scope, |s| fitted(s, f, &p));
        // Where nothing is seen that the light reaches, any map will do.
        let (mut views, sides, boxes) = match made {
            Some(made) => (made.views.clone(), made.sides.clone(), made.boxes),
            None => (vec![whole(&scope)?], vec![scope.resolution], FilmParts { count: 1, ..FilmParts::zeroed() }),
        };
        views.iter_mut().for_each(|view| view.reach = reach.metres);
        let count = views.len();
        f.gpu.queue.write_buffer(&self.boxes, 0, bytemuck::bytes_of(&boxes));
        let all = self.fit.write(f, 0, &views);
        let fitted = self.fitted.clone();
        self.fit.run_parts(f, &all, count as u32, &self.boxes, &fitted);
        let depths = Depths::hold(&mut self.layers, f, &sides)?;
        let size = size_of::<LightView>() as u64;
        for (i, side) in sides.iter().enumerate() {
            f.copy(&fitted, i as u64 * size, &self.single[i], size);
            let to = Target::whole(*side, &self.single[i], views[i].perspective == LightView::WARPED);
            self.casters.draw_depths(f, (&depths, i), to, &Triangles::All)?;
        }
        if count == 1 {
            f.outline_view(&fitted);
        }
        let bound = vec![("film_parts", (&self.boxes).into())];
        let maps = Maps { layers: depths.looked_up(), light_views: fitted, sides, bound };
        self.look_up.run(f, &maps, filter, &[])?;
        let drawn = |made: &Fitted| {
            let mut diagram = Diagram::new(&made.parts.whole, &made.places, &[]);
            diagram.cross(made.parts.middle, diagram::MARK);
            diagram
        };
        self.drawing.show(f, "warp", || made.as_ref().map(drawn));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::sides;

    /// All maps together have no more texels than one, and none is too small to look up.
    #[test]
    fn parts_share_the_texels_of_one_map() {
        for resolution in [64, 256, 512, 1024, 8192] {
            for shares in [&[1.0][..], &[0.25; 4], &[0.97, 0.01, 0.01, 0.01], &[0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]] {
                let sides = sides(shares, resolution);
                let texels: u64 = sides.iter().map(|side| u64::from(*side).pow(2)).sum();
                let all = u64::from(resolution).pow(2);
                assert!(texels <= all && texels > all * 7 / 10, "{shares:?} of {resolution}: {sides:?}");
                assert!(sides.iter().all(|side| *side >= 16), "{sides:?}");
            }
        }
    }
}
