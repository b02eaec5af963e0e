//!include lib/cascades.wgsl
//!include lib/resolve.wgsl
//!include lib/cells.wgsl
//!include lib/labels.wgsl
// Looking cascades up, and the maps that techniques with cascades show.

var<uniform> map: CascadeParams;
var shadow_maps: texture_depth_2d_array;

struct Receiver {
    // Position in the cascade's map, texels.
    texel: vec2f,
    // Stored depth to compare with: lit where it is not below the map's (depth is reversed).
    depth: f32,
    // How much that falls a metre of linear depth, and a metre across the light's axis along the receiver's plane.
    fall: f32,
    sideways: f32,
    // Texels a metre across the axis.
    texels: vec2f,
    // How far all biases move the comparison towards the light, in texels.
    moved: f32,
}

// As `receive` of lib/lookup.wgsl for one sample, with the texel of this cascade.
fn receive(s: Surface, v: LightView) -> Receiver {
    let lamp = v.perspective == 1u;
    let to_light = light_at(s.position).to_light;
    let distance = length(to_light);
    let cosine = dot(s.normal, to_light) / distance;
    let straight = dot(v.axis, vec4f(s.position, 1.0));
    let texel = texel_size(v, s.position, to_light / distance);
    let position = s.position + s.normal * (map.normal_offset * texel * sqrt(max(1.0 - cosine * cosine, 0.0)));
    let clip = light_clip(v, position);
    let z = dot(v.axis, vec4f(position, 1.0));
    var r: Receiver;
    r.texel = light_texel(v, clip);
    r.texels = 0.5 * v.resolution * scale_of(v) / select(1.0, z, lamp);
    // Stored depth is affine along the receiver's plane, under a spot light too: there it is so in 1 / z.
    r.fall = select(1.0, v.near * v.far / (z * z), lamp) / (v.far - v.near);
    let lean = vec2f(dot(v.row_x.xyz, v.axis.xyz), dot(v.row_y.xyz, v.axis.xyz));
    let nx = dot(s.normal, normalize(v.row_x.xyz - lean.x * v.axis.xyz));
    let ny = dot(s.normal, normalize(v.row_y.xyz - lean.y * v.axis.xyz));
    let tangent = vec2f(nx, ny) / max(cosine, 1e-6) * select(1.0, z / distance, lamp);
    r.sideways = r.fall * min(length(tangent), map.slope_limit);
    let slope = map.slope_bias * r.fall * min(length(tangent / r.texels), map.slope_limit * texel);
    r.depth = max(stored_depth(v, z - map.bias) + slope, 0.0);
    r.moved = (straight - linear_depth(v, r.depth)) / texel;
    return r;
}

fn outside_map(v: LightView, texel: vec2f) -> bool {
    return any(texel < vec2f(0.0)) || any(texel >= vec2f(v.resolution));
}

// One nearest sample; lit outside the map, where nothing can cast.
fn compare(v: LightView, i: u32, depth: f32, texel: vec2f) -> f32 {
    if outside_map(v, texel) {
        return 1.0;
    }
    return select(0.0, 1.0, depth >= textureLoad(shadow_maps, vec2u(texel), i, 0));
}

// Visibility by one cascade: a grid of comparisons over a square of `blur` metres, the same in all of them.
fn look_up(s: Surface, i: u32) -> f32 {
    let v = light_views[i];
    let r = receive(s, v);
    if map.blur == 0.0 {
        return compare(v, i, r.depth, r.texel);
    }
    let step = map.blur / f32(map.taps) * r.texels;
    // Taps lie up to half the blur's side away, on a slope that much deeper.
    let depth = max(r.depth + 0.71 * map.blur * r.sideways, 0.0);
    var lit = 0.0;
    for (var k = 0u; k < map.taps * map.taps; k++) {
        let cell = vec2f(vec2u(k % map.taps, k / map.taps)) - 0.5 * f32(map.taps - 1u);
        lit += compare(v, i, depth, r.texel + cell * step);
    }
    return lit / f32(map.taps * map.taps);
}

fn visibility(s: Surface) -> f32 {
    let depth = cascade_depth(s.position, s.depth);
    let i = cascade_of(depth);
    let t = blend_of(depth, i);
    // One copy of the look-up: adapters that run both sides of a branch pay for each.
    var lit = 0.0;
    var k = 0u;
    loop {
        let v = look_up(s, i + k);
        lit = select(mix(lit, v, t), v, k == 0u);
        k++;
        if t <= 0.0 || k == 2u {
            break;
        }
    }
    return lit;
}

