//! The chart tab: error against cost, a point a configuration.

use super::model::{Action, Model};
use super::needs::{listed, main_values, mebibytes, percent, title};
use super::pictures::{Picture, Pictures, Subject};
use super::plotting::{Labels, LogAxis, color, marker, say, short};
use super::sweep::Range;
use crate::chart::{self, Axis, COSTS, ERRORS, Series, Spot};
use crate::measure::Record;
use crate::setup::Setup;
use egui::{Align2, Color32, ComboBox, FontId, Grid, Pos2, Rect, RichText, Role, Sense, Stroke};
use egui::{Ui, Vec2, WidgetInfo, vec2};
use egui_plot::{Line, LineStyle, Plot, PlotPoint, PlotPoints, Points};
use std::collections::VecDeque;

/// Places of the live point that are kept.
const TRAIL: usize = 32;
/// What a frame of the window tells without a measurement.
const LIVE: [&str; 7] = ["error_share", "rmse", "mae", "beyond_tolerance", "boundary_p95_px", "gpu_ms", "gpu_bytes"];
/// Of these what is against the averaged truth: known where the picture has that of as many samples as measurements take.
const AVERAGED: [&str; 3] = ["rmse", "mae", "beyond_tolerance"];

/// Whether a frame with a truth of so many samples per pixel tells a figure as a measurement would.
fn told(m: &Model, axis: &Axis, samples: u32) -> bool {
    LIVE.contains(&axis.id)
        && (!AVERAGED.contains(&axis.id) || samples == m.setup.truth_samples.measured(&m.setup.light))
}

/// The trail as far as its errors are known.
fn trail<'a>(m: &'a Model, error: &Axis) -> Vec<&'a Record> {
    m.chart.trail.iter().filter(|r| told(m, error, r.truth_samples)).collect()
}

/// The chart's state.
pub struct Chart {
    /// Places of the axes in [`ERRORS`] and [`COSTS`].
    pub error: usize,
    pub cost: usize,
    pub range: Range,
    /// File to save to or to open.
    pub path: String,
    /// The pictures shown so far, as rows: what is known of them. The newest last.
    pub trail: VecDeque<Record>,
    /// The rows have changed since they were sorted into lines.
    pub stale: bool,
    lines: Vec<Series>,
    /// For each row a number that it shares with those of the same picture.
    seen: Vec<usize>,
}

impl Default for Chart {
    fn default() -> Chart {
        Chart {
            error: 0,
            cost: 0,
            range: Range::default(),
            path: "chart.svg".into(),
            trail: VecDeque::new(),
            stale: false,
            lines: Vec::new(),
            seen: Vec::new(),
        }
    }
}

impl Chart {
    /// Sorts rows into lines.
    fn sort(&mut self, rows: &[Record]) {
        self.lines = chart::series(rows);
        let mut views: Vec<Option<Setup>> = Vec::new();
        self.seen.clear();
        for r in rows {
            let view = r.setup().ok().map(|s| s.around());
            let known = views.iter().position(|v| *v == view);
            self.seen.push(known.unwrap_or(views.len()));
            if known.is_none() {
                views.push(view);
            }
        }
    }

    /// Moves the live point.
    pub fn live(&mut self, row: Record) {
        let same =
            |r: &Record| (&r.technique, &r.params, r.error_share) == (&row.technique, &row.params, row.error_share);
        if self.trail.back().is_some_and(same) {
            self.trail.pop_back();
        }
        self.trail.push_back(row);
        if self.trail.len() > TRAIL {
            self.trail.pop_front();
        }
    }
}

