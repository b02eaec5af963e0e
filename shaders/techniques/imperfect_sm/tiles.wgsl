// Imperfect shadow maps: scene points splatted into small paraboloid maps, whose holes are filled by pull and push.

// Points of the scene, rows of 512: position and normal (as `packed_normal`), or 0 where a masked surface has a hole.
var points: texture_2d<f32>;
var points_out: texture_storage_2d<rgba32float, write>;
// Of each its triangle, and its place in it: the weights of the second and third corner, 2 × 16 bits.
var<storage, read> places: array<vec2u>;
// One over the distance of the nearest point in each texel, with its slope (`with_cosine`), tile by tile; bits, 0 where there
// is none.
var<storage, read_write> splats: array<atomic<u32>>;
var<storage, read> splatted: array<u32>;
// All tiles in rows: metres from the VPL, with the surface's slope (`with_cosine`), 0 in holes. What is read and written are levels of one texture, each half as wide as
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

// A number with the cosine between a surface and the ray to the VPL in its last eight bits: of the 24 bits of precision it
// keeps 16.
fn with_cosine(x: f32, cosine: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & 0xffffff00u) | u32(255.0 * saturate(cosine)));
}

fn cosines_of(x: vec4f) -> vec4f {
    return vec4f(bitcast<vec4u>(x) & vec4u(255u)) / 255.0;
}

// A unit vector as a whole number, 2 × 11 bits, from 1 on.
fn packed_normal(n: vec3f) -> f32 {
    let at = round((0.5 + 0.5 * to_octahedron(n)) * 2047.0);
    return 1.0 + at.x + 2048.0 * at.y;
}

fn unpacked_normal(x: f32) -> vec3f {
    let bits = u32(x) - 1u;
    return from_octahedron(vec2f(vec2u(bits & 2047u, bits >> 11u)) / 1023.5 - 1.0);
}

@compute @workgroup_size(64)
fn place_points(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&places) {
        return;
    }
    let place = places[id.x];
    let index = triangle_at(place.x);
    let w = unpack2x16unorm(place.y);
    let a = vertex_at(index.x);
    let b = vertex_at(index.y);
    let c = vertex_at(index.z);
    let position = a.position + w.x * (b.position - a.position) + w.y * (c.position - a.position);
    let first = texture_place(index.x);
    let uv = first + w.x * (texture_place(index.y) - first) + w.y * (texture_place(index.z) - first);
    let normal = normalize(cross(b.position - a.position, c.position - a.position) + vec3f(0.0, 1e-37, 0.0));
    let there = select(packed_normal(normal), 0.0, masked_out(materials[a.material], uv));
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
    let near = with_cosine(1.0 / far, abs(dot(unpacked_normal(point.w), there)) / far);
    atomicMax(&splats[(id.y * vpl.tile + texel.y) * vpl.tile + texel.x], bitcast<u32>(near));
}

// The distance in a texel of a tile as splatted, with its slope.
fn as_splatted(tile: u32, texel: vec2u) -> f32 {
    let near = bitcast<f32>(splatted[(tile * vpl.tile + texel.y) * vpl.tile + texel.x]);
    return select(0.0, with_cosine(1.0 / near, cosines_of(vec4f(near)).x + 1e-3), near > 0.0);
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

// Radians that a texel of a tile takes whose side is so many texels long.
fn texel_angle(texel: vec2f, side: f32) -> f32 {
    let off = 2.0 * texel / side - 1.0;
    return 4.0 / (side * (1.0 + dot(off, off)));
}

// By how much the distances of surfaces with these cosines may differ over an angle and still be of one surface, as a share
// of the nearer one.
fn tolerance(cosines: vec4f, angle: f32) -> vec4f {
    let slopes = sqrt(max(1.0 - cosines * cosines, vec4f(0.0))) / max(cosines, vec4f(0.5 / 255.0));
    return vpl.tolerance + angle * slopes;
}

// A weighted mean of known distances: of one over them, which along a plane changes evenly with the direction.
fn mean_distance(far: vec4f, weights: vec4f) -> f32 {
    let whole = dot(weights, vec4f(1.0));
    let near = dot(weights, 1.0 / max(far, vec4f(1e-20)));
    return select(0.0, with_cosine(whole / max(near, 1e-30), dot(weights, cosines_of(far)) / max(whole, 1e-6)), whole > 0.0);
}

// A level from the finer one (Marroquim et al. 2007): four texels become the mean of the nearest of them and of those that
// can be of the same surface.
@compute @workgroup_size(8, 8)
fn pull(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(tiles_out);
    if any(id.xy >= size) {
        return;
    }
    let at = 2u * id.xy;
    let far = vec4f(textureLoad(finer, at, 0).x, textureLoad(finer, at + vec2u(1u, 0u), 0).x,
                    textureLoad(finer, at + vec2u(0u, 1u), 0).x, textureLoad(finer, at + 1u, 0).x);
    let side = size.x / tile_columns();
    let angle = texel_angle(vec2f(id.xy % side) + 0.5, f32(side));
    let known = far > vec4f(0.0);
    let all = select(vec4f(1e30), far, known);
    let nearest = min(min(all.x, all.y), min(all.z, all.w));
    let own = known & (all <= nearest * (1.0 + tolerance(cosines_of(far), angle)));
    textureStore(tiles_out, id.xy, vec4f(mean_distance(far, select(vec4f(0.0), vec4f(1.0), own))));
}

// Fills a level's holes from the coarser one, and replaces outliers: what lies farther than the coarser texels around it, by
// more than its slope explains, was seen between the points of the surface before it. On the two finest levels it is held
// against their mean, on coarser ones against the farthest of them: else the rims of what is near would grow by as much as
// these levels' texels.
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
    let step = select(vec2i(-1), vec2i(1), (id.xy & vec2u(1u)) == vec2u(1u));
    let beside = vec2u(clamp(vec2i(here) + step, vec2i(first), vec2i(last)));
    let far = vec4f(textureLoad(coarser, here, 0).x, textureLoad(coarser, vec2u(beside.x, here.y), 0).x,
                    textureLoad(coarser, vec2u(here.x, beside.y), 0).x, textureLoad(coarser, beside, 0).x);
    let mean = mean_distance(far, select(vec4f(0.0), vec4f(9.0, 3.0, 3.0, 1.0), far > vec4f(0.0)));
    let farthest = max(max(far.x, far.y), max(far.z, far.w));
    let held_against = select(farthest, mean, 2u * side >= vpl.tile);
    let angle = 2.0 * texel_angle(vec2f(id.xy % side) + 0.5, f32(side));
    let most = held_against * (1.0 + tolerance(cosines_of(vec4f(own)), angle).x);
    if own == 0.0 || (own > most && mean > 0.0) {
        textureStore(filled, id.xy, vec4f(mean));
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
    let slope = sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1e-3) * texel_angle(at, f32(vpl.tile));
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
