//! Scenes in OBJ, PLY and STL, formats that are refused, and presets beside a scene's file.

use crate::common::{ok, shadowscope};
use glam::{DVec3, Vec2, Vec3, Vec4};
use shadowscope::scene::geometry::Geometry;
use shadowscope::scene::{Mesh, Scene, formats};
use std::path::Path;

fn load(folder: &Path, name: &str, contents: &[u8]) -> anyhow::Result<Scene> {
    std::fs::write(folder.join(name), contents).unwrap();
    formats::load(&folder.join(name))
}

fn loaded(name: &str, contents: &[u8]) -> Scene {
    load(tempfile::tempdir().unwrap().path(), name, contents).unwrap()
}

fn refused(name: &str, contents: &[u8]) -> String {
    let message =
        format!("{:#}", load(tempfile::tempdir().unwrap().path(), name, contents).expect_err("must be refused"));
    assert!(message.contains(name) && !message.contains('\n') && message.chars().count() < 500, "{message}");
    message
}

fn area(mesh: &Mesh) -> f32 {
    let corner = |i: u32| mesh.positions[i as usize];
    let area = |t: &[u32]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length() / 2.0;
    mesh.indices.chunks_exact(3).map(area).sum()
}

/// A floor of 8 × 8, and a box of 1 × 2 × 1 on it, as quads that are counter-clockwise from outside.
fn floor_and_box() -> (Vec<[f32; 3]>, Vec<[usize; 4]>) {
    let mut corners = vec![[-4.0, 0.0, -4.0], [4.0, 0.0, -4.0], [4.0, 0.0, 4.0], [-4.0, 0.0, 4.0]];
    let mut faces = vec![[3, 2, 1, 0]];
    for i in 0..8 {
        let side = |bit: usize| if i & bit == 0 { 0.0 } else { 1.0 };
        corners.push([side(1), 2.0 * side(2), side(4)]);
    }
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3]];
    faces.extend(sides.map(|side: [usize; 4]| side.map(|i| i + 4)));
    (corners, faces)
}

fn as_obj() -> String {
    let (corners, faces) = floor_and_box();
    let mut text = String::from("# a comment\n");
    corners.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
    let count = corners.len() as i64;
    for (i, face) in faces.iter().enumerate() {
        // From the front, and from behind.
        let index = |v: usize| if i % 2 == 0 { v as i64 + 1 } else { v as i64 - count };
        text += &format!("f {} {} \\\n {} {}\n", index(face[0]), index(face[1]), index(face[2]), index(face[3]));
    }
    text
}

fn as_ply(encoding: &str) -> Vec<u8> {
    let (corners, faces) = floor_and_box();
    let mut data = format!(
        "ply\nformat {encoding} 1.0\ncomment made here\nelement vertex {}\nproperty float x\nproperty double y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        corners.len(),
        faces.len()
    )
    .into_bytes();
    let big = encoding == "binary_big_endian";
    let turned = |bytes: &[u8]| -> Vec<u8> { if big { bytes.iter().rev().copied().collect() } else { bytes.to_vec() } };
    for [x, y, z] in corners {
        if encoding == "ascii" {
            data.extend(format!("{x} {y} {z}\n").bytes());
        } else {
            data.extend(turned(&f32::to_le_bytes(x)));
            data.extend(turned(&f64::from(y).to_le_bytes()));
            data.extend(turned(&z.to_le_bytes()));
        }
    }
    for face in faces {
        if encoding == "ascii" {
            data.extend(format!("4 {} {} {} {}\n", face[0], face[1], face[2], face[3]).bytes());
        } else {
            data.push(4);
            face.iter().for_each(|i| data.extend(turned(&(*i as i32).to_le_bytes())));
        }
    }
    data
}

/// The triangles, z up.
fn turned() -> Vec<[[f32; 3]; 3]> {
    let (corners, faces) = floor_and_box();
    let turned = |i: usize| [corners[i][0], -corners[i][2], corners[i][1]];
    faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).map(|t| t.map(turned)).collect()
}

