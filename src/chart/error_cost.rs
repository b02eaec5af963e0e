//! The chart of error against cost.

use super::canvas::{self, Anchor, BLACK, Canvas, GREY, MARKER, SMALL, Stroke, TITLE, WIDTH};
use super::labels::{Found, Point, Room, Wish, arrange};
use super::scale::{Scale, Tick, short};
use super::{Axis, Series, Spot, busy, front, main_parameter, main_value, mark, point, series, spot};
use crate::measure::Record;
use anyhow::{Result, ensure};
use std::collections::BTreeSet;

/// Space around the chart, points.
const MARGIN: f64 = 4.0;
/// From one line of text to the next.
const LEAD: f64 = 9.0;
/// Height of a label.
const LABEL: f64 = 7.6;
/// Heights of the plot, tried in turn until every label finds room, points.
const HEIGHTS: [f64; 4] = [128.0, 150.0, 180.0, 220.0];
/// Cost of a label's place from which a higher chart is tried.
const POOR: f64 = 22.0;
/// With more lines than this only those on the Pareto front, and one of each technique, are labelled.
const MOST_LABELS: usize = 12;
/// With more labelled lines than this the values at their ends are written only where there is ample room.
const MOST_NUMBERED: usize = 8;

/// With more points than this those within a point of another one of their line are one for labels.
const MANY: usize = 1000;
/// Places beside which a label is tried, and numbers that stand on a line, at most.
const MOST_PLACES: usize = 48;

/// At most [`MOST_PLACES`] of a range, evenly, the first and the last among them.
fn spread(of: std::ops::Range<usize>) -> impl DoubleEndedIterator<Item = usize> {
    let count = of.len().min(MOST_PLACES);
    (0..count).map(move |n| of.start + n * (of.len() - 1) / (count - 1).max(1))
}

/// A label that has found its place.
struct Label {
    found: Found,
    class: &'static str,
    color: String,
    text: String,
}

/// Everything that has its place on the page.
struct Layout {
    x: Scale,
    y: Scale,
    /// Left, top, right, bottom of the plot.
    plot: [f64; 4],
    points: Vec<Point>,
    front: Vec<Point>,
}

/// Draws error against cost, both logarithmic, as SVG for a column of 84 mm: a point a record, a line a series with its
/// label beside it, the Pareto front as a grey stair. Zeros stand in a row or column of their own before a break of the
/// axis. Records without a value on one of the axes are left out. The order of the records does not matter.
///
/// # Errors
/// No record has a value on both axes.
pub fn svg(records: &[Record], x: &Axis, y: &Axis, title: &str) -> Result<String> {
    drawn(records, x, y, title, false)
}

/// As [`svg`], but with one line a technique: its own front over all of its parameters. The rest are faint points.
///
/// # Errors
/// As [`svg`].
pub fn fronts_svg(records: &[Record], x: &Axis, y: &Axis, title: &str) -> Result<String> {
    drawn(records, x, y, title, true)
}

fn drawn(records: &[Record], x: &Axis, y: &Axis, title: &str, fronts: bool) -> Result<String> {
    let mut rows: Vec<Record> = records.iter().filter(|r| point(r, x, y).is_some()).cloned().collect();
    ensure!(!rows.is_empty(), "there is nothing to draw: no row has a value for both {} and {}", x.id, y.id);
    rows.sort_by_cached_key(|r| serde_json::to_string(r).unwrap_or_default());
    let values: Vec<Point> = rows.iter().filter_map(|r| point(r, x, y)).collect();
    let spots: Vec<Spot> = rows.iter().filter_map(|r| spot(r, x, y)).collect();
    let front = front(x, &spots);
    let (lines, named) = if fronts {
        let (mut lines, rest) = super::fronts(&rows, x, y);
        let named = (0..lines.len()).collect();
        lines.extend(rest);
        (lines, named)
    } else {
        let lines = series(&rows);
        let named = named(&lines, &front);
        (lines, named)
    };
    let title = canvas::wrap(title, TITLE, WIDTH - 2.0 * MARGIN);
    let top = MARGIN + title.len() as f64 * (LEAD + 1.5) + LEAD + 4.0;
    let lay = |height: f64| {
        let layout = Layout::new(&values, &front, top, height);
        let (labels, missing) = layout.labels(&rows, &lines, &named, x);
        (layout, labels, missing)
    };
    // Higher only where that lets more labels in.
    let (mut layout, mut labels, mut missing) = lay(HEIGHTS[0]);
    for height in &HEIGHTS[1..] {
        if missing > 0 {
            let higher = lay(*height);
            if higher.2 < missing {
                (layout, labels, missing) = higher;
            }
        }
    }
    let mut c = Canvas::default();
    layout.draw(&mut c, &rows, (&lines, &named), [x, y], &labels);
    let mut below = layout.plot[3] + 22.5;
    let heading = |i: usize| (MARGIN, MARGIN + TITLE - 1.5 + i as f64 * (LEAD + 1.5));
    for (i, line) in title.iter().enumerate() {
        c.text("title", heading(i), Anchor::Start, TITLE, BLACK, line);
    }
    c.text("axis", heading(title.len()), Anchor::Start, SMALL, BLACK, y.title);
    for note in notes(&rows, x, lines.len() - named.len(), fronts) {
        for line in canvas::wrap(&note, SMALL, WIDTH - 2.0 * MARGIN) {
            below += LEAD;
            c.text("note", (MARGIN, below), Anchor::Start, SMALL, GREY, &line);
        }
    }
    Ok(c.finish(&format!("{} against {}", y.title, x.title), below + MARGIN))
}

