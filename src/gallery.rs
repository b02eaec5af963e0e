//! Set-ups that come with the program: each a file that opens as any other, whose first lines are its title and what it shows.

use crate::scene::Scene;
use crate::setup::Setup;
use anyhow::{Context, Result};
use include_dir::{Dir, include_dir};
use std::path::Path;
use std::sync::OnceLock;

static EMBEDDED: Dir = include_dir!("$CARGO_MANIFEST_DIR/assets/gallery");

/// A set-up of the gallery.
pub struct Exhibit {
    /// Its file's name without the ending.
    pub id: String,
    pub title: String,
    pub about: String,
    text: &'static str,
}

impl Exhibit {
    /// The set-up and its scene.
    ///
    /// # Errors
    /// As [`Setup::from_toml`].
    pub fn open(&self) -> Result<(Setup, Scene)> {
        Setup::from_toml(self.text, Path::new("")).with_context(|| format!("the set-up {} cannot be opened", self.id))
    }

    /// The set-up, in its scene that is there already.
    ///
    /// # Errors
    /// As [`Exhibit::open`].
    pub fn in_scene(&self, scene: &Scene) -> Result<Setup> {
        Ok(Setup::in_scene(toml::from_str(self.text)?, &self.scene()?, scene)?.0)
    }

    /// The name of its scene.
    pub fn scene(&self) -> Result<String> {
        Setup::scene_named(&toml::from_str(self.text)?, Path::new(""))
    }
}

/// All of them, by their files' names.
pub fn all() -> &'static [Exhibit] {
    static ALL: OnceLock<Vec<Exhibit>> = OnceLock::new();
    ALL.get_or_init(|| {
        let one = |file: &'static include_dir::File| {
            let text = file.contents_utf8()?;
            let mut lines = text.lines().map(|line| line.trim_start_matches('#').trim().to_string());
            let id = file.path().file_stem()?.to_string_lossy().into_owned();
            Some(Exhibit { id, title: lines.next()?, about: lines.next()?, text })
        };
        let mut all: Vec<Exhibit> = EMBEDDED.files().filter_map(one).collect();
        all.sort_by(|a, b| a.id.cmp(&b.id));
        all
    })
}

/// One by its id.
pub fn find(id: &str) -> Option<&'static Exhibit> {
    all().iter().find(|e| e.id == id)
}
