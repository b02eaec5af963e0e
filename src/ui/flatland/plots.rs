//! The charts: the error over all angles, and the footprint of each pixel or what few samples add.

use super::found::CHOICES;
use super::{Charted, Choice, Lab, color, short_name, tint};
use crate::chart::round_step;
use crate::flatland::{Film, table};
use crate::palette::LABELS;
use crate::ui::plotting::{Labels, LogAxis};
use egui::{
    Align, Button, Color32, Label, Layout, Pos2, Rect, RichText, Role, Sense, Stroke, Ui, UiBuilder, WidgetInfo,
};
use egui_plot::{GridMark, Line, LineStyle, Plot, PlotBounds, PlotPoint, PlotPoints, PlotResponse, Points, VLine};

/// Below this width the second chart has no room, points.
const BOTH: f32 = 560.0;

/// Draws both charts.
pub fn show(ui: &mut Ui, rect: Rect, lab: &mut Lab) {
    let Some(film) = lab.found.film.clone() else { return };
    let middle = if rect.width() < BOTH { rect.right() + 8.0 } else { rect.left() + (rect.width() * 0.56).round() };
    within(ui, rect.with_max_x(middle - 12.0), |ui| errors(ui, lab, &film));
    lab.found.update(&lab.now);
    if rect.width() >= BOTH {
        within(ui, rect.with_min_x(middle), |ui| match lab.now.show.chart {
            Charted::Footprints => footprints(ui, lab, &film),
            Charted::Added => added(ui, lab),
        });
    }
}

fn within(ui: &mut Ui, rect: Rect, add: impl FnOnce(&mut Ui)) {
    let mut inside = ui.new_child(UiBuilder::new().max_rect(rect));
    inside.shrink_clip_rect(rect);
    add(&mut inside);
}

/// A chart's title with the names of its curves, and on its right a choice of two.
fn title(ui: &mut Ui, title: &str, names: &[(String, Color32)], choice: Option<([&str; 2], &str, &mut bool)>) {
    ui.horizontal(|ui| {
        ui.set_height(20.0);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if let Some((labels, tip, second)) = choice {
                for (name, is) in [(labels[1], true), (labels[0], false)] {
                    let button =
                        Button::selectable(*second == is, RichText::new(name).size(12.0)).frame_when_inactive(true);
                    if ui.add(button).on_hover_text(tip).clicked() {
                        *second = is;
                    }
                }
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                if !title.is_empty() {
                    ui.add(Label::new(RichText::new(title).size(12.5).strong()).truncate());
                }
                for (name, color) in names {
                    ui.add(Label::new(RichText::new(format!("― {name}")).size(12.0).color(*color)).truncate());
                }
            });
        });
    });
}

/// A chart whose bounds only the lab moves.
fn plot<'a>(ui: &Ui, name: &'static str, y: LogAxis) -> Plot<'a> {
    Plot::new(name)
        .show_x(false)
        .show_y(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .y_axis_min_width(38.0)
        .grid_color(ui.visuals().window_stroke.color)
        .x_grid_spacer(|g| round_marks(g.bounds))
        .y_grid_spacer(move |g| y.marks(g.bounds))
        .y_axis_formatter(move |mark, _| y.text(mark))
}

/// Round numbers along an axis.
fn round_marks((low, high): (f64, f64)) -> Vec<GridMark> {
    let step = round_step(low, high, 6);
    // None so near the end that its number would be cut.
    let high = high - 0.02 * (high - low);
    let marks = (low / step).ceil() as i64..=(high / step).floor() as i64;
    marks.map(|i| GridMark { value: i as f64 * step, step_size: step }).collect()
}

