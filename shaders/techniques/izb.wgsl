//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/shadow_ray.wgsl
//!include map/light_view.wgsl
//!include map/ray_cells.wgsl
// The irregular z-buffer: each view sample is kept in the cell of the light's image that it lies in, and each triangle is brought to
// the samples of all cells that it touches. There the sample's own shadow ray meets it, as the truth's does. In which order
// threads fill the lists changes nothing: bits are or'ed.
//
// With 32 samples a pixel they lie on its micro-quad, what the pixel covers of the receiver's plane (frustum-traced shadows: Wyman,
// Hoetzlein, Lefohn 2015). Samples of a pixel that lie in one cell share an entry of its list.

var<uniform> params: IzbParams;

struct Plan {
    // Triangles, in the order of the BVH.
    triangles: u32,
    // Images: one, or the six faces of a cube around the light.
    images: u32,
    // Cells along each side of an image.
    side: u32,
    padding: u32,
    // Where samples lie in their pixel, from its centre, two in each.
    places: array<vec4f, 16>,
}

var<uniform> plan: Plan;

struct Entry {
    pixel: u32,
    // The pixel's samples that it stands for, a bit each.
    samples: u32,
    // The next entry of the cell, from 1 on; 0: none.
    next: u32,
}

struct State {
    // Of each image the largest 1 - u, 1 - v, u and v of a sample, as bits.
    bounds: array<atomic<u32>, 24>,
    boxes: atomic<u32>,
    entries: atomic<u32>,
}

var<storage, read_write> state: State;
var<storage, read_write> entries: array<Entry>;
// Of each pixel the samples that are in shadow, then those that no list has room for, a bit each.
var<storage, read_write> verdicts: array<atomic<u32>>;
// The arguments of a draw: vertices, instances, first vertex, first instance.
var<storage, read_write> arguments: array<u32, 4>;
var visibility_out: texture_storage_2d<r32float, write>;
var map_out: texture_storage_2d<r32float, write>;

fn cells_side() -> u32 {
    return plan.side;
}

// Large triangles are drawn into a picture with a pixel a tile.
const tile = 8u;

fn boxes_side() -> u32 {
    return (cells_side() + tile - 1u) / tile;
}

// Cells of all images. Behind their first entries `cells` has the length of each one's list, then how many triangles were brought to
// it (for the view of that alone), then three words a tile: its cells with a list, a bit each, and what its lists cost to go through.
fn cell_count() -> u32 {
    return plan.images * cells_side() * cells_side();
}

fn cell_number(image: u32, cell: vec2u) -> u32 {
    return (image * cells_side() + cell.y) * cells_side() + cell.x;
}

fn tile_word(image: u32, at: vec2u) -> u32 {
    return 3u * cell_count() + 3u * ((image * boxes_side() + at.y) * boxes_side() + at.x);
}

// The image that a position lies in: the face of a cube, in the order +x, -x, +y, -y, +z, -z.
fn image_of(position: vec3f) -> u32 {
    if plan.images == 1u {
        return 0u;
    }
    let q = position - frame.light_position;
    let size = abs(q);
    if size.x >= size.y && size.x >= size.z {
        return select(0u, 1u, q.x < 0.0);
    }
    if size.y >= size.z {
        return select(2u, 3u, q.y < 0.0);
    }
    return select(4u, 5u, q.z < 0.0);
}

// Where an image sees a position: x, y, w of clip space. Around a lamp it is reckoned from there, so that places near it keep their digits.
fn seen(v: LightView, position: vec3f) -> vec3f {
    if frame.light_kind == directional {
        return light_clip(v, position).xyw;
    }
    let q = position - frame.light_position;
    return vec3f(dot(v.row_x.xyz, q), dot(v.row_y.xyz, q), dot(v.row_w.xyz, q));
}

fn place_of(clip: vec3f) -> vec2f {
    return vec2f(0.5, -0.5) * clip.xy / clip.z + 0.5;
}

// By how much rounding may move what a shadow ray passes, in x and y of clip space: the ray starts off the surface by 8 units of the
// largest coordinate, and runs parallel to the one to the light.
fn slack(v: LightView) -> vec2f {
    let light = select(largest(frame.light_position), 0.0, frame.light_kind == directional);
    let size = max(max(largest(frame.bounds_min), largest(frame.bounds_max)), light);
    return 24.0 * unit * size * vec2f(length(v.row_x.xyz), length(v.row_y.xyz)) + 4.0 * unit;
}

