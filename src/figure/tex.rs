//! A sheet as a LaTeX snippet.

use super::compose::Sheet;
use super::spec::Width;
use super::write::Format;
use crate::measure::Column;
use std::fmt::Write;

/// Cells of a sheet whose numbers the caption repeats.
const MOST_TOLD: usize = 4;

/// The snippet that shows a sheet's file with its caption and numbers.
pub fn tex(sheet: &Sheet, name: &str, formats: &[Format]) -> String {
    let both = match &sheet.spec.width {
        Width::Journal(name) => name.ends_with("-2"),
        _ => f64::from(sheet.size[0]) / f64::from(sheet.spec.dpi) > 100.0 / 25.4,
    };
    let environment = if both { "figure*" } else { "figure" };
    let width = match &sheet.spec.width {
        Width::Journal(_) if both => "\\textwidth".to_string(),
        Width::Journal(_) => "\\columnwidth".into(),
        // In its own size.
        _ => format!("{:.3}bp", f64::from(sheet.size[0]) * 72.0 / f64::from(sheet.spec.dpi)),
    };
    let ending = if formats.contains(&Format::Pdf) || !formats.contains(&Format::Png) { "pdf" } else { "png" };
    // The caption that is drawn is cut off, since LaTeX sets its own.
    let cut = f64::from(sheet.caption_height) * 72.0 / f64::from(sheet.spec.dpi);
    let trim = if cut > 0.0 { format!(", trim=0 {cut:.3}bp 0 0, clip") } else { String::new() };
    let mut caption = escaped(&sheet.caption);
    // A caption that says where numbers stand has them, and many stand below their pictures alone.
    let placed = sheet.spec.caption.replace("{{", "").contains('{');
    if !placed && sheet.cells.len() <= MOST_TOLD {
        for column in sheet.spec.numbers.iter().filter_map(|id| Column::find(id).ok()) {
            caption += &sentence(sheet, column);
        }
    }
    // A file's name may have what no label has.
    let label = match sheet.spec.label.as_str() {
        "" => format!("fig:{name}").chars().filter(|c| is_of_label(*c)).collect(),
        label => label.to_string(),
    };
    format!(
        "% Needs \\usepackage{{graphicx}}, and a LaTeX of 2018 or newer, which reads UTF-8.\n\\begin{{{environment}}}\n  \\centering\n  \
         \\includegraphics[width={width}{trim}]{{{}}}\n  \\caption{{{}}}\n  \\label{{{label}}}\n\\end{{{environment}}}\n",
        file(&format!("{name}.{ending}")),
        caption.trim()
    )
}

/// Whether LaTeX takes a character of a label for nothing but itself.
pub fn is_of_label(c: char) -> bool {
    c.is_ascii_alphanumeric() || ":-_.+/".contains(c)
}

/// All cells' values of a column as a sentence, row by row.
fn sentence(sheet: &Sheet, column: &Column) -> String {
    let mut out = format!(" {}: ", escaped(column.name));
    let [rows, columns] = sheet.count;
    for row in 0..rows {
        let first = sheet.cell(row, 0);
        if row > 0 {
            out += "; ";
        }
        if !first.labels[1].is_empty() {
            let _ = write!(out, "{}: ", escaped(&first.labels[1]));
        }
        let told = (0..columns).map(|i| sheet.cell(row, i)).filter_map(|cell| {
            let value = escaped(&column.rounded(cell.record.as_ref()?));
            Some(if cell.labels[0].is_empty() { value } else { format!("{} {value}", escaped(&cell.labels[0])) })
        });
        out += &told.collect::<Vec<_>>().join(", ");
    }
    out + "."
}

/// A file's name for \includegraphics: in quotes of its own where it has more than one point or a space.
fn file(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if name.chars().all(plain) && name.matches('.').count() == 1 {
        name.into()
    } else {
        format!("\\detokenize{{{name}}}")
    }
}

/// Text that LaTeX sets as it stands.
pub fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\\' => out += "\\textbackslash{}",
            '~' => out += "\\textasciitilde{}",
            '^' => out += "\\textasciicircum{}",
            '#' | '$' | '%' | '&' | '_' | '{' | '}' => {
                out.push('\\');
                out.push(c);
            }
            '<' => out += "\\textless{}",
            '>' => out += "\\textgreater{}",
            '|' => out += "\\textbar{}",
            '"' => out += "\''",
            '\u{a0}' => out.push('~'),
            '–' => out += "--",
            '−' => out += "$-$",
            '×' => out += "$\\times$",
            '²' => out += "$^2$",
            '³' => out += "$^3$",
            '°' => out += "$^\\circ$",
            'µ' => out += "$\\mu$",
            '≤' => out += "$\\leq$",
            '≥' => out += "$\\geq$",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
