//!include map/warp/warped.wgsl
// Rosen 2012: rows and columns of the map are as wide as the most important thing in them asks. The importance map covers
// the light's image before the warp, with a number of bins per side of its own; axis 0 is x, axis 1 is y. Includers write
//     fn edges_at_pixels() -> bool   whether shadow edges are found in the camera's picture

var<uniform> rtw: RtwParams;
// Where the edges between bins go, shares of the map's side: bins + 1 for x, then for y; layer after layer.
var<storage, read> warps: array<f32>;

fn pieces_a_side() -> u32 {
    return bins();
}

// The first edge of an axis in the layer that is followed.
fn axis_start(axis: u32) -> u32 {
    return (2u * warped_layer + axis) * (bins() + 1u);
}

fn warp_bends() -> f32 {
    return f32(pieces_a_side());
}

// Place on an axis after the warp, and how fast it moves.
fn axis_warp(x: f32, axis: u32) -> vec2f {
    let number = pieces_a_side();
    let t = x * f32(number);
    let i = min(u32(t), number - 1u);
    let at = axis_start(axis) + i;
    let low = warps[at];
    let high = warps[at + 1u];
    return vec2f(mix(low, high, t - f32(i)), (high - low) * f32(number));
}

fn warp(u: vec2f) -> vec2f {
    return vec2f(axis_warp(u.x, 0u).x, axis_warp(u.y, 1u).x);
}

fn warp_slope(u: vec2f) -> mat2x2f {
    return mat2x2f(vec2f(axis_warp(u.x, 0u).y, 0.0), vec2f(0.0, axis_warp(u.y, 1u).y));
}

