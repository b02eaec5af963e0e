//! Figure sheets: layout, insets, numbers, files that repeat and reopen, errors, the tour, and the window's builder.

use crate::common::{gpu, ok, shadowscope};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use image::RgbaImage;
use shadowscope::figure::layout::{Grid, nearest};
use shadowscope::figure::{self, Axis, Format, Kind, Sheet, Spec, Width};
use shadowscope::frame::Renderer;
use shadowscope::measure::{self, Column, accuracy};
use shadowscope::message;
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::{self, Setup};
use shadowscope::ui::{self, Action, Model, Tab};
use std::path::Path;
use std::sync::Arc;

const SMALL: &str = r##"
width = 60
dpi = 100
font_size = 6
numbers = ["error_share", "rmse", "flip"]
insets = [{ at = [0.25, 0.5, 0.125, 0.25] }, { at = [0.5, 0.25, 0.25, 0.25], color = "#112233" }]
caption = "50 % of A_1 & B: {rmse 1,1} {{x}}"
columns = { techniques = ["shadow-map", "pcf", "truth"] }
[base]
scene = "cubes"
size = [160, 80]
[base.params.pcf]
kernel = 5
"##;

fn spec(text: &str) -> Spec {
    Spec::from_toml(text, Path::new("x.toml")).unwrap()
}

fn drawn(spec: &Spec) -> Sheet {
    figure::draw(spec, &gpu(), &mut |_, _| true).unwrap()
}

fn shapes(grid: &Grid, rows: usize, columns: usize, shape: f64) -> Vec<[u32; 4]> {
    let high = (f64::from(grid.picture) * shape).round() as u32;
    (0..rows * columns).map(|i| [grid.column(i % columns), 0, grid.picture, high]).collect()
}

/// The sheet is as wide as asked for; pictures are of one width, whole pixels, and gaps between them.
#[test]
fn widths_add_up() {
    for (width, mm) in [("\"acm-1\"", 84.751), ("\"ieee-2\"", 181.34), ("120", 120.0), ("53.25", 53.25)] {
        for columns in 1..=4 {
            for labels in 0..=2 {
                let spec = spec(&format!("width = {width}\ndpi = 300\ngap = 2\n[base]\nscene = \"cubes\""));
                let grid = Grid::new(&spec, columns, &[0.5], labels).unwrap();
                assert_eq!(grid.width, (mm / 25.4 * 300.0_f64).round() as u32);
                assert_eq!(grid.gap, 24, "2 mm at 300 pixels an inch are 23.6");
                let font = 8.0 * 300.0 / 72.0;
                let left = if labels > 0 { (labels as f64 * 1.25 * font + 0.3 * font).round() as u32 } else { 0 };
                assert_eq!(grid.left, left);
                let all = shapes(&grid, 1, columns, 0.5);
                let end = all.last().map(|a| a[0] + a[2]).unwrap();
                assert!(end <= grid.width && grid.width - end < columns as u32, "{end} of {}", grid.width);
                assert!(all.windows(2).all(|w| w[1][0] == w[0][0] + w[0][2] + grid.gap));
            }
        }
    }
    // By its pictures: the other way round.
    let own = spec("picture_width = 200\ndpi = 254\ngap = 1\n[base]\nscene = \"cubes\"");
    let grid = Grid::new(&own, 3, &[0.5], 0).unwrap();
    assert_eq!((grid.picture, grid.gap, grid.width), (200, 10, 3 * 200 + 2 * 10));
    let narrow = spec("width = 10\ndpi = 50\n[base]\nscene = \"cubes\"");
    let error = Grid::new(&narrow, 4, &[0.5], 1).unwrap_err().to_string();
    assert!(error.contains("larger width"), "{error}");
}