// By how much a sample's own place may be off, shares of the image. Cells are at least twice as wide.
fn spare(v: LightView) -> vec2f {
    return select(vec2f(1e-6), 0.5 * slack(v), frame.light_kind == directional);
}

fn bounds_of(image: u32) -> Bounds {
    var found: vec4f;
    for (var k = 0u; k < 4u; k++) {
        found[k] = bitcast<f32>(atomicLoad(&state.bounds[4u * image + k]));
    }
    let bounds = bounds_from(found);
    return Bounds(bounds.low, max(bounds.size, 2.0 * f32(cells_side()) * spare(light_views[image])));
}

fn place_in_pixel(k: u32) -> vec2f {
    let two = plan.places[k / 2u];
    return select(two.xy, two.zw, (k & 1u) == 1u);
}

// The surface at a sample of the pixel: the plane there, seen through that place of the pixel. At a grazing angle it does not
// run off to infinity.
fn at_sample(s: Surface, k: u32) -> Surface {
    if params.samples == samples_1 {
        return s;
    }
    if frame.orthographic == 1u {
        let step = frame.rays * vec3f(place_in_pixel(k), 0.0);
        let facing = min(dot(s.normal, frame.forward), -0.02);
        var beside = s;
        beside.position += step - frame.forward * (dot(s.normal, step) / facing);
        return beside;
    }
    let middle = pixel_ray(vec2f(s.pixel) + 0.5);
    let ray = pixel_ray(vec2f(s.pixel) + 0.5 + place_in_pixel(k));
    let slope = dot(s.normal, middle) / dot(s.normal, ray);
    let far = s.depth * select(2.0, clamp(slope, 0.5, 2.0), slope > 0.0);
    var moved = s;
    moved.position += far * ray - s.depth * middle;
    return moved;
}

// Samples of a surface that the light reaches, a bit each.
fn reached_samples(s: Surface) -> u32 {
    if params.samples == samples_1 {
        return 1u;
    }
    if frame.light_kind == directional {
        return 0xffffffffu;
    }
    var reached = 0u;
    for (var k = 0u; k < 32u; k++) {
        reached |= u32(light_at(at_sample(s, k).position).reached) << k;
    }
    return reached;
}

// Whether a pixel has a surface that the light can reach.
fn is_listed(pixel: vec2u) -> bool {
    return lit_sample(pixel).w > 0.0;
}

var<workgroup> group_bounds: array<atomic<u32>, 24>;

fn stretch(image: u32, most: vec4f) {
    for (var k = 0u; k < 4u; k++) {
        // + 0.0 turns a negative zero, whose bits are the largest of all, into zero.
        atomicMax(&group_bounds[4u * image + k], bitcast<u32>(max(most[k], 0.0) + 0.0));
    }
}

// Finds the box of the samples in each image. A workgroup takes 64 × 64 pixels.
@compute @workgroup_size(8, 8)
fn bound(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u,
         @builtin(local_invocation_index) index: u32) {
    var image = 0u;
    var most = vec4f(0.0);
    for (var i = 0u; i < 64u; i++) {
        let pixel = group.xy * 64u + vec2u(i % 8u, i / 8u) * 8u + local.xy;
        if !is_listed(pixel) {
            continue;
        }
        let s = load_surface(pixel);
        var left = reached_samples(s);
        while left != 0u {
            let position = at_sample(s, firstTrailingBit(left)).position;
            left &= left - 1u;
            let own = image_of(position);
            if own != image {
                stretch(image, most);
                most = vec4f(0.0);
                image = own;
            }
            let u = saturate(place_of(seen(light_views[own], position)));
            most = max(most, vec4f(1.0 - u, u));
        }
    }
    stretch(image, most);
    workgroupBarrier();
    if index < 24u {
        let found = atomicLoad(&group_bounds[index]);
        if found != 0u {
            atomicMax(&state.bounds[index], found);
        }
    }
}

// Where a sample is kept.
struct Cell {
    image: u32,
    at: vec2u,
}

fn cell_of_sample(position: vec3f) -> Cell {
    let image = image_of(position);
    let u = place_of(seen(light_views[image], position));
    return Cell(image, cell_at(share_of(bounds_of(image), u)));
}

// Rounds of loops that an invocation takes at most: Mesa's software driver stops loops after 65535 rounds of all of them together,
// and GPUs stop what takes too long.
const most_rounds = 24000u;

