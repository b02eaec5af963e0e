//!include map/choose/single.wgsl
//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include lib/light_cells.wgsl
//!include lib/light_place.wgsl
//!include lib/labels.wgsl
//!include lib/light_dots.wgsl
//!include constants.wgsl
// Maps from the corners of a quadtree's cells on the light (Schwärzler, Mattausch, Scherzer, Wimmer 2012), drawn and looked up one after
// the other: what they see of each pixel is kept, and weighed when the tree is grown.

var<uniform> sampling: AreaAdaptiveParams;
var<uniform> light_tree: LightTree;
// From the light's middle to the place that the map is drawn from, and its number.
var<uniform> step_to_place: vec4f;
// The places on the light, as `lib/light_place.wgsl` has them.
var<storage, read> light_places: array<vec2f>;
// Of each pixel a code for each sample, some a word; the first word of all pixels, then the second, …
var<storage, read_write> codes: array<u32>;
// As `map/light_tree.wgsl` has them, but counted.
var<storage, read_write> tallies: array<atomic<u32>>;
// Pixels that some sample's map does not reach.
var<storage, read_write> beyond: atomic<u32>;

// A code: twice the texels of the window that see the light, and 1 if the middle one does; or `no_code`: the map does not reach the pixel,
// or nothing can hide the light from it.
const no_code = 1u;

fn codes_a_word() -> u32 {
    return select(select(5u, 6u, sampling.kernel == 3u), 16u, sampling.kernel == 1u);
}

fn code_bits() -> u32 {
    return 32u / codes_a_word();
}

fn word_of(pixel: vec2u, k: u32) -> u32 {
    return (k / codes_a_word()) * frame.size.x * frame.size.y + pixel.y * frame.size.x + pixel.x;
}

fn code_in(word: u32, k: u32) -> u32 {
    return extractBits(word, k % codes_a_word() * code_bits(), code_bits());
}

fn code_of(pixel: vec2u, k: u32) -> u32 {
    return code_in(codes[word_of(pixel, k)], k);
}

// One map more.
@compute @workgroup_size(8, 8)
fn look(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    let light = light_at(s.position);
    var code = no_code;
    if may_be_shadowed(s, light) {
        let n = sampling.kernel;
        let around = 0.5 * f32(n - 1u);
        let r = receive(s, choose(s).layer, around, 1.0);
        if r.clip.w > 0.0 && !outside_map(r, r.texel) {
            let first = floor(r.texel - around) + 0.5;
            // A place that has set behind the surface's plane is not seen, whatever the map says.
            let risen = dot(s.normal, light.to_light + step_to_place.xyz) > 0.0;
            code = 0u;
            for (var i = 0u; i < select(0u, n * n, risen); i++) {
                let lit = u32(compare(r, first + vec2f(vec2u(i % n, i / n))) + 0.5);
                code += lit * select(2u, 3u, i == n * n / 2u);
            }
        }
    }
    let k = u32(step_to_place.w);
    let at = word_of(id.xy, k);
    codes[at] = insertBits(codes[at], code, k % codes_a_word() * code_bits(), code_bits());
}

// What the light's samples, up to some level's end, see of a pixel, and which reach it: a bit each.
struct Seen {
    bits: array<u32, 3>,
    reach: array<u32, 3>,
    // Some of them do.
    held: bool,
}

fn seen_of(pixel: vec2u) -> Seen {
    var seen = Seen(array<u32, 3>(0u, 0u, 0u), array<u32, 3>(0u, 0u, 0u), false);
    if any(pixel >= frame.size) {
        return seen;
    }
    let per_word = codes_a_word();
    var word = 0u;
    for (var k = 0u; k < min(sample_level.end, 96u); k++) {
        if k % per_word == 0u {
            word = codes[word_of(pixel, k)];
        }
        let code = code_in(word, k);
        seen.held = seen.held || code != no_code;
        seen.reach[k / 32u] |= select(1u, 0u, code == no_code) << (k % 32u);
        seen.bits[k / 32u] |= (code & 1u) << (k % 32u);
    }
    return seen;
}

