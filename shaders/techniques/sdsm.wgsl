//!include map/choose/cascades.wgsl
//!include map/depth_range.wgsl
// Lauritzen, Salvi, Lefohn 2011: cascades placed by where the view samples are.

var<uniform> sdsm: SdsmParams;
// Samples by the logarithm of their depth; last the fullest bin's number.
var<storage, read_write> bins: array<atomic<u32>, 1025>;
// `splits`, to be written: on entry the last frame's, or 0.
var<storage, read_write> parts: array<f32>;
var<storage, read_write> boxes: array<Box>;

const bin_count = 1024u;

// As in cascades.wgsl.
struct Box {
    low: vec2f,
    high: vec2f,
    last_low: vec2f,
    last_high: vec2f,
}

// Where a depth lies in the histogram, bins from its start. Without a perspective there is no reason for a logarithm.
fn bin_of(z: f32, range: vec2f) -> f32 {
    if frame.shadow_orthographic == 1u {
        return f32(bin_count) * (z - range.x) / max(range.y - range.x, 1e-6 * range.y);
    }
    return f32(bin_count) * log(z / range.x) / max(log(range.y / range.x), 1e-6);
}

fn depth_of_bin(bin: f32, range: vec2f) -> f32 {
    if frame.shadow_orthographic == 1u {
        return mix(range.x, range.y, bin / f32(bin_count));
    }
    return range.x * pow(range.y / range.x, bin / f32(bin_count));
}

var<workgroup> tile_bins: array<atomic<u32>, 1024>;

@compute @workgroup_size(8, 8)
fn fill_bins(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u,
             @builtin(local_invocation_index) index: u32) {
    let range = depth_range();
    for (var k = 0u; k < 64u; k++) {
        let z = lit_sample(group.xy * 64u + vec2u(k % 8u, k / 8u) * 8u + local.xy).w;
        if z > 0.0 {
            atomicAdd(&tile_bins[u32(clamp(bin_of(z, range), 0.0, f32(bin_count) - 1.0))], 1u);
        }
    }
    workgroupBarrier();
    for (var i = index; i < bin_count; i += 64u) {
        let n = atomicLoad(&tile_bins[i]);
        if n > 0u {
            atomicAdd(&bins[i], n);
        }
    }
}

// Sums of the bins before each: samples, and share × place of the bin's middle.
var<workgroup> before: array<u32, 1025>;
var<workgroup> moment: array<f32, 1025>;

