//! Warps by a grid of nodes: the WGSL solver and warp against f64, and what they do to pictures.

use crate::common::*;
use glam::{DMat2, DVec2, UVec2, Vec2, Vec3};
use shadowscope::gpu::{Gpu, Pass, Recorder, Resource, Shaders, Timer};
use shadowscope::map::filter::alone;
use shadowscope::map::warp::storage;
use shadowscope::measure::{self};
use shadowscope::params::{Value, Values};
use shadowscope::techniques;

const GRIDS: [&str; 2] = ["dsm", "fem-grid"];

/// The solver of `map/warp/relax.wgsl` in f64, on a grid of `side`² cells.
struct Twin {
    side: usize,
    wanted: Vec<f64>,
    smoothing: f64,
    floor: f64,
    nodes: Vec<DVec2>,
}

impl Twin {
    /// As `even_out`.
    fn new(side: usize, weights: &[f64], spare: f64, smoothing: f64, floor: f64) -> Twin {
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        let wanted = weights.iter().map(|w| (w / mean + spare) / (1.0 + spare)).collect();
        let nodes = (0..(side + 1) * (side + 1)).map(|i| Self::place(side, i).as_dvec2()).collect();
        Twin { side, wanted, smoothing, floor, nodes }
    }

    fn place(side: usize, node: usize) -> UVec2 {
        UVec2::new((node % (side + 1)) as u32, (node / (side + 1)) as u32)
    }

    fn free(&self, node: usize) -> DVec2 {
        let inner = |x: u32| (x > 0 && x < self.side as u32) as u32 as f64;
        let p = Self::place(self.side, node);
        DVec2::new(inner(p.x), inner(p.y))
    }

    /// Nodes around a cell.
    fn corners(&self, cell: usize) -> [usize; 4] {
        let row = self.side + 1;
        let i = cell / self.side * row + cell % self.side;
        [i, i + 1, i + row + 1, i + row]
    }

    /// The four corner triangles of a cell.
    fn triangles(&self, cell: usize) -> [[usize; 3]; 4] {
        let c = self.corners(cell);
        [0, 1, 2, 3].map(|k| [c[k], c[(k + 1) % 4], c[(k + 3) % 4]])
    }

    fn area(nodes: &[DVec2], t: [usize; 3]) -> f64 {
        0.5 * (nodes[t[1]] - nodes[t[0]]).perp_dot(nodes[t[2]] - nodes[t[0]])
    }

    fn neighbours(&self, node: usize) -> Vec<usize> {
        let free = self.free(node);
        let mut all = Vec::new();
        if free.x > 0.0 {
            all.extend([node - 1, node + 1]);
        }
        if free.y > 0.0 {
            all.extend([node - self.side - 1, node + self.side + 1]);
        }
        all
    }

    fn bend(&self, nodes: &[DVec2], node: usize) -> DVec2 {
        let around = self.neighbours(node);
        if around.is_empty() {
            return DVec2::ZERO;
        }
        let mean = around.iter().map(|i| nodes[*i]).sum::<DVec2>() / around.len() as f64;
        self.free(node) * (nodes[node] - mean)
    }

    /// The potential above its least, and the least area of a triangle.
    fn potential(&self, nodes: &[DVec2]) -> (f64, f64) {
        let (mut sum, mut least) = (0.0, f64::MAX);
        for (cell, wanted) in self.wanted.iter().enumerate() {
            for t in self.triangles(cell) {
                let area = Self::area(nodes, t);
                let ratio = area.max(1e-20) / (0.5 * wanted);
                sum += 0.25 * wanted * (ratio - 1.0 - ratio.ln());
                least = least.min(area);
            }
        }
        let bends = (0..nodes.len()).map(|i| self.bend(nodes, i).length_squared()).sum::<f64>();
        (sum + 0.5 * self.smoothing * bends, least)
    }

