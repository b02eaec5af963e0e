//! Contact shadows in screen space on top of any technique: what the picture itself shows near a surface, on the way to the
//! light, darkens it, whatever a bias let through.
//!
//! Two modes: a march along each pixel's ray, as engines have it (Filament, Bevy, Unreal), and a sweep along lines of pixels
//! (Aldridge, "Inside Bend: screen space shadows", 2023).

use crate::frame::{Frame, STORED};
use crate::gpu::{Buffer, Gpu, Pass, Slot};
use crate::light::Light;
use crate::measure::causes::{Causes, DETACHMENT};
use crate::measure::metrics::{FACING, Pixels};
use crate::palette::FALSE_SHADOW;
use crate::params::{Group, Params, Value, Values};
use crate::scene::Camera;
use crate::view::{self, Class, Drawn, Legend, Source, View};
use anyhow::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec2, DVec3};
use wgpu::TextureFormat as Format;

crate::params! {
    /// Contact shadows over what a technique drew.
    pub struct ContactParams {
        "Contact shadows" {
            /// Shadows of what the picture itself shows near a surface, on top of the technique's. March: along each pixel's ray to the light, over a length in the scene. Sweep: along lines of pixels, over a number of pixels (Bend Studio).
            contact: choice("off", ["off", "march", "sweep"]),
            /// How far a ray is followed.
            contact_length: float(0.3, 0.000001..=1000.0, "m", 0.2 of view) if contact = "march",
            /// How many places along a ray are looked at.
            contact_steps: int(16, 4..=64, "") if contact = "march",
            /// What lies in front of a ray hides the light if it is no farther from it than this. The picture shows no backs.
            contact_depth: float(0.1, 0.000001..=1000.0, "m", 0.1 of view) if contact = "march",
            /// How far from its surface a ray starts, along the normal.
            contact_bias: float(0.5, 0.0..=2.0, "pixels") if contact = "march",
            /// Where light grazes a surface its ray is turned so far towards the normal: all of it where the light stands up to 14° over the surface, none from 27° on.
            contact_tilt: float(0.0, 0.0..=45.0, "°") if contact = "march",
            /// From this share of the length on a hit counts less and less.
            contact_fade: float(0.7, 0.0..=1.0, "") if contact = "march",
            /// Hits that lie so near the picture's border count less and less, as a share of the picture's shorter side.
            contact_border: float(0.02, 0.0..=0.25, "") if contact = "march",
            /// Where the first place along a ray lies. None: at half a step. Ign: interleaved gradient noise, which the seed shifts.
            contact_jitter: choice("none", ["none", "ign"]) if contact = "march",
            /// How many pixels are looked at on the line towards the light.
            contact_pixels: int(60, 16..=256, "pixels") if contact = "sweep",
            /// How thick all things are taken for, as a share of their distance.
            contact_tau: float(0.005, 0.001..=0.05, "") if contact = "sweep",
            /// Two pixels beside each other that differ in depth by this share are an edge: nothing is interpolated there.
            contact_edge: float(0.02, 0.0..=0.2, "") if contact = "sweep",
            /// How sharp a shadow is: 1 soft across all of the thickness.
            contact_sharp: float(4.0, 1.0..=8.0, "") if contact = "sweep",
            /// So many pixels next to a surface darken it alone; the rest in four groups, whose mean is taken.
            contact_hard: int(4, 0..=16, "pixels") if contact = "sweep",
            /// The last so many pixels count less and less.
            contact_fading: int(8, 0..=64, "pixels") if contact = "sweep",
        }
    }
}

/// Views of the contact shadows, wherever they are on.
pub const VIEWS: &[View] = &[
    View {
        source: Source::Frame,
        ..view::map(
            "contact-visibility",
            "Contact shadows",
            "How much of the light the contact shadows alone let through. The technique's own visibility is taken where it \
             is less.",
            Drawn::Contact(view::VISIBILITY),
        )
    },
    View {
        source: Source::Frame,
        ..view::map(
            "contact-distance",
            "Contact distance",
            "How far away in the picture what hides the light was found.",
            view::ramp("distance of the hit", "px", [0.0, 64.0]),
        )
    },
    View {
        source: Source::Truth,
        group: view::Group::Errors,
        ..view::map(
            "contact-hits",
            "Contact hits",
            "Pixels that the contact shadows darken, rightly and falsely.",
            Drawn::Contact(Legend::Classes(&[
                Class::label(2, "dark, in shadow in truth"),
                Class::new(FALSE_SHADOW, "false hit: dark, lit in truth"),
            ])),
        )
    },
    View {
        source: Source::Truth,
        group: view::Group::Errors,
        ..view::map(
            "contact-gain",
            "Contact gain",
            "What the contact shadows changed: pixels that the technique alone has wrong and that are right with them, and \
             the other way round.",
            Drawn::Contact(Legend::Classes(&[
                Class::label(2, "gain: wrong without, right with them"),
                Class::new(FALSE_SHADOW, "loss: right without, wrong with them"),
            ])),
        )
    },
];

