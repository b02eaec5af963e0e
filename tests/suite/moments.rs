//! Filters of moments against closed forms, the CPU, and the truth.

use crate::common::*;
use glam::{Vec2, Vec3};
use shadowscope::frame::Renderer;
use shadowscope::gpu::{Gpu, Pass, Recorder, Resource, Shaders, Timer};
use shadowscope::light::Light;
use shadowscope::measure::metrics::FACING;
use shadowscope::params::{Params, Value, Values};
use shadowscope::scene::Scene;
use shadowscope::setup::Setup;
use shadowscope::techniques::{self, FILTERS};

/// What probes are given, and what they find.
const PROBED: &str = "
var<storage, read> given: array<vec4f>;
var<storage, read> second: array<vec4f>;
var<storage, read_write> probed: array<vec4f>;
";

/// A device that has `probe.wgsl`, which binds `PROBED` and lies in the folder.
pub fn with_probe(text: &str) -> (Gpu, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("probe.wgsl"), format!("{text}{PROBED}")).unwrap();
    let mut gpu = strict(Gpu::new(None).unwrap());
    gpu.shaders = Shaders::from_folder(folder.path());
    (gpu, folder)
}

/// Runs an entry point `probe` that is written on top of shaders, a thread for each of `given`; four numbers for each.
pub fn probe(text: &str, technique: &str, values: &Values, given: &[[f32; 4]], second: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let (gpu, _folder) = with_probe(text);
    let groups = techniques::find(technique).unwrap().params;
    let pass = Pass::compute(&gpu, "probe", "probe.wgsl", "probe", groups).unwrap();
    let buffer = |bytes: &[u8]| gpu.buffer("given", bytes, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let out = buffer(&vec![0; given.len() * 16]);
    let mut timer = Timer::new(&gpu);
    let mut recorder = Recorder::new(&gpu, &mut timer, false, [1, 1]);
    let mut bound: Vec<(&'static str, Resource)> = vec![
        ("given", (&buffer(bytemuck::cast_slice(given))).into()),
        ("second", (&buffer(bytemuck::cast_slice(second))).into()),
        ("probed", (&out).into()),
    ];
    for group in groups {
        let words = group.words(values);
        let words = gpu.buffer(group.name, bytemuck::cast_slice(&words), wgpu::BufferUsages::UNIFORM);
        recorder.set(group.name, &words);
        bound.push((group.name, (&words).into()));
    }
    recorder.run(&pass).bind_all(&bound).dispatch((given.len() as u32).div_ceil(64), 1, 1);
    recorder.finish().unwrap();
    bytemuck::pod_collect_to_vec(&gpu.read_buffer(&out).unwrap())
}

const HAMBURGER: &str = "//!include map/filter/hamburger.wgsl

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&given) {
        let d = depths_of(given[id.x], second[id.x].x);
        probed[id.x] = vec4f(d.shadow, d.near, d.far, d.determinant);
    }
}
";

/// The first four moments of depths with their shares.
fn moments(depths: &[[f64; 2]], bias: f64) -> [f32; 4] {
    [1, 2, 3, 4].map(|n| {
        let m: f64 = depths.iter().map(|[z, share]| share * z.powi(n)).sum();
        (m + (0.5 - m) * bias) as f32
    })
}