    /// The potential's slope at each node, and the curvature of its own triangles and bends.
    fn slopes(&self) -> Vec<(DVec2, DMat2)> {
        let mut all = vec![(DVec2::ZERO, DMat2::ZERO); self.nodes.len()];
        for (cell, wanted) in self.wanted.iter().enumerate() {
            for t in self.triangles(cell) {
                let area = Self::area(&self.nodes, t);
                for k in 0..3 {
                    let g = 0.5 * (self.nodes[t[(k + 1) % 3]] - self.nodes[t[(k + 2) % 3]]).perp() * -1.0;
                    all[t[k]].0 += 0.5 * (1.0 - 0.5 * wanted / area) * g;
                    all[t[k]].1 += DMat2::from_cols(g * g.x, g * g.y) * (0.25 * wanted / (area * area));
                }
            }
        }
        for node in 0..self.nodes.len() {
            let (bend, around) = (self.bend(&self.nodes, node), self.neighbours(node));
            all[node].0 += self.smoothing * bend;
            for i in &around {
                all[*i].0 -= self.smoothing / around.len() as f64 * bend;
            }
            all[node].1 += DMat2::IDENTITY * (1.25 * self.smoothing);
        }
        all
    }

    fn steps(&mut self, steps: usize, rate: f64) -> Vec<f64> {
        let mut moves = vec![DVec2::ZERO; self.nodes.len()];
        let mut now = self.potential(&self.nodes).0;
        let mut curve = vec![now];
        let mut gone_on = false;
        for _ in 0..steps {
            for (node, (slope, curvature)) in self.slopes().into_iter().enumerate() {
                let free = self.free(node);
                let step = match free.x * free.y > 0.0 {
                    true => -(curvature.inverse() * slope),
                    false => -slope / DVec2::new(curvature.x_axis.x, curvature.y_axis.y),
                };
                moves[node] = free * (rate * step + 0.9 * moves[node]);
            }
            let mut share = vec![1f64; self.nodes.len()];
            for t in (0..self.wanted.len()).flat_map(|c| self.triangles(c)) {
                let area = Self::area(&self.nodes, t);
                for k in 0..3 {
                    let g = -0.5 * (self.nodes[t[(k + 1) % 3]] - self.nodes[t[(k + 2) % 3]]).perp();
                    let loss = -g.dot(moves[t[k]]);
                    if loss > 0.0 {
                        share[t[k]] = share[t[k]].min(0.3 * (area - self.floor) / loss);
                    }
                }
            }
            moves.iter_mut().zip(&share).for_each(|(m, s)| *m *= *s);
            let after = |s: f64| self.nodes.iter().zip(&moves).map(|(p, m)| *p + *m * s).collect::<Vec<_>>();
            let found = (0..12).map(|k| 0.5f64.powi(k)).find(|s| {
                let (energy, least) = self.potential(&after(*s));
                energy < now && least > self.floor
            });
            if found.is_none() && !gone_on {
                break;
            }
            let s = found.unwrap_or(0.0);
            self.nodes = after(s);
            moves.iter_mut().for_each(|m| *m *= s);
            gone_on = found.is_some();
            now = self.potential(&self.nodes).0;
            curve.push(now);
        }
        curve
    }

    /// A cell's area over what it asks for, for all of them.
    fn ratios(&self, nodes: &[DVec2]) -> Vec<f64> {
        let area = |c: usize| self.triangles(c).map(|t| Self::area(nodes, t)).iter().sum::<f64>() / 2.0;
        self.wanted.iter().enumerate().map(|(c, w)| area(c) / w).collect()
    }
}

/// Passes of a technique's shader outside a frame. Shaders come from a copy with a test's own on top.
struct Bench {
    gpu: Gpu,
    _folder: tempfile::TempDir,
}

const PROBE: &str = "
var<storage, read> places: array<vec2f>;
var<storage, read_write> probed: array<vec4f>;

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&places) {
        let slope = warp_slope(places[id.x]);
        probed[2u * id.x] = vec4f(warp(places[id.x]), unwarp(warp(places[id.x])));
        probed[2u * id.x + 1u] = vec4f(slope[0], slope[1]);
    }
}
";

impl Bench {
    fn new() -> Bench {
        let folder = tempfile::tempdir().unwrap();
        let probe = |id: &str| format!("//!include techniques/{id}.wgsl\n{PROBE}");
        std::fs::write(folder.path().join("probe.wgsl"), probe("fem_grid")).unwrap();
        let mut gpu = strict(Gpu::new(None).unwrap());
        gpu.shaders = Shaders::from_folder(folder.path());
        Bench { gpu, _folder: folder }
    }