/// Draws the chart.
pub fn show(ui: &mut Ui, m: &mut Model, out: &mut Vec<Action>) {
    axes(ui, m);
    if std::mem::take(&mut m.chart.stale) {
        m.chart.sort(&m.rows);
    }
    let (cost, error) = (&COSTS[m.chart.cost], &ERRORS[m.chart.error]);
    let spots: Vec<Option<Spot>> = m.rows.iter().map(|r| chart::spot(r, cost, error)).collect();
    let points: Vec<Option<(f64, f64)>> = spots.iter().map(|s| s.map(|s| (s.cost, s.error))).collect();
    let known = LIVE.contains(&cost.id);
    let trail: Vec<(f64, f64)> =
        trail(m, error).into_iter().filter(|_| known).filter_map(|r| chart::point(r, cost, error)).collect();
    let ends = |s: &Spot| s.spread.map(|cost| (cost, s.error));
    let whiskers: Vec<(f64, f64)> = spots.iter().flatten().flat_map(ends).collect();
    let all = || points.iter().flatten().chain(&trail).chain(&whiskers);
    let (x, y) = (LogAxis::of(all().map(|p| p.0)), LogAxis::of(all().map(|p| p.1)));
    let at = |(cost, error): (f64, f64)| [x.at(cost), y.at(error)];

    let (text, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
    let stairs: Vec<Vec<(f64, f64)>> =
        fronts(cost, &m.chart.seen, &spots).iter().map(|front| staircase(front)).collect();

    let empty = all().next().is_none();
    let plot = Plot::new(("chart", m.chart.cost, m.chart.error))
        .show_x(false)
        .show_y(false)
        .set_margin_fraction(vec2(0.09, 0.1))
        .y_axis_min_width(44.0)
        .grid_color(ui.visuals().window_stroke.color)
        .show_axes(!empty)
        .show_grid(!empty)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .x_grid_spacer(move |g| x.marks(g.bounds))
        .y_grid_spacer(move |g| y.marks(g.bounds))
        .x_axis_formatter(move |mark, _| x.text(mark))
        .y_axis_formatter(move |mark, _| y.text(mark) + if error.percent() { " %" } else { "" });
    let shown = plot.show(ui, |plot| {
        for line in &m.chart.lines {
            let places: PlotPoints = line.points.iter().filter_map(|i| points[*i]).map(at).collect();
            plot.line(
                Line::new("", places).color(color(&line.technique).gamma_multiply(0.8)).width(1.5).allow_hover(false),
            );
        }
        for stair in &stairs {
            let steps: PlotPoints = stair.iter().copied().map(at).collect();
            let line = Line::new("", steps).color(text.gamma_multiply(0.6)).width(1.0);
            plot.line(line.style(LineStyle::dashed_dense()).allow_hover(false));
        }
        for line in &m.chart.lines {
            let places: PlotPoints = line.points.iter().filter_map(|i| points[*i]).map(at).collect();
            let places = Points::new("", places).shape(marker(&line.technique)).radius(4.5);
            plot.points(places.color(color(&line.technique)).allow_hover(false));
        }
        // Part of the bounds; drawn below.
        plot.points(
            Points::new("", trail.iter().chain(&whiskers).copied().map(at).collect::<PlotPoints>())
                .radius(0.1)
                .color(Color32::TRANSPARENT)
                .allow_hover(false),
        );
        let wheel = plot.response().ctx.input(|i| i.smooth_scroll_delta.y);
        if plot.response().contains_pointer() && wheel != 0.0 {
            plot.zoom_bounds_around_hovered(Vec2::splat((wheel * 0.004).exp()));
        }
    });
    let frame = *shown.transform.frame();
    let screen = |p: (f64, f64)| {
        let [x, y] = at(p);
        shown.transform.position_from_point(&PlotPoint::new(x, y))
    };
    let screens: Vec<Option<Pos2>> = points.iter().map(|p| p.map(screen).filter(|s| frame.contains(*s))).collect();
    let mut labels = Labels::new(frame);
    labels.keep_clear(screens.iter().flatten().copied());
    for line in &m.chart.lines {
        let at: Vec<Pos2> = line.points.iter().filter_map(|i| screens[*i]).collect();
        labels.keep_off(at.windows(2).map(|p| [p[0], p[1]]));
        labels.keep_off(draw_whiskers(ui, frame, line, &spots, |cost, error| screen((cost, error))).into_iter());
    }
    for stair in &stairs {
        let at: Vec<Pos2> = stair.iter().copied().map(screen).collect();
        labels.keep_off(at.windows(2).map(|p| [p[0], p[1]]));
    }
    live(ui, m, error, frame, &mut labels, &trail.iter().copied().map(screen).collect::<Vec<_>>());
    for line in &m.chart.lines {
        let ends: Vec<Pos2> = line.points.iter().rev().filter_map(|i| screens[*i]).collect();
        labels.write(ui, &ends, &line.label, color(&line.technique), false);
    }
    let samples = m.setup.truth_samples.shown(&m.setup.light, m.info(), m.setup.values());
    let aside = match [error, cost].into_iter().find(|a| !told(m, a, samples)) {
        Some(axis) => format!("The picture now is not shown: only a measurement tells its {}.", axis.title),
        None if trail.len() > 1 => "Ring: the picture now. Faint dots: where it was before.".into(),
        None => String::new(),
    };
    let small = FontId::proportional(11.5);
    say(ui, frame, (Align2::RIGHT_TOP, frame.right_top() + vec2(-8.0, 6.0)), aside, small, weak);
    if let Some(busy) = chart::busy(&m.rows).filter(|_| ["gpu_ms", "cost", "ratio"].contains(&cost.id)) {
        let ink = ui.visuals().warn_fg_color;
        let small = FontId::proportional(11.5);
        say(ui, frame, (Align2::LEFT_BOTTOM, frame.left_bottom() + vec2(8.0, -6.0)), busy, small, ink);
    }
    if points.iter().all(Option::is_none) {
        let text = match m.rows.is_empty() {
            true => "Sweep, measure or open a file: every configuration becomes a point here.",
            false => "None of the rows has both of these figures.",
        };
        say(ui, frame, (Align2::CENTER_CENTER, frame.center()), text.into(), FontId::proportional(13.0), weak);
    }
    let mut chosen = None;
    for (i, place) in screens.iter().enumerate() {
        let Some(place) = place else { continue };
        let r = &m.rows[i];
        let touch = ui.interact(
            Rect::from_center_size(*place, Vec2::splat(13.0)),
            ui.scope_id().with(("row", i)),
            Sense::click(),
        );
        touch.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("{} {}", r.technique, main_values(r))));
        if touch.hovered() {
            let painter = ui.painter().with_clip_rect(frame);
            painter.circle_stroke(*place, 8.0, Stroke::new(1.5, Color32::WHITE));
        }
        if touch.clicked() {
            chosen = Some(i);
        }
        let (pictures, busy) = (&mut m.pictures, m.measuring.is_some());
        touch.on_hover_ui(|ui| about(ui, r, pictures, busy, out));
    }
    if let Some(i) = chosen {
        let row = m.rows[i].clone();
        out.extend(m.apply(&row));
    }
}

