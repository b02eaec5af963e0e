//!include map/warp/rtw.wgsl
// Where importance is found for a rectilinear warp: at the pixels (map/warp/rtw.wgsl), or in the light's own map, which is drawn plain
// before.

var<uniform> analysing: AnalysisParams;

fn edges_at_pixels() -> bool {
    return analysing.analysis == analysis_backward;
}

// The scene's depth in the light's image before the warp, a texel a bin; 0: nothing there.
var light_depth: texture_depth_2d;

// Linear depth at a bin, metres; beyond the map's side and where there is nothing: the far end.
fn depth_of(bin: vec2i) -> f32 {
    if any(bin < vec2i(0)) || any(bin >= vec2i(i32(bins()))) {
        return light_view.far;
    }
    return linear_depth(light_view, textureLoad(light_depth, vec2u(bin), 0));
}

// Where a bin's middle lies at a linear depth: three planes meet there; on a paraboloid so far along the bin's ray.
fn position_at(bin: vec2i, z: f32) -> vec3f {
    let u = (vec2f(bin) + 0.5) / f32(bins());
    if curved() {
        let q = z * normalize(paraboloid_ray(light_view, vec2f(2.0 * u.x - 1.0, 1.0 - 2.0 * u.y)));
        return frame.light_position + q.x * light_view.row_x.xyz + q.y * light_view.row_y.xyz + q.z * light_view.axis.xyz;
    }
    let a = light_view.row_x - (2.0 * u.x - 1.0) * light_view.row_w;
    let b = light_view.row_y - (1.0 - 2.0 * u.y) * light_view.row_w;
    let c = light_view.axis - vec4f(0.0, 0.0, 0.0, z);
    let bc = cross(b.xyz, c.xyz);
    let sum = a.w * bc + b.w * cross(c.xyz, a.xyz) + c.w * cross(a.xyz, b.xyz);
    return -sum / dot(a.xyz, bc);
}

// What is shown of neighbours along one axis: the one that lies nearer in depth belongs to the same surface.
fn along_surface(bin: vec2i, z: f32, side: vec2i) -> vec3f {
    let before = depth_of(bin - side);
    let after = depth_of(bin + side);
    if abs(after - z) <= abs(before - z) {
        return position_at(bin + side, after) - position_at(bin, z);
    }
    return position_at(bin, z) - position_at(bin - side, before);
}

// Whether a neighbouring bin's depth is far from this one's: a lamp's z is a distance, the sun's has no origin, so its
// steps are shares of the depth that the map holds.
fn bin_edge(bin: vec2i, z: f32) -> bool {
    let whole = select(light_view.far - light_view.near, z, any(light_view.row_w.xyz != vec3f(0.0)));
    var most = 0.0;
    for (var i = 0; i < 9; i++) {
        let other = clamp(bin + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), vec2i(i32(bins()) - 1));
        most = max(most, abs(depth_of(other) - z));
    }
    return most > rtw.edge_threshold * whole;
}

fn in_view(position: vec3f) -> bool {
    let clip = frame.view_proj * vec4f(position, 1.0);
    return clip.w > 0.0 && all(abs(clip.xy) <= vec2f(clip.w)) && clip.z >= 0.0 && clip.z <= clip.w;
}

// Forward analysis: what the light sees at each bin, the camera asked only where its frustum lies. Hybrid: the light's
// side, the edges, joins what the view samples left there.
@compute @workgroup_size(8, 8)
fn importance_of_texels(@builtin(global_invocation_id) id: vec3u) {
    follow(light_view);
    let bin = vec2i(id.xy);
    let z = depth_of(bin);
    // Around a light, what another layer is looked up for counts there.
    if id.x >= bins() || id.y >= bins() || !in_layer(position_at(bin, z)) {
        return;
    }
    let at = map_start() + id.y * bins() + id.x;
    let covered = textureLoad(light_depth, id.xy, 0) > 0.0;
    let edge = edge_term(covered && bin_edge(bin, z));
    var sum = 0.0;
    if analysing.analysis == analysis_forward {
        let position = position_at(bin, z);
        let light = light_at(position);
        if has_no_term() || !covered || !light.reached {
            return;
        }
        var normal = cross(along_surface(bin, z, vec2i(1, 0)), along_surface(bin, z, vec2i(0, 1)));
        normal *= select(-1.0, 1.0, dot(normal, light.to_light) > 0.0) / max(length(normal), 1e-30);
        sum = with_term(camera_terms(position, normal, in_view(position)), rtw.shadow_edge != 0u, edge);
    } else {
        sum = bitcast<f32>(atomicLoad(&importance[at]));
        // What the camera has no say in, counts by itself.
        if !has_camera_term() {
            sum = nothing_yet();
        }
        sum = with_term(sum, covered && rtw.shadow_edge != 0u, edge);
    }
    atomicStore(&importance[at], bitcast<u32>(max(sum, 0.0)));
}
