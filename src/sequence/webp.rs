//! Animated WebP of lossless stills (the container of RFC 9649), with texts inside as XMP.

use super::Run;
use crate::files;
use anyhow::{Context, Result, ensure};
use image::ExtendedColorType;
use image::codecs::webp::WebPEncoder;
use std::io::{self, Read, Seek, SeekFrom};

const CANNOT: &str = "the animation cannot be written as WebP";
/// Of the canvas: frames have alpha, there is XMP, it is animated.
const FLAGS: u8 = 0x10 | 0x04 | 0x02;
/// Of a frame: it replaces what is below it.
const REPLACES: u8 = 0x02;

/// Draws all frames into an animated WebP.
pub(super) fn encode(run: &mut Run, texts: &[String; 2]) -> Result<Vec<u8>> {
    let (frames, fps) = (run.sequence.frames, f64::from(run.sequence.fps));
    let mut bytes = b"RIFF\0\0\0\0WEBP".to_vec();
    for frame in 0..frames {
        let (pixels, _) = run.frame(frame)?;
        let [width, height] = pixels.size;
        ensure!(
            width.max(height) <= 16384,
            "{width} × {height} pixels are more than WebP takes (16384 a side); write a .png file"
        );
        if frame == 0 {
            let mut canvas = vec![FLAGS, 0, 0, 0];
            canvas.extend([width, height].iter().flat_map(|side| three(side - 1)));
            chunk(&mut bytes, b"VP8X", &canvas);
            // Nothing behind it, and played again and again.
            chunk(&mut bytes, b"ANIM", &[0; 6]);
        }
        let mut still = Vec::new();
        let encoder = WebPEncoder::new_lossless(&mut still);
        encoder.encode(&pixels.rgba, width, height, ExtendedColorType::Rgba8).context(CANNOT)?;
        // Behind the file's head stands the chunk of the pixels, which is a frame's too.
        let still = still.get(12..).context(CANNOT)?;
        // Whole milliseconds, so that their sum keeps to the rate.
        let ends = |frames: u32| (f64::from(frames) * 1000.0 / fps).round() as u32;
        let mut content = vec![0; 6];
        content.extend(
            [width - 1, height - 1, (ends(frame + 1) - ends(frame)).min(0xff_ffff)].iter().flat_map(|n| three(*n)),
        );
        content.push(REPLACES);
        content.extend(still);
        chunk(&mut bytes, b"ANMF", &content);
        ensure!(
            bytes.len() < 1 << 31,
            "more than 2 GiB do not fit into a WebP file; draw fewer frames, or numbered ones"
        );
    }
    chunk(&mut bytes, b"XMP ", packet(texts).as_bytes());
    let size = bytes.len() as u32 - 8;
    bytes[4..8].copy_from_slice(&size.to_le_bytes());
    Ok(bytes)
}

fn three(number: u32) -> [u8; 3] {
    let [a, b, c, _] = number.to_le_bytes();
    [a, b, c]
}

fn chunk(bytes: &mut Vec<u8>, name: &[u8; 4], content: &[u8]) {
    bytes.extend(name);
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.extend(content);
    if content.len() % 2 == 1 {
        bytes.push(0);
    }
}

/// The elements of the packet that hold the set-up and the sequence.
const ELEMENTS: [&str; 2] = ["shadowscope:setup", "shadowscope:sequence"];
const ESCAPES: [(&str, &str); 3] = [("&", "&amp;"), ("<", "&lt;"), (">", "&gt;")];

fn packet(texts: &[String; 2]) -> String {
    let escaped = |text: &String| ESCAPES.iter().fold(text.clone(), |text, (c, name)| text.replace(c, name));
    let elements = ELEMENTS.iter().zip(texts).map(|(name, text)| format!("<{name}>{}</{name}>", escaped(text)));
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\
         <rdf:Description rdf:about=\"\" xmlns:shadowscope=\"urn:shadowscope\">{}</rdf:Description></rdf:RDF></x:xmpmeta>",
        elements.collect::<String>()
    )
}

/// The set-up and the sequence inside a WebP file; None: it has no such text.
///
/// # Errors
/// It cannot be read, is no WebP, or has more text than is read.
pub(crate) fn read_texts(file: &mut (impl Read + Seek)) -> io::Result<[Option<String>; 2]> {
    let mut head = [0; 12];
    file.read_exact(&mut head)?;
    if !head.starts_with(b"RIFF") || !head.ends_with(b"WEBP") {
        return Err(io::Error::other("it is not a WebP file"));
    }
    loop {
        let mut head = [0; 8];
        match file.read_exact(&mut head) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok([None, None]),
            read => read?,
        }
        let size = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
        if head.starts_with(b"XMP ") {
            if u64::from(size) > files::MOST_TEXT {
                return Err(io::Error::other(format!("its text has more than {} MiB", files::MOST_TEXT >> 20)));
            }
            let mut text = Vec::new();
            file.by_ref().take(size.into()).read_to_end(&mut text)?;
            let text = String::from_utf8(text).map_err(io::Error::other)?;
            return Ok(ELEMENTS.map(|name| {
                let (_, rest) = text.split_once(&format!("<{name}>"))?;
                let (held, _) = rest.split_once(&format!("</{name}>"))?;
                Some(ESCAPES.iter().rev().fold(held.to_string(), |text, (c, name)| text.replace(name, c)))
            }));
        }
        file.seek(SeekFrom::Current(i64::from(size) + i64::from(size % 2)))?;
    }
}