/// Draws the quartiles of a line's times; where they lie.
fn draw_whiskers(
    ui: &Ui,
    frame: Rect,
    line: &Series,
    spots: &[Option<Spot>],
    at: impl Fn(f64, f64) -> Pos2,
) -> Vec<[Pos2; 2]> {
    let painter = ui.painter().with_clip_rect(frame);
    let mut drawn = Vec::new();
    let stroke = Stroke::new(1.0, color(&line.technique).gamma_multiply(0.8));
    for spot in line.points.iter().filter_map(|i| spots[*i]).filter(|s| s.spread[0] < s.spread[1]) {
        let ends = spot.spread.map(|cost| at(cost, spot.error));
        painter.line_segment(ends, stroke);
        for end in ends {
            painter.line_segment([end - vec2(0.0, 3.0), end + vec2(0.0, 3.0)], stroke);
        }
        drawn.push(ends);
    }
    drawn
}

/// The points that no other beats, for each picture that was measured: another scene, camera or light is another matter.
fn fronts(cost: &chart::Axis, seen: &[usize], spots: &[Option<Spot>]) -> Vec<Vec<(f64, f64)>> {
    let views = seen.iter().max().map_or(0, |most| most + 1);
    let of = |view: usize| {
        let own = seen.iter().zip(spots).filter(|(v, _)| **v == view);
        let own: Vec<Spot> = own.filter_map(|(_, s)| *s).collect();
        chart::front(cost, &own).into_iter().map(|i| (own[i].cost, own[i].error)).collect()
    };
    (0..views).map(of).collect()
}

/// From each point to the cost of the next, then down.
fn staircase(front: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for p in front {
        out.extend(out.last().map(|last| (p.0, last.1)));
        out.push(*p);
    }
    out
}

/// The boxes that choose the axes.
fn axes(ui: &mut Ui, m: &mut Model) {
    let choose = |ui: &mut Ui, id: &str, all: &'static [Axis], chosen: &mut usize, width: f32| {
        // A box is as wide as its text, if there is room.
        let size = vec2(width, ui.spacing().interact_size.y);
        let shown = ui.allocate_ui(size, |ui| {
            let combo = ComboBox::from_id_salt(id).selected_text(all[*chosen].title).width(width).truncate();
            combo.show_ui(ui, |ui| {
                for (i, axis) in all.iter().enumerate() {
                    if ui.selectable_label(i == *chosen, axis.title).on_hover_text(axis.doc).clicked() {
                        *chosen = i;
                    }
                }
            })
        });
        let shown = shown.inner;
        shown.response.on_hover_text(all[*chosen].doc).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, id));
    };
    ui.horizontal(|ui| {
        let room = ui.available_width();
        let width = ((room - 70.0) / 2.0).clamp(60.0, 300.0);
        choose(ui, "error axis", ERRORS, &mut m.chart.error, width);
        ui.label(RichText::new("against").weak());
        choose(ui, "cost axis", COSTS, &mut m.chart.cost, width);
    });
}

