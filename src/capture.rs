//! Pictures to files, with the set-up inside, and the set-up out of them again.

mod pixels;

use crate::files;
use crate::frame::{Ask, History, Pixels, Renderer, Truth};
use crate::legend::{self, Key};
use crate::measure::metrics;
use crate::scene::geometry::shading_normal;
use crate::sequence;
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Result, anyhow, ensure};
use pixels::{averaged, cut};
use std::io::Cursor;
use std::path::Path;

/// Keywords of the PNG text chunks (iTXt) that hold the set-up as TOML, and of an animation the sequence.
pub const SETUP: &str = "shadowscope-setup";
pub const SEQUENCE: &str = "shadowscope-sequence";

/// Endings of files that may hold a set-up.
pub const HOLD: [&str; 3] = sequence::ENDINGS;

/// Renders a set-up at its size and writes it: .png the view with the set-up inside, .exr the raw 32-bit
/// floats of the views visibility, truth, depth (one channel), position, normals (shading normals) and aliasing (three),
/// and of counts the map itself (several below each other), a number per texel. Returns what is to be said of
/// what the picture shows wrong ([`Renderer::notes`]), and of what of the set-up it leaves aside.
///
/// # Errors
/// A light that the technique does not serve, another file ending, or what the file system says.
pub fn capture(renderer: &mut Renderer, setup: &Setup, path: &Path) -> Result<Vec<String>> {
    check(&setup.view, path)?;
    if is_exr(path) {
        return raw(renderer, setup, path);
    }
    let (Pixels { size, rgba }, notes) = picture(renderer, setup, History::Whole)?;
    write_png(path, size, &rgba, Some(&setup.to_toml(path)?))?;
    Ok(notes)
}

/// What [`capture`] writes into a .png: supersampled, cut and with its legend, colours not multiplied by their alpha; and what is to be said of it.
///
/// # Errors
/// As [`capture`].
pub fn picture(renderer: &mut Renderer, setup: &Setup, history: History) -> Result<(Pixels, Vec<String>)> {
    serve(setup)?;
    draw(renderer, setup, history)?;
    let key = if setup.legend { Some(key(renderer, setup)?) } else { None };
    let mut pixels = read(renderer, setup, key.as_ref())?;
    if let Some(key) = &key {
        (pixels.size, pixels.rgba) = legend::below(key, pixels.size, pixels.rgba)?;
    }
    Ok((pixels, notes(renderer, setup)?))
}

/// As [`capture`], as a .png of exactly this size with the legend in it: the picture is as much lower as the strip is high.
/// The set-up inside has that picture's size, so that it gives the same file again.
///
/// # Errors
/// As [`capture`]; another file ending, or a size without room for the legend.
pub fn figure(renderer: &mut Renderer, setup: &Setup, whole: [u32; 2], path: &Path) -> Result<Vec<String>> {
    ensure!(!is_exr(path), "{}: raw values have no legend; a figure's file name ends in .png", path.display());
    check(&setup.view, path)?;
    serve(setup)?;
    let [width, full] = whole;
    let no_room = || format!("{width} × {full} pixels leave no room for the legend");
    let mut setup = Setup { legend: true, size: setup.size_around(whole), ..setup.clone() };
    setup.check()?;
    // How high the strip is depends on the picture's figures, and those of a small one are much the same.
    let small = Setup { size: setup.size.map(|side| side.div_ceil(4)), supersample: 1, ..setup.clone() };
    draw(renderer, &small, History::Whole)?;
    let first = key(renderer, &setup)?;
    let mut height = legend::picture_height(&first, whole).with_context(no_room)?;
    for again in 0.. {
        setup.size = setup.size_around([width, height]);
        setup.check()?;
        draw(renderer, &setup, History::Whole)?;
        let key = key(renderer, &setup)?;
        let strip = legend::strip_height(&key, [width, height]);
        let ends = height + strip;
        // Where a strip of one height asks for a picture that asks for another, the lower picture leaves some paper over.
        if ends == full || ends < full && again > 1 {
            let pixels = read(renderer, &setup, Some(&key))?;
            let (_, mut rgba) = legend::below(&key, pixels.size, pixels.rgba)?;
            rgba.resize(4 * width as usize * full as usize, 255);
            write_png(path, whole, &rgba, Some(&setup.to_toml(path)?))?;
            break;
        }
        height = full.checked_sub(strip).filter(|height| *height > 0 && again < 8).with_context(no_room)?;
    }
    notes(renderer, &setup)
}

