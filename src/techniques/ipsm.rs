//! Improved paraboloid shadow maps (Vanek, Navratil, Herout, Zemcik 2011).

use super::cube::look_up;
use super::dual_paraboloid::{SideParams, plain, toward_view};
use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::map::cascades::ANALYSED;
use crate::map::faces::{self, FaceParams, Faces, around};
use crate::map::filter::LookUp;
use crate::map::fit::Scope;
use crate::map::paraboloid::CurvedParams;
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams};
use crate::params::Params;
use anyhow::Result;
use glam::DVec3;

crate::params! {
    /// Navratil 2015, section 4.1.
    pub struct IpsmParams {
        "Cone" {
            /// The cone around what the camera sees. Mean: around the mean direction of the corners, as published. Smallest: the narrowest that holds them.
            cone: choice("smallest", ["mean", "smallest"]),
            /// The depths that the camera's frustum is cut to. Samples: between the nearest and the farthest pixel that the light may reach, found on the GPU. Scene: as far as the scene goes.
            depths: choice("samples", ["samples", "scene"]),
            /// By how much the range of depths is widened at both ends.
            depth_margin: float(2.0, 0.0..=10.0, "%"),
            /// Widest half angle of the cone; beyond it plain paraboloids are drawn: two, or a hemisphere light's one.
            widest: float(90.0, 30.0..=90.0, "°"),
            /// Share of the last frame's axis that stays, so that the map turns gently.
            smoothing: float(0.0, 0.0..=0.9, "none" => "much"),
        }
    }
}

pub static INFO: Info = Info {
    id: "ipsm",
    title: "Improved paraboloid shadow map",
    paper: "Vanek, Navratil, Herout, Zemcik 2011",
    family: "All directions",
    mark: 22,
    doc: "One paraboloid, turned towards what the camera sees and magnified to it. Far better than two plain ones while the lamp \
          stands outside the view; once it is inside, two plain ones are all that is left, and the picture changes abruptly.",
    lights: faces::LIGHTS,
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[IpsmParams::GROUP, SideParams::GROUP, FaceParams::GROUP, CurvedParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "128..4096*2"), ("depths", "scene,samples"), ("raster", "linear,exact")],
    maps: &[&faces::MAPS, ANALYSED],
    needs: |_| &[],
    make: |gpu, info| Ok(Box::new(Ipsm::new(gpu, info)?)),
};

struct Ipsm {
    faces: Faces,
    look_up: LookUp,
    range: Buffer,
    find_range: Pass,
    aim: Pass,
    /// The last frame's axis.
    last_axis: Buffer,
}

/// Half the angle of the cone around directions, radians, by their mean as published; None: they surround the light.
fn mean_cone(directions: &[DVec3]) -> Option<f64> {
    let axis = directions.iter().sum::<DVec3>().try_normalize()?;
    directions.iter().map(|d| d.dot(axis).clamp(-1.0, 1.0).acos()).max_by(f64::total_cmp)
}

impl Ipsm {
    fn new(gpu: &Gpu, info: &'static Info) -> Result<Ipsm> {
        let pass = |name, entry| Pass::compute(gpu, name, "techniques/ipsm.wgsl", entry, info.params);
        let zero = |label| gpu.buffer(label, &[0; 16], wgpu::BufferUsages::STORAGE);
        Ok(Ipsm {
            faces: Faces::new(gpu)?,
            look_up: look_up(gpu, info),
            range: zero("depth range"),
            find_range: pass("depth range", "find_range")?,
            aim: pass("fit: cone", "aim")?,
            last_axis: zero("last axis"),
        })
    }
}

impl Technique for Ipsm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = IpsmParams::read(f.values);
        let filter = chosen(f.values);
        let around = around(f, SideParams::read(f.values).resolution, (filter.reach)(f))?;
        let scope = Scope::of(f, around.side as u32, 0.0);
        let eye = scope.eye();
        let directions: Vec<DVec3> =
            eye.corners().iter().filter_map(|corner| (*corner - around.light).try_normalize()).collect();
        let inside = eye.planes().iter().all(|plane| plane.dot(around.light.extend(1.0)) >= 0.0);
        // The narrowest cone around a part of the frustum is no wider than any around all of it. Where this says nothing, both kinds
        // of maps are held, and the GPU decides.
        let narrowest = p.cone == "smallest" && p.smoothing == 0.0;
        let widest = (p.widest as f64).min(89.9).to_radians();
        let fits = narrowest && mean_cone(&directions).is_some_and(|half| 1.01 * half <= widest);
        let mut sides = plain(&around, f, || toward_view(&around, f));
        if fits && !inside {
            sides.truncate(1);
        }
        self.faces.rewritten();
        self.faces.prepare(f, &around, &sides);
        if !inside {
            f.clear(&self.range);
            let [w, h] = f.size.map(|s| s.div_ceil(64));
            f.run(&self.find_range).bind("range", &self.range).dispatch(w, h, 1);
            if f.fresh {
                f.clear(&self.last_axis);
            }
            f.run(&self.aim)
                .bind("range", &self.range)
                .bind("aimed_faces", &self.faces.uniform)
                .bind("aimed_views", &self.faces.light_views)
                .bind("last_axis", &self.last_axis)
                .dispatch(1, 1, 1);
        }
        let maps = self.faces.draw(f, &around, &sides)?;
        self.look_up.run(f, &maps, filter, &[])
    }
}
