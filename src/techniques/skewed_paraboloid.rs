//! Paraboloid shadow maps with a skewed cut (Navratil, Zemcik, Juranek, Peciva 2012).

use super::cube::{Solid, look_up};
use super::dual_paraboloid::{SideParams, toward_view};
use super::{FILTERING, Info};
use crate::frame::Frame;
use crate::map::cascades::ANALYSED;
use crate::map::faces::{self, FaceParams, Faces, own_axis};
use crate::map::fit::faces::{Around, Face};
use crate::map::paraboloid::CurvedParams;
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams};
use crate::params::Params;
use glam::{DMat3, DVec3};

crate::params! {
    /// Navratil 2015, section 4.1.4.
    pub struct SkewedParams {
        "Cut" {
            /// By how much each paraboloid is turned against its half of all directions. Positive: the side of its rim that faces what the camera sees gets denser texels, the opposite side sparser ones. 0: a plain paraboloid.
            beta: float(30.0, -60.0..=60.0, "°"),
            /// The same across: towards one end of the horizon of that rim.
            alpha: float(0.0, -60.0..=60.0, "°"),
        }
    }
}

pub static INFO: Info = Info {
    id: "skewed-paraboloid",
    title: "Skewed paraboloid shadow map",
    paper: "Navratil, Zemcik, Juranek, Peciva 2012",
    family: "All directions",
    mark: 23,
    doc: "Two paraboloids whose border passes through what the camera sees, each turned so that its texels are densest there. \
          What lies on the far side of the rim gets few.",
    lights: faces::LIGHTS,
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[SkewedParams::GROUP, SideParams::GROUP, FaceParams::GROUP, CurvedParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "128..4096*2"), ("beta", "0,15,30,45,60"), ("raster", "linear,exact")],
    maps: &[&faces::MAPS, ANALYSED],
    needs: |_| &[],
    make: |gpu, info| {
        let side = |f: &Frame| SideParams::read(f.values).resolution;
        Ok(Box::new(Solid { faces: Faces::new(gpu)?, look_up: look_up(gpu, info), side, views: sides }))
    },
};

/// The turn of directions by the two cut angles, degrees: first about x, then about y.
pub fn cut(alpha: f64, beta: f64) -> DMat3 {
    DMat3::from_rotation_y(beta.to_radians()) * DMat3::from_rotation_x(alpha.to_radians())
}

/// The sides around a light. The dense rim lies along x of both frames, which are mirror images of each other, so that both
/// dense rims meet.
fn sides(around: &Around, f: &Frame) -> Vec<Face> {
    let p = SkewedParams::read(f.values);
    let toward = match SideParams::read(f.values).orientation.as_str() {
        "view" => toward_view(around, f),
        _ => None,
    };
    let toward = toward.unwrap_or(DVec3::X);
    let own = own_axis(&f.light);
    // An omni light's border stands upright, or nearly, through what is seen.
    let z = own.unwrap_or_else(|| {
        let level = toward.cross(DVec3::Y);
        level.try_normalize().unwrap_or(DVec3::Z)
    });
    let across = (toward - z * z.dot(toward)).try_normalize();
    let x = across.unwrap_or_else(|| z.any_orthonormal_vector());
    let frame = DMat3::from_cols(x, z.cross(x), z);
    let turn = cut(p.alpha as f64, p.beta as f64);
    let mirrored = DMat3::from_cols(frame.x_axis, frame.y_axis, -frame.z_axis);
    let frames: &[DMat3] = if own.is_some() { &[frame] } else { &[frame, mirrored] };
    frames.iter().enumerate().map(|(i, frame)| around.paraboloid(*frame, turn, i as u32)).collect()
}
