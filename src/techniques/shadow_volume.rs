//! Shadow volumes: of the silhouette (Heidmann 1991; Kim, Kim, Turk 2008), and of each triangle by itself.

use super::{Info, Technique};
use crate::frame::{DRAWN, Frame, STORED};
use crate::gpu::{Buffer, Gpu, Need, Pass, Raster, Slot, hold};
use crate::light::Light;
use crate::map::silhouettes::{self, Kind, Silhouettes, groups};
use crate::params::{Group, Params};
use crate::scene::Camera;
use crate::view::{self, Class, Drawn, Legend, View};
use anyhow::Result;
use glam::DVec3;
use rayon::prelude::*;
use wgpu::{BufferUsages as Use, StencilOperation as Op, TextureFormat as Format};

crate::params! {
    /// How volumes are counted.
    pub struct VolumeParams {
        "Volumes" {
            /// Where a pixel's ray counts the volumes that it is in. Zfail: behind the surface, up to infinity, which is always right. Zpass: before it, which takes fewer triangles, but is wrong where the eye is in a volume or the near plane cuts one. Auto: before it, unless some triangle stands between the light and the near plane.
            method: choice("zfail", ["zfail", "zpass", "auto"]),
            /// What counts. Additive: blending into floats; faces that stand for several count as many at once. It runs over at 16 million faces behind a pixel, or at 2048 on adapters that blend 16-bit floats only. Stencil8: the stencil, as when volumes were new, which runs over at 256.
            counting: choice("additive", ["additive", "stencil8"]),
            /// What says whether a volume's face lies before or behind the surface. Exact: the face's plane and the surface's position, in the fragment shader. Buffer: the depth test, as when volumes were new; it is faster, and wrong here and there at edges, by the rounding of what the rasteriser interpolates.
            depth_test: choice("exact", ["exact", "buffer"]) if counting = "stencil8",
            /// What triangles cast that have holes by their texture, as leaves and grass: a volume can have none. Nothing is right more often.
            holes: choice("nothing", ["nothing", "whole"]),
        }
    }
}

crate::params! {
    /// What volumes are made of.
    pub struct TopologyParams {
        "Volumes" {
            /// Whose volumes are counted. Multiplicity: those of all triangles, of which sides that cancel are left out; right whatever the mesh is like. Closed: those of triangles whose front faces the light, half as many; right where meshes are closed and their fronts are outside.
            topology: choice("multiplicity", ["multiplicity", "closed"]),
        }
    }
}

const COUNT: View = view::map(
    "volume-count",
    "Volumes counted",
    "How many volumes each pixel lies in: with topology = multiplicity the triangles between it and the light, with closed only those \
     whose front faces the light. A count below 0, which is wrong, has no colours of its own: -1 is shown as 1.",
    view::ramp("volumes around the pixel, without the sign", "", [0.0, 8.0]),
);
const OVERDRAW: View = view::map(
    "volume-overdraw",
    "Volume overdraw",
    "How many faces of volumes are drawn over each pixel, before or behind what it sees: what the technique costs.",
    view::counts("fragments per pixel", 1000.0),
);
const LINES: View = view::map(
    "volume-lines",
    "Volumes as lines",
    "The edges of all sides of volumes, from the caster to infinity; faint behind surfaces.",
    Drawn::Labels(Legend::Classes(&[Class::label(1, "edge of a volume's side; faint behind surfaces")])),
);

pub static INFO: Info = Info {
    id: "shadow-volume",
    title: "Shadow volumes",
    paper: "Crow 1977; Heidmann 1991; Kim, Kim, Turk 2008",
    family: "Volumes",
    mark: 33,
    doc: "The space that triangles hide from the light, drawn as polygons and counted at each pixel. No map, no resolution \
          and no bias: the hard shadow is exact. It takes fill rate instead, and knows no holes in leaves.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: None,
    smooth: |_| false,
    params: &[VolumeParams::GROUP, TopologyParams::GROUP],
    main: &[("method", "zfail,auto")],
    maps: &[&[COUNT, OVERDRAW, silhouettes::EDGES, LINES]],
    needs: |_| &[Need::StorageBuffers(5)],
    make: |gpu, info| Ok(Box::new(Volumes::new(gpu, info, "techniques/shadow_volume.wgsl")?)),
};