fn as_stl(header: &[u8]) -> Vec<u8> {
    let mut data = header.to_vec();
    data.resize(80, b' ');
    data.extend((turned().len() as u32).to_le_bytes());
    for triangle in turned() {
        data.extend([0; 12]);
        triangle.iter().flatten().for_each(|x| data.extend(x.to_le_bytes()));
        data.extend([0; 2]);
    }
    data
}

fn as_ascii_stl() -> String {
    let mut text = String::from("SOLID\n");
    for (i, triangle) in turned().into_iter().enumerate() {
        if i == 2 {
            text += "endsolid floor\nsolid box\n";
        }
        text += " facet normal 0 0 0\n  outer loop\n";
        triangle.iter().for_each(|[x, y, z]| text += &format!("   vertex {x} {y} {z:e}\n"));
        text += "  endloop\n endfacet\n";
    }
    text + "endsolid"
}

/// One scene in every format: the same surface, and the same true shadow of each pixel.
#[test]
fn all_formats_hold_the_same_scene() {
    let dir = tempfile::tempdir().unwrap();
    let files: [(&str, Vec<u8>); 7] = [
        ("a.obj", as_obj().into_bytes()),
        ("b.ply", as_ply("ascii")),
        ("c.ply", as_ply("binary_little_endian")),
        ("d.ply", as_ply("binary_big_endian")),
        ("e.stl", as_stl(b"")),
        ("f.stl", as_stl(b"solid but binary")),
        ("g.stl", as_ascii_stl().into_bytes()),
    ];
    let mut first = None;
    for (name, contents) in files {
        let scene = load(dir.path(), name, &contents).unwrap();
        assert_eq!((scene.triangles(), scene.cameras.len() >= 2, scene.lights.len()), (14, true, 4), "{name}");
        let total: f32 = scene.meshes.iter().map(area).sum();
        assert!((total - (64.0 + 2.0 + 8.0)).abs() < 1e-4, "{name}: {total}");
        assert_eq!(scene.notes.iter().any(|note| note.contains("z is taken as up")), name.ends_with("stl"), "{name}");
        let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
        let edges = geometry.edges().found;
        assert_eq!((edges.open, edges.twisted, edges.degenerate), (4, 0, 0), "{name}: the box is closed");
        let aim =
            ["--camera=5,6,7:0,0,0:50", "--light=directional:to_light=-0.5,1,0.3", "--size=96x72", "--view=truth"];
        ok(dir.path(), &[&["capture", name, "-o", "x.png"], &aim[..]].concat());
        let picture = image::open(dir.path().join("x.png")).unwrap().into_rgba8();
        let shades: std::collections::BTreeSet<[u8; 4]> = picture.pixels().map(|p| p.0).collect();
        assert!(shades.len() > 2, "{name} shows nothing");
        assert!(*first.get_or_insert(picture.clone()) == picture, "{name} is another picture than a.obj");
    }
}

#[test]
fn polygons_of_any_shape_are_filled() {
    // An L, whose fan from the first corner would leave it; and a square with a corner in its side.
    let scene = loaded("l.obj", b"v 0 0 0\nv 0 0 2\nv 2 0 2\nv 2 0 1\nv 1 0 1\nv 1 0 0\nf 4 5 6 1 2 3 # an L\n");
    assert!((area(&scene.meshes[0]) - 3.0).abs() < 1e-6);
    let up = |n: &Vec3| n.abs_diff_eq(Vec3::Y, 1e-6);
    assert!(scene.meshes[0].normals.iter().all(up));
    let corner = |i: u32| scene.meshes[0].positions[i as usize];
    for t in scene.meshes[0].indices.chunks_exact(3) {
        let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
        assert!((b - a).cross(c - a).y > 0.0, "all triangles are turned as the polygon is");
    }
    let scene = loaded("s.obj", b"v 0 0 0\nv 0 0 2\nv 1 0 2\nv 2 0 2\nv 2 0 0\nf 3 4 5 1 2\n");
    assert!((area(&scene.meshes[0]) - 4.0).abs() < 1e-6);
}