/// The lines that are labelled.
fn named(lines: &[Series], front: &[usize]) -> BTreeSet<usize> {
    let mut techniques = BTreeSet::new();
    let best = |s: &Series| s.points.iter().any(|p| front.contains(p));
    let mut out: BTreeSet<usize> =
        (0..lines.len()).filter(|i| lines.len() <= MOST_LABELS || best(&lines[*i])).collect();
    techniques.extend(out.iter().map(|i| lines[*i].technique.as_str()));
    for (i, s) in lines.iter().enumerate() {
        if techniques.insert(&s.technique) {
            out.insert(i);
        }
    }
    out
}

/// What must be known to read the chart, in sentences.
fn notes(rows: &[Record], x: &Axis, unnamed: usize, fronts: bool) -> Vec<String> {
    let all = |f: &dyn Fn(&Record) -> String| {
        rows.iter().map(f).collect::<BTreeSet<String>>().into_iter().collect::<Vec<_>>()
    };
    let numbers: Vec<&str> = all(&|r| main_parameter(&r.technique).unwrap_or_default().to_string())
        .iter()
        .filter_map(|n| rows.iter().filter_map(|r| main_parameter(&r.technique)).find(|m| m == n))
        .collect();
    let mut how = Vec::new();
    if !numbers.is_empty() {
        how.push(format!("Numbers at points: {}.", numbers.join(", ")));
    }
    if x.id == "gpu_ms" {
        how.push("Whiskers: quartiles of the frames; the front counts times whose quartiles overlap as equal.".into());
    }
    if ["gpu_ms", "cost", "ratio"].contains(&x.id) {
        how.extend(busy(rows));
    }
    if fronts {
        how.push(format!("Lines: each technique's own front. Faint: {unnamed} configurations off it."));
    } else if unnamed > 0 {
        how.push(format!("Faint: {unnamed} lines away from the front, not labelled."));
    }
    let software = match (rows.iter().any(|r| r.software), x.id) {
        (true, "gpu_ms") => ", software: compare as ratios only",
        (true, _) => ", software",
        _ => "",
    };
    let scenes = all(&|r| format!("{}, {} × {} pixels", r.scene, r.width, r.height));
    let who = all(&|r| r.adapter.clone());
    vec![how.join(" "), format!("{}. {}{software}.", scenes.join("; "), who.join("; "))]
}