/// Whether a technique's values ask for contact shadows.
pub fn wanted(values: &Values) -> bool {
    matches!(values.get("contact"), Some(Value::Text(mode)) if mode != "off")
}

/// Turns them off.
pub fn turn_off(values: &mut Values) {
    values.insert("contact".into(), Value::Text("off".into()));
}

/// The name of their pass among the times.
const PASS: &str = "contact shadows";
/// Threads of a workgroup of the sweep: as many pixels one behind the other, on one line.
const LANES: i32 = 64;
/// Bands of that many pixels in the largest picture, in all directions from the light.
const MOST_BANDS: usize = 544;
/// The farthest from the picture that the light's place in it may lie, pixels: whole numbers up to there are exact as floats.
const FARTHEST: f64 = 4194304.0;

/// How the picture is cut up for the sweep, as `Sweep` in `shaders/contact.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Sweep {
    /// The light's pixel.
    pub light: [i32; 2],
    /// 1 over its depth along the camera's axis, 1/m; 0 of the sun.
    pub light_depth: f32,
    /// Rays run towards that pixel (1), or, where the light is behind the camera, away from it (-1).
    pub towards: i32,
    /// Each with its wedge (1: along y; 2: on the side of lower numbers), the distance of its farthest pixels from the light
    /// along the wedge's axis, the first line that crosses it there, counted from the light, and how many there are.
    pub bands: [[i32; 4]; MOST_BANDS],
}

impl Sweep {
    /// Cuts a picture of a light up: four wedges around the light's place in the picture, each in bands of 64 pixels along its
    /// axis. How many bands there are, and the most lines of one.
    pub fn new(camera: &Camera, light: &Light, size: [u32; 2]) -> (Sweep, [u32; 2]) {
        let (place, depth) = place_of(camera, light, size);
        let sun = matches!(light, Light::Directional { .. });
        let mut sweep = Sweep {
            light: [place.x, place.y].map(|x| x.floor() as i32),
            light_depth: if sun { 0.0 } else { depth.recip() as f32 },
            towards: if depth < 0.0 { -1 } else { 1 },
            bands: [[0; 4]; MOST_BANDS],
        };
        let light = sweep.light;
        let (mut count, mut most) = (0, 0);
        for wedge in 0..4 {
            let (axis, lower) = (wedge & 1, wedge & 2 != 0);
            let (along, across) = (light[axis], light[1 - axis]);
            let [length, breadth] = [size[axis], size[1 - axis]].map(|s| s as i32);
            // The light's own pixel belongs to the first wedge.
            let nearest = if wedge == 0 { 0 } else { 1 };
            let (near, end) = if lower { (along - length + 1, along) } else { (-along, length - 1 - along) };
            let near = near.max(nearest);
            for first in (near..=end).step_by(LANES as usize) {
                let far = first + LANES - 1;
                // A line moves by less than a band's length across it.
                let low = (-across - LANES).max(-far);
                let high = (breadth - across + LANES).min(far);
                if low <= high && count < MOST_BANDS {
                    sweep.bands[count] = [wedge as i32, far, low, high - low + 1];
                    count += 1;
                    most = most.max(high - low + 1);
                }
            }
        }
        (sweep, [count as u32, most as u32])
    }
}

/// Where the light is in the picture, pixels from the upper left corner, and its depth along the camera's axis, below zero behind
/// the camera: metres, of the sun per metre towards it. An area light is its centre.
fn place_of(camera: &Camera, light: &Light, size: [u32; 2]) -> (DVec2, f64) {
    let [x, y, corner] = camera.rays(size);
    let from = if matches!(light, Light::Directional { .. }) { DVec3::ZERO } else { camera.position.as_dvec3() };
    let to_light = light.position().as_dvec3() - from;
    let mut p = DMat3::from_cols(x, y, corner).inverse() * to_light;
    let least = (p.x.abs().max(p.y.abs()) / FARTHEST).max(1e-12);
    if p.z.abs() < least {
        p.z = least.copysign(p.z);
    }
    (p.truncate() / p.z, p.z)
}

