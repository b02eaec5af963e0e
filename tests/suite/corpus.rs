//! Files that others may have made, all readers: those in `tests/corpus`, among them all that once were trouble, and damaged
//! copies of them.

use crate::common::Random;
use crate::readers::{self, Reader};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.is_file());
    found.sort();
    found
}

/// Lets a reader have the bytes; `keep` is where they are found again if it falls over them or takes too long.
fn read(reader: Reader, bytes: &[u8], keep: impl Fn() -> PathBuf) {
    let start = Instant::now();
    let fell = catch_unwind(|| reader(bytes)).is_err();
    let took = start.elapsed();
    assert!(!fell && took < Duration::from_secs(10), "{}: {took:?}", keep().display());
}

#[test]
fn every_file_of_the_corpus_is_taken_or_refused() {
    for (name, reader) in readers::ALL {
        let corpus = files(&Path::new("tests/corpus").join(name));
        assert!(!corpus.is_empty(), "{name}");
        for path in corpus {
            read(reader, &std::fs::read(&path).unwrap(), || path.clone());
        }
    }
}

fn below(random: &mut Random, n: u32) -> u32 {
    ((random.next() * n as f32) as u32).min(n - 1)
}

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

/// A look at what `fuzz/` does at length, without what that needs.
#[test]
fn damaged_files_are_taken_or_refused() {
    let mut random = Random(0x5eed);
    let mut corpora = readers::ALL.map(|(name, reader)| (reader, files(&Path::new("tests/corpus").join(name))));
    corpora[0].1.extend(
        files(Path::new("tests/data/gltf")).into_iter().filter(|path| path.extension() == Some("glb".as_ref())),
    );
    let (begun, mut tried) = (Instant::now(), 0);
    while begun.elapsed() < Duration::from_secs(3) {
        let (reader, files) = &corpora[tried % corpora.len()];
        let path = &files[below(&mut random, files.len() as u32) as usize];
        let mut bytes = std::fs::read(path).unwrap();
        damage(&mut bytes, &mut random);
        read(*reader, &bytes, || {
            let kept = std::env::temp_dir().join(format!("shadowscope-damaged-{tried}"));
            std::fs::write(&kept, &bytes).unwrap();
            kept
        });
        tried += 1;
    }
    assert!(tried > 50, "{tried}");
}
