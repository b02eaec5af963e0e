// Imperfect shadow maps: scene points splatted into small paraboloid maps, whose holes are filled by pull and push.

// Points of the scene, rows of 512: position, and 1, or 0 where a masked surface has a hole.
var points: texture_2d<f32>;
var points_out: texture_storage_2d<rgba32float, write>;
// Of each its triangle, and its place in it: the weights of the second and third corner, 2 × 16 bits.
var<storage, read> places: array<vec2u>;
// One over the distance of the nearest point in each texel, tile by tile; bits, 0 where there is none.
var<storage, read_write> splats: array<atomic<u32>>;
var<storage, read> splatted: array<u32>;
// All tiles in rows: metres from the VPL, 0 in holes. What is read and written are levels of one texture, each half as wide as
// the one before.
var tiles: texture_2d<f32>;
var finer: texture_2d<f32>;
var tiles_out: texture_storage_2d<r32float, write>;
var coarser: texture_2d<f32>;
var filled: texture_storage_2d<r32float, read_write>;

// Tiles in a row, as in Rust; a root that is whole may come out a little too large.
fn tile_columns() -> u32 {
    return u32(ceil(sqrt(f32(vpl.vpls)) - 0.001));
}

@compute @workgroup_size(64)
fn place_points(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&places) {
        return;
    }
    let place = places[id.x];
    let index = triangles[place.x];
    let w = unpack2x16unorm(place.y);
    let a = vertices[index.x];
    let b = vertices[index.y];
    let c = vertices[index.z];
    let position = a.position + w.x * (b.position - a.position) + w.y * (c.position - a.position);
    let uv = a.uv + w.x * (b.uv - a.uv) + w.y * (c.uv - a.uv);
    let there = select(1.0, 0.0, masked_out(materials[a.material], uv));
    textureStore(points_out, vec2u(id.x & 511u, id.x >> 9u), vec4f(position, there));
}

// Where a direction from a VPL lies in its tile, texels (Brabec, Annen, Seidel 2002). `there`: from the VPL, `far` metres long.
fn tile_place(there: vec3f, far: f32, normal: vec3f) -> vec2f {
    let axes = tangents(normal);
    let at = vec2f(dot(there, axes[0]), dot(there, axes[1])) / (far + dot(there, normal));
    return clamp((0.5 + 0.5 * at) * f32(vpl.tile), vec2f(0.0), vec2f(f32(vpl.tile) - 0.01));
}

// A thread for each point of each VPL. The points lie in random order: each VPL takes another run of them.
@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= vpl.points {
        return;
    }
    let light = vpls.all[id.y];
    let count = 512u * textureDimensions(points).y;
    let i = (id.x + hash(id.y ^ hash(frame.seed ^ 4u))) & (count - 1u);
    let point = textureLoad(points, vec2u(i & 511u, i >> 9u), 0);
    let there = point.xyz - light.position;
    let far = length(there);
    // What lies in the VPL's own plane shadows nothing.
    if point.w == 0.0 || dot(there, light.normal) <= 0.02 * far {
        return;
    }
    let texel = vec2u(tile_place(there, far, light.normal));
    atomicMax(&splats[(id.y * vpl.tile + texel.y) * vpl.tile + texel.x], bitcast<u32>(1.0 / far));
}

// The distance in a texel of a tile as splatted.
fn as_splatted(tile: u32, texel: vec2u) -> f32 {
    let near = bitcast<f32>(splatted[(tile * vpl.tile + texel.y) * vpl.tile + texel.x]);
    return select(0.0, 1.0 / near, near > 0.0);
}

@compute @workgroup_size(8, 8)
fn unpack(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(tiles_out);
    if any(id.xy >= size) {
        return;
    }
    let tile = id.xy / vpl.tile;
    let number = tile.y * tile_columns() + tile.x;
    var far = 0.0;
    if number < vpl.vpls {
        far = as_splatted(number, id.xy % vpl.tile);
    }
    textureStore(tiles_out, id.xy, vec4f(far));
}

// By how much distances may differ, as a share of the nearer, and still be of one surface.
fn tolerance(side: u32) -> f32 {
    return vpl.tolerance * f32(vpl.tile / side);
}

// The mean of four distances but for holes and for what lies farther behind the nearest than the tolerance. Of one over the
// distance: along a plane it changes evenly with the direction.
fn mean_of_nearest(far: vec4f, weights: vec4f, tolerance: f32) -> f32 {
    let known = far > vec4f(0.0);
    let all = select(vec4f(3.4e38), far, known);
    let nearest = min(min(all.x, all.y), min(all.z, all.w));
    let kept = select(vec4f(0.0), weights, known & (all <= vec4f(nearest * (1.0 + tolerance))));
    return select(0.0, dot(kept, vec4f(1.0)) / max(dot(kept, 1.0 / all), 1e-30), any(known));
}

