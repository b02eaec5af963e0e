//! `animate`: a set-up's picture along a way.

use super::{Picture, check_target, interrupt, progress, renderer, show};
use crate::files;
use crate::message::tell;
use crate::sequence::{self, Along, FRAMES, Sequence};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// What moves, and where the frames go.
#[derive(clap::Args)]
pub struct Wanted {
    #[command(flatten)]
    picture: Picture,
    /// Animation to write (.png or .apng, .webp), or numbered frames: a name such as out/frame-.png becomes out/frame-0001.png and so on.
    #[arg(short, long)]
    output: PathBuf,
    /// The camera once around the upright line through its target, in so many frames.
    #[arg(long, value_name = "FRAMES", num_args = 0..=1, default_missing_value = "60", group = "way")]
    turntable: Option<u32>,
    /// Camera and light along the set-up's own path, or what moves along that of a case whose scene it is.
    #[arg(long, value_name = "CASE", num_args = 0..=1, default_missing_value = "", group = "way")]
    path: Option<String>,
    /// The clock of the scene's animation, all of it or from one time to another, seconds.
    #[arg(long, value_name = "FROM..TO", num_args = 0..=1, default_missing_value = "", group = "way")]
    clock: Option<String>,
    /// Frames; by default as many as fit the time.
    #[arg(long, value_parser = clap::value_parser!(u32).range(i64::from(FRAMES[0])..=i64::from(FRAMES[1])))]
    frames: Option<u32>,
    /// Frames a second; by default 30.
    #[arg(long)]
    fps: Option<f32>,
    /// Where the turntable starts, degrees from the camera, seen from above anticlockwise.
    #[arg(long, value_name = "DEGREES", requires = "turntable", allow_hyphen_values = true)]
    start: Option<f32>,
}

pub fn run(wanted: Wanted, adapter: Option<&str>) -> Result<()> {
    let Wanted { picture, output, turntable, path, clock, frames, fps, start } = wanted;
    sequence::check_name(&output)?;
    let numbered = sequence::is_numbered(&output);
    check_target(&if numbered { sequence::numbered(&output, 0) } else { output.clone() })?;
    // What an animation was made of is known to it.
    let held = held(&picture.wanted.setup)?;
    let (setup, scene) = picture.open()?;
    let along = match (turntable, path.as_deref(), clock.as_deref()) {
        (Some(_), ..) => Along::Turntable { start: start.unwrap_or(0.0) },
        (_, Some(""), _) => Along::path_of(&setup).unwrap_or(Along::Path),
        (_, Some(case), _) => Along::Case { case: case.into() },
        (.., Some("")) => sequence::whole_clock(&setup, &scene)?,
        (.., Some(times)) => {
            let times = times.split_once("..").and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
            let (from, to) = times.context("--clock takes FROM..TO, two times in seconds, such as 0..2.5")?;
            Along::Clock { from, to }
        }
        _ => match &held {
            Some(held) => held.along.clone(),
            None => bail!("nothing moves; say what does: --turntable, --path or --clock"),
        },
    };
    let held = held.filter(|held| held.along == along);
    let frames = frames.or(turntable).or(held.as_ref().map(|held| held.frames));
    let sequence = Sequence::new(along, &setup, frames, fps.or(held.map(|held| held.fps)))?;

    let mut renderer = renderer(interrupt::device(adapter)?, scene)?;
    let bar = progress();
    let mut finished = 0;
    let written = sequence::write(&mut renderer, &setup, &sequence, &output, &mut |done| {
        finished = (done * sequence.frames as f32).round() as u32;
        show(&bar, done, format!("frame {} of {}", finished + 1, sequence.frames));
        !interrupt::asked()
    });
    bar.finish_and_clear();
    let written = interrupt::kept(written, || match (numbered, finished) {
        (true, 1..) => format!("{finished} of {} frames are written", sequence.frames),
        _ => "nothing is written".into(),
    });
    for note in written? {
        tell!("{note}");
    }
    let told = |path: &Path| path.display().to_string();
    match numbered {
        true => {
            let [first, last] = [0, sequence.frames - 1].map(|frame| told(&sequence::numbered(&output, frame)));
            tell!("wrote {first} to {last}");
        }
        false => tell!("wrote {}: {} frames, {} a second", told(&output), sequence.frames, sequence.fps),
    }
    Ok(())
}

/// The sequence inside what is opened, if that is an animation.
fn held(setup: &str) -> Result<Option<Sequence>> {
    let path = files::path_of(setup);
    let holds = path.extension().is_some_and(|e| sequence::ENDINGS.iter().any(|held| e.eq_ignore_ascii_case(held)));
    if holds { sequence::read(&path) } else { Ok(None) }
}
