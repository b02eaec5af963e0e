//!include map/look_up.wgsl
//!include lib/listed.wgsl
//!include lib/labels.wgsl
//!include lib/shadow_ray.wgsl
// Beister, Ernst, Stamminger 2005: where all texels of a window around the receiver agree, they decide; else a ray does.

var<uniform> agreement: AgreementParams;

// The share of the window's texels that see the light.
fn lit_share(s: Surface) -> f32 {
    let n = agreement.window;
    let around = 0.5 * f32(n - 1u);
    let r = receive(s, choose(s).layer, around, 1.0);
    let first = floor(r.texel - around) + 0.5;
    var seen = 0.0;
    for (var i = 0u; i < n * n; i++) {
        seen += compare(r, first + vec2f(vec2u(i % n, i / n)));
    }
    return seen / f32(n * n);
}

@compute @workgroup_size(8, 8)
fn agree(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let s = load_surface(id.xy);
    let light = light_at(s.position);
    var v = select(1.0, 0.0, s.valid);
    if may_be_shadowed(s, light) {
        v = lit_share(s);
        if agreement.rays != 0u && v > 0.0 && v < 1.0 {
            list_ray(id.xy, 3.4e38);
        }
    }
    textureStore(visibility_out, id.xy, vec4f(v));
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map != shows_agreement {
        return inspect_filter(s);
    }
    let light = light_at(s.position);
    if !may_be_shadowed(s, light) {
        return -1.0;
    }
    let seen = lit_share(s);
    let blocked = trace(shadow_ray(s, light)).blocked;
    if seen > 0.0 && seen < 1.0 {
        return label(select(2u, 4u, blocked), 0.8);
    }
    if (seen == 0.0) != blocked {
        return label(0u, 1.0);
    }
    return label(select(1u, 7u, blocked), 0.25);
}
