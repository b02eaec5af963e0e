//! Which casters a cascade draws: all that a texel's centre needs, and hardly another.

use crate::common::*;
use glam::{DMat3, DVec2, DVec3, DVec4, Vec2, Vec3, Vec4};
use shadowscope::gpu::{Pass, Raster, Recorder, Table, Timer};
use shadowscope::light::LightView;
use shadowscope::map::cascades::Fitting;
use shadowscope::scene::geometry::Vertex;
use wgpu::BufferUsages as Use;

const SIDE: u32 = 256;

/// Where a world position lies in the map: texels and w.
fn place(v: &LightView, p: Vec3) -> (DVec2, f64) {
    let dot = |row: Vec4| row.as_dvec4().dot(p.as_dvec3().extend(1.0));
    let w = dot(v.row_w);
    (DVec2::new(1.0 + dot(v.row_x) / w, 1.0 - dot(v.row_y) / w) * 0.5 * v.resolution as f64, w)
}

/// The world position at a place in the map and a linear depth.
fn unproject(v: &LightView, texel: DVec2, z: f64) -> Vec3 {
    let w = if v.perspective == 1 { z } else { 1.0 };
    let ndc = (texel / (0.5 * v.resolution as f64) - 1.0) * DVec2::new(1.0, -1.0) * w;
    let [x, y, axis]: [DVec4; 3] = [v.row_x, v.row_y, v.axis].map(|row| row.as_dvec4());
    let rows = DMat3::from_cols(x.truncate(), y.truncate(), axis.truncate()).transpose();
    (rows.inverse() * (DVec3::new(ndc.x, ndc.y, z) - DVec3::new(x.w, y.w, axis.w))).as_vec3()
}

/// Whether a triangle holds a texel's centre of the map, by some margin in texels.
fn covers(t: [DVec2; 3], margin: f64) -> bool {
    let low = t[0].min(t[1]).min(t[2]);
    let high = t[0].max(t[1]).max(t[2]);
    let turn = (t[1] - t[0]).perp_dot(t[2] - t[0]).signum();
    let inside = |c: DVec2| {
        (0..3).all(|i| {
            let edge = t[(i + 1) % 3] - t[i];
            turn * edge.perp_dot(c - t[i]) >= margin * edge.length()
        })
    };
    let cells = |a: f64, b: f64| (a.floor() as i32).max(0)..=(b.floor() as i32).min(SIDE as i32 - 1);
    cells(low.y, high.y).any(|y| cells(low.x, high.x).any(|x| inside(DVec2::new(x as f64, y as f64) + 0.5)))
}

/// Triangles of every awkward kind: smaller than a texel, slivers, with corners on centres, flat ones, large ones, beyond the
/// map's borders, and under a lamp behind it.
fn awkward(v: &LightView, random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let triangle = |i: usize| {
        let mut at = |low: f64, high: f64| low + random.next() as f64 * (high - low);
        let reach = SIDE as f64;
        let mut from = DVec2::new(at(-8.0, reach + 8.0), at(-8.0, reach + 8.0));
        let mut point = |r: f64| DVec2::new(at(-r, r), at(-r, r));
        let mut steps = match i % 6 {
            0 => [point(0.3), point(0.3)],
            1 => [point(1.0), point(1.0)],
            2 => {
                let long = point(80.0);
                [long, long * 0.6 + point(0.2)]
            }
            3 => [point(1.5), point(1.5)],
            4 => {
                let long = point(20.0);
                [long, long * 1.5]
            }
            _ => [point(60.0), point(60.0)],
        };
        if i % 6 == 3 {
            from = from.floor() + 0.5;
            steps[0] = steps[0].round();
        }
        let mut depth = || (v.near + (v.far - v.near) * random.next()) as f64;
        let deep = [depth(), depth(), depth()];
        let behind = v.perspective == 1 && i % 30 == 5;
        [
            unproject(v, from, deep[0]),
            unproject(v, from + steps[0], deep[1]),
            unproject(v, from + steps[1], if behind { -deep[2] } else { deep[2] }),
        ]
    };
    (0..count).map(triangle).collect()
}

