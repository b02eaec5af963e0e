//! Damaged scene files: whatever a loader is given, it draws it or refuses it in a sentence, soon.

use crate::common::Random;
use shadowscope::scene::formats;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Files below a folder, one level deep.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path),
        }
    }
    found.retain(|p| {
        let extension = p.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        ["glb", "gltf", "obj", "ply", "stl"].contains(&extension.as_str())
            && p.metadata().is_ok_and(|m| m.len() < 400_000)
    });
    found.sort();
    found
}

fn below(random: &mut Random, n: u32) -> u32 {
    ((random.next() * n as f32) as u32).min(n - 1)
}

/// Small files of the formats that are text.
const TEXTS: [(&str, &str); 3] = [
    (
        "quad.obj",
        "mtllib none.mtl\no quad\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -4 -3 -2\n",
    ),
    (
        "quad.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3\n",
    ),
    (
        "one.stl",
        "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid one\n",
    ),
];

/// A few bytes changed, moved, cut out or doubled; numbers become borders of their types.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + below(random, 6) {
        let length = bytes.len() as u32;
        if length < 4 {
            return;
        }
        let at = below(random, length - 3) as usize;
        match below(random, 8) {
            0 => bytes[at] ^= 1 << below(random, 8),
            1 => bytes[at] = below(random, 256) as u8,
            2 => bytes[at..at + 4]
                .copy_from_slice(&[[0; 4], [255; 4], [0, 0, 0, 128], [255, 255, 255, 127]][below(random, 4) as usize]),
            3 => bytes[at..at + 4]
                .copy_from_slice(&[f32::NAN, f32::INFINITY, 1e38, 1e-45][below(random, 4) as usize].to_le_bytes()),
            4 => bytes.truncate(at),
            5 => {
                let end = (at + 1 + below(random, 64) as usize).min(bytes.len());
                bytes.drain(at..end);
            }
            6 => {
                let end = (at + 1 + below(random, 64) as usize).min(bytes.len());
                let part = bytes[at..end].to_vec();
                let to = below(random, length) as usize;
                bytes.splice(to..to, part);
            }
            // A digit of the JSON or text nearby.
            _ => {
                if let Some(digit) = bytes[at..].iter_mut().find(|b| b.is_ascii_digit()) {
                    *digit = b"0123456789-e.\"[{"[below(random, 16) as usize];
                }
            }
        }
    }
}

/// By default for a moment. `SHADOWSCOPE_MUTATE` says for how many seconds, and after a colon a folder of files to damage.
#[test]
fn damaged_files_are_drawn_or_refused() {
    let (seconds, folder) = match std::env::var("SHADOWSCOPE_MUTATE") {
        Ok(text) => {
            let (seconds, folder) = text.split_once(':').unwrap_or((&text, "tests/data"));
            (seconds.parse().unwrap(), folder.to_owned())
        }
        Err(_) => (3.0, "tests/data".into()),
    };
    let texts = tempfile::tempdir().unwrap();
    for (name, text) in TEXTS {
        std::fs::write(texts.path().join(name), text).unwrap();
    }
    let corpus = [files(Path::new(&folder)), files(texts.path())].concat();
    assert!(corpus.len() > 5, "{corpus:?}");
    let place = tempfile::tempdir().unwrap();
    let mut random = Random(0x5eed ^ seconds as u64);
    let (begun, mut tried, mut drawn, mut slowest) = (Instant::now(), 0u64, 0u64, Duration::ZERO);
    while begun.elapsed() < Duration::from_secs_f64(seconds) {
        let from = &corpus[below(&mut random, corpus.len() as u32) as usize];
        let mut bytes = std::fs::read(from).unwrap();
        damage(&mut bytes, &mut random);
        let path = place.path().join("damaged").with_extension(from.extension().unwrap());
        std::fs::write(&path, &bytes).unwrap();
        let start = Instant::now();
        let loaded = catch_unwind(AssertUnwindSafe(|| formats::load(&path)));
        let took = start.elapsed();
        let keep = || {
            let kept = std::env::temp_dir()
                .join(format!("shadowscope-damaged-{tried}"))
                .with_extension(path.extension().unwrap());
            std::fs::write(&kept, &bytes).unwrap();
            kept
        };
        match loaded {
            Ok(Ok(_)) => drawn += 1,
            Ok(Err(error)) => {
                let message = error.to_string();
                assert!(message.len() < 1200 && !message.contains('\n'), "{message} ({})", keep().display());
            }
            Err(_) => panic!("the loader fell over {}, from {}", keep().display(), from.display()),
        }
        assert!(took < Duration::from_secs(20), "{took:?} for {}, from {}", keep().display(), from.display());
        slowest = slowest.max(took);
        tried += 1;
    }
    println!("{tried} damaged files, {drawn} drawn, slowest {slowest:?}");
    assert!(tried > 20 && drawn > 0);
}
