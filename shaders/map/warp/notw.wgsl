//!include map/warp/warped.wgsl
// Milet, Navratil, Zemcik 2015: every row, then every column of the map has a warp of its own, after the view samples in
// it (Navratil 2015, algorithm 3). Lines are rows where x is warped, columns where y is.

var<uniform> notw: NotwParams;
// Where the edges between a line's texels go: side + 1 places a line, shares of the map's side; layer after layer.
var<storage, read> rows: array<f32>;
var<storage, read> columns: array<f32>;

fn warp_bends() -> f32 {
    return map_side();
}

// The first edge of a line of the layer that is followed.
fn line_start(line: u32) -> u32 {
    let side = u32(map_side());
    return (warped_layer * side + line) * (side + 1u);
}

// Where a layer's lines begin among sums and smoothed warps, and its view samples among others.
fn edges_of_layer(length: u32) -> u32 {
    return own_part(length, u32(map_side()) * (u32(map_side()) + 1u));
}

fn texels_of_layer(length: u32) -> u32 {
    return own_part(length, u32(map_side()) * u32(map_side()));
}

// Where on the lines' own axis a place across them lies: the two nearest lines and the share of the second.
struct Lines {
    first: u32,
    second: u32,
    share: f32,
    // 0 beyond the outermost lines' middles, where nothing changes.
    rate: f32,
}

fn lines_at(across: f32) -> Lines {
    let side = u32(map_side());
    let at = across * map_side() - 0.5;
    let inner = clamp(at, 0.0, map_side() - 1.0);
    let first = min(u32(inner), side - 1u);
    return Lines(first, min(first + 1u, side - 1u), inner - f32(first), select(0.0, map_side(), at == inner));
}

// Place along a line, and its derivatives along and across the lines.
fn row_warp(x: f32, y: f32) -> vec3f {
    let l = lines_at(y);
    let i = min(u32(x * map_side()), u32(map_side()) - 1u);
    let g = x * map_side() - f32(i);
    let a = line_start(l.first) + i;
    let b = line_start(l.second) + i;
    let low = mix(rows[a], rows[b], l.share);
    let high = mix(rows[a + 1u], rows[b + 1u], l.share);
    let across = mix(rows[b], rows[b + 1u], g) - mix(rows[a], rows[a + 1u], g);
    return vec3f(mix(low, high, g), (high - low) * map_side(), across * l.rate);
}

fn column_warp(y: f32, x: f32) -> vec3f {
    let l = lines_at(x);
    let i = min(u32(y * map_side()), u32(map_side()) - 1u);
    let g = y * map_side() - f32(i);
    let a = line_start(l.first) + i;
    let b = line_start(l.second) + i;
    let low = mix(columns[a], columns[b], l.share);
    let high = mix(columns[a + 1u], columns[b + 1u], l.share);
    let across = mix(columns[b], columns[b + 1u], g) - mix(columns[a], columns[a + 1u], g);
    return vec3f(mix(low, high, g), (high - low) * map_side(), across * l.rate);
}

// Equation 4.9, continuous: between the middles of two lines their warps are mixed.
fn warp(u: vec2f) -> vec2f {
    let x = row_warp(u.x, u.y).x;
    return vec2f(x, column_warp(u.y, x).x);
}

fn warp_slope(u: vec2f) -> mat2x2f {
    let x = row_warp(u.x, u.y);
    let y = column_warp(u.y, x.x);
    return mat2x2f(vec2f(x.y, y.z * x.y), vec2f(x.z, y.y + y.z * x.z));
}