/// The picture now, and where it has been: fading.
fn live(ui: &Ui, m: &Model, error: &Axis, frame: Rect, labels: &mut Labels, places: &[Pos2]) {
    let painter = ui.painter().with_clip_rect(frame);
    let trail = trail(m, error);
    let count = places.len();
    if count != trail.len() {
        return;
    }
    // What was counted at another size stands beside no row.
    let beside = |r: &Record| m.rows.is_empty() || m.rows.iter().any(|o| (o.width, o.height) == (r.width, r.height));
    for i in 0..count {
        let fade = (i + 1) as f32 / count as f32;
        let color = color(&trail[i].technique).gamma_multiply(0.15 + 0.6 * fade * fade);
        let kind = |r: &Record| (r.technique.clone(), r.width, r.height);
        if i > 0 && kind(trail[i - 1]) == kind(trail[i]) {
            painter.line_segment([places[i - 1], places[i]], Stroke::new(1.0, color.gamma_multiply(0.6)));
        }
        if i + 1 < count {
            match beside(trail[i]) {
                true => painter.circle_filled(places[i], 2.5, color),
                false => painter.circle_stroke(places[i], 2.5, Stroke::new(1.0, color)),
            };
        }
    }
    let (Some(place), Some(row)) = (places.last(), trail.last()) else { return };
    // Hollow while the error of what is shown is not known yet, or was counted at another size than all rows.
    let known = m.facts.error.is_some() && m.measuring.is_none();
    let now = known && beside(row);
    painter.circle_stroke(
        *place,
        7.5,
        Stroke::new(2.0, if now { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() }),
    );
    if now {
        painter.circle_filled(*place, 4.0, color(&row.technique));
    }
    let mut text = if known { "now".to_string() } else { "before".to_string() };
    if !beside(row) {
        text += &format!(", at {} × {} pixels", row.width, row.height);
    }
    labels.write(
        ui,
        &[*place],
        &text,
        if now { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() },
        false,
    );
}

/// What a point is: settings, figures, a small picture.
fn about(ui: &mut Ui, r: &Record, pictures: &mut Pictures, busy: bool, out: &mut Vec<Action>) {
    ui.set_width(250.0);
    ui.label(RichText::new(title(&r.technique)).strong());
    let main = main_values(r);
    if !main.is_empty() {
        ui.label(main);
    }
    let wide = vec2(240.0, (240.0 * r.height as f32 / r.width.max(1) as f32).clamp(60.0, 240.0));
    match pictures.look(&Subject::Row(r.setup.clone()), busy, out) {
        Picture::Drawn(texture) => {
            ui.add(egui::Image::from_texture((texture.id(), wide)));
        }
        Picture::Failed(why) => {
            ui.label(RichText::new(why).small().weak());
        }
        Picture::Waiting => {
            ui.allocate_ui(wide, |ui| {
                ui.set_min_size(wide);
                ui.centered_and_justified(|ui| match busy {
                    true => ui.label(RichText::new("no small picture while measuring").small().weak()),
                    false => ui.add(egui::Spinner::new().size(22.0)),
                });
            });
        }
    }
    // Each multiple has a base of its own.
    let same = r.ratio_resolution.map_or("× plain map".into(), |side| format!("× plain map of {side}²"));
    let multiple = |x: Option<f64>, base: Option<f64>| Some(format!("{} (1: {} ms)", short(x?), short(base?)));
    let rows = [
        ("wrong pixels", Some(percent(r.error_share))),
        ("RMSE", Some(format!("{:.5}", r.rmse))),
        ("MAE", Some(format!("{:.5}", r.mae))),
        ("FLIP", Some(format!("{:.5}", r.flip))),
        ("edge error, 95 %", r.boundary_p95_px.map(|px| format!("{px:.1} px"))),
        ("flicker", r.flicker.map(percent)),
        ("time", Some(format!("{} ms ({} to {})", short(r.gpu_ms), short(r.gpu_ms_q1), short(r.gpu_ms_q3)))),
        ("× the set-up's plain map", multiple(r.cost, r.cost_base_ms())),
        (same.as_str(), multiple(r.ratio, r.ratio_base_ms())),
        ("memory", Some(mebibytes(r.gpu_bytes))),
        ("rays", (r.rays > 0).then(|| r.rays.to_string())),
    ];
    Grid::new("about").num_columns(2).min_row_height(15.0).spacing([10.0, 1.0]).show(ui, |ui| {
        for (name, value) in rows.into_iter().filter_map(|(name, value)| Some((name, value?))) {
            ui.label(RichText::new(name).small());
            ui.label(RichText::new(value).monospace().size(11.5));
            ui.end_row();
        }
    });
    ui.label(RichText::new(listed(r).replace('\n', ", ")).small().weak());
    let place = format!("{}, {} × {} pixels. Click to apply.", r.scene, r.width, r.height);
    ui.label(RichText::new(place).small().weak());
}