pub static TRIANGLES: Info = Info {
    id: "shadow-volume-tri",
    title: "Shadow volumes of triangles",
    paper: "Crow 1977; Heidmann 1991",
    family: "Volumes",
    mark: 34,
    doc: "A closed volume for each triangle by itself. It asks nothing of the mesh, not even which triangles are neighbours, \
          and draws many times the sides that a silhouette has.",
    lights: INFO.lights,
    filter: None,
    smooth: |_| false,
    params: &[VolumeParams::GROUP],
    main: &[("method", "zfail,auto")],
    maps: &[&[COUNT, OVERDRAW, LINES]],
    needs: |_| &[],
    make: |gpu, info| Ok(Box::new(Volumes::new(gpu, info, "techniques/shadow_volume_tri.wgsl")?)),
};

/// How long it takes to draw the sides of volumes that cover the picture some hundred times, in full-screen passes
/// ([`crate::gpu::Run::in_bands`]); each band goes through all their corners again.
const SIDES_COST: u32 = 8;

/// What the passes depend on.
#[derive(Clone, Copy, PartialEq)]
struct State {
    z_pass: bool,
    additive: bool,
    exact: bool,
    /// Triangles cast with their front only.
    closed: bool,
    /// Triangles with holes by their texture cast as if they had none.
    masked: bool,
    /// Sides end in one point.
    one_far_end: bool,
}

impl State {
    /// What an 8-bit stencil holds from here on is taken for a count below 0, as in WGSL. Z-pass may count as many too few as the
    /// eye lies in volumes; z-fail few, and only by wrong depth tests or open meshes.
    fn negative_from(&self) -> u32 {
        match (self.z_pass, self.exact && !self.closed) {
            (true, _) => 128,
            (false, false) => 200,
            (false, true) => 256,
        }
    }
}

struct Passes {
    /// What a stencil counts the one way, and the other: it cannot tell faces from one another. Blending takes all at once.
    caps: Vec<Pass>,
    sides: Vec<Pass>,
    resolve: Pass,
    inspect: Pass,
    fronts_only: Buffer,
    negative_from: Buffer,
    sources: Sources,
}

/// Where sides come from.
enum Sources {
    Silhouettes(Box<Silhouettes>),
    Triangles { face: Pass, facing: Option<(u32, Buffer)> },
}

/// Passes that only views need.
struct Views {
    overdraw: [Pass; 2],
    inspect_overdraw: Pass,
    lines: Pass,
    inspect_lines: Pass,
    /// The silhouette's own, and what counts lines.
    silhouette: Option<(Pass, Pass, Buffer)>,
}

/// What decides whether something stands before the eye: the scene's revision, camera, picture and light.
type Eye = (u64, Camera, [u32; 2], Light);

struct Volumes {
    file: &'static str,
    info: &'static Info,
    receive: Pass,
    receivers: Slot,
    sums: Slot,
    drawn: Slot,
    overflowing: Buffer,
    /// As `part` in WGSL.
    parts: [Buffer; 3],
    /// The stencil of a depth buffer.
    stencil: Option<(wgpu::TextureView, wgpu::TextureView)>,
    passes: Option<(State, Passes)>,
    views: Option<((), Views)>,
    /// Whether something stands between the light and the near plane.
    before_eye: Option<(Eye, bool)>,
}

impl Volumes {
    fn new(gpu: &Gpu, info: &'static Info, file: &'static str) -> Result<Volumes> {
        Ok(Volumes {
            file,
            info,
            receive: Pass::compute(gpu, "receivers", file, "receive", info.params)?,
            receivers: Slot::default(),
            sums: Slot::default(),
            drawn: Slot::default(),
            overflowing: gpu.room("overflowing", 16, Use::STORAGE | Use::COPY_DST | Use::COPY_SRC),
            parts: [0, 1, 2].map(|part| word(gpu, "part", part)),
            stencil: None,
            passes: None,
            views: None,
            before_eye: None,
        })
    }

    fn silhouettes(&self) -> bool {
        self.info.id == INFO.id
    }
}

/// Adds to what is there.
const ADDED: wgpu::BlendState = {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: add, alpha: add }
};

/// The stencil counts front faces one way and back faces the other; `turned`: of faces whose normal points inside.
fn stencil(gpu: &Gpu, state: &State, turned: bool) -> wgpu::DepthStencilState {
    let face = |counted| {
        // The depth test that counts: each fragment that the shader kept; nearer ones; all others, equal ones among them.
        let [pass_op, depth_fail_op] = match (state.exact, state.z_pass) {
            (true, _) | (false, true) => [counted, Op::Keep],
            (false, false) => [Op::Keep, counted],
        };
        wgpu::StencilFaceState { compare: wgpu::CompareFunction::Always, fail_op: Op::Keep, depth_fail_op, pass_op }
    };
    let [front, back] = match state.z_pass != turned {
        true => [Op::IncrementWrap, Op::DecrementWrap],
        false => [Op::DecrementWrap, Op::IncrementWrap],
    };
    wgpu::DepthStencilState {
        format: gpu.depth_stencil(),
        depth_write_enabled: Some(false),
        depth_compare: Some(match state.exact {
            true => wgpu::CompareFunction::Always,
            false => wgpu::CompareFunction::Greater,
        }),
        stencil: wgpu::StencilState { front: face(front), back: face(back), read_mask: 0xff, write_mask: 0xff },
        bias: Default::default(),
    }
}

