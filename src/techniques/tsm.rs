//! Trapezoidal shadow map (Martin, Tan 2004).

use super::shadow_map::MAPS;
use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::light::LightView;
use crate::map::filter::LookUp;
use crate::map::fit::diagram::{self, Diagram, Drawing, MARK};
use crate::map::fit::tsm::{self, Tsm};
use crate::map::fit::{Kept, Scope, tell_even};
use crate::map::peel::StoredParams;
use crate::map::single::{ShadowMap, scope};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use anyhow::Result;
use glam::DVec2;

crate::params! {
    /// Where the trapezoid puts its texels.
    pub struct TsmParams {
        "Warp" {
            /// The distance from the near plane to the point in focus on the view's axis, as a share of the distance to the far plane.
            focus: float(0.2, 0.01..=1.0, "× depth"),
            /// The share of the map's height given to what lies between the near plane and the point in focus (the 80 % rule).
            focus_share: float(0.8, 0.5..=0.95, "× map"),
        }
    }
}

pub static INFO: Info = Info {
    id: "tsm",
    title: "Trapezoidal shadow map",
    paper: "Martin, Tan 2004",
    family: "Warping",
    mark: 5,
    doc: "The view frustum, seen from the light, is enclosed in a trapezoid that a perspective turns into the square map. \
          It depends on the frustum alone, so that it moves steadily. Nothing is gained where light and gaze are parallel.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[TsmParams::GROUP, MapParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "256..8192*2"), ("focus", "0.1,0.2,0.4")],
    maps: &[
        MAPS,
        &[diagram::view(
            "Left the light's image, right the map: the view frustum's hull (green), the trapezoid (yellow) and every \
             sixteenth of the map's texels. The cross is the vanishing point q; the lines are the centre line and the line \
             in focus.",
        )],
    ],
    needs: |_| &[],
    make: |gpu, info| {
        Ok(Box::new(Trapezoidal {
            map: ShadowMap::new(gpu)?,
            look_up: LookUp::new(gpu, "map/single.wgsl", info.params),
            drawing: Drawing::new(gpu)?,
            fit: Kept::default(),
        }))
    },
};

struct Trapezoidal {
    map: ShadowMap,
    look_up: LookUp,
    drawing: Drawing,
    fit: Kept<(Tsm, Option<LightView>)>,
}

/// The trapezoid's corners, or the hull's where a rectangle stands in: what the map covers.
fn covered(t: &Tsm) -> &[DVec2] {
    t.trapezoid.as_ref().map_or(&t.hull, |t| t)
}

fn fitted(scope: &Scope, p: &TsmParams) -> (Tsm, Option<LightView>) {
    let image = scope.image();
    let t = tsm::fit(scope, &image, p.focus_share as f64, p.focus as f64);
    let seen = scope.seen();
    let view = match seen.is_empty() {
        true => None,
        false => scope.view(&image, &t.warp, covered(&t), scope.deepest(&image, &seen)),
    };
    (t, view)
}

impl Technique for Trapezoidal {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = TsmParams::read(f.values);
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        tell_even(f);
        let (t, view) = self.fit.get(f, scope(f, reach), |s| fitted(s, &p));
        let maps = self.map.render_view(f, *view, reach, false)?;
        self.look_up.run(f, &maps, filter, &[])?;
        self.drawing.show(f, "warp", || Some(draw(t)));
        Ok(())
    }
}

fn draw(t: &Tsm) -> Diagram {
    let across = t.axis.perp();
    let along = |p: &DVec2| (*p - t.focus).dot(t.axis);
    let (low, high) = t.hull.iter().fold((0f64, 0f64), |(l, h), p| (l.min(along(p)), h.max(along(p))));
    let side = |p: &DVec2| (*p - t.focus).dot(across).abs();
    let half = t.hull.iter().map(side).fold(0.0, f64::max);
    // A distant vanishing point would make all else small.
    let near = t.trapezoid.is_some() && (t.q - t.focus).length() < 3.0 * (high - low);
    let mut d = Diagram::new(&t.warp, covered(t), if near { std::slice::from_ref(&t.q) } else { &[] });
    for (i, p) in t.hull.iter().enumerate() {
        d.line(*p, t.hull[(i + 1) % t.hull.len()], diagram::HULL);
    }
    d.line(t.focus + t.axis * low, t.focus + t.axis * high, MARK);
    d.line(t.focus - across * half, t.focus + across * half, MARK);
    if near {
        d.cross(t.q, MARK);
    }
    d
}