// Puts samples of a pixel into a cell's list. False: there is no room.
fn put(pixel: u32, cell: Cell, samples: u32) -> bool {
    let number = cell_number(cell.image, cell.at);
    let rounds = 1u + countOneBits(samples);
    if atomicAdd(&cells[cell_count() + number], 1u) >= params.longest
        || atomicAdd(&cells[tile_word(cell.image, cell.at / tile) + 2u], rounds) + rounds > most_rounds {
        return false;
    }
    // One sample a pixel: its entry has the pixel's number.
    var i = pixel;
    if params.samples != samples_1 {
        i = atomicAdd(&state.entries, 1u);
        if i >= arrayLength(&entries) {
            return false;
        }
    }
    let next = atomicExchange(&cells[number], i + 1u);
    if next == 0u {
        let bit = tile * (cell.at.y % tile) + cell.at.x % tile;
        atomicOr(&cells[tile_word(cell.image, cell.at / tile) + bit / 32u], 1u << (bit & 31u));
    }
    entries[i] = Entry(pixel, samples, next);
    return true;
}

// Lists the samples. What finds no room is left to rays.
@compute @workgroup_size(8, 8)
fn list(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) || !is_listed(id.xy) {
        return;
    }
    let s = load_surface(id.xy);
    let pixel = id.y * frame.size.x + id.x;
    var left = reached_samples(s);
    var rest = 0u;
    if params.samples == samples_1 {
        rest = select(1u, 0u, put(pixel, cell_of_sample(s.position), 1u));
        left = 0u;
    }
    var own: array<Cell, 32>;
    for (var k = 0u; k < 32u && left != 0u; k++) {
        own[k] = cell_of_sample(at_sample(s, k).position);
    }
    while left != 0u {
        let cell = own[firstTrailingBit(left)];
        var together = 0u;
        for (var k = 0u; k < 32u; k++) {
            together |= u32(own[k].image == cell.image && all(own[k].at == cell.at)) << k;
        }
        together &= left;
        left &= ~together;
        if !put(pixel, cell, together) {
            rest |= together;
        }
    }
    if rest != 0u {
        atomicStore(&verdicts[2u * pixel + 1u], rest);
    }
}

// Samples of a surface that the triangle blocks, of those given.
fn blocked(s: Surface, samples: u32, c: Caster) -> u32 {
    var hit = 0u;
    var left = samples;
    while left != 0u {
        let k = firstTrailingBit(left);
        left &= left - 1u;
        let moved = at_sample(s, k);
        let ray = shadow_ray(moved, light_at(moved.position));
        let candidate = meets_corners(ray, shear_of(ray.direction), c.corners[0], c.corners[1], c.corners[2]);
        if candidate.found && !passes(candidate) {
            hit |= 1u << k;
        }
    }
    return hit;
}

struct Caster {
    // As rays read them.
    corners: array<vec4u, 3>,
    clips: array<vec3f, 3>,
    // Edge functions of a place x, y, 1 of the image, in clip space over w, and how much they change within half a cell; rounding alone.
    edges: mat3x3f,
    spread: vec3f,
    rounding: vec3f,
}

fn caster_of(image: u32, triangle: u32) -> Caster {
    let v = light_views[image];
    let corners = array<vec4u, 3>(corner_texel(3u * triangle), corner_texel(3u * triangle + 1u), corner_texel(3u * triangle + 2u));
    let a = seen(v, bitcast<vec3f>(corners[0].xyz));
    let b = seen(v, bitcast<vec3f>(corners[1].xyz));
    let c = seen(v, bitcast<vec3f>(corners[2].xyz));
    let edges = mat3x3f(cross(b, c), cross(c, a), cross(a, b));
    let half = bounds_of(image).size / f32(cells_side()) + 2.0 * spare(v);
    let spread = vec3f(dot(abs(edges[0].xy), half), dot(abs(edges[1].xy), half), dot(abs(edges[2].xy), half));
    // What the corners' slack changes of a cross product, at any place of the image; and its own rounding.
    let off = slack(v);
    let far = vec3f(largest(a), largest(b), largest(c));
    let rounding = 4.0 * (max(off.x, off.y) * (far.yzx + far.zxy) + 4.0 * unit * far.yzx * far.zxy);
    return Caster(corners, array<vec3f, 3>(a, b, c), edges, spread, rounding);
}