#[test]
fn normals_are_given_or_smooth_or_flat() {
    // Two faces of a roof.
    let roof = "v 0 0 1\nv 0 0 -1\nv 1 1 -1\nv 1 1 1\nv 2 0 1\nv 2 0 -1\n";
    let faces = "f 1 4 3 2\nf 4 5 6 3\n";
    let ridge = |text: &str| -> Vec<Vec3> {
        let scene = loaded("roof.obj", text.as_bytes());
        let mesh = &scene.meshes[0];
        let top = mesh.positions.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        mesh.positions.iter().zip(&mesh.normals).filter(|(p, _)| p.y == top).map(|(_, n)| *n).collect()
    };
    let flat = ridge(&format!("{roof}{faces}"));
    assert_eq!(flat.len(), 4);
    assert!(flat.iter().all(|n| (n.x.abs() - 0.5f32.sqrt()).abs() < 1e-6 && n.y > 0.0), "{flat:?}");
    let smooth = ridge(&format!("{roof}s 7\n{faces}"));
    assert_eq!(smooth.len(), 2);
    assert!(smooth.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)), "{smooth:?}");
    let groups = ridge(&format!("{roof}s 1\nf 1 4 3 2\ns 2\nf 4 5 6 3\n"));
    assert!(groups.len() == 4 && groups.iter().all(|n| n.x.abs() > 0.7), "{groups:?}");
    assert_eq!(ridge(&format!("{roof}s 1\ns off\n{faces}")).len(), 4);
    let given = ridge(&format!("{roof}vn 0 0 5\nf 1//1 4//1 3//1 2//1\n"));
    assert!(given.len() == 2 && given.iter().all(|n| *n == Vec3::Z), "{given:?}");
}

#[test]
fn materials_of_a_library() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let picture =
        |name: &str, color: [u8; 4]| image::RgbaImage::from_pixel(2, 2, image::Rgba(color)).save(folder.join(name));
    picture("wood.png", [200, 100, 50, 10]).unwrap();
    std::fs::create_dir(folder.join("masks")).unwrap();
    picture("masks/holes.png", [60, 60, 60, 255]).unwrap();
    std::fs::write(
        folder.join("my lib.mtl"),
        "newmtl red\nKd 0.5 0.25 0.125\nnewmtl wood\nKd 0 0 0\nmap_Kd -s 1 1 1 -clamp on C:\\work\\WOOD.png\nnewmtl glass\n\
         Tr 0.75\nnewmtl half\nd 0.75\nTr 1\nnewmtl leaf\nmap_Kd wood.png\nmap_d Masks\\Holes.PNG\nnewmtl gone\nmap_Kd no.png\nKd 1\n",
    )
    .unwrap();
    let names = ["red", "wood", "glass", "half", "leaf", "gone", "unknown\u{1b}[31m"];
    let faces: String = names.iter().map(|name| format!("usemtl {name}\nf 1/1 2/2 3/3\n")).collect();
    let text =
        format!("mtllib my lib.mtl\nmtllib other.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 0.25\n{faces}");
    let scene = load(folder, "a.obj", text.as_bytes()).unwrap();
    let of = |i: usize| &scene.materials[scene.meshes[i].material as usize];
    assert_eq!(scene.meshes.len(), 7);
    assert_eq!(scene.meshes[0].uvs[0].to_array(), [0.0, 1.0], "v points up in the file and down here");
    assert_eq!((of(0).base_color.to_array(), of(0).alpha_cutoff), ([0.5, 0.25, 0.125, 1.0], None));
    let texture = |i: usize| &scene.textures[of(i).texture.unwrap() as usize];
    assert_eq!((of(1).base_color.truncate(), of(1).alpha_cutoff), (Vec3::ONE, None));
    assert_eq!(texture(1).rgba[..4], [200, 100, 50, 255]);
    assert_eq!(texture(1).wrap, [shadowscope::scene::Wrap::Clamp; 2]);
    assert_eq!((of(2).base_color.w, of(2).alpha_cutoff), (0.25, Some(0.5)));
    assert_eq!((of(3).base_color.w, of(3).alpha_cutoff), (0.75, Some(0.5)));
    assert_eq!((texture(4).rgba[..4].to_vec(), of(4).alpha_cutoff), (vec![200, 100, 50, 60], Some(0.5)));
    assert_eq!((of(5).texture, of(5).base_color.truncate()), (None, Vec3::ONE));
    assert!(scene.materials.iter().all(|m| m.double_sided));
    let told = scene.notes.join(" ");
    for part in
        ["\"other.mtl\" (there is no such file)", "no.png", "unknown\\u{1b}[31m", "1 material is more than half"]
    {
        assert!(told.contains(part), "{part}: {told}");
    }
}

