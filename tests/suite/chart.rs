//! Charts and reports, from rows made by hand.

use crate::common::{Random, shadowscope};
use resvg::usvg::roxmltree::{Document, Node};
use resvg::usvg::{Options, Tree};
use shadowscope::chart::{self, Axis, COSTS, ERRORS, Lines, Spot};
use shadowscope::frame::Renderer;
use shadowscope::measure::{self, Record, params_text, report};
use shadowscope::setup::Setup;
use std::collections::HashSet;
use std::sync::Arc;

fn record(technique: &str, params: &str, gpu_ms: f64, error_share: f64) -> Record {
    Record {
        technique: technique.into(),
        params: params.into(),
        scene: "bench".into(),
        width: 480,
        height: 270,
        facing: 1000,
        lit_incorrect: (error_share * 1000.0) as usize,
        error_share,
        gpu_ms,
        gpu_ms_q1: gpu_ms * 0.8,
        gpu_ms_q3: gpu_ms * 1.3,
        gpu_ms_low: gpu_ms * 0.9,
        gpu_ms_high: gpu_ms * 1.1,
        adapter: "Abacus <1>".into(),
        software: true,
        ..Record::default()
    }
}

/// Two techniques over five resolutions, one of them with two kernels, and an exact one.
fn sweep() -> Vec<Record> {
    let mut rows = Vec::new();
    for (i, resolution) in [1024, 256, 4096, 512, 2048].into_iter().enumerate() {
        let r = resolution as f64 / 256.0;
        rows.push(record("shadow-map", &format!("cull=none;resolution={resolution}"), 0.1 * r, 0.02 / r));
        for kernel in [3, 5] {
            let k = kernel as f64;
            let params = format!("kernel={kernel};mode=grid;resolution={resolution}");
            rows.push(record("pcf", &params, 0.1 * r + 0.03 * k, 0.012 * k.sqrt() / r));
        }
        rows[i].index = i as u64;
    }
    rows.push(record("rt-hard", "epsilon=0.0", 6.0, 0.0));
    rows
}

fn axes() -> [&'static Axis; 2] {
    [&COSTS[0], &ERRORS[0]]
}

fn draw(rows: &[Record]) -> String {
    chart::svg(rows, axes()[0], axes()[1], "A chart & its title").unwrap()
}

fn of_class<'a>(document: &'a Document, class: &str) -> Vec<Node<'a, 'a>> {
    document.descendants().filter(|n| n.attribute("class") == Some(class)).collect()
}