    /// Solves a grid for `fem-grid`'s cell errors, and probes the warp: nodes, energies, and for each place where it goes,
    /// where it comes back to, and the slope there.
    fn solve(&self, side: usize, sums: &[f64], sets: &[(&str, Value)], places: &[Vec2]) -> Solved {
        let gpu = &self.gpu;
        let info = techniques::find("fem-grid").unwrap();
        let mut values = Values::new();
        values.insert("grid".into(), Value::Int(side as i64));
        values.insert("error".into(), Value::Text("sum".into()));
        values.extend(sets.iter().map(|(k, v)| (k.to_string(), v.clone())));
        let words = info.params[0].words(&values);
        let fem = gpu.buffer("fem", bytemuck::cast_slice(&words), wgpu::BufferUsages::UNIFORM);
        let fixed: Vec<u32> = sums.iter().flat_map(|s| [(s * 256.0) as u32, 0]).collect();
        let given = |label, bytes: &[u8]| gpu.buffer(label, bytes, wgpu::BufferUsages::STORAGE);
        let nodes = (side + 1) * (side + 1);
        let (placed, energies) = (storage(gpu, "nodes", nodes as u64 * 8), storage(gpu, "energies", 502 * 4));
        let table = storage(gpu, "table", (side * side * 16) as u64);
        let probed = storage(gpu, "probed", places.len() as u64 * 32);
        let bound: Vec<(&'static str, Resource)> = vec![
            ("fem", (&fem).into()),
            ("error_sums", (&given("sums", bytemuck::cast_slice(&fixed))).into()),
            ("solver", (&storage(gpu, "solver", nodes as u64 * 40)).into()),
            ("weights", (&storage(gpu, "weights", (side * side * 4) as u64)).into()),
            ("energies", (&energies).into()),
            ("placed_nodes", (&placed).into()),
            ("grid_nodes", (&placed).into()),
            ("cell_table", (&table).into()),
            ("table_made", (&table).into()),
            ("places", (&given("places", bytemuck::cast_slice(places))).into()),
            ("probed", (&probed).into()),
        ];
        let pass = |entry| Pass::compute(gpu, "test", &alone("probe.wgsl"), entry, info.params).unwrap();
        let (solve, make_table, probe) = (pass("solve"), pass("make_table"), pass("probe"));
        let mut timer = Timer::new(gpu);
        let mut recorder = Recorder::new(gpu, &mut timer, false, [1, 1]);
        recorder.run(&solve).bind_all(&bound).dispatch(1, 1, 1);
        let groups = side.div_ceil(4) as u32;
        recorder.run(&make_table).bind_all(&bound).dispatch(groups, groups, 1);
        recorder.run(&probe).bind_all(&bound).dispatch(places.len().div_ceil(64) as u32, 1, 1);
        recorder.finish().unwrap();
        gpu.check().unwrap();
        let read = |b: &wgpu::Buffer| bytemuck::pod_collect_to_vec::<u8, f32>(&gpu.read_buffer(b).unwrap());
        let energies = read(&energies);
        Solved {
            nodes: read(&placed).chunks(2).map(|p| DVec2::new(p[0] as f64, p[1] as f64)).collect(),
            energies: energies[1..energies[0] as usize + 2].to_vec(),
            probed: read(&probed).chunks(8).map(|p| p.try_into().unwrap()).collect(),
        }
    }
}

struct Solved {
    nodes: Vec<DVec2>,
    energies: Vec<f32>,
    probed: Vec<[f32; 8]>,
}

impl Solved {
    /// In cells.
    fn in_cells(&self, side: usize) -> Vec<DVec2> {
        self.nodes.iter().map(|p| *p * side as f64).collect()
    }
}

/// Errors a cell: a dense spot, or wild ones over many octaves.
fn sums(side: usize, wild: bool) -> Vec<f64> {
    let mut r = Random(11);
    (0..side * side)
        .map(|i| {
            let p = DVec2::new((i % side) as f64, (i / side) as f64) / side as f64;
            match wild {
                false => 4000.0 * (-p.distance_squared(DVec2::new(0.3, 0.6)) / 0.03).exp(),
                true => (100.0 * (10.0 * (r.next() as f64 - 0.5) - 3.0 * p.y).exp()).min(1e6),
            }
        })
        .map(|s: f64| (s * 256.0).floor() / 256.0)
        .collect()
}

