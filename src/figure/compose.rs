//! Draws the cells of a sheet and lays them out.

use super::layout::{self, Area, Boxed, Grid, LINE};
use super::spec::{Axis, Change, Kind, Spec, in_scene, measurable};
use crate::capture;
use crate::chart::{text_width, wrap};
use crate::frame::{History, Pixels, Renderer};
use crate::gpu::Gpu;
use crate::legend::{self, Anchor, Key, Known, Mark, Part};
use crate::measure::{self, Column, Record, STOPPED};
use crate::palette::{Rgb, bytes};
use crate::scene::Scene;
use crate::setup::{self, Arrange, Setup};
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A cell of a sheet.
#[derive(Clone, Debug)]
pub struct Cell {
    pub setup: Setup,
    /// What its column and its row are called; empty where there is one.
    pub labels: [String; 2],
    /// The same for the names of files.
    pub stems: [String; 2],
    /// Why there is nothing to be seen.
    pub refused: Option<String>,
    /// What it shows, rows from the top; empty where it is refused.
    pub picture: Pixels,
    /// What was measured of it; None of the truth, or where nothing was asked for.
    pub record: Option<Record>,
    /// The axes of a chart, from the picture's corner.
    axes: Vec<Mark>,
}

/// A sheet, drawn.
#[derive(Clone, Debug)]
pub struct Sheet {
    pub spec: Spec,
    /// Rows and columns.
    pub count: [usize; 2],
    /// Row by row.
    pub cells: Vec<Cell>,
    pub grid: Grid,
    /// Pixels.
    pub size: [u32; 2],
    pub items: Vec<Item>,
    /// The caption with its numbers, and how much of the height it takes.
    pub caption: String,
    pub caption_height: u32,
    /// What is to be said of the pictures, a sentence each.
    pub notes: Vec<String>,
}

/// What lies on a sheet, in pixels; y downwards.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Texels of a cell's picture, enlarged where that is larger.
    Picture {
        at: Area,
        cell: usize,
        texels: Area,
    },
    /// Left, top, right, bottom; what fills it, with its opacity; colour and width of its frame, which lies inside.
    Rect {
        at: [f64; 4],
        fill: Option<([u8; 3], f64)>,
        frame: Option<([u8; 3], f64)>,
    },
    /// Colours from left to right.
    Scale {
        at: [f64; 4],
        stops: Vec<[u8; 3]>,
    },
    Line {
        from: [f64; 2],
        to: [f64; 2],
        color: [u8; 3],
        width: f64,
    },
    /// On its base line; upwards: turned by a quarter, and read from below.
    Text {
        at: [f64; 2],
        anchor: Anchor,
        size: f64,
        color: [u8; 3],
        text: String,
        upwards: bool,
    },
}

pub const INK: [u8; 3] = [0x22; 3];
const FAINT: [u8; 3] = [0x66; 3];
const EMPTY: [u8; 3] = [0xee; 3];
/// Size of what stands below pictures over that of labels.
const SMALL: f64 = 0.88;

