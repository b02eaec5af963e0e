//! What a sheet shows, as TOML: a set-up, and what of it changes from row to row and from column to column.

use super::KEYWORD;
use super::tex::is_of_label;
use crate::capture;
use crate::files;
use crate::legend;
use crate::measure::Column;
use crate::message::{self, shortened};
use crate::params::Values;
use crate::scene::{Scene, builtin};
use crate::setup::{self, MAX_SIZE, Setup, Side};
use crate::techniques;
use crate::view;
use anyhow::{Context, Result, bail, ensure};
use std::path::Path;
use toml::{Table, Value};

/// A sheet. Scenes in it are named as they are found from where the program runs; in files they count from the file's folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    /// Keys of a set-up; what is left out is as the scene starts.
    pub base: Table,
    pub rows: Axis,
    pub columns: Axis,
    pub width: Width,
    /// Pixels an inch.
    pub dpi: u32,
    /// Points of 1/72 inch.
    pub font_size: f64,
    /// Between pictures, millimetres.
    pub gap: f64,
    pub insets: Vec<Inset>,
    pub insets_at: Place,
    /// The view's legend below the pictures.
    pub legend: bool,
    /// Names of [`Column`]s that are measured and told below each picture.
    pub numbers: Vec<String>,
    /// The picture's size that they are measured at; None: that of the picture in the sheet.
    pub measured_size: Option<[u32; 2]>,
    pub caption: String,
    /// The caption stands below the sheet too, not only in the LaTeX snippet.
    pub draw_caption: bool,
    /// LaTeX's label.
    pub label: String,
    /// Each cell is written as a capture of its own too.
    pub cells: bool,
}

/// What changes along rows or columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Axis {
    /// Nothing: there is one.
    #[default]
    One,
    /// The short form: names of one kind; `all` alone stands for all there are.
    List(Kind, Vec<String>),
    Changes(Vec<Change>),
}

/// Keys of a set-up that take another value, and what that is called.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    pub label: Option<String>,
    pub keys: Table,
}

/// What a short list names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Techniques,
    Cameras,
    Lights,
    Scenes,
    Views,
}

impl Kind {
    pub const ALL: [Kind; 5] = [Kind::Techniques, Kind::Cameras, Kind::Lights, Kind::Scenes, Kind::Views];

    /// As specs have it.
    pub fn id(self) -> &'static str {
        match self {
            Kind::Techniques => "techniques",
            Kind::Cameras => "cameras",
            Kind::Lights => "lights",
            Kind::Scenes => "scenes",
            Kind::Views => "views",
        }
    }

    /// The set-up's key.
    fn key(self) -> &'static str {
        self.id().trim_end_matches('s')
    }

    /// All names of a kind; those of cameras and lights are the scene's.
    pub fn names(self, scene: &Scene) -> Vec<String> {
        match self {
            Kind::Techniques => techniques::ALL.iter().map(|info| info.id.into()).collect(),
            Kind::Cameras => scene.cameras.iter().map(|c| c.name.clone()).collect(),
            Kind::Lights => scene.lights.iter().map(|l| l.name.clone()).collect(),
            Kind::Scenes => builtin::NAMES.iter().map(|name| name.to_string()).collect(),
            Kind::Views => view::VIEWS.iter().map(|v| v.id.into()).collect(),
        }
    }

    /// What a name is called on a sheet.
    pub fn label(self, name: &str) -> String {
        match self {
            Kind::Techniques if name == Side::TRUTH => "Ray-traced truth".into(),
            Kind::Techniques => techniques::find(name).map_or(name, |info| info.title).into(),
            Kind::Views => view::VIEWS.iter().find(|v| v.id == name).map_or(name, |v| v.title).into(),
            Kind::Scenes => files::path_of(name).file_stem().map_or(name.into(), |s| s.to_string_lossy().into_owned()),
            Kind::Cameras | Kind::Lights => name.into(),
        }
    }
}

/// A part of each picture that is shown magnified.
#[derive(Clone, Debug, PartialEq)]
pub struct Inset {
    /// Left, top, width and height as shares of the picture's sides.
    pub at: [f64; 4],
    /// Of its frame: red, green, blue.
    pub color: [u8; 3],
}

/// Colours of the frames of insets that have none of their own: dark and light enough for any picture, and told apart by the colour-blind.
pub const FRAMES: [[u8; 3]; 4] = [[230, 60, 0], [0, 140, 220], [240, 190, 0], [0, 160, 110]];