/// The error as a function of the angle.
fn errors(ui: &mut Ui, lab: &mut Lab, film: &Film) {
    let strong = ui.visuals().text_color();
    let colors = [color(ui, LABELS[2]), color(ui, LABELS[3]), color(ui, LABELS[0])];
    let names: Vec<_> = ["mean", "mean + σ", "worst"].map(String::from).into_iter().zip(colors).collect();
    let tip = "Along the angle itself, or along s, which draws the ends of the valid angles out: there the mean and the worst are \
               convex and have one minimum each.";
    let before = lab.now.show.stretched;
    title(ui, "pixels a lexel", &names, Some((["angle", "stretched"], tip, &mut lab.now.show.stretched)));
    if before != lab.now.show.stretched {
        lab.zoom = None;
    }
    let stretched = lab.now.show.stretched;
    // The line's angle as the tables have it, without a jump; s turns the same way.
    let half = film.half_angle();
    let zero = table::angle(half);
    let x_of = move |normal: f64| if stretched { -film.stretched(normal) } else { zero - (normal - half).to_degrees() };
    let normal_of = |x: f64| if stretched { film.normal(-x) } else { half - (x - zero).to_radians() };
    let mut marks: Vec<(String, f64, f64, Color32)> = Vec::new();
    for (choice, row) in &lab.found.rows {
        let value = match choice {
            Choice::Least(crate::flatland::Metric::L2) => row.mean_sigma,
            Choice::Least(crate::flatland::Metric::Max) => row.worst,
            _ => row.average,
        };
        marks.push((short_name(*choice), x_of(row.normal), value, tint(ui, *choice)));
    }
    let chosen = lab.found.chosen.clone().filter(|_| lab.found.parts.is_empty());
    let curve = &lab.found.curve;
    let value = |b: &crate::flatland::Badness, k: usize| [b.mean, b.mean_sigma, b.worst][k];
    let least = curve.iter().map(|p| p.badness.mean).fold(f64::INFINITY, f64::min);
    let most = lab.found.rows.iter().map(|(_, r)| r.worst).chain(chosen.iter().map(|r| r.worst));
    let most = most.fold(4.0 * least, f64::max).min(1e4 * least);
    let y = LogAxis::of([least].into_iter());
    let (low, high) = ((least * 0.8).log10(), (most * 1.6).log10());
    let whole = if stretched {
        let ends =
            marks.iter().map(|m| m.1).fold((-3.0, 3.0), |(a, b): (f64, f64), x| (a.min(x - 0.7), b.max(x + 0.7)));
        [ends.0.max(-6.0), ends.1.min(6.0)]
    } else {
        let [a, b] = film.valid().map(x_of);
        [a.min(b), a.max(b)]
    };
    let [from, to] = lab.zoom.unwrap_or(whole);
    let text = move |x: f64, span: f64| {
        let x = if stretched { x } else { (x + 45.0).rem_euclid(180.0) - 45.0 };
        let places = if span > 20.0 || stretched && span > 3.0 {
            0
        } else if span > 1.5 {
            1
        } else {
            2
        };
        format!("{x:.places$}{}", if stretched { "" } else { "°" })
    };
    let curves: Vec<PlotPoints> = (0..3)
        .map(|k| {
            curve.iter().map(|p| [x_of(p.normal), value(&p.badness, k).log10()]).filter(|p| p[0].is_finite()).collect()
        })
        .collect();
    let now = chosen.as_ref().map(|row| x_of(row.normal));
    let points: Vec<_> = marks.iter().map(|m| ([m.1, m.2.log10()], m.3)).collect();
    let faint = ui.visuals().weak_text_color().gamma_multiply(0.5);
    let shown = plot(ui, "flatland errors", y)
        .x_axis_formatter(move |mark: GridMark, range| text(mark.value, range.end() - range.start()))
        .sense(Sense::click_and_drag())
        .show(ui, |plot| {
            plot.set_plot_bounds(PlotBounds::from_min_max([from, low], [to, high]));
            for (points, color) in curves.into_iter().zip(colors) {
                plot.line(Line::new("", points).color(color).width(1.6).allow_hover(false));
            }
            if !stretched {
                for end in film.valid() {
                    plot.vline(
                        VLine::new("", x_of(end)).color(faint).style(LineStyle::dashed_dense()).allow_hover(false),
                    );
                }
            }
            if let Some(x) = now {
                plot.vline(VLine::new("", x).color(strong).width(1.5).allow_hover(false));
            }
            for (at, color) in points {
                plot.points(Points::new("", vec![at]).color(color).radius(4.5).allow_hover(false));
            }
        });
    let r = &shown.response;
    r.widget_info(|| WidgetInfo::labeled(Role::Slider, true, "film's angle"));
    let x_at = |at: Pos2| shown.transform.value_from_position(at).x;
    if let (true, Some(at)) = (r.dragged() || r.clicked(), r.interact_pointer_pos()) {
        lab.turn(film, normal_of(x_at(at)));
    }
    let wheel = ui.input(|i| i.smooth_scroll_delta.y) as f64;
    if let Some(at) = r.hover_pos()
        && wheel != 0.0
    {
        let (held, grow) = (x_at(at), (-wheel * 0.004).exp());
        let zoomed = [held + (from - held) * grow, held + (to - held) * grow];
        lab.zoom = (zoomed[1] - zoomed[0] < whole[1] - whole[0]).then_some(zoomed);
    }
    if r.double_clicked() {
        lab.zoom = None;
    }
    let frame = *shown.transform.frame();
    let mut labels = Labels::new(frame);
    let screen = |x: f64, y: f64| shown.transform.position_from_point(&PlotPoint::new(x, y));
    let curve = &lab.found.curve;
    for k in 0..3 {
        let on = curve.iter().step_by(3).map(|p| screen(x_of(p.normal), value(&p.badness, k).log10()));
        let on: Vec<Pos2> = on.filter(|at| frame.contains(*at)).collect();
        labels.keep_off(on.windows(2).map(|p| [p[0], p[1]]));
    }
    labels.keep_clear(marks.iter().map(|m| screen(m.1, m.2.log10())));
    for (name, x, value, color) in &marks {
        let at = screen(*x, value.log10());
        if frame.contains(at) {
            labels.write(ui, &[at], name, *color, true);
        }
    }
    if r.hovered() && !r.dragged() {
        let tip = "Drag to turn the film. The wheel zooms, a double-click shows all angles.";
        shown.response.on_hover_text_at_pointer(tip);
    }
}