/// Draws a sheet. `watch` is told the share done and what it is at, and stops the work by saying no.
///
/// # Errors
/// One sentence: what of the spec cannot be drawn, and in which cell; or that it was stopped.
pub fn draw(spec: &Spec, gpu: &Arc<Gpu>, watch: &mut dyn FnMut(f32, &str) -> bool) -> Result<Sheet> {
    let columns: Vec<&Column> = spec.numbers.iter().map(|id| measurable(id)).collect::<Result<_>>()?;
    let (mut cells, count, scenes) = resolve(spec)?;
    let shapes: Vec<f64> = cells.iter().map(|cell| shape(&cell.setup)).collect();
    let [rows, across] = count;
    // How many lines a row's label takes follows from how high pictures are, and that from how wide labels are.
    let named = cells.iter().any(|cell| !cell.labels[1].is_empty());
    let first = Grid::new(spec, across, &shapes, usize::from(named))?;
    let label = |row: usize| {
        let row = &cells[row * across..][..across];
        let high = row.iter().map(|cell| picture_size(&first, &cell.setup)[1]).max().unwrap_or(0);
        wrap(&row[0].labels[1], first.font, f64::from(high).max(4.0 * first.font))
    };
    let labels: Vec<Vec<String>> = (0..rows).map(label).collect();
    let grid = Grid::new(spec, across, &shapes, labels.iter().map(Vec::len).max().unwrap_or(0))?;
    for cell in &mut cells {
        cell.setup.size = cell.setup.size_around(picture_size(&grid, &cell.setup));
        cell.setup.check().with_context(|| cell.told())?;
    }
    let high = |row: usize| (0..across).map(|i| u64::from(cells[row * across + i].setup.part()[3])).max().unwrap_or(0);
    let height = (0..rows).map(high).sum::<u64>().min(u64::from(u32::MAX));
    layout::check_size([grid.width, height as u32])?;
    let mut sheet = Sheet {
        spec: spec.clone(),
        count,
        cells,
        size: [grid.width, 0],
        grid,
        items: Vec::new(),
        caption: String::new(),
        caption_height: 0,
        notes: Vec::new(),
    };
    // What its caption asks for is refused before anything is drawn.
    sheet.filled(&spec.caption)?;
    let mut keys: Vec<(Key, String)> = Vec::new();
    let total = sheet.cells.len() as f32;
    let mut done = 0.0;
    // Scene by scene: each is on the device once.
    for (scene, cells) in scenes {
        let scene = Arc::new(scene);
        let mut renderer: Option<Renderer> = None;
        for i in cells {
            let what = sheet.cells[i].told();
            ensure!(watch(done / total, &what), STOPPED);
            if sheet.cells[i].refused.is_none() {
                let renderer = match &mut renderer {
                    Some(renderer) => renderer,
                    None => renderer.insert(Renderer::new(gpu.clone(), scene.clone())?),
                };
                sheet.show(renderer, i, &mut keys).with_context(|| what.clone())?;
                if !columns.is_empty() && !is_truth(&sheet.cells[i].setup) {
                    let mut tick = |part: f32| watch((done + part) / total, &what);
                    let record = measured(spec, renderer, &sheet.cells[i].setup, &columns, &mut tick);
                    sheet.cells[i].record = Some(record.with_context(|| what.clone())?);
                }
            }
            done += 1.0;
        }
    }
    sheet.caption = sheet.filled(&spec.caption)?;
    sheet.lay_out(&labels, &columns, keys);
    layout::check_size(sheet.size)?;
    Ok(sheet)
}

/// Cells row by row, how many rows and columns there are, and the scenes with the cells that show them.
type Resolved = (Vec<Cell>, [usize; 2], Vec<(Scene, Vec<usize>)>);

/// Finds the set-up of each cell.
fn resolve(spec: &Spec) -> Result<Resolved> {
    let base = setup::scene_name(&spec.base).context("base")?.to_string();
    let mut scenes = BTreeMap::from([(base.clone(), (setup::load_scene(&base)?, Vec::new()))]);
    let open = &scenes[&base].0;
    let (rows, columns) = (spec.changes(&spec.rows, open)?, spec.changes(&spec.columns, open)?);
    Spec::check_count(rows.len(), columns.len())?;
    let mut cells: Vec<Cell> = Vec::new();
    let label = |change: &Change| change.label.clone().unwrap_or_else(|| in_words(change));
    for (i, row) in rows.iter().enumerate() {
        for (j, column) in columns.iter().enumerate() {
            let labels = [label(column), label(row)];
            let stems = [stem(&spec.columns, column), stem(&spec.rows, row)];
            let whose = || format!("row {}, column {}", i + 1, j + 1);
            let keys = spec.cell(row, column);
            let name = setup::scene_name(&keys).with_context(whose)?.to_string();
            if !scenes.contains_key(&name) {
                scenes.insert(name.clone(), (setup::load_scene(&name).with_context(whose)?, Vec::new()));
            }
            let Some((scene, of)) = scenes.get_mut(&name) else { bail!("{name} was just loaded") };
            let (setup, lacking) = in_scene(keys, &name, scene).with_context(whose)?;
            let shown = (0..setup.sides()).filter(|side| match setup.arrange {
                Arrange::Flicker => *side == setup.front as usize,
                _ => true,
            });
            // What is off needs no shadow.
            let sides = shown.filter(|side| !setup.is_truth(*side) && !setup.idles());
            let refused = sides.filter_map(|side| setup.info(side)).find_map(|info| info.refuses(&setup.light));
            of.push(cells.len());
            let refused = refused.or(lacking);
            cells.push(Cell {
                setup,
                labels,
                stems,
                refused,
                picture: Pixels::default(),
                record: None,
                axes: Vec::new(),
            });
        }
    }
    Ok((cells, [rows.len(), columns.len()], scenes.into_values().collect()))
}

