//! The scenes that come with the program, generated in code.

mod arches;
mod bench;
mod blocks;
mod builder;
mod cubes;
mod hall;
mod observatory;
mod pavilion;
mod terrain;

use super::Scene;

/// A generated scene: how it is called, what it shows, what makes it.
pub struct Builtin {
    pub name: &'static str,
    /// One line.
    pub description: &'static str,
    build: fn() -> Scene,
}

/// All generated scenes, in the order in which they are listed.
pub const SCENES: &[Builtin] = &[
    Builtin {
        name: "bench",
        description: "Two trees, a lamp, a flower box and a bench, with the nine views of Morais 2015",
        build: bench::build,
    },
    Builtin {
        name: "blocks",
        description: "A half-played tower of bevelled wooden blocks on a table",
        build: blocks::build,
    },
    Builtin {
        name: "arches",
        description: arches::DESCRIPTION,
        build: arches::build,
    },
    Builtin {
        name: "hall",
        description: hall::DESCRIPTION,
        build: hall::build,
    },
    Builtin {
        name: "observatory",
        description: observatory::DESCRIPTION,
        build: observatory::build,
    },
    Builtin {
        name: "pavilion",
        description: pavilion::DESCRIPTION,
        build: pavilion::build,
    },
    Builtin {
        name: "cubes",
        description: "Three cubes on a plane, one for each of three cascades",
        build: cubes::build,
    },
    Builtin {
        name: "terrain",
        description: "A village among hills, one kilometre of landscape under a low sun",
        build: terrain::build,
    },
];

/// The scenes' names, in the order of [`SCENES`].
pub const NAMES: &[&str] = &{
    let mut names = [""; SCENES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = SCENES[i].name;
        i += 1;
    }
    names
};

/// Generates the scene called `name`; the same one, bit for bit, at every call.
pub fn build(name: &str) -> Option<Scene> {
    let scene = SCENES.iter().find(|scene| scene.name == name)?;
    Some((scene.build)())
}