// Which of a cell's corners see it, as four bits, and which reach it, as four more.
fn state(seen: ptr<function, Seen>, cell: u32) -> u32 {
    let corners = cell_corners[cell];
    var bits = 0u;
    for (var i = 0u; i < 4u; i++) {
        let word = corners[i] / 32u;
        let bit = corners[i] % 32u;
        bits |= ((*seen).bits[word] >> bit & 1u) << i;
        bits |= ((*seen).reach[word] >> bit & 1u) << (4u + i);
    }
    return bits;
}

// All see it, or none does; or none reaches it.
fn agrees(state: u32) -> bool {
    return state == 0xf0u || state == 0xffu || (state >> 4u) == 0u;
}

// Of the cells of a level, two words each as `tallies`; and the receivers.
var<workgroup> in_cells: array<atomic<u32>, 129>;

fn tally(pixel: vec2u) {
    var here = seen_of(pixel);
    if !here.held {
        return;
    }
    atomicAdd(&in_cells[128], 1u);
    var beside: array<Seen, 4>;
    var looked = false;
    for (var i = 0u; i < 1u << (2u * sample_level.level); i++) {
        let cell = first_cell(sample_level.level) + i;
        if !is_there(light_tree.split, sample_level.level, i) {
            continue;
        }
        let own = state(&here, cell);
        if agrees(own) {
            continue;
        }
        atomicAdd(&in_cells[2u * i], 1u);
        if sampling.criterion != criterion_gap {
            continue;
        }
        var edge = false;
        for (var j = 0u; j < 4u; j++) {
            if !looked {
                // Left of the picture's edge lies nothing: a number that wraps around is none of its pixels.
                beside[j] = seen_of(vec2u(vec2i(pixel) + select(vec2i(0, 1), vec2i(1, 0), j < 2u) * select(1, -1, (j & 1u) == 0u)));
            }
            var other = beside[j];
            edge = edge || (other.held && state(&other, cell) != own);
        }
        looked = true;
        if edge {
            atomicAdd(&in_cells[2u * i + 1u], 1u);
        }
    }
}

// A workgroup takes 32 × 32 pixels.
@compute @workgroup_size(8, 8)
fn count_pixels(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    for (var i = 0u; i < 16u; i++) {
        tally(group.xy * 32u + vec2u(i % 4u, i / 4u) * 8u + local.xy);
    }
    workgroupBarrier();
    for (var i = index; i < 129u; i += 64u) {
        let n = atomicLoad(&in_cells[i]);
        if n > 0u {
            let cells = 2u * first_cell(sample_level.level) + i;
            atomicAdd(&tallies[select(cells, 2u * most_cells + sample_level.level, i == 128u)], n);
        }
    }
}

@compute @workgroup_size(8, 8)
fn weighed(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let s = load_surface(id.xy);
    var v = select(1.0, 0.0, s.valid);
    if may_be_shadowed(s, light_at(s.position)) {
        // In whole numbers, so that what all samples see is 1, and what none does 0.
        var lit = 0u;
        var all_of_it = 0u;
        var all_reach = true;
        for (var i = 0u; i < light_tree.maps; i++) {
            let one = light_tree.samples[i / 4u][i % 4u];
            let code = code_of(id.xy, one & 0xffffu);
            let reaches = code != no_code;
            lit += select(0u, (one >> 16u) * (code >> 1u), reaches);
            all_of_it += select(0u, one >> 16u, reaches);
            all_reach = all_reach && reaches;
        }
        v = select(f32(lit) / f32(all_of_it * sampling.kernel * sampling.kernel), 1.0, all_of_it == 0u);
        if !all_reach {
            atomicAdd(&beyond, 1u);
        }
    }
    textureStore(visibility_out, id.xy, vec4f(v));
}

fn dot_count() -> u32 {
    return light_tree.maps;
}

fn dot_number(i: u32) -> u32 {
    return light_tree.samples[i / 4u][i % 4u] & 0xffffu;
}

fn dot_place(i: u32) -> vec2f {
    return light_places[dot_number(i)];
}