/// Insets keep the shape of what they show and fill the picture's width, or its height.
#[test]
fn insets_fill_a_side() {
    for place in ["below", "beside"] {
        let text = SMALL.replace("font_size = 6", &format!("font_size = 6\ninsets_at = \"{place}\"\n"));
        let text = text.replace("dpi = 100", "dpi = 600").replace("width = 60", "width = 170");
        let spec = spec(&text);
        for shape in [0.5, 0.75, 1.5] {
            let grid = Grid::new(&spec, 2, &[shape], 0).unwrap();
            let size = [grid.picture, (f64::from(grid.picture) * shape).round() as u32];
            let boxes = grid.insets(&spec, size);
            assert_eq!(boxes.len(), 2);
            for b in &boxes {
                let [wide, high] = [b.texels[2], b.texels[3]].map(f64::from);
                let [across, down] = [b.at[2], b.at[3]].map(f64::from);
                assert!((across / down - wide / high).abs() < 3.0 / down.min(across), "{place} {shape}: {b:?}");
            }
            let last = boxes[1].at;
            match place {
                "below" => {
                    let full = boxes[0].at[3] == size[1];
                    assert!(full || last[0] + last[2] == size[0], "{boxes:?} under {size:?}");
                    assert_eq!(boxes[0].at[1], size[1] + grid.inner);
                    assert_eq!(last[0], boxes[0].at[2] + grid.inner);
                }
                _ => {
                    assert!(
                        (i64::from(last[1] + last[3]) - i64::from(size[1])).abs() <= 2,
                        "{boxes:?} beside {size:?}"
                    );
                    assert!(last[0] + last[2] <= grid.cell && grid.cell <= grid.width / 2);
                    assert!(grid.width / 2 - last[0] - last[2] <= grid.gap + 3, "{grid:?} {boxes:?}");
                }
            }
        }
    }
}

/// The middle of each pixel falls into the texel that it shows; whole factors give equal blocks.
#[test]
fn magnifying_takes_the_nearest_texel() {
    assert_eq!(nearest(7, 3, 9).collect::<Vec<_>>(), [7, 7, 7, 8, 8, 8, 9, 9, 9]);
    for (texels, pixels) in [(5, 13), (13, 5), (1, 7), (100, 100)] {
        for (i, found) in nearest(2, texels, pixels).enumerate() {
            let middle = (i as f64 + 0.5) * f64::from(texels) / f64::from(pixels);
            assert_eq!(found, 2 + middle.floor() as u32, "{i} of {pixels}");
        }
    }
}

fn picture(bytes: &[u8]) -> RgbaImage {
    image::load_from_memory(bytes).unwrap().into_rgba8()
}

