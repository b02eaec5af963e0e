//! `lesson`: a lesson as a page, measured now.

use super::{interrupt, print, progress, show};
use crate::lessons;
use anyhow::{Context, Result};
use std::path::Path;
use std::sync::Arc;

/// Prints a lesson, or the set-up of one of its steps, from 1.
pub fn lesson(id: &str, step: Option<usize>, adapter: Option<&str>) -> Result<()> {
    let lesson = lessons::find(id)?;
    if let Some(number) = step {
        let steps = lesson.steps.len();
        let step = number.checked_sub(1).and_then(|i| lesson.steps.get(i));
        let step = step.with_context(|| format!("--setup {number}: {id} has the steps 1 to {steps}"))?;
        let (setup, _) = step.scene.open().with_context(|| format!("{id}, step {number}"))?;
        return print(&setup.to_toml(Path::new("setup.toml"))?);
    }
    let gpu = Arc::new(interrupt::device(adapter)?);
    let bar = progress();
    let measured = lessons::walk(&gpu, lesson, &mut |done, what| show(&bar, done, what.into()));
    bar.finish_and_clear();
    let measured = measured?;
    print(&lessons::page(lesson, &measured))
}