/// What a change is called in the names of files: as the list has it, or by its label.
fn stem(axis: &Axis, change: &Change) -> String {
    match axis {
        Axis::List(kind, _) => {
            change.keys.values().find_map(|name| name.as_str()).map_or(String::new(), |name| match kind {
                Kind::Scenes => kind.label(name),
                _ => name.into(),
            })
        }
        _ => change.label.clone().unwrap_or_else(|| in_words(change)),
    }
}

/// What a change without a label is called.
fn in_words(change: &Change) -> String {
    fn walk(path: &str, table: &toml::Table, out: &mut Vec<String>) {
        for (key, value) in table {
            match value {
                toml::Value::Table(inner) => walk(key, inner, out),
                toml::Value::String(text) => out.push(match path {
                    "" => {
                        Kind::ALL.iter().find(|k| k.id() == format!("{key}s")).map_or(text.clone(), |k| k.label(text))
                    }
                    _ => format!("{key} = {text}"),
                }),
                other => out.push(format!("{key} = {other}")),
            }
        }
    }
    let mut out = Vec::new();
    walk("", &change.keys, &mut out);
    crate::message::cut(&out.join(", "), 80)
}

/// Height of a picture over its width.
fn shape(setup: &Setup) -> f64 {
    let [.., w, h] = setup.part();
    f64::from(h) / f64::from(w)
}

/// Size of a cell's picture.
fn picture_size(grid: &Grid, setup: &Setup) -> [u32; 2] {
    let high = (f64::from(grid.picture) * shape(setup)).round();
    [grid.picture, high.clamp(1.0, f64::from(u32::MAX)) as u32]
}

/// Whether a cell shows the truth, of which nothing can be measured.
pub fn is_truth(setup: &Setup) -> bool {
    let alone = setup.arrange == Arrange::Flicker && setup.is_truth(setup.front as usize);
    alone || setup.overlay.is_none() && setup.view == "truth"
}

/// Measures what columns ask for of a cell's set-up; times and flicker only where they are asked for.
fn measured(
    spec: &Spec,
    renderer: &mut Renderer,
    setup: &Setup,
    columns: &[&Column],
    tick: &mut dyn FnMut(f32) -> bool,
) -> Result<Record> {
    // Of a flicker the side that is seen.
    let front = if setup.arrange == Arrange::Flicker { setup.front as usize } else { 0 };
    let setup = Setup { size: spec.measured_size.unwrap_or(setup.size), ..setup.side(front).measured() };
    measure::asked(renderer, &setup, columns, tick)
}

impl Cell {
    /// What it is called in messages.
    pub fn told(&self) -> String {
        let labels: Vec<&str> = self.labels.iter().map(String::as_str).filter(|l| !l.is_empty()).collect();
        if labels.is_empty() { self.setup.technique.clone() } else { labels.join(", ") }
    }

    /// A number with its name and unit; None where nothing was measured.
    pub fn number(&self, column: &Column) -> Option<String> {
        let value = column.rounded(self.record.as_ref()?);
        Some(match column.name.rsplit_once(", ").filter(|(_, unit)| UNITS.contains(unit)) {
            Some((name, unit)) => format!("{name}\u{a0}{value}\u{a0}{unit}"),
            None => format!("{}\u{a0}{value}", column.name.replace(' ', "\u{a0}")),
        })
    }
}