fn number(node: &Node, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

fn place(marker: &Node) -> (f64, f64) {
    let text = marker.attribute("transform").unwrap().trim_start_matches("translate(").trim_end_matches(')');
    let (x, y) = text.split_once(' ').unwrap();
    (x.parse().unwrap(), y.parse().unwrap())
}

fn text(node: &Node) -> String {
    node.descendants().filter_map(|n| if n.is_text() { n.text() } else { None }).collect()
}

#[test]
fn series_split_by_what_varies_and_run_over_the_main_parameter() {
    let rows = sweep();
    let lines = chart::series(&rows);
    let labels: Vec<&str> = lines.iter().map(|s| s.label.as_str()).collect();
    assert_eq!(labels, ["shadow-map", "pcf kernel=3", "pcf kernel=5", "rt-hard"]);
    for line in &lines[..3] {
        let values: Vec<&str> = line.points.iter().map(|i| chart::main_value(&rows[*i]).unwrap()).collect();
        assert_eq!(values, ["256", "512", "1024", "2048", "4096"], "{}", line.label);
        assert!(line.points.iter().all(|i| line.label.starts_with(&rows[*i].technique)));
    }
    let mut seen: Vec<usize> = lines.iter().flat_map(|s| s.points.clone()).collect();
    seen.sort();
    assert_eq!(seen, (0..rows.len()).collect::<Vec<_>>(), "each row is in one line");
    // Another scene, another camera, and kernels in the order of numbers.
    let mut rows =
        vec![record("pcf", "kernel=11;resolution=256", 1.0, 0.1), record("pcf", "kernel=5;resolution=256", 1.0, 0.1)];
    rows[0].setup = r#"{"camera":{"fov":30},"light":1}"#.into();
    rows[1].setup = r#"{"camera":{"fov":40},"light":1}"#.into();
    rows.push(Record { scene: "terrain".into(), ..rows[1].clone() });
    let labels: Vec<String> = chart::series(&rows).into_iter().map(|s| s.label).collect();
    assert_eq!(
        labels,
        ["pcf kernel=5 bench camera 2", "pcf kernel=5 terrain camera 2", "pcf kernel=11 bench camera 1"]
    );
}

/// With many parameters one line a technique: what nothing of its own beats, and every row once.
#[test]
fn each_technique_has_one_front() {
    let mut rows = sweep();
    let [x, y] = axes();
    let (lines, rest) = chart::fronts(&rows, x, y);
    let labels: Vec<&str> = lines.iter().map(|s| s.label.as_str()).collect();
    assert_eq!(labels, ["shadow-map", "pcf", "rt-hard"]);
    let place = |i: &usize| chart::point(&rows[*i], x, y).unwrap();
    for line in &lines {
        let own = |i: &usize| rows[*i].technique == line.technique;
        for i in (0..rows.len()).filter(own) {
            let (p, first) = (place(&i), line.points.contains(&i));
            let beaten = (0..rows.len()).filter(own).map(|j| place(&j)).any(|q| q.0 <= p.0 && q.1 <= p.1 && q != p);
            assert_eq!(first, !beaten, "{} {}", rows[i].technique, rows[i].params);
        }
        assert!(line.points.windows(2).all(|w| place(&w[0]).0 < place(&w[1]).0), "by ascending cost");
    }
    let mut seen: Vec<usize> = lines.iter().chain(&rest).flat_map(|s| s.points.clone()).collect();
    seen.sort();
    assert_eq!(seen, (0..rows.len()).collect::<Vec<_>>());
    assert!(!rest.is_empty());
    let svg = chart::fronts_svg(&rows, x, y, "").unwrap();
    let document = Document::parse(&svg).unwrap();
    let notes = of_class(&document, "note").iter().map(text).collect::<Vec<_>>().join(" ");
    assert!(notes.contains(&format!("Faint: {} configurations off it.", rest.len())), "{notes}");
    assert_eq!(of_class(&document, "label").len(), lines.len());
    assert_eq!(of_class(&document, "point").len(), rows.len());
    // Other scenes have fronts of their own.
    rows.push(Record { scene: "terrain".into(), ..rows[0].clone() });
    let labels: Vec<String> = chart::fronts(&rows, x, y).0.into_iter().map(|s| s.label).collect();
    assert_eq!(labels, ["shadow-map bench", "shadow-map terrain", "pcf bench", "rt-hard bench"]);
}

#[test]
fn the_front_is_what_nothing_beats() {
    let mut random = Random(5);
    for round in 0..50 {
        // Few values, so that many are equal.
        let mut value = || (random.next() * if round % 2 == 0 { 6.0 } else { 1000.0 }).floor() as f64;
        let points: Vec<(f64, f64)> = (0..40).map(|_| (value(), value())).collect();
        let front = chart::pareto(&points);
        let beaten = |p: (f64, f64)| points.iter().any(|q| q.0 <= p.0 && q.1 <= p.1 && *q != p);
        for (i, p) in points.iter().enumerate() {
            let first = points.iter().position(|q| q == p) == Some(i);
            assert_eq!(front.contains(&i), first && !beaten(*p), "{p:?} in {points:?}");
        }
        assert!(front.windows(2).all(|w| points[w[0]].0 < points[w[1]].0), "by ascending cost");
    }
    assert_eq!(chart::pareto(&[(f64::NAN, 0.0), (1.0, f64::NAN), (2.0, 1.0)]), [2]);
}

/// Of times whose quartiles overlap none is called faster: what is more accurate beats the other.
#[test]
fn overlapping_times_rank_nothing() {
    let spot = |cost: f64, half: f64, error: f64| Spot { cost, spread: [cost - half, cost + half], error };
    // The first two cannot be told apart in time, the third is faster for sure, the fourth slower and worse.
    let spots = [spot(10.0, 1.0, 0.02), spot(11.0, 1.0, 0.01), spot(5.0, 1.0, 0.05), spot(20.0, 2.0, 0.03)];
    assert_eq!(chart::pareto(&spots), [2, 1]);
    // Overlaps make chains: what is faster than the front for sure stays there, though what lies between beats it.
    let chain = [spot(1.0, 0.3, 0.09), spot(1.5, 0.3, 0.07), spot(2.0, 0.3, 0.06)];
    assert_eq!(chart::pareto(&chain), [0, 2]);
    // As wrong and as fast as each other, both are on the front.
    assert_eq!(chart::pareto(&[spot(10.0, 1.0, 0.01), spot(9.5, 1.0, 0.01)]), [1, 0]);
    // With narrow quartiles the faster one is back.
    let sure = spots.map(|s| Spot { spread: [s.cost; 2], ..s });
    assert_eq!(chart::pareto(&sure), [2, 0, 1]);
    // Of a record the quartiles count along every axis of time, as multiples where it is one; bytes have none.
    let row = Record { cost: Some(3.0), gpu_bytes: 7, ..record("shadow-map", "", 2.0, 0.01) };
    let axis = |id: &str| COSTS.iter().find(|a| a.id == id).unwrap();
    for (id, expected) in [("gpu_ms", [1.6, 2.6]), ("cost", [2.4, 3.9]), ("gpu_bytes", [7.0, 7.0])] {
        let found = axis(id).spread(&row).unwrap();
        assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-12), "{id}: {found:?}");
    }
    // What scatters by half of its median ranks nothing, and is said so where times are drawn.
    let steady: Vec<Record> =
        sweep().into_iter().map(|r| Record { gpu_ms_q1: r.gpu_ms * 0.95, gpu_ms_q3: r.gpu_ms * 1.05, ..r }).collect();
    assert!(chart::busy(&sweep()).unwrap().contains("50 %") && chart::busy(&steady).is_none());
    let noted = |rows: &[Record], cost: &Axis| {
        let svg = chart::svg(rows, cost, &ERRORS[0], "").unwrap();
        of_class(&Document::parse(&svg).unwrap(), "note").iter().map(text).collect::<Vec<_>>().join(" ")
    };
    assert!(noted(&sweep(), axis("gpu_ms")).contains("too busy") && !noted(&steady, axis("gpu_ms")).contains("busy"));
    assert!(!noted(&sweep(), axis("gpu_bytes")).contains("busy"));
}