fn dot_seen(i: u32) -> bool {
    let s = load_surface(probed_pixel());
    return may_be_shadowed(s, light_at(s.position)) && (code_of(probed_pixel(), dot_number(i)) & 1u) != 0u;
}

// The last level of cells.
fn levels() -> u32 {
    return select(0u, sampling.levels, has_size());
}

// The place of the square, -1 to 1, for one of the light: the other way round than `on_light`.
fn square_of(at: vec2f) -> vec2f {
    if frame.light_kind == rect_area {
        return at;
    }
    let wide = abs(at.x) > abs(at.y);
    let along = select(at.yx, at, wide);
    let radius = length(at) * sign(along.x);
    let other = radius * atan(along.y / select(along.x, 1.0, along.x == 0.0)) / 0.7853982;
    return select(vec2f(other, radius), vec2f(radius, other), wide);
}

// The cell at a place of the square that is not split: its place in its level, and the level.
fn leaf_at(square: vec2f) -> vec3u {
    let at = saturate(0.5 + 0.5 * square);
    var leaf = vec3u(0u);
    for (var level = 0u; level < levels(); level++) {
        let side = 1u << level;
        if leaf.z == level && is_split(light_tree.split, first_cell(level) + leaf.y * side + leaf.x) {
            leaf = vec3u(min(vec2u(at * f32(2u * side)), vec2u(2u * side - 1u)), level + 1u);
        }
    }
    return leaf;
}

// The cells' borders in a drawing of the light.
fn on_border(square: vec2f, leaf: vec3u) -> bool {
    let within = fract((0.5 + 0.5 * square) * f32(1u << leaf.z));
    let off = min(within, 1.0 - within) / f32(1u << leaf.z);
    return min(off.x, off.y) < 0.25 / drawn_half();
}

// The dots in a drawing of the light, or how much each cell's corners disagree; with the cells' borders.
fn drawn_cells(pixel: vec2u, filled: bool) -> f32 {
    let dots = light_dots(pixel);
    let at = drawn_place(pixel);
    let edge = select(length(at), max(abs(at.x), abs(at.y)), frame.light_kind == rect_area);
    let square = square_of(at);
    let leaf = leaf_at(square);
    let side = 1u << leaf.z;
    let apart = f32(atomicLoad(&tallies[2u * (first_cell(leaf.z) + leaf.y * side + leaf.x)]));
    let share = apart / max(f32(atomicLoad(&tallies[2u * most_cells + leaf.z])), 1.0);
    // In steps, as the legend has them.
    let color = select(select(3u, 0u, share > 0.001), 1u, share > 0.01);
    let fill = select(drawn(color, select(0.6, 0.15, apart == 0.0)), drawn(2u, 0.6), leaf.z == levels());
    let free = select(label_of(dots) == white, true, filled);
    let inside = select(dots, fill, filled);
    let outside = select(dots, drawn(white, 0.0), filled && label_of(dots) != white);
    return select(outside, select(inside, drawn(white, 0.35), free && has_size() && on_border(square, leaf)), edge < 1.0);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_light_samples || frame.map == shows_light_cells {
        return drawn_cells(s.pixel, frame.map == shows_light_cells);
    }
    if frame.map != shows_penumbra_cells && frame.map != shows_penumbra_level {
        return inspect_filter(s);
    }
    if !may_be_shadowed(s, light_at(s.position)) || !has_size() {
        return -1.0;
    }
    var cells = 0u;
    var finest = -1.0;
    for (var level = 0u; level <= levels(); level++) {
        for (var i = 0u; i < 1u << (2u * level); i++) {
            if !is_leaf(light_tree.split, level, i, levels()) {
                continue;
            }
            let corners = cell_corners[first_cell(level) + i];
            var bits = 0u;
            for (var c = 0u; c < 4u; c++) {
                bits += code_of(s.pixel, corners[c]) & 1u;
            }
            if bits % 4u != 0u {
                cells++;
                finest = f32(level);
            }
        }
    }
    return select(finest, select(-1.0, f32(cells), cells > 0u), frame.map == shows_penumbra_cells);
}