/// A place that is far from zero keeps the digits that the text gives it.
#[test]
fn far_scenes_keep_their_digits() {
    let at = |x: f64, z: f64| format!("v {} 0 {}\n", 500_000.0 + x, 5_000_000.0 + z);
    let text = at(0.125, 0.0) + &at(0.125, 0.0625) + &at(0.1875, 0.0) + "f 1 2 3\n";
    let scene = loaded("far.obj", text.as_bytes());
    assert!((area(&scene.meshes[0]) - 0.5 * 0.0625 * 0.0625).abs() < 1e-9);
    assert!(scene.origin.distance(DVec3::new(500_000.15, 0.0, 5_000_000.03)) < 0.01, "{}", scene.origin);
}

#[test]
fn files_that_are_damaged() {
    for (name, text, says) in [
        ("a.obj", "", "no faces"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", "no faces"),
        ("a.obj", "v 0 0 0\nv 1 0\n", "line 2"),
        ("a.obj", "v 0 0 nan\n", "line 1"),
        ("a.obj", "v 0 0 1e300\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", "not finite"),
        ("a.obj", "v 0 0 0\nf 1 2 3\n", "vertex number 2, but the file has 1"),
        ("a.obj", "v 0 0 0\nf 1 -2 1\n", "line 2"),
        ("a.obj", "v 0 0 0\nf 1 0 1\n", "line 2"),
        ("a.obj", "v 0 0 0\nf 1/1/1/1 1 1\n", "line 2"),
        ("a.obj", "v 0 0 0\nf 99999999999999999999 1 1\n", "line 2"),
        ("a.obj", "v 0 0 0\nv 0 0 1\nf 1 2 1\n", "no triangles"),
        ("a.ply", "ply\n", "no PLY file"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n1\n", "no room"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n\n\n\n", "no room"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1\n3 0 0 0\n",
            "lack x, y or z",
        ),
        // What Gaussian splats look like.
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float packed\nend_header\n1\n", "no faces"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float16 x\nend_header\n1\n",
            "(Line 4: Couldn't parse line); export",
        ),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n1 2 3\n3 0 -1 0\n",
            "vertex number",
        ),
        (
            "a.ply",
            "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list int int vertex_indices\nend_header\n\x7f\x7f\x7f\x7f",
            "no PLY file",
        ),
        ("a.stl", "", "not an STL file"),
        ("a.stl", "solid\nvertex 1 2\n", "line 2"),
        ("a.stl", "solid\nvertex 1 2 3\n", "no whole triangles"),
        ("a.stl", "solid\nendsolid\n", "no faces"),
        ("a.dat", "anything", "none of the formats"),
    ] {
        let message = refused(name, text.as_bytes());
        assert!(message.contains(says), "{text:?}: {message}");
    }
    let mut cut = as_stl(b"");
    cut.truncate(cut.len() - 60);
    assert!(refused("cut.stl", &cut).contains("14 triangles, but ends after 12"));
    let mut cut = as_ply("binary_little_endian");
    cut.truncate(cut.len() - 5);
    refused("cut.ply", &cut);
}