/// Writes raw values, which are of one technique.
fn raw(renderer: &mut Renderer, setup: &Setup, path: &Path) -> Result<Vec<String>> {
    let mut aside = Vec::new();
    if setup.supersample > 1 {
        aside.push("Not supersampled: raw values are those of one sample a pixel.".to_string());
    }
    if setup.crop.is_some() && setup.view == "counts" {
        aside.push("Not cropped: counts are of a map, not of the picture.".to_string());
    }
    let setup = &Setup { supersample: 1, ..setup.alone() };
    serve(setup)?;
    let truth = if setup.needs_truth() { Truth::All } else { Truth::Off };
    renderer.draw(setup, Ask { truth, analysis: true, ..Ask::of(setup) })?;
    write_exr(renderer, setup, path)?;
    Ok(aside.into_iter().chain(notes(renderer, setup)?).collect())
}

/// Refuses a light that one of the sides does not serve.
fn serve(setup: &Setup) -> Result<()> {
    // What is off needs no shadow.
    for side in (0..setup.sides()).filter(|side| !setup.is_truth(*side) && !setup.idles()) {
        techniques::find_or_say(&setup.side(side).technique)?.serve(&setup.light)?;
    }
    Ok(())
}

/// What of the other lights' shadows the sides do not draw, a sentence each.
fn unshadowed(setup: &Setup) -> Vec<String> {
    let sides = (0..setup.sides()).filter(|_| setup.shows_all_lights()).filter_map(|side| setup.info(side));
    sides.flat_map(|info| setup.unshadowed(info)).collect()
}

/// What is to be said of the picture just drawn.
fn notes(renderer: &Renderer, setup: &Setup) -> Result<Vec<String>> {
    Ok(setup.left_aside().into_iter().chain(unshadowed(setup)).chain(renderer.notes()?).collect())
}

/// Renders a set-up's picture, in as many pixels for one as it asks for.
fn draw(renderer: &mut Renderer, setup: &Setup, history: History) -> Result<()> {
    let n = setup.drawn_for_one();
    let enlarged = setup.enlarged(n);
    let truth = if setup.needs_truth() { Truth::All } else { Truth::Off };
    let drawn = renderer.draw(&enlarged, Ask { truth, history, ..Ask::of(&enlarged) });
    if n > 1 {
        drawn.with_context(|| format!("supersample = {n} cannot be drawn"))?;
    } else {
        drawn?;
    }
    Ok(())
}

/// Reads the part of the picture just drawn that the file shows, with the axes of a chart.
fn read(renderer: &Renderer, setup: &Setup, key: Option<&Key>) -> Result<Pixels> {
    let n = setup.drawn_for_one();
    let mut pixels = Pixels { size: setup.size.map(|side| side * n), rgba: renderer.read_picture()? };
    if let Some(key) = key.filter(|_| n == 1) {
        legend::draw_axes(key, pixels.size, &mut pixels.rgba)?;
    }
    if n > 1 || setup.transparent {
        pixels = averaged(&pixels, n);
    }
    let part = setup.part();
    if setup.crop.is_some() {
        let texels: &[[u8; 4]] = bytemuck::cast_slice(&pixels.rgba);
        pixels.rgba = bytemuck::cast_vec(cut(texels, pixels.size[0], part));
        pixels.size = [part[2], part[3]];
    }
    Ok(pixels)
}