/// A line without a gap.
type Run = Vec<[f64; 2]>;

/// Pixels a lexel at each pixel of the image.
fn footprints(ui: &mut Ui, lab: &mut Lab, film: &Film) {
    let world = &lab.now.world;
    let strong = ui.visuals().strong_text_color();
    let parts = lab.found.parts.len();
    let chosen = if parts > 0 { format!("{parts} frusta") } else { short_name(lab.now.film) };
    let mut names = vec![(chosen, strong)];
    let mut lines: Vec<(Vec<Run>, Color32, f32)> = Vec::new();
    let runs = |each: Vec<(f64, usize, f64)>| -> Vec<Run> {
        let same = |a: &(f64, usize, f64), b: &(f64, usize, f64)| a.1 == b.1 && b.0 - a.0 < 1.5;
        let points = |run: &[(f64, usize, f64)]| run.iter().map(|x| [x.0, x.2.log10()]).collect();
        each.chunk_by(same).map(points).collect()
    };
    for choice in [CHOICES[0], CHOICES[3], CHOICES[4]] {
        if let Some(row) = lab.found.row(choice).filter(|_| choice != lab.now.film || parts > 0) {
            let each = film.samples.iter().zip(film.footprints(row.normal));
            let mut each: Vec<_> = each.map(|(s, b)| (world.place(s.point), s.segment, b)).collect();
            each.sort_by(|a, b| a.0.total_cmp(&b.0));
            lines.push((runs(each), tint(ui, choice).gamma_multiply(0.75), 1.2));
            names.push((short_name(choice), tint(ui, choice)));
        }
    }
    lines.push((runs(lab.found.seen.iter().map(|x| (x.place, x.segment, x.footprint)).collect()), strong, 2.0));
    second_title(ui, lab, &names);
    let values = lines.iter().flat_map(|l| l.0.iter().flatten()).map(|p| p[1]).filter(|v| v.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if !low.is_finite() {
        return;
    }
    // One always shows.
    let (low, high) = (low.min(-0.15) - 0.1, high.max(0.15) + 0.1);
    let y = LogAxis::of([1.0].into_iter());
    let pixels = lab.now.world.pixels as f64;
    let even = ui.visuals().weak_text_color().gamma_multiply(0.8);
    plot(ui, "flatland footprints", y).show(ui, |plot| {
        plot.set_plot_bounds(PlotBounds::from_min_max([-0.01 * pixels, low], [1.04 * pixels, high]));
        plot.line(Line::new("", vec![[0.0, 0.0], [pixels, 0.0]]).color(even).width(1.0).allow_hover(false));
        for (runs, color, width) in lines {
            for run in runs {
                if let [only] = run[..] {
                    plot.points(Points::new("", vec![only]).color(color).radius(width).allow_hover(false));
                }
                plot.line(Line::new("", run).color(color).width(width).allow_hover(false));
            }
        }
    });
}

fn second_title(ui: &mut Ui, lab: &mut Lab, names: &[(String, Color32)]) {
    let tip = "Pixels a lexel at each pixel of the image, from its lower edge to its upper; or what a film that is chosen \
               from few samples adds to the error, over the number of samples.";
    let mut second = lab.now.show.chart == Charted::Added;
    title(ui, "", names, Some((["footprints", "few samples"], tip, &mut second)));
    lab.now.show.chart = if second { Charted::Added } else { Charted::Footprints };
}

/// What a film that is chosen from few samples adds to the error.
fn added(ui: &mut Ui, lab: &mut Lab) {
    let colors = [CHOICES[0], CHOICES[1]].map(|c| tint(ui, c));
    let names: Vec<_> = ["L1, mean", "L2, mean + σ"].map(String::from).into_iter().zip(colors).collect();
    second_title(ui, lab, &names);
    let all = lab.found.added.clone();
    let most = all.iter().flat_map(|a| a.1).fold(0.05, f64::max) * 100.0;
    let few = lab.now.few;
    let line = ui.visuals().text_color();
    let x = LogAxis::of([1.0].into_iter());
    let shown: PlotResponse<()> = plot(ui, "flatland samples", x)
        .y_grid_spacer(|g| round_marks(g.bounds))
        .y_axis_formatter(|mark, _| format!("{} %", crate::chart::digits((mark.value * 1e6).round() / 1e6)))
        .x_grid_spacer(move |g| x.marks(g.bounds))
        .x_axis_formatter(move |mark, _| x.text(mark))
        .show(ui, |plot| {
            plot.set_plot_bounds(PlotBounds::from_min_max(
                [4.8f64.log10(), -0.03 * most],
                [1150f64.log10(), 1.1 * most],
            ));
            for (k, color) in colors.into_iter().enumerate() {
                let points: PlotPoints = all.iter().map(|(n, a)| [(*n as f64).log10(), a[k] * 100.0]).collect();
                plot.line(Line::new("", points).color(color).width(1.8).allow_hover(false));
            }
            if let Some(few) = few {
                plot.vline(VLine::new("", (few as f64).log10()).stroke(Stroke::new(1.2, line)).allow_hover(false));
            }
        });
    let r = &shown.response;
    if let (true, Some(at)) = (r.dragged() || r.clicked(), r.interact_pointer_pos()) {
        let x = shown.transform.value_from_position(at).x;
        lab.now.few = Some((10f64.powf(x).round() as usize).clamp(5, 1000));
    }
}