/// Where magnified insets stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    #[default]
    Below,
    Beside,
}

/// How wide a sheet is.
#[derive(Clone, Debug, PartialEq)]
pub enum Width {
    /// A journal's column, by its name in [`WIDTHS`].
    Journal(&'static str),
    /// Millimetres.
    Mm(f64),
    /// As wide as its pictures make it, whose width this is in pixels.
    Picture(u32),
}

/// A journal's columns: name, millimetres, what it is. From the classes acmart (sigconf: 241.1474 pt and 506.295 pt of 1/72.27 inch), IEEEtran
/// (21 pc and 43 pc) and egpubl (Computer Graphics Forum).
pub const WIDTHS: [(&str, f64, &str); 6] = [
    ("acm-1", 84.751, "ACM, one column"),
    ("acm-2", 177.936, "ACM, both columns"),
    ("ieee-1", 88.562, "IEEE, one column"),
    ("ieee-2", 181.340, "IEEE, both columns"),
    ("cgf-1", 84.0, "Eurographics, CGF: one column"),
    ("cgf-2", 177.0, "Eurographics, CGF: both columns"),
];

/// Most cells of a sheet, insets of a picture, and characters of a text.
const MOST_CELLS: usize = 4096;
pub const MOST_INSETS: usize = 4;
const MOST_TEXT: usize = 4000;

impl Default for Spec {
    fn default() -> Spec {
        Spec {
            base: Table::new(),
            rows: Axis::One,
            columns: Axis::One,
            width: Width::Journal("acm-2"),
            dpi: 300,
            font_size: 8.0,
            gap: 1.0,
            insets: Vec::new(),
            insets_at: Place::Below,
            legend: true,
            numbers: Vec::new(),
            measured_size: None,
            caption: String::new(),
            draw_caption: true,
            label: String::new(),
            cells: false,
        }
    }
}

/// The keys of a spec, and what each takes.
const KEYS: [(&str, &str); 17] = [
    ("base", "a table with a scene or a set-up's file, and keys of set-ups"),
    ("rows", AXIS),
    ("columns", AXIS),
    (
        "width",
        "a number of millimetres from 10 to 2000, or one of acm-1, acm-2, ieee-1, ieee-2, cgf-1, cgf-2, in quotes",
    ),
    ("picture_width", "a whole number of pixels from 16 to 16384, instead of width"),
    ("dpi", "a whole number of pixels an inch from 50 to 1200"),
    ("font_size", "a number of points from 4 to 24"),
    ("gap", "a number of millimetres from 0 to 20"),
    (
        "insets",
        "a list of up to 4 tables with at = [left, top, width, height] in shares of the picture, and color = \"#rrggbb\"",
    ),
    ("insets_at", "\"below\" or \"beside\""),
    ("legend", "true or false"),
    ("numbers", "a list of columns of the measuring record, such as [\"error_share\", \"rmse\", \"flip\"]"),
    ("measured_size", "two whole numbers from 1 to 16384 pixels"),
    ("caption", "a text of up to 4000 characters"),
    ("draw_caption", "true or false"),
    ("label", "letters, digits and :-_.+/ for LaTeX's \\label, such as \"fig:bench\""),
    ("cells", "true or false"),
];
const AXIS: &str = "one list of names, such as { techniques = [\"pcf\", \"vsm\", \"truth\"] } (techniques, cameras, lights, scenes or views; \"all\" for \
                    all), or tables with a label and keys of set-ups, as [[rows]]";

/// Why a key's value is refused.
fn refusal(key: &str, value: &Value) -> anyhow::Error {
    let takes = KEYS.iter().find(|(name, _)| *name == key).map_or("", |(_, takes)| takes);
    anyhow::anyhow!("{key} = {} is not allowed; it takes {takes}", shortened(&value.to_string()))
}

/// Most attributes of an element of a sheet, or equals signs of a spec in it.
const MOST_ATTRIBUTES: usize = 4096;

/// Whether a text is a spec, not a set-up: it has keys that only specs have.
pub fn is_figure(text: &str) -> bool {
    let own = |table: Table| ["base", "rows", "columns"].iter().any(|key| table.contains_key(*key));
    toml::from_str(text).is_ok_and(own)
}

/// Whether a picture's file is a sheet that holds its spec.
pub fn has_sheet(path: &Path) -> bool {
    matches!(sheet_text(path), Ok(Some(_)))
}

/// The spec inside a sheet.
fn sheet_text(path: &Path) -> Result<Option<String>> {
    let name = path.display();
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("svg")) {
        let text = files::read_text(path)?;
        let bad = || format!("{name} is not SVG that can be read");
        // Attributes of an element are compared each with each.
        let most = text.split('<').map(|tag| tag.matches('=').count()).max().unwrap_or(0);
        ensure!(most <= MOST_ATTRIBUTES, "{}: an element has more than {MOST_ATTRIBUTES} attributes", bad());
        let document = resvg::usvg::roxmltree::Document::parse(&text).with_context(bad)?;
        let held = document.descendants().find(|node| node.tag_name().name() == KEYWORD);
        return Ok(held.and_then(|node| node.text()).map(String::from));
    }
    capture::read_text(path, KEYWORD)
}

