//! Shadow rays per second: those of one picture, on the adapter and by the crate obvhs on the CPU's threads.
//!
//! ```sh
//! cargo run --release --example rays -- bench trees-side
//! cargo run --release --example rays -- bench trees-side rays.bin
//! ```
//!
//! The third word is a file for other tracers, as `embree.cpp` beside this one: the number of triangles and of rays as 32-bit whole numbers, the triangles' corners as nine
//! 32-bit floats each, then of each ray the origin, the direction and the distance up to which it runs, seven floats; all little-endian.

use anyhow::{Context, Result, bail};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::Ray;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use shadowscope::frame::{Ask, Renderer};
use shadowscope::gpu::Gpu;
use shadowscope::light::Light;
use shadowscope::measure::{metrics, timing};
use shadowscope::scene::geometry::Geometry;
use shadowscope::setup::{self, Setup};
use std::sync::Arc;
use std::time::Instant;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, camera, ..] = words.as_slice() else {
        bail!("write the scene and its camera: rays bench trees-side [FILE]");
    };
    let (mut setup, scene) = Setup::open(name)?;
    setup.camera = setup::parse_camera(&scene, camera, setup.clock())?;
    setup.size = [1024, 1024];
    setup.select("rt-hard")?;
    let geometry = Geometry::new(&scene, 0, 0.0)?;
    let triangles: Vec<[Vec3; 3]> = (0..geometry.triangles.len()).map(|i| geometry.corners(i)).collect();

    let start = Instant::now();
    let mut renderer = Renderer::new(Arc::new(Gpu::new(None)?), Arc::new(scene))?;
    println!("{}: {} triangles, on the device after {:.2} s", name, triangles.len(), start.elapsed().as_secs_f64());
    renderer.render(&setup, Ask::of(&setup))?;
    let (mask, position) = (renderer.read_mask()?, renderer.read_position()?);
    let facing = mask.iter().zip(&position).filter(|(m, _)| **m == metrics::FACING);
    let rays: Vec<Ray> = facing
        .map(|(_, p)| {
            let from = Vec3::new(p[0], p[1], p[2]);
            let (direction, far) = match setup.light {
                Light::Directional { to_light, .. } => (to_light.normalize(), f32::MAX),
                Light::Spot { position, .. } | Light::Omni { position, .. } => {
                    ((position - from).normalize(), position.distance(from))
                }
                _ => bail!("a ray a pixel goes to a sun, a spot or an omni light"),
            };
            Ok(Ray::new(Vec3A::from(from), Vec3A::from(direction), 1e-3, far))
        })
        .collect::<Result<_>>()?;
    let rate = |seconds: f64| {
        format!("{:8.1} ms, {:6.2} million rays a second", seconds * 1e3, rays.len() as f64 / seconds / 1e6)
    };

    let times = timing::time(&mut renderer, std::slice::from_ref(&setup), &mut |_| true)?;
    let pass = times[0].passes.iter().find(|(name, _)| name == "shadow rays").context("rt-hard has no pass of rays")?;
    println!("{} rays", rays.len());
    let visibility = renderer.read_visibility()?;
    let lit = mask.iter().zip(&visibility).filter(|(m, v)| **m == metrics::FACING && **v >= 0.5).count();
    println!("{:28} {}, {lit} lit", renderer.gpu.info.name, rate(pass.1.median * 1e-3));

    let flat: Vec<Triangle> =
        triangles.iter().map(|t| Triangle { v0: t[0].into(), v1: t[1].into(), v2: t[2].into() }).collect();
    let start = Instant::now();
    let bvh = build_bvh2_from_tris(&flat, BvhBuildParams::medium_build(), &mut Default::default());
    println!("obvhs: BVH in {:.3} s", start.elapsed().as_secs_f64());
    let ordered: Vec<Triangle> = bvh.primitive_indices.iter().map(|i| flat[*i as usize]).collect();
    let trace = |ray: &Ray| bvh.ray_traverse_miss(*ray, |ray, i| ordered[i].intersect(ray));
    for threads in [1, rayon::current_num_threads()] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let mut lit = 0;
        let mut seconds: Vec<f64> = (0..7)
            .map(|_| {
                let start = Instant::now();
                lit = pool.install(|| rays.par_iter().with_min_len(1024).filter(|ray| trace(ray)).count());
                start.elapsed().as_secs_f64()
            })
            .collect();
        seconds.sort_by(f64::total_cmp);
        println!("{:28} {}, {lit} lit", format!("obvhs, {threads} threads"), rate(seconds[3]));
    }
    if let Some(file) = words.get(2) {
        let mut bytes: Vec<u8> =
            [triangles.len() as u32, rays.len() as u32].iter().flat_map(|n| n.to_le_bytes()).collect();
        let floats = triangles.iter().flatten().flat_map(|v| v.to_array());
        let of_ray = |r: &Ray| {
            r.origin.to_array().into_iter().chain(r.direction.to_array()).chain([r.tmax]).collect::<Vec<f32>>()
        };
        bytes.extend(floats.chain(rays.iter().flat_map(of_ray)).flat_map(f32::to_le_bytes));
        std::fs::write(file, bytes).with_context(|| format!("writing {file}"))?;
    }
    Ok(())
}
