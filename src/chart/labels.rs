//! Finds room for labels in a chart: beside what they name, off the lines, and never on one another.

/// Left, top, right, bottom, points.
pub type Rect = [f64; 4];
pub type Point = (f64, f64);

/// What a label must keep off.
#[derive(Clone)]
pub struct Room {
    pub bounds: Rect,
    /// Markers, each with the number of its line.
    pub markers: Vec<(Point, usize)>,
    /// Lines from point to point, and how much it hurts to cross them.
    pub segments: Vec<(Point, Point, f64)>,
    /// Labels already there.
    pub taken: Vec<Rect>,
}

/// A label that looks for its place.
pub struct Wish {
    /// The number of its line.
    pub owner: usize,
    pub size: (f64, f64),
    /// What it may stand beside, at least one, each with what choosing it costs.
    pub beside: Vec<(Point, f64)>,
    /// Farthest from there, points.
    pub reach: f64,
}

/// Where a label goes.
#[derive(Clone, Copy)]
pub struct Found {
    pub rect: Rect,
    /// What it stands beside.
    pub beside: Point,
    /// How bad the place is: from 1000 up it covers another label or leaves the plot, from 40 up it covers a marker.
    pub cost: f64,
}

const CROWDED: f64 = 1000.0;
/// Distances tried, points.
const DISTANCES: [f64; 10] = [3.5, 5.0, 7.5, 11.0, 16.0, 23.0, 33.0, 46.0, 64.0, 90.0];

impl Room {
    /// The best place there is. The room does not take it.
    pub fn find(&self, wish: &Wish) -> Found {
        let (w, h) = wish.size;
        let mut best = Found { rect: self.bounds, beside: (self.bounds[0], self.bounds[1]), cost: f64::INFINITY };
        for (p, price) in &wish.beside {
            for d in DISTANCES.into_iter().filter(|d| *d <= wish.reach) {
                // To the side, in the corners, above and below: the side reads best.
                let s = d * 0.7;
                let places = [
                    (d, -h / 2.0, 0.0),
                    (-d - w, -h / 2.0, 0.4),
                    (s, -s - h, 0.6),
                    (s, s, 0.6),
                    (-s - w, -s - h, 0.8),
                    (-s - w, s, 0.8),
                    (-w / 2.0, -d - h, 0.6),
                    (-w / 2.0, d, 0.8),
                ];
                for (dx, dy, side) in places {
                    let rect = [p.0 + dx, p.1 + dy, p.0 + dx + w, p.1 + dy + h];
                    let cost = price + side + 0.35 * (d - DISTANCES[0]);
                    if let Some(cost) = self.cost(&rect, wish.owner, cost, best.cost) {
                        best = Found { rect, beside: *p, cost };
                    }
                }
            }
        }
        best
    }

    /// What a place costs beside what it costs anyway; None if that is no less than `best`, which soon shows where it is crowded.
    fn cost(&self, r: &Rect, owner: usize, anyway: f64, best: f64) -> Option<f64> {
        let b = &self.bounds;
        let outside = (b[0] - r[0]).max(b[1] - r[1]).max(r[2] - b[2]).max(r[3] - b[3]).max(0.0);
        let mut cost = anyway + if outside > 0.0 { CROWDED * (1.0 + outside) } else { 0.0 };
        for t in &self.taken {
            if overlap(r, t, 0.8) {
                cost += CROWDED;
            }
        }
        for ((x, y), of) in &self.markers {
            let m = super::canvas::MARKER + 0.3;
            let box_of = |m: f64| [x - m, y - m, x + m, y + m];
            if overlap(r, &box_of(m), 0.0) {
                cost += 40.0;
            } else if *of != owner && overlap(r, &box_of(m + 3.0), 0.0) {
                // It would seem to name another line.
                cost += 3.0;
            }
            if cost >= best {
                return None;
            }
        }
        for (from, to, weight) in &self.segments {
            cost += weight * inside(r, *from, *to);
            if cost >= best {
                return None;
            }
        }
        (cost < best).then_some(cost)
    }
}

/// Finds places for labels together: one after another, then each twice more, now that it is known where the others went;
/// once in their order and once in the opposite one, of which the better is taken.
pub fn arrange(room: &Room, wishes: &[Wish]) -> Vec<Found> {
    let trial = |order: &[usize]| {
        let mut room = Room { taken: vec![NOWHERE; wishes.len()], ..room.clone() };
        let mut found = vec![Found { rect: NOWHERE, beside: (0.0, 0.0), cost: 0.0 }; wishes.len()];
        for i in order.iter().chain(order).chain(order) {
            room.taken[*i] = NOWHERE;
            found[*i] = room.find(&wishes[*i]);
            room.taken[*i] = found[*i].rect;
        }
        found
    };
    let there: Vec<usize> = (0..wishes.len()).collect();
    let back: Vec<usize> = (0..wishes.len()).rev().collect();
    let (a, b) = (trial(&there), trial(&back));
    let sum = |f: &[Found]| f.iter().map(|f| f.cost).sum::<f64>();
    if sum(&b) < sum(&a) { b } else { a }
}

const NOWHERE: Rect = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];

/// Whether two rectangles come closer than a gap.
pub fn overlap(a: &Rect, b: &Rect, gap: f64) -> bool {
    a[0] < b[2] + gap && b[0] < a[2] + gap && a[1] < b[3] + gap && b[1] < a[3] + gap
}

/// Length of the part of a line that lies in a rectangle (Liang, Barsky 1984).
pub fn inside(r: &Rect, from: Point, to: Point) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for (along, distance) in [(-dx, from.0 - r[0]), (dx, r[2] - from.0), (-dy, from.1 - r[1]), (dy, r[3] - from.1)] {
        if along == 0.0 {
            if distance < 0.0 {
                return 0.0;
            }
        } else if along < 0.0 {
            enter = enter.max(distance / along);
        } else {
            leave = leave.min(distance / along);
        }
    }
    (leave - enter).max(0.0) * dx.hypot(dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_inside_a_rectangle() {
        let r = [0.0, 0.0, 10.0, 5.0];
        assert_eq!(inside(&r, (-5.0, 2.0), (15.0, 2.0)), 10.0);
        assert_eq!(inside(&r, (5.0, -5.0), (5.0, 2.0)), 2.0);
        assert_eq!(inside(&r, (-5.0, 6.0), (15.0, 6.0)), 0.0);
        assert_eq!(inside(&r, (0.0, 0.0), (10.0, 5.0)), 125f64.sqrt());
        assert_eq!(inside(&r, (-4.0, 0.0), (0.0, 9.0)), 0.0);
    }
}