impl Spec {
    /// Reads a spec (.toml), or that inside a sheet (.png or .svg); a name of one that comes with the program will do.
    ///
    /// # Errors
    /// One sentence that names the file, the key and what is allowed.
    pub fn open(what: &str) -> Result<Spec> {
        let path = &files::path_of(what);
        if let Some((_, text)) = super::BUILT_IN.iter().find(|(name, _)| *name == what && !path.exists()) {
            return Spec::from_toml(text, Path::new(""));
        }
        let told = path.display();
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "toml" => {
                let text = files::read_text(path)?;
                Spec::from_toml(&text, path).with_context(|| format!("{told} is not a usable figure"))
            }
            "png" | "svg" => {
                let none = || format!("{told} holds no figure's spec; only sheets drawn by shadowscope do");
                let text = sheet_text(path)?.with_context(none)?;
                Spec::from_toml(&text, path).with_context(|| format!("the spec inside {told} cannot be used"))
            }
            _ => bail!(
                "{}: a figure is drawn from a spec (.toml), a sheet (.png, .svg), or one of {}",
                shortened(what),
                super::BUILT_IN.map(|(name, _)| name).join(", ")
            ),
        }
    }

    /// Reads a spec's text; scenes in it count from the folder of `path`.
    ///
    /// # Errors
    /// As [`Spec::open`].
    pub fn from_toml(text: &str, path: &Path) -> Result<Spec> {
        let mut table: Table = toml::from_str(text).map_err(|e| setup::one_line(&e.to_string()))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let known = || KEYS.iter().map(|(name, _)| *name);
        if let Some(key) = table.keys().find(|key| !known().any(|name| name == key.as_str())) {
            let meant = nearest(key, known()).map_or(String::new(), |name| format!(" (is {name} meant?)"));
            bail!("{} is unknown{meant}; there are {}", shortened(key), known().collect::<Vec<_>>().join(", "));
        }
        let mut spec = Spec::default();
        let Some(base) = table.remove("base") else {
            bail!("the table [base] is missing; it takes a scene or a set-up's file, and keys of set-ups");
        };
        let Value::Table(base) = base else { bail!(refusal("base", &base)) };
        spec.base = based(base, folder).context("base")?;
        for (key, axis) in [("rows", &mut spec.rows), ("columns", &mut spec.columns)] {
            if let Some(value) = table.remove(key) {
                *axis = read_axis(key, value, folder)?;
            }
        }
        ensure!(
            !(table.contains_key("width") && table.contains_key("picture_width")),
            "width and picture_width are both given; one says how wide the other is"
        );
        for (key, value) in &table {
            spec.take(key, value).with_context(|| refusal(key, value))??;
        }
        Ok(spec)
    }

    /// Takes over a key's value; None: it is of another type or out of range.
    fn take(&mut self, key: &str, value: &Value) -> Option<Result<()>> {
        let number = |least: f64, most: f64| {
            let number = value.as_float().or(value.as_integer().map(|i| i as f64))?;
            (least..=most).contains(&number).then_some(number)
        };
        let count = |least: u32, most: u32| {
            let number = u32::try_from(value.as_integer()?).ok()?;
            (least..=most).contains(&number).then_some(number)
        };
        let text = || value.as_str().filter(|text| text.chars().count() <= MOST_TEXT).map(String::from);
        match key {
            "width" => {
                let journal = value.as_str().and_then(|name| WIDTHS.iter().find(|w| w.0 == name));
                let journal = journal.map(|w| Width::Journal(w.0));
                self.width = journal.or_else(|| number(10.0, 2000.0).map(Width::Mm))?;
            }
            "picture_width" => self.width = Width::Picture(count(16, MAX_SIZE)?),
            "dpi" => self.dpi = count(50, 1200)?,
            "font_size" => self.font_size = number(4.0, 24.0)?,
            "gap" => self.gap = number(0.0, 20.0)?,
            "legend" => self.legend = value.as_bool()?,
            "draw_caption" => self.draw_caption = value.as_bool()?,
            "cells" => self.cells = value.as_bool()?,
            "caption" => self.caption = text()?,
            "label" => self.label = text().filter(|label| label.chars().all(is_of_label))?,
            "insets_at" => {
                self.insets_at = match value.as_str()? {
                    "below" => Place::Below,
                    "beside" => Place::Beside,
                    _ => return None,
                }
            }
            "measured_size" => {
                let sides: Vec<u32> =
                    value.as_array()?.iter().map(|v| u32::try_from(v.as_integer()?).ok()).collect::<Option<_>>()?;
                let size: [u32; 2] = sides.try_into().ok()?;
                self.measured_size = size.iter().all(|s| (1..=MAX_SIZE).contains(s)).then_some(Some(size))?;
            }
            "numbers" => {
                self.numbers = value.as_array()?.iter().map(|v| v.as_str().map(String::from)).collect::<Option<_>>()?;
                return Some(self.numbers.iter().try_for_each(|id| measurable(id).map(|_| ()).context("numbers")));
            }
            "insets" => {
                let list = value.as_array().filter(|list| list.len() <= MOST_INSETS)?;
                let read = |(i, inset)| read_inset(i, inset).with_context(|| format!("inset {}", i + 1));
                match list.iter().enumerate().map(read).collect() {
                    Ok(insets) => self.insets = insets,
                    Err(e) => return Some(Err(e)),
                }
            }
            _ => return None,
        }
        Some(Ok(()))
    }

    /// The spec as TOML text for a file: scenes count from that file's folder.
    pub fn to_toml(&self, file: &Path) -> Result<String> {
        let near = |table: &Table| {
            let mut table = table.clone();
            if let Some(Value::String(scene)) = table.get_mut("scene") {
                *scene = setup::from_folder_of(file, scene);
            }
            Value::Table(table)
        };
        let texts = |list: &[String]| Value::Array(list.iter().map(|text| text.as_str().into()).collect());
        let axis = |axis: &Axis| match axis {
            Axis::One => None,
            Axis::List(kind, names) => {
                let named = |name: &String| match kind {
                    Kind::Scenes => setup::from_folder_of(file, name),
                    _ => name.clone(),
                };
                let names: Vec<String> = names.iter().map(named).collect();
                let list = if names == ["all"] { "all".into() } else { texts(&names) };
                Some(Value::Table(Table::from_iter([(kind.id().to_string(), list)])))
            }
            Axis::Changes(changes) => {
                let one = |change: &Change| {
                    let Value::Table(mut table) = near(&change.keys) else { return Value::Table(Table::new()) };
                    table.extend(change.label.iter().map(|label| ("label".to_string(), label.as_str().into())));
                    Value::Table(table)
                };
                Some(Value::Array(changes.iter().map(one).collect()))
            }
        };
        let mut out = Table::new();
        let mut put = |key: &str, value: Value| _ = out.insert(key.into(), value);
        match self.width {
            Width::Journal(name) => put("width", name.into()),
            Width::Mm(mm) => put("width", mm.into()),
            Width::Picture(pixels) => put("picture_width", pixels.into()),
        }
        put("dpi", self.dpi.into());
        put("font_size", self.font_size.into());
        put("gap", self.gap.into());
        put("insets_at", if self.insets_at == Place::Below { "below" } else { "beside" }.into());
        put("legend", self.legend.into());
        put("numbers", texts(&self.numbers));
        if let Some(size) = self.measured_size {
            put("measured_size", Value::Array(size.map(Value::from).into()));
        }
        put("caption", self.caption.as_str().into());
        put("draw_caption", self.draw_caption.into());
        put("label", self.label.as_str().into());
        put("cells", self.cells.into());
        let inset = |inset: &Inset| {
            let [r, g, b] = inset.color;
            let color = format!("#{r:02x}{g:02x}{b:02x}");
            let at = Value::Array(inset.at.map(Value::Float).into());
            Value::Table(Table::from_iter([("at".to_string(), at), ("color".to_string(), color.into())]))
        };
        if !self.insets.is_empty() {
            put("insets", Value::Array(self.insets.iter().map(inset).collect()));
        }
        put("base", near(&self.base));
        for (key, value) in [("rows", axis(&self.rows)), ("columns", axis(&self.columns))] {
            value.into_iter().for_each(|value| put(key, value));
        }
        toml::to_string(&out).context("the figure's spec cannot be written as TOML")
    }

    /// The set-up that the sheet starts from.
    ///
    /// # Errors
    /// As [`Setup::from_toml`].
    pub fn open_base(&self) -> Result<(Setup, Scene)> {
        let name = setup::scene_name(&self.base)?.to_string();
        let mut scene = setup::load_scene(&name)?;
        let (setup, _) = in_scene(self.base.clone(), &name, &mut scene).context("base")?;
        Ok((setup, scene))
    }

    /// What each row or column changes; `scene` is the base's.
    pub fn changes(&self, axis: &Axis, scene: &Scene) -> Result<Vec<Change>> {
        let changes = match axis {
            Axis::One => vec![Change::default()],
            Axis::List(kind, names) => {
                let names = if names == &["all"] { kind.names(scene) } else { names.clone() };
                let one = |name: &String| {
                    let keys = Table::from_iter([(kind.key().to_string(), name.as_str().into())]);
                    Change { label: Some(kind.label(name)), keys }
                };
                names.iter().map(one).collect()
            }
            Axis::Changes(changes) => changes.clone(),
        };
        ensure!(!changes.is_empty(), "a sheet needs at least one row and one column");
        Ok(changes)
    }

    /// The keys of the set-up of a cell.
    pub fn cell(&self, row: &Change, column: &Change) -> Table {
        let mut keys = self.base.clone();
        // Of two changes of the scene the other's camera is kept, which is meant for it.
        let (first, second) = if column.keys.contains_key("scene") { (column, row) } else { (row, column) };
        change(&mut keys, &first.keys);
        change(&mut keys, &second.keys);
        keys
    }

    /// Cells that the axes make.
    pub fn check_count(rows: usize, columns: usize) -> Result<()> {
        ensure!(
            rows.saturating_mul(columns) <= MOST_CELLS,
            "{rows} rows of {columns} columns are too many; a sheet has up to {MOST_CELLS} pictures"
        );
        Ok(())
    }
}

