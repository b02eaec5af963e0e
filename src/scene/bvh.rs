//! The BVH that shadow rays walk: built binary, then widened to four children a node, whose boxes take a byte a plane.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::ops::Range;

/// A node with up to four children, inner nodes before leaves, as three texels that `shaders/lib/trace.wgsl` reads.
///
/// A plane of child k's box lies at `origin` + byte k × the axis' scale (after Ylitie, Karras, Laine 2017), rounded
/// outward: what is decoded holds the child whole.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Node {
    pub origin: Vec3,
    /// From the lowest bit: the scales of x, y and z as exponents of `f32`, 8 bits each; each child's triangles,
    /// 2 bits each, 0 for an inner node.
    pub scales: u32,
    /// The first inner child × 8 + how many there are; they lie side by side.
    pub children: u32,
    /// The first triangle of the leaves, whose triangles lie side by side in the order of the children.
    pub triangles: u32,
    pub low: [u32; 3],
    pub high: [u32; 3],
}

/// What lies in a child's box.
pub enum Child {
    /// Another of [`Bvh::nodes`].
    Node(usize),
    /// A stretch of [`Bvh::order`].
    Triangles(Range<usize>),
}

/// A BVH of triangles.
pub struct Bvh {
    /// The root first.
    pub nodes: Vec<Node>,
    /// The triangles in the order in which the nodes name them.
    pub order: Vec<u32>,
    /// The box of all.
    pub bounds: [Vec3; 2],
}

/// Levels that the shader's stack can hold.
const MAX_DEPTH: usize = 64;
/// Triangles that a leaf may have.
const MAX_LEAF: u32 = 3;

impl Bvh {
    /// Builds one, no deeper than the shader's stack.
    pub fn new(triangles: &[Triangle]) -> Bvh {
        let boxes: Vec<[Vec3; 2]> =
            triangles.iter().map(|t| [t.v0.min(t.v1).min(t.v2).into(), t.v0.max(t.v1).max(t.v2).into()]).collect();
        if !heaped(&boxes) {
            let (wide, depth) = Bvh::clustered(triangles);
            if depth <= MAX_DEPTH {
                return wide;
            }
        }
        // Many triangles in one place can make that builder nest without end; halving the list cannot.
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = vec![Bvh2Node::default()];
        halve(&boxes, &mut order, 0, 0, &mut nodes);
        widened(nodes, &order).0
    }

    /// Built by merging neighbours (Meister, Bittner 2018), with its depth.
    fn clustered(triangles: &[Triangle]) -> (Bvh, usize) {
        let config = obvhs::BvhBuildParams {
            pre_split: false,
            max_prims_per_leaf: MAX_LEAF,
            ..obvhs::BvhBuildParams::fast_build()
        };
        let bvh = obvhs::bvh2::builder::build_bvh2_from_tris(triangles, config, &mut Default::default());
        widened(bvh.nodes, &bvh.primitive_indices)
    }
}

/// Boxes of a sample in which those are counted that lie one in the other.
const SAMPLE: usize = 1024;
/// So many of the sample, each in or around as many others, are a heap.
const HEAP: usize = 24;

/// Whether many boxes, given by their low and high ends, lie one in the other. Of these each is nearest to the smaller one beside it, so that merging
/// neighbours, a pair a round, would take as many rounds as there are boxes.
pub fn heaped(boxes: &[[Vec3; 2]]) -> bool {
    // Few take no time either way.
    if boxes.len() <= 8 * SAMPLE {
        return false;
    }
    // Spread over the list, in no step that the list may have too.
    let sample: Vec<[Vec3; 2]> =
        (0..SAMPLE).map(|i| boxes[(i as u64 * 2_654_435_761 % boxes.len() as u64) as usize]).collect();
    let within = |a: &[Vec3; 2], b: &[Vec3; 2]| a[0].cmpge(b[0]).all() && a[1].cmple(b[1]).all();
    let nested = |a: &&[Vec3; 2]| sample.iter().filter(|b| within(a, b) || within(b, a)).take(HEAP + 1).count() > HEAP;
    sample.par_iter().filter(nested).count() >= HEAP
}

/// Makes node `at` of the triangles `order`, which begin at `first` of the whole list, by halves along the longest axis.
fn halve(boxes: &[[Vec3; 2]], order: &mut [u32], first: usize, at: usize, nodes: &mut Vec<Bvh2Node>) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for i in order.iter() {
        low = low.min(boxes[*i as usize][0]);
        high = high.max(boxes[*i as usize][1]);
    }
    nodes[at] = Bvh2Node { min: low, max: high, prim_count: order.len() as u32, first_index: first as u32 };
    if order.len() > MAX_LEAF as usize {
        let axis = (high - low).max_position();
        let middle = order.len() / 2;
        let place = |i: &u32| boxes[*i as usize][0][axis] + boxes[*i as usize][1][axis];
        order.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
        let children = nodes.len();
        nodes[at].prim_count = 0;
        nodes[at].first_index = children as u32;
        nodes.extend([Bvh2Node::default(); 2]);
        let (left, right) = order.split_at_mut(middle);
        halve(boxes, left, first, children, nodes);
        halve(boxes, right, first + middle, children + 1, nodes);
    }
}