/// Shares stand in the chart in per cent, in the rows from 0 to 1.
#[test]
fn shares_are_drawn_in_per_cent() {
    let row = record("shadow-map", "", 1.0, 0.025);
    for axis in ERRORS {
        let share = axis.title.contains('%');
        assert_eq!(axis.percent(), share, "{}", axis.id);
        if let Some(value) = (axis.get)(&row) {
            assert_eq!(axis.of(&row), Some(value * if share { 100.0 } else { 1.0 }));
        }
    }
    assert_eq!(chart::point(&row, &COSTS[0], &ERRORS[0]), Some((1.0, 2.5)));
}

/// The last number of an axis ends on the page, however long it is.
#[test]
fn no_number_is_cut_off_by_the_pages_edge() {
    for scale in [1e-9, 1e-3, 1.0, 1e6, 1e12] {
        let rows: Vec<Record> = sweep().into_iter().map(|r| Record { gpu_ms: r.gpu_ms * scale, ..r }).collect();
        let svg = draw(&rows);
        let document = Document::parse(&svg).unwrap();
        let page = document.root_element().attribute("viewBox").unwrap().split(' ').nth(2).unwrap();
        let page: f64 = page.parse().unwrap();
        for tick in of_class(&document, "tick-x") {
            // No character is wider than 0.62 of its size; exponents are smaller.
            let half = 0.62 * 7.0 * text(&tick).chars().count() as f64 / 2.0;
            assert!(number(&tick, "x") + half <= page + 1.5, "{scale}: {}", text(&tick));
        }
    }
}

