//! Parallel-split shadow maps (Zhang, Sun, Xu, Lun 2006), also known as cascaded shadow maps (Engel 2006).

use super::{FILTERING, Info, Technique, chosen};
use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass};
use crate::light::{Light, LightView};
use crate::map::cascades::{ANALYSED, Boxes, CascadeParams, Cascades, MAPS};
use crate::map::filter::{LookUp, alone};
use crate::map::fit::crop::{Extent, crop};
use crate::map::fit::{Scope, hull};
use crate::map::peel::StoredParams;
use crate::map::{BiasParams, CasterParams, HardwareParams};
use crate::params::Params;
use crate::scene::Camera;
use crate::scene::geometry::Geometry;
use anyhow::Result;
use glam::{DVec2, DVec3, DVec4, Vec4};

crate::params! {
    /// How the view is split, and what each map covers.
    pub struct PssmParams {
        "Splits" {
            /// The depths that are split. Camera: the camera's whole range. Scene: the depths at which the camera can see the scene's box, in coarse steps under the sun's stable fit. Visible: from the nearest to the farthest surface in the picture that faces the light, found on the GPU; it takes the fit to samples, as the other fits are made before the picture is drawn and use the scene.
            range: choice("scene", ["camera", "scene", "visible"]),
            /// Where the cascades meet. Practical: between a uniform and a logarithmic split. Percent: at percentages of your choice.
            scheme: choice("practical", ["practical", "percent"]) if cascades > 1,
            /// The mix of a uniform split (0: all cascades equally deep) and a logarithmic one (1: each as many times as deep as the one before, so that texels match the perspective).
            lambda: float(0.5, 0.0..=1.0, "uniform" => "logarithmic") if scheme = "practical",
            /// Moves all splits away from the camera, by a multiple of the depth that a cascade has in a uniform split.
            split_bias: float(0.0, 0.0..=1.0, "× even") if scheme = "practical",
            /// Where the first cascade ends, between near and far.
            percent_1: float(5.0, 0.0..=100.0, "%") if scheme = "percent",
            /// Where the second cascade ends, between near and far.
            percent_2: float(15.0, 0.0..=100.0, "%") if scheme = "percent" and cascades > 2,
            /// Where the third cascade ends, between near and far.
            percent_3: float(35.0, 0.0..=100.0, "%") if scheme = "percent" and cascades > 3,
            /// Where the fourth cascade ends, between near and far.
            percent_4: float(50.0, 0.0..=100.0, "%") if scheme = "percent" and cascades > 4,
            /// Where the fifth cascade ends, between near and far.
            percent_5: float(65.0, 0.0..=100.0, "%") if scheme = "percent" and cascades > 5,
            /// Where the sixth cascade ends, between near and far.
            percent_6: float(80.0, 0.0..=100.0, "%") if scheme = "percent" and cascades > 6,
            /// Where the seventh cascade ends, between near and far.
            percent_7: float(90.0, 0.0..=100.0, "%") if scheme = "percent" and cascades > 7,
        }
        "Fit" {
            /// What each map covers. Stable: the sphere around its part of the view, which stays steady as the camera moves (under a spot light, a box whose sides change in steps). Indep: the box around that part. Crop: as much of that box as holds both casters and receivers. Samples: only the surfaces in the picture that face the light.
            fit: choice("stable", ["indep", "crop", "samples", "stable"]),
            /// Stabilised: maps move by whole texels only. Without it, shadow edges crawl as the camera moves.
            snap: flag(true) if fit = "stable",
        }
    }
}

const FILE: &str = "techniques/pssm.wgsl";