/// The legend of the picture just drawn, with its errors where they are shown.
fn key(renderer: &mut Renderer, setup: &Setup) -> Result<Key> {
    let mut known = renderer.known()?;
    if setup.needs_truth() && !setup.idles() {
        let width = renderer.read_width()?;
        let mask = renderer.read_mask()?;
        let (hard, mean) = (renderer.read_labels()?, renderer.read_truth()?);
        for side in 0..setup.sides() {
            let seen = if setup.is_truth(side) { None } else { Some(renderer.read_side(side)?) };
            known.errors.push(seen.map(|visibility| metrics::errors(&visibility, &hard, &mean, &mask, width)));
        }
    }
    if let Some(Some(errors)) = known.errors.first_mut() {
        errors.causes = renderer.causes().map(|c| c.counts);
    }
    Ok(Key::new(setup, renderer.geometry().bounds, &known))
}

/// The views that an .exr can hold.
const RAW: [&str; 7] = ["visibility", "truth", "depth", "position", "normals", "aliasing", "counts"];

/// Refuses a file whose ending or view cannot be written, before anything is rendered.
pub fn check(view: &str, path: &Path) -> Result<()> {
    let name = path.display();
    let png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    ensure!(png || is_exr(path), "{name}: a capture's file name ends in .png or .exr");
    ensure!(png || RAW.contains(&view), "{name}: the view {view} has no raw values; .exr takes {}", RAW.join(", "));
    Ok(())
}

/// Whether a file is to hold raw values.
pub fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// What makes PNG of eight bits a channel, sRGB-encoded.
pub fn png_encoder(
    bytes: &mut Vec<u8>,
    [width, height]: [u32; 2],
    color: png::ColorType,
) -> png::Encoder<'_, &mut Vec<u8>> {
    let mut encoder = png::Encoder::new(bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder
}

/// Writes four bytes per pixel, rows from the top, as PNG, with a set-up as an iTXt chunk if given.
pub fn write_png(path: &Path, size: [u32; 2], rgba: &[u8], setup: Option<&str>) -> Result<()> {
    let doing = || format!("{} cannot be written", path.display());
    let mut bytes = Vec::new();
    let mut encoder = png_encoder(&mut bytes, size, png::ColorType::Rgba);
    if let Some(text) = setup {
        encoder.add_itxt_chunk(SETUP.into(), text.into()).with_context(doing)?;
    }
    let mut writer = encoder.write_header().with_context(doing)?;
    writer.write_image_data(rgba).with_context(doing)?;
    writer.finish().with_context(doing)?;
    files::save(path, &bytes)
}

/// Reads the set-up inside a captured picture or animation.
///
/// # Errors
/// No file, no picture, or one without a set-up.
pub fn read_setup(path: &Path) -> Result<String> {
    let name = path.display();
    read_text(path, SETUP)?.with_context(|| format!("{name} holds no set-up; only pictures captured by shadowscope do"))
}

/// Reads the text of a keyword inside a captured picture or animation; None: it holds none.
///
/// # Errors
/// No file, or no picture.
pub fn read_text(path: &Path, keyword: &str) -> Result<Option<String>> {
    let name = path.display();
    let mut file =
        files::open(path, files::MOST_DATA).map_err(|e| anyhow!("{name} cannot be read: {}", files::reason(&e)))?;
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("webp")) {
        let texts = sequence::read_texts(&mut file);
        let [setup, sequence] = texts.map_err(|e| anyhow!("{name} cannot be read: {}", files::reason(&e)))?;
        return Ok(if keyword == SETUP { setup } else { sequence });
    }
    let mut decoder = png::Decoder::new(file);
    let not_png = || format!("{name} is not a PNG file that can be read");
    decoder.read_header_info().with_context(not_png)?;
    let reader = decoder.read_info().with_context(not_png)?;
    let Some(mut chunk) = reader.info().utf8_text.iter().find(|c| c.keyword == keyword).cloned() else {
        return Ok(None);
    };
    // A text may be compressed a thousandfold.
    let most = files::MOST_TEXT as usize;
    let bound = || format!("the set-up inside {name} cannot be read, or has more than {} MiB", most >> 20);
    chunk.decompress_text_with_limit(most).with_context(bound)?;
    chunk.get_text().map(Some).with_context(|| format!("the set-up inside {name} cannot be read"))
}

