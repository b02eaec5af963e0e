//! Two drivers beside one another: what differs between them is rounding.

use crate::common::*;
use crate::laws::in_turn;
use glam::Vec3;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::gpu::{self, Gpu};
use shadowscope::measure::metrics::FACING;
use shadowscope::setup::Setup;
use shadowscope::techniques::{self, Info};
use std::sync::Arc;

/// What an adapter makes of a set-up: the classes of its pixels, where they lie, their visibility and the picture.
struct Seen {
    mask: Vec<u32>,
    position: Vec<[f32; 4]>,
    visibility: Vec<f32>,
    picture: Vec<u8>,
}

/// Every technique on the first two adapters that the system has, one row each: the shares of pixels that differ, and by how much.
/// It needs two, which VK_DRIVER_FILES can name, and so runs when asked for.
#[test]
#[ignore = "needs two graphics drivers"]
fn adapters_agree() {
    let names: Vec<String> = gpu::adapters(&gpu::instance()).iter().map(|a| a.get_info().name).collect();
    assert!(names.len() >= 2, "two adapters are compared, and there is {names:?}; name two drivers in VK_DRIVER_FILES");
    let plate = plate(Vec3::new(-0.5, 3.0, 2.0), Vec3::ZERO, 0.1);
    let lights = [sun(Vec3::new(0.8, 0.6, 0.3)), lamp(Vec3::new(-0.5, 3.0, 2.0)), plate];
    let view = camera(Vec3::new(2.0, 3.0, 4.0), Vec3::ZERO);
    let yard = Arc::new(scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], view, lights[0]));
    let setups: Vec<(&Info, Setup)> = techniques::ALL
        .iter()
        .map(|&info| {
            let mut s = Setup::new("test", &yard).unwrap();
            s.size = [128, 96];
            s.light = in_turn(info, &lights).expect("a light for each technique");
            choose(&mut s, info, 256, &[]);
            (info, s)
        })
        .collect();
    // Both draw at once.
    let draw = |name: &str| -> Vec<Seen> {
        let mut r = Renderer::new(Arc::new(strict(Gpu::new(Some(name)).unwrap())), yard.clone()).unwrap();
        let draw = |(info, s): &(&Info, Setup)| {
            r.render(s, Ask { fresh: true, ..ask(s) }).unwrap_or_else(|e| panic!("{}: {e:#}", info.id));
            Seen {
                mask: r.read_mask().unwrap(),
                position: r.read_position().unwrap(),
                visibility: r.read_visibility().unwrap(),
                picture: r.read_picture().unwrap(),
            }
        };
        setups.iter().map(draw).collect()
    };
    let [first, second] = std::thread::scope(|scope| {
        [&names[0], &names[1]].map(|name| scope.spawn(|| draw(name))).map(|drawing| drawing.join().unwrap())
    });
    println!(
        "Left out of the shadow's columns: pixels that show another surface on {} than on {}.\n",
        names[0], names[1]
    );
    println!(
        "| technique | light | other surface, % | shadow differs, % | mean difference | greatest | picture differs, % |"
    );
    println!("|---|---|---|---|---|---|---|");
    for ((info, s), (a, b)) in setups.iter().zip(first.iter().zip(&second)) {
        let ([mut other, mut facing, mut differ], mut sum, mut greatest) = ([0_usize; 3], 0.0, 0.0_f32);
        for i in 0..a.mask.len() {
            let [p, q] = [&a, &b].map(|x| Vec3::from_slice(&x.position[i]));
            if a.mask[i] != b.mask[i] || (a.mask[i] == FACING && p.distance(q) > 1e-3) {
                other += 1;
            } else if a.mask[i] == FACING {
                let d = (a.visibility[i] - b.visibility[i]).abs();
                facing += 1;
                differ += usize::from(d > 1.0 / 255.0);
                sum += f64::from(d);
                greatest = greatest.max(d);
            }
        }
        let pixels = a.mask.len();
        let pictures = a.picture.chunks(4).zip(b.picture.chunks(4)).filter(|(p, q)| p != q).count();
        let percent = |n: usize, of: usize| 100.0 * n as f64 / of as f64;
        let mean = sum / facing as f64;
        println!(
            "| `{}` | {} | {:.3} | {:.3} | {mean:.6} | {greatest:.4} | {:.3} |",
            info.id,
            s.light.kind(),
            percent(other, pixels),
            percent(differ, facing),
            percent(pictures, pixels),
        );
        assert!(percent(other, pixels) < 0.2, "{}: the G-buffers differ", info.id);
        assert!(facing > 3000 && mean < 0.005, "{}: shadows differ by {mean} on average", info.id);
    }
}
