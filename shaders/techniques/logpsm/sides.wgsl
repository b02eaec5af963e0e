//!include map/warp/warped.wgsl
//!include map/warp/logarithm.wgsl
//!include map/warp/extents.wgsl
//!include map/tiles.wgsl
//!include map/choose/whole_layers.wgsl
// A map for each side of the view's frustum, with a logarithm along it.

struct Sides {
    count: u32,
    // A surface belongs to the side of whose row dot(row, (X, 1)) is the largest. Of sides that are not there it is that of none, so that no
    // branch need ask for their number.
    rows: array<vec4f, most_layers>,
    // The way along each face with a depth of 1 m; 0: the face lies at one depth.
    along: array<vec4f, most_layers>,
}

var<uniform> sides: Sides;
// k and ln of each side.
var<uniform> shapes: array<vec4f, most_layers>;
var<storage, read_write> made_shapes: array<vec4f, most_layers>;
var<storage, read_write> fitted: array<LightView, most_layers>;

fn shape() -> Shape {
    let s = shapes[warped_layer];
    return Shape(s.x, s.y);
}

fn layer_of(position: vec3f) -> u32 {
    var best = 0u;
    for (var i = 1u; i < most_layers; i++) {
        best = select(best, i, dot(sides.rows[i], vec4f(position, 1.0)) > dot(sides.rows[best], vec4f(position, 1.0)));
    }
    return best;
}

fn in_layer(position: vec3f) -> bool {
    return layer_of(position) == light_view.layer;
}

// Each view narrowed to its receivers, the logarithm along it, and the margin: a thread a side.
@compute @workgroup_size(8)
fn fit_sides(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    var v = light_views[i];
    v.layer = i;
    v.idle = u32(i >= sides.count || !has_samples(i));
    if v.idle == 0u {
        v = narrowed_to_samples(v, i);
    }
    let along = sides.along[i].xyz;
    // What w gains along the face as y gains 1. At 1 - 2e-5 f_w/n_w is 1e5.
    let steep = dot(v.row_y.xyz, along);
    let h = select(clamp(dot(v.row_w.xyz, along) / steep, 0.0, 1.0 - 2e-5), 0.0, steep == 0.0);
    let made = shaped(v, h);
    fitted[i] = made.view;
    made_shapes[i] = vec4f(made.shape.k, made.shape.ln, 0.0, 0.0);
}

fn choose(s: Surface) -> Chosen {
    return Chosen(layer_of(s.position), 0u, 0.0);
}

// The layer whose warp is shown: that of the probed surface, or the first that is in use.
fn shown_layer() -> u32 {
    let s = load_surface(min(probed_pixel(), frame.size - 1u));
    if s.valid && faces_light(s) {
        return choose(s).layer;
    }
    for (var i = 0u; i < most_layers; i++) {
        if light_views[i].idle == 0u {
            return i;
        }
    }
    return 0u;
}

fn inspect_map(s: Surface) -> f32 {
    switch frame.map {
        case shows_shadow_maps, shows_sides, shows_gain, shows_texels, shows_bias: {}
        default: {
            warped_layer = shown_layer();
        }
    }
    return inspect_warped(s);
}

fn inspect_warp(s: Surface) -> f32 {
    if frame.map == shows_shadow_maps {
        return maps_picture(s.pixel, textureNumLayers(shadow_maps));
    }
    if !s.valid {
        return -1.0;
    }
    let layer = choose(s).layer;
    switch frame.map {
        case shows_sides: {
            return label(layer, 0.5);
        }
        case shows_gain: {
            follow(light_views[layer]);
            return gain(s, light_views[layer]);
        }
        default: {
            return -1.0;
        }
    }
}

// Of all layers together what their passes told: the first of `state.counters`.
var<storage, read_write> told: array<u32, 5>;

// After a layer's passes.
@compute @workgroup_size(1)
fn tell() {
    for (var k = 0u; k < 5u; k++) {
        told[k] += atomicLoad(&state.counters[k]);
    }
}