/// The slope that the steps follow is the potential's, by differences.
#[test]
fn the_twin_descends_its_potential() {
    let mut t = Twin::new(8, &sums(8, true), 0.1, 0.3, 0.05);
    t.steps(5, 0.5);
    let slopes = t.slopes();
    for node in 0..t.nodes.len() {
        for axis in [DVec2::X, DVec2::Y].into_iter().filter(|a| a.dot(t.free(node)) > 0.0) {
            let at = |e: f64| {
                let mut nodes = t.nodes.clone();
                nodes[node] += axis * e;
                t.potential(&nodes).0
            };
            let (found, exact) = (slopes[node].0.dot(axis), (at(1e-6) - at(-1e-6)) / 2e-6);
            assert!((found - exact).abs() < 1e-5 * (1.0 + exact.abs()), "node {node}: {found}, {exact}");
        }
    }
}

/// The solver on the GPU goes the way of its twin, always down; areas come near their goals, and no triangle folds.
#[test]
fn energy_falls_and_areas_follow() {
    let bench = Bench::new();
    for (side, wild, smoothing) in [(16, false, 0.05), (16, true, 0.05), (32, false, 0.0), (13, true, 1.0)] {
        let weights = sums(side, wild);
        let sets = [("smoothing", Value::Float(smoothing)), ("steps", Value::Int(300))];
        let found = bench.solve(side, &weights, &sets, &[Vec2::ZERO]);
        let name = format!("{side}² wild: {wild}");
        assert!(found.energies.len() > 10, "{name}: {} steps", found.energies.len());
        assert!(found.energies.windows(2).all(|e| e[1] <= e[0]), "{name}: {:?}", found.energies);
        let nodes = found.in_cells(side);
        let mut twin = Twin::new(side, &weights, 0.1, smoothing, 0.05);
        let before = twin.ratios(&twin.nodes);
        let (energy, least) = twin.potential(&nodes);
        let last = *found.energies.last().unwrap() as f64;
        assert!((energy - last).abs() < 1e-3 * energy.max(1.0), "{name}: {last}, recomputed {energy}");
        assert!(least > 0.0499, "{name}: a triangle of {least}");
        let curve = twin.steps(300, 0.5);
        assert!(curve.windows(2).all(|e| e[1] <= e[0]), "{name}");
        let first_steps = curve.iter().zip(&found.energies).take(8);
        for (i, (exact, f)) in first_steps.enumerate() {
            assert!((*f as f64 - exact).abs() < 0.01 * exact.max(1.0), "{name}, step {i}: {f}, twin {exact}");
        }
        let off = (last - curve.last().unwrap()).abs();
        assert!(off < 0.03 * curve[0], "{name}: {last} at the end, twin {}", curve.last().unwrap());
        // Cells without a place to go stay where the floor holds them; the weighted mean of the rest must gain.
        let spread = |r: &[f64]| -> f64 {
            let sum: f64 = r.iter().zip(&twin.wanted).map(|(r, w)| w * r.ln().powi(2)).sum();
            (sum / twin.wanted.iter().sum::<f64>()).sqrt()
        };
        let (before, after) = (spread(&before), spread(&twin.ratios(&nodes)));
        assert!(after < if wild { 0.85 } else { 0.25 } * before, "{name}: {before} before, {after} after");
        for (i, p) in nodes.iter().enumerate() {
            let (regular, free) = (Twin::place(side, i).as_dvec2(), twin.free(i));
            assert!(((*p - regular) * (1.0 - free)).length() < 1e-6, "{name}: node {i} leaves its side: {p}");
        }
    }
    // Nothing to follow, no steps: the regular grid.
    for (weights, steps) in [(vec![0.0; 64], 100), (sums(8, true), 0)] {
        let found = bench.solve(8, &weights, &[("steps", Value::Int(steps))], &[Vec2::ZERO]);
        for (i, p) in found.in_cells(8).iter().enumerate() {
            assert!(p.distance(Twin::place(8, i).as_dvec2()) < 1e-6, "node {i} at {p}");
        }
    }
}

