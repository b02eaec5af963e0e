//! A technique from outside: shadows projected on a plane (Blinn 1988). All of the explorer, with this technique in its lists:
//!
//! ```sh
//! cargo run --release --example planar_shadow
//! cargo run --release --example planar_shadow -- measure blocks --techniques planar-shadow,shadow-map
//! ```
//!
//! docs/adding-a-technique.md goes through it line by line.

use anyhow::Result;
use shadowscope::frame::{DRAWN, Frame};
use shadowscope::gpu::{Buffer, Pass, Raster, Slot};
use shadowscope::params::Params;
use shadowscope::techniques::{Info, Own, Technique};
use shadowscope::view::{self, Class, Drawn, Legend};
use wgpu::{BufferUsages as Use, TextureFormat as Format};

shadowscope::params! {
    /// The plane, and what of the scene casts on it.
    pub struct PlanarParams {
        "Plane" {
            /// Height of the plane that receives the shadow, in the scene's coordinates.
            height: float(0.0, -1000.0..=1000.0, "m"),
            /// What lies flat within this distance of the plane receives.
            tolerance: float(0.01, 0.0..=1.0, "m"),
            /// What casts. Above: what rises above the plane by more than the tolerance. Any: whatever lies under it casts too, upwards, as a bare projection has it.
            casts: choice("above", ["above", "any"]),
        }
    }
}

static INFO: Info = Info {
    id: "planar-shadow",
    title: "Planar shadow",
    paper: "Blinn 1988",
    family: "Projection",
    mark: 48,
    doc: "The scene drawn once more, squashed on a plane from the light. Exact on that plane, and there are no shadows \
          anywhere else.",
    lights: &["directional", "spot", "omni", "hemisphere"],
    filter: None,
    smooth: |_| false,
    params: &[PlanarParams::GROUP],
    main: &[],
    maps: &[&[view::map(
        "receivers",
        "Receivers",
        "Which pixels lie on the plane: the others have no shadow.",
        Drawn::Labels(Legend::Classes(&[Class::label(2, "on the plane"), Class::label(7, "beside it")])),
    )]],
    needs: |_| &[],
    make: |gpu, info| {
        let raster = Raster {
            vertex: "squash",
            fragment: Some("cast_shadow"),
            targets: &[Format::R8Unorm],
            ..Raster::default()
        };
        Ok(Box::new(Planar {
            cast: Pass::render(gpu, "cast", FILE, raster, info.params)?,
            resolve: Pass::compute(gpu, "resolve", FILE, "resolve", info.params)?,
            inspect: Pass::compute(gpu, "inspect", FILE, "inspect", info.params)?,
            plane: gpu.room("plane", 16, Use::UNIFORM | Use::COPY_DST),
            shadow: Slot::default(),
        }))
    },
};

const FILE: &str = "techniques/planar_shadow.wgsl";

struct Planar {
    cast: Pass,
    resolve: Pass,
    inspect: Pass,
    plane: Buffer,
    shadow: Slot,
}

impl Technique for Planar {
    fn render(&mut self, f: &mut Frame) -> Result<()> {
        // Inside, coordinates are relative to the scene's middle.
        let height = f64::from(PlanarParams::read(f.values).height) - f.origin.y;
        f.gpu.queue.write_buffer(&self.plane, 0, bytemuck::bytes_of(&[height as f32, 0.0, 0.0, 0.0]));
        f.set("plane", &self.plane);
        let shadow = self.shadow.get(f.gpu, "shadow on the plane", f.size, Format::R8Unorm, DRAWN);
        let corners = f.scene.triangle_count * 3;
        f.run(&self.cast).of_picture().draw(&[&shadow], None, true, |p| p.draw(0..corners, 0..1));
        f.run(&self.resolve).bind("shadow", &shadow).of_picture().per_pixel();
        if f.wants_any_map() {
            f.run(&self.inspect).of_picture().per_pixel();
        }
        Ok(())
    }
}

static OWN: [Own; 1] = [Own { info: &INFO, shaders: &[(FILE, include_str!("planar_shadow.wgsl"))] }];

fn main() -> std::process::ExitCode {
    shadowscope::cli::main(&OWN)
}
