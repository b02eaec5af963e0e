//! What a lesson's steps measure.

use super::claim::{Claim, Quantity, Whose};
use super::{Lesson, Plan, Step};
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::measure::{self, Column, Record};
use crate::setup::Setup;
use anyhow::{Context, Result};
use std::sync::Arc;

/// What was measured of a step's set-ups.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    pub records: Vec<(Whose, Record)>,
}

impl Measured {
    pub fn of(&self, whose: Whose) -> Option<&Record> {
        self.records.iter().find(|(w, _)| *w == whose).map(|(_, record)| record)
    }

    pub fn value(&self, quantity: Quantity) -> Option<f64> {
        (quantity.column.get)(self.of(quantity.whose)?)
    }

    /// Whether all of these are so.
    pub fn all_hold(&self, claims: &[Claim]) -> bool {
        claims.iter().all(|claim| claim.holds(&|q| self.value(q)) == Some(true))
    }
}

/// A question answered by measuring.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    pub measured: Measured,
    /// The right one of the question's choices.
    pub right: Option<usize>,
    /// The set-up that the reader made of it, where that is another.
    pub own: Option<Record>,
}

/// A set-up in its scene, by what draws it.
fn open<'a>(held: &'a mut Option<Renderer>, gpu: &Arc<Gpu>, plan: &Plan) -> Result<(&'a mut Renderer, Setup)> {
    let name = plan.scene();
    if held.as_ref().is_some_and(|r| r.scene().name != name) {
        *held = None;
    }
    let setup = match held {
        Some(renderer) => plan.in_scene(renderer.scene())?,
        None => {
            let (setup, scene) = plan.open()?;
            *held = Some(Renderer::new(gpu.clone(), Arc::new(scene))?);
            setup
        }
    };
    let renderer = held.as_mut().context("the scene has gone")?;
    Ok((renderer, setup))
}

/// What is measured already: set-ups, whether against the averaged truth, and whether with flicker.
type Known = Vec<((Setup, bool, bool), Record)>;

/// Measures these columns of these of a step's set-ups, those that are not known yet.
fn measured(
    (held, known): (&mut Option<Renderer>, &mut Known),
    gpu: &Arc<Gpu>,
    (step, before): (&Step, Option<&Step>),
    columns: &[&Column],
    sides: &[Whose],
    tick: &mut dyn FnMut(f32, &str),
) -> Result<Measured> {
    let mut out = Measured::default();
    for (i, whose) in sides.iter().enumerate() {
        tick(i as f32 / sides.len() as f32, whose.told());
        let plan = step.plan(*whose, before).with_context(|| format!("there is no set-up of {}", whose.told()))?;
        let (renderer, setup) = open(held, gpu, &plan)?;
        let setup = if let Whose::Side(i) = whose { setup.side(*i) } else { setup };
        let [hard, steady] =
            [Column::is_of_labels, |c: &Column| !c.id.contains("flicker")].map(|of| columns.iter().all(|c| of(c)));
        let timed = columns.iter().any(|c| c.is_time() || c.is_multiple());
        let key = (setup.measured(), hard, steady);
        let found = known.iter().find(|(k, _)| *k == key && !timed).map(|(_, record)| record.clone());
        let record = match found {
            Some(record) => record,
            None => measure::figures(renderer, &setup, columns)?,
        };
        known.push((key, record.clone()));
        out.records.push((*whose, record));
    }
    Ok(out)
}

/// Measures all that the steps of a lesson are about but times.
///
/// # Errors
/// A step that cannot be opened or drawn.
pub fn walk(gpu: &Arc<Gpu>, lesson: &Lesson, tick: &mut dyn FnMut(f32, &str)) -> Result<Vec<Measured>> {
    let (mut held, mut known) = (None, Known::new());
    let mut all = Vec::new();
    for (i, step) in lesson.steps.iter().enumerate() {
        tick(i as f32 / lesson.steps.len() as f32, &step.title);
        let before = i.checked_sub(1).map(|i| &lesson.steps[i]);
        let (mut columns, sides) = step.asked(step.quantities());
        columns.retain(|c| !c.is_time() && !c.is_multiple());
        // A step that claims nothing is drawn all the same.
        let found = measured((&mut held, &mut known), gpu, (step, before), &columns, &sides, &mut |_, _| ());
        all.push(found.with_context(|| format!("{}, step {}", lesson.id, i + 1))?);
    }
    Ok(all)
}

/// Measures what a step's question is about; `own`: the set-up that the reader has made of the step's, in the scene that is open.
///
/// # Errors
/// A set-up that cannot be drawn.
pub fn answer(
    renderer: Renderer,
    lesson: &Lesson,
    step: usize,
    own: Option<Setup>,
    tick: &mut dyn FnMut(f32, &str),
) -> Result<Answer> {
    let gpu = renderer.gpu.clone();
    let mut held = Some(renderer);
    let Some(Step { question: Some(question), .. }) = lesson.steps.get(step) else { return Ok(Answer::default()) };
    let before = step.checked_sub(1).map(|i| &lesson.steps[i]);
    let step = &lesson.steps[step];
    let (columns, sides) = step.asked(question.quantities());
    let mut out = Answer::default();
    // The scene that is open comes first.
    if let (Some(own), Some(renderer)) = (own, &mut held) {
        tick(0.0, "as you have it");
        out.own = Some(measure::figures(renderer, &own, &columns)?);
    }
    out.measured = measured((&mut held, &mut Known::new()), &gpu, (step, before), &columns, &sides, tick)?;
    out.right = question.choices.iter().position(|c| out.measured.all_hold(&c.holds));
    Ok(out)
}
