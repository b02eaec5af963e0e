//! Loads Wavefront OBJ files with their materials (MTL).
//!
//! They are read by hand: of the crates there are, one panics on a colour of one number and none keeps smoothing groups.

use super::polygons::{Corner, GREY, NONE, Polygons, WRONG, cannot_load, linear, material};
use super::textures::{MAX_IMAGES, TOO_LARGE, decode};
use super::{Material, Scene, Texture, Wrap};
use crate::files;
use crate::message::{counted, list, quoted, shortened};
use anyhow::{Context, Result, anyhow, bail, ensure};
use glam::{DVec3, Vec2, Vec3, Vec4};
use image::RgbaImage;
use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::str::SplitWhitespace;

/// Loads a file, y up.
pub fn load(path: &Path) -> Result<Scene> {
    read(path).map_err(|cause| cannot_load(path, &cause))
}

/// A file's text; what is no UTF-8 can only be a name or a comment. Lines that go on are one.
fn text_of(data: &[u8]) -> String {
    let text = match data {
        [0xff, 0xfe, rest @ ..] => Cow::Owned(utf16(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => Cow::Owned(utf16(rest, u16::from_be_bytes)),
        _ => String::from_utf8_lossy(data),
    };
    text.trim_start_matches('\u{feff}').replace("\\\r\n", " ").replace("\\\n", " ")
}

/// UTF-16, as some tools of Windows write text.
fn utf16(data: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = data.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

fn read(path: &Path) -> Result<Scene> {
    let data = files::read(path, files::MOST_DATA).map_err(|error| anyhow!(files::reason(&error)))?;
    let text = text_of(&data);
    let mut polygons = Polygons::default();
    let mut library = Library::beside(path);
    let (mut now, mut smooth) = (None, 0);
    let (mut lines_and_points, mut curves) = (0, 0);
    for (number, line) in lines(&text).enumerate() {
        let at = || format!("line {}", number + 1);
        let mut words = line.split_whitespace();
        match words.next().unwrap_or_default() {
            "v" => {
                let [x, y, z] = numbers(&mut words);
                let place = DVec3::new(x, y, z);
                ensure!(place.is_finite(), "{}: {} is no place of three numbers", at(), quoted(line.trim()));
                polygons.positions.push(place);
                if words.clone().count() >= 3 {
                    // Vertices before the first with a colour are white.
                    polygons.colors.resize(polygons.positions.len() - 1, Vec4::ONE);
                    polygons.colors.push(linear(numbers(&mut words).map(|x: f64| x as f32)));
                }
            }
            "vt" => {
                let [u, v] = numbers(&mut words);
                // A texture may have one coordinate only.
                polygons.uvs.push(Vec2::new(u as f32, if v.is_nan() { 1.0 } else { 1.0 - v as f32 }));
            }
            "vn" => polygons.normals.push(Vec3::from_array(numbers(&mut words).map(|x: f64| x as f32))),
            "f" => {
                let counts = [polygons.positions.len(), polygons.uvs.len(), polygons.normals.len()];
                let first = polygons.corners.len();
                for word in words.take_while(|word| !word.starts_with('#')) {
                    polygons.corners.push(corner(word, counts).with_context(at)?);
                }
                ensure!(polygons.corners.len() < NONE as usize, "it has more corners of faces than can be counted");
                if polygons.corners.len() - first < 3 {
                    polygons.corners.truncate(first);
                    lines_and_points += 1;
                } else {
                    let material = *now.get_or_insert_with(|| library.plain());
                    polygons.face(first, material, smooth);
                }
            }
            "s" => {
                let group = words.next().unwrap_or("1");
                smooth = if group.eq_ignore_ascii_case("off") { 0 } else { group.parse().unwrap_or(1) };
            }
            "usemtl" => now = Some(library.named(rest(line))?),
            "mtllib" => library.read(rest(line)),
            "l" | "p" => lines_and_points += 1,
            "curv" | "curv2" | "surf" => curves += 1,
            _ => {}
        }
    }
    if !polygons.colors.is_empty() {
        polygons.colors.resize(polygons.positions.len(), Vec4::ONE);
    }
    let mut notes = Vec::new();
    notes.extend(counted(lines_and_points, "line or point is left out.", "lines or points are left out."));
    notes.extend(counted(
        curves,
        "free-form curve or surface is left out.",
        "free-form curves or surfaces are left out.",
    ));
    // Nothing at all would be seen. Exporters that write `d 0` for all have lost the opacity on their way.
    let hidden = |material: u32| library.materials[material as usize].base_color.w < 0.5;
    if library.hidden > 0 && polygons.faces.iter().all(|face| hidden(face.material)) {
        library.materials.iter_mut().for_each(|material| material.base_color.w = 1.0);
        library.hidden = 0;
        notes.push(
            "All materials are more than half transparent (d below 0.5): they are drawn as if they were opaque.".into(),
        );
    }
    notes.extend(library.notes());
    polygons.scene(path, library.materials, library.textures, notes)
}

/// The next numbers of a line; NaN where one is missing or none.
fn numbers<const N: usize>(words: &mut SplitWhitespace) -> [f64; N] {
    std::array::from_fn(|_| words.next().and_then(|word| word.parse().ok()).unwrap_or(f64::NAN))
}

/// What follows the first word of a line: a name, which may hold spaces.
fn rest(line: &str) -> &str {
    line.trim_start().split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
}

/// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`; `counts`: how many of each there are so far, from which negative ones count back.
fn corner(word: &str, counts: [usize; 3]) -> Result<Corner> {
    let mut found = [NONE; 3];
    for (i, text) in word.split('/').enumerate() {
        let index: Option<i64> = if text.is_empty() && i > 0 { continue } else { text.parse().ok() };
        // Some exporters write 0 for a normal or texture coordinate that there is none of.
        let index = index.filter(|index| (*index != 0 || i > 0) && i < 3);
        let index = index.with_context(|| format!("{} is no corner of a face", quoted(word)))?;
        let index = if index < 0 { counts[i] as i64 + index } else { index - 1 };
        found[i] = match u32::try_from(index).ok().filter(|index| *index < WRONG) {
            Some(index) => index,
            None if i > 0 => WRONG,
            None => bail!("{} counts back beyond the first", quoted(word)),
        };
    }
    let [position, uv, normal] = found;
    Ok(Corner { position, normal, uv })
}

/// A material's description.
#[derive(Clone, Default)]
struct Described {
    color: Option<Vec3>,
    /// 0: not there. 1: opaque.
    dissolve: Option<f32>,
    transparency: Option<f32>,
    map_color: Option<Map>,
    map_alpha: Option<Map>,
}

/// A texture's file.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Map {
    path: PathBuf,
    clamp: bool,
}

/// The materials of a file.
#[derive(Default)]
pub(super) struct Library {
    folder: PathBuf,
    described: HashMap<String, Described>,
    /// Those in use, by name.
    used: HashMap<String, u32>,
    plain: Option<u32>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    /// By the files that they are made of.
    known: HashMap<(Option<Map>, Option<Map>), Option<u32>>,
    /// Libraries read.
    read: HashSet<String>,
    /// Libraries and images that cannot be read, and why.
    missing: BTreeSet<String>,
    unknown: BTreeSet<String>,
    /// Bytes of all images.
    held: u64,
    hidden: usize,
    unread: usize,
}

impl Library {
    /// Of the files beside another.
    pub fn beside(path: &Path) -> Self {
        Library { folder: path.parent().unwrap_or(Path::new("")).into(), ..Library::default() }
    }

    /// The number of a material that is nothing but a texture.
    pub fn painted(&mut self, name: &str) -> Result<u32> {
        self.make(
            name,
            &Described { map_color: Some(Map { path: relative(name), clamp: false }), ..Described::default() },
        )
    }

    /// Reads the libraries that a line names.
    fn read(&mut self, names: &str) {
        // Once is enough, however many lines name it.
        if !self.read.insert(names.into()) {
            return;
        }
        // A name may hold spaces, or there may be several.
        let whole = self.fetch(names);
        if whole.is_ok() || !names.contains(char::is_whitespace) {
            return self.add(names, whole);
        }
        for name in names.split_whitespace() {
            let data = self.fetch(name);
            self.add(name, data);
        }
    }

    fn fetch(&self, name: &str) -> std::io::Result<Vec<u8>> {
        files::read_beside(&self.folder, &relative(name))
    }

    fn add(&mut self, name: &str, data: std::io::Result<Vec<u8>>) {
        let data = match data {
            Ok(data) => data,
            Err(error) => {
                self.missing.insert(format!("{} ({})", quoted(name), files::reason(&error)));
                return;
            }
        };
        let text = text_of(&data);
        let mut now = None;
        for line in lines(&text) {
            let mut words = line.split_whitespace();
            let key = words.next().unwrap_or_default();
            if key == "newmtl" {
                now = Some(rest(line).to_string());
                self.described.insert(rest(line).into(), Described::default());
                continue;
            }
            let Some(described) = now.as_ref().and_then(|name| self.described.get_mut(name)) else { continue };
            let one = |words: &mut SplitWhitespace| words.next().and_then(|word| word.parse::<f32>().ok());
            match key {
                "Kd" => {
                    // One number stands for all three; spectral curves are no numbers.
                    let [r, g, b] = numbers(&mut words).map(|x: f64| x as f32);
                    let color = Vec3::new(r, if g.is_nan() { r } else { g }, if b.is_nan() { r } else { b });
                    match color.is_finite() {
                        true => described.color = Some(color.max(Vec3::ZERO)),
                        false => self.unread += 1,
                    }
                }
                // `d -halo` is followed by its number too.
                "d" => described.dissolve = one(&mut words).or_else(|| one(&mut words)),
                "Tr" => described.transparency = one(&mut words),
                "map_Kd" | "map_kd" => described.map_color = map(rest(line)),
                "map_d" | "map_D" => described.map_alpha = map(rest(line)),
                _ => {}
            }
        }
    }

    /// The number of a material by its name.
    fn named(&mut self, name: &str) -> Result<u32> {
        if let Some(known) = self.used.get(name) {
            return Ok(*known);
        }
        let index = match self.described.get(name).cloned() {
            Some(described) => self.make(name, &described)?,
            None => {
                self.unknown.insert(name.into());
                self.plain()
            }
        };
        self.used.insert(name.into(), index);
        Ok(index)
    }

    /// That of faces without one.
    fn plain(&mut self) -> u32 {
        let next = self.materials.len() as u32;
        let index = *self.plain.get_or_insert(next);
        if index == next {
            self.materials.push(material("none", GREY));
        }
        index
    }

    fn make(&mut self, name: &str, described: &Described) -> Result<u32> {
        let texture = self.texture(described.map_color.clone(), described.map_alpha.clone())?;
        // Some exporters write black beside a texture, which would be all that is seen.
        let color = described.color.unwrap_or(GREY.truncate());
        let drawn = texture.is_some() && described.map_color.is_some();
        let color = if drawn && (described.color.is_none() || color == Vec3::ZERO) { Vec3::ONE } else { color };
        let opacity = described.dissolve.or(described.transparency.map(|t| 1.0 - t)).unwrap_or(1.0);
        let opacity = if opacity.is_nan() { 1.0 } else { opacity.clamp(0.0, 1.0) };
        self.hidden += usize::from(opacity < 0.5);
        let masked = opacity < 1.0 || texture.is_some() && described.map_alpha.is_some();
        let mut made = material(name, color.extend(opacity));
        made.texture = texture;
        made.alpha_cutoff = masked.then_some(0.5);
        self.materials.push(made);
        Ok(self.materials.len() as u32 - 1)
    }

    /// The number of a texture made of the colour of one file and the alpha of another.
    fn texture(&mut self, color: Option<Map>, alpha: Option<Map>) -> Result<Option<u32>> {
        let key = (color, alpha);
        if let Some(known) = self.known.get(&key) {
            return Ok(*known);
        }
        let mut image = |map: &Option<Map>| map.as_ref().map_or(Ok(None), |map| self.image(map));
        let (color, alpha) = (image(&key.0)?, image(&key.1)?);
        let picture = match (color, alpha) {
            (Some(color), Some(alpha)) => Some(joined(color, &alpha)),
            // Without a map of it there is no transparency.
            (Some(mut color), None) => {
                color.pixels_mut().for_each(|p| p[3] = 255);
                Some(color)
            }
            (None, Some(alpha)) => {
                let white = RgbaImage::from_pixel(alpha.width(), alpha.height(), image::Rgba([255; 4]));
                Some(joined(white, &alpha))
            }
            (None, None) => None,
        };
        let index = picture.map(|picture| {
            let clamp = [&key.0, &key.1].into_iter().flatten().next().is_some_and(|map| map.clamp);
            let wrap = [if clamp { Wrap::Clamp } else { Wrap::Repeat }; 2];
            let (width, height) = picture.dimensions();
            self.textures.push(Texture { width, height, rgba: picture.into_raw(), wrap, ..Texture::default() });
            self.textures.len() as u32 - 1
        });
        self.known.insert(key, index);
        Ok(index)
    }

    fn image(&mut self, map: &Map) -> Result<Option<RgbaImage>> {
        let read = files::read_beside(&self.folder, &map.path).map_err(|error| files::reason(&error));
        let hint = image::ImageFormat::from_path(&map.path).ok();
        match read.and_then(|data| decode(&data, hint)) {
            Ok((picture, _)) => {
                self.held += picture.len() as u64;
                ensure!(self.held <= MAX_IMAGES, TOO_LARGE);
                Ok(Some(picture))
            }
            Err(why) => {
                self.missing.insert(format!("{} ({})", quoted(&map.path.to_string_lossy()), shortened(&why)));
                Ok(None)
            }
        }
    }

    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.missing.is_empty() {
            let names = self.missing.iter().take(5).cloned().collect::<Vec<_>>().join(", ");
            let more = self.missing.len().saturating_sub(5);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            notes.push(format!("Drawn without {names}{more}: put what is missing next to the file."));
        }
        if !self.unknown.is_empty() {
            let names = list(self.unknown.iter().map(String::as_str));
            notes.push(format!("Drawn in grey, as no material library describes it: {names}."));
        }
        notes.extend(counted(
            self.hidden,
            "material is more than half transparent (d below 0.5) and not drawn.",
            "materials are more than half transparent (d below 0.5) and not drawn.",
        ));
        notes.extend(counted(
            self.unread,
            "material has a colour that is not three numbers and is drawn in grey.",
            "materials have colours that are not three numbers and are drawn in grey.",
        ));
        notes
    }
}

/// A path as libraries write it; of an absolute one the name alone, as it tells of the machine that it was made on.
fn relative(name: &str) -> PathBuf {
    let name = name.trim_matches('"').replace('\\', "/");
    let absolute = name.starts_with('/') || name.get(1..2) == Some(":");
    if absolute { name.rsplit('/').next().unwrap_or_default().into() } else { name.into() }
}

/// A texture's file, behind its options.
fn map(text: &str) -> Option<Map> {
    let mut text = text;
    let mut clamp = false;
    while text.starts_with('-') {
        let (option, mut after) = text.split_once(char::is_whitespace)?;
        after = after.trim_start();
        // All take one word, or up to three numbers.
        let most = if ["-o", "-s", "-t"].contains(&option) {
            3
        } else if option == "-mm" {
            2
        } else {
            1
        };
        for i in 0..most {
            let (word, behind) = after.split_once(char::is_whitespace)?;
            if i > 0 && word.parse::<f32>().is_err() {
                break;
            }
            clamp |= option == "-clamp" && word == "on";
            after = behind.trim_start();
        }
        text = after;
    }
    (!text.is_empty()).then(|| Map { path: relative(text), clamp })
}

/// A picture with the alpha of another: its own if it has one, else how bright it is.
fn joined(mut color: RgbaImage, alpha: &RgbaImage) -> RgbaImage {
    let own = alpha.pixels().any(|p| p[3] < 255);
    let level = image::GrayImage::from_fn(alpha.width(), alpha.height(), |x, y| {
        let p = alpha.get_pixel(x, y);
        image::Luma([if own { p[3] } else { p[0].max(p[1]).max(p[2]) }])
    });
    let (width, height) = (color.width().max(level.width()), color.height().max(level.height()));
    let filter = image::imageops::FilterType::Triangle;
    if color.dimensions() != (width, height) {
        color = image::imageops::resize(&color, width, height, filter);
    }
    let resized =
        (level.dimensions() != (width, height)).then(|| image::imageops::resize(&level, width, height, filter));
    let level = resized.unwrap_or(level);
    color.pixels_mut().zip(level.pixels()).for_each(|(c, a)| c[3] = a[0]);
    color
}

/// The lines of a text, however it ends them: old programs wrote carriage returns alone.
fn lines(text: &str) -> impl Iterator<Item = &str> + Clone {
    let old = !text.contains('\n');
    text.split(move |c| c == '\n' || old && c == '\r').map(|line| line.strip_suffix('\r').unwrap_or(line))
}