pub static INFO: Info = Info {
    id: "pssm",
    title: "Parallel-split (cascaded) shadow maps",
    paper: "Zhang, Sun, Xu, Lun 2006",
    family: "Cascades",
    mark: 2,
    doc: "The view is cut into slices along its depth, and each slice has a map of its own: near things get more \
          texels, as perspective demands. Where slices meet, the sharpness jumps; where light and view are parallel, \
          all maps cover the same area.",
    lights: &["directional", "spot"],
    filter: None,
    smooth: |_| false,
    params: crate::groups!(
        &[CascadeParams::GROUP, CasterParams::GROUP, PssmParams::GROUP],
        FILTERING,
        &[BiasParams::GROUP, StoredParams::GROUP, HardwareParams::GROUP],
    ),
    main: &[("resolution", "256..4096*2"), ("cascades", "2,4"), ("lambda", "0.5,0.9")],
    maps: &[&MAPS, ANALYSED],
    needs: |_| &[],
    make: |gpu, info| Ok(Box::new(Pssm::new(gpu, info)?)),
};

/// Where the cascades meet, metres along the camera's axis: count + 1 numbers from near to far, none below the last.
/// Zhang 2006, equations 1 to 3 (Navratil 2015, 3.3 to 3.5); `percent` as Azri 2020, 3.2.2.
pub fn splits(p: &PssmParams, count: u32, near: f64, far: f64) -> Vec<f64> {
    let m = count as f64;
    let percents = [p.percent_1, p.percent_2, p.percent_3, p.percent_4, p.percent_5, p.percent_6, p.percent_7];
    let mut all = vec![near];
    for i in 1..count {
        let share = i as f64 / m;
        let at = if p.scheme == "percent" {
            near + (far - near) * percents[i as usize - 1] as f64 / 100.0
        } else {
            let logarithmic = near * (far / near).powf(share);
            let even = near + (far - near) * share;
            let bias = p.split_bias as f64 * (far - near) / m;
            even + (logarithmic - even) * p.lambda as f64 + bias
        };
        let last = all[i as usize - 1];
        all.push(at.clamp(last, far));
    }
    all.push(far);
    all
}

/// The sphere around the part of a symmetric frustum from depth `a` to `b`: its centre's depth along the axis and its
/// radius. `k`: squared tangent of half the diagonal field of view.
pub fn sphere(a: f64, b: f64, k: f64) -> [f64; 2] {
    if k * (a + b) >= b - a {
        return [b, b * k.sqrt()];
    }
    let radius = ((b - a).powi(2) + 2.0 * (a * a + b * b) * k + ((a + b) * k).powi(2)).sqrt() / 2.0;
    [(a + b) * (1.0 + k) / 2.0, radius]
}

/// What the cascades' views depend on, beside their parameters.
pub struct Seen<'a> {
    pub camera: &'a Camera,
    /// Width over height of the picture.
    pub aspect: f64,
    /// The light's view of the whole scene, which gives the axes.
    pub whole: LightView,
    /// Metres that the filter's taps lie from the receiver.
    pub reach: f32,
}

/// The part of the view's depth that a cascade's map covers: the band before the cascade, where it is mixed in, belongs to
/// it.
fn part(c: &CascadeParams, splits: &[f64], i: usize) -> [f64; 2] {
    let before = if i > 0 { c.blend as f64 * (splits[i] - splits[i - 1]) } else { 0.0 };
    [splits[i] - before, splits[i + 1]]
}

/// What of the light's image each cascade between `splits` is cropped to, under the fit `crop`; None: all of its part.
pub fn crops(p: &PssmParams, c: &CascadeParams, splits: &[f64], scope: &Scope, g: &Geometry) -> Vec<Option<Extent>> {
    let image = scope.image();
    let cut = |i: usize| {
        let [a, b] = part(c, splits, i);
        let body = scope.slice(a, b);
        if p.fit != "crop" || body.is_empty() {
            return None;
        }
        crop(scope, g, [a, b], &Extent::of(&image, &body, scope.eps()))
    };
    (0..splits.len() - 1).map(cut).collect()
}