/// The springs, solved at once, balance the assembled forces, and fold where the potential does not.
#[test]
fn the_direct_stiffness_method_folds() {
    let bench = Bench::new();
    let seed = [("variant", Value::Text("seed-stiffness".into()))];
    for wild in [false, true] {
        let weights = sums(16, wild);
        let found = bench.solve(16, &weights, &seed, &[Vec2::ZERO]);
        let least = Twin::new(16, &weights, 0.1, 0.0, 0.0).potential(&found.in_cells(16)).1;
        assert!(least < -0.01, "wild: {wild}: least triangle {least}");
        let (first, last) = (found.energies[0], *found.energies.last().unwrap());
        assert!(last < 1e-8 * first, "wild: {wild}: residual {last} of {first}");
    }
}

/// Bilinear in each cell, with the right slope; every place comes back to where it was; sides stay sides.
#[test]
fn the_warp_turns_back() {
    let bench = Bench::new();
    for (side, wild) in [(8, true), (16, false), (33, true), (64, false)] {
        let mut r = Random(5);
        let mut places: Vec<Vec2> = (0..4000).map(|_| Vec2::new(r.next(), r.next())).collect();
        for i in 0..=200 {
            let t = i as f32 / 200.0;
            places.extend([Vec2::new(t, 0.0), Vec2::new(t, 1.0), Vec2::new(0.0, t), Vec2::new(1.0, t)]);
        }
        let found = bench.solve(side, &sums(side, wild), &[], &places);
        let row = side + 1;
        for (u, p) in places.iter().zip(&found.probed) {
            let at = u.as_dvec2() * side as f64;
            let cell = at.floor().min(DVec2::splat(side as f64 - 1.0));
            let f = at - cell;
            let i = cell.y as usize * row + cell.x as usize;
            let n = [i, i + 1, i + row, i + row + 1].map(|i| found.nodes[i]);
            let exact = (n[0] * (1.0 - f.x) + n[1] * f.x) * (1.0 - f.y) + (n[2] * (1.0 - f.x) + n[3] * f.x) * f.y;
            let there = DVec2::new(p[0] as f64, p[1] as f64);
            let back = Vec2::new(p[2], p[3]);
            assert!(there.distance(exact) < 1e-6, "{side}: {u} to {there}, not {exact}");
            // A thousandth of a texel of a map of 1024².
            let texel = 1e-3 / 1024.0;
            let slope = DMat2::from_cols(DVec2::new(p[4] as f64, p[5] as f64), DVec2::new(p[6] as f64, p[7] as f64));
            let missed = slope * (back - *u).as_dvec2();
            assert!(missed.length() < texel, "{side}: {u} comes back to {back}, off by {missed} in the map");
            let x = ((n[1] - n[0]) * (1.0 - f.y) + (n[3] - n[2]) * f.y) * side as f64;
            let y = ((n[2] - n[0]) * (1.0 - f.x) + (n[3] - n[1]) * f.x) * side as f64;
            let off = (slope.x_axis - x).length() + (slope.y_axis - y).length();
            assert!(off < 1e-4 * side as f64 && slope.determinant() > 0.0, "{side}: slope {slope} at {u}");
            for axis in 0..2 {
                if u[axis] == 0.0 || u[axis] == 1.0 {
                    assert_eq!(there[axis], u[axis] as f64, "{side}: {u} leaves its side");
                }
            }
        }
    }
}

/// All pixels that face the light have a texel, and fewer are wrong than without a warp.
#[test]
fn grids_hold_all_receivers_and_pay() {
    for name in ["bench", "arches"] {
        let (mut r, mut s) = built_in(name, [160, 160]);
        let whole = errors(&mut r, &mut s, "shadow-map", &["resolution=256", "fit=scene"]).share();
        for technique in GRIDS {
            let e = errors(&mut r, &mut s, technique, &["resolution=256"]);
            assert!(e.share() < 0.95 * whole, "{name} {technique}: {} against {whole}", e.share());
            assert_eq!(counted(&mut r, &s), facing(&mut r), "{name} {technique}");
        }
    }
}

/// Moved corners alone miss long triangles' places; rays through texels do not.
#[test]
fn exact_beats_linear_on_long_triangles() {
    let (mut r, mut s) = built_in("st-longtri", [128, 128]);
    for technique in GRIDS {
        let linear = errors(&mut r, &mut s, technique, &["resolution=256", "raster=linear"]).share();
        let exact = errors(&mut r, &mut s, technique, &["resolution=256", "raster=exact"]).share();
        assert!(exact < 0.7 * linear, "{technique}: exact {exact}, linear {linear}");
        // A texel is metres wide here: the tolerance must be small for as few errors.
        let split = errors(&mut r, &mut s, technique, &["resolution=256", "tolerance=0.05"]).share();
        assert!(split < 1.2 * exact + 0.003, "{technique}: subdivide {split}, exact {exact}");
    }
}