// Where the place `at` after a line's warp was before it: the warp rises from edge to edge.
fn unwarp_column(at: f32, x: f32) -> f32 {
    let l = lines_at(x);
    let first = line_start(l.first);
    let second = line_start(l.second);
    var low = 0u;
    var high = u32(map_side()) - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if mix(columns[first + middle + 1u], columns[second + middle + 1u], l.share) < at {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let start = mix(columns[first + low], columns[second + low], l.share);
    let end = mix(columns[first + low + 1u], columns[second + low + 1u], l.share);
    return (f32(low) + saturate((at - start) / max(end - start, 1e-12))) / map_side();
}

fn unwarp_row(at: f32, y: f32) -> f32 {
    let l = lines_at(y);
    let first = line_start(l.first);
    let second = line_start(l.second);
    var low = 0u;
    var high = u32(map_side()) - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if mix(rows[first + middle + 1u], rows[second + middle + 1u], l.share) < at {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let start = mix(rows[first + low], rows[second + low], l.share);
    let end = mix(rows[first + low + 1u], rows[second + low + 1u], l.share);
    return (f32(low) + saturate((at - start) / max(end - start, 1e-12))) / map_side();
}

// First the column, as rows were warped first.
fn unwarp(at: vec2f) -> vec2f {
    let y = unwarp_column(at.y, at.x);
    return vec2f(unwarp_row(at.x, y), y);
}

// Making the warps: the same passes for rows and columns.

var<storage, read_write> moved: array<atomic<u32>>;
// View samples, side a line; their sums before each edge, side + 1 a line; all of a line; and of all lines.
var<storage, read> samples: array<u32>;
var<storage, read_write> sums: array<f32>;
var<storage, read_write> weights: array<f32>;
var<storage, read_write> total: atomic<u32>;

// Counts view samples by where the rows' warps take them, column after column.
@compute @workgroup_size(8, 8)
fn count_moved(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let u = unwarped_place(s.position).xy;
    if all(u >= vec2f(0.0)) && all(u <= vec2f(1.0)) {
        let last = u32(map_side()) - 1u;
        let x = min(u32(row_warp(u.x, u.y).x * map_side()), last);
        atomicAdd(&moved[texels_of_layer(arrayLength(&moved)) + x * (last + 1u) + min(u32(u.y * map_side()), last)], 1u);
    }
}

var<workgroup> chunks: array<u32, 64>;

// Equation 4.5 for each line, a workgroup a line.
@compute @workgroup_size(64)
fn sum(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) index: u32) {
    follow(light_view);
    let side = u32(map_side());
    let chunk = (side + 63u) / 64u;
    let start = min(index * chunk, side);
    let end = min(start + chunk, side);
    let line = texels_of_layer(arrayLength(&samples)) + group.x * side;
    var own = 0u;
    for (var i = start; i < end; i++) {
        own += samples[line + i];
    }
    chunks[index] = own;
    workgroupBarrier();
    var before = 0u;
    var all = 0u;
    for (var k = 0u; k < 64u; k++) {
        before += select(0u, chunks[k], k < index);
        all += chunks[k];
    }
    let edges = edges_of_layer(arrayLength(&sums)) + group.x * (side + 1u);
    if index == 0u {
        weights[group.x] = f32(all);
        atomicAdd(&total, all);
        sums[edges] = 0.0;
        sums[edges + side] = f32(all);
    }
    // Nobody looks at the other sums of a line without samples.
    if all == 0u {
        return;
    }
    for (var i = start; i < end; i++) {
        before += samples[line + i];
        sums[edges + i + 1u] = f32(before);
    }
}

var<storage, read> line_sums: array<f32>;
var<storage, read> line_weights: array<f32>;
var<storage, read_write> smoothed: array<f32>;
var<storage, read_write> smoothed_weights: array<f32>;
var<storage, read> samples_total: u32;

// A line's own warp at an edge and 1, both times the line's weight; equation 4.6 with a floor that makes it rise everywhere.
// `spare`: the floor, view samples a texel.
fn weighted(line: u32, edge: u32, spare: f32) -> vec2f {
    let n = line_weights[line];
    if n == 0.0 {
        return vec2f(0.0);
    }
    let place = (line_sums[edges_of_layer(arrayLength(&line_sums)) + line * (u32(map_side()) + 1u) + edge] + spare * f32(edge)) / (n + spare * map_side());
    return select(vec2f(place, 1.0), vec2f(place * n, n), notw.weighting == weighting_count);
}

// Half the window across the lines, lines; a tent is a box twice, each of half its width.
fn reach() -> i32 {
    let whole = round(notw.window * map_side());
    return i32(select(whole, round(0.5 * whole), notw.kernel == kernel_tent));
}

fn finished(line: u32, edge: u32, sum: f32, weight: f32) -> f32 {
    let plain = f32(edge) / map_side();
    if weight <= 0.0 || edge == 0u || edge == u32(map_side()) {
        return plain;
    }
    return mix(plain, sum / weight, notw.strength);
}

// Outputs to a thread. Their windows share all lines but the outermost, which are added one after the other: nothing is
// ever subtracted, so that sums keep their digits.
const run = 16;

// `first`: of the lines' own warps; otherwise of what the first box left. `last`: what is left is the warp.
fn smooth_lines(id: vec2u, first: bool, last: bool) {
    follow(light_view);
    let side = i32(map_side());
    let edge = id.x;
    let start = i32(id.y) * run;
    if light_view.idle != 0u || edge > u32(side) || start >= side {
        return;
    }
    let k = reach();
    var spare = 0.0;
    if first {
        spare = max(notw.floor, 1e-5) * f32(samples_total) / (map_side() * map_side());
    }
    var sums_of: array<f32, 16>;
    var weights_of: array<f32, 16>;
    // Lines in the windows of all outputs.
    let first_shared = start + run - 1 - k;
    let last_shared = start + k;
    var core = vec2f(0.0);
    for (var j = max(first_shared, 0); j <= min(last_shared, side - 1); j++) {
        core += line_of(u32(j), edge, first, spare);
    }
    if first_shared <= last_shared {
        var part = core;
        for (var m = run - 1; m >= 0; m--) {
            sums_of[m] = part.x;
            weights_of[m] = part.y;
            // The line that the next output's window has on the left.
            let j = start + m - 1 - k;
            if j >= 0 && j < side {
                part += line_of(u32(j), edge, first, spare);
            }
        }
        part = vec2f(0.0);
        for (var m = 1; m < run; m++) {
            let j = start + m + k;
            if j >= 0 && j < side {
                part += line_of(u32(j), edge, first, spare);
            }
            sums_of[m] += part.x;
            weights_of[m] += part.y;
        }
    } else {
        for (var m = 0; m < run; m++) {
            var part = vec2f(0.0);
            for (var j = max(start + m - k, 0); j <= min(start + m + k, side - 1); j++) {
                part += line_of(u32(j), edge, first, spare);
            }
            sums_of[m] = part.x;
            weights_of[m] = part.y;
        }
    }
    for (var m = 0; m < run && start + m < side; m++) {
        let line = u32(start + m);
        let at = edges_of_layer(arrayLength(&smoothed)) + line * u32(side + 1) + edge;
        if last {
            smoothed[at] = finished(line, edge, sums_of[m], weights_of[m]);
        } else {
            smoothed[at] = sums_of[m];
            if edge == 0u {
                smoothed_weights[line] = weights_of[m];
            }
        }
    }
}

fn line_of(line: u32, edge: u32, first: bool, spare: f32) -> vec2f {
    if first {
        return weighted(line, edge, spare);
    }
    return vec2f(line_sums[edges_of_layer(arrayLength(&line_sums)) + line * (u32(map_side()) + 1u) + edge], line_weights[line]);
}

@compute @workgroup_size(64)
fn smooth_box(@builtin(global_invocation_id) id: vec3u) {
    smooth_lines(id.xy, true, true);
}

@compute @workgroup_size(64)
fn smooth_tent_first(@builtin(global_invocation_id) id: vec3u) {
    smooth_lines(id.xy, true, false);
}

@compute @workgroup_size(64)
fn smooth_tent_second(@builtin(global_invocation_id) id: vec3u) {
    smooth_lines(id.xy, false, true);
}

// Along each line: the mean over a window that is symmetric, so that a line that is not warped stays so, and ends where
// the line ends.
@compute @workgroup_size(64)
fn smooth_along(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    let side = u32(map_side());
    if light_view.idle != 0u || id.x > side || id.y >= side {
        return;
    }
    let most = u32(round(notw.window_along * map_side()));
    let k = min(min(id.x, side - id.x), most);
    let line = edges_of_layer(arrayLength(&line_sums)) + id.y * (side + 1u);
    let to = edges_of_layer(arrayLength(&smoothed)) + id.y * (side + 1u);
    var sum = 0.0;
    for (var i = id.x - k; i <= id.x + k; i++) {
        sum += line_sums[line + i];
    }
    smoothed[to + id.x] = sum / f32(2u * k + 1u);
}

// What is shown of it.

// Of rows and columns, as `sum` left them.
var<storage, read> row_sums: array<f32>;
var<storage, read> column_sums: array<f32>;
var<storage, read> moved_counts: array<u32>;

// Offsets: yellow to the right or down, blue to the left or up; strongest at a quarter of the map. Left before smoothing,
// right after.
fn offsets(pixel: vec2u, of_columns: bool) -> f32 {
    let at = square_place(vec2f(pixel) + 0.5);
    let after = at.x >= 1.0;
    let u = select(at, at - vec2f(1.0, 0.0), after);
    if any(u < vec2f(0.0)) || any(u >= vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    let texel = vec2u(u * map_side());
    let line = select(texel.y, texel.x, of_columns);
    let edge = select(texel.x, texel.y, of_columns);
    let first = line_start(line);
    let place = first + edge;
    var x = f32(edge) / map_side();
    let plain = x;
    if after {
        if of_columns {
            x = columns[place];
        } else {
            x = rows[place];
        }
    } else if of_columns {
        let all = column_sums[first + u32(map_side())];
        x = select(plain, column_sums[place] / all, all > 0.0);
    } else {
        let all = row_sums[first + u32(map_side())];
        x = select(plain, row_sums[place] / all, all > 0.0);
    }
    let offset = 4.0 * (x - plain);
    return drawn(select(4u, 1u, offset > 0.0), sqrt(abs(offset)));
}

// Counts between the rows' warp and the columns', in the middle of the picture; -1 beside.
fn between_counts(pixel: vec2u) -> f32 {
    let size = vec2f(frame.size);
    let scale = map_side() * max(1.0 / size.x, 1.0 / size.y);
    let middle = (vec2f(pixel) + 0.5 - 0.5 * size) * scale + 0.5 * map_side();
    if any(middle < vec2f(0.0)) || any(middle >= vec2f(map_side())) {
        return -1.0;
    }
    let steps = u32(clamp(ceil(scale), 1.0, 16.0));
    var sum = 0.0;
    for (var i = 0u; i < steps * steps; i++) {
        let off = ((vec2f(vec2u(i % steps, i / steps)) + 0.5) / f32(steps) - 0.5) * select(0.0, scale, steps > 1u);
        let texel = vec2u(clamp(middle + off, vec2f(0.0), vec2f(map_side() - 1.0)));
        sum += f32(moved_counts[texels_of_layer(arrayLength(&moved_counts)) + texel.x * u32(map_side()) + texel.y]);
    }
    return sum / f32(steps * steps);
}

// Texels by their view samples: none, then in half octaves from one on. Before the warps, between them, after both.
const occupancy_bins = 20u;
var<storage, read_write> occupancy: array<atomic<u32>, 20>;
var<uniform> occupancies: array<vec4u, 15>;

// Counts view samples by their texels after both warps.
@compute @workgroup_size(8, 8)
fn count_after(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if !s.valid {
        return;
    }
    let texel = map_texel(light_view, light_clip(light_view, s.position));
    if all(texel >= vec2f(0.0)) && all(texel <= vec2f(map_side())) {
        let cell = min(vec2u(texel), vec2u(u32(map_side()) - 1u));
        atomicAdd(&moved[cell.y * u32(map_side()) + cell.x], 1u);
    }
}

@compute @workgroup_size(64)
fn occupy(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    if light_view.idle != 0u || id.x >= u32(map_side()) {
        return;
    }
    let n = samples[texels_of_layer(arrayLength(&samples)) + id.y * u32(map_side()) + id.x];
    atomicAdd(&occupancy[select(0u, min(1u + u32(2.0 * log2(f32(n)) + 1e-3), occupancy_bins - 1u), n > 0u)], 1u);
}

fn occupied(part: u32, bin: u32) -> u32 {
    let i = part * occupancy_bins + bin;
    return occupancies[i / 4u][i % 4u];
}

// Bars of three colours for each number of samples; heights are roots of the texels' shares.
fn histogram(pixel: vec2u) -> f32 {
    let at = ((vec2f(pixel) + 0.5) / vec2f(frame.size) - 0.05) / 0.9;
    if any(at < vec2f(0.0)) || any(at >= vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    let place = at.x * f32(occupancy_bins);
    let part = u32(fract(place) * 4.0);
    if part > 2u {
        return drawn(white, 0.0);
    }
    var all = 0u;
    for (var i = 0u; i < occupancy_bins; i++) {
        all += occupied(part, i);
    }
    let share = f32(occupied(part, u32(place))) / f32(max(all, 1u));
    let color = array<u32, 3>(7u, 3u, 1u)[part];
    return drawn(color, select(0.04, 0.9, 1.0 - at.y <= sqrt(share)));
}

fn inspect_warp(s: Surface) -> f32 {
    switch frame.map {
        case shows_occupancy: {
            return histogram(s.pixel);
        }
        case shows_counts_between: {
            return between_counts(s.pixel);
        }
        case shows_row_offsets, shows_column_offsets: {
            return offsets(s.pixel, frame.map == shows_column_offsets);
        }
        default: {
            return -1.0;
        }
    }
}