/// What stands behind a number instead of before it.
const UNITS: [&str; 6] = ["%", "px", "px²", "m", "MiB", "frames"];

impl Sheet {
    /// A cell, counted from 0.
    pub fn cell(&self, row: usize, column: usize) -> &Cell {
        &self.cells[row * self.count[1] + column]
    }

    /// Draws a cell's picture, and keeps its legend if no other is like it.
    fn show(&mut self, renderer: &mut Renderer, i: usize, keys: &mut Vec<(Key, String)>) -> Result<()> {
        let told = self.cells[i].told();
        let setup = &self.cells[i].setup;
        let (picture, notes) = capture::picture(renderer, setup, History::Whole)?;
        for note in notes {
            let note = if self.cells.len() > 1 { format!("{told}: {note}") } else { note };
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
        let known = Known { errors: Vec::new(), ..renderer.known()? };
        let bounds = renderer.geometry().bounds;
        let mut key = Key::new(setup, bounds, &known);
        let size = picture.size.map(|side| side as f32);
        let axes = if setup.crop.is_none() {
            legend::axes(&key, size, size[1], (SMALL * self.grid.font) as f32)
        } else {
            Vec::new()
        };
        if self.cells.len() > 1 {
            // What sides are called stands beside the pictures.
            key.parts.retain(|part| !matches!(part, Part::Text(_)));
            let shown = setup.overlay.as_ref().map_or(&setup.view, |overlay| &overlay.view);
            if let Some(view) = setup.find_view(shown) {
                key.title = view.title.into();
            }
        }
        let same = |other: &Key| other.title == key.title && format!("{:?}", other.parts) == format!("{:?}", key.parts);
        if self.spec.legend && !key.is_empty() && !keys.iter().any(|(other, _)| same(other)) {
            keys.push((key, told));
        }
        let cell = &mut self.cells[i];
        (cell.picture, cell.axes) = (picture, axes);
        Ok(())
    }

    /// A caption with its numbers in place of `{column row,column}`, and `{` for `{{`.
    fn filled(&self, caption: &str) -> Result<String> {
        let mut out = String::new();
        let mut rest = caption;
        while let Some((before, behind)) = rest.split_once('{') {
            out += before;
            if let Some(behind) = behind.strip_prefix('{') {
                out.push('{');
                rest = behind;
                continue;
            }
            let form =
                || "caption: write a measured number as {rmse 1,2} (row 1, column 2), and { itself as {{".to_string();
            let (inside, behind) = behind.split_once('}').with_context(form)?;
            let (id, place) = inside.split_once(' ').unwrap_or((inside, "1,1"));
            let (row, column) = place.split_once(',').with_context(form)?;
            let at = |text: &str, most: usize| text.trim().parse::<usize>().ok().filter(|n| (1..=most).contains(n));
            let [rows, columns] = self.count;
            let (Some(row), Some(column)) = (at(row, rows), at(column, columns)) else {
                bail!("caption: {{{inside}}} is outside the sheet, which has {rows} rows and {columns} columns");
            };
            Column::find(id).context("caption")?;
            ensure!(
                self.spec.numbers.iter().any(|number| number == id),
                "caption: {id} is not measured; put it into numbers, which has {}",
                if self.spec.numbers.is_empty() { "none".into() } else { self.spec.numbers.join(", ") }
            );
            let cell = self.cell(row - 1, column - 1);
            out += &cell
                .record
                .as_ref()
                .map_or("–".into(), |record| Column::find(id).map(|c| c.rounded(record)).unwrap_or_default());
            rest = behind;
        }
        Ok(out + &rest.replace("}}", "}"))
    }

    /// Gives everything its place.
    fn lay_out(&mut self, rows: &[Vec<String>], columns: &[&Column], keys: Vec<(Key, String)>) {
        let grid = self.grid.clone();
        let across = self.count[1];
        let font = grid.font;
        let small = SMALL * font;
        let mut items = Vec::new();
        let text = |at, anchor, size, color, text: &str, upwards| Item::Text {
            at,
            anchor,
            size,
            color,
            text: text.into(),
            upwards,
        };
        let mut y = 0;
        // The columns' labels stand on the pictures.
        let heads: Vec<Vec<String>> =
            (0..across).map(|j| wrap(&self.cell(0, j).labels[0], font, f64::from(grid.cell))).collect();
        let lines = heads.iter().map(Vec::len).max().unwrap_or(0);
        if lines > 0 {
            let height = grid.lines(lines, font) + (0.25 * font) as u32;
            for (j, head) in heads.iter().enumerate() {
                let middle = f64::from(grid.column(j)) + f64::from(grid.cell) / 2.0;
                for (k, line) in head.iter().enumerate() {
                    let below = (head.len() - k - 1) as f64 * LINE * font + 0.45 * font;
                    let base = f64::from(height) - below;
                    items.push(text([middle, base], Anchor::Middle, font, INK, line, false));
                }
            }
            y += height;
        }
        for (i, lines) in rows.iter().enumerate() {
            if i > 0 {
                y += grid.gap;
            }
            let mut bottom = y;
            let mut high = 0;
            for j in 0..across {
                let index = i * across + j;
                let cell = &self.cells[index];
                let [.., w, h] = cell.setup.part();
                high = high.max(h);
                let (x, mut end) = (grid.column(j), y + h);
                let boxes = grid.insets(&self.spec, [w, h]);
                for boxed in &boxes {
                    end = end.max(y + boxed.at[1] + boxed.at[3]);
                }
                match &cell.refused {
                    Some(why) => empty(&mut items, [x, y, w, h], why, small),
                    None => pictures(&mut items, &self.spec, index, [x, y], cell, &boxes, font),
                }
                let numbers: Vec<String> = columns.iter().filter_map(|column| cell.number(column)).collect();
                if !numbers.is_empty() {
                    let lines = flow(&numbers, small, f64::from(grid.cell));
                    for (k, line) in lines.iter().enumerate() {
                        let base = f64::from(end) + 0.25 * small + (k as f64 + 0.85) * LINE * small;
                        let middle = f64::from(x) + f64::from(grid.cell) / 2.0;
                        items.push(text([middle, base], Anchor::Middle, small, INK, line, false));
                    }
                    end += grid.lines(lines.len(), small) + (0.5 * small) as u32;
                }
                bottom = bottom.max(end);
            }
            for (k, line) in lines.iter().enumerate() {
                // Read from below: the last line is next to the pictures.
                let from = (lines.len() - k - 1) as f64 * LINE * font + 0.55 * font;
                let at = [f64::from(grid.left) - from, f64::from(y) + f64::from(high) / 2.0];
                items.push(text(at, Anchor::Middle, font, INK, line, true));
            }
            y = bottom;
        }
        let several = |title: &str| keys.iter().filter(|(key, _)| key.title == title).count() > 1;
        for (key, told) in &keys {
            let mut named = key.clone();
            if several(&key.title) {
                named.title = format!("{} ({told})", key.title);
            }
            y += (0.4 * font) as u32;
            let (height, marks) = legend::strip(&named, grid.width as f32, small as f32);
            marks.iter().for_each(|mark| add(&mut items, mark, [0.0, f64::from(y)], INK));
            y += height.ceil() as u32;
        }
        let before = y;
        if self.spec.draw_caption && !self.caption.is_empty() {
            y += (0.7 * font) as u32;
            let lines = wrap(&self.caption, font, f64::from(grid.width));
            for (k, line) in lines.iter().enumerate() {
                let base = f64::from(y) + (k as f64 + 0.85) * LINE * font;
                items.push(text([0.0, base], Anchor::Start, font, INK, line, false));
            }
            y += grid.lines(lines.len(), font) + (0.2 * font) as u32;
        }
        self.caption_height = y - before;
        self.size = [grid.width, y.max(1)];
        self.items = items;
    }
}

/// A cell's picture with its insets, and their frames.
fn pictures(
    items: &mut Vec<Item>,
    spec: &Spec,
    index: usize,
    [x, y]: [u32; 2],
    cell: &Cell,
    boxes: &[Boxed],
    font: f64,
) {
    let [w, h] = cell.picture.size;
    items.push(Item::Picture { at: [x, y, w, h], cell: index, texels: [0, 0, w, h] });
    let corner = [f64::from(x), f64::from(y)];
    cell.axes.iter().for_each(|mark| add(items, mark, corner, [0xf0; 3]));
    // As thick as the strokes of letters.
    let stroke = (font / 12.0).max(1.0);
    for (boxed, inset) in boxes.iter().zip(&spec.insets) {
        let [l, t, w, h] = boxed.texels.map(f64::from);
        let [left, top] = [corner[0] + l, corner[1] + t];
        items.push(Item::Rect { at: [left, top, left + w, top + h], fill: None, frame: Some((inset.color, stroke)) });
    }
    for (boxed, inset) in boxes.iter().zip(&spec.insets) {
        let [l, t, w, h] = boxed.at;
        let at = [x + l, y + t, w, h];
        items.push(Item::Picture { at, cell: index, texels: boxed.texels });
        let [l, t, w, h] = at.map(f64::from);
        items.push(Item::Rect { at: [l, t, l + w, t + h], fill: None, frame: Some((inset.color, 1.5 * stroke)) });
    }
}

/// A cell that shows nothing, and says why.
fn empty(items: &mut Vec<Item>, at: Area, why: &str, size: f64) {
    let [x, y, w, h] = at.map(f64::from);
    items.push(Item::Rect { at: [x, y, x + w, y + h], fill: Some((EMPTY, 1.0)), frame: None });
    let lines = wrap(why, size, w - size);
    let most = ((h / (LINE * size)) as usize).max(1);
    let lines = &lines[..lines.len().min(most)];
    let first = y + h / 2.0 - (lines.len() as f64 / 2.0 - 0.75) * LINE * size;
    for (k, line) in lines.iter().enumerate() {
        items.push(Item::Text {
            at: [x + w / 2.0, first + k as f64 * LINE * size],
            anchor: Anchor::Middle,
            size,
            color: FAINT,
            text: line.clone(),
            upwards: false,
        });
    }
}

/// Texts beside each other with commas between, in lines of at most a width; none is broken.
fn flow(texts: &[String], size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for text in texts {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line}, {text}"), size) <= width => *line += &format!(", {text}"),
            _ => lines.push(text.clone()),
        }
    }
    lines
}

