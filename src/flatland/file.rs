//! Worlds as TOML files, with angles in degrees.

use super::Flatland;
use anyhow::{Result, ensure};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// A world as it is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    eye: [f64; 2],
    /// Degrees counter-clockwise from +x.
    gaze: f64,
    /// Degrees.
    fov: f64,
    light: [f64; 2],
    #[serde(default = "hundred")]
    pixels: usize,
    #[serde(default = "hundred")]
    lexels: usize,
    /// x and y of one end, x and y of the other.
    segments: Vec<[f64; 4]>,
}

fn hundred() -> usize {
    100
}

/// Most segments of a world.
pub const MOST_SEGMENTS: usize = 1000;
/// Most pixels, and most texels.
pub const MOST: usize = 10_000;

/// Whether a TOML text is meant as a world, not as a set-up.
pub fn is_world(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|t| t.contains_key("segments") && t.contains_key("eye"))
}

impl Flatland {
    /// # Errors
    /// Text that is no such file, in one sentence.
    pub fn from_toml(text: &str) -> Result<Flatland> {
        let file: File = toml::from_str(text).map_err(|e| crate::setup::one_line(&e.to_string()))?;
        let numbers = [file.eye, file.light].into_iter().flatten().chain(file.segments.iter().flatten().copied());
        for x in numbers {
            ensure!(x.is_finite() && x.abs() <= 1e9, "{x} is no place: coordinates go from -1e9 to 1e9");
        }
        ensure!(file.gaze.is_finite() && file.gaze.abs() <= 360.0, "gaze = {}: it goes from -360 to 360°", file.gaze);
        ensure!((1.0..=170.0).contains(&file.fov), "fov = {}: it goes from 1 to 170°", file.fov);
        for (what, count) in [("pixels", file.pixels), ("lexels", file.lexels)] {
            ensure!((1..=MOST).contains(&count), "{what} = {count}: it goes from 1 to {MOST}");
        }
        let count = file.segments.len();
        ensure!(count <= MOST_SEGMENTS, "there are {count} segments, and there can be {MOST_SEGMENTS}");
        let segments = file.segments.iter().map(|[a, b, c, d]| [DVec2::new(*a, *b), DVec2::new(*c, *d)]).collect();
        Ok(Flatland {
            eye: file.eye.into(),
            gaze: file.gaze.to_radians(),
            fov: file.fov.to_radians(),
            light: file.light.into(),
            segments,
            pixels: file.pixels,
            lexels: file.lexels,
        })
    }

    /// # Errors
    /// None that is known.
    pub fn to_toml(&self) -> Result<String> {
        let segments = self.segments.iter().map(|[a, b]| [a.x, a.y, b.x, b.y]).collect();
        let degrees = |x: f64| (x.to_degrees() * 1e9).round() / 1e9;
        let file = File {
            eye: self.eye.to_array(),
            gaze: degrees(self.gaze),
            fov: degrees(self.fov),
            light: self.light.to_array(),
            pixels: self.pixels,
            lexels: self.lexels,
            segments,
        };
        Ok(toml::to_string(&file)?)
    }
}
