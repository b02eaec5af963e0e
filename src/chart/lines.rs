//! Lines over a common axis, such as error along a path.

use super::canvas::{self, Anchor, BLACK, Canvas, SMALL, Stroke, TITLE, WIDTH};
use super::error_cost::draw_axes;
use super::scale::Scale;
use anyhow::{Result, ensure};
use std::collections::BTreeMap;

/// A chart of lines.
pub struct Lines {
    pub title: String,
    /// What runs along the axis, with its unit.
    pub x: String,
    /// What is drawn above it, with its unit.
    pub y: String,
    /// Values on a logarithmic axis, with a row for zeros.
    pub log_y: bool,
    pub lines: Vec<Line>,
}

/// Label, the technique's [`mark`](super::mark), and points.
pub type Line = (String, usize, Vec<(f64, f64)>);

const MARGIN: f64 = 4.0;
const LEAD: f64 = 9.0;
const HEIGHT: f64 = 118.0;
/// The widest column of labels; longer ones are broken.
const WIDEST: f64 = 74.0;
/// Markers on each line.
const MARKERS: usize = 6;

/// Draws lines as SVG for a column of 84 mm, each labelled at its right end. Points that are no numbers interrupt a line.
///
/// # Errors
/// There is no point to draw.
pub fn lines_svg(chart: &Lines) -> Result<String> {
    let finite = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let all = || chart.lines.iter().flat_map(|l| &l.2).filter(finite);
    ensure!(all().next().is_some(), "{}: there is nothing to draw", chart.title);
    let labels: Vec<Vec<String>> = chart.lines.iter().map(|l| canvas::wrap(&l.0, SMALL, WIDEST)).collect();
    let widest = labels.iter().flatten().map(|l| canvas::text_width(l, SMALL)).fold(0.0, f64::max);
    let needed: f64 = labels.iter().map(|l| l.len() as f64 * LEAD).sum();
    let title = canvas::wrap(&chart.title, TITLE, WIDTH - 2.0 * MARGIN);
    let above = canvas::wrap(&chart.y, SMALL, WIDTH - 2.0 * MARGIN);
    let top = MARGIN + title.len() as f64 * (LEAD + 1.5) + above.len() as f64 * LEAD + 4.0;
    let bottom = top + HEIGHT.max(needed);
    let mut y = Scale::new(all().map(|p| p.1), chart.log_y);
    y.lay(bottom, top);
    let ticks = y.ticks(|_| SMALL);
    let written = ticks.iter().map(|t| canvas::power_width(&t.text, t.exponent)).fold(6.0, f64::max);
    let plot = [MARGIN + written + 5.0, top, WIDTH - MARGIN - widest - 12.0, bottom];
    let mut x = Scale::tight(all().map(|p| p.0));
    x.lay(plot[0], plot[2]);

    let mut c = Canvas::default();
    for (i, line) in title.iter().enumerate() {
        c.text("title", (MARGIN, MARGIN + TITLE - 1.5 + i as f64 * (LEAD + 1.5)), Anchor::Start, TITLE, BLACK, line);
    }
    for (i, line) in above.iter().enumerate() {
        let at = top - 6.0 - (above.len() - 1 - i) as f64 * LEAD;
        c.text("axis", (MARGIN, at), Anchor::Start, SMALL, BLACK, line);
    }
    draw_axes(&mut c, &x, &y, plot);
    let mut below = bottom + 20.0;
    for line in canvas::wrap(&chart.x, SMALL, WIDTH - 2.0 * MARGIN) {
        c.text("axis", ((plot[0] + plot[2]) / 2.0, below), Anchor::Middle, SMALL, BLACK, &line);
        below += LEAD;
    }

    let mut nth: BTreeMap<usize, usize> = BTreeMap::new();
    let mut ends = Vec::new();
    let at = |p: &(f64, f64)| (x.at(p.0), y.at(p.1));
    for (i, (_, place, points)) in chart.lines.iter().enumerate() {
        let again = nth.entry(*place).and_modify(|n| *n += 1).or_insert(0);
        let color = canvas::color(*place);
        for run in points.split(|p| !finite(&p)).filter(|r| !r.is_empty()) {
            let run: Vec<_> = run.iter().map(at).collect();
            c.line("line", &run, &Stroke { color: &color, width: 1.0, dash: canvas::dash(*again) });
        }
        if let Some(last) = points.iter().rev().find(finite) {
            ends.push((i, at(last)));
        }
    }
    // Markers of different lines at different places, so that lines on one another are told apart.
    for (i, (label, place, points)) in chart.lines.iter().enumerate() {
        let shown: Vec<_> = points.iter().filter(finite).collect();
        let count = MARKERS.min(shown.len());
        for m in 0..count {
            let share = (m as f64 + (i as f64 + 0.5) / chart.lines.len() as f64) / count as f64;
            c.marker("point", *place, at(shown[(share * shown.len() as f64) as usize]), label);
        }
    }
    // Labels in the order of the lines' ends, pushed apart around where they want to be.
    ends.sort_by(|a, b| a.1.1.total_cmp(&b.1.1).then(a.0.cmp(&b.0)));
    let heights: Vec<f64> = ends.iter().map(|(i, _)| labels[*i].len() as f64 * LEAD).collect();
    let wanted: Vec<f64> = ends.iter().zip(&heights).map(|((_, end), h)| end.1 - h / 2.0).collect();
    for ((i, end), y0) in ends.iter().zip(apart(&wanted, &heights, top, bottom)) {
        let place = chart.lines[*i].1;
        let ink = canvas::ink(place);
        let middle = y0 + labels[*i].len() as f64 * LEAD / 2.0;
        c.line(
            "thread",
            &[*end, (plot[2] + 2.0, end.1), (plot[2] + 6.0, middle), (plot[2] + 9.0, middle)],
            &Stroke::solid(&ink, 0.4),
        );
        for (n, line) in labels[*i].iter().enumerate() {
            let base = y0 + (n as f64 + 1.0) * LEAD - 2.0;
            c.text("label", (plot[2] + 11.0, base), Anchor::Start, SMALL, &ink, line);
        }
    }
    Ok(c.finish(&format!("{}: {}", chart.title, chart.y), below - LEAD + MARGIN + 2.0))
}

