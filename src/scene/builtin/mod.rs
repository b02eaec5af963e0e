//! The scenes that come with the program, generated in code.

mod arches;
mod bench;
mod blocks;
pub(crate) mod builder;
pub mod cases;
pub(crate) mod crowd;
pub(crate) mod cubes;
mod hall;
mod observatory;
mod pavilion;
mod terrain;

use super::Scene;

use cases::CASES;

/// A generated scene: how it is called, what it shows and has, what makes it.
pub struct Builtin {
    pub name: &'static str,
    /// One line.
    pub description: &'static str,
    /// Drawn triangles, and the names of its cameras and lights: known before it is built.
    pub triangles: usize,
    pub cameras: &'static [&'static str],
    pub lights: &'static [&'static str],
    build: fn() -> Scene,
}

/// All generated scenes, in the order in which they are listed.
pub const SCENES: &[Builtin] = &[
    Builtin {
        name: "bench",
        description: "Two trees, a lamp, a flower box and a bench, with the nine views of Morais 2015",
        triangles: 55_026,
        cameras: &[
            "bench-side",
            "bench-with",
            "bench-against",
            "flowers-side",
            "flowers-with",
            "flowers-against",
            "trees-side",
            "trees-with",
            "trees-against",
        ],
        lights: &["sun", "spot", "lamp"],
        build: bench::build,
    },
    Builtin {
        name: "blocks",
        description: "A half-played tower of bevelled wooden blocks on a table",
        triangles: 18_054,
        cameras: &["default", "low", "close", "fallen", "above"],
        lights: &["sun", "spot", "omni", "window"],
        build: blocks::build,
    },
    Builtin {
        name: "arches",
        description: arches::DESCRIPTION,
        triangles: 262_876,
        cameras: &["atrium", "gallery", "curtain", "corner", "above"],
        lights: &["sun", "lantern", "spot", "hemisphere", "skylight"],
        build: arches::build,
    },
    Builtin {
        name: "hall",
        description: hall::DESCRIPTION,
        triangles: 125_502,
        cameras: &["room", "table", "windows", "counter", "lamp", "beams"],
        lights: &["sun", "pendant", "cage lamp", "ceiling lamp", "window"],
        build: hall::build,
    },
    Builtin {
        name: "observatory",
        description: observatory::DESCRIPTION,
        triangles: 52_434,
        cameras: &["path", "terrace", "telescope", "mast", "aerial"],
        lights: &["evening sun", "noon sun", "dome lamp", "floodlight"],
        build: observatory::build,
    },
    Builtin {
        name: "pavilion",
        description: pavilion::DESCRIPTION,
        triangles: 504_468,
        cameras: &["plaza", "canopy", "fins", "ramp", "panels", "aerial"],
        lights: &["sun", "low sun", "floodlight", "canopy lamp"],
        build: pavilion::build,
    },
    Builtin {
        name: "cubes",
        description: "Three cubes on a plane, one for each of three cascades",
        triangles: 778,
        cameras: &["default", "near", "above"],
        lights: &["sun", "spot", "omni", "area"],
        build: cubes::build,
    },
    Builtin {
        name: "terrain",
        description: "A village among hills, one kilometre of landscape under a low sun",
        triangles: 293_392,
        cameras: &["default", "street", "square", "meadow", "wood", "hill", "bird", "above"],
        lights: &["sun", "noon", "floodlight", "street lamp"],
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

/// Generates the scene called `name`, one of [`NAMES`] or a stability case; the same one, bit for bit, at every call.
pub fn build(name: &str) -> Option<Scene> {
    let scenes = SCENES.iter().map(|scene| (scene.name, scene.build));
    let (_, build) = scenes.chain(CASES.iter().map(|case| (case.id, case.build))).find(|(known, _)| *known == name)?;
    Some(build())
}

/// Whether [`build`] knows the name.
pub fn is_builtin(name: &str) -> bool {
    NAMES.contains(&name) || CASES.iter().any(|case| case.id == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles a scene should have, and by how much it may miss that.
    const BUDGETS: [(&str, usize, f32); 8] = [
        ("bench", 55_026, 0.01),
        ("blocks", 17_800, 0.03),
        ("arches", 260_000, 0.03),
        ("hall", 126_000, 0.03),
        ("observatory", 52_000, 0.03),
        ("pavilion", 505_000, 0.03),
        ("cubes", 750, 0.10),
        ("terrain", 250_000, 0.20),
    ];

    fn triangles(scene: &Scene) -> usize {
        let drawn = scene.nodes.iter().flat_map(|node| &node.meshes);
        drawn.map(|&mesh| scene.meshes[mesh as usize].indices.len() / 3).sum()
    }

    #[test]
    fn every_name_builds_the_scene_that_is_listed() {
        for listed in SCENES {
            let scene = build(listed.name).unwrap();
            assert_eq!((scene.name.as_str(), scene.triangles()), (listed.name, listed.triangles));
            assert!(
                scene.cameras.iter().map(|c| c.name.as_str()).eq(listed.cameras.iter().copied()),
                "{}",
                listed.name
            );
            assert!(scene.lights.iter().map(|l| l.name.as_str()).eq(listed.lights.iter().copied()), "{}", listed.name);
        }
        assert!(build("no such scene").is_none());
    }

    #[test]
    fn a_scene_is_the_same_at_every_build() {
        for name in NAMES {
            let [a, b] = [build(name), build(name)].map(Option::unwrap);
            assert_eq!(a.materials, b.materials, "{name}");
            assert_eq!(a.meshes.len(), b.meshes.len(), "{name}");
            for (a, b) in a.meshes.iter().zip(&b.meshes) {
                let same = a.positions == b.positions && a.normals == b.normals && a.uvs == b.uvs;
                assert!(same && a.indices == b.indices && a.material == b.material, "{name}");
            }
            for (a, b) in a.textures.iter().zip(&b.textures) {
                assert!(a.rgba == b.rgba, "{name}");
            }
        }
    }

    #[test]
    fn triangle_counts_keep_to_their_budgets() {
        for (name, budget, tolerance) in BUDGETS {
            let count = triangles(&build(name).unwrap());
            let miss = count as f32 / budget as f32 - 1.0;
            assert!(miss.abs() <= tolerance, "{name}: {count} for {budget}");
        }
    }

    #[test]
    fn meshes_are_sound() {
        for name in NAMES {
            let scene = build(name).unwrap();
            for mesh in &scene.meshes {
                let count = mesh.positions.len();
                let material = &scene.materials[mesh.material as usize];
                let what = format!("{name}: {}", material.name);
                assert_eq!((mesh.normals.len(), mesh.uvs.len()), (count, count), "{what}");
                assert!(mesh.indices.iter().all(|&i| (i as usize) < count), "{what}");
                assert_eq!(mesh.indices.len() % 3, 0, "{what}");
                assert!(mesh.positions.iter().all(|p| p.is_finite()), "{what}");
                assert!(mesh.uvs.iter().all(|uv| uv.is_finite()), "{what}");
                assert!(mesh.normals.iter().all(|n| n.is_normalized()), "{what}");
                for t in mesh.indices.chunks_exact(3) {
                    let [a, b, c] = [t[0], t[1], t[2]].map(|i| mesh.positions[i as usize]);
                    assert!((b - a).cross(c - a) != glam::Vec3::ZERO, "{what}: {a} {b} {c}");
                }
                if let Some(texture) = material.texture {
                    let texture = &scene.textures[texture as usize];
                    assert!(texture.width.max(texture.height) <= 512, "{what}");
                    assert_eq!(texture.rgba.len(), (texture.width * texture.height * 4) as usize);
                }
            }
        }
    }

    #[test]
    fn scenes_have_cameras_and_lights_with_names_of_their_own() {
        for name in NAMES {
            let scene = build(name).unwrap();
            assert!(scene.cameras.len() >= 2, "{name}");
            assert!(matches!(scene.lights[0].light, crate::light::Light::Directional { .. }), "{name}");
            for view in &scene.cameras {
                let same = scene.cameras.iter().filter(|other| other.name == view.name);
                assert_eq!(same.count(), 1, "{name}: {}", view.name);
                let camera = view.camera;
                assert!(camera.position.distance(camera.target) > camera.near, "{name}");
                assert!(0.0 < camera.near && camera.near < camera.far, "{name}");
            }
            for lit in &scene.lights {
                let same = scene.lights.iter().filter(|other| other.name == lit.name);
                assert_eq!(same.count(), 1, "{name}: {}", lit.name);
            }
        }
    }
}
