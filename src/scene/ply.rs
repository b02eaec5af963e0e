//! Loads PLY files, ASCII and binary.

use super::Scene;
use super::obj::Library;
use super::polygons::{Corner, GREY, NO_FACES, NONE, Polygons, cannot_load, linear, material};
use crate::files;
use crate::message::{counted, cut};
use anyhow::{Context, Result, anyhow, ensure};
use glam::{DVec3, Vec2, Vec3, Vec4};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::path::Path;

/// Loads a file, y up.
pub fn load(path: &Path) -> Result<Scene> {
    read(path).map_err(|cause| cannot_load(path, &cause))
}

/// A vertex, or a face or strip by its vertices.
#[derive(Default)]
struct Element {
    position: [Option<f64>; 3],
    normal: [Option<f32>; 3],
    uv: [Option<f32>; 2],
    /// From 0 to 1.
    color: [Option<f32>; 3],
    vertices: Vec<i64>,
    /// Texture coordinates of a face's corners, two each.
    corner_uvs: Vec<f32>,
    /// Which of the file's textures a face has.
    texture: usize,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Element::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let float = || value.to_f32_lossy();
        match name {
            "x" | "y" | "z" => {
                let number = if let Property::Double(x) = value { Some(x) } else { float().map(f64::from) };
                self.position[usize::from(name.as_bytes()[0] - b'x')] = number;
            }
            "nx" | "ny" | "nz" => self.normal[usize::from(name.as_bytes()[1] - b'x')] = float(),
            "u" | "s" | "texture_u" | "texture_s" => self.uv[0] = float(),
            "v" | "t" | "texture_v" | "texture_t" => self.uv[1] = float(),
            "red" | "diffuse_red" => self.color[0] = share(&value),
            "green" | "diffuse_green" => self.color[1] = share(&value),
            "blue" | "diffuse_blue" => self.color[2] = share(&value),
            "vertex_indices" | "vertex_index" => {
                self.vertices = match value {
                    Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
                    Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
                    Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
                    Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
                    Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
                    Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
                    _ => return PropertyAccessResult::Ignored,
                }
            }
            "texcoord" => {
                self.corner_uvs = match value {
                    Property::ListFloat(list) => list,
                    Property::ListDouble(list) => list.into_iter().map(|x| x as f32).collect(),
                    _ => return PropertyAccessResult::Ignored,
                }
            }
            "texnumber" => self.texture = float().map_or(0, |number| number as usize),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// A colour's component: whole numbers go to the largest of their kind.
fn share(value: &Property) -> Option<f32> {
    match value {
        Property::UChar(x) => Some(f32::from(*x) / 255.0),
        Property::UShort(x) => Some(f32::from(*x) / 65535.0),
        other => other.to_f32_lossy(),
    }
}

fn read(path: &Path) -> Result<Scene> {
    let data = files::read(path, files::MOST_DATA).map_err(|error| anyhow!(files::reason(&error)))?;
    let invalid = |error: ply_rs_bw::parser::ParseError| {
        // Below the first line stands how the reader works.
        let text = error.to_string();
        let line = text.lines().next().unwrap_or_default().trim_end_matches(['.', ':']);
        anyhow!("it is no PLY file that can be read ({}); export it again", cut(line, 160))
    };
    let parser = Parser::<Element>::new();
    let mut reader = Reader::new(&data[..]);
    let header = parser.read_header(&mut reader).map_err(invalid)?;
    for (name, element) in &header.elements {
        let held = element.count <= data.len() && !(element.properties.is_empty() && element.count > 0);
        ensure!(
            held,
            "it says that it has {} of {}, but has no room for them; export it again",
            element.count,
            cut(name, 40)
        );
    }
    let drawn = ["face", "tristrips"];
    let faces = drawn.iter().any(|name| header.elements.get(*name).is_some_and(|element| element.count > 0));
    ensure!(faces, NO_FACES);
    let mut notes: Vec<String> = Vec::new();
    for (name, element) in
        header.elements.iter().filter(|(name, _)| *name != "vertex" && !drawn.contains(&name.as_str()))
    {
        let name = cut(name, 40);
        notes.extend(counted(
            element.count,
            &format!("{name} is left out."),
            &format!("elements \"{name}\" are left out."),
        ));
    }
    // As MeshLab and programs for photogrammetry name their textures.
    let mut library = Library::beside(path);
    let mut textured = Vec::new();
    for comment in &header.comments {
        if let Some(("TextureFile", name)) = comment.trim().split_once(char::is_whitespace) {
            textured.push(library.painted(name.trim())?);
        }
    }
    let payload = parser.read_payload(&mut reader, &header).map_err(invalid)?;
    let vertices = payload.get("vertex").context("it has no element \"vertex\"; export it with vertices and faces")?;
    let mut polygons = Polygons::default();
    for vertex in vertices {
        let [Some(x), Some(y), Some(z)] = vertex.position else {
            return Err(anyhow!("its vertices lack x, y or z; export it again"));
        };
        polygons.positions.push(DVec3::new(x, y, z));
        if let [Some(x), Some(y), Some(z)] = vertex.normal {
            polygons.normals.push(Vec3::new(x, y, z));
        }
        if let [Some(r), Some(g), Some(b)] = vertex.color {
            polygons.colors.push(linear([r, g, b]));
        }
        if let [Some(u), Some(v)] = vertex.uv {
            polygons.uvs.push(Vec2::new(u, 1.0 - v));
        }
    }
    let count = vertices.len();
    let (normals, uvs) = (polygons.normals.len() == count, polygons.uvs.len() == count);
    let corner = |index: i64| {
        let index = u32::try_from(index).ok().filter(|index| *index != NONE);
        let index =
            index.with_context(|| "a face has a vertex number that is none; the file is damaged, export it again")?;
        anyhow::Ok(Corner {
            position: index,
            normal: if normals { index } else { NONE },
            uv: if uvs { index } else { NONE },
        })
    };
    for face in payload.get("face").into_iter().flatten() {
        let first = polygons.corners.len();
        for index in &face.vertices {
            polygons.corners.push(corner(*index)?);
        }
        if face.corner_uvs.len() == 2 * face.vertices.len() && !textured.is_empty() {
            for (corner, uv) in polygons.corners[first..].iter_mut().zip(face.corner_uvs.chunks_exact(2)) {
                corner.uv = polygons.uvs.len() as u32;
                polygons.uvs.push(Vec2::new(uv[0], 1.0 - uv[1]));
            }
        }
        polygons.face(first, textured.get(face.texture).or(textured.first()).copied().unwrap_or_default(), 0);
    }
    // Strips one after the other, with -1 between them.
    for list in payload.get("tristrips").into_iter().flatten() {
        for strip in list.vertices.split(|index| *index < 0) {
            for (i, v) in strip.windows(3).enumerate() {
                let first = polygons.corners.len();
                let [a, b, c] = if i % 2 == 0 { [v[0], v[1], v[2]] } else { [v[0], v[2], v[1]] };
                polygons.corners.extend([corner(a)?, corner(b)?, corner(c)?]);
                polygons.face(first, textured.first().copied().unwrap_or_default(), 0);
            }
        }
    }
    // A texture stands in the place of colours, which programs write beside it all the same.
    let colored = polygons.colors.len() == count && library.textures.is_empty();
    if !colored {
        polygons.colors.clear();
    }
    if textured.is_empty() {
        library.materials.push(material("PLY", GREY));
    }
    if colored {
        library.materials.iter_mut().for_each(|material| material.base_color = Vec4::ONE);
    }
    notes.extend(library.notes());
    polygons.scene(path, library.materials, library.textures, notes)
}