impl Layout {
    fn new(values: &[Point], front: &[usize], top: f64, height: f64) -> Layout {
        let mut x = Scale::new(values.iter().map(|v| v.0), true);
        let mut y = Scale::new(values.iter().map(|v| v.1), true);
        y.lay(top + height, top);
        let widest = y.ticks(|_| SMALL).iter().map(|t| canvas::power_width(&t.text, t.exponent)).fold(6.0, f64::max);
        let mut plot = [MARGIN + widest + 5.0, top, WIDTH - 10.0, top + height];
        x.lay(plot[0], plot[2]);
        // The last number is not cut off by the page's edge.
        let reach = |t: &Tick| t.at + canvas::power_width(&t.text, t.exponent) / 2.0;
        let over = x.ticks(|t| canvas::power_width(&t.text, t.exponent)).last().map_or(0.0, reach) - (WIDTH - 1.0);
        if over > 0.0 {
            plot[2] -= over;
            x.lay(plot[0], plot[2]);
        }
        let points: Vec<Point> = values.iter().map(|v| (x.at(v.0), y.at(v.1))).collect();
        // The border of what some point beats: down to each point of the front, and on to the next.
        let mut stair = Vec::new();
        for i in front {
            let p = points[*i];
            stair.push((p.0, stair.last().map_or(top, |l: &Point| l.1)));
            stair.push(p);
        }
        if let Some(l) = stair.last().copied() {
            stair.push((plot[2], l.1));
        }
        Layout { x, y, plot, points, front: stair }
    }

    /// Places the labels; counts those that found no room.
    fn labels(&self, rows: &[Record], lines: &[Series], named: &BTreeSet<usize>, x: &Axis) -> (Vec<Label>, usize) {
        let [left, top, right, bottom] = self.plot;
        let mut room = Room {
            bounds: [left + 1.5, top - 2.0, right + 8.0, bottom - 1.5],
            markers: vec![],
            segments: vec![],
            taken: vec![],
        };
        for (i, line) in lines.iter().enumerate() {
            room.markers.extend(line.points.iter().map(|p| (self.points[*p], i)));
            room.segments.extend(line.points.windows(2).map(|p| (self.points[p[0]], self.points[p[1]], 1.2)));
        }
        // Of very many in one place labels need keep off few.
        if room.markers.len() > MANY {
            let mut places = BTreeSet::new();
            room.markers.retain(|((x, y), i)| places.insert((*i, x.round() as i64, y.round() as i64)));
            room.segments.retain(|(a, b, _)| (a.0 - b.0).hypot(a.1 - b.1) > 1.0);
        }
        room.segments.extend(self.front.windows(2).map(|p| (p[0], p[1], 0.25)));
        for (i, _, [a, b]) in self.whiskers(rows, x) {
            room.segments.push(((a, self.points[i].1), (b, self.points[i].1), 1.2));
        }
        let text_size = |text: &str| (canvas::text_width(text, SMALL), LABEL);
        // Names stand at a line's end, else at its start, else anywhere on it.
        let mut wishes = Vec::new();
        let mut texts = Vec::new();
        for i in named {
            let (at, label) = (&lines[*i].points, &lines[*i].label);
            let price = |n: usize| {
                if n + 1 == at.len() {
                    0.0
                } else if n == 0 {
                    1.5
                } else {
                    3.0
                }
            };
            let beside = spread(0..at.len()).rev().map(|n| (self.points[at[n]], price(n))).collect();
            wishes.push(Wish { owner: *i, size: text_size(label), beside, reach: 90.0 });
            texts.push(label.clone());
        }
        // Numbers stand close to their points: those at the ends in any case, those between where there is room.
        let number = |i: usize, p: usize, reach: f64| {
            let value = main_value(&rows[p])?;
            let text = value.parse::<f64>().map_or(value.to_string(), short);
            Some((Wish { owner: i, size: text_size(&text), beside: vec![(self.points[p], 0.0)], reach }, text))
        };
        for i in named {
            let at = &lines[*i].points;
            let mut ends = vec![at[0], at[at.len() - 1]];
            ends.dedup();
            for (wish, text) in ends.into_iter().filter_map(|p| number(*i, p, 7.5)) {
                wishes.push(wish);
                texts.push(text);
            }
        }
        let (mut out, mut missing) = (Vec::new(), 0);
        let label = |found, class, i: usize, text| {
            let color = canvas::ink(mark(&lines[i].technique));
            Label { found, class, color, text }
        };
        let found = arrange(&room, &wishes);
        // Of many lines each would have the same numbers.
        let enough = if named.len() > MOST_NUMBERED { 3.0 } else { 25.0 };
        for (n, (f, text)) in found.into_iter().zip(texts).enumerate() {
            let (class, worst) = if n < named.len() { ("label", f64::INFINITY) } else { ("value", enough) };
            if f.cost < worst {
                room.taken.push(f.rect);
                out.push(label(f, class, wishes[n].owner, text));
            }
            missing += (f.cost >= worst.min(POOR)) as usize;
        }
        // A name far away hangs on a thread, which the other numbers keep off too.
        room.segments.extend(out.iter().filter_map(Label::thread).map(|(a, b)| (a, b, 1.2)));
        for i in named {
            let at = &lines[*i].points;
            for n in spread(1..at.len().saturating_sub(1)).rev() {
                let Some((wish, text)) = number(*i, at[n], 5.0) else { continue };
                let f = room.find(&wish);
                if f.cost < 3.0 {
                    room.taken.push(f.rect);
                    out.push(label(f, "value", *i, text));
                }
            }
        }
        let corners = spread(0..self.front.len()).map(|n| (self.front[n], 0.0)).collect();
        let f = room.find(&Wish { owner: usize::MAX, size: text_size(FRONT), beside: corners, reach: 5.0 });
        if f.cost < 12.0 && !self.front.is_empty() {
            out.push(Label { found: f, class: "value", color: GREY.into(), text: FRONT.into() });
        }
        (out, missing)
    }

