//! Dual paraboloid shadow maps (Brabec, Annen, Seidel 2002), with a side culled that no pixel needs (Osman, Bukowski, McEvoy 2006).

use super::cube::{Solid, look_up};
use super::{FILTERING, Info};
use crate::frame::Frame;
use crate::map::cascades::ANALYSED;
use crate::map::faces::{self, FaceParams, Faces, frame_of, own_axis};
use crate::map::fit::Scope;
use crate::map::fit::faces::{Around, Face};
use crate::map::paraboloid::CurvedParams;
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams};
use crate::params::Params;
use glam::{DMat3, DVec3};

crate::params! {
    /// A paraboloid's sides.
    pub struct SideParams {
        "Map" {
            /// Side of each square map. A lamp has two, a hemisphere light one.
            resolution: int(1024, 16..=8192, "texels"),
            /// Which way an omni light's maps look. View: the first one at what the camera sees, so that often one is enough. Fixed: down and up.
            orientation: choice("view", ["view", "fixed"]),
        }
    }
}

pub static INFO: Info = Info {
    id: "dual-paraboloid",
    title: "Dual paraboloid shadow map",
    paper: "Brabec, Annen, Seidel 2002",
    family: "All directions",
    mark: 21,
    doc: "Two maps, each of half of all directions. A third of a cube's memory and passes; but straight edges become arcs, which \
          large triangles miss unless they are split or met exactly, and the middle of each map is four times as coarse as its rim.",
    lights: faces::LIGHTS,
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[SideParams::GROUP, FaceParams::GROUP, CurvedParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "128..4096*2"), ("raster", "linear,subdivide,exact"), ("culling", "none,samples")],
    maps: &[&faces::MAPS, ANALYSED],
    needs: |_| &[],
    make: |gpu, info| {
        let side = |f: &Frame| SideParams::read(f.values).resolution;
        Ok(Box::new(Solid { faces: Faces::new(gpu)?, look_up: look_up(gpu, info), side, views: sides }))
    },
};

/// The sides around a light.
pub fn sides(around: &Around, f: &Frame) -> Vec<Face> {
    plain(around, f, || match SideParams::read(f.values).orientation.as_str() {
        "view" => toward_view(around, f),
        _ => None,
    })
}

/// A hemisphere light's one side, or the two of an omni light: the first in that direction, or down.
pub fn plain(around: &Around, f: &Frame, first: impl FnOnce() -> Option<DVec3>) -> Vec<Face> {
    let own = own_axis(&f.light);
    let first = frame_of(own.or_else(first).unwrap_or(DVec3::NEG_Y));
    let frames = [first, DMat3::from_cols(-first.x_axis, first.y_axis, -first.z_axis)];
    let sides = frames.iter().enumerate().take(if own.is_some() { 1 } else { 2 });
    sides.map(|(i, frame)| around.paraboloid(*frame, DMat3::IDENTITY, i as u32)).collect()
}

/// The direction from the light to the middle of what the camera sees of the scene; None if it sees nothing.
pub fn toward_view(around: &Around, f: &Frame) -> Option<DVec3> {
    let scope = Scope::of(f, around.side as u32, 0.0);
    scope.seen_of(scope.cuboid()).center().and_then(|middle| (middle - around.light).try_normalize())
}
