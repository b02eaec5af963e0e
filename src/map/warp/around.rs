//! Faces or sides around a light whose maps are warped: which of them some pixel looks up, and where in each
//! (`shaders/map/warp/faces.wgsl`).

use crate::frame::Frame;
use crate::gpu::{Buffer, Gpu, Pass, Resource};
use crate::light::LightView;
use crate::map::faces::{DRAWS, FacesUniform, around};
use crate::map::filter::{Reach, alone};
use crate::map::fit::faces::{Around, Face};
use crate::map::paraboloid::Paraboloid;
use crate::map::{MOST, light_views};
use crate::params::Group;
use anyhow::Result;
use bytemuck::Zeroable;
use wgpu::BufferUsages as Use;

crate::params! {
    /// Warped maps around a light.
    pub struct NearParams {
        "Map" {
            /// Depth at which maps begin. Casters nearer to the light than this are drawn as if at it.
            near: float(0.05, 0.000001..=1000.0, "m", 0.1 of view),
        }
    }
}

/// The faces around a light, given its place, and how many texels the side of each has.
#[derive(Clone, Copy)]
pub struct Views {
    pub side: fn(&Frame) -> u32,
    pub faces: fn(&Around, &Frame) -> Vec<Face>,
}

/// Bytes of what `extents` holds.
const EXTENTS: u64 = MOST as u64 * 20;

/// What draws all casters into the faces as they are before the warp.
#[derive(Clone)]
pub struct Plain {
    /// As `shaders/map/faces.wgsl` writes them; of no instance into a face that nothing looks up. They hold until the warped maps are drawn.
    pub draws: Buffer,
    /// The faces are a paraboloid's sides.
    pub curved: bool,
}

/// How a paraboloid's sides are drawn before the warp.
pub const PLAIN_RASTER: &str = "exact";

/// What is known of the faces on the GPU.
pub struct Layers {
    views: Views,
    uniform: Buffer,
    whole: Buffer,
    fitted: Buffer,
    samples: Buffer,
    extents: Buffer,
    draws: Buffer,
    curved: bool,
    told: Buffer,
    /// Whether views are narrowed.
    cropping: [Buffer; 2],
    each: Vec<Buffer>,
    look: Pass,
    fit: Pass,
    tell: Pass,
}

impl Layers {
    pub fn new(gpu: &Gpu, file: &str, groups: &[Group], views: Views) -> Result<Layers> {
        let zero = |label, size: usize, usage| gpu.buffer(label, &vec![0; size], usage);
        let counted = |label, bytes| super::storage(gpu, label, bytes);
        let pass = |name, entry| Pass::compute(gpu, name, "map/warp/faces.wgsl", entry, &[]);
        Ok(Layers {
            views,
            uniform: zero("faces", size_of::<FacesUniform>(), Use::UNIFORM | Use::COPY_SRC),
            whole: light_views(gpu, "whole light views"),
            fitted: light_views(gpu, "light views"),
            samples: counted("faces' samples", MOST as u64 * 4),
            extents: counted("extents of samples", EXTENTS),
            draws: gpu.room("faces' draws", DRAWS as u64, Use::STORAGE | Use::INDIRECT | Use::COPY_SRC | Use::COPY_DST),
            curved: false,
            told: counted("triangles of all layers", super::TRIANGLES_MET + 4),
            cropping: [0u32, 1].map(|x| gpu.buffer("cropping", bytemuck::bytes_of(&[x, 0, 0, 0]), Use::UNIFORM)),
            each: (0..MOST).map(|_| zero("light view", size_of::<LightView>(), Use::UNIFORM)).collect(),
            look: pass("fit: samples", "extents_of_layers")?,
            fit: pass("fit: narrow", "fit_faces")?,
            tell: Pass::compute(gpu, "layers told", &alone(file), "tell", groups)?,
        })
    }

    /// Texels of the side of each face.
    pub fn side(&self, f: &Frame) -> u32 {
        (self.views.side)(f)
    }

