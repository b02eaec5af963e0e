//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include map/splits.wgsl
//!include map/culling.wgsl
// What cascades share: the view samples of each, their boxes in the light's view, and the triangles drawn into each.
// `light_view` is the whole scene's.

const most_cascades = 8u;
const words = 8u;
const no_samples = 7u;

// Of each cascade: largest u, v, 1 - u, 1 - v, depth share and 1 - depth share of its samples, as the bits of floats in
// [0, 1]; then a word of nothing, and the number of samples.
var<storage, read_write> extents: array<atomic<u32>, 64>;

var<workgroup> tile: array<atomic<u32>, 64>;

// Samples of one cascade.
struct Gathered {
    // u, v, 1 - u, 1 - v.
    most: vec4f,
    // Depth in the light's view, and its complement.
    share: vec2f,
    number: u32,
}

fn keep(i: u32, g: Gathered) {
    if g.number == 0u {
        return;
    }
    let at = i * words;
    for (var k = 0u; k < 4u; k++) {
        // abs: a negative zero's bits are the largest of all.
        atomicMax(&tile[at + k], bitcast<u32>(abs(g.most[k])));
    }
    atomicMax(&tile[at + 4u], bitcast<u32>(abs(g.share.x)));
    atomicMax(&tile[at + 5u], bitcast<u32>(abs(g.share.y)));
    atomicAdd(&tile[at + no_samples], g.number);
}

// Tells the cascades that have samples, where nothing else is asked of them. A workgroup takes 64 × 64 pixels.
@compute @workgroup_size(8, 8)
fn mark(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    var used = 0u;
    for (var k = 0u; k < 64u; k++) {
        let p = lit_sample(group.xy * 64u + vec2u(k % 8u, k / 8u) * 8u + local.xy);
        if p.w > 0.0 {
            let i = cascade_of(p.w);
            used |= select(1u, 3u, blend_of(p.w, i) > 0.0) << i;
        }
    }
    for (var i = 0u; i < fitting.count; i++) {
        if (used >> i & 1u) == 1u {
            atomicMax(&extents[i * words + no_samples], 1u);
        }
    }
}

// A workgroup takes 64 × 64 pixels. A thread's pixels mostly lie in one cascade: few atomics.
@compute @workgroup_size(8, 8)
fn gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u,
          @builtin(local_invocation_index) index: u32) {
    let v = light_view;
    var held = 0u;
    var gathered = Gathered();
    for (var k = 0u; k < 64u; k++) {
        let p = lit_sample(group.xy * 64u + vec2u(k % 8u, k / 8u) * 8u + local.xy);
        if p.w <= 0.0 {
            continue;
        }
        let clip = light_clip(v, p.xyz);
        let uv = saturate(0.5 + 0.5 * clip.xy / clip.w);
        let depth = saturate((dot(v.axis, vec4f(p.xyz, 1.0)) - v.near) / (v.far - v.near));
        let share = vec2f(depth, 1.0 - depth);
        let i = cascade_of(p.w);
        let sides = vec4f(uv, 1.0 - uv);
        if i != held {
            keep(held, gathered);
            held = i;
            gathered = Gathered();
        }
        gathered = Gathered(max(gathered.most, sides), max(gathered.share, share), gathered.number + 1u);
        if blend_of(p.w, i) > 0.0 {
            keep(i + 1u, Gathered(sides, share, 1u));
        }
    }
    keep(held, gathered);
    workgroupBarrier();
    let value = atomicLoad(&tile[index]);
    if value > 0u {
        if index % words == no_samples {
            atomicAdd(&extents[index], value);
        } else {
            atomicMax(&extents[index], value);
        }
    }
}

// A cascade's box in the whole view, shares of its sides: this frame's and the last one's. high ≤ low: none.
struct Box {
    low: vec2f,
    high: vec2f,
    last_low: vec2f,
    last_high: vec2f,
}

var<storage, read_write> boxes: array<Box>;
var<storage, read_write> fitted: array<LightView>;
// Indexed indirect draws, opaque and masked for each cascade: index count, instances, first index, base vertex, first
// instance.
var<storage, read_write> draws: array<atomic<u32>>;

fn extent_of(at: u32) -> f32 {
    return bitcast<f32>(atomicLoad(&extents[at]));
}