/// Adds a legend's mark, from a corner on.
fn add(items: &mut Vec<Item>, mark: &Mark, [x, y]: [f64; 2], ink: [u8; 3]) {
    let at = |[l, t]: [f32; 2]| [x + f64::from(l), y + f64::from(t)];
    let area = |[l, t, r, b]: [f32; 4]| [x + f64::from(l), y + f64::from(t), x + f64::from(r), y + f64::from(b)];
    let color = |rgb: Rgb| bytes(rgb);
    let drawn = match mark {
        Mark::Fill(rect, rgb) => {
            Item::Rect { at: area(*rect), fill: Some((color(*rgb), 1.0)), frame: Some(([0x88; 3], 1.0)) }
        }
        Mark::Scale(rect, palette) => {
            Item::Scale { at: area(*rect), stops: palette.stops.iter().map(|c| color(*c)).collect() }
        }
        Mark::Line(from, to) => Item::Line { from: at(*from), to: at(*to), color: ink, width: 1.0 },
        Mark::Text { at: place, anchor, size, text, ground, .. } => {
            let [x, y] = at(*place);
            if *ground {
                let dark = Some(([0; 3], 0.6));
                items.push(Item::Rect {
                    at: area(legend::text_box(*place, *anchor, *size, text)),
                    fill: dark,
                    frame: None,
                });
            }
            let size = f64::from(*size);
            Item::Text {
                at: [x, y + 0.35 * size],
                anchor: *anchor,
                size,
                color: ink,
                text: text.clone(),
                upwards: false,
            }
        }
    };
    items.push(drawn);
}