#[test]
fn the_chart_is_svg_with_every_point_and_label() {
    let rows = sweep();
    let svg = draw(&rows);
    Tree::from_str(&svg, &Options::default()).expect("usvg reads it");
    let document = Document::parse(&svg).unwrap();
    let root = document.root_element();
    assert_eq!(root.attribute("width"), Some("84mm"));
    let points = of_class(&document, "point");
    assert_eq!(points.len(), rows.len(), "a marker a record");
    assert_eq!(points.iter().map(|p| p.attribute("d")).collect::<HashSet<_>>().len(), 3, "a shape a technique");
    assert_eq!(points.iter().map(|p| p.attribute("fill")).collect::<HashSet<_>>().len(), 3, "a colour a technique");
    let labels: HashSet<String> = of_class(&document, "label").iter().map(text).collect();
    let wanted: HashSet<String> = chart::series(&rows).into_iter().map(|s| s.label).collect();
    assert_eq!(labels, wanted);
    let values: Vec<String> = of_class(&document, "value").iter().map(text).collect();
    for (end, lines) in [("256", 3), ("4096", 3), ("Pareto front", 1)] {
        assert_eq!(values.iter().filter(|v| *v == end).count(), lines, "{end} in {values:?}");
    }
    // The exact technique stands in the row of zeros, below all others.
    let zero = of_class(&document, "tick-y").into_iter().find(|t| text(t) == "0").expect("a row for zeros");
    let mut heights: Vec<f64> = points.iter().map(|p| place(p).1).collect();
    heights.sort_by(f64::total_cmp);
    let [.., last, lowest] = heights[..] else { panic!() };
    assert!((lowest + 2.5 - number(&zero, "y")).abs() < 0.02 && lowest > last + 10.0, "{heights:?}");
    // Nothing is smaller than seven points but exponents, and the note tells the adapter.
    let sizes = document.descendants().filter(|n| n.has_tag_name("text")).map(|n| number(&n, "font-size"));
    assert!(sizes.fold(f64::MAX, f64::min) >= 7.0);
    let notes: Vec<String> = of_class(&document, "note").iter().map(text).collect();
    let notes = notes.join(" ");
    for said in ["Abacus <1>", "compare as ratios only", "bench, 480 × 270", "Numbers at points: resolution"] {
        assert!(notes.contains(said), "{said}: {notes}");
    }
    // Whiskers belong to times only.
    assert_eq!(of_class(&document, "whisker").len(), 3 * rows.len());
    let other = chart::svg(&rows, &COSTS[3], &ERRORS[1], "").unwrap();
    assert!(!other.contains("whisker") && other.contains("point"));
}

#[test]
fn logarithmic_axes_put_values_where_they_belong() {
    let rows = [(0.1, 0.5), (0.3, 0.05), (1.0, 0.01), (2.0, 0.02), (10.0, 0.005), (40.0, 0.0)];
    let rows: Vec<Record> = rows
        .iter()
        .enumerate()
        .map(|(i, (x, y))| record("shadow-map", &format!("resolution={}", 64 << i), *x, *y))
        .collect();
    // The rows' values, 0 to 1, on an axis that is not in per cent.
    let rows: Vec<Record> = rows.into_iter().map(|r| Record { rmse: r.error_share, ..r }).collect();
    let svg = chart::svg(&rows, &COSTS[0], &ERRORS[1], "").unwrap();
    let document = Document::parse(&svg).unwrap();
    let ticks = |class: &str, axis: &str| -> Vec<(f64, f64)> {
        let all = of_class(&document, class);
        all.iter().filter_map(|t| Some((text(t).parse().ok()?, number(t, axis)))).collect()
    };
    let across = ticks("tick-x", "x");
    let at = |v: f64| across.iter().find(|t| t.0 == v).unwrap_or_else(|| panic!("no {v} in {across:?}")).1;
    let decade = at(1.0) - at(0.1);
    assert!(decade > 20.0 && (at(10.0) - at(1.0) - decade).abs() < 0.03, "{across:?}");
    let up = ticks("tick-y", "y");
    let height = |v: f64| up.iter().find(|t| t.0 == v).unwrap_or_else(|| panic!("no {v} in {up:?}")).1 - 2.5;
    let rise = height(0.1) - height(0.01);
    for r in rows.iter().filter(|r| r.error_share > 0.0) {
        let x = at(1.0) + decade * r.gpu_ms.log10();
        let y = height(0.01) + rise * (r.error_share / 0.01).log10();
        let points = of_class(&document, "point");
        let near = points.iter().map(place).filter(|p| (p.0 - x).abs() < 0.05 && (p.1 - y).abs() < 0.05).count();
        assert_eq!(near, 1, "{} ms, {}", r.gpu_ms, r.error_share);
    }
}