// The maps side by side, fitted into the picture as the counts are; near bright.
fn maps_picture(pixel: vec2u) -> f32 {
    let columns = u32(ceil(sqrt(f32(fitting.count))));
    let rows = (fitting.count + columns - 1u) / columns;
    let side = f32(textureDimensions(shadow_maps).x);
    let whole = side * vec2f(vec2u(columns, rows));
    let picture = vec2f(frame.size);
    let scale = max(whole.x / picture.x, whole.y / picture.y);
    let at = (vec2f(pixel) + 0.5 - 0.5 * picture) * scale + 0.5 * whole;
    let tile = vec2u(max(at, vec2f(0.0)) / side);
    let i = tile.y * columns + tile.x;
    if any(at < vec2f(0.0)) || any(at >= whole) || i >= fitting.count {
        return drawn(white, 0.0);
    }
    let inner = at - vec2f(tile) * side;
    if any(inner < vec2f(4.0 * scale)) || any(inner >= vec2f(side - 4.0 * scale)) {
        return drawn(i, 0.8);
    }
    return drawn(white, 0.05 + 0.9 * nearness(i, vec2u(inner * (light_views[i].resolution / side))));
}

// What a map holds, linear: 1 at its near, 0 at its far end.
fn nearness(i: u32, texel: vec2u) -> f32 {
    let v = light_views[i];
    return (v.far - linear_depth(v, textureLoad(shadow_maps, texel, i, 0))) / (v.far - v.near);
}

fn inside(v: LightView, p: vec3f) -> bool {
    let clip = light_clip(v, p);
    return all(abs(clip.xy) < vec2f(clip.w)) && clip.z > 0.0 && clip.z < clip.w;
}

// The upright plane through the camera's axis, the camera at the left: its frustum by cascades, split planes white, and
// the cross-sections of the light views' boxes as outlines.
fn side_view(pixel: vec2u) -> f32 {
    let eye = frame.shadow_eye;
    let forward = frame.shadow_forward;
    let tangent = 1.0 / length(frame.shadow_up);
    let up = normalize(frame.shadow_up);
    // As far as the scene goes, or the camera sees.
    let sides = max(abs(frame.bounds_min - eye), abs(frame.bounds_max - eye));
    let end = min(split(fitting.count), dot(sides, abs(forward)));
    let size = vec2f(frame.size);
    let scale = max(1.1 * end / size.x, 2.2 * end * tangent / size.y);
    let x = (f32(pixel.x) + 0.5) * scale - 0.05 * end;
    let y = (0.5 * size.y - f32(pixel.y) - 0.5) * scale;
    let p = eye + x * forward + y * up;
    for (var i = 0u; i < fitting.count; i++) {
        let v = light_views[i];
        let here = inside(v, p);
        let next = vec3f(1.5 * scale);
        if here && !(inside(v, p + next * forward) && inside(v, p - next * forward) && inside(v, p + next * up) && inside(v, p - next * up)) {
            return drawn(i, 0.95);
        }
    }
    if x < split(0u) || x > end || abs(y) > x * tangent {
        return drawn(white, 0.0);
    }
    for (var i = 0u; i <= fitting.count; i++) {
        if abs(x - split(i)) < 0.75 * scale {
            return drawn(white, 0.9);
        }
    }
    return drawn(cascade_of(x), 0.4);
}

// The maps of every technique with cascades; numbered as the first of `MAPS` in Rust.
fn inspect_cascades(s: Surface) -> f32 {
    if frame.map == 1u {
        return maps_picture(s.pixel);
    }
    if frame.map == 2u {
        return side_view(s.pixel);
    }
    if !s.valid {
        return -1.0;
    }
    let depth = cascade_depth(s.position, s.depth);
    let i = cascade_of(depth);
    if frame.map == 0u {
        // A frozen camera leaves surfaces without a map.
        let beside = frame.frozen == 1u && outside_map(light_views[i], receive(s, light_views[i]).texel);
        return select(label(i, 0.5), -1.0, beside);
    }
    if frame.map == 3u {
        let t = blend_of(depth, i);
        return select(-1.0, t, t > 0.0);
    }
    let r = receive(s, light_views[i]);
    if outside_map(light_views[i], r.texel) {
        return -1.0;
    }
    if frame.map == 4u {
        return cell_value(vec2u(r.texel));
    }
    return select(-1.0, r.moved, faces_light(s));
}