// A level from the finer one (Marroquim et al. 2007): four texels become one.
@compute @workgroup_size(8, 8)
fn pull(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(tiles_out);
    if any(id.xy >= size) {
        return;
    }
    let at = 2u * id.xy;
    let far = vec4f(textureLoad(finer, at, 0).x, textureLoad(finer, at + vec2u(1u, 0u), 0).x,
                    textureLoad(finer, at + vec2u(0u, 1u), 0).x, textureLoad(finer, at + 1u, 0).x);
    textureStore(tiles_out, id.xy, vec4f(mean_of_nearest(far, vec4f(1.0), tolerance(2u * size.x / tile_columns()))));
}

// Fills a level's holes from the coarser one, and replaces outliers: what lies farther behind the surface there than the
// tolerance was seen between that surface's points.
@compute @workgroup_size(8, 8)
fn push(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(filled);
    if any(id.xy >= size) {
        return;
    }
    let own = textureLoad(filled, id.xy).x;
    let side = size.x / tile_columns();
    // The four nearest texels of the coarser level, in the same tile.
    let first = id.xy / side * (side / 2u);
    let last = first + side / 2u - 1u;
    let here = id.xy / 2u;
    let beside = vec2u(clamp(vec2i(here) + select(vec2i(-1), vec2i(1), (id.xy & vec2u(1u)) == vec2u(1u)), vec2i(first), vec2i(last)));
    let far = vec4f(textureLoad(coarser, here, 0).x, textureLoad(coarser, vec2u(beside.x, here.y), 0).x,
                    textureLoad(coarser, vec2u(here.x, beside.y), 0).x, textureLoad(coarser, beside, 0).x);
    let weights = vec4f(9.0, 3.0, 3.0, 1.0);
    let expected = mean_of_nearest(far, weights, 100.0);
    if own == 0.0 || own > expected * (1.0 + tolerance(side)) && expected > 0.0 {
        textureStore(filled, id.xy, vec4f(expected));
    }
}

// Whether a surface sees a VPL, by its tile. A hole hides nothing.
fn seen_in_tile(s: Surface, position: vec3f, normal: vec3f, i: u32) -> bool {
    let there = s.position - position;
    let far = length(there);
    let at = tile_place(there, far, normal);
    let columns = tile_columns();
    let stored = textureLoad(tiles, vec2u(at) + vpl.tile * vec2u(i % columns, i / columns), 0).x;
    // How far the receiver's plane falls back over a texel, as a share of the distance.
    let cosine = abs(dot(s.normal, there)) / far;
    let off = 2.0 * at / f32(vpl.tile) - 1.0;
    let texel = 4.0 / (f32(vpl.tile) * (1.0 + dot(off, off)));
    let slope = min(sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1e-3), 1000.0) * texel;
    return stored == 0.0 || far <= stored * (1.0 + vpl.vpl_bias + slope);
}

// A texel of a tile: near bright, far dark; holes red, beside the disc nothing. As splatted, or filled.
fn tile_texel(tile: u32, texel: vec2u, after: bool) -> f32 {
    let off = (2.0 * vec2f(texel) + 1.0) / f32(vpl.tile) - 1.0;
    if dot(off, off) > 1.0 || tile >= vpl.vpls {
        return drawn(white, 0.0);
    }
    var far = 0.0;
    if after {
        let columns = tile_columns();
        far = textureLoad(tiles, texel + vpl.tile * vec2u(tile % columns, tile / columns), 0).x;
    } else {
        far = as_splatted(tile, texel);
    }
    if far == 0.0 {
        return drawn(0u, 0.75);
    }
    // A third of the scene's diagonal is grey.
    let reach = 0.3333 * distance(frame.bounds_min, frame.bounds_max);
    return drawn(white, 0.05 + 0.95 * reach / (reach + 2.0 * far));
}

// All tiles, fitted into the picture.
fn all_tiles(pixel: vec2u, after: bool) -> f32 {
    let whole = vec2f(textureDimensions(tiles));
    let size = vec2f(frame.size);
    let scale = max(whole.x / size.x, whole.y / size.y);
    let at = (vec2f(pixel) + 0.5 - 0.5 * size) * scale + 0.5 * whole;
    if any(at < vec2f(0.0)) || any(at >= whole) {
        return drawn(white, 0.0);
    }
    let tile = vec2u(at) / vpl.tile;
    return tile_texel(tile.y * tile_columns() + tile.x, vec2u(at) % vpl.tile, after);
}

// One tile, left as splatted, right filled.
fn one_tile(pixel: vec2u, tile: u32) -> f32 {
    let at = square_place(vec2f(pixel) + 0.5);
    let after = at.x >= 1.0;
    let place = at - vec2f(select(0.0, 1.0, after), 0.0);
    if any(place < vec2f(0.0)) || any(place >= vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    return tile_texel(tile, vec2u(place * f32(vpl.tile)), after);
}