/// The light's views of the cascades between `splits`, by the fits that need no look at the picture. `crops`: see [`crops`].
pub fn light_views(
    p: &PssmParams,
    c: &CascadeParams,
    splits: &[f64],
    seen: &Seen,
    crops: &[Option<Extent>],
) -> Vec<LightView> {
    let unit = |row: Vec4| row.truncate().as_dvec3().normalize();
    let (right, up, axis) = (unit(seen.whole.row_x), unit(seen.whole.row_y), unit(seen.whole.axis));
    let camera = seen.camera;
    let view = camera.view();
    let [side, above, back] = [0, 1, 2].map(|i| view.row(i).truncate().as_dvec3());
    let half = camera.half_height();
    let wide = |z: f64| if camera.height.is_some() { half } else { z * half };
    let eye = camera.position.as_dvec3();
    let to_light = |x: DVec3| DVec3::new(right.dot(x), up.dot(x), axis.dot(x));
    let margin = seen.whole.margin as f64;
    let mut views = Vec::new();
    for (i, (cut, resolution)) in crops.iter().zip(c.sides()).enumerate() {
        let [a, b] = part(c, splits, i);
        let resolution = resolution as f64;
        // With the texels that the filter needs at each border.
        let widened = |side: f64, spare: f64| {
            (side + 2.0 * seen.reach as f64) * resolution / (resolution - 2.0 * (margin + spare)).max(1.0)
        };
        let (center, half, depth) = if p.fit == "stable" {
            let diagonal = half * half * (1.0 + seen.aspect * seen.aspect);
            let [z, r] = match camera.height {
                Some(_) => [(a + b) / 2.0, ((b - a) / 2.0).hypot(diagonal.sqrt())],
                None => sphere(a, b, diagonal),
            };
            // Rounded up to a sixteenth of its power of two, so that rounding errors of the camera do not change it.
            let quantum = (r.log2().floor() - 4.0).exp2();
            let r = (r / quantum - 1e-6).ceil() * quantum;
            let center = to_light(eye - back * z);
            // Snapping moves the box by up to half a texel.
            let side = widened(2.0 * r, 1.0);
            let texel = side / resolution;
            // The depth moves by steps too, of half a quantum around the sphere: stored depths then stay bit for bit.
            let steps = DVec3::new(texel, texel, quantum);
            let center = if p.snap { (center / steps).round() * steps } else { center };
            let deep = r + quantum / 2.0;
            (center.truncate(), DVec2::splat(side / 2.0), [center.z - deep, center.z + deep])
        } else {
            let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for corner in 0..8 {
                let z = if corner & 4 == 0 { a } else { b };
                let sign = |bit: u32| if corner & bit == 0 { -wide(z) } else { wide(z) };
                let at = eye - back * z + side * sign(1) * seen.aspect + above * sign(2);
                let at = to_light(at);
                (low, high) = (low.min(at), high.max(at));
            }
            if let Some(cut) = cut {
                (low, high) = (cut.low.extend(cut.nearest), cut.high.extend(cut.deepest));
            }
            let size = (high - low).truncate();
            let half = DVec2::new(widened(size.x, 0.0), widened(size.y, 0.0)) / 2.0;
            ((low + high).truncate() / 2.0, half, [low.z, high.z])
        };
        let least = 1e-6 * seen.whole.far as f64;
        let half = half.max(DVec2::splat(least));
        let range = (depth[1] - depth[0]).max(10.0 * least);
        let row = |v: DVec3, offset: f64, scale: f64| (v * scale).extend(offset * scale).as_vec4();
        views.push(LightView {
            row_x: row(right, -center.x, 1.0 / half.x),
            row_y: row(up, -center.y, 1.0 / half.y),
            row_z: (DVec4::W * depth[1] - axis.extend(0.0)).as_vec4() / range as f32,
            row_w: Vec4::W,
            axis: axis.extend(-depth[0]).as_vec4(),
            near: 0.0,
            far: range as f32,
            perspective: 0,
            texel: (2.0 * half.max_element() / resolution) as f32,
            resolution: resolution as f32,
            ..seen.whole
        });
    }
    views
}

