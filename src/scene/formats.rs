//! Which reader a scene's file takes: by what it holds, or else by its name.

use super::{Scene, gltf, obj, ply, stl};
use crate::files;
use anyhow::{Result, bail};
use std::io::Read;
use std::path::Path;

/// How the names of files end that hold scenes.
pub const ENDINGS: [&str; 5] = ["glb", "gltf", "obj", "ply", "stl"];

/// Formats that are not read: how their files end and begin, their names, and what to do.
const FOREIGN: [(&[&str], &[u8], &str, &str); 11] = [
    (&["fbx"], b"Kaydara FBX", "FBX", BLENDER),
    (&["usdc"], b"PXR-USDC", "USD", BLENDER),
    (&["usda"], b"#usda", "USD", BLENDER),
    (&["usd", "usdz"], b"", "USD", BLENDER),
    (&["blend"], b"BLENDER", "Blender's own", BLENDER),
    (&["dae"], b"", "COLLADA", "convert it to glTF: `assimp export FILE.dae FILE.glb` does"),
    (&["3ds", "max"], b"", "3ds Max", "convert it to glTF: `assimp export FILE.3ds FILE.glb` does for .3ds"),
    (&["pbrt"], b"", "PBRT", "take its .ply files, or let `pbrt --toply` write its meshes as such"),
    (&["abc"], b"Ogawa", "Alembic", BLENDER),
    (&["zip", "7z", "rar"], b"PK\x03\x04", "archive", "unpack it and open the scene's file in it"),
    (&["gz", "xz", "zst"], b"\x1f\x8b", "archive", "unpack it and open the scene's file in it"),
];
const BLENDER: &str = "convert it to glTF: Blender opens it, and File > Export > glTF 2.0 writes a .glb";

/// The ending of a file's name, in small letters.
fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Whether a name is that of a scene's file, or of one in a format that is known not to be read.
pub fn is_named(path: &Path) -> bool {
    let ending = &*ending(path);
    ENDINGS.contains(&ending) || FOREIGN.iter().any(|(endings, ..)| endings.contains(&ending))
}

/// Loads a scene's file.
///
/// # Errors
/// One sentence that names the file.
pub fn load(path: &Path) -> Result<Scene> {
    let name = path.display();
    let mut start = Vec::new();
    let read = files::open(path, files::MOST_DATA).and_then(|file| file.take(512).read_to_end(&mut start));
    if let Err(error) = read {
        bail!("cannot load {name}: {}; check the path", files::reason(&error));
    }
    let ending = &*ending(path);
    let text = start.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&start).trim_ascii_start();
    if text.starts_with(b"glTF") || text.starts_with(b"{") {
        return gltf::load(path);
    }
    if text.starts_with(b"ply") && text.get(3).is_some_and(u8::is_ascii_whitespace) {
        return ply::load(path);
    }
    let foreign = |(endings, begins, ..): &&(&[&str], &[u8], &str, &str)| {
        !begins.is_empty() && start.starts_with(begins) || endings.contains(&ending)
    };
    if let Some((_, _, format, advice)) = FOREIGN.iter().find(foreign) {
        bail!("cannot load {name}: {format} files are not read; {advice}");
    }
    match ending {
        "gltf" | "glb" => gltf::load(path),
        "obj" => obj::load(path),
        "ply" => ply::load(path),
        "stl" => stl::load(path),
        _ if text.to_ascii_lowercase().starts_with(b"solid") => stl::load(path),
        _ => bail!("cannot load {name}: it is none of the formats that are read: {}", ENDINGS.join(", ")),
    }
}