    fn draw(
        &self,
        c: &mut Canvas,
        rows: &[Record],
        (lines, named): (&[Series], &BTreeSet<usize>),
        [x, y]: [&Axis; 2],
        labels: &[Label],
    ) {
        draw_axes(c, &self.x, &self.y, self.plot);
        let [left, _, right, bottom] = self.plot;
        c.text("axis", ((left + right) / 2.0, bottom + 20.0), Anchor::Middle, SMALL, BLACK, x.title);
        c.line("front", &self.front, &Stroke::solid("#d0d0d0", 2.6));
        let faint: Vec<usize> = (0..lines.len()).filter(|i| !named.contains(i)).collect();
        if !faint.is_empty() {
            c.faint(|c| self.lines(c, rows, lines, &faint, [x, y]));
        }
        let bold: Vec<usize> = named.iter().copied().collect();
        for (i, r, ends) in self.whiskers(rows, x) {
            if bold.iter().any(|n| lines[*n].points.contains(&i)) {
                let (at, color) = (self.points[i].1, canvas::color(mark(&r.technique)));
                let thin = Stroke::solid(&color, 0.7);
                c.line("whisker", &[(ends[0], at), (ends[1], at)], &thin);
                for end in ends {
                    c.line("whisker", &[(end, at - 1.6), (end, at + 1.6)], &thin);
                }
            }
        }
        self.lines(c, rows, lines, &bold, [x, y]);
        for l in labels {
            if let Some((from, to)) = l.thread() {
                c.line("thread", &[from, to], &Stroke::solid(&l.color, 0.4));
            }
        }
        for l in labels {
            c.sheet(l.found.rect);
            let [x0, _, x1, y1] = l.found.rect;
            c.text(l.class, ((x0 + x1) / 2.0, y1 - 1.8), Anchor::Middle, SMALL, &l.color, &l.text);
        }
    }

    /// Some of the lines, their markers on top.
    fn lines(&self, c: &mut Canvas, rows: &[Record], lines: &[Series], which: &[usize], [x, y]: [&Axis; 2]) {
        for i in which {
            let before = lines[..*i].iter().filter(|s| s.technique == lines[*i].technique).count();
            self.series(c, rows, &lines[*i], [x, y], before);
        }
        for s in which.iter().map(|i| &lines[*i]) {
            for i in &s.points {
                let r = &rows[*i];
                let value = |a: &Axis| format!("{}: {}", a.title, a.of(r).map_or("-".into(), short));
                let told = format!("{}: {}\n{}\n{}", s.label, r.params.replace(';', ", "), value(x), value(y));
                c.marker("point", mark(&r.technique), self.points[*i], &told);
            }
        }
    }

