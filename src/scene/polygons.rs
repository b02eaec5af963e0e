//! Scenes of files that hold polygons and nothing else: no nodes, cameras, lights or units.

use super::gltf::{MAX_TRIANGLES, too_many};
use super::{Local, Material, Mesh, Node, Scene, Texture, origin, presets};
use crate::message::{counted, shortened};
use anyhow::{Result, anyhow, bail, ensure};
use earcut::{Earcut, utils3d::project3d_to_2d};
use glam::{DQuat, DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use std::path::Path;

/// In place of an index that a corner does not have.
pub const NONE: u32 = u32::MAX;

/// In place of an index that a corner has, but that no file can mean: it counts back beyond the first.
pub const WRONG: u32 = NONE - 1;

pub const NO_FACES: &str = "it holds no faces to draw, only points or lines; export it with its faces";

/// A file's polygons.
#[derive(Default)]
pub struct Polygons {
    pub positions: Vec<DVec3>,
    /// Linear; empty, or one a position.
    pub colors: Vec<Vec4>,
    pub normals: Vec<Vec3>,
    /// (0, 0) is the image's upper left corner.
    pub uvs: Vec<Vec2>,
    pub corners: Vec<Corner>,
    pub faces: Vec<Face>,
}

/// A corner of a face, as indices, the last two of which may be [`NONE`].
#[derive(Clone, Copy)]
pub struct Corner {
    pub position: u32,
    pub normal: u32,
    pub uv: u32,
}

/// A polygon, counter-clockwise seen from the front.
pub struct Face {
    /// Where its corners begin among all, and how many there are.
    pub first: u32,
    pub count: u32,
    pub material: u32,
    /// Corners without a normal have the mean of those faces around that are of the same group; 0: of none, the face is flat.
    pub smooth: u32,
}

/// What tells the vertices of one mesh apart: position, texture coordinates, and the normal's kind and number.
type Key = (u32, u32, u8, u32);

impl Polygons {
    /// Adds a face of the corners from `first` on.
    pub fn face(&mut self, first: usize, material: u32, smooth: u32) {
        let count = self.corners.len() - first;
        self.faces.push(Face { first: first as u32, count: count as u32, material, smooth });
    }

    /// The scene of them: a mesh a material, seen from both sides, with cameras and lights that suit it.
    ///
    /// # Errors
    /// An index or number that is none, no triangles, or too many.
    pub fn scene(
        mut self,
        path: &Path,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        notes: Vec<String>,
    ) -> Result<Scene> {
        self.check()?;
        let lost = self.drop_lost();
        // The distance from zero goes into a node of 64 bits before the vertices are rounded.
        let used = self.corners.iter().map(|corner| self.positions[corner.position as usize]);
        let (low, high) = used.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let place = origin::origin([low, high]);
        let local = |corner: &Corner| (self.positions[corner.position as usize] - place).as_vec3();

        let normals: Vec<DVec3> = self.faces.iter().map(|face| self.normal(face)).collect();
        let mut smooth: HashMap<(u32, u32), DVec3> = HashMap::new();
        for (face, normal) in self.faces.iter().zip(&normals).filter(|(face, _)| face.smooth != 0) {
            for corner in self.corners_of(face) {
                *smooth.entry((corner.position, face.smooth)).or_default() += *normal;
            }
        }
        let mut meshes: Vec<(Mesh, HashMap<Key, u32>)> = Vec::new();
        let mut of_material: HashMap<u32, usize> = HashMap::new();
        let mut split = Split::default();
        let (mut flat, mut outside) = (0, 0);
        for (number, (face, face_normal)) in self.faces.iter().zip(&normals).enumerate() {
            let corners = self.corners_of(face);
            let at = *of_material.entry(face.material).or_insert_with(|| {
                meshes.push((Mesh { material: face.material, ..Mesh::default() }, HashMap::new()));
                meshes.len() - 1
            });
            let (mesh, known) = &mut meshes[at];
            for triangle in split.triangles(corners.iter().map(|c| self.positions[c.position as usize] - place)) {
                let [a, b, c] = triangle.map(|i| local(&corners[i]).as_dvec3());
                if (b - a).cross(c - a) == DVec3::ZERO {
                    flat += 1;
                    continue;
                }
                for corner in triangle.map(|i| corners[i]) {
                    let own = self.normals.get(corner.normal as usize).and_then(|n| n.try_normalize());
                    let (kind, group, normal) = match own {
                        Some(normal) => (0, corner.normal, normal),
                        None if face.smooth != 0 => {
                            let sum = smooth.get(&(corner.position, face.smooth)).copied().unwrap_or_default();
                            (1, face.smooth, sum.normalize_or(face_normal.normalize_or(DVec3::Y)).as_vec3())
                        }
                        None => (2, number as u32, face_normal.normalize_or(DVec3::Y).as_vec3()),
                    };
                    let next = mesh.positions.len() as u32;
                    let index = *known.entry((corner.position, corner.uv, kind, group)).or_insert(next);
                    if index == next {
                        let uv = self.uvs.get(corner.uv as usize).copied().unwrap_or_default();
                        outside += usize::from(!uv.is_finite());
                        mesh.positions.push(local(&corner));
                        mesh.colors.extend(self.colors.get(corner.position as usize));
                        mesh.normals.push(normal);
                        mesh.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
                    }
                    mesh.indices.push(index);
                }
            }
        }
        let meshes: Vec<Mesh> =
            meshes.into_iter().map(|(mesh, _)| mesh).filter(|mesh| !mesh.indices.is_empty()).collect();
        ensure!(!meshes.is_empty(), "it holds no triangles to draw; export it with its faces");
        let local = Local::Trs { translation: place, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        let node = Node { local, meshes: (0..meshes.len() as u32).collect(), ..Node::default() };
        let mut scene = Scene {
            name: shortened(&path.file_stem().unwrap_or_default().to_string_lossy()),
            meshes,
            nodes: vec![node],
            materials,
            textures,
            notes,
            ..Scene::default()
        };
        scene.notes.extend(counted(flat, "triangle without area is left out.", "triangles without area are left out."));
        scene.notes.extend(counted(
            split.fanned,
            "face has so many corners that it is cut as a fan, which is right only where it is convex.",
            "faces have so many corners that they are cut as fans, which is right only where they are convex.",
        ));
        scene.notes.extend(counted(
            outside,
            "vertex has texture coordinates that are not finite, which are set to zero.",
            "vertices have texture coordinates that are not finite, which are set to zero.",
        ));
        scene.notes.extend(counted(
            lost,
            "corner of a face names a normal or texture coordinate that the file does not have, and does without.",
            "corners of faces name normals or texture coordinates that the file does not have, and do without.",
        ));
        let bounds = origin::take_off(&mut scene)?;
        presets::add(&mut scene, bounds);
        Ok(scene)
    }

    fn check(&self) -> Result<()> {
        let triangles = self.faces.iter().map(|face| u64::from(face.count).saturating_sub(2)).sum();
        if triangles > MAX_TRIANGLES {
            return Err(too_many(triangles));
        }
        ensure!(triangles > 0, NO_FACES);
        for corner in &self.corners {
            let (number, count) = (u64::from(corner.position) + 1, self.positions.len());
            let Some(position) = self.positions.get(corner.position as usize) else {
                bail!(
                    "a face has the vertex number {number}, but the file has {count}; it is damaged or badly exported, export it \
                     again"
                );
            };
            if !position.as_vec3().is_finite() {
                bail!("the position of vertex number {number} is not finite; export it again");
            }
        }
        Ok(())
    }

    /// Takes normals and texture coordinates that are not there off the corners that name them, and says how many do. A surface is
    /// complete without; some exporters leave them out.
    fn drop_lost(&mut self) -> usize {
        let (normals, uvs) = (self.normals.len(), self.uvs.len());
        let mut lost = 0;
        for corner in &mut self.corners {
            let mut is_lost = false;
            for (index, count) in [(&mut corner.normal, normals), (&mut corner.uv, uvs)] {
                if *index != NONE && *index as usize >= count {
                    *index = NONE;
                    is_lost = true;
                }
            }
            lost += usize::from(is_lost);
        }
        lost
    }

    fn corners_of(&self, face: &Face) -> &[Corner] {
        &self.corners[face.first as usize..][..face.count as usize]
    }

    /// A face's normal by Newell's method; its length is twice the area.
    fn normal(&self, face: &Face) -> DVec3 {
        let corners = self.corners_of(face);
        let Some(first) = corners.first() else { return DVec3::ZERO };
        let at = |i: usize| {
            self.positions[corners[i % corners.len()].position as usize] - self.positions[first.position as usize]
        };
        (0..corners.len()).map(|i| at(i).cross(at(i + 1))).sum()
    }
}

/// From how many corners on it counts how long ears are sought.
const MANY: usize = 256;
/// How long they are sought in a file: the sum of the squares of such polygons' corners, which it takes at worst.
const MOST_SOUGHT: u64 = 400_000_000;

/// Splits polygons into triangles.
#[derive(Default)]
struct Split {
    sought: u64,
    /// Polygons that would have taken too long and are cut as fans.
    fanned: usize,
    ears: Option<Earcut<f64>>,
    plane: Vec<[f64; 2]>,
    found: Vec<u32>,
}

impl Split {
    /// The triangles as numbers of corners: a fan where the polygon is convex, else ears.
    fn triangles(&mut self, corners: impl Iterator<Item = DVec3>) -> Vec<[usize; 3]> {
        let ring: Vec<DVec3> = corners.collect();
        let count = ring.len();
        let fan = |count: usize| (2..count).map(|i| [0, i - 1, i]).collect();
        if count <= 3 {
            return fan(count);
        }
        // One that comes to a corner again has no inside to speak of, and would keep the ears' search busy for long.
        let mut places: Vec<[u64; 3]> = ring.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
        places.sort_unstable();
        if places.windows(2).any(|two| two[0] == two[1]) {
            return fan(count);
        }
        let ring: Vec<[f64; 3]> = ring.iter().map(|p| (*p - ring[0]).to_array()).collect();
        if !project3d_to_2d(&ring, count, &mut self.plane) {
            return fan(count);
        }
        let plane = &self.plane;
        let turn = |a: usize, b: usize, c: usize| {
            let [a, b, c] = [plane[a], plane[b], plane[c]];
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        // Of fans of convex polygons all triangles turn the same way, and so do all corners.
        let convex = (0..count).all(|i| turn(i, (i + 1) % count, (i + 2) % count) >= 0.0);
        if convex && (2..count).all(|i| turn(0, i - 1, i) >= 0.0) {
            return fan(count);
        }
        let work = if count < MANY { 0 } else { (count as u64).pow(2) };
        if self.sought + work > MOST_SOUGHT {
            self.fanned += 1;
            return fan(count);
        }
        self.sought += work;
        self.ears.get_or_insert_with(Earcut::new).earcut(plane.iter().copied(), &[], &mut self.found);
        let ordered = |t: &[u32]| {
            let [a, b, c] = [t[0] as usize, t[1] as usize, t[2] as usize];
            if turn(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
        };
        self.found.chunks_exact(3).map(ordered).collect()
    }
}

/// A surface of one colour, linear, seen from both sides.
pub fn material(name: &str, base_color: Vec4) -> Material {
    Material { name: shortened(name), base_color, texture: None, alpha_cutoff: None, double_sided: true }
}

/// An sRGB colour from 0 to 1 in linear light.
pub fn linear(color: [f32; 3]) -> Vec4 {
    let [r, g, b] = color.map(|x| match x.clamp(0.0, 1.0) {
        x if x.is_nan() => 1.0,
        x if x <= 0.04045 => x / 12.92,
        x => ((x + 0.055) / 1.055).powf(2.4),
    });
    Vec4::new(r, g, b, 1.0)
}

/// The colour of surfaces of which the file says nothing.
pub const GREY: Vec4 = Vec4::new(0.8, 0.8, 0.8, 1.0);

/// As every reader says that a file cannot be loaded.
pub fn cannot_load(path: &Path, cause: &anyhow::Error) -> anyhow::Error {
    anyhow!("cannot load {}: {}", path.display(), crate::message::sentence(cause))
}
