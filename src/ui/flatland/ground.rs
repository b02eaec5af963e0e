//! The world, or its image in post-perspective space: where it lies on the screen, its rays and spans.

use super::found::Found;
use super::handles::{films, handles};
use super::{Choice, Lab, Spans, State, color, tint};
use crate::flatland::{Film, Flatland, PostPerspective};
use crate::palette::{LABELS, OCTAVES, bytes};
use egui::{
    Align2, Color32, CursorIcon, FontId, Id, Painter, PointerButton, Pos2, Rect, Response, Sense, Shape, Stroke, Ui,
    pos2, vec2,
};
use glam::DVec2;

/// Rays of each kind that are drawn at most, and coloured spans.
pub const RAYS: usize = 50;
const SPANS: usize = 400;
/// How near to a segment a click must be, and to an end for a new one to begin there, points.
const NEAR: f64 = 7.0;
/// Farthest place that something can be dragged to.
pub const FARTHEST: f64 = 1e6;
/// Depth before and behind the eye that post-perspective space is drawn from.
const SHALLOW: f64 = 1e-2;

/// Where a space lies on the screen.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub rect: Rect,
    middle: DVec2,
    /// Points a unit.
    pub scale: f64,
    /// Panned or zoomed: a window of another size shows the same part.
    own: bool,
}

/// What a drag of the pointer does.
#[derive(Clone, Copy, Debug)]
pub enum Drag {
    Pan,
    /// Draws a segment from here.
    Draw(DVec2),
    /// Moves a segment; where the pointer was.
    Segment(usize, DVec2),
    /// Turns the film: its normal less the pointer's direction from the light.
    Turn(f64),
}

/// A space with its place on the screen.
pub struct Placed {
    pub view: View,
    pub post: Option<PostPerspective>,
}

impl View {
    pub fn placed(self, post: Option<PostPerspective>) -> Placed {
        Placed { view: self, post }
    }

    /// Shows all points of a space.
    fn fitted(rect: Rect, points: impl Iterator<Item = DVec2>) -> View {
        let around = |(low, high): (DVec2, DVec2), p: DVec2| (low.min(p), high.max(p));
        let (low, high) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), around);
        let size = (high - low).max(DVec2::splat(1e-3));
        // Room for the handles, and for the legend below.
        let room = DVec2::new(rect.width() as f64 - 110.0, rect.height() as f64 - 110.0).max(DVec2::splat(40.0));
        let scale = (room / size).min_element();
        View { rect, middle: (low + high) / 2.0 - DVec2::Y * 12.0 / scale, scale, own: false }
    }

    fn to_screen(self, q: DVec2) -> DVec2 {
        let [x, y] = [self.rect.center().x, self.rect.center().y].map(f64::from);
        DVec2::new(x + (q.x - self.middle.x) * self.scale, y - (q.y - self.middle.y) * self.scale)
    }

    fn place_at(self, at: Pos2) -> DVec2 {
        let off = at - self.rect.center();
        self.middle + DVec2::new(off.x as f64, -off.y as f64) / self.scale
    }
}

impl Placed {
    /// A point in the space's own axes: depth runs to the right, as the view does in most worlds.
    fn shown(&self, p: DVec2) -> Option<DVec2> {
        let Some(post) = self.post else { return Some(p) };
        let q = post.project(p);
        q.is_finite().then_some(DVec2::new(q.y, q.x))
    }

    /// Where a point of the world is drawn.
    pub fn at(&self, p: DVec2) -> Option<Pos2> {
        let at = self.view.to_screen(self.shown(p)?);
        (at.abs().max_element() < 1e5).then_some(pos2(at.x as f32, at.y as f32))
    }

    /// The point of the world that is drawn there.
    pub fn world(&self, at: Pos2) -> DVec2 {
        let q = self.view.place_at(at);
        self.post.map_or(q, |post| post.unproject(DVec2::new(q.y, q.x)))
    }