fn write_exr(renderer: &Renderer, setup: &Setup, path: &Path) -> Result<()> {
    use exr::prelude::*;
    let (part, whole) = (setup.part(), setup.size[0]);
    let [mut w, mut h] = [part[2] as usize, part[3] as usize];
    let doing = || format!("{} cannot be written", path.display());
    let one = |name: &str, values: Vec<f32>| {
        let channel = AnyChannel::new(name, FlatSamples::F32(values));
        AnyChannels::sort(vec![channel].into())
    };
    let three = |values: Vec<[f32; 3]>| {
        let values = cut(&values, whole, part);
        let channel =
            |name: &str, i: usize| AnyChannel::new(name, FlatSamples::F32(values.iter().map(|v| v[i]).collect()));
        AnyChannels::sort(vec![channel("R", 0), channel("G", 1), channel("B", 2)].into())
    };
    let channels = match setup.view.as_str() {
        "visibility" => one("Y", cut(&renderer.read_visibility()?, whole, part)),
        "truth" => one("Y", cut(&renderer.read_truth()?, whole, part)),
        "depth" => one("Y", cut(&renderer.read_position()?, whole, part).iter().map(|p| p[3]).collect()),
        "position" => three(renderer.read_position()?.iter().map(|p| [p[0], p[1], p[2]]).collect()),
        "aliasing" => {
            let values = renderer.analysis().aliasing(&renderer.gpu)?;
            three(values.context("this technique has no maps")?.iter().map(|a| [a[0], a[1], a[2]]).collect())
        }
        "counts" => {
            let maps = renderer.analysis().maps().context("this technique has no maps")?;
            [w, h] = [maps.size[0] as usize, (maps.size[1] * maps.layers) as usize];
            let mut values = Vec::with_capacity(w * h);
            let take = |_, counts: &[u32]| values.extend(counts.iter().map(|c| *c as f32));
            let counted = renderer.analysis().counts(&renderer.gpu, take)?;
            ensure!(counted, "{} × {} texels are too many to count", maps.size[0], maps.size[1]);
            one("Y", values)
        }
        _ => {
            let position = renderer.read_position()?;
            let normal =
                |(s, p): (&[u32; 4], &[f32; 4])| if p[3] > 0.0 { shading_normal(*s).to_array() } else { [0.0; 3] };
            three(renderer.read_surface()?.iter().zip(&position).map(normal).collect())
        }
    };
    let mut attributes = LayerAttributes::named(setup.view.as_str());
    let mut comments = setup.to_toml(path)?;
    if setup.view == "position" {
        // At full distance they would be rounded.
        let [x, y, z] = renderer.scene().origin.to_array();
        comments += &format!("# Positions are relative to [{x:?}, {y:?}, {z:?}].\n");
    }
    attributes.comments = Text::new_or_none(comments);
    let layer = Layer::new((w, h), attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).with_context(doing)?;
    files::save(path, bytes.get_ref())
}

/// Reads `WxH`.
pub fn parse_size(text: &str) -> Result<[u32; 2]> {
    let sides: Vec<u32> = text.split('x').filter_map(|s| s.trim().parse().ok()).collect();
    ensure!(
        sides.len() == 2 && text.split('x').count() == 2,
        "--size {text}: write it as WIDTHxHEIGHT, such as 1920x1080"
    );
    Ok([sides[0], sides[1]])
}
