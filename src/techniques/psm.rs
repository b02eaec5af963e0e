//! Perspective shadow map (Stamminger, Drettakis 2002).

use super::shadow_map::MAPS;
use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::light::LightView;
use crate::map::filter::LookUp;
use crate::map::fit::diagram::{self, Diagram, Drawing, GRID, HULL, MARK};
use crate::map::fit::psm::{self, Psm, Slide};
use crate::map::fit::{Kept, Scope, tell_even};
use crate::map::peel::StoredParams;
use crate::map::single::{ShadowMap, scope};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use crate::view::{self, Drawn, Legend};
use anyhow::Result;
use glam::{DVec2, DVec3, Vec4Swizzles};

crate::params! {
    /// The perspective that the map is drawn after.
    pub struct PsmParams {
        "Warp" {
            /// How far the eye is slid back. Auto: just far enough for all receivers and casters to lie in front of it. Fixed: by a distance of your choice.
            slide: choice("auto", ["auto", "fixed"]),
            /// How far the eye is slid back. Large: the map becomes a plain shadow map.
            slide_back: float(0.0, 0.0..=100.0, "m") if slide = "fixed",
            /// The smallest near distance of the eye once it is slid back. Small: nearly all texels lie close to the camera.
            min_near: float(1.0, 0.00001..=1000.0, "m", 0.5 of view),
            /// Push the near plane forward to the first receiver, so that no texels are spent on the empty space before it.
            push_near: flag(true),
        }
    }
}

pub static INFO: Info = Info {
    id: "psm",
    title: "Perspective shadow map",
    paper: "Stamminger, Drettakis 2002",
    family: "Warping",
    mark: 6,
    doc: "A shadow map of the scene as the camera's perspective leaves it: near things are large and get many texels. Ahead \
          of the camera the light becomes a point, behind it a sink, and the map changes as the camera turns.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[PsmParams::GROUP, MapParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "256..8192*2"), ("min_near", "0.5,1,2,4")],
    maps: &[
        MAPS,
        &[
            diagram::view(
                "Left the light's image, right the map: what the camera sees (green), the map's border (yellow) and every \
             sixteenth of its texels. Figures: how far the eye is slid back, metres, and the angle between the light's \
             film plane and the camera's after the perspective, degrees.",
            ),
            view::map(
                "pps",
                "Post-perspective space",
                "The space after the camera's perspective, from the side (left) and from above (right): the \
                      camera looks to the right, its near and far planes in blue. Green: what the camera sees. Cross \
                      and lines: the light as a point, and its rays; parallel ones where it is no point.",
                Drawn::Diagram(Legend::Squares(["from the side", "from above"], diagram::SPACE_CLASSES)),
            ),
        ],
    ],
    needs: |_| &[],
    make: |gpu, info| {
        Ok(Box::new(Perspective {
            map: ShadowMap::new(gpu)?,
            look_up: LookUp::new(gpu, "map/single.wgsl", info.params),
            drawing: Drawing::new(gpu)?,
            fit: Kept::default(),
        }))
    },
};

struct Perspective {
    map: ShadowMap,
    look_up: LookUp,
    drawing: Drawing,
    fit: Kept<Option<Fitted>>,
}

/// A fit, and where in the light's image the corners of what the camera sees are.
struct Fitted {
    psm: Psm,
    points: Vec<DVec2>,
    view: Option<LightView>,
}

/// None if the camera sees nothing.
fn fitted(scope: &Scope, p: &PsmParams) -> Option<Fitted> {
    let seen = scope.seen();
    if seen.is_empty() {
        return None;
    }
    let image = scope.image();
    let fixed = (p.slide == "fixed").then_some(p.slide_back as f64);
    let psm = psm::fit(scope, &image, &seen, Slide { fixed, least_near: p.min_near as f64, push: p.push_near });
    let points: Vec<DVec2> = seen.iter().map(|p| image.at(*p)).collect();
    let view = scope.view(&image, &psm.warp, &points, scope.deepest(&image, &seen));
    Some(Fitted { psm, points, view })
}

impl Technique for Perspective {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = PsmParams::read(f.values);
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        tell_even(f);
        let made = self.fit.get(f, scope(f, reach), |s| fitted(s, &p));
        let maps = self.map.render_view(f, made.as_ref().and_then(|m| m.view), reach, true)?;
        self.look_up.run(f, &maps, filter, &[])?;
        self.drawing.show(f, "warp", || made.as_ref().map(draw_warp));
        self.drawing.show(f, "pps", || made.as_ref().map(|m| draw_space(&m.psm)));
        Ok(())
    }
}

fn draw_warp(made: &Fitted) -> Diagram {
    let mut d = Diagram::new(&made.psm.warp, &made.points, &[]);
    d.number(0, made.psm.delta);
    d.number(1, made.psm.plane.map_or(f64::INFINITY, f64::to_degrees));
    d
}

/// The post-perspective box from the side and from above.
fn draw_space(psm: &Psm) -> Diagram {
    let mut d = Diagram::blank(DVec2::new(1.0, 0.0), 4.0);
    let side = |p: DVec3| DVec2::new(2.0 * p.z, p.y);
    let above = |p: DVec3| DVec2::new(2.0 * p.z, -p.x);
    for (half, project) in [&side as &dyn Fn(DVec3) -> DVec2, &above].into_iter().enumerate() {
        let corner = |x: f64, z: f64| project(DVec3::new(x, x, z));
        let frame = [corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        (0..4).for_each(|i| d.place(half, frame[i], frame[(i + 1) % 4], GRID));
        let points: Vec<DVec2> = psm.receivers.iter().map(|p| project(*p)).collect();
        let around = crate::map::fit::hull::hull(&points);
        (0..around.len()).for_each(|i| d.place(half, around[i], around[(i + 1) % around.len()], HULL));
        for p in &psm.receivers {
            let towards = match psm.case {
                Some(psm::Case::Parallel) => psm.light.xyz().normalize_or_zero(),
                Some(_) => psm.light.xyz() / psm.light.w - *p,
                None => DVec3::ZERO,
            };
            // No farther than the drawing holds.
            let step = project(*p + towards) - project(*p);
            let reach = (1.2 / step.length().max(1e-9)).min(1.0);
            d.place(half, project(*p), project(*p) + step * reach, MARK);
        }
        if matches!(psm.case, Some(psm::Case::Point | psm::Case::Sink)) {
            let (at, arm) = (project(psm.light.xyz() / psm.light.w), DVec2::splat(0.06));
            d.place(half, at - arm, at + arm, 1.0);
            d.place(half, at - arm.perp(), at + arm.perp(), 1.0);
        }
    }
    d
}
