//! `profile`: every pass of techniques, and the bytes that it moves.

use super::{Wanted, failures, interrupt, print, progress, renderer, to_measure};
use crate::frame::{Renderer, SHARED_PASSES};
use crate::gpu::Traffic;
use crate::measure::timing;
use anyhow::{Result, ensure};
use std::fmt::Write;
use std::sync::Arc;

#[derive(clap::Args)]
pub struct Output {
    /// GB that a GPU's memory moves in a second; without it those that this adapter reads and writes as it copies. With it and a software
    /// adapter no times are compared: they are no GPU's.
    #[arg(long, value_name = "GB/S")]
    bandwidth: Option<f64>,
    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// A pass of a technique.
#[derive(serde::Serialize)]
struct Row {
    technique: String,
    pass: String,
    /// Median, milliseconds.
    ms: f64,
    #[serde(flatten)]
    moved: Traffic,
    /// What it moves at the least takes so long at the bandwidth, milliseconds.
    bound_ms: f64,
}

/// What is told: how it was got, and every pass.
#[derive(serde::Serialize)]
struct Profile<'a> {
    adapter: &'a str,
    /// Of the picture, pixels.
    size: [u32; 2],
    /// Bytes a second, read and written, that bounds are at, in GB.
    bandwidth_gb_s: f64,
    passes: &'a [Row],
}

/// Bytes below which a pass waits for nothing that it moves.
const LITTLE: u64 = 100_000;

/// Columns: what a thread reads and writes is a pixel's or a texel's, as the pass goes through one or the other.
const HEAD: &str = "| technique | pass | ms | threads | bytes read a thread | written a thread | MB moved | MB at the least | bound, ms | time / bound |\n\
                    |---|---|---|---|---|---|---|---|---|---|\n";

pub fn run(wanted: Wanted, ids: &[String], output: &Output, adapter: Option<&str>) -> Result<()> {
    let sound = output.bandwidth.is_none_or(|b| b.is_finite() && b > 0.0);
    ensure!(sound, "--bandwidth takes a number above 0: the GB that memory moves in a second");
    let (mut setup, scene, ids, mut failed) = to_measure(wanted, ids)?;
    let mut renderer = renderer(interrupt::device(adapter)?, scene)?;
    // Counting shaders are slow, and so on a device of their own.
    let counting = interrupt::device(adapter)?.count_traffic()?;
    let mut counting = Renderer::new(Arc::new(counting), renderer.scene().clone())?;
    let bandwidth = match output.bandwidth {
        Some(said) => said * 1e9,
        None => timing::bandwidth(&renderer.gpu)?,
    };
    let bar = progress();
    let mut rows = Vec::new();
    for (i, id) in ids.iter().enumerate() {
        setup.select(id)?;
        super::show(&bar, i as f32 / ids.len() as f32, id.clone());
        let measured = timing::time(&mut renderer, std::slice::from_ref(&setup), &mut |_| !interrupt::asked())
            .and_then(|times| Ok((times, timing::traffic(&mut counting, &setup)?)));
        let (times, traffic) = match measured {
            Ok(measured) => measured,
            Err(e) if interrupt::stopped(&e) => {
                bar.finish_and_clear();
                return interrupt::kept(Err(e), || "nothing is told of passes unless all are measured".into());
            }
            Err(e) => {
                failed.push(format!("{id}: {e:#}"));
                continue;
            }
        };
        for (pass, ms) in times.iter().flat_map(|t| &t.passes).filter(|p| !SHARED_PASSES.contains(&p.0.as_str())) {
            let Some((_, moved)) = traffic.iter().find(|(name, _)| name == pass) else { continue };
            let bound_ms = moved.least as f64 / bandwidth * 1e3;
            rows.push(Row { technique: id.clone(), pass: pass.clone(), ms: ms.median, moved: *moved, bound_ms });
        }
    }
    bar.finish_and_clear();
    let adapter = renderer.gpu.info.name.as_str();
    if output.json {
        let bandwidth_gb_s = bandwidth / 1e9;
        let told = Profile { adapter, size: setup.size, bandwidth_gb_s, passes: &rows };
        print(&(serde_json::to_string_pretty(&told)? + "\n"))?;
    } else {
        let [w, h] = setup.size;
        let mut text = format!("{adapter}, {w} × {h} pixels, bounds at {:.1} GB/s.\n\n{HEAD}", bandwidth / 1e9);
        // Times of one machine tell nothing of another one's memory.
        let comparable = !(renderer.gpu.software() && output.bandwidth.is_some());
        for r in &rows {
            let a_thread = |bytes: u64| match r.moved.threads {
                0 => String::new(),
                n => format!("{:.1}", bytes as f64 / n as f64),
            };
            let (read, written) = (a_thread(r.moved.read), a_thread(r.moved.written));
            let threads = if r.moved.threads == 0 { "draw".into() } else { r.moved.threads.to_string() };
            let ratio = match comparable && r.moved.least >= LITTLE {
                true => format!("{:.0}", r.ms / r.bound_ms),
                false => String::new(),
            };
            let [moved, least] = [r.moved.read + r.moved.written, r.moved.least].map(|bytes| bytes as f64 / 1e6);
            writeln!(
                text,
                "| `{}` | {} | {:.3} | {threads} | {read} | {written} | {moved:.1} | {least:.1} | {:.3} | {ratio} |",
                r.technique, r.pass, r.ms, r.bound_ms
            )?;
        }
        print(&text)?;
    }
    failures(&failed, ids.len() + failed.len())
}