/// Two depths come out exactly, and of any depths no more is called shadowed than is (Peters, Klein 2015, proposition 1).
#[test]
fn moments_bound_the_shadow_from_below() {
    let two = [[0.3, 0.25], [0.7, 0.75]];
    let mut sets = vec![(two.to_vec(), 0.2), (two.to_vec(), 0.5), (two.to_vec(), 0.9)];
    let mut random = Random(7);
    let mut next = || f64::from(random.next());
    for _ in 0..3000 {
        let count = 2 + (next() * 7.0) as usize;
        let mut depths: Vec<[f64; 2]> = (0..count).map(|_| [next(), 0.05 + next()]).collect();
        let sum: f64 = depths.iter().map(|d| d[1]).sum();
        depths.iter_mut().for_each(|d| d[1] /= sum);
        sets.push((depths, next()));
    }
    let given: Vec<[f32; 4]> =
        sets.iter().enumerate().map(|(i, (d, _))| moments(d, if i < 3 { 0.0 } else { 3e-6 })).collect();
    let receivers: Vec<[f32; 4]> = sets.iter().map(|(_, t)| [*t as f32; 4]).collect();
    let found = probe(HAMBURGER, "msm", &Values::new(), &given, &receivers);
    for ((shadow, wanted), (_, t)) in found.iter().map(|f| f[0]).zip([0.0, 0.25, 1.0]).zip(&sets) {
        assert!((shadow - wanted).abs() < 1e-3, "at {t}: {shadow}, not {wanted}");
    }
    let [mut most, mut mean] = [0.0_f64; 2];
    for (f, (depths, t)) in found.iter().zip(&sets).skip(3) {
        let before: f64 = depths.iter().filter(|d| d[0] < *t).map(|d| d[1]).sum();
        assert!(f[0].is_finite() && (0.0..=1.0).contains(&f[0]), "{f:?}");
        most = most.max(f64::from(f[0]) - before);
        mean += f64::from(f[0]) / before.max(1e-9) / 3000.0;
    }
    // What rounding adds; and it is no empty promise.
    assert!(most < 0.01 && mean > 0.4, "up to {most} too much, {mean} of the shadow on average");
}

const SERIES: &str = "//!include map/single.wgsl
//!include map/filter/csm_convolution.wgsl
//!include store/rgba32float.wgsl

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&given) {
        var v = 0.5;
        for (var k = 1u; k <= csm.terms; k++) {
            let m = moments(0.5 / share_used, 0.0, (k - 1u) / 2u);
            v += term(k, select(m.xy, m.zw, k % 2u == 0u), given[id.x].x);
        }
        probed[id.x] = vec4f(v + second[id.x].x);
    }
}
";

/// The step of the depth test is a ramp whose width follows from the number of terms, and undamped the series rings, by the 9 % of
/// Gibbs whatever their number (Annen et al. 2007, section 4).
#[test]
fn the_series_has_its_width_and_rings() {
    let places: Vec<[f32; 4]> = (0..=4000).map(|i| [0.25 + i as f32 / 8000.0; 4]).collect();
    let zero = vec![[0.0; 4]; places.len()];
    let curve = |terms: i64, damping: f64| {
        let values =
            [("terms", Value::Int(terms)), ("damping", Value::Float(damping))].map(|(k, v)| (k.to_string(), v));
        let found = probe(SERIES, "csm-convolution", &Values::from(values), &places, &zero);
        found.into_iter().map(|v| v[0]).collect::<Vec<f32>>()
    };
    for (terms, width) in [(4, 0.185), (8, 0.085), (16, 0.041)] {
        let damped = curve(terms, 1.0);
        let at = |level: f32| places[damped.iter().position(|v| *v < level).unwrap()][0];
        let found = at(0.1) - at(0.9);
        assert!((found / width - 1.0).abs() < 0.04, "{terms} terms: {found}, not {width}");
        assert!((at(0.5) - 0.5).abs() < 1e-3, "{terms} terms are half way at {}", at(0.5));
        let over = curve(terms, 0.0).into_iter().fold(0.0, f32::max) - 1.0;
        assert!((0.085..0.095).contains(&over), "{terms} terms ring by {over}");
        let damped_over = damped.into_iter().fold(0.0, f32::max) - 1.0;
        assert!(damped_over < 0.5 * over, "damped, {terms} terms still ring by {damped_over}");
    }
}

fn cuboid(low: Vec3, high: Vec3) -> Vec<[Vec3; 3]> {
    let p = |i: usize| Vec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { high[a] } else { low[a] }));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.iter().flat_map(|f| [[p(f[0]), p(f[1]), p(f[2])], [p(f[0]), p(f[2]), p(f[3])]]).collect()
}