    /// What is drawn of a line of the world: in post-perspective space the parts before and behind the eye.
    pub fn lines(&self, world: &Flatland, a: DVec2, b: DVec2) -> Vec<[Pos2; 2]> {
        let mut parts = vec![(a, b)];
        if self.post.is_some() {
            let [za, zb] = [a, b].map(|p| (p - world.eye).dot(world.forward()));
            parts = [1.0, -1.0]
                .into_iter()
                .filter_map(|side| cut(a, b, za * side - SHALLOW, zb * side - SHALLOW))
                .collect();
        }
        let drawn = |(a, b): (DVec2, DVec2)| {
            let [a, b] = [self.shown(a)?, self.shown(b)?].map(|q| self.view.to_screen(q));
            clip(self.view.rect, a, b)
        };
        parts.into_iter().filter_map(drawn).collect()
    }
}

/// The part of a line where a value that runs from `x` to `y` along it is not negative.
fn cut(a: DVec2, b: DVec2, x: f64, y: f64) -> Option<(DVec2, DVec2)> {
    let zero = || a + (b - a) * (x / (x - y));
    match (x >= 0.0, y >= 0.0) {
        (true, true) => Some((a, b)),
        (true, false) => Some((a, zero())),
        (false, true) => Some((zero(), b)),
        (false, false) => None,
    }
}

/// The part of a line on the screen that lies in a rectangle.
fn clip(rect: Rect, a: DVec2, b: DVec2) -> Option<[Pos2; 2]> {
    let rect = rect.expand(20.0);
    let [left, top, right, bottom] = [rect.left(), rect.top(), rect.right(), rect.bottom()].map(f64::from);
    let (mut a, mut b) = (a, b);
    for side in 0..4 {
        let inside = |p: DVec2| [p.x - left, p.y - top, right - p.x, bottom - p.y][side];
        (a, b) = cut(a, b, inside(a), inside(b))?;
    }
    Some([pos2(a.x as f32, a.y as f32), pos2(b.x as f32, b.y as f32)])
}

/// Colours of a lexel's or a pixel's footprint.
fn octaves(footprint: f64) -> Color32 {
    let [r, g, b] = bytes(OCTAVES.at(((footprint.log2() + 4.0) / 8.0) as f32));
    Color32::from_rgb(r, g, b)
}

/// Draws the world and takes its input.
pub fn show(ui: &mut Ui, rect: Rect, lab: &mut Lab) {
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 0.0, ui.visuals().extreme_bg_color);
    let post = lab.found.post.filter(|_| lab.now.show.post);
    let slot = post.is_some() as usize;
    let mut view = match lab.views[slot] {
        Some(view) if view.own || view.rect == rect => View { rect, ..view },
        _ => fit(rect, &lab.now, &lab.found, post),
    };
    // Before a layout has settled there is no room to fit into.
    if rect.width() > 60.0 && rect.height() > 60.0 {
        lab.views[slot] = Some(view);
    }
    let ground = ui.interact(rect, Id::unique("flatland's ground"), Sense::click_and_drag());
    drag_ground(ui, &ground, lab, &mut view, post);
    if let Some(kept) = &mut lab.views[slot] {
        *kept = view;
    }
    let placed = view.placed(post);
    let draw = Draw { ui, painter: painter.clone(), placed: &placed, world: &lab.now.world };
    grid(&draw);
    segments(&draw, lab);
    rays(&draw, &lab.now, &lab.found);
    spans(&draw, &lab.now, &lab.found);
    construction(&draw, &lab.now);
    if post.is_some() {
        near_line(&draw, &lab.found);
    }
    let Some(film) = lab.found.film.clone() else {
        let text = "The camera sees nothing, or what it sees does not lie within 180° as seen from the light.";
        say(ui, &painter, rect, text);
        handles(ui, &painter, &placed, lab);
        return legend(ui, &painter, rect);
    };
    if lab.found.chosen.is_none() && lab.found.parts.is_empty() {
        say(ui, &painter, rect, "The chosen film does not cross all rays to what the camera sees. Choose another one.");
    }
    if post.is_none() {
        films(ui, &painter, &placed, lab, &film);
    }
    handles(ui, &painter, &placed, lab);
    legend(ui, &painter, rect);
    let told = match (lab.drawing, post.is_some()) {
        (true, _) => "Drag to draw a segment. Escape lays the pen down.".into(),
        (_, true) => "post-perspective space: the view is the square, its depth runs to the right".into(),
        _ => lab
            .selected
            .map_or(String::new(), |i| format!("segment {} selected: drag it or its ends, Del deletes it", i + 1)),
    };
    painter.text(
        rect.left_top() + vec2(10.0, 8.0),
        Align2::LEFT_TOP,
        told,
        FontId::proportional(12.0),
        ui.visuals().weak_text_color(),
    );
}

