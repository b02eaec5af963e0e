//! Measured rows as text, CSV and JSON.

use super::Row;
use crate::gpu::Gpu;
use serde_json::json;

/// The rows as JSON; the adapter is named, and whether it is software.
pub fn json(gpu: &Gpu, rows: &[Row]) -> serde_json::Value {
    let rows: Vec<_> = rows
        .iter()
        .map(|r| {
            let e = &r.errors;
            let boundary = e.boundary.map(|b| json!({"median": b.median, "p95": b.p95, "max": b.max}));
            let passes: Vec<_> = r
                .times
                .passes
                .iter()
                .map(|(name, q)| json!({"name": name, "median": q.median, "q1": q.q1, "q3": q.q3}))
                .collect();
            json!({
                "technique": r.technique, "params": r.params, "facing": e.facing,
                "lit_correct": e.lit_correct, "lit_incorrect": e.lit_incorrect,
                "shadow_correct": e.shadow_correct, "shadow_incorrect": e.shadow_incorrect,
                "away": e.away, "background": e.background,
                "rmse": e.rmse, "boundary_px": boundary, "gpu_ms": r.times.gpu,
                "wall_clock": r.times.wall_clock, "passes": passes,
                "cpu_ms": r.times.cpu_ms, "gpu_bytes": r.gpu_bytes, "notes": r.notes,
            })
        })
        .collect();
    json!({"adapter": gpu.info.name, "driver": gpu.info.driver_info, "software": gpu.software(), "rows": rows})
}

/// The rows as CSV, a line a technique; parameters as `name=value` lists, passes as
/// `name=median|q1|q3`.
pub fn csv(gpu: &Gpu, rows: &[Row]) -> String {
    let mut out = String::from(
        "adapter,software,technique,params,facing,lit_correct,lit_incorrect,shadow_correct,shadow_incorrect,away,\
         background,rmse,boundary_median_px,boundary_p95_px,boundary_max_px,gpu_ms_median,gpu_ms_q1,gpu_ms_q3,frames,\
         passes,cpu_ms,gpu_bytes\n",
    );
    for r in rows {
        let e = &r.errors;
        let params: Vec<String> = r.params.iter().map(|(k, v)| format!("{k}={v}")).collect();
        let passes: Vec<String> =
            r.times.passes.iter().map(|(n, q)| format!("{n}={}|{}|{}", q.median, q.q1, q.q3)).collect();
        let b = e.boundary.map_or(",,".into(), |b| format!("{},{},{}", b.median, b.p95, b.max));
        let t = &r.times.gpu;
        out += &format!(
            "\"{}\",{},{},\"{}\",{},{},{},{},{},{},{},{},{b},{},{},{},{},\"{}\",{},{}\n",
            gpu.info.name.replace('"', "'"),
            gpu.software(),
            r.technique,
            params.join(";"),
            e.facing,
            e.lit_correct,
            e.lit_incorrect,
            e.shadow_correct,
            e.shadow_incorrect,
            e.away,
            e.background,
            e.rmse,
            t.median,
            t.q1,
            t.q3,
            t.frames,
            passes.join(";"),
            r.times.cpu_ms,
            r.gpu_bytes
        );
    }
    out
}

/// The rows as a table for people, with what must be known to read it.
pub fn text(gpu: &Gpu, rows: &[Row]) -> String {
    let mut lines = vec![
        [
            "technique",
            "facing",
            "lit ok",
            "lit wrong",
            "shadow ok",
            "shadow wrong",
            "away",
            "backgr.",
            "error %",
            "RMSE",
        ]
        .into_iter()
        .chain(["px off, median/p95/max", "GPU ms", "quartiles", "frames", "CPU ms", "MiB"])
        .map(String::from)
        .collect::<Vec<_>>(),
    ];
    for r in rows {
        let (e, t) = (&r.errors, &r.times.gpu);
        lines.push(vec![
            r.technique.clone(),
            e.facing.to_string(),
            e.lit_correct.to_string(),
            e.lit_incorrect.to_string(),
            e.shadow_correct.to_string(),
            e.shadow_incorrect.to_string(),
            e.away.to_string(),
            e.background.to_string(),
            format!("{:.4}", e.share() * 100.0),
            format!("{:.5}", e.rmse),
            e.boundary.map_or("-".into(), |b| format!("{:.1}/{:.1}/{:.1}", b.median, b.p95, b.max)),
            format!("{:.3}", t.median),
            format!("{:.3}-{:.3}", t.q1, t.q3),
            t.frames.to_string(),
            format!("{:.3}", r.times.cpu_ms),
            format!("{:.2}", r.gpu_bytes as f64 / 1048576.0),
        ]);
    }
    let widths: Vec<usize> = (0..lines[0].len()).map(|c| lines.iter().map(|l| l[c].len()).max().unwrap_or(0)).collect();
    let mut out = format!("adapter: {}{}\n", gpu.info.name, if gpu.software() { " (software)" } else { "" });
    for line in &lines {
        let cells = line.iter().zip(&widths).enumerate();
        let cells = cells.map(|(i, (c, w))| if i == 0 { format!("{c:<w$}") } else { format!("{c:>w$}") });
        out += cells.collect::<Vec<_>>().join("  ").trim_end();
        out.push('\n');
    }
    for r in rows {
        out += &format!("{} passes, ms:", r.technique);
        for (name, q) in &r.times.passes {
            out += &format!("  {name} {:.3} ({:.3}-{:.3})", q.median, q.q1, q.q3);
        }
        out.push('\n');
        for note in &r.notes {
            out += &format!("{}: {note}\n", r.technique);
        }
    }
    if rows.iter().any(|r| r.times.wall_clock) {
        out += "Times are wall clock, each pass submitted alone: this adapter's timestamps cannot be trusted.\n";
    }
    if gpu.software() {
        out += "This adapter is software: compare its times as ratios only; they say nothing of a GPU.\n";
    }
    out
}