// One thread a cascade.
@compute @workgroup_size(8)
fn fit(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let at = i * words;
    // A cascade without samples draws nothing.
    let used = i < fitting.count && atomicLoad(&extents[at + no_samples]) > 0u;
    let region = select(0u, i * fitting.triangles * 3u, fitting.culled != 0u);
    for (var masked = 0u; masked < 2u; masked++) {
        let draw = (2u * i + masked) * 5u;
        let count = select(fitting.opaque, fitting.triangles - fitting.opaque, masked == 1u) * 3u;
        atomicStore(&draws[draw], select(count, 0u, !used || fitting.culled != 0u));
        atomicStore(&draws[draw + 1u], u32(used));
        atomicStore(&draws[draw + 2u], region + select(0u, fitting.opaque * 3u, masked == 1u));
        atomicStore(&draws[draw + 3u], 0u);
        atomicStore(&draws[draw + 4u], 0u);
    }
    if i >= fitting.count || fitting.narrow == 0u {
        return;
    }
    var b = boxes[i];
    b.last_low = b.low;
    b.last_high = b.high;
    var v = light_view;
    v.resolution = f32(fitting.sides[i / 4u][i % 4u]);
    if !used {
        boxes[i] = Box(vec2f(0.0), vec2f(0.0), b.last_low, b.last_high);
        fitted[i] = v;
        return;
    }
    b.high = vec2f(extent_of(at), extent_of(at + 1u));
    b.low = 1.0 - vec2f(extent_of(at + 2u), extent_of(at + 3u));
    if fitting.smoothing > 0.0 && all(b.last_high > b.last_low) {
        // It grows at once, since it must hold all samples, and shrinks slowly.
        b.low = min(b.low, mix(b.low, b.last_low, fitting.smoothing));
        b.high = max(b.high, mix(b.high, b.last_high, fitting.smoothing));
    }
    boxes[i] = b;
    // A metre's share of a spot light's view is largest at the sample nearest to it.
    let nearest = mix(v.far, v.near, extent_of(at + 5u));
    let metres = 2.0 / scale_of(v) * select(1.0, nearest, v.perspective == 1u);
    let reach = min(2.0 * fitting.reach / metres, vec2f(1.0));
    let grown = (b.high - b.low + reach) * v.resolution / max(v.resolution - 2.0 * fitting.margin, 1.0);
    let half = max(0.5 * grown, max(0.5 * fitting.least / metres, vec2f(1e-6)));
    let center = b.low + b.high - 1.0;
    v.row_x = (v.row_x - center.x * v.row_w) * (0.5 / half.x);
    v.row_y = (v.row_y - center.y * v.row_w) * (0.5 / half.y);
    let fine = scale_of(v);
    v.texel = 2.0 / (v.resolution * min(fine.x, fine.y));
    // Casters are kept from the light on; beyond the last receiver nothing matters.
    let share = extent_of(at + 4u);
    v.far = min(v.near + max(share * 1.0001 + 1e-5, 1e-4) * (v.far - v.near), v.far);
    v.row_z = (vec4f(0.0, 0.0, 0.0, v.far) - v.axis) * select(1.0, v.near, v.perspective == 1u) / (v.far - v.near);
    fitted[i] = v;
}

var<storage, read_write> indices: array<u32>;
// Three corners a triangle, as casters are drawn.
var<storage, read> corners_of: array<u32>;

// One thread per triangle: goes to each cascade whose box, swept towards the light, it may touch, unless it slips between
// the texels' centres.
@compute @workgroup_size(64)
fn cull(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * row + id.x;
    if index >= fitting.triangles {
        return;
    }
    let t = vec3u(corners_of[3u * index], corners_of[3u * index + 1u], corners_of[3u * index + 2u]);
    let p = vertex_position(t.x);
    let q = vertex_position(t.y);
    let r = vertex_position(t.z);
    let masked = u32(index >= fitting.opaque);
    for (var i = 0u; i < fitting.count; i++) {
        let draw = (2u * i + masked) * 5u;
        if atomicLoad(&draws[draw + 1u]) == 0u || !touches(light_views[i], p, q, r) {
            continue;
        }
        let at = 3u * (i * fitting.triangles + masked * fitting.opaque) + atomicAdd(&draws[draw], 3u);
        indices[at] = t.x;
        indices[at + 1u] = t.y;
        indices[at + 2u] = t.z;
    }
}
