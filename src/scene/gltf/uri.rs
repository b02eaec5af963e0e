//! What a glTF URI stands for: data in the URI itself or a file next to the glTF file.

use super::broken;
use crate::files;
use crate::message::quoted;
use anyhow::{Result, bail};
use std::path::{Component, Path, PathBuf};

/// The bytes `uri` stands for. `owner` names the buffer or image in messages; files lie in `folder`.
pub fn fetch(uri: &str, folder: &Path, owner: &str) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err(broken(format!("the data URI of {owner} is not base64")));
        };
        return match base64(text) {
            Some(bytes) => Ok(bytes),
            None => Err(broken(format!("the data URI of {owner} is not valid base64"))),
        };
    }
    if ["http:", "https:"].iter().any(|scheme| uri.get(..scheme.len()).is_some_and(|s| s.eq_ignore_ascii_case(scheme)))
    {
        bail!(
            "{owner} lies on the network, at {}, from where nothing is fetched; download it, put it next to the file and use \
             a relative URI",
            quoted(uri)
        );
    }
    let Some(relative) = relative_path(uri) else {
        bail!(
            "{owner} lies at {}, outside the file's folder, where nothing is read; \
             put it next to the file and use a relative URI",
            quoted(uri)
        );
    };
    files::read_beside(folder, &relative).map_err(|error| {
        anyhow::anyhow!(
            "{owner} is in the file {}, which cannot be read ({}); put it next to the scene's file",
            quoted(uri),
            files::reason(&error)
        )
    })
}

/// The path below the file's folder that a relative URI names; `None` if it leads elsewhere.
fn relative_path(uri: &str) -> Option<PathBuf> {
    let first = uri.split('/').next()?;
    if first.contains(':') {
        return None; // a scheme
    }
    // Some exporters on Windows write their own separator.
    let decoded = percent_decoded(uri)?.replace('\\', "/");
    let path = PathBuf::from(decoded);
    let inside = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
    path.components().all(inside).then_some(path)
}

fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        let hex = |at: usize| Some((char::from(*tail.get(at)?)).to_digit(16)? as u8);
        // A lone percent sign stands for itself, as browsers read it.
        if let (b'%', Some(high), Some(low)) = (first, hex(0), hex(1)) {
            bytes.push(high << 4 | low);
            rest = &tail[2..];
        } else {
            bytes.push(*first);
            rest = tail;
        }
    }
    String::from_utf8(bytes).ok()
}

/// Decodes base64 (RFC 4648, padding optional); `None` if a character does not belong.
fn base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    if text.len() % 4 == 1 {
        return None;
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for &letter in group {
            let digit = match letter {
                b'A'..=b'Z' => letter - b'A',
                b'a'..=b'z' => letter - b'a' + 26,
                b'0'..=b'9' => letter - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(digit);
        }
        bits <<= 6 * (4 - group.len());
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Some(bytes)
}