/// Left, top, right, bottom of a text: letters are at least this wide in common fonts.
fn extent(node: &Node) -> [f64; 4] {
    let (size, x, y) = (number(node, "font-size"), number(node, "x"), number(node, "y"));
    let width = 0.48 * size * text(node).chars().count() as f64;
    let left = x - if node.attribute("text-anchor") == Some("middle") { width / 2.0 } else { 0.0 };
    [left, y - 0.72 * size, left + width, y]
}

fn assert_apart(document: &Document, classes: &[&str]) {
    let labels: Vec<_> = classes.iter().flat_map(|c| of_class(document, c)).collect();
    assert!(labels.len() > 3);
    for (i, a) in labels.iter().enumerate() {
        for b in &labels[i + 1..] {
            let (x, y) = (extent(a), extent(b));
            let apart = x[0] >= y[2] || y[0] >= x[2] || x[1] >= y[3] || y[1] >= x[3];
            assert!(apart, "{} lies on {}", text(a), text(b));
        }
    }
}

#[test]
fn labels_do_not_lie_on_each_other() {
    let mut random = Random(11);
    for lines in [1, 4, 9, 30] {
        let mut rows = Vec::new();
        for kernel in 0..lines {
            let (speed, error) = (1.0 + random.next() as f64, 0.01 * (1.0 + random.next() as f64));
            for step in 0..5 {
                let params = format!("kernel={kernel};mode=disk;resolution={}", 256 << step);
                rows.push(record("pcf", &params, speed * 1.6f64.powi(step), error * 0.6f64.powi(step)));
            }
        }
        rows.extend(sweep());
        let svg = draw(&rows);
        let document = Document::parse(&svg).unwrap();
        assert_apart(&document, &["label", "value"]);
        for label in of_class(&document, "label") {
            let [left, top, right, bottom] = extent(&label);
            assert!(left > 0.0 && right < 238.2 && top > 0.0 && bottom < 400.0, "{} leaves the page", text(&label));
        }
        // Of very many lines only the best are named, and the chart says so.
        let named = of_class(&document, "label").len();
        assert_eq!(svg.contains("not labelled"), named < chart::series(&rows).len());
        assert_eq!(of_class(&document, "point").len(), rows.len());
    }
}

/// Thousands of rows that share their parameters, as results of many views do: a line of them all, in time that grows as they do.
#[test]
fn thousands_of_points_on_a_line_are_drawn() {
    let mut random = Random(11);
    let rows: Vec<Record> = (0..6000)
        .map(|i| {
            let technique = ["shadow-map", "pcf"][i % 2];
            record(technique, "resolution=1024", 0.1 + random.next() as f64, 0.01 + 0.1 * random.next() as f64)
        })
        .collect();
    let svg = draw(&rows);
    let document = Document::parse(&svg).unwrap();
    assert_eq!(of_class(&document, "point").len(), rows.len());
    assert!(of_class(&document, "label").len() >= 2);
}

#[test]
fn the_same_rows_give_the_same_picture_in_any_order() {
    let mut rows = sweep();
    let svg = draw(&rows);
    assert_eq!(svg, draw(&rows));
    rows.reverse();
    assert_eq!(svg, draw(&rows), "the order of the rows shows");
    let picture = chart::png(&svg, 700).unwrap();
    assert_eq!(picture, chart::png(&svg, 700).unwrap());
    let pixels = image::load_from_memory(&picture).unwrap().to_rgb8();
    assert_eq!(pixels.width(), 700);
    assert!(pixels.height() > 400 && pixels.height() < 1200, "{}", pixels.height());
    let colors: HashSet<[u8; 3]> = pixels.pixels().map(|p| p.0).collect();
    for id in rows.iter().map(|r| &r.technique) {
        let color = chart::COLORS[chart::mark(id) % chart::COLORS.len()];
        assert!(colors.contains(&color), "the colour of {id} is missing");
    }
    assert!(colors.len() > 100 && *pixels.get_pixel(1, 1) == image::Rgb([255; 3]));
    // Text is drawn too: without the numbers and names there is less ink.
    let bare: String = svg.lines().filter(|l| !l.starts_with("<text")).collect();
    let ink = |png: &[u8]| image::load_from_memory(png).unwrap().to_luma8().pixels().filter(|p| p.0[0] < 200).count();
    assert!(ink(&picture) > ink(&chart::png(&bare, 700).unwrap()) + 2000);
    assert!(chart::png(&svg, 0).is_err() && chart::png("<svg", 100).is_err());
}