/// Normals and texture coordinates that faces name but the file leaves out: the surface is there without them.
#[test]
fn corners_of_obj_files_lack_what_they_name() {
    for (lines, lost) in [
        ("f 1//1 2//1 3//1\n", 3),
        ("vt 0 0\nf 1/1 2/7 3/1\n", 1),
        ("f 1/0/0 2/0/0 3/0/0\n", 3),
        ("vn 0 1 0\nf 1//1 2//-1 3//-2\n", 1),
        // Those that come later are there.
        ("f 1//1 2//1 3//1\nvn 0 1 0\n", 0),
    ] {
        let scene = loaded("lacking.obj", format!("v 0 0 0\nv 0 0 1\nv 1 0 0\n{lines}").as_bytes());
        assert!((area(&scene.meshes[0]) - 0.5).abs() < 1e-6);
        assert!(scene.meshes[0].normals.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)), "{lines}");
        let told = scene.notes.join(" ");
        assert_eq!(told.contains(&format!("{lost} corner")), lost > 0, "{lines}: {told}");
        assert_eq!(told.contains("does not have"), lost > 0, "{lines}: {told}");
    }
}

/// Where nothing would be left to see, opacity does not count; else it does.
#[test]
fn obj_files_of_hidden_materials_alone() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl gone\nKd 1 0 0\nd 0\nnewmtl there\nKd 0 1 0\n").unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 0\nusemtl gone\nf 1 2 3\n";
    let alone = load(folder.path(), "alone.obj", text.as_bytes()).unwrap();
    assert_eq!(alone.materials[0].base_color, Vec4::new(1.0, 0.0, 0.0, 1.0));
    let both = load(folder.path(), "both.obj", format!("{text}usemtl there\nf 3 2 1\n").as_bytes()).unwrap();
    assert_eq!(both.materials.iter().map(|m| m.base_color.w).collect::<Vec<_>>(), [0.0, 1.0]);
    assert!(alone.notes.join(" ").contains("drawn as if they were opaque"), "{:?}", alone.notes);
    assert!(both.notes.join(" ").contains("not drawn"), "{:?}", both.notes);
}

/// Textures as MeshLab and programs for photogrammetry write them: named in comments, with coordinates for each corner.
#[test]
fn textures_of_a_ply_file() {
    let folder = tempfile::tempdir().unwrap();
    for (name, color) in [("a red.png", [255, 0, 0]), ("green.png", [0, 255, 0])] {
        image::RgbImage::from_pixel(2, 2, image::Rgb(color)).save(folder.path().join(name)).unwrap();
    }
    let text = "ply\nformat ascii 1.0\ncomment VCGLIB generated\ncomment TextureFile a red.png\ncomment TextureFile green.png\n\
                element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
                property uchar blue\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
                property int texnumber\nelement edge 1\nproperty int vertex1\nend_header\n\
                0 0 0 9 9 9\n0 0 1 9 9 9\n1 0 1 9 9 9\n1 0 0 9 9 9\n3 0 1 2 6 0 0 0 1 1 1 1\n3 0 2 3 6 0 0 0.5 0.25 1 0 0\n0\n";
    let scene = load(folder.path(), "textured.ply", text.as_bytes()).unwrap();
    assert_eq!(scene.meshes.len(), 2, "one a texture");
    for mesh in &scene.meshes {
        let material = &scene.materials[mesh.material as usize];
        let rgba = &scene.textures[material.texture.unwrap() as usize].rgba;
        assert!(mesh.colors.is_empty() && material.base_color == Vec4::ONE, "the texture takes the place of colours");
        let (red, at) = (mesh.uvs.contains(&Vec2::new(0.5, 0.75)), rgba[..3].to_vec());
        assert_eq!(at, if red { [255, 0, 0] } else { [0, 255, 0] }, "{:?}", mesh.uvs);
        assert!(mesh.uvs.contains(&Vec2::new(0.0, 1.0)), "v is up in the file, down in the image");
    }
    assert!(scene.notes.join(" ").contains("1 edge is left out"), "{:?}", scene.notes);
    std::fs::remove_file(folder.path().join("green.png")).unwrap();
    let scene = load(folder.path(), "textured.ply", text.as_bytes()).unwrap();
    assert_eq!((scene.meshes.len(), scene.textures.len()), (2, 1));
    assert!(scene.notes.join(" ").contains("\"green.png\" (there is no such file)"), "{:?}", scene.notes);
}