/// The set-up of a cell's keys in their scene. A camera or a light may be written as on the command line.
/// Where the technique lacks the view that another has, the view stays away; that it did is told beside the set-up.
pub(super) fn in_scene(mut keys: Table, name: &str, scene: &mut Scene) -> Result<(Setup, Option<String>)> {
    let mut written = |key: &str| match keys.get(key) {
        Some(Value::String(text)) if text.contains(':') => {
            let text = text.clone();
            keys.remove(key);
            Some(text)
        }
        _ => None,
    };
    let [camera, shadow_camera, light] = ["camera", "shadow_camera", "light"].map(&mut written);
    if keys.get("technique").and_then(Value::as_str) == Some(Side::TRUTH) {
        // The truth is a side of a comparison, which then shows it alone; the other serves every light.
        keys.insert("technique".into(), "rt-hard".into());
        let truth = Table::from_iter([("technique".to_string(), Side::TRUTH.into())]);
        keys.insert("against".into(), Value::Array(vec![truth.into()]));
        keys.insert("arrange".into(), "flicker".into());
        keys.insert("front".into(), 1.into());
        keys.remove("overlay");
    }
    keys.insert("legend".into(), false.into());
    let shared = |id: &str| view::VIEWS.iter().any(|v| v.id == id);
    let own = keys.get("view").and_then(Value::as_str).filter(|id| !shared(id)).map(String::from);
    let own = own.filter(|id| techniques::ALL.iter().any(|info| has_view(info, id)));
    if own.is_some() {
        keys.remove("view");
    }
    let (mut setup, note) = Setup::in_scene(keys, name, scene)?;
    scene.notes.extend(note);
    let clock = setup.clock();
    if let Some(text) = camera {
        setup.camera = setup::parse_camera(scene, &text, clock)?;
    }
    if let Some(text) = shadow_camera {
        setup.shadow_camera = Some(setup::parse_camera(scene, &text, clock)?);
    }
    if let Some(text) = light {
        setup.light = setup::parse_light(scene, &text, clock)?;
        setup.fit_path();
    }
    let mut lacking = None;
    if let Some(id) = own {
        match setup.find_view(&id) {
            Some(_) => setup.view = id,
            None => lacking = Some(format!("{} has no view {id}", legend::side_name(&setup, 0))),
        }
    }
    setup.check()?;
    Ok((setup, lacking))
}

