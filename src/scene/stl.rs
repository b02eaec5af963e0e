//! Loads STL files, binary and ASCII.

use super::Scene;
use super::polygons::{Corner, GREY, NONE, Polygons, cannot_load, material};
use crate::files;
use crate::message::quoted;
use anyhow::{Context, Result, anyhow, ensure};
use glam::DVec3;
use std::path::Path;

/// Loads a file. STL says nothing of axes and units: z is taken as up, as most programs that write it do.
pub fn load(path: &Path) -> Result<Scene> {
    read(path).map_err(|cause| cannot_load(path, &cause))
}

fn read(path: &Path) -> Result<Scene> {
    let data = files::read(path, files::MOST_DATA).map_err(|error| anyhow!(files::reason(&error)))?;
    let mut polygons = Polygons::default();
    let mut add = |[x, y, z]: [f32; 3]| polygons.positions.push(DVec3::new(x.into(), z.into(), -f64::from(y)));
    // A binary file may begin as an ASCII one does, but its length tells.
    let claimed = data.get(80..84).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    let ascii = data.trim_ascii_start().get(..5).is_some_and(|start| start.eq_ignore_ascii_case(b"solid"));
    match claimed {
        Some(count) if !ascii || data.len() == 84 + 50 * count => {
            let room = (data.len() - 84) / 50;
            ensure!(
                count <= room,
                "it says that it has {count} triangles, but ends after {room}; download or export it again"
            );
            for facet in data[84..].chunks_exact(50).take(count) {
                let number = |i: usize| f32::from_le_bytes([facet[i], facet[i + 1], facet[i + 2], facet[i + 3]]);
                [12, 24, 36].into_iter().for_each(|at| add([number(at), number(at + 4), number(at + 8)]));
            }
        }
        _ => {
            ensure!(
                ascii,
                "it is not an STL file, as it is too short for a binary one and does not begin with \"solid\""
            );
            let text = String::from_utf8_lossy(&data);
            for (number, line) in text.lines().enumerate() {
                let mut words = line.split_ascii_whitespace();
                if words.next().is_some_and(|word| word.eq_ignore_ascii_case("vertex")) {
                    let mut next = || words.next().and_then(|word| word.parse().ok());
                    let at = || format!("line {}: {} is no vertex of three numbers", number + 1, quoted(line.trim()));
                    add([next().with_context(at)?, next().with_context(at)?, next().with_context(at)?]);
                }
            }
        }
    }
    ensure!(
        polygons.positions.len() % 3 == 0,
        "it has {} corners, which are no whole triangles; it is damaged, export it again",
        polygons.positions.len()
    );
    for triangle in 0..polygons.positions.len() / 3 {
        let first = 3 * triangle;
        let corner = |i: usize| Corner { position: (first + i) as u32, normal: NONE, uv: NONE };
        polygons.corners.extend([0, 1, 2].map(corner));
        polygons.face(first, 0, 0);
    }
    let note = "STL has neither axes nor units: z is taken as up, and a unit as a metre.".into();
    polygons.scene(path, vec![material("STL", GREY)], Vec::new(), vec![note])
}
