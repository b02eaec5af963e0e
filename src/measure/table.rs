//! Measured rows as a table for people.

use super::{Record, tied};
use crate::chart;

/// The rows with what must be known to read them.
pub fn text(rows: &[Record]) -> String {
    let names = [
        "technique",
        "facing",
        "lit ok",
        "lit wrong",
        "shadow ok",
        "shadow wrong",
        "away",
        "outside",
        "backgr.",
        "error %",
        "RMSE",
        "MAE",
        "max",
        "off > 0.1, %",
        "FLIP",
        "px off, median/p95/max",
        "contours, px",
        "flicker, %",
        "GPU ms",
        "quartiles",
        "frames",
        "× same-size plain map",
        "CPU ms",
        "MiB",
    ];
    let count = |n: Option<u64>| n.map_or("-".into(), |n| n.to_string());
    let of = |part: Option<u64>, whole: Option<u64>| match (part, whole) {
        (Some(part), Some(whole)) => format!("{part} of {whole}"),
        _ => "-".into(),
    };
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.2}"));
    let mut lines = vec![names.map(String::from).to_vec()];
    for r in rows {
        let edge = match (r.boundary_median_px, r.boundary_p95_px, r.boundary_max_px) {
            (Some(median), Some(p95), Some(max)) => format!("{median:.1}/{p95:.1}/{max:.1}"),
            _ => "-".into(),
        };
        lines.push(vec![
            r.technique.clone(),
            r.facing.to_string(),
            r.lit_correct.to_string(),
            r.lit_incorrect.to_string(),
            r.shadow_correct.to_string(),
            r.shadow_incorrect.to_string(),
            r.away.to_string(),
            r.outside.to_string(),
            r.background.to_string(),
            format!("{:.4}", r.error_share * 100.0),
            format!("{:.5}", r.rmse),
            format!("{:.5}", r.mae),
            format!("{:.3}", r.max_error),
            format!("{:.3}", r.beyond_tolerance * 100.0),
            format!("{:.5}", r.flip),
            edge,
            number(r.contour_mean_px),
            r.flicker.map_or("-".into(), |f| format!("{:.3}", f * 100.0)),
            format!("{:.3}", r.gpu_ms),
            format!("{:.3}-{:.3}", r.gpu_ms_q1, r.gpu_ms_q3),
            r.frames.to_string(),
            match (r.ratio, r.ratio_resolution) {
                (Some(ratio), Some(resolution)) => format!("{ratio:.2} ({resolution}²)"),
                _ => "-".into(),
            },
            format!("{:.3}", r.cpu_ms),
            format!("{:.2}", r.gpu_bytes as f64 / 1048576.0),
        ]);
    }
    let mut needs = vec![
        [
            "needs",
            "views",
            "texels covered",
            "triangles drawn",
            "fragments",
            "rays",
            "m median/p95/max",
            "texel area",
            "stretch",
            "long/short, p95",
            "folds",
            "texel use",
            "samples per texel",
        ]
        .map(String::from)
        .to_vec(),
    ];
    for r in rows {
        needs.push(vec![
            r.technique.clone(),
            of(r.views_needed, r.views_rendered),
            of(r.texels_covered, r.texels),
            of(r.triangles_drawn, r.triangles_submitted),
            count(r.fragments),
            format!("{} of {} pixels", r.rays, r.facing),
            format!("{}/{}/{}", number(r.m_p50), number(r.m_p95), number(r.m_max)),
            number(r.texel_area_p95),
            number(r.stretch_p95),
            number(r.anisotropy_p95),
            count(r.folds),
            r.utilisation.map_or("-".into(), |u| format!("{:.1} %", u * 100.0)),
            format!("{} (largest {})", number(r.count_mean), count(r.count_max)),
        ]);
    }
    let mut out = String::new();
    if let Some(r) = rows.first() {
        let software = if r.software { ", software" } else { "" };
        out += &format!("adapter: {} ({}{software})\n", r.adapter, r.driver);
    }
    out += &aligned(&lines);
    if let Some(r) = rows.first() {
        out += &format!(
            "Counts, error % and px off are against one sample per pixel; RMSE, MAE, max, off > 0.1 and FLIP against {}.\n",
            if r.truth_samples > 1 { format!("the mean of {}", r.truth_samples) } else { "the same".into() }
        );
    }
    out += "\n";
    out += &aligned(&needs);
    out += "\n";
    let lights = per_light(rows);
    if lights.len() > 1 {
        out += &aligned(&lights);
        out += "In the rows of all lights, errors are over the pixels of each light that can be wrong.\n\n";
    }
    for r in rows {
        out += &format!("{} passes, ms:", r.technique);
        for (name, times) in r.passes.split(';').filter_map(|p| p.split_once('=')) {
            let numbers: Vec<&str> = times.split('|').collect();
            if let [median, q1, q3] = numbers[..] {
                out += &format!("  {name} {median} ({q1}-{q3})");
            }
        }
        out.push('\n');
        if let (Some(rmse), Some(lag)) = (r.settle_rmse, r.lag_frames) {
            let settles = match r.settle_frames {
                Some(frames) => format!("settles in {frames} frames, to an RMSE of {rmse:.5}"),
                None => format!("has not settled after 64 frames, at an RMSE of {rmse:.5}"),
            };
            out +=
                &format!("{} {settles}; it lags {lag} frames behind a light that turns by 0.4° a frame\n", r.technique);
        }
        if let (Some(seeds), Some(noise), Some(bias)) = (r.seeds, r.seed_noise, r.seed_bias) {
            out += &format!("{} over {seeds} seeds: noise {noise:.5}, bias {bias:.5}\n", r.technique);
        }
        if let Some(error) = r.truth_error.filter(|e| r.rmse < *e) {
            out += &format!(
                "{}: the RMSE lies below what {} samples leave of the truth's own noise, {error:.5}; more samples would tell\n",
                r.technique, r.truth_samples
            );
        }
        if !r.notes.is_empty() {
            out += &format!("{}: {}\n", r.technique, r.notes);
        }
    }
    for (i, a) in rows.iter().enumerate() {
        for b in rows[i + 1..].iter().filter(|b| tied(a, b)) {
            out +=
                &format!("{} and {} are tied: these frames cannot tell their times apart.\n", a.technique, b.technique);
        }
    }
    if let Some(busy) = chart::busy(rows) {
        out += &format!("{busy}\n");
    }
    if rows.iter().any(|r| r.wall_clock) {
        out += "Times are wall clock, each pass submitted alone: this adapter's timestamps cannot be trusted.\n";
    }
    if rows.iter().any(|r| r.software) {
        out += "This adapter is software: compare its times as ratios only; they say nothing of a GPU.\n";
    }
    out
}