/// A number for shaders.
fn word(gpu: &Gpu, label: &str, value: u32) -> Buffer {
    gpu.buffer(label, bytemuck::bytes_of(&[value, 0, 0, 0]), Use::UNIFORM)
}

impl Passes {
    fn new(gpu: &Gpu, file: &'static str, silhouettes: bool, groups: &[Group], state: &State) -> Result<Passes> {
        let fragment = match (state.additive, state.z_pass) {
            (true, true) => Some("add_before"),
            (true, false) => Some("add_behind"),
            (false, true) => Some("keep_before"),
            (false, false) => Some("keep_behind"),
        };
        let sums = [gpu.blended_sums()];
        let draw = |name, vertex, turned| {
            let raster = Raster {
                vertex,
                fragment: fragment.filter(|_| state.exact),
                targets: if state.additive { &sums } else { &[] },
                depth: (!state.additive).then(|| stencil(gpu, state, turned)),
                blend: state.additive.then_some(ADDED),
                ..Raster::default()
            };
            Pass::render(gpu, name, file, raster, groups)
        };
        let turns: &[bool] = if state.additive { &[false] } else { &[false, true] };
        let all = |name, vertex| turns.iter().map(|turned| draw(name, vertex, *turned)).collect::<Result<Vec<_>>>();
        let [resolve, inspect] = match state.additive {
            true => ["resolve_sums", "inspect_sums"],
            false => ["resolve_stencil", "inspect_stencil"],
        };
        let kind = Kind {
            vertices: if state.one_far_end { 3 } else { 6 },
            both_sides: !state.closed,
            repeated: !state.additive,
            masked: state.masked,
        };
        let sources = match silhouettes {
            true => Sources::Silhouettes(Box::new(Silhouettes::of(gpu, kind)?)),
            false => Sources::Triangles { face: silhouettes::face(gpu, state.masked)?, facing: None },
        };
        Ok(Passes {
            caps: all("caps", if state.z_pass { "thin_cap_corner" } else { "cap_corner" })?,
            sides: all("sides", "side_corner")?,
            resolve: Pass::compute(gpu, "resolve", file, resolve, groups)?,
            inspect: Pass::compute(gpu, "inspect", file, inspect, groups)?,
            fronts_only: word(gpu, "fronts only", state.closed as u32),
            negative_from: word(gpu, "negative from", state.negative_from()),
            sources,
        })
    }
}

impl Views {
    fn new(gpu: &Gpu, file: &'static str, groups: &[Group], silhouettes: bool) -> Result<Views> {
        let draw = |name, vertex, fragment, topology, operation| {
            let part = wgpu::BlendComponent { operation, ..ADDED.color };
            let raster = Raster {
                vertex,
                fragment: Some(fragment),
                targets: &[gpu.blended_sums()],
                topology,
                blend: Some(wgpu::BlendState { color: part, alpha: part }),
                ..Raster::default()
            };
            Pass::render(gpu, name, file, raster, groups)
        };
        use wgpu::BlendOperation::{Add, Max};
        use wgpu::PrimitiveTopology::{LineList, TriangleList};
        let faces = |vertex| draw("inspect", vertex, "add_one", TriangleList, Add);
        let lines = |vertex| draw("inspect", vertex, "draw_lines", LineList, Max);
        let compute = |entry| Pass::compute(gpu, "inspect", file, entry, groups);
        let own = || -> Result<_> {
            let draws = gpu.room("draws of lines", 32, Use::STORAGE | Use::INDIRECT);
            Ok((silhouettes::lines(gpu, "inspect", file, groups)?, compute("count_lines")?, draws))
        };
        Ok(Views {
            overdraw: [faces("cap_corner")?, faces("side_corner")?],
            inspect_overdraw: compute("inspect_overdraw")?,
            lines: lines("volume_line")?,
            inspect_lines: compute("inspect_lines")?,
            silhouette: if silhouettes { Some(own()?) } else { None },
        })
    }
}

