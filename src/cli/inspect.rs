//! `inspect`: a pixel's story.

use super::{Wanted, parse_place, print, renderer};
use crate::gpu::Gpu;
use crate::measure::diagnosis::{self, Diagnosis};
use crate::measure::story;
use crate::setup;
use anyhow::{Result, ensure};
use clap::Args;
use serde::Serialize;

/// Which pixel, and how it is told.
#[derive(Args)]
pub struct Pixel {
    /// The technique; `list techniques` names them.
    #[arg(long)]
    technique: Option<String>,
    /// The pixel's place in the picture: X,Y, from 0 to 1 from its upper left corner; the set-up's probe unless given.
    #[arg(long, value_parser = parse_place, value_name = "X,Y")]
    at: Option<[f32; 2]>,
    /// Also try what would help, each change alone, and tell what it does to the errors.
    #[arg(long = "try")]
    tries: bool,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// A story with what was tried.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    story: &'a story::Story,
    before: Option<diagnosis::Errors>,
    tried: Vec<(String, diagnosis::Errors)>,
}

pub fn run(wanted: &Wanted, pixel: Pixel, adapter: Option<&str>) -> Result<()> {
    let own = pixel.technique.clone().unwrap_or(setup::DEFAULT_TECHNIQUE.into());
    let (mut setup, scene) = wanted.open(&[own])?;
    if let Some(technique) = &pixel.technique {
        setup.select(technique)?;
    }
    if let Some([x, y]) = pixel.at {
        let inside = [x, y].iter().all(|share| (0.0..=1.0).contains(share));
        ensure!(inside, "--at {x},{y} lies outside the picture; give two shares from 0 to 1");
        setup.probe = [x, y];
    }
    let selected = [setup.technique.clone()];
    wanted.apply(&mut setup, &scene, &selected)?;
    let mut renderer = renderer(Gpu::new(adapter)?, scene)?;
    let told = story::at(&mut renderer, &setup, setup.probe)?;
    let (mut before, mut tried) = (None, Vec::new());
    if let Some(Diagnosis { remedies, .. }) = told.diagnosis.as_ref().filter(|_| pixel.tries) {
        let mut measure = |setup: &_| diagnosis::measure(&mut renderer, setup, told.size, setup_place(&told));
        before = Some(measure(&setup)?);
        for remedy in remedies {
            tried.push((remedy.text(), measure(&remedy.applied(&setup))?));
        }
    }
    if pixel.json {
        return print(&(serde_json::to_string_pretty(&Told { story: &told, before, tried })? + "\n"));
    }
    let mut text = told.text();
    if let Some(before) = before {
        text += "Tried\n";
        for (what, e) in [("as it is".to_string(), before)].iter().chain(&tried) {
            let label = if e.wrong { "wrong" } else { "right" };
            text += &format!("  {what:<34} {:.3} % wrong, RMSE {:.4}; this pixel {label}\n", 100.0 * e.share, e.rmse);
        }
    }
    print(&text)
}

/// The middle of the pixel, as a place.
fn setup_place(told: &story::Story) -> [f32; 2] {
    [0, 1].map(|i| (told.pixel[i] as f32 + 0.5) / told.size[i] as f32)
}