#[test]
fn what_cannot_be_drawn_is_left_out_or_said() {
    let rows = sweep();
    let error = chart::svg(&rows, &COSTS[1], &ERRORS[0], "").unwrap_err().to_string();
    assert!(error.contains("ratio") && error.contains("nothing to draw"), "{error}");
    let mut some = rows.clone();
    some[0].ratio = Some(1.0);
    some[1].ratio = Some(f64::NAN);
    some[2].ratio = Some(2.0);
    let svg = chart::svg(&some, &COSTS[1], &ERRORS[0], "\u{1} <title>").unwrap();
    assert_eq!(of_class(&Document::parse(&svg).unwrap(), "point").len(), 2);
    // Nothing wrong is an edge error of nothing; wrong pixels without an edge have none.
    let axis = |id: &str| ERRORS.iter().find(|a| a.id == id).unwrap();
    let edge = |r: &Record| chart::point(r, &COSTS[0], axis("boundary_p95_px")).map(|p| p.1);
    assert_eq!((edge(&rows[rows.len() - 1]), edge(&rows[0])), (Some(0.0), None));
    // Nothing but zeros is a row of zeros.
    let svg = chart::svg(&rows, &COSTS[3], axis("flip"), "").unwrap();
    let document = Document::parse(&svg).unwrap();
    let ticks: Vec<String> =
        ["tick-x", "tick-y"].iter().flat_map(|c| of_class(&document, c)).map(|t| text(&t)).collect();
    assert_eq!(ticks, ["0", "0"]);
}

#[test]
fn lines_are_labelled_at_their_ends() {
    let wave =
        |height: f64| (0..60).map(|i| (i as f64 / 59.0, height * (1.2 + (i as f64 * 0.2).sin()))).collect::<Vec<_>>();
    let mut gap = wave(0.01);
    gap[30].1 = f64::NAN;
    let names =
        ["shadow-map", "pcf mode=tent kernel=5 with a very long name", "rt-hard", "pcf kernel=3", "pcf kernel=7"];
    let places = [0, 1, 2, 1, 1];
    let data = [wave(0.02), gap, wave(0.0), wave(0.0101), wave(0.0102)];
    let lines = names.iter().zip(places).zip(data).map(|((n, p), d)| (n.to_string(), p, d)).collect();
    let mut lines =
        Lines { title: "Sun".into(), x: "elevation, °".into(), y: "error share".into(), log_y: true, lines };
    let svg = chart::lines_svg(&lines).unwrap();
    Tree::from_str(&svg, &Options::default()).unwrap();
    let document = Document::parse(&svg).unwrap();
    assert_apart(&document, &["label"]);
    let said: Vec<String> = of_class(&document, "label").iter().map(text).collect();
    let said = said.join(" ");
    assert!(names.iter().all(|n| said.contains(n)), "{said}");
    assert_eq!(of_class(&document, "line").len(), 6, "a value that is no number interrupts its line");
    assert!(of_class(&document, "tick-y").iter().any(|t| text(t) == "0"), "zeros have their row");
    let labels = of_class(&document, "label");
    let height = |name: &str| number(labels.iter().find(|l| text(l) == name).unwrap(), "y");
    assert!(
        height("shadow-map") < height("pcf kernel=7") && height("pcf kernel=3") < height("rt-hard"),
        "highest first"
    );
    assert_eq!(svg, chart::lines_svg(&lines).unwrap());
    lines.log_y = false;
    assert!(chart::lines_svg(&lines).unwrap().contains("0.02"));
    lines.lines.clear();
    assert!(chart::lines_svg(&lines).is_err());
}

