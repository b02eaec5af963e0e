//! Shadow volumes.

use crate::common::*;
use shadowscope::frame::Ask;
use shadowscope::setup;

#[test]
#[ignore]
fn survey() {
    let scenes =
        std::env::var("SCENES").unwrap_or("bench blocks arches hall observatory pavilion cubes terrain".into());
    let size: usize = std::env::var("SIDE").ok().and_then(|s| s.parse().ok()).unwrap_or(480);
    let sets = std::env::var("SETS").unwrap_or("shadow-volume;shadow-volume-tri".into());
    for name in scenes.split(' ') {
        let (mut r, mut s) = built_in(name, [size as u32, size as u32 * 3 / 4]);
        let lights = r.scene().lights.clone();
        let cameras = r.scene().cameras.clone();
        let cameras = if std::env::var("CAMERAS").is_ok() { &cameras[..] } else { &cameras[..1] };
        for camera in cameras {
            for light in &lights {
                if light.light.kind() == "rect-area" {
                    continue;
                }
                s.camera = camera.camera;
                s.light = setup::scene_light(r.scene(), &light.name).unwrap();
                select(&mut s, "rt-hard", &[]);
                r.render(&s, ask(&s)).unwrap();
                let truth = r.read_visibility().unwrap();
                let n = facing(&mut r);
                let mut first: Option<Vec<f32>> = None;
                for set in sets.split(';') {
                    let mut words = set.split(' ');
                    let technique = words.next().unwrap();
                    let params: Vec<&str> = words.collect();
                    select(&mut s, technique, &params);
                    r.render(&s, Ask { picture: false, ..ask(&s) }).unwrap();
                    let own = r.read_visibility().unwrap();
                    let wrong: Vec<usize> = (0..own.len()).filter(|i| own[*i] != truth[*i]).collect();
                    let dark = wrong.iter().filter(|i| own[**i] == 0.0).count();
                    let apart = first.as_ref().map(|f| (0..own.len()).filter(|i| f[*i] != own[*i]).count());
                    let h = own.len() / size;
                    let alone = |i: &&usize| {
                        let (x, y) = (**i % size, **i / size);
                        (y.max(1) - 1..(y + 2).min(h))
                            .all(|v| (x.max(1) - 1..(x + 2).min(size)).all(|u| truth[v * size + u] == truth[**i]))
                    };
                    let specks: Vec<_> = wrong.iter().filter(alone).collect();
                    let specks_at: Vec<_> = specks.iter().take(4).map(|i| (*i % size, *i / size)).collect();
                    let at: Vec<_> = wrong.iter().take(5).map(|i| (i % size, i / size)).collect();
                    let at = format!("{at:?} specks {} {specks_at:?}", specks.len());
                    println!(
                        "{name} {} {} [{set}]: {} wrong ({dark} dark) of {n} = {:.4} %, apart {apart:?} {at:?}",
                        camera.name,
                        light.name,
                        wrong.len(),
                        wrong.len() as f64 / n as f64 * 100.0
                    );
                    first.get_or_insert(own);
                }
            }
        }
    }
}