/// Whether a triangle reaches into the pyramid over the near rectangle whose top is the light, so that the eye may lie in its
/// volume (Everitt, Kilgard 2002).
fn stands_before(f: &Frame) -> bool {
    let (camera, [x, y, corner]) = (f.eye, f.eye.rays(f.size));
    let [w, h] = f.size.map(f64::from);
    let (eye, near) = (camera.position.as_dvec3(), f64::from(camera.near));
    let forward = camera.forward().as_dvec3();
    let at_near = |ray: DVec3| if camera.height.is_some() { ray + near * forward } else { near * ray };
    let rectangle = [corner, corner + x * w, corner + x * w + y * h, corner + y * h].map(|ray| eye + at_near(ray));
    let middle = (rectangle[0] + rectangle[2]) / 2.0;
    let light = f.light.position().as_dvec3();
    let directional = matches!(f.light, Light::Directional { .. });
    let towards = |p: DVec3| if directional { light } else { light - p };
    // Points inside are on their positive sides.
    let side = forward.dot(towards(middle));
    let [low, high] = f.geometry.bounds.map(|b| b.as_dvec3());
    let slack = 1e-6 * (low.abs().max(high.abs()).max_element() + (eye - low).length());
    if side.abs() <= slack * towards(middle).length().max(1.0) {
        return true;
    }
    let mut planes = vec![(rectangle[0], forward * side.signum())];
    for i in 0..4 {
        let (a, b) = (rectangle[i], rectangle[(i + 1) % 4]);
        let normal = (b - a).cross(towards(a)).normalize_or_zero();
        planes.push((a, if normal.dot(middle - a) < 0.0 { -normal } else { normal }));
    }
    (0..f.geometry.triangles.len()).into_par_iter().any(|i| {
        let corners = f.geometry.corners(i).map(|c| c.as_dvec3());
        // Apart by a plane of the pyramid, or by the triangle's own.
        if planes.iter().any(|(a, normal)| corners.iter().all(|c| normal.dot(*c - *a) < -slack)) {
            return false;
        }
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        let height = |p: &DVec3| normal.dot(*p - corners[0]);
        let top = if directional { normal.dot(light) } else { height(&light) };
        let side = top.signum();
        !(side * top > slack && rectangle.iter().all(|p| side * height(p) > slack))
    })
}

impl Technique for Volumes {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = VolumeParams::read(f.values);
        let closed = self.silhouettes() && TopologyParams::read(f.values).topology == "closed";
        let z_pass = match p.method.as_str() {
            "zfail" => false,
            method => {
                let key = (f.revision, f.eye, f.size, f.light);
                let before = *hold(&mut self.before_eye, key, |_| Ok(stands_before(f)))?;
                if before && method == "zpass" {
                    f.tell_note(
                        "Some triangle stands between the light and the near plane: the eye may lie in its volume, where method = zpass \
                         counts too few."
                            .into(),
                    );
                }
                method == "zpass" || !before
            }
        };
        let additive = p.counting == "additive";
        let state = State {
            z_pass,
            additive,
            exact: additive || p.depth_test == "exact",
            closed,
            masked: p.holes == "whole",
            one_far_end: matches!(f.light, Light::Directional { .. }) && f.eye.height.is_none(),
        };
        let (gpu, file, info, silhouettes) = (f.gpu, self.file, self.info, self.silhouettes());
        let make = |state: &State| Passes::new(gpu, file, silhouettes, info.params, state);
        let passes = hold(&mut self.passes, state, make)?;
        let (triangles, corners) = (f.scene.triangle_count, if state.one_far_end { 3 } else { 6 });

        let draw = match &mut passes.sources {
            Sources::Silhouettes(silhouettes) => {
                let (draw, found) = silhouettes.find(f)?;
                if closed && found.open + found.twisted > 0 {
                    f.tell_note(format!(
                        "The meshes have {} open edges and {} along which fronts and backs meet: what turns its back to the light \
                         there casts no shadow with topology = closed.",
                        found.open, found.twisted
                    ));
                }
                Some(draw)
            }
            Sources::Triangles { face, facing } => {
                let room = |count: &u32| Ok(gpu.room("facing", u64::from(*count) * 4, Use::STORAGE));
                f.set("facing", &*hold(facing, triangles, room)?);
                let [x, y] = groups(triangles);
                f.run(face).dispatch(x, y, 1);
                None
            }
        };
        let masked = triangles - f.scene.opaque_count;
        if masked > 0 {
            f.tell_note(format!(
                "{masked} triangles have holes by their texture, which volumes cannot have: they cast {}.",
                if state.masked { "as if they had none" } else { "no shadow" }
            ));
        }
        let sides = |p: &mut wgpu::RenderPass| match &draw {
            Some(draw) => p.draw_indirect(draw, 0),
            None => p.draw(0..triangles * 3 * corners, 0..1),
        };
        // Of a directional light all far corners are one point.
        let caps = if state.z_pass || state.one_far_end { 1 } else { 2 };
        let caps = |p: &mut wgpu::RenderPass| p.draw(0..triangles * 3, 0..caps);

