//! Light space perspective shadow map (Wimmer, Scherzer, Purgathofer 2004).

use super::shadow_map::MAPS;
use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::light::LightView;
use crate::map::filter::LookUp;
use crate::map::fit::diagram::{self, Diagram, Drawing};
use crate::map::fit::lispsm::{self, Lispsm, Strength};
use crate::map::fit::{Kept, Scope, tell_even};
use crate::map::peel::StoredParams;
use crate::map::single::{ShadowMap, scope};
use crate::map::{BiasParams, CasterParams, MapParams};
use crate::params::Params;
use anyhow::Result;
use glam::DVec2;

crate::params! {
    /// How strongly the map is warped, and over what.
    pub struct LispsmParams {
        "Warp" {
            /// How strong the warp is. 0: a plain map. 1: the warp with the smallest worst error along the view (n_opt). Above 1: more texels near the camera and fewer far away, towards a perspective shadow map.
            strength: float(1.0, 0.0..=2.0, "× n_opt"),
            /// The |cos γ| at which the warp begins to fade out, γ being the angle between the gaze and the light.
            fade: float(0.9, 0.8..=0.99, "") if strength > 0.0,
            /// Fit the map to what the camera sees: first to the part of the scene's box inside its frustum, then to the receivers themselves. Off: to the whole scene.
            focus: flag(true),
        }
    }
}

pub static INFO: Info = Info {
    id: "lispsm",
    title: "Light space perspective shadow map",
    paper: "Wimmer, Scherzer, Purgathofer 2004",
    family: "Warping",
    mark: 4,
    doc: "A shadow map warped along the view, so that texels are small near the camera and large far away. Where gaze and \
          light are parallel there is nothing to gain, and the warp fades out.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[LispsmParams::GROUP, MapParams::GROUP, CasterParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP],
    ),
    main: &[("resolution", "256..8192*2"), ("strength", "0.5,1,1.5")],
    maps: &[
        MAPS,
        &[diagram::view(
            "Left the light's image, right the map: what the camera sees (green), the map's border (yellow) and every \
             sixteenth of its texels. The cross is the perspective's centre, the line the gaze. Figures: n in metres (under a \
             spot light at 1 m from it) and γ in degrees.",
        )],
    ],
    needs: |_| &[],
    make: |gpu, info| {
        Ok(Box::new(LightSpacePerspective {
            map: ShadowMap::new(gpu)?,
            look_up: LookUp::new(gpu, "map/single.wgsl", info.params),
            drawing: Drawing::new(gpu)?,
            fit: Kept::default(),
        }))
    },
};

struct LightSpacePerspective {
    map: ShadowMap,
    look_up: LookUp,
    drawing: Drawing,
    fit: Kept<Option<Fitted>>,
}

/// A fit and what it was made of.
struct Fitted {
    lispsm: Lispsm,
    points: Vec<DVec2>,
    view: Option<LightView>,
}

/// None if the camera sees nothing.
fn fitted(scope: &Scope, p: &LispsmParams) -> Option<Fitted> {
    let body = if p.focus { scope.seen() } else { scope.lit() };
    if body.is_empty() {
        return None;
    }
    let image = scope.image();
    let by = Strength { strength: p.strength as f64, fade: p.fade as f64 };
    let lispsm = lispsm::fit(scope, &image, &body, by);
    let points: Vec<DVec2> = body.iter().map(|p| image.at(*p)).collect();
    let view = scope.view(&image, &lispsm.warp, &points, scope.deepest(&image, &body));
    Some(Fitted { lispsm, points, view })
}

impl Technique for LightSpacePerspective {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let p = LispsmParams::read(f.values);
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        tell_even(f);
        let made = self.fit.get(f, scope(f, reach), |s| fitted(s, &p));
        let maps = self.map.render_view(f, made.as_ref().and_then(|m| m.view), reach, p.focus)?;
        self.look_up.run(f, &maps, filter, &[])?;
        self.drawing.show(f, "warp", || made.as_ref().map(|m| Diagram::of_perspective(&m.lispsm, &m.points, false)));
        Ok(())
    }
}