/// What is drawn with.
struct Draw<'a> {
    ui: &'a Ui,
    painter: Painter,
    placed: &'a Placed,
    world: &'a Flatland,
}

impl Draw<'_> {
    fn line(&self, a: DVec2, b: DVec2, stroke: Stroke) {
        for line in self.placed.lines(self.world, a, b) {
            self.painter.line_segment(line, stroke);
        }
    }

    fn dashed(&self, a: DVec2, b: DVec2, stroke: Stroke) {
        for line in self.placed.lines(self.world, a, b) {
            self.painter.extend(Shape::dashed_line(&line, stroke, 6.0, 4.0));
        }
    }
}

fn fit(rect: Rect, s: &State, found: &Found, post: Option<PostPerspective>) -> View {
    let world = &s.world;
    if let Some(post) = post {
        let square = [DVec2::splat(-1.0), DVec2::splat(1.0)];
        let q = post.project(world.light);
        let light = Some(DVec2::new(q.y, q.x)).filter(|q| q.abs().max_element() < 4.0);
        return View::fitted(rect, square.into_iter().chain(light));
    }
    let ends = world.segments.iter().flatten().copied().filter(|p| p.abs().max_element() < FARTHEST / 2.0);
    // Not what lies near the horizon.
    let mut seen: Vec<DVec2> = found.film.iter().flat_map(|f| &f.samples).map(|s| s.point).collect();
    seen.sort_by(|a, b| a.distance(world.eye).total_cmp(&b.distance(world.eye)));
    let most = seen.get(seen.len() * 17 / 20).map_or(0.0, |p| 2.0 * p.distance(world.eye));
    seen.retain(|p| p.distance(world.eye) <= most);
    View::fitted(rect, [world.eye, world.light].into_iter().chain(ends).chain(seen))
}

/// The pointer on the ground: pans, zooms, selects, moves segments, draws them.
fn drag_ground(ui: &Ui, r: &Response, lab: &mut Lab, view: &mut View, post: Option<PostPerspective>) {
    let placed = view.placed(post);
    let origin = ui.input(|i| i.pointer.press_origin());
    let under = |at: Pos2, lab: &Lab| nearest(&placed, &lab.now.world, at);
    if r.drag_started()
        && let Some(at) = origin
    {
        let primary = r.dragged_by(PointerButton::Primary);
        lab.drag = Some(match under(at, lab) {
            _ if primary && lab.drawing => Drag::Draw(snapped(&placed, &lab.now.world, at)),
            Some(i) if primary && post.is_none() => {
                lab.selected = Some(i);
                Drag::Segment(i, placed.world(at))
            }
            _ => Drag::Pan,
        });
    }
    match (r.dragged(), lab.drag) {
        (true, Some(Drag::Pan)) => {
            let moved = r.drag_delta();
            view.middle -= DVec2::new(moved.x as f64, -moved.y as f64) / view.scale;
            view.own = true;
            ui.set_cursor_icon(CursorIcon::Grabbing);
        }
        (true, Some(Drag::Segment(i, before))) => {
            if let (Some(at), true) = (r.interact_pointer_pos(), i < lab.now.world.segments.len()) {
                let moved = rounded(placed.world(at) - before, view.scale);
                for end in &mut lab.now.world.segments[i] {
                    *end += moved;
                }
                lab.drag = Some(Drag::Segment(i, before + moved));
            }
        }
        _ => {}
    }
    if r.drag_stopped()
        && let Some(Drag::Draw(from)) = lab.drag.take()
        && let Some(at) = r.interact_pointer_pos()
    {
        let to = snapped(&placed, &lab.now.world, at);
        let long = placed.at(from).is_some_and(|from| from.distance(at) > 4.0);
        let full = lab.now.world.segments.len() >= crate::flatland::file::MOST_SEGMENTS;
        if long && to.is_finite() && !full {
            lab.now.world.segments.push([from, to]);
            lab.selected = Some(lab.now.world.segments.len() - 1);
        }
    }
    if r.clicked() && !lab.drawing {
        lab.selected = r.interact_pointer_pos().and_then(|at| under(at, lab));
    }
    if r.double_clicked() && lab.selected.is_none() {
        *view = fit(view.rect, &lab.now, &lab.found, post);
    }
    if lab.drawing && r.hovered() {
        ui.set_cursor_icon(CursorIcon::Crosshair);
    }
    let wheel = ui.input(|i| i.smooth_scroll_delta.y);
    if let Some(at) = r.hover_pos()
        && r.contains_pointer()
        && wheel != 0.0
    {
        let held = view.place_at(at);
        view.scale = (view.scale * (wheel as f64 * 0.004).exp()).clamp(1e-3, 1e6);
        view.middle += held - view.place_at(at);
        view.own = true;
    }
}