/// On the drawn grid the energy variant shows no fold, the seed does.
#[test]
fn folds_are_shown() {
    let (mut r, mut s) = built_in("bench", [128, 128]);
    let mut folds = |technique: &str, sets: &[&str]| {
        select(&mut s, technique, sets);
        s.view = "nodes".into();
        r.render(&s, ask(&s)).unwrap();
        // Colour 1 on the plain ground.
        r.read_map().unwrap().iter().filter(|x| (17.0..18.0).contains(*x)).count()
    };
    assert_eq!(folds("dsm", &["resolution=256"]), 0);
    assert_eq!(folds("fem-grid", &["resolution=256"]), 0);
    for error in ["error=sum", "error=sqrt"] {
        let seed = folds("fem-grid", &["resolution=256", "variant=seed-stiffness", error]);
        assert!(seed > 50, "{error}: {seed} pixels of folded cells");
    }
}

/// The folds of a measured row are those of the grid's own Jacobian, on the CPU.
#[test]
fn folds_are_the_grids() {
    let (mut r, mut s) = built_in("bench", [96, 96]);
    for (variant, fold) in [("variant=energy", false), ("variant=seed-stiffness", true)] {
        select(&mut s, "fem-grid", &["resolution=256", "raster=exact", variant]);
        let row = measure::accuracy(&mut r, &s, 0).unwrap();
        let bytes = r.analysis().table(&r.gpu, "grid_nodes").unwrap().unwrap();
        let nodes: Vec<[f32; 2]> = bytemuck::pod_collect_to_vec(&bytes);
        let wide = (nodes.len() as f64).sqrt() as usize;
        assert_eq!(wide * wide, nodes.len());
        let node = |x: usize, y: usize| DVec2::from_array(nodes[y * wide + x].map(f64::from));
        let mut turned = 0u64;
        for (x, y) in (0..256).flat_map(|y| (0..256).map(move |x| (x, y))) {
            let u = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / 256.0 * (wide - 1) as f64;
            let (i, j, f) = (u.x as usize, u.y as usize, u.fract());
            let n = [node(i, j), node(i + 1, j), node(i, j + 1), node(i + 1, j + 1)];
            let along_x = (n[1] - n[0]).lerp(n[3] - n[2], f.y);
            let along_y = (n[2] - n[0]).lerp(n[3] - n[1], f.x);
            turned += (along_x.perp_dot(along_y) <= 0.0) as u64;
        }
        // Rounding may turn a place over whose Jacobian all but vanishes.
        let found = row.folds.unwrap();
        assert!(found.abs_diff(turned) <= turned / 200 && (found > 50) == fold, "{variant}: {found}, not {turned}");
        assert_eq!(row.triangles_folded, Some(0), "{variant}: exact raster moves no edge");
    }
}

/// An edge takes texels from where there is none: importance without edges leaves the grid regular.
#[test]
fn only_edges_move_the_grid() {
    let ground = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    let mut with_box = ground.clone();
    with_box.extend(floor(Vec2::splat(-1.0), Vec2::splat(1.0), 2.0));
    let view = camera(Vec3::new(0.0, 4.0, 9.0), Vec3::ZERO);
    for (triangles, moves) in [(ground, false), (with_box, true)] {
        let (mut r, mut s) = start(
            scene(vec![mesh(&triangles, 0)], vec![material(Vec3::ONE)], view, sun(Vec3::new(0.2, 1.0, 0.1))),
            [96, 96],
        );
        select(&mut s, "dsm", &["resolution=256", "grid=16"]);
        s.view = "edges".into();
        r.render(&s, ask(&s)).unwrap();
        let edges = r.read_map().unwrap().iter().filter(|x| (16.0..17.0).contains(*x)).count();
        s.view = "counts-before".into();
        r.render(&s, ask(&s)).unwrap();
        let before = r.read_map().unwrap();
        s.view = "counts".into();
        r.render(&s, ask(&s)).unwrap();
        let after = r.read_map().unwrap();
        assert_eq!((edges > 10, before != after), (moves, moves), "{edges} pixels of edges");
    }
}