#[test]
fn casters_that_cover_no_texel_are_left_out_and_no_others() {
    let gpu = gpu();
    let mut timer = Timer::new(&gpu);
    let bounds = |center: Vec3| [center - 10.0, center + 10.0];
    let far = Vec3::new(3000.0, 20.0, -2000.0);
    let lamp = spot(Vec3::new(2.0, 12.0, 1.0), Vec3::ZERO, 35.0);
    let view = |light, center| LightView::whole(&light, bounds(center), SIDE, 0.0).unwrap();
    let slanted = sun(Vec3::new(0.4, 0.8, 0.3).normalize());
    let mut random = Random(3);
    let unclipped_depth = gpu.abilities.features.contains(wgpu::Features::DEPTH_CLIP_CONTROL);
    let raster = Raster {
        vertex: if unclipped_depth { "caster" } else { "clamped_caster" },
        unclipped_depth,
        depth: Raster::nearest(wgpu::TextureFormat::Depth32Float),
        vertices: Some(Vertex::LAYOUT),
        ..Raster::default()
    };
    let casters = Pass::render(&gpu, "casters", "map/casters.wgsl", raster, &[]).unwrap();
    let cull = Pass::compute(&gpu, "culling", "map/cascades.wgsl", "cull", &[]).unwrap();
    for (name, v) in [("sun", view(slanted, Vec3::ZERO)), ("far", view(slanted, far)), ("spot", view(lamp, Vec3::ZERO))]
    {
        let triangles = awkward(&v, &mut random, 12_000);
        let count = triangles.len() as u32;
        let corner = |p: &Vec3| Vertex { position: *p, normal: 0, uv: Vec2::ZERO, material: 0, color: 0 };
        let corners: Vec<Vertex> = triangles.iter().flatten().map(corner).collect();
        let fitting = Fitting { count: 1, opaque: count, triangles: count, culled: 1, ..bytemuck::Zeroable::zeroed() };
        let all: Vec<u32> = (0..3 * count).collect();
        let buffer = |bytes: &[u8], usage| gpu.buffer("casters", bytes, usage);
        let vertices = buffer(bytemuck::cast_slice(&corners), Use::VERTEX);
        let records = Table::new(&gpu, "vertices by number", bytemuck::cast_slice(&corners));
        let indices = buffer(bytemuck::cast_slice(&all), Use::INDEX | Use::STORAGE);
        let kept = buffer(&vec![0; 12 * count as usize], Use::INDEX | Use::STORAGE | Use::COPY_SRC);
        let draws =
            buffer(bytemuck::cast_slice(&[0u32, 1, 0, 0, 0, 0, 1, 3 * count, 0, 0]), Use::STORAGE | Use::COPY_SRC);
        let mut views = bytemuck::bytes_of(&v).to_vec();
        views.resize(8 * size_of::<LightView>(), 0);
        let mut recorder = Recorder::new(&gpu, &mut timer, false, [1, 1]);
        recorder
            .run(&cull)
            .bind("vertices", records.view())
            .bind("corners_of", &indices)
            .bind("fitting", &buffer(bytemuck::bytes_of(&fitting), Use::UNIFORM))
            .bind("light_views", &buffer(&views, Use::UNIFORM))
            .bind("draws", &draws)
            .bind("indices", &kept)
            .dispatch(count.div_ceil(64), 1, 1);
        recorder.finish().unwrap();
        let drawn: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_range(&draws, 0, 4).unwrap());
        let mut map = |indices: &wgpu::Buffer, number: u32| -> Vec<u32> {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Depth32Float,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let depth = texture.create_view(&Default::default());
            let mut recorder = Recorder::new(&gpu, &mut timer, false, [1, 1]);
            let light_view = buffer(bytemuck::bytes_of(&v), Use::UNIFORM);
            recorder.run(&casters).bind("light_view", &light_view).draw(&[], Some((&depth, 0.0)), true, |pass| {
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..number, 0, 0..1);
            });
            recorder.finish().unwrap();
            bytemuck::pod_collect_to_vec(&gpu.read_texture(&texture).unwrap())
        };
        let (whole, part) = (map(&indices, 3 * count), map(&kept, drawn[0]));
        gpu.check().unwrap();
        assert!(whole.iter().filter(|d| **d > 0).count() > (SIDE * SIDE / 2) as usize, "{name}: the map is empty");
        assert!(whole == part, "{name}: a caster is missing");
        let names: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_range(&kept, 0, drawn[0] as u64 * 4).unwrap());
        let mut stays = vec![false; triangles.len()];
        names.iter().for_each(|i| stays[*i as usize / 3] = true);
        let [mut empty, mut left_out] = [0, 0];
        for (t, stays) in triangles.iter().zip(stays) {
            let places = t.map(|p| place(&v, p));
            if places.iter().any(|(_, w)| *w <= 0.0) {
                continue;
            }
            let t = places.map(|(texel, _)| texel);
            assert!(stays || !covers(t, 0.0), "{name}: {t:?} is left out");
            if !covers(t, -0.15) {
                empty += 1;
                left_out += !stays as usize;
            }
        }
        assert!(empty > 2000 && left_out as f64 > 0.9 * empty as f64, "{name}: {left_out} of {empty} are left out");
    }
}