/// The segment that is drawn under the pointer.
fn nearest(placed: &Placed, world: &Flatland, at: Pos2) -> Option<usize> {
    let off = |i: usize| {
        let [a, b] = world.segments[i];
        let each = placed.lines(world, a, b).into_iter().map(|[a, b]| {
            let along = b - a;
            let t = ((at - a).dot(along) / along.length_sq().max(1e-9)).clamp(0.0, 1.0);
            (a + along * t).distance(at) as f64
        });
        each.fold(f64::INFINITY, f64::min)
    };
    let all = (0..world.segments.len()).map(|i| (off(i), i));
    all.filter(|(d, _)| *d < NEAR).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
}

/// A place under the pointer: an end of a segment that is near, or a round number.
fn snapped(placed: &Placed, world: &Flatland, at: Pos2) -> DVec2 {
    let ends = world.segments.iter().flatten().filter_map(|p| Some((placed.at(*p)?.distance(at) as f64, *p)));
    let near = ends.filter(|(d, _)| *d < NEAR).min_by(|a, b| a.0.total_cmp(&b.0));
    near.map_or(round_place(placed, at), |(_, p)| p)
}

pub fn round_place(placed: &Placed, at: Pos2) -> DVec2 {
    let limit = DVec2::splat(FARTHEST);
    rounded(placed.world(at), placed.view.scale).clamp(-limit, limit)
}

/// Rounded to less than a point.
fn rounded(p: DVec2, scale: f64) -> DVec2 {
    let places = 10f64.powf((scale / 0.5).log10().ceil());
    (p * places).round() / places
}

/// The world's axes as a fine grid, or the square that the view becomes.
fn grid(draw: &Draw) {
    let (view, visuals) = (draw.placed.view, draw.ui.visuals());
    let faint = Stroke::new(1.0, visuals.window_stroke.color.gamma_multiply(0.6));
    if draw.placed.post.is_some() {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|q| view.to_screen(q.into()));
        for i in 0..4 {
            if let Some(line) = clip(view.rect, corners[i], corners[(i + 1) % 4]) {
                draw.painter.line_segment(line, Stroke::new(1.0, visuals.weak_text_color()));
            }
        }
        return;
    }
    let step = 10f64.powf((110.0 / view.scale).log10().floor());
    let step = [5.0, 2.0, 1.0].map(|m| m * step).into_iter().find(|s| s * view.scale <= 110.0).unwrap_or(step);
    let [low, high] = [view.rect.left_bottom(), view.rect.right_top()].map(|p| view.place_at(p));
    let font = FontId::proportional(10.5);
    for i in (low.x / step).ceil() as i64..=(high.x / step).floor() as i64 {
        let x = view.to_screen(DVec2::new(i as f64 * step, 0.0)).x as f32;
        draw.painter.vline(x, view.rect.y_range(), faint);
        let at = pos2(x + 3.0, view.rect.bottom() - 2.0);
        let text = crate::chart::digits(i as f64 * step);
        draw.painter.text(at, Align2::LEFT_BOTTOM, text, font.clone(), visuals.weak_text_color().gamma_multiply(0.7));
    }
    for i in (low.y / step).ceil() as i64..=(high.y / step).floor() as i64 {
        let y = view.to_screen(DVec2::new(0.0, i as f64 * step)).y as f32;
        draw.painter.hline(view.rect.x_range(), y, faint);
    }
}