/// The contact shadows of one light.
pub struct Contact {
    march: Pass,
    sweep: Pass,
    /// Where the sweep has no meaning.
    pass_by: Pass,
    /// The technique's visibility without them.
    before: Slot,
    held: Option<(Sweep, Buffer)>,
}

impl Contact {
    pub fn new(gpu: &Gpu) -> Result<Contact> {
        let pass = |entry| Pass::compute(gpu, PASS, "contact.wgsl", entry, &[ContactParams::GROUP]);
        Ok(Contact {
            march: pass("march")?,
            sweep: pass("sweep")?,
            pass_by: pass("pass_by")?,
            before: Slot::default(),
            held: None,
        })
    }

    /// The technique's visibility without them.
    pub fn before(&self) -> &Slot {
        &self.before
    }

    /// Has a technique drawn, and takes the lower of its visibility and theirs.
    pub fn over(&mut self, f: &mut Frame, draw: impl FnOnce(&mut Frame) -> Result<()>) -> Result<()> {
        let gpu = f.gpu;
        let before = self.before.get(gpu, "visibility without contact shadows", f.size, Format::R32Float, STORED);
        let kept = ["visibility", "visibility_out"].map(|name| (name, f.set(name, &before)));
        let drawn = draw(f);
        for (name, resource) in kept {
            if let Some(resource) = resource {
                f.set(name, resource);
            }
        }
        drawn?;
        if ContactParams::read(f.values).contact == "march" {
            f.run(&self.march).of_picture().bind("visibility_before", &before).per_pixel();
            return Ok(());
        }
        if f.eye.height.is_some() {
            f.tell_note(
                "contact = sweep follows lines through the light's place in the picture, and an orthographic picture has none for the \
                 sun: it darkens nothing there; contact = march does."
                    .into(),
            );
            f.run(&self.pass_by).of_picture().bind("visibility_before", &before).per_pixel();
            return Ok(());
        }
        let (sweep, [bands, lines]) = Sweep::new(&f.eye, &f.light, f.size);
        let buffer = match &mut self.held {
            Some((held, buffer)) => {
                if *held != sweep {
                    gpu.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&sweep));
                    *held = sweep;
                }
                buffer
            }
            held => {
                let buffer = gpu.buffer("contact sweep", bytemuck::bytes_of(&sweep), wgpu::BufferUsages::UNIFORM);
                &mut held.insert((sweep, buffer)).1
            }
        };
        let run = f.run(&self.sweep).of_picture().bind("visibility_before", &before);
        run.bind("cut", &*buffer).dispatch(lines, bands, 1);
        Ok(())
    }
}

/// What contact shadows did to the pixels that can be wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Pixels that they darken, and those of them that are in shadow in truth.
    pub hits: u64,
    pub right: u64,
    /// Pixels that the technique alone has wrong by detachment ([`crate::measure::causes`]), and those of them that they darken.
    pub detached: u64,
    pub repaired: u64,
    /// Pixels that are right with them alone, and wrong with them alone.
    pub gained: u64,
    pub lost: u64,
}

impl Found {
    /// Counts over a frame: its pixels with the technique's own visibility, their causes, and the contact shadows' visibility.
    pub fn count(p: &Pixels, causes: &Causes, contact: &[f32]) -> Found {
        let mut found = Found::default();
        for i in (0..p.mask.len()).filter(|i| p.mask[*i] == FACING) {
            let (lit, hit, before) = (p.hard[i] >= 0.5, contact[i] < 0.5, p.visibility[i] >= 0.5);
            let detached = causes.classes[i] == DETACHMENT;
            found.hits += hit as u64;
            found.right += (hit && !lit) as u64;
            found.detached += detached as u64;
            found.repaired += (detached && hit) as u64;
            found.gained += (hit && before && !lit) as u64;
            found.lost += (hit && before && lit) as u64;
        }
        found
    }

    /// Together with another frame's.
    pub fn and(self, other: Found) -> Found {
        Found {
            hits: self.hits + other.hits,
            right: self.right + other.right,
            detached: self.detached + other.detached,
            repaired: self.repaired + other.repaired,
            gained: self.gained + other.gained,
            lost: self.lost + other.lost,
        }
    }
}

/// The group that every technique has beside its own.
pub const GROUP: Group = ContactParams::GROUP;