/// Moves the near plane of a view under the sun back to where the scene's casters begin; `whole`: the view of all of it.
fn hold_casters(v: &mut LightView, whole: &LightView) {
    let back = whole.axis.w - v.axis.w;
    if back > 0.0 {
        v.axis = whole.axis;
        v.far += back;
        v.row_z = (Vec4::W * v.far - v.axis) / v.far;
    }
}

/// A spot light's views of the cascades between `splits`, by the fits that need no look at the picture. `whole`: its view of
/// the whole cone; `reach`: metres that the filter's taps lie from the receiver. A cascade that the cone does not meet gets that too: no sample will ask for it.
///
/// Perspective leaves no fit that only ever moves. The texels of a stable map are those of a grid that stands still in the
/// lamp's image, and so in the world, as long as the map's sides stay; these go in steps of a fourth of a power of two.
pub fn lamp_views(
    p: &PssmParams,
    c: &CascadeParams,
    splits: &[f64],
    scope: &Scope,
    (whole, reach): (LightView, f32),
    crops: &[Option<Extent>],
) -> Vec<LightView> {
    let image = scope.image();
    let spread = match scope.light {
        Light::Spot { outer_angle, .. } => (outer_angle as f64).to_radians().tan(),
        _ => return c.sides().iter().map(|side| LightView { resolution: *side as f32, ..whole }).collect(),
    };
    let view = |i: usize, resolution: f64| -> Option<LightView> {
        let free = |spare: f64| resolution / (resolution - 2.0 * (scope.margin as f64 + spare)).max(1.0);
        let [a, b] = part(c, splits, i);
        let body = scope.slice(a, b);
        if body.is_empty() {
            return None;
        }
        let all = Extent::of(&image, &body, scope.eps());
        let Extent { low, high, deepest, .. } = crops[i].unwrap_or(all);
        // With what the filter needs at each border.
        let widened = |side: DVec2, nearest: f64, spare: f64| {
            (side + DVec2::splat(2.0 * reach as f64 / nearest.max(1e-9))) * free(spare)
        };
        let nearest = all.nearest;
        let (mut center, mut side) = ((low + high) / 2.0, widened(high - low, nearest, 0.0));
        if p.fit == "stable" {
            // Snapping moves the box by up to half a texel.
            side = widened(high - low, nearest, 1.0).map(|side| ((side.log2() * 4.0 - 1e-6).ceil() / 4.0).exp2());
            let texel = side / resolution;
            center = if p.snap { (center / texel).round() * texel } else { center };
        }
        // Never more than the cone.
        let all = DVec2::splat(2.0 * spread);
        center = DVec2::select(side.cmplt(all), center, DVec2::ZERO);
        side = side.min(all);
        let half = (side / 2.0).max(DVec2::splat(1e-6));
        let row = |i: usize| ((image.rows[i] - image.rows[2] * center[i]) / half[i]).as_vec4();
        let (near, last) = (whole.near, whole.far);
        let far = ((deepest * 1.0001 + 1e-5) as f32).min(last).max(near * 1.0001 + 1e-6);
        Some(LightView {
            row_x: row(0),
            row_y: row(1),
            row_z: (Vec4::W * far - whole.axis) * (near / (far - near)),
            far,
            texel: (2.0 * half.max_element() / resolution) as f32,
            resolution: resolution as f32,
            ..whole
        })
    };
    let sized =
        |(i, side): (usize, u32)| view(i, side as f64).unwrap_or(LightView { resolution: side as f32, ..whole });
    c.sides().into_iter().enumerate().map(sized).collect()
}