fn segments(draw: &Draw, lab: &Lab) {
    for (i, [a, b]) in lab.now.world.segments.iter().enumerate() {
        let visuals = draw.ui.visuals();
        let stroke = match lab.selected == Some(i) {
            true => Stroke::new(9.0, visuals.selection.bg_fill),
            false => Stroke::new(7.0, visuals.weak_text_color().gamma_multiply(0.55)),
        };
        draw.line(*a, *b, stroke);
    }
    if let (Some(Drag::Draw(from)), Some(at)) = (lab.drag, draw.ui.input(|i| i.pointer.interact_pos())) {
        let to = snapped(draw.placed, &lab.now.world, at);
        draw.line(from, to, Stroke::new(5.0, draw.ui.visuals().hyperlink_color));
    }
}

/// How far rays go that meet nothing.
fn far(placed: &Placed) -> f64 {
    if placed.post.is_some() { 1e4 } else { 2.0 * placed.view.rect.size().length() as f64 / placed.view.scale }
}

/// The frusta that the light has: directions, normal, lexels and a colour of their own where there are several.
pub fn frusta(found: &Found, film: &Film, lexels: usize) -> Vec<([f64; 2], f64, usize, Option<usize>)> {
    if found.parts.is_empty() {
        let whole = |normal| ([film.bottom, film.top], normal, lexels, None);
        return found.chosen.iter().map(|row| whole(row.normal)).collect();
    }
    let parts = found.parts.iter().enumerate().filter(|(_, p)| p.lexels > 0);
    parts.map(|(i, p)| (p.hull, p.normal, p.lexels, Some(i))).collect()
}

/// The colour of a part.
pub fn part_color(ui: &Ui, i: usize) -> Color32 {
    color(ui, LABELS[[3, 6, 2, 5][i % 4]])
}

/// The direction to a place of a film, 0 to 1.
fn direction([bottom, top]: [f64; 2], normal: f64, place: f64) -> f64 {
    let [low, high] = [bottom, top].map(|a| (a - normal).tan());
    normal + (low + (high - low) * place).atan()
}

fn rays(draw: &Draw, s: &State, found: &Found) {
    let world = draw.world;
    let reach = far(draw.placed);
    let view_color = draw.ui.visuals().hyperlink_color;
    if s.show.pixel_rays {
        let stride = world.pixels.div_ceil(RAYS);
        for i in (0..world.pixels).step_by(stride) {
            let ray = world.ray(i as f64 + stride.min(world.pixels) as f64 / 2.0);
            let to = world.first(world.eye, ray).map_or(ray.normalize() * reach, |(depth, _)| ray * depth);
            draw.line(world.eye, world.eye + to, Stroke::new(0.7, view_color.gamma_multiply(0.35)));
        }
    }
    for p in [0.0, world.pixels as f64] {
        let to = world.eye + world.ray(p).normalize() * reach;
        draw.line(world.eye, to, Stroke::new(1.0, view_color.gamma_multiply(0.8)));
    }
    let (Some(film), true) = (&found.film, s.show.lexel_rays) else { return };
    let frusta = frusta(found, film, world.lexels);
    let all: usize = frusta.iter().map(|f| f.2).sum();
    let stride = all.div_ceil(RAYS).max(1);
    for (hull, normal, lexels, part) in frusta {
        let tint = part.map_or(draw.ui.visuals().warn_fg_color, |i| part_color(draw.ui, i));
        let mut edges: Vec<usize> = (0..lexels).step_by(stride).collect();
        edges.push(lexels);
        for j in edges {
            let ray = DVec2::from_angle(direction(hull, normal, j as f64 / lexels as f64));
            let depth = world.first(world.light, ray).map_or(reach, |(depth, _)| depth);
            let edge = j == 0 || j == lexels;
            let stroke = Stroke::new(if edge { 1.0 } else { 0.7 }, tint.gamma_multiply(if edge { 0.8 } else { 0.4 }));
            draw.line(world.light, world.light + ray * depth, stroke);
        }
    }
}