    /// One line; what leads to a zero is dotted, as its slope means nothing.
    fn series(&self, c: &mut Canvas, rows: &[Record], s: &Series, [x, y]: [&Axis; 2], nth: usize) {
        let color = canvas::color(mark(&s.technique));
        let at_zero = |i: &usize| point(&rows[*i], x, y).map(|p| (p.0 == 0.0, p.1 == 0.0));
        let mut run: Vec<Point> = Vec::new();
        let mut runs = Vec::new();
        for (n, i) in s.points.iter().enumerate() {
            if n > 0 && at_zero(i) != at_zero(&s.points[n - 1]) {
                let ends = [self.points[s.points[n - 1]], self.points[*i]];
                c.line("line", &ends, &Stroke { color: &color, width: 0.7, dash: "0.7 1.6" });
                runs.push(std::mem::take(&mut run));
            }
            run.push(self.points[*i]);
        }
        runs.push(run);
        for run in runs.iter().filter(|r| r.len() > 1) {
            c.line("line", run, &Stroke { color: &color, width: 1.0, dash: canvas::dash(nth) });
        }
    }

    /// The quartiles of every time, along the axis of time, with the record and its number.
    fn whiskers<'a>(&self, rows: &'a [Record], x: &Axis) -> Vec<(usize, &'a Record, [f64; 2])> {
        let has = |r: &&Record| x.id == "gpu_ms" && r.gpu_ms_q1 > 0.0 && r.gpu_ms_q3 > r.gpu_ms_q1;
        let along = |r: &Record| [r.gpu_ms_q1, r.gpu_ms_q3].map(|v| self.x.at(v).clamp(self.plot[0], self.plot[2]));
        rows.iter().enumerate().filter(|(_, r)| has(r)).map(|(i, r)| (i, r, along(r))).collect()
    }
}

/// The name of the grey stair.
const FRONT: &str = "Pareto front";

/// Grid, axes with their breaks, and what is written beside them.
pub fn draw_axes(c: &mut Canvas, x: &Scale, y: &Scale, [left, top, right, bottom]: [f64; 4]) {
    let across = x.ticks(|t| canvas::power_width(&t.text, t.exponent));
    let up = y.ticks(|_| SMALL);
    for t in &across {
        c.grid((t.at, top), (t.at, bottom));
    }
    for t in &up {
        c.grid((left, t.at), (right, t.at));
    }
    if let Some(at) = x.zero() {
        c.grid((at, top), (at, bottom));
    }
    if let Some(at) = y.zero() {
        c.grid((left, at), (right, at));
    }
    let black = Stroke::solid(BLACK, 0.6);
    c.line("axis", &[(left, top), (left, bottom), (right, bottom)], &black);
    let mark_x = |c: &mut Canvas, at: f64, long: f64| {
        c.line("mark", &[(at, bottom), (at, bottom + long)], &Stroke::solid(BLACK, 0.5))
    };
    let mark_y = |c: &mut Canvas, at: f64, long: f64| {
        c.line("mark", &[(left - long, at), (left, at)], &Stroke::solid(BLACK, 0.5))
    };
    for at in x.minor() {
        mark_x(c, at, 1.2);
    }
    for at in y.minor() {
        mark_y(c, at, 1.2);
    }
    let write_x = |c: &mut Canvas, at: f64, text: &str, e| {
        mark_x(c, at, 2.5);
        c.power("tick-x", (at, bottom + 10.5), Anchor::Middle, text, e);
    };
    let write_y = |c: &mut Canvas, at: f64, text: &str, e| {
        mark_y(c, at, 2.5);
        c.power("tick-y", (left - 4.0, at + 2.5), Anchor::End, text, e);
    };
    for t in &across {
        write_x(c, t.at, &t.text, t.exponent);
    }
    for t in &up {
        write_y(c, t.at, &t.text, t.exponent);
    }
    if let Some(at) = x.zero() {
        write_x(c, at, "0", None);
    }
    if let Some(at) = y.zero() {
        write_y(c, at, "0", None);
    }
    if let Some(at) = x.gap() {
        c.broken((at, bottom), (1.0, 0.0));
    }
    if let Some(at) = y.gap() {
        c.broken((left, at), (0.0, -1.0));
    }
}

impl Label {
    /// The line from what a label names to it, where it is too far away to be seen as one.
    fn thread(&self) -> Option<(Point, Point)> {
        let ([x0, y0, x1, y1], p) = (self.found.rect, self.found.beside);
        let near = (p.0.clamp(x0, x1), p.1.clamp(y0, y1));
        let (dx, dy) = (near.0 - p.0, near.1 - p.1);
        let far = dx.hypot(dy);
        let from = MARKER / far;
        (far > 8.0).then_some(((p.0 + dx * from, p.1 + dy * from), near))
    }
}