/// Whether a technique has a view with its parameters at their defaults.
fn has_view(info: &techniques::Info, id: &str) -> bool {
    let mut values = Values::new();
    info.fill(&mut values, 1.0);
    view::find(id, info, &values).is_some()
}

/// Keys that mean something in one scene only.
const OF_SCENE: [&str; 9] =
    ["camera", "shadow_camera", "light", "light_on", "light_number", "more_lights", "path", "time", "animation"];

/// Lets keys take other values. Another scene has cameras and lights of its own. Tables are changed key by key, unless the new one is whole.
fn change(keys: &mut Table, to: &Table) {
    if to.contains_key("scene") {
        OF_SCENE.iter().for_each(|key| _ = keys.remove(*key));
    }
    if to.contains_key("technique") {
        // What was beside the base's technique stays, but for a truth that stood alone.
        let alone = keys.get("arrange").and_then(Value::as_str) == Some("flicker");
        if alone {
            ["against", "arrange", "front"].iter().for_each(|key| _ = keys.remove(*key));
        }
    }
    setup::lay_over(keys, to, &whole);
}

/// Whether a table stands for all of the key.
fn whole(key: &str, table: &Table) -> bool {
    match key {
        "light" => table.contains_key("kind"),
        "camera" | "shadow_camera" => table.contains_key("position") && table.contains_key("target"),
        "path" => true,
        _ => false,
    }
}