/// Boxes over a floor, seen from the side.
fn over_a_floor(boxes: &[[Vec3; 2]], light: Light) -> Scene {
    let mut triangles = floor(Vec2::splat(-6.0), Vec2::splat(6.0), 0.0);
    triangles.extend(boxes.iter().flat_map(|[low, high]| cuboid(*low, *high)));
    let view = camera(Vec3::new(0.0, 7.0, 9.0), Vec3::new(0.0, 0.5, 0.0));
    scene(vec![mesh(&triangles, 0)], vec![material(Vec3::splat(0.8))], view, light)
}

/// A box that hovers over a floor.
fn hovering(light: Light) -> Scene {
    over_a_floor(&[[Vec3::new(-1.2, 1.5, -1.2), Vec3::new(1.2, 2.0, 1.2)]], light)
}

/// An exponential that is too large for its numbers is infinite at the map's far end: light and shadow are lost there.
#[test]
fn exponents_beyond_the_format_fail() {
    // Low boxes, far from the near plane that a high one sets.
    let boxes = [
        [Vec3::new(-1.5, 0.6, -1.5), Vec3::new(1.5, 0.9, 1.5)],
        [Vec3::new(4.0, 5.8, -5.0), Vec3::new(4.2, 6.0, -4.8)],
    ];
    let (mut r, mut s) = start(over_a_floor(&boxes, sun(Vec3::new(0.1, 1.0, 0.1))), [120, 90]);
    let mut wrong = |technique: &str, sets: &[&str]| {
        let e = errors(&mut r, &mut s, technique, &[&["resolution=512"], sets].concat());
        e.lit_incorrect + e.shadow_incorrect
    };
    for (technique, precision, good, bad) in
        [("esm", "precision=32", "exponent=80", "exponent=115"), ("esm", "precision=16", "exponent=10", "exponent=30")]
    {
        let [good, bad] = [good, bad].map(|e| wrong(technique, &[precision, "fall_back=false", e]));
        assert!(bad > 3 * good + 100, "{technique} {precision}: {good} pixels wrong, and {bad} beyond the format");
    }
}

/// Of the pixels that the truth, averaged, calls dark: how many a technique calls lit by more than a twentieth, and the light that
/// all of them get, in pixels.
pub fn leaks(setup: &Setup, r: &mut Renderer) -> (usize, f64) {
    r.render(setup, ask(setup)).unwrap();
    let (v, truth, mask) = (r.read_visibility().unwrap(), r.read_truth().unwrap(), r.read_mask().unwrap());
    let dark: Vec<f32> = (0..v.len()).filter(|i| mask[*i] == FACING && truth[*i] == 0.0).map(|i| v[i]).collect();
    assert!(dark.len() > 1000, "{} dark pixels", dark.len());
    (dark.iter().filter(|v| **v > 0.05).count(), dark.iter().map(|v| f64::from(*v)).sum())
}

/// Through two lattices the variance lets most light, its exponential kin less, four moments less again.
#[test]
fn light_leaks_by_the_number_of_moments() {
    let (mut r, mut s) = built_in("st-fence", [240, 150]);
    let found =
        [("vsm", "bleed_reduction=0"), ("esm", "exponent=60"), ("evsm", "bleed_reduction=0"), ("msm", "precision=32")]
            .map(|(technique, set)| {
                select(&mut s, technique, &[set, "resolution=2048", "blur_radius=2"]);
                leaks(&s, &mut r)
            });
    // The exponential alone lets less light through lattices than any: its leaks lie where shadows touch their casters.
    let [vsm, esm, evsm, msm] = found;
    println!("vsm {vsm:?}, esm {esm:?}, evsm {evsm:?}, msm {msm:?}");
    assert!(vsm.1 > 1.1 * evsm.1 && evsm.1 > 1.1 * msm.1 && vsm.1 > 1.1 * esm.1, "{found:?}");
    assert!(vsm.0 > evsm.0 && evsm.0 > msm.0 && vsm.0 > esm.0, "{found:?}");
}