/// What lies between an inset's frames in the file are the texels of the cell's capture, and nothing else.
#[test]
fn insets_and_pictures_are_the_captures_own_pixels() {
    let dir = tempfile::tempdir().unwrap();
    let sheet = drawn(&Spec { cells: true, ..spec(SMALL) });
    figure::write(&sheet, dir.path(), "s", &[Format::Png]).unwrap();
    let page = picture(&std::fs::read(dir.path().join("s.png")).unwrap());
    assert_eq!(page.width(), (60.0 / 25.4 * 100.0_f64).round() as u32);
    for (i, name) in ["shadow-map", "pcf", "truth"].into_iter().enumerate() {
        let path = dir.path().join(format!("{name}.png"));
        let cell = picture(&std::fs::read(&path).unwrap());
        let top = sheet
            .items
            .iter()
            .find_map(|item| match item {
                figure::Item::Picture { at, cell, .. } if *cell == i => Some(*at),
                _ => None,
            })
            .unwrap();
        assert_eq!([top[0], top[2], top[3]], [sheet.grid.column(i), cell.width(), cell.height()]);
        let boxes = sheet.grid.insets(&sheet.spec, [cell.width(), cell.height()]);
        let edge = 3;
        let mut compared = 0;
        for b in &boxes {
            let rows: Vec<u32> = nearest(b.texels[1], b.texels[3], b.at[3]).collect();
            let columns: Vec<u32> = nearest(b.texels[0], b.texels[2], b.at[2]).collect();
            for y in edge..b.at[3] - edge {
                for x in edge..b.at[2] - edge {
                    let seen = page.get_pixel(top[0] + b.at[0] + x, top[1] + b.at[1] + y);
                    assert_eq!(seen, cell.get_pixel(columns[x as usize], rows[y as usize]), "{name} {x} {y}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 100, "{compared}");
        // Outside the frames the picture is the capture.
        let framed = |x: u32, y: u32| {
            boxes.iter().any(|b| {
                let [l, t, w, h] = b.texels;
                x + 2 >= l && x <= l + w + 2 && y + 2 >= t && y <= t + h + 2
            })
        };
        for (x, y, pixel) in cell.enumerate_pixels().filter(|(x, y, _)| !framed(*x, *y)) {
            assert_eq!(page.get_pixel(top[0] + x, top[1] + y), pixel, "{name} {x} {y}");
        }
        // And it reopens as that.
        let (setup, _) = Setup::open(path.to_str().unwrap()).unwrap();
        assert_eq!(setup.size, [cell.width(), cell.height()]);
    }
}

/// Numbers below pictures and in the caption are those that measuring the cell's capture gives; the truth has none.
#[test]
fn numbers_are_measured_ones() {
    let sheet = drawn(&spec(SMALL));
    for column in 0..2 {
        let cell = sheet.cell(0, column);
        let scene = setup::load_scene("cubes").unwrap();
        let mut renderer = Renderer::new(gpu(), Arc::new(scene)).unwrap();
        let row = accuracy(&mut renderer, &cell.setup, 0).unwrap();
        let held = cell.record.as_ref().unwrap();
        assert_eq!((row.rmse, row.flip, row.error_share), (held.rmse, held.flip, held.error_share));
        let rmse = Column::find("rmse").unwrap();
        assert_eq!(cell.number(rmse).unwrap(), format!("RMSE\u{a0}{}", rmse.rounded(&row)));
        let share = Column::find("error_share").unwrap();
        assert_eq!(cell.number(share).unwrap(), format!("error\u{a0}{}\u{a0}%", share.rounded(&row)));
    }
    assert!(sheet.cell(0, 2).record.is_none(), "the truth is not measured");
    let rmse = Column::find("rmse").unwrap().rounded(sheet.cell(0, 0).record.as_ref().unwrap());
    assert_eq!(sheet.caption, format!("50 % of A_1 & B: {rmse} {{x}}"));
    // The command line says the same.
    let dir = tempfile::tempdir().unwrap();
    figure::write(
        &Sheet { spec: Spec { cells: true, ..sheet.spec.clone() }, ..sheet.clone() },
        dir.path(),
        "s",
        &[Format::Png],
    )
    .unwrap();
    ok(dir.path(), &["measure", "pcf.png", "--techniques", "pcf", "--csv", "rows.csv"]);
    let rows = measure::read(&dir.path().join("rows.csv")).unwrap();
    let held = sheet.cell(0, 1).record.as_ref().unwrap();
    assert_eq!((rows[0].rmse, rows[0].error_share), (held.rmse, held.error_share));
}

/// All four files repeat byte for byte, and so do those of a sheet that is drawn again from its PNG or SVG in another folder.
#[test]
fn files_repeat_and_reopen() {
    let dir = tempfile::tempdir().unwrap();
    let scene = format!("{}/tests/data/origin.glb", env!("CARGO_MANIFEST_DIR"));
    std::fs::copy(&scene, dir.path().join("scene.glb")).unwrap();
    let text = SMALL
        .replace("\"cubes\"", "\"scene.glb\"")
        .replace("columns =", "rows = { scenes = [\"scene.glb\", \"cubes\"] }\ncolumns =");
    std::fs::write(dir.path().join("s.toml"), &text).unwrap();
    ok(dir.path(), &["figure", "s.toml", "-o", "a"]);
    ok(dir.path(), &["figure", "s.toml", "-o", "b/deeper"]);
    let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    let again = |what: &str, folder: &str| {
        ok(dir.path(), &["figure", what, "-o", folder]);
        for ending in ["svg", "pdf", "tex", "png"] {
            let same = read(&format!("a/s.{ending}")) == read(&format!("{folder}/s.{ending}"));
            assert!(same, "{what}: the {ending} differs");
        }
    };
    for ending in ["pdf", "tex"] {
        assert_eq!(read(&format!("a/s.{ending}")), read(&format!("b/deeper/s.{ending}")), "{ending}");
    }
    // The way to the scene is another from there; the pixels are the same.
    assert_eq!(picture(&read("a/s.png")), picture(&read("b/deeper/s.png")));
    again("s.toml", "c");
    again("a/s.png", "d");
    again("a/s.svg", "e");
    again("b/deeper/s.png", "f");
    let pdf = read("a/s.pdf");
    assert!(pdf.starts_with(b"%PDF-") && !pdf.windows(12).any(|w| w == b"CreationDate"));
    let tex = String::from_utf8(read("a/s.tex")).unwrap();
    assert!(tex.contains("\\caption{50 \\% of A\\_1 \\& B: 0") && tex.contains("\\{x\\}}"), "{tex}");
    // The SVG's 59.944 mm.
    assert!(tex.contains("\\includegraphics[width=169.920bp, trim=0 ") && tex.contains("]{s.pdf}"), "{tex}");
    let svg = String::from_utf8(read("a/s.svg")).unwrap();
    for needed in [">Shadow map</text>", "data:image/png;base64,", "<metadata>", "width=\"59.944mm\""] {
        assert!(svg.contains(needed), "no {needed}");
    }
    // It is no set-up, and says so.
    let out = shadowscope(dir.path(), &["capture", "a/s.png", "-o", "x.png"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains("holds no set-up"));
}

/// The caption without places for numbers is followed by all of them.
#[test]
fn latex_holds_the_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let sheet = drawn(&spec(
        &SMALL
            .replace("50 % of A_1 & B: {rmse 1,1} {{x}}", "x^2 ~ \\\\ {{}} #$")
            .replace("width = 60", "width = \"acm-1\""),
    ));
    figure::write(&sheet, dir.path(), "my figure", &[Format::Tex]).unwrap();
    let tex = std::fs::read_to_string(dir.path().join("my figure.tex")).unwrap();
    let value = |i: usize, id: &str| Column::find(id).unwrap().rounded(sheet.cell(0, i).record.as_ref().unwrap());
    let rmse = format!("RMSE: Shadow map {}, Percentage-closer filtering {}.", value(0, "rmse"), value(1, "rmse"));
    assert!(tex.contains(&rmse), "{tex}");
    assert!(tex.contains("error, \\%: "), "{tex}");
    assert!(tex.contains("x\\textasciicircum{}2 \\textasciitilde{} \\textbackslash{} \\{\\} \\#\\$"), "{tex}");
    assert!(tex.contains("\\detokenize{my figure.pdf}") && tex.contains("\\label{fig:myfigure}"), "{tex}");
    assert!(tex.contains("\\includegraphics[width=\\columnwidth"), "{tex}");
}

/// Axes, labels and changes of several kinds; what a technique does not serve stays empty and says so.
#[test]
fn rows_and_columns_change_the_setup() {
    let text = r#"
picture_width = 64
legend = true
[base]
scene = "cubes"
size = [64, 48]
view = "visibility"
[[rows]]
label = "sun, wide"
light = "sun:angular_radius=2"
[[rows]]
label = "lamp"
light = "omni:position=2,6,3;range=40;color=80,80,80"
[[columns]]
technique = "pcf"
params.pcf.kernel = 3
[[columns]]
technique = "pcf"
params.pcf.kernel = 9
[[columns]]
technique = "cube"
[[columns]]
technique = "truth"
"#;
    let sheet = drawn(&spec(text));
    assert_eq!(sheet.count, [2, 4]);
    let labels: Vec<&str> = (0..4).map(|i| sheet.cell(0, i).labels[0].as_str()).collect();
    assert_eq!(labels[0], "kernel = 3, Percentage-closer filtering");
    assert_eq!(labels[3], "Ray-traced truth");
    assert_eq!(sheet.cell(0, 0).setup.light.radius(), 2f32.to_radians().tan());
    let refused = |i: usize, j: usize| sheet.cell(i, j).refused.is_some();
    assert_eq!([0, 1, 2, 3].map(|j| refused(0, j)), [false, false, true, false]);
    assert_eq!([0, 1, 2, 3].map(|j| refused(1, j)), [true, true, false, false]);
    assert!(sheet.cell(1, 0).refused.as_ref().unwrap().contains("not omni"));
    assert_ne!(sheet.cell(0, 0).picture, sheet.cell(0, 1).picture, "another kernel is another picture");
    // One legend for all.
    let texts = |wanted: &str| {
        let same = |item: &&figure::Item| matches!(item, figure::Item::Text { text, .. } if text == wanted);
        sheet.items.iter().filter(same).count()
    };
    assert_eq!(texts("Visibility"), 1);
}

/// A bad spec gives one sentence: where, which key, what is allowed.
#[test]
fn bad_specs_are_refused_in_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let base = "[base]\nscene = \"cubes\"\n";
    for (text, words) in [
        ("widht = 3\n[base]\nscene = \"cubes\"", &["widht is unknown (is width meant?)", "dpi"][..]),
        ("width = 3\n[base]\nscene = \"cubes\"", &["width = 3 is not allowed", "acm-1"]),
        ("width = \"acm\"\n[base]\nscene = \"cubes\"", &["width = \"acm\" is not allowed"]),
        ("picture_width = 40\nwidth = 80\n[base]\nscene = \"cubes\"", &["both given"]),
        ("label = \"a}b\"\n[base]\nscene = \"cubes\"", &["label = \"a}b\" is not allowed", "letters, digits"]),
        ("dpi = 30\n[base]\nscene = \"cubes\"", &["dpi = 30 is not allowed", "50 to 1200"]),
        ("rows = 3\n[base]\nscene = \"cubes\"", &["rows = 3 is not allowed"]),
        (
            "rows = { technique = [\"pcf\"] }\n[base]\nscene = \"cubes\"",
            &["rows.technique is unknown (is techniques meant?)"],
        ),
        ("rows = { techniques = [\"pfc\"] }\n[base]\nscene = \"cubes\"", &["rows", "pfc"]),
        ("rows = { techniques = [] }\n[base]\nscene = \"cubes\"", &["rows.techniques = [] is not allowed"]),
        (
            "rows = { cameras = [\"nowhere\"] }\n[base]\nscene = \"cubes\"",
            &["row 1, column 1", "no camera named nowhere"],
        ),
        ("numbers = [\"rms\"]\n[base]\nscene = \"cubes\"", &["numbers", "rms: there is no such column", "rmse"]),
        ("numbers = [\"seed_bias\"]\n[base]\nscene = \"cubes\"", &["seed_bias is not measured"]),
        ("insets = [{ at = [0.5, 0.5, 0.6, 0.1] }]\n[base]\nscene = \"cubes\"", &["inset 1", "at = ", "from 0 to 1"]),
        (
            "insets = [{ at = [0, 0, 1, 1], color = \"red\" }]\n[base]\nscene = \"cubes\"",
            &["inset 1", "color = \"red\""],
        ),
        ("insets = [{ size = 1 }]\n[base]\nscene = \"cubes\"", &["inset 1", "size is unknown"]),
        (
            "picture_width = 32\ncaption = \"{rmse 3,1}\"\nnumbers = [\"rmse\"]\n[base]\nscene = \"cubes\"\nsize=[32,32]",
            &["caption", "outside the sheet"],
        ),
        (
            "picture_width = 32\ncaption = \"{mae 1,1}\"\n[base]\nscene = \"cubes\"\nsize=[32,32]",
            &["caption", "mae is not measured"],
        ),
        ("[base]\nscne = \"cubes\"", &["base", "key scene is missing"]),
        ("width = 80", &["[base] is missing"]),
        ("[base]\nscene = \"cubes\"\nzoom = 3", &["zoom is unknown"]),
        ("[base]\nscene = \"cubes\"\n[[rows]]\nsize = [3, 3]", &["row 1", "size is the same for all"]),
        (
            "[base]\nscene = \"cubes\"\n[[rows]]\ntechnique = \"pcf\"\nparams.pcf.kernel = 4000",
            &["row 1", "pcf.kernel"],
        ),
        ("[base]\nscene = \"atlantis\"", &["atlantis", "neither a built-in scene"]),
        ("[base", &["not a usable figure"]),
    ] {
        std::fs::write(dir.path().join("bad.toml"), text).unwrap();
        let path = dir.path().join("bad.toml");
        let drawn = Spec::open(path.to_str().unwrap()).and_then(|spec| figure::draw(&spec, &gpu(), &mut |_, _| true));
        let said = message::sentence(&drawn.err().unwrap_or_else(|| panic!("{text} is drawn")));
        assert!(words.iter().all(|word| said.contains(word)), "{text}\n{said}");
    }
    std::fs::write(dir.path().join("bad.toml"), "widht = 3").unwrap();
    for (args, word) in [
        (&["figure", "bad.toml", "-o", "out"][..], "bad.toml is not a usable figure"),
        (&["figure", "none.toml", "-o", "out"], "none.toml"),
        (&["figure", "bench", "-o", "out"], "compare, tour"),
        (&["figure", "compare", "-o", "bad.toml"], "bad.toml is a file"),
        (&["figure", "compare", "-o", "out", "--formats", "jpg"], "jpg"),
        (&["tour", "--scenes", "atlantis"], "atlantis"),
        (&["tour", "--techniques", "pfc"], "pfc"),
    ] {
        let out = shadowscope(dir.path(), args);
        assert!(!out.status.success() && String::from_utf8_lossy(&out.stderr).contains(word), "{args:?}");
        assert!(!dir.path().join("out").exists(), "{args:?}: something was written");
    }
    // Stopped, nothing is there.
    let error = figure::draw(
        &spec(&format!("picture_width = 32\ncolumns = {{ techniques = [\"pcf\", \"vsm\"] }}\n{base}size = [32, 32]")),
        &gpu(),
        &mut |done, _| done < 0.4,
    );
    assert!(error.is_err_and(|e| e.to_string() == measure::STOPPED));
}

/// Those that come with the program can be read, and name what there is.
#[test]
fn built_in_specs_are_usable() {
    for (name, _) in figure::BUILT_IN {
        let spec = Spec::open(name).unwrap();
        let (_, scene) = spec.open_base().unwrap();
        for axis in [&spec.rows, &spec.columns] {
            assert!(spec.changes(axis, &scene).unwrap().len() > 1);
        }
        let text = spec.to_toml(Path::new("x.toml")).unwrap();
        assert_eq!(Spec::from_toml(&text, Path::new("x.toml")).unwrap(), spec, "{name} changes when it is written");
    }
}

/// The tour draws what its filters leave: each as a capture, and all of them on the sheet.
#[test]
fn the_tour_has_filters() {
    let dir = tempfile::tempdir().unwrap();
    ok(dir.path(), &["tour", "-o", "t", "--scenes", "cubes", "--techniques", "pcf,cube,rt-hard"]);
    let mut names: Vec<String> = std::fs::read_dir(dir.path().join("t"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        ["contact-sheet.png", "cubes-pcf.png", "cubes-rt-hard.png"],
        "cubes has a sun, which cube does not serve"
    );
    let (setup, _) = Setup::open(dir.path().join("t/cubes-pcf.png").to_str().unwrap()).unwrap();
    assert_eq!((setup.technique.as_str(), setup.scene.as_str()), ("pcf", "cubes"));
    let sheet = Spec::open(dir.path().join("t/contact-sheet.png").to_str().unwrap()).unwrap();
    assert_eq!(sheet.rows, Axis::List(Kind::Techniques, ["pcf", "cube", "rt-hard"].map(String::from).into()));
}

struct State {
    model: Model,
    actions: Vec<Action>,
}

fn window(what: &str) -> Harness<'static, State> {
    let (mut setup, scene) = Setup::open(what).unwrap();
    setup.size = [64, 40];
    let geometry = Geometry::new(&scene, 0, 0.0).unwrap();
    let state = State { model: Model::new(setup, Arc::new(scene), geometry.bounds), actions: Vec::new() };
    let draw = |ui: &mut egui::Ui, s: &mut State| {
        ui::apply_style(ui.ctx());
        ui::layout(ui, &mut s.model, &mut s.actions);
    };
    let builder = Harness::builder().with_size([1296.0, 816.0]).with_accessibility_check(false);
    let mut harness = builder.build_ui_state(draw, state);
    harness.run_steps(4);
    harness
}

fn click(harness: &mut Harness<'static, State>, label: &str) {
    harness.get_all_by_label(label).next().unwrap().scroll_to_me();
    harness.run_steps(8);
    harness.get_all_by_label(label).next().unwrap().click();
    harness.run_steps(4);
}

/// Two clicks from the start a figure with legend and caption is written, and it shows what the picture shows.
#[test]
fn two_clicks_write_a_figure() {
    let mut harness = window("cubes");
    harness.state_mut().model.setup.view = "error".into();
    harness.run_steps(4);
    click(&mut harness, "Figure");
    assert_eq!(harness.state().model.drawer, Some(Tab::Figure));
    click(&mut harness, "Write figure");
    let Some(Action::Sheet(spec, Some(((folder, name), formats)))) = harness.state().actions.last().cloned() else {
        panic!("{:?}", harness.state().actions)
    };
    assert_eq!((folder.as_path(), name.as_str(), formats.len()), (Path::new("figures"), "figure", 4));
    assert!(spec.legend && spec.draw_caption && spec.caption.starts_with("The scene cubes"), "{}", spec.caption);
    let sheet = drawn(&Spec { width: Width::Picture(64), ..*spec });
    assert_eq!(sheet.count, [1, 1]);
    let own = &harness.state().model.setup;
    let shown = &sheet.cells[0].setup;
    assert_eq!((&shown.view, &shown.camera, &shown.light, shown.size), (&own.view, &own.camera, &own.light, own.size));
    let said: Vec<&str> = sheet
        .items
        .iter()
        .filter_map(|i| if let figure::Item::Text { text, .. } = i { Some(text.as_str()) } else { None })
        .collect();
    assert!(said.join(" ").ends_with(&sheet.spec.caption), "{said:?}");
    assert!(sheet.caption_height > 0 && said.len() > 2, "the legend and the caption are drawn: {said:?}");
}

/// Lists, numbers and insets that are chosen in the window are those of the spec.
#[test]
fn the_builder_chooses_rows_numbers_and_insets() {
    let mut harness = window("cubes");
    harness.key_press(egui::Key::F7);
    harness.run_steps(4);
    assert_eq!(harness.state().model.drawer, Some(Tab::Figure));
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "columns").scroll_to_me();
    harness.run_steps(8);
    harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "columns").click();
    harness.run_steps(4);
    click(&mut harness, "techniques");
    click(&mut harness, "vsm");
    click(&mut harness, "rmse");
    let built = harness.state().model.sheet().unwrap();
    assert_eq!(built.columns, Axis::List(Kind::Techniques, ["shadow-map", "truth", "vsm"].map(String::from).into()));
    assert_eq!((built.rows.clone(), built.numbers.clone()), (Axis::One, vec!["rmse".to_string()]));
    // A rectangle that is dragged out in the picture.
    harness.state_mut().model.builder.marking = true;
    harness.run_steps(4);
    harness.drag_at(egui::pos2(420.0, 120.0));
    harness.run_steps(2);
    harness.hover_at(egui::pos2(480.0, 180.0));
    harness.run_steps(2);
    harness.drop_at(egui::pos2(480.0, 180.0));
    harness.run_steps(4);
    let m = &harness.state().model;
    let [x, y, w, h] = m.builder.spec.insets.first().expect("an inset").at;
    assert!(!m.builder.marking && w > 0.02 && h > 0.02 && x + w <= 1.0 && y + h <= 1.0, "{x} {y} {w} {h}");
    m.sheet().unwrap();
    // What a file says is taken over.
    let (path, text) = (Path::new("papers/fig.toml"), SMALL);
    harness.state_mut().model.build(path, spec(text));
    harness.run_steps(4);
    let m = &harness.state().model;
    assert_eq!((m.builder.path.as_str(), m.builder.spec.insets.len()), ("figures/fig", 2));
    harness.get_by_label("Preview");
}