// Brings a triangle to the samples of a cell that has some.
fn bring(c: Caster, number: u32) {
    if frame.map == shows_tests {
        atomicAdd(&cells[2u * cell_count() + number], 1u);
    }
    var i = atomicLoad(&cells[number]);
    while i != 0u {
        let entry = entries[i - 1u];
        let left = entry.samples & ~atomicLoad(&verdicts[2u * entry.pixel]);
        if left != 0u {
            let s = load_surface(vec2u(entry.pixel % frame.size.x, entry.pixel / frame.size.x));
            let hit = blocked(s, left, c);
            if hit != 0u {
                atomicOr(&verdicts[2u * entry.pixel], hit);
            }
        }
        i = entry.next;
    }
}

// A part of a tile's bits: the columns and rows from `first` to `last`, up to 7 each.
fn rows_of(first: vec2u, last: vec2u) -> vec2u {
    let row = extractBits(0xffu, 0u, last.x - first.x + 1u) << first.x;
    let all = row * 0x01010101u;
    var words = vec2u(all);
    for (var k = 0u; k < 2u; k++) {
        let low = min(max(first.y, 4u * k) - 4u * k, 4u);
        let high = min(max(last.y + 1u, 4u * k) - 4u * k, 4u);
        words[k] &= insertBits(0u, 0xffffffffu, 8u * low, 8u * (max(high, low) - low));
    }
    return words;
}

// A triangle's edge functions at a place of the lists, in cells.
fn edges_at(c: Caster, bounds: Bounds, place: vec2f) -> vec3f {
    let u = bounds.low + place / f32(cells_side()) * bounds.size;
    return vec3f(2.0 * u.x - 1.0, 1.0 - 2.0 * u.y, 1.0) * c.edges;
}

// Brings a triangle to the cells of a tile that have lists, of those from `first` to `last` of the image.
fn bring_to_tile(c: Caster, image: u32, at: vec2u, first: vec2u, last: vec2u) {
    let word = tile_word(image, at);
    let base = tile * at;
    let part = rows_of(max(first, base) - base, min(last - base, vec2u(tile - 1u)));
    let bounds = bounds_of(image);
    if passes_by(edges_at(c, bounds, vec2f(base) + 0.5 * f32(tile)), f32(tile) * c.spread + c.rounding) {
        return;
    }
    for (var k = 0u; k < 2u; k++) {
        var left = atomicLoad(&cells[word + k]) & part[k];
        while left != 0u {
            let bit = firstTrailingBit(left);
            left &= left - 1u;
            let cell = base + vec2u(bit & 7u, 4u * k + (bit >> 3u));
            if !passes_by(edges_at(c, bounds, vec2f(cell) + 0.5), c.spread + c.rounding) {
                bring(c, cell_number(image, cell));
            }
        }
    }
}

struct ImageBox {
    low: vec2f,
    high: vec2f,
}

// The box of a triangle in an image, of what of it lies ahead of the light.
fn image_box(v: LightView, c: Caster) -> ImageBox {
    let off = slack(v);
    let far = max(largest(c.clips[0]), max(largest(c.clips[1]), largest(c.clips[2])));
    // Nearer to a lamp no ray goes: the truth's ends 64 units of the largest coordinate before it.
    let least = select(16.0 * unit * max(largest(frame.light_position), 1e-6), 0.0, frame.light_kind == directional);
    var box = ImageBox(vec2f(1e9), vec2f(-1e9));
    for (var k = 0u; k < 3u; k++) {
        let p = c.clips[k];
        let q = c.clips[(k + 1u) % 3u];
        if p.z > least {
            let u = place_of(p);
            let around = (off + 4.0 * unit * abs(p.xy)) / p.z;
            box.low = min(box.low, u - around);
            box.high = max(box.high, u + around);
        }
        if (p.z > least) != (q.z > least) {
            let cut = mix(p, q, (least - p.z) / (q.z - p.z));
            let u = place_of(vec3f(cut.xy, least));
            let around = (off + 8.0 * unit * far) / least;
            box.low = min(box.low, u - around);
            box.high = max(box.high, u + around);
        }
    }
    return box;
}

// Most tiles of a box that is gone through at once; larger ones, and those with long lists, are left to the rasteriser, tile by tile.
const few_tiles = 16u;