#[test]
fn strips_of_a_ply_file() {
    let scene = loaded(
        "strips.ply",
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
          element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0 255 0 188\n0 0 1 255 0 188\n1 0 0 255 0 188\n1 0 1 255 0 188\n\
          8 0 1 2 3 -1 0 1 2\n",
    );
    assert_eq!(scene.triangles(), 3);
    assert!((area(&scene.meshes[0]) - 1.5).abs() < 1e-6);
    assert!(scene.meshes[0].normals.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)));
    let half = Vec4::new(1.0, 0.0, 0.5, 1.0);
    assert!(scene.meshes[0].colors.len() == scene.meshes[0].positions.len(), "a colour a vertex");
    assert!(scene.meshes[0].colors.iter().all(|c| c.abs_diff_eq(half, 0.01)), "{:?}", scene.meshes[0].colors);
}

#[test]
fn formats_are_told_by_contents_before_names() {
    assert_eq!(loaded("named.obj", &as_ply("ascii")).triangles(), 14);
    for order in [u16::to_le_bytes, u16::to_be_bytes] {
        let text: Vec<u8> = format!("\u{feff}{}", as_obj()).encode_utf16().flat_map(order).collect();
        assert_eq!(loaded("wide.obj", &text).triangles(), 14);
    }
    assert_eq!(loaded("named.dat", as_ascii_stl().as_bytes()).triangles(), 14);
    for (name, contents, says) in [
        ("a.fbx", &b"Kaydara FBX Binary  \0"[..], "FBX"),
        ("a.usda", b"#usda 1.0\n", "USD"),
        ("a.usdc", b"PXR-USDC", "USD"),
        ("a.usdz", b"PK\x03\x04", "USD"),
        ("a.blend", b"BLENDER-v300", "Blender"),
        ("a.dae", b"<?xml version=\"1.0\"?><COLLADA>", "COLLADA"),
        ("a.3ds", b"MM", "3ds"),
        ("a.pbrt", b"Film \"rgb\"", "PBRT"),
        ("scene.obj", b"PK\x03\x04", "unpack"),
        ("scene.glb", b"Kaydara FBX Binary  \0", "FBX"),
    ] {
        let message = refused(name, contents);
        assert!(
            message.contains(says) && (message.contains("convert") || message.contains("unpack") || says == "PBRT"),
            "{message}"
        );
    }
}