fn axis_unwarp(at: f32, axis: u32) -> f32 {
    let number = pieces_a_side();
    let first = axis_start(axis);
    var low = 0u;
    var high = number - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if warps[first + middle + 1u] < at {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let start = warps[first + low];
    return (f32(low) + saturate((at - start) / max(warps[first + low + 1u] - start, 1e-12))) / f32(number);
}

fn unwarp(at: vec2f) -> vec2f {
    return vec2f(axis_unwarp(at.x, 0u), axis_unwarp(at.y, 1u));
}

// The importance map.

// Bins a side, as in Rust.
fn bins() -> u32 {
    return min(rtw.importance_bins, u32(map_side()));
}

// Where the layer's part begins of the importance maps, of the profiles and of the blurred ones.
fn map_start() -> u32 {
    return warped_layer * bins() * bins();
}

fn profiles_start() -> u32 {
    return warped_layer * (2u * bins() + 1u);
}

fn blurred_start() -> u32 {
    return warped_layer * 2u * bins();
}

// Importance, as the bits of floats that are never negative: rows from the top.
var<storage, read_write> importance: array<atomic<u32>>;

// How terms are put together: start and step.
fn nothing_yet() -> f32 {
    return select(0.0, 1.0, rtw.combine == combine_product);
}

fn with_term(sum: f32, on: bool, term: f32) -> f32 {
    switch select(3u, rtw.combine, on) {
        case combine_product: {
            return sum * term;
        }
        case combine_max: {
            return max(sum, term);
        }
        case combine_sum: {
            return sum + term;
        }
        default: {
            return sum;
        }
    }
}

// Whether nothing at all is important, and so nothing is moved.
fn has_no_term() -> bool {
    return !has_camera_term() && rtw.shadow_edge == 0u;
}

fn has_camera_term() -> bool {
    return rtw.desired_view != 0u || rtw.distance_to_eye != 0u || rtw.surface_normal != 0u;
}

// How far from the eye anything in view can be, metres: the scene's farthest corner or the camera's.
fn farthest() -> f32 {
    let scene = length(max(abs(frame.bounds_min - frame.eye), abs(frame.bounds_max - frame.eye)));
    let view = frame.far * length(pixel_ray(vec2f(0.0)));
    return max(min(scene, view), 1e-6);
}

fn near_share(position: vec3f) -> f32 {
    // Before an orthographic camera nothing is nearer than another.
    if frame.orthographic == 1u {
        return 1.0;
    }
    let d = distance(position, frame.eye);
    if rtw.falloff == falloff_inverse {
        return min(frame.near / max(d, 1e-6), 1.0);
    }
    return 1.0 - pow(min(d / farthest(), 1.0), rtw.power);
}

// The terms that the camera decides; `seen`: the desired view holds the position.
fn camera_terms(position: vec3f, normal: vec3f, seen: bool) -> f32 {
    let facing = max(dot(normal, normalize(to_eye(position))), 0.0);
    var sum = with_term(nothing_yet(), rtw.desired_view != 0u, select(0.0, 1.0, seen));
    sum = with_term(sum, rtw.distance_to_eye != 0u, near_share(position));
    return with_term(sum, rtw.surface_normal != 0u, 1.0 + rtw.normal_weight * facing);
}

fn edge_term(edge: bool) -> f32 {
    return 1.0 + select(0.0, rtw.edge_weight, edge);
}

// The cosine from which two neighbouring pixels' normals make an edge.
const bent = 0.866;

// Whether a neighbouring pixel lies off this surface's plane, or is turned away from it.
fn pixel_edge(s: Surface) -> bool {
    let sides = array<vec2i, 4>(vec2i(-1, 0), vec2i(1, 0), vec2i(0, -1), vec2i(0, 1));
    for (var i = 0u; i < 4u; i++) {
        let pixel = vec2i(s.pixel) + sides[i];
        if any(pixel < vec2i(0)) || any(pixel >= vec2i(frame.size)) {
            continue;
        }
        let other = load_surface(vec2u(pixel));
        // A plane's depth changes fast where the camera grazes it: what counts is how far a pixel is off it.
        if !other.valid || abs(dot(s.normal, other.position - s.position)) > rtw.edge_threshold * distance_at(s.depth) || dot(s.normal, other.normal) < bent {
            return true;
        }
    }
    return false;
}

// Backward analysis, and the camera's side of hybrid: each view sample puts its importance into its bin.
@compute @workgroup_size(8, 8)
fn importance_of_samples(@builtin(global_invocation_id) id: vec3u) {
    let s = view_sample(id.xy);
    if has_no_term() || !s.valid {
        return;
    }
    let u = unwarped_place(s.position).xy;
    if !(all(u >= vec2f(0.0)) && all(u <= vec2f(1.0))) {
        return;
    }
    var sum = camera_terms(s.position, s.normal, true);
    if edges_at_pixels() && rtw.shadow_edge != 0u {
        sum = with_term(sum, true, edge_term(pixel_edge(s)));
    }
    let bin = min(vec2u(u * f32(bins())), vec2u(bins() - 1u));
    atomicMax(&importance[map_start() + bin.y * bins() + bin.x], bitcast<u32>(max(sum, 0.0)));
}

// From the map to the warps.

// The largest of each column, then of each row, then of all; bits as in `importance`.
var<storage, read_write> profiles: array<atomic<u32>>;

// A workgroup takes 64 × 64 bins: each thread a column of them, then a row.
@compute @workgroup_size(64)
fn collapse(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) index: u32) {
    follow(light_view);
    if light_view.idle != 0u {
        return;
    }
    let n = bins();
    let start = map_start();
    let to = profiles_start();
    let first = group.xy * 64u;
    let end = min(first + 64u, vec2u(n));
    let own = first + index;
    var most = vec2u(0u);
    if own.x < n {
        for (var y = first.y; y < end.y; y++) {
            most.x = max(most.x, atomicLoad(&importance[start + y * n + own.x]));
        }
        if most.x > 0u {
            atomicMax(&profiles[to + own.x], most.x);
            atomicMax(&profiles[to + 2u * n], most.x);
        }
    }
    if own.y < n {
        for (var x = first.x; x < end.x; x++) {
            most.y = max(most.y, atomicLoad(&importance[start + own.y * n + x]));
        }
        if most.y > 0u {
            atomicMax(&profiles[to + n + own.y], most.y);
        }
    }
}