// The place, in bins, before which that share of the samples lies.
fn quantile(share: f32) -> f32 {
    let wanted = share * f32(before[bin_count]);
    var low = 0u;
    var high = bin_count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if f32(before[middle + 1u]) < wanted {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let n = f32(before[low + 1u] - before[low]);
    return f32(low) + saturate((wanted - f32(before[low])) / max(n, 1.0));
}

@compute @workgroup_size(256)
fn place_splits(@builtin(local_invocation_index) index: u32) {
    for (var i = index; i < bin_count; i += 256u) {
        before[i + 1u] = atomicLoad(&bins[i]);
    }
    workgroupBarrier();
    if index > 0u {
        return;
    }
    let count = fitting.count;
    let range = depth_range();
    if range.x <= 0.0 {
        // Nothing to look up: any rising numbers serve.
        for (var i = 0u; i <= count; i++) {
            parts[i] = frame.near + f32(i);
        }
        return;
    }
    var fullest = 0u;
    for (var i = 0u; i < bin_count; i++) {
        let n = before[i + 1u];
        fullest = max(fullest, n);
        before[i + 1u] += before[i];
        moment[i + 1u] = moment[i] + f32(n) / f32(frame.size.x * frame.size.y) * (f32(i) + 0.5);
    }
    atomicStore(&bins[bin_count], fullest);
    var places: array<f32, 9>;
    for (var i = 0u; i <= count; i++) {
        let share = f32(i) / f32(count);
        places[i] = f32(bin_count) * share;
        if sdsm.scheme == scheme_adaptive_log {
            places[i] = quantile(share);
        }
    }
    if sdsm.scheme == scheme_kmeans {
        // Lloyd 1982, in one dimension: means of the logarithm, and boundaries halfway.
        var means: array<f32, 8>;
        for (var i = 0u; i < count; i++) {
            means[i] = quantile((f32(i) + 0.5) / f32(count));
        }
        for (var k = 0u; k < 8u; k++) {
            for (var i = 1u; i < count; i++) {
                places[i] = 0.5 * (means[i - 1u] + means[i]);
            }
            for (var i = 0u; i < count; i++) {
                let first = u32(round(places[i]));
                let to = u32(round(places[i + 1u]));
                let n = before[to] - before[first];
                if n > 0u {
                    means[i] = (moment[to] - moment[first]) * f32(frame.size.x * frame.size.y) / f32(n);
                }
            }
        }
        for (var i = 1u; i < count; i++) {
            places[i] = 0.5 * (means[i - 1u] + means[i]);
        }
    }
    let restart = parts[count] <= 0.0;
    for (var i = 0u; i <= count; i++) {
        let z = depth_of_bin(places[i], range);
        let inner = i > 0u && i < count;
        parts[i] = select(z, clamp(mix(z, parts[i], fitting.smoothing), range.x, range.y), inner && !restart);
    }
}

// Samples by depth, near at the left on a logarithmic axis; bars' heights are roots of the numbers. Split lines white.
fn histogram(pixel: vec2u) -> f32 {
    let range = depth_range();
    let size = vec2f(frame.size);
    let at = ((vec2f(pixel) + 0.5) / size - 0.05) / 0.9;
    if any(at < vec2f(0.0)) || any(at > vec2f(1.0)) || range.x <= 0.0 {
        return drawn(white, 0.0);
    }
    for (var i = 0u; i <= fitting.count; i++) {
        if abs(bin_of(split(i), range) / f32(bin_count) - at.x) * size.x * 0.9 < 0.75 {
            return drawn(white, 0.9);
        }
    }
    // As many bins as the pixel covers: the fullest.
    let width = f32(bin_count) / (0.9 * size.x);
    let first = u32(clamp(at.x * f32(bin_count) - 0.5 * width, 0.0, f32(bin_count) - 1.0));
    var n = 0u;
    for (var i = first; i <= min(first + u32(width), bin_count - 1u); i++) {
        n = max(n, atomicLoad(&bins[i]));
    }
    let height = sqrt(f32(n) / max(f32(atomicLoad(&bins[bin_count])), 1.0));
    let i = cascade_of(depth_of_bin(at.x * f32(bin_count), range));
    return drawn(i, select(0.12, 0.85, 1.0 - at.y <= height));
}

fn near_edge(at: vec2f, low: vec2f, high: vec2f, width: f32) -> bool {
    let inner = all(at > low + width) && all(at < high - width);
    return all(at >= low - width) && all(at <= high + width) && !inner;
}

// The light's view with the boxes of the samples: this frame's strong, the last frame's grey where they differ.
fn plan(pixel: vec2u) -> f32 {
    let v = light_view;
    // Under a spot light at a depth of 1 m.
    let metres = 2.0 / scale_of(v);
    var low = vec2f(1.0);
    var high = vec2f(0.0);
    for (var i = 0u; i < fitting.count; i++) {
        let b = boxes[i];
        if all(b.high > b.low) {
            low = min(low, b.low);
            high = max(high, b.high);
        }
    }
    if any(high <= low) {
        return drawn(white, 0.0);
    }
    let size = vec2f(frame.size);
    let across = (high - low) * metres;
    let scale = 1.08 * max(across.x / size.x, across.y / size.y);
    let offset = (vec2f(pixel) + 0.5 - 0.5 * size) * vec2f(scale, -scale);
    let uv = 0.5 * (low + high) + offset / metres;
    for (var i = 0u; i < fitting.count; i++) {
        let b = boxes[i];
        if all(b.high > b.low) && near_edge(uv * metres, b.low * metres, b.high * metres, scale) {
            return drawn(i, 1.0);
        }
    }
    for (var i = 0u; i < fitting.count; i++) {
        let b = boxes[i];
        if all(b.last_high > b.last_low) && near_edge(uv * metres, b.last_low * metres, b.last_high * metres, 0.5 * scale) {
            return drawn(white, 0.5);
        }
    }
    // Beneath, what the finest map there holds.
    let origin = select(vec3f(0.0), frame.light_position + v.axis.xyz, v.perspective == 1u);
    let ndc = 2.0 * uv - 1.0 - vec2f(dot(v.row_x, vec4f(origin, 1.0)), dot(v.row_y, vec4f(origin, 1.0)));
    let p = origin + v.row_x.xyz * (ndc.x / dot(v.row_x.xyz, v.row_x.xyz)) + v.row_y.xyz * (ndc.y / dot(v.row_y.xyz, v.row_y.xyz));
    for (var i = 0u; i < fitting.count; i++) {
        let b = boxes[i];
        if all(uv > b.low) && all(uv < b.high) {
            let texel = light_texel(light_views[i], light_clip(light_views[i], p));
            return drawn(white, 0.1 + 0.6 * nearness(i, vec2u(texel)));
        }
    }
    return drawn(white, 0.0);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_histogram {
        return histogram(s.pixel);
    }
    if frame.map == shows_boxes {
        return plan(s.pixel);
    }
    return inspect_cascades(s);
}