    /// Finds the faces that some pixel looks up. `narrow`: each is narrowed to where. The light views of all, and how many there are.
    ///
    /// # Errors
    /// Maps too small for their guard bands.
    pub fn fit(&mut self, f: &mut Frame, narrow: bool) -> Result<usize> {
        let around = around(f, self.side(f), Reach::default())?;
        let faces = (self.views.faces)(&around, f);
        let mut uniform = FacesUniform {
            count: faces.len() as u32,
            triangles: f.scene.triangle_count,
            opaque: f.scene.opaque_count,
            vertices: Paraboloid::vertices(PLAIN_RASTER),
            ..FacesUniform::zeroed()
        };
        for (axis, face) in uniform.axes.iter_mut().zip(&faces) {
            *axis = face.axis.as_vec3().extend(face.layer as f32);
        }
        let view = |face: &Face| {
            // Depth is linear, as the warp leaves no plane flat.
            let matrix = face.view.perspective != LightView::PARABOLOID;
            let perspective = if matrix { LightView::WARPED } else { face.view.perspective };
            LightView { perspective, ..face.view }
        };
        self.curved = faces.iter().any(|face| face.view.perspective == LightView::PARABOLOID);
        let views: Vec<LightView> = faces.iter().map(view).collect();
        f.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        f.gpu.queue.write_buffer(&self.whole, 0, bytemuck::cast_slice(&views));
        f.clear(&self.samples);
        f.clear(&self.extents);
        f.clear(&self.draws);
        f.clear(&self.told);
        let bound: [(&'static str, Resource); 7] = [
            ("faces", (&self.uniform).into()),
            ("light_views", (&self.whole).into()),
            ("samples", (&self.samples).into()),
            ("extents", (&self.extents).into()),
            ("cropping", (&self.cropping[narrow as usize]).into()),
            ("fitted", (&self.fitted).into()),
            ("told_draws", (&self.draws).into()),
        ];
        let [w, h] = f.size.map(|side| side.div_ceil(64));
        f.run(&self.look).bind_all(&bound).dispatch(w, h, 1);
        f.run(&self.fit).bind_all(&bound).dispatch(1, 1, 1);
        let size = size_of::<LightView>() as u64;
        for (i, one) in self.each.iter().enumerate().take(faces.len()) {
            f.copy(&self.fitted, i as u64 * size, one, size);
        }
        Ok(faces.len())
    }

    /// The light views of all faces, and of each its own.
    pub fn light_views(&self) -> (Buffer, Vec<Buffer>) {
        (self.fitted.clone(), self.each.clone())
    }

    /// What shaders need to know of all faces.
    pub fn bound(&self) -> [(&'static str, Resource); 3] {
        [
            ("faces", (&self.uniform).into()),
            ("face_samples", (&self.samples).into()),
            ("face_draws", (&self.draws).into()),
        ]
    }

    /// What draws the faces as they are before the warp.
    pub fn plain(&self) -> Plain {
        Plain { draws: self.draws.clone(), curved: self.curved }
    }

    /// What the layers' passes count together, as `State` in `shaders/map/warp/warped.wgsl`.
    pub fn told(&self) -> &Buffer {
        &self.told
    }

    /// After a layer's casters are drawn: `bound` as its passes have it.
    pub fn drawn(&self, f: &mut Frame, bound: &[(&'static str, Resource)]) {
        let own = [("told", (&self.told).into()), ("told_draws", (&self.draws).into())];
        f.run(&self.tell).bind_all(bound).bind_all(&own).dispatch(1, 1, 1);
    }

    /// Tells what became of the faces.
    pub fn report(&self, f: &mut Frame, count: usize) {
        f.count_pieces(&self.told);
        f.keep_table("faces", &self.uniform);
        f.keep_table("face_samples", &self.samples);
        f.tell_faces([&self.samples, &self.draws], count as u32);
    }
}