/// Where a ray meets a segment's line, as a share of the segment; its far end where the ray runs away from it.
fn share(world: &Flatland, origin: DVec2, ray: DVec2, segment: usize) -> f64 {
    let [a, b] = world.segments[segment];
    let across = ray.perp_dot(b - a);
    let (depth, place) = ((a - origin).perp_dot(b - a) / across, (a - origin).perp_dot(ray) / across);
    if depth > 0.0 && place.is_finite() {
        place.clamp(0.0, 1.0)
    } else {
        (b.distance_squared(origin) > a.distance_squared(origin)) as u8 as f64
    }
}

/// Footprints along the segments.
fn spans(draw: &Draw, s: &State, found: &Found) {
    let world = draw.world;
    let colour = |segment: usize, [from, to]: [f64; 2], color: Color32, ends: bool| {
        let [a, b] = world.segments[segment];
        let [from, to] = [from, to].map(|t| a + (b - a) * t);
        for line in draw.placed.lines(world, from, to) {
            draw.painter.line_segment(line, Stroke::new(5.0, color));
            let long = line[0].distance(line[1]);
            if ends && long > 3.0 {
                let side = (line[1] - line[0]).rot90() / long * 5.5;
                let tick = Stroke::new(1.0, draw.ui.visuals().extreme_bg_color);
                draw.painter.line_segment([line[1] - side, line[1] + side], tick);
            }
        }
    };
    match s.show.spans {
        Spans::Off => {}
        Spans::Pixels => {
            let group = found.seen.len().div_ceil(SPANS).max(1);
            for same in found.seen.chunk_by(|a, b| a.segment == b.segment) {
                for run in same.chunks(group) {
                    let places = [run[0].place - 0.5, run[run.len() - 1].place + 0.5];
                    let ends = places.map(|p| share(world, world.eye, world.ray(p), run[0].segment));
                    let mean = run.iter().map(|x| x.footprint.ln()).sum::<f64>() / run.len() as f64;
                    colour(run[0].segment, ends, octaves(mean.exp()), group == 1);
                }
            }
        }
        Spans::Lexels => {
            let Some(film) = &found.film else { return };
            for (hull, normal, lexels, _) in frusta(found, film, world.lexels) {
                let group = lexels.div_ceil(SPANS).max(1);
                for j in (0..lexels).step_by(group) {
                    let next = (j + group).min(lexels);
                    let at = |j: f64| DVec2::from_angle(direction(hull, normal, j / lexels as f64));
                    let Some((_, segment)) = world.first(world.light, at((j + next) as f64 / 2.0)) else { continue };
                    let ends = [j, next].map(|j| share(world, world.light, at(j as f64), segment));
                    let [a, b] = world.segments[segment];
                    let points = ends.map(|t| a + (b - a) * t);
                    let before = points.iter().all(|p| (*p - world.eye).dot(world.forward()) > 0.0);
                    let places = points.map(|p| world.place(p));
                    let middle = (places[0] + places[1]) / 2.0;
                    if before && (0.0..=world.pixels as f64).contains(&middle) {
                        let footprint = (places[1] - places[0]).abs() / (next - j) as f64;
                        colour(segment, ends, octaves(footprint), group == 1);
                    }
                }
            }
        }
    }
}