var<storage, read> raw: array<f32>;
var<storage, read_write> blurred: array<f32>;

// A Gaussian along each axis; at the ends only what lies inside counts, and counts in full.
@compute @workgroup_size(64)
fn blur(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    let n = i32(bins());
    let own = i32(id.x);
    if light_view.idle != 0u || own >= n {
        return;
    }
    let first = i32(profiles_start()) + i32(id.y) * n;
    let to = i32(blurred_start()) + i32(id.y) * n;
    let reach = i32(ceil(3.0 * rtw.profile_blur));
    let falloff = -0.5 / max(rtw.profile_blur * rtw.profile_blur, 1e-12);
    var sum = 0.0;
    var all = 0.0;
    for (var i = max(own - reach, 0); i <= min(own + reach, n - 1); i++) {
        let d = f32(i - own);
        let weight = exp(falloff * d * d);
        sum += weight * raw[first + i];
        all += weight;
    }
    blurred[to + own] = sum / all;
}

var<storage, read> smooth_profiles: array<f32>;
var<storage, read_write> edges: array<f32>;

var<workgroup> chunks: array<u32, 256>;
var<workgroup> peaks: array<f32, 256>;

// A bin's width in whole parts of 2^31 / bins: whole numbers add up exactly, whatever their order, so edges always rise.
fn parts(value: f32, peak: f32) -> u32 {
    let n = f32(bins());
    // A flatter warp would not survive the 24 bits of a place.
    let least = max(rtw.floor, 1e-6 * n);
    return max(u32((value / peak + least) / (1.0 + least) * (2147483648.0 / n)), 1u);
}

// Prefix sums with a floor: a workgroup an axis. Without any importance nothing is moved.
@compute @workgroup_size(256)
fn sum_up(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) index: u32) {
    follow(light_view);
    let n = bins();
    let profile = blurred_start() + group.x * n;
    let chunk = (n + 255u) / 256u;
    let start = min(index * chunk, n);
    let end = min(start + chunk, n);
    var own_peak = 0.0;
    for (var i = start; i < end; i++) {
        own_peak = max(own_peak, smooth_profiles[profile + i]);
    }
    peaks[index] = own_peak;
    workgroupBarrier();
    var peak = 0.0;
    for (var k = 0u; k < 256u; k++) {
        peak = max(peak, peaks[k]);
    }
    var own = 0u;
    for (var i = start; i < end; i++) {
        own += parts(smooth_profiles[profile + i], peak);
    }
    chunks[index] = own;
    workgroupBarrier();
    var before = 0u;
    var all = 0u;
    for (var k = 0u; k < 256u; k++) {
        before += select(0u, chunks[k], k < index);
        all += chunks[k];
    }
    let first = axis_start(group.x);
    if index == 0u {
        edges[first] = 0.0;
    }
    for (var i = start; i < end; i++) {
        before += parts(smooth_profiles[profile + i], peak);
        edges[first + i + 1u] = select(f32(i + 1u) / f32(n), f32(before) / f32(all), peak > 0.0);
    }
}

// What is shown of it.

var<storage, read> importance_map: array<f32>;

fn largest() -> f32 {
    return max(raw[profiles_start() + 2u * bins()], 1e-30);
}

// The most important bin that a pixel of the picture covers, `half` to each side of `u`.
fn most_important(u: vec2f, half: vec2f) -> f32 {
    let n = f32(bins());
    let low = vec2u(clamp((u - half) * n, vec2f(0.0), vec2f(n - 1.0)));
    let high = min(vec2u(clamp((u + half) * n, vec2f(0.0), vec2f(n - 1.0))), low + 15u);
    var most = 0.0;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            most = max(most, importance_map[map_start() + y * bins() + x]);
        }
    }
    return most;
}

// Half a picture's pixel in the squares of `square_place`.
fn half_pixel() -> f32 {
    let size = vec2f(frame.size);
    return 0.5 * max(2.08 / size.x, 1.04 / size.y);
}