/// The rows' figures light by light, each row's sum behind them; the first line names the columns, and is alone where no row has
/// several lights.
pub fn per_light(rows: &[Record]) -> Vec<Vec<String>> {
    let names = ["technique", "light", "facing", "wrong", "error %", "RMSE", "GPU ms", "MiB"];
    let mut lines = vec![names.map(String::from).to_vec()];
    for r in rows {
        let mut line = |light: String, facing: u64, wrong: u64, [share, rmse, ms]: [f64; 3], bytes: u64| {
            let (share, rmse) = (format!("{:.4}", 100.0 * share), format!("{rmse:.5}"));
            let (ms, mib) = (format!("{ms:.3}"), format!("{:.2}", bytes as f64 / 1048576.0));
            lines.push(vec![r.technique.clone(), light, facing.to_string(), wrong.to_string(), share, rmse, ms, mib]);
        };
        let lights = r.per_light();
        for l in &lights {
            let figures = [l.error_share(), l.rmse, l.gpu_ms];
            line(format!("{} {}", l.number, l.kind), l.facing, l.wrong, figures, l.gpu_bytes);
        }
        if !lights.is_empty() {
            let wrong = (r.lit_incorrect + r.shadow_incorrect) as u64;
            line("all".into(), r.facing as u64, wrong, [r.error_share, r.rmse, r.gpu_ms], r.gpu_bytes);
        }
    }
    lines
}

/// Cells in columns: the first to the left, the others to the right.
pub fn aligned(lines: &[Vec<String>]) -> String {
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| lines.iter().filter_map(|l| l.get(c)).map(|s| s.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = String::new();
    for line in lines {
        let cells = line.iter().zip(&widths).enumerate();
        let cells = cells.map(|(i, (c, &w))| if i == 0 { format!("{c:<w$}") } else { format!("{c:>w$}") });
        out += cells.collect::<Vec<_>>().join("  ").trim_end();
        out.push('\n');
    }
    out
}

/// A Markdown table; the first line names the columns.
pub fn markdown(lines: &[Vec<String>]) -> String {
    let mut out = String::new();
    for (i, line) in lines.iter().enumerate() {
        out += &format!("| {} |\n", line.join(" | "));
        if i == 0 {
            out += &format!("|{}\n", "---|".repeat(line.len()));
        }
    }
    out
}