#[test]
fn the_command_joins_files_and_says_what_it_leaves_out() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let mut rows = sweep();
    for r in &mut rows[..4] {
        r.flicker = Some(0.01);
    }
    measure::write(&rows[..6], &folder.join("a.csv"), false).unwrap();
    measure::write(&rows[6..], &folder.join("b.json"), true).unwrap();
    measure::write(&[], &folder.join("none.json"), true).unwrap();
    std::fs::write(folder.join("other.csv"), "name,value\na,1\n").unwrap();
    let ok = |args: &[&str]| {
        let out = shadowscope(folder, args);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success() && out.stdout.is_empty(), "{args:?}: {said}");
        said
    };
    let said = ok(&["chart", "a.csv", "b.json", "-o", "new/chart.svg", "--title", "Both"]);
    assert!(!said.contains("left out"), "{said}");
    let svg = std::fs::read_to_string(folder.join("new/chart.svg")).unwrap();
    assert_eq!(svg, chart::svg(&rows, axes()[0], axes()[1], "Both").unwrap(), "the command and the library draw alike");
    let said = ok(&["chart", "a.csv", "b.json", "--y", "flicker", "--x", "gpu_bytes", "-o", "c.PNG", "--width", "333"]);
    assert!(said.contains("12 of 16 rows") && said.contains("--flicker"), "{said}");
    assert_eq!(image::open(folder.join("c.PNG")).unwrap().width(), 333);
    for (args, says) in [
        (
            vec!["a.csv", "-o", "x.svg", "--x", "speed"],
            "gpu_ms, ratio, cost, gpu_bytes, rays, triangles_submitted, fragments",
        ),
        (
            vec!["a.csv", "-o", "x.svg", "--y", "gpu_ms"],
            "error_share, rmse, mae, beyond_tolerance, flip, jod, rmse_penumbra, penumbra_off_px, gap_p95_m, boundary_p95_px",
        ),
        (vec!["b.json", "-o", "x.svg", "--y", "flicker"], "--flicker"),
        (vec!["none.json", "-o", "x.svg"], "no rows"),
        (vec!["other.csv", "-o", "x.svg"], "technique"),
        (vec!["missing.csv", "-o", "x.svg"], "missing.csv"),
        (vec!["a.csv", "-o", "x.pdf"], ".svg or .png"),
        (vec!["a.csv", "-o", "a.csv/x.svg"], "a.csv"),
        (vec!["a.csv", "-o", "x.png", "--width", "0"], "1 to 16384"),
    ] {
        let out = shadowscope(folder, &[&["chart"], &args[..]].concat());
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(!out.status.success(), "{args:?} succeeded");
        let last = error.lines().last().unwrap_or_default();
        assert!(last.starts_with("shadowscope: ") && last.contains(says), "{args:?}: {error}");
    }
    assert!(!folder.join("x.svg").exists() && !folder.join("x.png").exists());
}