// Brings each triangle to the cells that it may touch.
@compute @workgroup_size(64)
fn bring_triangles(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let triangle = id.y * groups.x * 64u + id.x;
    if triangle >= plan.triangles {
        return;
    }
    var rounds = 0u;
    for (var image = 0u; image < plan.images; image++) {
        // No sample lies there.
        if atomicLoad(&state.bounds[4u * image]) == 0u && atomicLoad(&state.bounds[4u * image + 2u]) == 0u {
            continue;
        }
        let v = light_views[image];
        let caster = caster_of(image, triangle);
        let box = image_box(v, caster);
        let bounds = bounds_of(image);
        let low = (box.low - bounds.low - spare(v)) / bounds.size - 1e-5;
        let high = (box.high - bounds.low + spare(v)) / bounds.size + 1e-5;
        if any(low > vec2f(1.0)) || any(high < vec2f(0.0)) || any(low > high) {
            continue;
        }
        let first = cell_at(low);
        let last = cell_at(high);
        let tiles = last / tile - first / tile + 1u;
        var left_over = tiles.x * tiles.y > few_tiles;
        if !left_over {
            for (var k = 0u; k < tiles.x * tiles.y; k++) {
                let at = first / tile + vec2u(k % tiles.x, k / tiles.x);
                rounds += min(atomicLoad(&cells[tile_word(image, at) + 2u]), most_rounds);
            }
            left_over = rounds > most_rounds;
        }
        if left_over {
            let at = atomicAdd(&state.boxes, 1u);
            if at < arrayLength(&boxes) {
                boxes[at] = boxed(triangle, first / tile, last / tile, image);
                continue;
            }
        }
        for (var k = 0u; k < tiles.x * tiles.y; k++) {
            bring_to_tile(caster, image, first / tile + vec2u(k % tiles.x, k / tiles.x), first, last);
        }
    }
}

// Writes the draw of the large boxes.
@compute @workgroup_size(1)
fn finish() {
    arguments[0] = 6u * min(atomicLoad(&state.boxes), arrayLength(&drawn_boxes));
    arguments[1] = 1u;
}

@fragment
fn bring_box(in: BoxCaster) {
    let at = vec2u(in.clip.xy);
    let word = tile_word(in.image, at);
    if (atomicLoad(&cells[word]) | atomicLoad(&cells[word + 1u])) != 0u {
        bring_to_tile(caster_of(in.image, in.triangle), in.image, at, tile * at, min(tile * at + 7u, vec2u(cells_side() - 1u)));
    }
}

// Samples in shadow of those that no list had room for.
fn traced(s: Surface, samples: u32) -> u32 {
    var hit = 0u;
    var left = samples;
    while left != 0u {
        let k = firstTrailingBit(left);
        left &= left - 1u;
        let moved = at_sample(s, k);
        let found = trace(shadow_ray(moved, light_at(moved.position)));
        tally_ray(found);
        hit |= u32(found.blocked) << k;
    }
    return hit;
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    var lit = select(1.0, 0.0, s.valid);
    if is_listed(id.xy) {
        let pixel = 2u * (id.y * frame.size.x + id.x);
        let reached = reached_samples(s);
        let shadowed = atomicLoad(&verdicts[pixel]) | traced(s, atomicLoad(&verdicts[pixel + 1u]));
        lit = 1.0 - f32(countOneBits(shadowed & reached)) / f32(max(countOneBits(reached), 1u));
    }
    textureStore(visibility_out, id.xy, vec4f(lit));
}

// The lists of all images beside each other, fitted into the picture: how many entries each has.
fn lists_laid_out(pixel: vec2u) -> f32 {
    let tiles = select(vec2u(3u, 2u), vec2u(1u), plan.images == 1u);
    let size = vec2f(frame.size);
    let side = min(size.x / f32(tiles.x), size.y / f32(tiles.y));
    let at = (vec2f(pixel) + 0.5 - 0.5 * size) / side + 0.5 * vec2f(tiles);
    if any(at < vec2f(0.0)) || any(at >= vec2f(tiles)) {
        return 0.0;
    }
    let tile = vec2u(at);
    let first = cell_at(fract(at) - vec2f(0.5 / side));
    let last = cell_at(fract(at) + vec2f(0.5 / side));
    // The longest of the lists that the pixel covers.
    var most = 0u;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            most = max(most, atomicLoad(&cells[cell_count() + cell_number(tile.y * 3u + tile.x, vec2u(x, y))]));
        }
    }
    return f32(most);
}

@compute @workgroup_size(8, 8)
fn inspect(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    var value = -1.0;
    if frame.map == shows_lists {
        value = lists_laid_out(id.xy);
    } else if is_listed(id.xy) {
        let cell = cell_of_sample(load_surface(id.xy).position);
        let number = cell_number(cell.image, cell.at);
        value = f32(atomicLoad(&cells[select(1u, 2u, frame.map == shows_tests) * cell_count() + number]));
    }
    textureStore(map_out, id.xy, vec4f(value));
}