/// The base's keys with those of the set-up's file that it may name, and its scene as it is found from here.
fn based(mut base: Table, folder: &Path) -> Result<Table> {
    let name = setup::beside(setup::scene_name(&base)?, folder);
    let path = files::path_of(&name);
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let text = match ending.as_str() {
        "toml" => Some(files::read_text(&path)?),
        held if capture::HOLD.contains(&held) => Some(capture::read_setup(&path)?),
        _ => None,
    };
    base.insert("scene".into(), name.as_str().into());
    let Some(text) = text else { return Ok(base) };
    let mut keys = setup::read_table(&text).with_context(|| format!("{} is not a usable set-up", path.display()))?;
    let scene = setup::beside(setup::scene_name(&keys)?, path.parent().unwrap_or(Path::new("")));
    keys.insert("scene".into(), scene.into());
    base.remove("scene");
    change(&mut keys, &base);
    Ok(keys)
}

fn read_axis(key: &str, value: Value, folder: &Path) -> Result<Axis> {
    let wrong = refusal(key, &value);
    match value {
        Value::Table(table) => {
            let mut entries = table.into_iter();
            let (Some((name, list)), None) = (entries.next(), entries.next()) else { bail!(wrong) };
            let Some(kind) = Kind::ALL.into_iter().find(|kind| kind.id() == name) else {
                let kinds = Kind::ALL.map(Kind::id);
                let meant = nearest(&name, kinds).map_or(String::new(), |kind| format!(" (is {kind} meant?)"));
                bail!("{key}.{} is unknown{meant}; there are {}", shortened(&name), kinds.join(", "));
            };
            let names: Option<Vec<String>> = match &list {
                Value::String(all) if all == "all" => Some(vec!["all".into()]),
                Value::Array(list) if !list.is_empty() => list.iter().map(|v| v.as_str().map(String::from)).collect(),
                _ => None,
            };
            let mut names = names.with_context(|| {
                let given = shortened(&list.to_string());
                format!("{key}.{name} = {given} is not allowed; it takes a list of names in quotes, or \"all\"")
            })?;
            if names != ["all"] {
                for name in &mut names {
                    match kind {
                        Kind::Techniques if name != Side::TRUTH => {
                            _ = techniques::find_or_say(name).with_context(|| key.to_string())?
                        }
                        Kind::Scenes => *name = setup::beside(name, folder),
                        _ => {}
                    }
                }
            }
            Ok(Axis::List(kind, names))
        }
        Value::Array(list) => {
            let mut changes = Vec::new();
            for (i, value) in list.into_iter().enumerate() {
                let Value::Table(mut keys) = value else { bail!(wrong) };
                let whose = format!("{} {}", key.trim_end_matches('s'), i + 1);
                let label = match keys.remove("label") {
                    Some(Value::String(label)) => Some(message::cut(&label, 200)),
                    None => None,
                    Some(other) => {
                        bail!("{whose}: label = {} is not allowed; it takes a text", shortened(&other.to_string()))
                    }
                };
                if let Some(key) = ["size", "legend", "supersample"].into_iter().find(|key| keys.contains_key(*key)) {
                    bail!(
                        "{whose}: {key} is the same for all pictures; give it in [base]{}",
                        if key == "legend" { " or beside it" } else { "" }
                    );
                }
                if let Some(Value::String(scene)) = keys.get_mut("scene") {
                    *scene = setup::beside(scene, folder);
                }
                changes.push(Change { label, keys });
            }
            ensure!(!changes.is_empty(), "{key} is empty; leave it out for a single one");
            Ok(Axis::Changes(changes))
        }
        _ => bail!(wrong),
    }
}

