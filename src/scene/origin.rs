//! Where a file's scene lies: the point that is taken off its coordinates, and what its distance has cost.

use super::presets::{Bounds, for_each_vertex};
use crate::scene::Scene;
use crate::scene::pose::placements;
use anyhow::{Result, bail};
use glam::{DVec3, Mat3};

/// The largest scene whose cameras and lights a set-up can hold, metres across.
const LARGEST: f64 = 1e10;

/// Sets [`Scene::origin`] and gives the scene's extent relative to it, as it stands at the clock's start. Says in the notes
/// what the distance has cost.
///
/// # Errors
/// A scene that leaves the range of 32-bit floats, or has no extent.
pub fn take_off(scene: &mut Scene) -> Result<Bounds> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut finite = true;
    for_each_vertex(scene, |position| {
        finite &= position.is_finite();
        low = low.min(position);
        high = high.max(position);
    });
    let size = (high - low).length();
    if !finite || !(size as f32).is_finite() || !(low.length() as f32).is_finite() {
        bail!("its triangles leave the range of 32-bit floats; move or scale it closer to zero");
    }
    if size > LARGEST {
        bail!("its scene is {size:.1e} m across; up to {LARGEST:.0e} m can be drawn: scale it down");
    }
    if size as f32 == 0.0 {
        bail!(
            "its geometry has no extent: all its vertices fall on one point, as after a matrix or scale of zero; \
             mend the transforms of its nodes and export it again"
        );
    }
    scene.origin = origin([low, high]);
    scene.diagonal = size as f32;
    notes(scene, size);
    Ok(Bounds { min: (low - scene.origin).as_vec3(), max: (high - scene.origin).as_vec3() })
}

/// The middle of an extent, on a grid about as fine as 32-bit floats of the extent's size. Without the grid, what 64-bit
/// floats round far away would make another scene of a file that was only moved; a coarser one would not bring a
/// translation that a 32-bit float holds back to the same point.
pub(super) fn origin([low, high]: [DVec3; 2]) -> DVec3 {
    // Round numbers, of which many scenes are made, lie on neither border: of two steps, between two points.
    let side = 0.7 * (high - low).max_element().max(f64::from(f32::MIN_POSITIVE));
    let step = (side.log2().floor() - 23.0).exp2();
    ((low + high) / 2.0 / step + 0.4).floor() * step
}

fn notes(scene: &mut Scene, size: f64) {
    let far = scene.origin.length();
    if far > 1e3 * size {
        let [x, y, z] = scene.origin.to_array();
        scene.notes.push(format!(
            "The scene lies {} from the zero point of its coordinates and is drawn relative to ({x}, {y}, {z}).",
            metres(far)
        ));
    }
    let (reach, grain) = coarsest(scene);
    if grain > 1e-5 * size {
        scene.notes.push(format!(
            "Vertices lie up to {} from the zero point of their mesh, where the file's 32-bit numbers are {} apart: its \
             surfaces are rounded to that, unless the distance is moved into a node.",
            metres(reach),
            metres(grain)
        ));
    }
}

/// The mesh whose vertices are rounded most where it is drawn: how far they lie from the mesh's zero point, and the step of
/// a 32-bit float there, both in metres as drawn.
fn coarsest(scene: &Scene) -> (f64, f64) {
    let reach = |mesh: &crate::scene::Mesh| mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let reaches: Vec<f32> = scene.meshes.iter().map(reach).collect();
    let drawn = placements(scene, 0, 0.0).into_iter().map(|placed| {
        let axes = Mat3::from_mat4(placed.matrix(0).as_mat4());
        let scale = axes.x_axis.length().max(axes.y_axis.length()).max(axes.z_axis.length()) as f64;
        let reach = reaches[placed.index];
        (reach as f64 * scale, (reach.next_up() - reach) as f64 * scale)
    });
    drawn.fold((0.0, 0.0), |most, this| if this.1 > most.1 { this } else { most })
}

/// A length in words, three digits or so.
fn metres(x: f64) -> String {
    match x {
        x if x >= 1e4 => format!("{:.0} km", x / 1e3),
        x if x >= 10.0 => format!("{x:.0} m"),
        x if x >= 0.1 => format!("{x:.2} m"),
        x => format!("{:.2} mm", x * 1e3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round boxes, turned ones, small and large: wherever they stand, the origin moves along by just as much.
    #[test]
    fn the_origin_moves_with_the_extent() {
        for (low, high) in [
            ([-5.0, 0.0, -5.0], [5.0, 2.5, 5.0]),
            ([0.0, 0.0, 0.0], [1.0, 8.0, 4.0]),
            ([0.1f32 as f64, 0.7f32 as f64, -3.3f32 as f64], [0.9f32 as f64, 1.0, 2.6f32 as f64]),
            ([-700.0, -3.0, 12.0], [1300.5, 40.25, 900.0]),
        ] {
            let (low, high) = (DVec3::from(low), DVec3::from(high));
            let here = origin([low, high]);
            assert!(((low + high) / 2.0 - here).abs().max_element() < 1e-6 * (high - low).length());
            for far in [[5e5, 0.0, 5e6], [1e7, 1e7, -1e7], [f64::from(123456.79_f32), -7e4, 0.5], [-1e5, 3.0, -99999.0]]
            {
                let far = DVec3::from(far);
                // What composing matrices in 64 bits may round that far out, too.
                for rounding in [0.0, 1e-9, -1e-9] {
                    assert_eq!(origin([low + far + rounding, high + far]) - here, far, "{low} to {high} at {far}");
                }
            }
        }
    }

    #[test]
    fn a_point_is_its_own_origin() {
        let point = DVec3::new(1e7, 0.25, -3.0);
        assert!((origin([point, point]) - point).length() < 1e-6);
    }
}