#[test]
fn a_report_is_one_page_that_holds_everything() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("report");
    let (mut setup, scene) = Setup::open("cubes").unwrap();
    setup.size = [96, 64];
    let mut renderer = Renderer::new(crate::common::gpu(), Arc::new(scene)).unwrap();
    let mut rows = Vec::new();
    for (technique, set, ms, error) in [
        ("shadow-map", "resolution=256", 1.0, 0.02),
        ("shadow-map", "resolution=512", 2.0, 0.01),
        ("pcf", "resolution=256", 2.1, 0.03),
        ("pcf", "resolution=512", 4.0, 0.015),
        ("rt-hard", "max_visits=65536", 9.0, 0.0),
    ] {
        setup.select(technique).unwrap();
        setup.set(set, &[technique.into()]).unwrap();
        let mut r = record(technique, &params_text(&setup), ms, error);
        (r.scene, r.width, r.height) = ("cubes".into(), 96, 64);
        r.ratio = Some(ms / 2.0);
        r.cost = Some(ms / 4.0);
        r.setup = serde_json::to_string(&setup).unwrap();
        rows.push(r);
    }
    report::write(&rows, "Cubes & <light>", &folder, &mut renderer).unwrap();
    let html = std::fs::read_to_string(folder.join("index.html")).unwrap();
    assert!(html.contains("<h1>Cubes &amp; &lt;light&gt;</h1>") && html.contains("<td>Abacus &lt;1&gt;</td>"));
    for id in ["shadow-map", "pcf", "rt-hard"] {
        assert!(html.contains(&format!("<td class=\"t\">{id}</td>")), "{id} is not in the table");
    }
    // Nothing comes from elsewhere.
    for scheme in ["http://", "https://"] {
        assert!(
            html.matches(scheme).count() == html.matches(&format!("xmlns=\"{scheme}www.w3.org")).count(),
            "{scheme}"
        );
    }
    assert!(!html.contains("<link") && !html.contains("src=\"/") && html.matches("<script").count() == 1);
    // Charts, each of them SVG, without an XML line amid the page.
    let charts: Vec<&str> = html.split("<svg").skip(1).filter_map(|s| s.split("</svg>").next()).collect();
    assert_eq!(charts.len(), 4, "error share over cost and time, RMSE, FLIP over cost");
    for svg in charts {
        Document::parse(&format!("<svg{svg}</svg>")).unwrap();
    }
    assert!(!html.contains("<?xml"));
    // Pictures of four configurations, for the exact one is also the dearest: three, two views each.
    let pictures: Vec<&str> =
        html.split("data:image/png;base64,").skip(1).filter_map(|s| s.split('"').next()).collect();
    assert_eq!(pictures.len(), 6);
    let mut files: Vec<String> =
        std::fs::read_dir(&folder).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    assert_eq!(
        files,
        [
            "index.html",
            "pcf-3-error.png",
            "pcf-3-shaded.png",
            "report.toml",
            "rt-hard-5-error.png",
            "rt-hard-5-shaded.png",
            "shadow-map-1-error.png",
            "shadow-map-1-shaded.png"
        ]
    );
    use base64::Engine;
    let embedded: HashSet<Vec<u8>> =
        pictures.iter().map(|p| base64::engine::general_purpose::STANDARD.decode(p).unwrap()).collect();
    for file in files.iter().filter(|f| f.ends_with(".png")) {
        let bytes = std::fs::read(folder.join(file)).unwrap();
        assert_eq!(image::load_from_memory(&bytes).unwrap().width(), 96);
        assert!(embedded.contains(&bytes), "{file} is not in the page");
        let (inside, _) = Setup::open(folder.join(file).to_str().unwrap()).unwrap();
        assert!(file.starts_with(&inside.technique) && file.contains(&inside.view), "{file}");
    }
    // 2.0 and 2.1 ms are tied, and nothing else.
    let ties: Vec<&str> = html.split("<td>#").skip(1).filter_map(|s| s.split('<').next()).collect();
    assert_eq!(ties, ["3", "2"]);
    // The front: the pcf rows are beaten.
    let front = html.split("The cheapest for each error").nth(1).unwrap().split("</table>").next().unwrap();
    assert_eq!(front.matches("<tr><td>").count(), 3);
    assert!(!front.contains("pcf"));
    // Every cell stands under a heading.
    for table in html.split("<table").skip(1).filter(|t| t.contains("<thead>")) {
        let (head, body) = table.split_once("</thead>").unwrap();
        for row in body.split("<tr>").skip(1).filter_map(|r| r.split("</tr>").next()) {
            assert_eq!(
                head.matches("<th").count() - head.matches("<thead").count(),
                row.matches("<td").count(),
                "{row}"
            );
        }
    }
    assert!(front.contains(">error, %</th>") && front.contains(">GPU ms</th>"), "{front}");
    // The command measures these rows again: the set-up beside it holds what does not vary.
    for said in
        ["--techniques shadow-map,pcf,rt-hard", "--set shadow-map.resolution=256,512", "--set pcf.resolution=256,512"]
    {
        assert!(html.contains(said), "{said}");
    }
    let (base, _) = Setup::open(folder.join("report.toml").to_str().unwrap()).unwrap();
    assert_eq!((base.size, base.params["pcf"].len()), ([96, 64], setup.params["pcf"].len()));
    assert!(!html.contains("not every combination"));
    // Less than all combinations is said; another size is another report.
    let mut more = rows.clone();
    setup.select("pcf").unwrap();
    setup.set("kernel=5", &["pcf".into()]).unwrap();
    more.push(Record { params: params_text(&setup), setup: serde_json::to_string(&setup).unwrap(), ..rows[3].clone() });
    report::write(&more, "Part", &folder, &mut renderer).unwrap();
    let part = std::fs::read_to_string(folder.join("index.html")).unwrap();
    assert!(part.contains("not every combination") && part.contains("measures 7 configurations"));
    setup.size = [32, 32];
    rows[1].setup = serde_json::to_string(&setup).unwrap();
    assert!(report::write(&rows, "Two sizes", &folder, &mut renderer).unwrap_err().to_string().contains("one set-up"));
    assert!(report::write(&[], "None", &folder, &mut renderer).is_err());
}