fn read_inset(i: usize, value: &Value) -> Result<Inset> {
    let Some(table) = value.as_table() else {
        bail!("{} is no table with at and color", shortened(&value.to_string()))
    };
    if let Some(key) = table.keys().find(|key| !["at", "color"].contains(&key.as_str())) {
        bail!("{} is unknown; there are at, color", shortened(key));
    }
    let at = table.get("at").context("at is missing; it takes left, top, width and height in shares of the picture")?;
    let numbers: Vec<f64> =
        at.as_array().into_iter().flatten().filter_map(|v| v.as_float().or(v.as_integer().map(|i| i as f64))).collect();
    let inside = |at: &[f64; 4]| {
        let [x, y, w, h] = *at;
        x >= 0.0 && y >= 0.0 && w > 0.0 && h > 0.0 && x + w <= 1.0 + 1e-6 && y + h <= 1.0 + 1e-6
    };
    let at: [f64; 4] = numbers.try_into().ok().filter(inside).with_context(|| {
        let given = shortened(&at.to_string());
        format!("at = {given} is not allowed; it takes left, top, width and height of a part of the picture, in shares of its sides from 0 to 1")
    })?;
    let color = match table.get("color") {
        None => FRAMES[i % FRAMES.len()],
        Some(value) => {
            let hex =
                value.as_str().and_then(|text| text.strip_prefix('#')).filter(|hex| hex.len() == 6 && hex.is_ascii());
            let part = |i: usize| u8::from_str_radix(hex?.get(2 * i..2 * i + 2)?, 16).ok();
            match (part(0), part(1), part(2)) {
                (Some(r), Some(g), Some(b)) => [r, g, b],
                _ => bail!(
                    "color = {} is not allowed; it takes a colour such as \"#e63c00\"",
                    shortened(&value.to_string())
                ),
            }
        }
    };
    Ok(Inset { at, color })
}

/// Columns that cells are not measured for: they need frames over time or seeds.
const LEFT_OUT: [&str; 5] = ["seed_noise", "seed_bias", "settle_frames", "settle_rmse", "lag_frames"];

/// A column that can stand below a picture.
///
/// # Errors
/// No such column, or one that sheets do not measure.
pub fn measurable(id: &str) -> Result<&'static Column> {
    let column = Column::find(id)?;
    ensure!(!LEFT_OUT.contains(&id), "{id} is not measured for sheets; `shadowscope measure` tells it");
    Ok(column)
}

/// The name that differs least from what was written, if it differs little.
fn nearest<'a>(written: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let cost = |name: &str| {
        let (a, b): (Vec<char>, Vec<char>) = (written.chars().take(40).collect(), name.chars().collect());
        let mut row: Vec<usize> = (0..=b.len()).collect();
        for (i, x) in a.iter().enumerate() {
            let mut before = std::mem::replace(&mut row[0], i + 1);
            for (j, y) in b.iter().enumerate() {
                let new = (before + usize::from(x != y)).min(row[j] + 1).min(row[j + 1] + 1);
                before = std::mem::replace(&mut row[j + 1], new);
            }
        }
        row[b.len()]
    };
    names
        .into_iter()
        .map(|name| (cost(name), name))
        .min()
        .filter(|(cost, name)| *cost <= 1 + name.len() / 4)
        .map(|(_, name)| name)
}