#[test]
fn presets_beside_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    std::fs::write(folder.join("room.obj"), as_obj()).unwrap();
    let presets = "[[cameras]]\nname = \"published\"\nposition = [5, 6, 7]\ntarget = [0, 0, 0]\nfov = 50\n\
        [[cameras]]\nname = \"overview\"\nposition = [1, 9, 2]\ntarget = [0, 0, 0]\nfov = 30\nnear = 0.5\nfar = 90\n\
        [[lights]]\nname = \"noon\"\nkind = \"directional\"\nto_light = [-0.5, 1, 0.3]\n";
    let size = ["--size", "64x48"];
    let run = |args: &[&str]| ok(folder, &[&["capture", "room.obj"], &size[..], args].concat());
    let aim = ["--camera", "5,6,7:0,0,0:50", "--light", "directional:to_light=-0.5,1,0.3"];
    run(&[&aim[..], &["-o", "a.png"]].concat());
    std::fs::write(folder.join("room.presets.toml"), presets).unwrap();
    let out = run(&["-o", "b.png"]);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.contains("2 cameras are from room.presets.toml.") && said.contains("1 light is from"), "{said}");
    run(&["--camera", "published", "--light", "noon", "-o", "c.png"]);
    run(&["--camera", "overview", "-o", "d.png"]);
    let read = |name: &str| image::open(folder.join(name)).unwrap().into_rgba8();
    assert!(read("a.png") == read("b.png") && read("a.png") == read("c.png") && read("a.png") != read("d.png"));
    for (text, says) in [
        ("[[cameras]]\nname = \"a\"\nposition = [0, 0, 0]\n", "camera 1 lacks the key target"),
        ("[[cameras]]\nposition = [0, 0, 0]\ntarget = [0, 0, 1]\nfov = 40\n", "camera 1 lacks the key name"),
        ("[[cameras]]\nname = \"a\"\nposition = [0, 0, 0]\ntarget = [0, 0, 1]\nfov = 400\n", "1 to 170"),
        (
            "[[cameras]]\nname = \"a\"\nposition = [0, 0, 0]\ntarget = [0, 0, 1]\nfov = 40\nzoom = 1\n",
            "zoom is unknown",
        ),
        ("[[lights]]\nname = \"a\"\nkind = \"sun\"\n", "one of directional"),
        ("[[lights]]\nname = \"a\"\nkind = \"omni\"\nrange = 1\n", "position"),
        ("[[lamps]]\n", "lamps is unknown"),
        ("lights = 1\n", "a list of tables"),
        ("[[cameras", "room.presets.toml"),
    ] {
        std::fs::write(folder.join("room.presets.toml"), text).unwrap();
        let out = shadowscope(folder, &["capture", "room.obj", "-o", "x.png"]);
        let error = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(
            !out.status.success() && error.contains("room.presets.toml") && error.contains(says),
            "{text}: {error}"
        );
    }
}

/// A face that comes to its corners again and again is cut as a fan: ears would be sought for very long.
#[test]
fn faces_that_repeat_their_corners_load_soon() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("again.obj");
    let corners: Vec<String> = (0..20_000).map(|i| (1 + i % 5).to_string()).collect();
    let text = format!("v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1 0\nf {}\n", corners.join(" "));
    std::fs::write(&path, &text).unwrap();
    let scene = formats::load(&path).unwrap();
    assert!(scene.triangles() > 5000);
    // Old programs ended lines with a carriage return alone.
    std::fs::write(&path, "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r").unwrap();
    assert_eq!(formats::load(&path).unwrap().triangles(), 1);
}

/// A library counts once, however many lines name it: two thousand times a megabyte would take minutes.
#[test]
fn a_library_named_again_and_again_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let library = format!("newmtl red\nKd 1 0 0\n{}", "newmtl other\nKd 0 1 0\n".repeat(50_000));
    std::fs::write(folder.path().join("a.mtl"), library).unwrap();
    let text = format!("{}v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n", "mtllib a.mtl\n".repeat(2000));
    let start = std::time::Instant::now();
    let scene = load(folder.path(), "a.obj", text.as_bytes()).unwrap();
    assert_eq!(scene.materials[0].base_color, Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

/// A face of a hundred thousand corners would be cut for minutes if ears were sought: it becomes a fan, and a note says so.
#[test]
fn faces_of_very_many_corners_load_soon() {
    let folder = tempfile::tempdir().unwrap();
    let count = 100_000;
    let corner = |i: u32| {
        let (sin, cos) = (i as f64 / f64::from(count) * std::f64::consts::TAU).sin_cos();
        let radius = f64::from(1 + i % 2);
        format!("v {} {} 0\n", radius * cos, radius * sin)
    };
    let corners: Vec<String> = (1..=count).map(|i| i.to_string()).collect();
    let text = format!("{}f {}\n", (0..count).map(corner).collect::<String>(), corners.join(" "));
    let scene = load(folder.path(), "star.obj", text.as_bytes()).unwrap();
    assert!(scene.triangles() > 90_000);
    assert!(scene.notes.iter().any(|note| note.starts_with("1 face has so many corners")), "{:?}", scene.notes);
}