/// Memory and passes follow the parameters.
#[test]
fn moments_take_what_they_say() {
    let (mut r, mut s) = start(hovering(sun(Vec3::new(0.3, 1.0, 0.2))), [64, 48]);
    let mut bytes = |technique: &str, sets: &[&str]| {
        select(&mut s, technique, &[&["resolution=256"], sets].concat());
        r.render(&s, ask(&s)).unwrap().gpu_bytes
    };
    let texels = 256 * 256;
    let none = bytes("shadow-map", &[]);
    // The moments, and one layer on its way; with all levels of detail a third more; and the light view of each layer.
    let levels = |n: u64| (0..=8).map(|i| (n >> i) * (n >> i)).sum::<u64>();
    let four = bytes("pssm", &["cascades=4", "filter=msm", "mipmaps=false"]) - bytes("pssm", &["cascades=4"]);
    for (taken, textures) in [
        (bytes("vsm", &["mipmaps=false"]) - none, 2 * 8 * texels),
        (bytes("evsm", &["mipmaps=true"]) - none, 16 * (levels(256) + texels)),
        (bytes("esm", &["mipmaps=false", "precision=16"]) - none, 2 * 2 * texels),
        (bytes("vsm", &["mipmaps=false", "precision=16"]) - none, 2 * 4 * texels),
        (bytes("csm-convolution", &["mipmaps=false", "terms=5"]) - none, (3 + 1) * 16 * texels),
        (four, (4 + 1) * 16 * texels),
    ] {
        assert!((textures..textures + 8192).contains(&taken), "{taken}, textures {textures}");
    }
}

/// Each filter's parameters mean something exactly where it is chosen.
#[test]
fn parameters_come_with_their_filter() {
    let info = techniques::find("lispsm").unwrap();
    for filter in FILTERS {
        let mut values = Values::new();
        values.insert("filter".into(), Value::Text(filter.id.into()));
        // Noise needs taps in a disk.
        values.insert("mode".into(), Value::Text("disk".into()));
        let own = techniques::ALL.iter().find(|i| i.filter.is_some_and(|f| f.id == filter.id)).unwrap();
        for group in techniques::FILTERING.iter().filter(|g| g.name != techniques::FilterParams::GROUP.name) {
            let belongs = own.params.iter().any(|g| g.name == group.name);
            let applies = info.applies(&group.specs[0], &values);
            assert_eq!(belongs, applies, "{} of {}", group.name, filter.id);
        }
        assert!(info.filter(&values).is_some_and(|f| f.id == filter.id));
        // These straighten or keep a shadow's edge; the others blur it.
        assert_eq!(info.filters(&values), !["nearest", "rbsm"].contains(&filter.id));
    }
}

/// Filters of moments compare with one depth, and the view of the bias says so: where texels' own rays move a comparison by the
/// receiver's slope, theirs is moved by what rounding asks for.
#[test]
fn the_view_shows_the_bias_that_moments_take() {
    let (mut r, mut s) = start(over_a_floor(&[], sun(Vec3::new(0.9, 0.6, 0.2))), [64, 48]);
    s.view = "bias".into();
    let mut most = |technique: &str| {
        select(&mut s, technique, &["bias_kind=ray-plane", "resolution=128"]);
        r.render(&s, ask(&s)).unwrap();
        r.read_map().unwrap().into_iter().fold(0.0, f32::max)
    };
    assert!(most("shadow-map") > 0.3);
    for technique in ["vsm", "esm", "evsm", "csm-convolution", "msm"] {
        let most = most(technique);
        assert!(most > 0.001 && most < 0.05, "{technique}: {most} texels");
    }
}
