//! Unwarped maps under every light: a single one under suns and spots, and around lamps one for each of a cube's faces.

use super::faces::{self, Faces, around, looked_at};
use super::filter::{Filter, LookUp, Reach};
use super::single::ShadowMap;
use super::{MapParams, Maps};
use crate::frame::Frame;
use crate::gpu::{Buffer, Resource, hold};
use crate::params::{Group, Params};
use anyhow::Result;

/// The maps of the last frame's kind of light, and what looks them up.
pub struct PlainMaps {
    files: [&'static str; 2],
    groups: &'static [Group],
    held: Option<(bool, (Drawn, LookUp))>,
}

enum Drawn {
    Single(Box<ShadowMap>),
    Cube(Box<Faces>),
}

impl PlainMaps {
    /// `files`: the technique's shaders that look a single map up and a cube's; `groups`: all of its parameters, with
    /// [`faces::FaceParams`] among them.
    pub fn new(files: [&'static str; 2], groups: &'static [Group]) -> PlainMaps {
        PlainMaps { files, groups, held: None }
    }

    /// Fits the maps to the frame's light and draws the casters' depth. `reach`: how far the filter's taps lie from the receiver.
    ///
    /// # Errors
    /// Maps that the adapter cannot hold, or passes that cannot be made.
    pub fn draw(&mut self, f: &mut Frame, reach: Reach) -> Result<Maps> {
        let (files, groups) = (self.files, self.groups);
        let is_around = faces::LIGHTS.contains(&f.light.kind());
        let (drawn, _) = hold(&mut self.held, is_around, |is_around| {
            let drawn = match is_around {
                true => Drawn::Cube(Box::new(Faces::new(f.gpu)?)),
                false => Drawn::Single(Box::new(ShadowMap::new(f.gpu)?)),
            };
            Ok((drawn, LookUp::new(f.gpu, files[*is_around as usize], groups)))
        })?;
        match drawn {
            Drawn::Single(map) => map.render(f, reach),
            Drawn::Cube(cube) => {
                let around = around(f, MapParams::read(f.values).resolution, reach)?;
                let views = around.cube();
                cube.prepare(f, &around, &views);
                cube.draw(f, &around, &views)
            }
        }
    }

    /// Of maps that were drawn for a lamp, the light view of each alone, and the draws that say which of them are drawn at all
    /// (`draws` in `shaders/map/faces.wgsl`).
    pub fn faces(&self) -> Option<(Vec<Buffer>, Buffer)> {
        match &self.held {
            Some((_, (Drawn::Cube(cube), _))) => Some((cube.single_views(), cube.draws().clone())),
            _ => None,
        }
    }

    /// Fills the frame's visibility from the maps that were drawn, and draws the view that is asked for, as [`LookUp::run`].
    ///
    /// # Errors
    /// Passes that cannot be made.
    pub fn look_up(
        &mut self,
        f: &mut Frame,
        maps: &Maps,
        filter: &Filter,
        bound: &[(&'static str, Resource)],
    ) -> Result<()> {
        if let Some((is_around, (_, look_up))) = &mut self.held {
            look_up.run(f, maps, filter, bound)?;
            if *is_around {
                f.show_map(looked_at(f));
            }
        }
        Ok(())
    }

    /// The shader of the last frame's kind of light.
    pub fn file(&self) -> &'static str {
        self.files[self.faces_drawn() as usize]
    }

    fn faces_drawn(&self) -> bool {
        matches!(&self.held, Some((_, (Drawn::Cube(_), _))))
    }
}