/// Theorem 1: from the eye across the view to the plane's line, and from there to the light.
fn construction(draw: &Draw, s: &State) {
    let Choice::Plane(i) = s.film else { return };
    let (world, side) = (draw.world, draw.world.forward().perp());
    let [a, b] = world.segments[i];
    let meets = world.eye + side * ((a - world.eye).perp_dot(b - a) / side.perp_dot(b - a));
    if draw.placed.post.is_some() || !meets.is_finite() {
        return;
    }
    let stroke = Stroke::new(1.2, draw.ui.visuals().text_color().gamma_multiply(0.8));
    draw.dashed(world.eye, meets, stroke);
    draw.dashed(meets, world.light, stroke);
    let end = if a.distance_squared(meets) < b.distance_squared(meets) { a } else { b };
    let on = ((meets - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    if on == 0.0 || on == 1.0 {
        draw.dashed(end, meets, Stroke::new(1.0, stroke.color.gamma_multiply(0.6)));
    }
    if let Some(at) = draw.placed.at(meets) {
        draw.painter.circle_filled(at, 3.5, stroke.color);
        draw.painter.text(at + vec2(6.0, -4.0), Align2::LEFT_BOTTOM, "q", FontId::proportional(13.0), stroke.color);
    }
}

/// The near line of the perspective map's frustum in its own space.
fn near_line(draw: &Draw, found: &Found) {
    let (Some(p), Some(post), view) = (found.perspective, draw.placed.post, draw.placed.view) else { return };
    let [point, meets] = p.line;
    let [a, b] = [point, point + (meets - point) * 0.5].map(|p| post.project(p)).map(|q| DVec2::new(q.y, q.x));
    let along = (b - a).normalize_or_zero() * 50.0;
    let tint = tint(draw.ui, Choice::NearLine);
    if let Some(line) = clip(view.rect, view.to_screen(a - along), view.to_screen(a + along)) {
        draw.painter.line_segment(line, Stroke::new(1.6, tint));
        let at = view.to_screen(a);
        let at = pos2(at.x as f32, at.y as f32);
        draw.painter.circle_filled(at, 3.0, tint);
        draw.painter.text(at + vec2(-40.0, -5.0), Align2::RIGHT_BOTTOM, "near line", FontId::proportional(12.0), tint);
    }
}

/// What the spans' colours mean.
fn legend(ui: &Ui, painter: &Painter, rect: Rect) {
    let (font, text) = (FontId::proportional(11.5), ui.visuals().text_color());
    let at = rect.left_bottom() + vec2(12.0, -34.0);
    let (width, count) = (17.0, OCTAVES.stops.len());
    let back = Rect::from_min_size(at - vec2(6.0, 17.0), vec2(width * count as f32 + 12.0, 48.0)).intersect(rect);
    painter.rect_filled(back, 4.0, ui.visuals().extreme_bg_color.gamma_multiply(0.85));
    painter.text(at - vec2(0.0, 2.0), Align2::LEFT_BOTTOM, "pixels a lexel", font.clone(), text);
    for i in 0..count {
        let block = Rect::from_min_size(at + vec2(i as f32 * width, 0.0), vec2(width - 1.0, 9.0));
        painter.rect_filled(block, 1.0, octaves(2f64.powi(i as i32 - 4)));
        if i % 2 == 0 {
            let name = ["1/16", "1/4", "1", "4", "16"][i / 2];
            painter.text(block.center_bottom() + vec2(0.0, 2.0), Align2::CENTER_TOP, name, font.clone(), text);
        }
    }
}

/// A sentence in the middle of the world.
fn say(ui: &Ui, painter: &Painter, rect: Rect, text: &str) {
    let width = (rect.width() - 40.0).max(60.0);
    let galley = painter.layout(text.into(), FontId::proportional(14.0), ui.visuals().warn_fg_color, width);
    let place = Align2::CENTER_TOP.anchor_size(rect.center_top() + vec2(0.0, 30.0), galley.size());
    painter.rect_filled(place.expand2(vec2(8.0, 4.0)), 4.0, ui.visuals().panel_fill);
    painter.galley(place.min, galley, ui.visuals().warn_fg_color);
}