/// The depths along the camera's axis that are split: all of its range, or where it can see the scene's box, and of that
/// only what a spot light's cone holds.
///
/// Under the sun the stable fit's both ends go outwards to steps of a fourth of a power of two: splits that followed every
/// step of the camera would let texels swim. A spot light's maps have sides in steps whatever the splits are.
pub fn split_range(p: &PssmParams, scope: &Scope) -> [f64; 2] {
    let all = [scope.camera.near as f64, scope.camera.far as f64];
    if p.range == "camera" {
        return all;
    }
    let eye = scope.eye();
    let [mut low, mut high] =
        hull::extent(scope.seen().iter().map(|x| DVec2::splat(eye.depth(*x)))).map(|depth| depth.x);
    if low >= high {
        return all;
    }
    if p.fit == "stable" && eye.orthographic {
        // How far before the scene such a camera stands means nothing: even steps of a fourth of what it sees, or less.
        let step = ((high - low).log2().floor() - 2.0).exp2();
        low = (low / step + 1e-3).floor() * step;
        high = (high / step - 1e-3).ceil() * step;
    } else if p.fit == "stable" && !matches!(scope.light, Light::Spot { .. }) {
        // An end that lies on a step, but for rounding, stays there.
        low = ((low.log2() * 4.0 + 1e-3).floor() / 4.0).exp2();
        high = ((high.log2() * 4.0 - 1e-3).ceil() / 4.0).exp2();
    }
    [low.max(all[0]), high.min(all[1])]
}

struct Pssm {
    cascades: Cascades,
    range: Buffer,
    find_range: Pass,
    place_splits: Pass,
    look_up: LookUp,
}

impl Pssm {
    fn new(gpu: &Gpu, info: &Info) -> Result<Pssm> {
        let pass = |name, entry| Pass::compute(gpu, name, &alone(FILE), entry, info.params);
        Ok(Pssm {
            cascades: Cascades::new(gpu)?,
            range: gpu.buffer("depth range", &[0; 16], wgpu::BufferUsages::STORAGE),
            find_range: pass("depth range", "find_range")?,
            place_splits: pass("splits", "place_splits")?,
            look_up: LookUp::new(gpu, FILE, info.params),
        })
    }
}

impl Technique for Pssm {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        let mut p = PssmParams::read(f.values);
        let c = CascadeParams::read(f.values);
        if f.camera.height.is_some() && p.scheme == "practical" && c.cascades > 1 && p.lambda > 0.0 {
            // As the shader does that places splits between samples.
            p.lambda = 0.0;
            f.tell_note(
                "An orthographic camera shows all depths at one size: the split is uniform, whatever λ is.".into(),
            );
        }
        let filter = chosen(f.values);
        let reach = (filter.reach)(f);
        let whole = self.cascades.whole(f, &c, reach)?;
        let camera = &f.camera;
        let scope = Scope::of(f, c.resolution, whole.margin);
        let [near, far] = split_range(&p, &scope);
        let splits = splits(&p, c.cascades, near, far);
        let crops = || crops(&p, &c, &splits, &scope, f.geometry);
        let boxes = if p.fit == "samples" {
            Boxes::Samples { dilate: 0.0, least: 0.0, smoothing: 0.0 }
        } else if whole.perspective == 1 {
            Boxes::Given(lamp_views(&p, &c, &splits, &scope, (whole, reach.metres), &crops()))
        } else {
            let seen = Seen { camera, aspect: f.size[0] as f64 / f.size[1] as f64, whole, reach: reach.metres };
            let mut views = light_views(&p, &c, &splits, &seen, &crops());
            if reach.casters {
                views.iter_mut().for_each(|v| hold_casters(v, &whole));
            }
            Boxes::Given(views)
        };
        self.cascades.prepare(f, &c, reach, &boxes);
        if p.fit == "samples" && p.range == "visible" {
            let [w, h] = f.size.map(|s| s.div_ceil(64));
            f.clear(&self.range);
            f.run(&self.find_range).bind("range", &self.range).dispatch(w, h, 1);
            f.run(&self.place_splits)
                .bind("range", &self.range)
                .bind("fitting", &self.cascades.fitting)
                .bind("parts", &self.cascades.splits)
                .dispatch(1, 1, 1);
        } else {
            let words: Vec<f32> = splits.iter().map(|z| *z as f32).collect();
            f.gpu.queue.write_buffer(&self.cascades.splits, 0, bytemuck::cast_slice(&words));
        }
        let maps = self.cascades.draw(f, &c)?;
        self.look_up.run(f, &maps, filter, &[])
    }
}