        f.set("fronts_only", &passes.fronts_only);
        f.set("negative_from", &passes.negative_from);
        f.set("part", &self.parts[0]);
        if state.exact {
            let receivers = self.receivers.get(gpu, "receivers", f.size, Format::Rgba32Uint, STORED);
            f.run(&self.receive).bind("receivers_out", &receivers).of_picture().per_pixel();
            f.set("receivers", &receivers);
        } else {
            self.receivers = Slot::default();
        }
        if state.additive {
            let sums = self.sums.get(gpu, "sums", f.size, gpu.blended_sums(), DRAWN);
            f.run(&passes.caps[0]).of_picture().draw(&[&sums], None, true, caps);
            f.run(&passes.sides[0]).in_bands(SIDES_COST).of_picture().draw(&[&sums], None, false, sides);
            f.run(&passes.resolve).bind("sums", &sums).of_picture().per_pixel();
            if f.wants_any_map() {
                f.run(&passes.inspect).bind("sums", &sums).of_picture().per_pixel();
            }
        } else {
            self.sums = Slot::default();
            let depth = f.depth.clone();
            let aspect = wgpu::TextureViewDescriptor { aspect: wgpu::TextureAspect::StencilOnly, ..Default::default() };
            let stencil = &*hold(&mut self.stencil, depth.clone(), |d| Ok(d.texture().create_view(&aspect)))?;
            let depth = Some((&depth, 0.0));
            f.clear(&self.overflowing);
            for (i, part) in self.parts[1..].iter().enumerate() {
                let run = f.run(&passes.caps[i]).bind("part", part).of_picture();
                let run = if i == 0 { run.counting_in_stencil() } else { run.counting_on_in_stencil() };
                run.draw(&[], depth, false, caps);
            }
            for (pass, part) in passes.sides.iter().zip(&self.parts[1..]) {
                let run = f.run(pass).in_bands(SIDES_COST).bind("part", part).of_picture();
                run.counting_on_in_stencil().draw(&[], depth, false, sides);
            }
            let counted = [("stencil", stencil.into()), ("overflowing", (&self.overflowing).into())];
            f.run(&passes.resolve).bind_all(&counted).of_picture().per_pixel();
            if f.wants_any_map() {
                f.run(&passes.inspect).bind_all(&counted).of_picture().per_pixel();
            }
            f.tell_counted(&self.overflowing, match state.negative_from() {
                256 => |pixels| {
                    format!(
                        "{pixels} pixels count 200 volumes and more: an 8-bit stencil runs over at 256, and counts such pixels as lit; \
                         counting = additive does not."
                    )
                },
                _ => |pixels| {
                    format!(
                        "{pixels} pixels' stencils end at 200 to 255: counts below 0, which wrong depth tests and open meshes leave, or \
                         200 volumes and more, of which 256 run over; volume-count shows the former."
                    )
                },
            });
        }

        if !f.wants_any_map() || f.view == COUNT.id {
            return Ok(());
        }
        let views = hold(&mut self.views, (), |_| Views::new(gpu, file, info.params, silhouettes))?;
        let drawn = self.drawn.get(gpu, "drawn for a view", f.size, gpu.blended_sums(), DRAWN);
        if f.view == OVERDRAW.id {
            let [cap, side] = &views.overdraw;
            f.run(cap).of_picture().uncounted().draw(&[&drawn], None, true, caps);
            f.run(side).of_picture().uncounted().draw(&[&drawn], None, false, sides);
            f.run(&views.inspect_overdraw).bind("drawing", &drawn).of_picture().per_pixel();
            return Ok(());
        }
        if let (Some((silhouette, count, draws)), Some(draw)) = (&views.silhouette, &draw) {
            f.run(count).bind("draw", draw).bind("line_draws", draws).dispatch(1, 1, 1);
            let (pass, at) = if f.view == silhouettes::EDGES.id { (silhouette, 0) } else { (&views.lines, 16) };
            f.run(pass).of_picture().uncounted().draw(&[&drawn], None, true, |p| p.draw_indirect(draws, at));
        } else {
            let all = |p: &mut wgpu::RenderPass| p.draw(0..triangles * 18, 0..1);
            f.run(&views.lines).of_picture().uncounted().draw(&[&drawn], None, true, all);
        }
        f.run(&views.inspect_lines).bind("drawing", &drawn).of_picture().per_pixel();
        Ok(())
    }
}
