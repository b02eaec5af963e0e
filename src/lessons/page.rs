//! A lesson as a page of the docs, with what was measured.

use super::claim::Whose;
use super::{Lesson, Measured, Step};
use crate::glossary;
use crate::measure::table;
use std::fmt::Write;

/// The page of a lesson, in Markdown. It holds no times: these are the machine's.
pub fn page(lesson: &Lesson, measured: &[Measured]) -> String {
    let id = &lesson.id;
    let mut out = format!(
        "# {}\n\n{}\n\n![The first step](../images/lessons/{id}.png)\n\nIn the window: the tile *{}* of the start screen (F8). This page is what `shadowscope lesson {id}` prints.\n",
        lesson.title, lesson.see, lesson.title
    );
    for (i, (step, measured)) in lesson.steps.iter().zip(measured).enumerate() {
        let _ = write!(out, "\n## {}. {}\n\n", i + 1, step.title);
        for paragraph in step.text.split("\n\n") {
            let _ = write!(out, "{}\n\n", glossary::linked(&wrapped(paragraph), "../glossary.md"));
        }
        if let Some(trial) = &step.trial {
            let _ = write!(out, "**Try.** {}\n\n", wrapped(&trial.text));
        }
        if let Some(question) = &step.question {
            let _ = write!(out, "**Question.** {}\n\n", wrapped(&question.ask));
            for choice in &question.choices {
                let right = if measured.all_hold(&choice.holds) { " ✓" } else { "" };
                let _ = writeln!(out, "- {}{right}", wrapped(&choice.text));
            }
            if !question.choices.is_empty() {
                out.push('\n');
            }
            if question.measure.column.is_time() || question.measure.column.is_multiple() {
                out += "The answer depends on the machine: the window measures it.\n\n";
            }
        }
        out += &figures(step, measured);
    }
    out.trim_end().to_string() + "\n"
}

/// Line breaks in the file are none in the text.
fn wrapped(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A table of what was measured.
fn figures(step: &Step, measured: &Measured) -> String {
    let columns: Vec<_> =
        step.asked(step.quantities()).0.into_iter().filter(|c| !c.is_time() && !c.is_multiple()).collect();
    if columns.is_empty() {
        return String::new();
    }
    let mut lines = vec![vec![String::new()]];
    lines[0].extend(columns.iter().map(|c| c.name.to_string()));
    for (whose, record) in &measured.records {
        let mut line = vec![told(*whose, step)];
        line.extend(columns.iter().map(|c| c.rounded(record)));
        lines.push(line);
    }
    let size = measured.of(Whose::Here).map_or([0; 2], |r| [r.width, r.height]);
    format!("{}\nMeasured at {} × {} pixels.\n", table::markdown(&lines), size[0], size[1])
}

fn told(whose: Whose, step: &Step) -> String {
    let side = |i: usize| step.scene.side(i);
    match whose {
        Whose::Side(i) => side(i).map_or(whose.told().into(), |t| format!("`{t}`")),
        _ => whose.told().into(),
    }
}