// The place before the warp that a pixel of the two squares shows, and half of what it covers there; x < 0: none.
fn shown_place(pixel: vec2u) -> vec4f {
    let at = square_place(vec2f(pixel) + 0.5);
    let right = at.x >= 1.0;
    let place = select(at, at - vec2f(1.0, 0.0), right);
    if any(place < vec2f(0.0)) || any(place >= vec2f(1.0)) {
        return vec4f(-1.0);
    }
    var u = place;
    var half = vec2f(half_pixel());
    if right {
        u = unwarp(place);
        let slope = warp_slope(u);
        half /= vec2f(slope[0].x, slope[1].y);
    }
    return vec4f(u, half);
}

fn importance_picture(pixel: vec2u) -> f32 {
    let u = shown_place(pixel);
    if u.x < 0.0 {
        return drawn(white, 0.0);
    }
    let share = most_important(u.xy, u.zw) / largest();
    return select(drawn(4u, 0.45), drawn(1u, 0.15 + 0.85 * share), share > 0.0);
}

// Bins that matter to nobody and yet have more texels than without the warp: the other corners of the cross product.
fn dense_picture(pixel: vec2u) -> f32 {
    let u = shown_place(pixel);
    if u.x < 0.0 {
        return drawn(white, 0.0);
    }
    let share = most_important(u.xy, u.zw) / largest();
    let slope = warp_slope(u.xy);
    let octaves = log2(slope[0].x * slope[1].y);
    if share > 0.0 {
        return drawn(1u, 0.15 + 0.85 * share);
    }
    return select(drawn(7u, 0.25), drawn(4u, 0.35 + 0.15 * octaves), octaves > 0.0);
}

// Whether a curve between two heights passes a pixel of this height.
fn passes(height: f32, a: f32, b: f32, half: f32) -> bool {
    return height >= min(a, b) - half && height <= max(a, b) + half;
}

// The profile of x on the left and of y on the right: grey before the blur, orange after it, blue the warp.
fn profile_picture(pixel: vec2u) -> f32 {
    let at = square_place(vec2f(pixel) + 0.5);
    let axis = select(0u, 1u, at.x >= 1.0);
    let x = at.x - f32(axis);
    let height = 1.0 - at.y;
    let half = half_pixel();
    if x < 0.0 || x >= 1.0 || height < 0.0 || height > 1.0 {
        return drawn(white, 0.0);
    }
    // A line between the two.
    if min(x, 1.0 - x) < half {
        return drawn(white, 0.25);
    }
    let n = f32(bins());
    let from_x = saturate(x - half);
    let to_x = saturate(x + half);
    let wide = max(1.5 * half, f32(frame.size.y) / 1000.0 * half);
    if passes(height, axis_warp(from_x, axis).x, axis_warp(to_x, axis).x, wide) {
        return drawn(3u, 1.0);
    }
    let first = u32(clamp(from_x * n, 0.0, n - 1.0));
    let last = min(u32(clamp(to_x * n, 0.0, n - 1.0)), first + 63u);
    let start = blurred_start() + axis * bins();
    let raw_start = profiles_start() + axis * bins();
    let next = min(last + 1u, bins() - 1u);
    let after = smooth_profiles[start + first] / largest();
    let beyond = smooth_profiles[start + next] / largest();
    if passes(height, after, beyond, wide) {
        return drawn(6u, 1.0);
    }
    var most = 0.0;
    for (var i = first; i <= last; i++) {
        most = max(most, raw[raw_start + i]);
    }
    if height <= most / largest() {
        return drawn(white, 0.45);
    }
    // Without a warp.
    return drawn(white, select(0.0, 0.25, passes(height, from_x, to_x, half)));
}

fn inspect_warp(s: Surface) -> f32 {
    switch frame.map {
        case shows_importance: {
            return importance_picture(s.pixel);
        }
        case shows_profiles: {
            return profile_picture(s.pixel);
        }
        case shows_over_dense: {
            return dense_picture(s.pixel);
        }
        default: {
            return -1.0;
        }
    }
}