/// Gives each node up to four children: those of the largest boxes give way to their own. Also says how deep it is.
fn widened(mut binary: Vec<Bvh2Node>, order: &[u32]) -> (Bvh, usize) {
    // An ulp of room, so that rounding in the shader loses nothing.
    for node in &mut binary {
        node.min = node.min.to_array().map(f32::next_down).into();
        node.max = node.max.to_array().map(f32::next_up).into();
    }
    let area = |n: &Bvh2Node| {
        let d = n.max - n.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    };
    let bounds = [binary[0].min, binary[0].max];
    let mut wide = Bvh { nodes: vec![Node::default()], order: Vec::with_capacity(order.len()), bounds };
    let mut deepest = 0;
    // Binary node, where it goes, its depth.
    let mut todo = vec![(0, 0, 1)];
    while let Some((from, to, depth)) = todo.pop() {
        deepest = deepest.max(depth);
        let mut children: Vec<usize> = vec![from];
        while children.len() < 4 {
            let inner = (0..children.len()).filter(|i| !binary[children[*i]].is_leaf());
            let Some(i) = inner.max_by(|a, b| area(&binary[children[*a]]).total_cmp(&area(&binary[children[*b]])))
            else {
                break;
            };
            let first = binary[children.swap_remove(i)].first_index as usize;
            children.extend([first, first + 1]);
        }
        // The largest first: it is the likeliest to stop the ray.
        children.sort_by(|a, b| {
            let (a, b) = (&binary[*a], &binary[*b]);
            a.is_leaf().cmp(&b.is_leaf()).then(area(b).total_cmp(&area(a)))
        });
        let boxes: Vec<_> = children.iter().map(|c| [binary[*c].min, binary[*c].max]).collect();
        let mut node = Node::of(&boxes);
        let inner = children.partition_point(|c| !binary[*c].is_leaf());
        node.children = (wide.nodes.len() << 3 | inner) as u32;
        node.triangles = wide.order.len() as u32;
        for (k, child) in children.iter().enumerate() {
            let child = &binary[*child];
            if child.is_leaf() {
                let first = child.first_index as usize;
                wide.order.extend(&order[first..first + child.prim_count as usize]);
                node.scales |= child.prim_count << (24 + 2 * k);
            }
        }
        // The first on top, so that what is walked together lies together.
        todo.extend((0..inner).rev().map(|k| (children[k], wide.nodes.len() + k, depth + 1)));
        wide.nodes.resize(wide.nodes.len() + inner, Node::default());
        wide.nodes[to] = node;
    }
    (wide, deepest)
}

impl Node {
    /// Its children, each with the two ends of a box that holds it, as the shader decodes them.
    pub fn children(&self) -> impl Iterator<Item = ([Vec3; 2], Child)> {
        let (first, inner) = (self.children as usize >> 3, self.children as usize & 7);
        let plane = |bytes: &[u32; 3], axis: usize, k: usize| {
            let scale = f32::from_bits((self.scales >> (8 * axis) & 255) << 23);
            self.origin[axis] + (bytes[axis] >> (8 * k) & 255) as f32 * scale
        };
        let mut leaf = self.triangles as usize;
        (0..4).filter_map(move |k| {
            let count = (self.scales >> (24 + 2 * k) & 3) as usize;
            let child = if k < inner { Child::Node(first + k) } else { Child::Triangles(leaf..leaf + count) };
            leaf += count;
            let ends = [&self.low, &self.high].map(|b| Vec3::from_array([0, 1, 2].map(|axis| plane(b, axis, k))));
            (k < inner || count > 0).then_some((ends, child))
        })
    }

    /// A node around the boxes of its children, with neither inner nodes nor triangles yet.
    fn of(boxes: &[[Vec3; 2]]) -> Node {
        let origin = boxes.iter().fold(Vec3::INFINITY, |low, b| low.min(b[0]));
        let end = boxes.iter().fold(Vec3::NEG_INFINITY, |high, b| high.max(b[1]));
        let mut node = Node { origin, ..Node::default() };
        for axis in 0..3 {
            let (origin, end) = (origin[axis], end[axis]);
            // As the shader decodes it: the product is exact, and the sum rounded once.
            let plane = |exponent: u32, byte: u32| origin + byte as f32 * f32::from_bits(exponent << 23);
            // Each step moves a plane: no less than an ulp.
            let least = (origin.abs().max(end.abs()) * f32::EPSILON).max(f32::MIN_POSITIVE).to_bits() >> 23;
            let mut exponent = least.max(((end - origin) / 255.0).to_bits() >> 23);
            while plane(exponent, 255) < end && exponent < 245 {
                exponent += 1;
            }
            node.scales |= exponent << (8 * axis);
            // An empty child's box is inside out.
            let (mut low, mut high) = (u32::MAX, 0);
            for (k, b) in boxes.iter().enumerate() {
                let steps = |to: f32| (to - origin) / f32::from_bits(exponent << 23);
                let mut from = steps(b[0][axis]).floor() as u32;
                while from > 0 && plane(exponent, from) > b[0][axis] {
                    from -= 1;
                }
                let mut to = (steps(b[1][axis]).ceil() as u32).min(255);
                while to < 255 && plane(exponent, to) < b[1][axis] {
                    to += 1;
                }
                low = low & !(255 << (8 * k)) | from.min(255) << (8 * k);
                high |= to << (8 * k);
            }
            node.low[axis] = low;
            node.high[axis] = high;
        }
        node
    }
}
