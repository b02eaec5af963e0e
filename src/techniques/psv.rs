//! Partitioned shadow volumes (Gerhards, Mora, Aveneau, Ghazanfarpour 2015; Mora, Gerhards, Aveneau, Ghazanfarpour 2016).

use super::{Info, Technique};
use crate::frame::Frame;
use crate::gpu::{Buffer, Pass, Table, hold};
use crate::light::Light;
use crate::params::Params;
use crate::scene::shadow_tree::{Order, ShadowTree};
use crate::view::{self, map};
use anyhow::{Result, ensure};
use std::time::Instant;

crate::params! {
    /// The tree of shadow planes.
    pub struct PsvParams {
        "Tree" {
            /// The order in which triangles are inserted. Area: the largest first, which shadow most. Random: by chance, from the set-up's seed. As-is: as the scene has them.
            order: choice("area", ["area", "random", "as-is"]),
            /// Leave out parts of the tree that lie farther from the light than the pixel does.
            prune: flag(true),
            /// How many places in the tree a pixel can keep to come back to. Where these are too few a ray decides.
            max_stack: int(64, 16..=64, "links"),
        }
    }
}

pub static INFO: Info = Info {
    id: "psv",
    title: "Partitioned shadow volumes",
    paper: "Gerhards et al. 2015; Mora et al. 2016",
    family: "Volumes",
    mark: 38,
    doc: "All triangles' shadow volumes in one tree: at each plane through the light and an edge, a pixel goes on to its own side. \
          Exact, and no mesh is too broken for it, but the tree is made anew when the light moves.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: None,
    smooth: |_| false,
    params: &[PsvParams::GROUP],
    main: &[("order", "area,random"), ("prune", "false,true")],
    maps: &[&[
        map(
            "visits",
            "Triangles visited",
            "How many triangles of the tree each pixel visits; each has four planes.",
            view::counts("triangles visited", 1000.0),
        ),
        map(
            "stack",
            "Stack",
            "How many places in the tree were kept at once at each pixel to come back to.",
            view::ramp("links on the stack", "", [0.0, 64.0]),
        ),
    ]],
    needs: |_| &[],
    make: |gpu, _| {
        Ok(Box::new(Psv {
            resolve: Pass::compute(gpu, "walk", FILE, "resolve", INFO.params)?,
            inspect: Pass::compute(gpu, "inspect", FILE, "inspect", INFO.params)?,
            uniform: gpu.buffer("tree", &[0; 32], wgpu::BufferUsages::UNIFORM),
            records: None,
        }))
    },
};

const FILE: &str = "techniques/psv.wgsl";
/// How long the tree is walked, in full-screen passes ([`crate::gpu::Run::in_bands`]).
const COST: u32 = 128;

/// What the tree depends on.
type Key = (u64, Light, Order);

struct Psv {
    resolve: Pass,
    inspect: Pass,
    uniform: Buffer,
    records: Option<(Key, Table)>,
}

/// The part of a light that the tree depends on.
fn without_color(light: &Light) -> Light {
    match *light {
        Light::Directional { to_light, .. } => {
            Light::Directional { to_light, angular_radius: 0.0, color: Default::default() }
        }
        _ => Light::Omni { position: light.position(), range: 0.0, radius: 0.0, color: Default::default() },
    }
}

impl Technique for Psv {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = PsvParams::read(f.values);
        let order = match p.order.as_str() {
            "as-is" => Order::AsIs,
            "area" => Order::Area,
            _ => Order::Random(f.seed),
        };
        let key = (f.revision, without_color(&f.light), order);
        if f.fresh {
            self.records = None;
        }
        let records = hold(&mut self.records, key, |(_, light, order)| {
            [&self.resolve, &self.inspect].into_iter().for_each(Pass::forget);
            let start = Instant::now();
            let bytes = f.geometry.bvh.order.len() as u64 * 32;
            ensure!(
                bytes <= Table::most(f.gpu),
                "the tree of shadow planes takes {} MiB, more than a texture of {} holds; open a scene with fewer triangles",
                bytes.div_ceil(1 << 20),
                f.gpu.info.name
            );
            let tree = ShadowTree::new(f.geometry, f.scene.opaque_count as usize, light, *order)?;
            f.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::cast_slice(&[tree.root, 0, 0, 0]));
            let records = Table::new(f.gpu, "shadow planes", bytemuck::cast_slice(&tree.records));
            f.note("shadow planes (CPU)", start.elapsed().as_secs_f64() * 1e3);
            Ok(records)
        })?;
        f.run(&self.resolve).in_bands(COST).bind("tree", &self.uniform).bind("records", records.view()).per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect).bind("tree", &self.uniform).bind("records", records.view()).per_pixel();
        }
        Ok(())
    }
}