/// Starts of boxes in a row that keep their order and do not overlap, near where they are wanted: boxes that touch form
/// groups, each around the mean of its wishes.
fn apart(wanted: &[f64], heights: &[f64], low: f64, high: f64) -> Vec<f64> {
    // First box, sum of (wish − offset in the group), boxes, height.
    let mut groups: Vec<(usize, f64, usize, f64)> = Vec::new();
    let start = |g: &(usize, f64, usize, f64)| (g.1 / g.2 as f64).clamp(low, (high - g.3).max(low));
    for (i, (w, h)) in wanted.iter().zip(heights).enumerate() {
        let mut group = (i, *w, 1, *h);
        while let Some(before) = groups.last().copied().filter(|b| start(b) + b.3 > start(&group)) {
            groups.pop();
            group = (before.0, before.1 + group.1 - group.2 as f64 * before.3, before.2 + group.2, before.3 + group.3);
        }
        groups.push(group);
    }
    let mut out = Vec::new();
    for g in &groups {
        let mut at = start(g);
        for h in &heights[g.0..g.0 + g.2] {
            out.push(at);
            at += h;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::apart;

    #[test]
    fn labels_are_pushed_apart_and_stay_inside() {
        assert_eq!(apart(&[10.0, 50.0], &[9.0, 9.0], 0.0, 100.0), [10.0, 50.0]);
        assert_eq!(apart(&[50.0, 50.0], &[10.0, 10.0], 0.0, 100.0), [45.0, 55.0]);
        assert_eq!(apart(&[95.0, 95.0, 20.0 + 75.0], &[10.0; 3], 0.0, 100.0), [70.0, 80.0, 90.0]);
        assert_eq!(apart(&[-5.0, -5.0], &[10.0, 10.0], 0.0, 100.0), [0.0, 10.0]);
    }
}
