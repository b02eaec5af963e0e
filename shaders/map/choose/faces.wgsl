//!include map/faces_of.wgsl
//!include map/look_up.wgsl
//!include lib/labels.wgsl
//!include map/laid.wgsl
// Choosing among the faces around a light, and the maps that techniques with faces show. Each face's map goes so far beyond its
// edges as the filter reaches (a guard band): nothing is looked up twice at a seam. Taps that lie farther off all the same
// are looked up where their direction belongs.

fn choose(s: Surface) -> Chosen {
    let i = face_of(s.position - frame.light_position);
    return Chosen(i, i, 0.0);
}

fn texture_layer(layer: u32) -> u32 {
    return u32(faces.axes[layer].w);
}

// A place of a map in the light's image before any warp, as clip positions over w have it.
fn image_of(v: LightView, texel: vec2f) -> vec2f {
    return vec2f(2.0, -2.0) * before_place(v, texel) / v.resolution + vec2f(-1.0, 1.0);
}

// Where a view sees the light's ray of a place in its map, at a depth of 1 (a paraboloid's: 1 m from the light). From the light.
fn ray_of(v: LightView, texel: vec2f) -> vec3f {
    let ndc = image_of(v, texel);
    if v.perspective == 3u {
        let q = normalize(paraboloid_ray(v, ndc));
        return q.x * v.row_x.xyz + q.y * v.row_y.xyz + q.z * v.axis.xyz;
    }
    // The rows of its matrix over the depth: where all three planes meet.
    let a = v.row_x.xyz;
    let b = v.row_y.xyz;
    let c = v.axis.xyz;
    return (ndc.x * cross(b, c) + ndc.y * cross(c, a) + cross(a, b)) / dot(a, cross(b, c));
}

// Of a layer that two faces share each holds its part; a paraboloid holds directions up to its guard band.
fn holds(layer: u32, texel: vec2f) -> bool {
    let v = light_views[layer];
    if v.perspective == 3u {
        let ray = paraboloid_ray(v, image_of(v, texel));
        return ray.z >= v.ahead * length(ray);
    }
    let at = vec3f(texel, 1.0);
    return dot(faces.regions[2u * layer].xyz, at) >= 0.0 && dot(faces.regions[2u * layer + 1u].xyz, at) >= 0.0;
}

fn beside(r: Receiver, texel: vec2f) -> Beside {
    let own = light_views[r.layer];
    let ray = ray_of(own, texel);
    let offset = linear_depth(own, depth_at(r, texel)) * ray;
    let other = face_of(offset);
    let v = light_views[other];
    let position = frame.light_position + offset;
    let clip = light_clip(v, position);
    let at = clamp(map_texel(v, clip), vec2f(0.0), vec2f(v.resolution - 0.5));
    let found = drawn_depth(other, vec2u(at));
    // The receiver's own bias is in `offset`; where that face sees it at a slant it takes the slope's there too.
    let z = depth_in(v, position);
    let climb = length(plane_gradient(v, r.normal, clip).depth);
    let steepest = biases.slope_limit * abs(stored_depth(v, z - texel_size(v, position, normalize(-offset))) - stored_depth(v, z));
    let slope = select(0.7072, biases.slope_bias, biases.bias_kind == bias_kind_slope) * min(climb, steepest);
    // Depth along the other's axis, then along the ray.
    let far = linear_depth(v, found) / max(depth_in(v, frame.light_position + ray), 1e-6);
    return Beside(select(0.0, 1.0, stored_depth(v, z) + select(slope, 0.0, biases.bias_kind == bias_kind_none) >= found), far);
}

// Samples and triangles of each face, as map/faces.wgsl counts them.
var<storage, read> face_samples: array<u32>;
var<storage, read> face_draws: array<u32>;

fn face_drawn(i: u32) -> bool {
    return face_draws[10u * i + 1u] > 0u;
}

// What a map holds, linear: 1 at its near, 0 at its far end.
fn nearness(i: u32, texel: vec2u) -> f32 {
    let v = light_views[i];
    return (v.far - linear_depth(v, drawn_depth(i, texel))) / (v.far - v.near);
}

// The views of every technique with faces.
fn inspect_faces(s: Surface) -> f32 {
    if frame.map == shows_shadow_maps {
        return unfolded(s.pixel);
    }
    if frame.map == shows_face_load {
        return face_load(s.pixel);
    }
    if frame.map == shows_texel_angle {
        return angle_chart(s.pixel);
    }
    if !s.valid {
        return -1.0;
    }
    let i = choose(s).layer;
    if frame.map == shows_faces {
        return label(i, select(0.2, 0.5, face_drawn(i)));
    }
    if frame.map == shows_solid_angle {
        let v = light_views[i];
        let q = s.position - frame.light_position;
        return select(-1.0, solid_angle_of(v, q) * texels_of_all() / 12.566371, faces_light(s));
    }
    return inspect_filter(s);
}

// Texels of all maps together.
fn texels_of_all() -> f32 {
    let layers = texture_layer(faces.count - 1u) + 1u;
    return f32(layers) * light_views[0].resolution * light_views[0].resolution;
}

// The solid angle of the texel in a direction from the light, steradians.
fn solid_angle_of(v: LightView, q: vec3f) -> f32 {
    let direction = normalize(q);
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(direction.x) > 0.5);
    let t = normalize(cross(direction, other));
    let clip = light_clip(v, frame.light_position + direction);
    let a = map_along(v, t, clip);
    let b = map_along(v, cross(direction, t), clip);
    return 1.0 / max(abs(a.x * b.y - a.y * b.x), 1e-30);
}

// Columns and rows of the tiles that the maps are laid out in, and the tile of each layer. A cube's faces unfolded: a cross.
struct Tiling {
    columns: u32,
    rows: u32,
}

fn tiling() -> Tiling {
    let layers = texture_layer(faces.count - 1u) + 1u;
    if layers == 6u {
        return Tiling(4u, 3u);
    }
    return Tiling(select(layers, 2u, layers == 4u), select(1u, 2u, layers == 4u));
}

fn layer_in(tile: vec2u) -> i32 {
    let l = tiling();
    if l.columns == 4u {
        // +x +z -x -z in the middle; +y over +z, -y below.
        let middle = array<i32, 4>(0, 4, 1, 5);
        let beside = select(select(-1, 3, tile.y == 2u), 2, tile.y == 0u);
        return select(select(-1, beside, tile.x == 1u), middle[tile.x], tile.y == 1u);
    }
    return i32(tile.y * l.columns + tile.x);
}

// The face that a place of a layer belongs to.
fn face_at(layer: u32, texel: vec2f) -> u32 {
    for (var i = 0u; i < faces.count; i++) {
        let at = vec3f(texel, 1.0);
        if texture_layer(i) == layer && dot(faces.regions[2u * i].xyz, at) >= 0.0 && dot(faces.regions[2u * i + 1u].xyz, at) >= 0.0 {
            return i;
        }
    }
    return 0u;
}

fn laid_tile(layer: u32) -> vec2u {
    let l = tiling();
    if l.columns == 4u {
        return array<vec2u, 6>(vec2u(0u, 1u), vec2u(2u, 1u), vec2u(1u, 0u), vec2u(1u, 2u), vec2u(1u, 1u), vec2u(3u, 1u))[layer];
    }
    return vec2u(layer % l.columns, layer / l.columns);
}

// Texels a pixel where all tiles are fitted into the picture.
fn laid_scale() -> f32 {
    let l = tiling();
    let whole = light_views[0].resolution * vec2f(vec2u(l.columns, l.rows)) / vec2f(frame.size);
    return max(whole.x, whole.y);
}

fn laid_out(pixel: vec2f) -> Laid {
    let l = tiling();
    let side = light_views[0].resolution;
    let whole = side * vec2f(vec2u(l.columns, l.rows));
    let scale = laid_scale();
    let at = (pixel - 0.5 * vec2f(frame.size)) * scale + 0.5 * whole;
    let tile = vec2u(max(at, vec2f(0.0)) / side);
    if any(at < vec2f(0.0)) || any(at >= whole) || layer_in(tile) < 0 {
        return Laid(false, 0u, vec2f(0.0), scale, false);
    }
    let inner = at - vec2f(tile) * side;
    let rim = any(inner < vec2f(2.0 * scale)) || any(inner >= vec2f(side - 2.0 * scale));
    return Laid(true, u32(layer_in(tile)), inner, scale, rim);
}

// The pixel at which that shows a place of a view's map.
fn pixel_of(v: LightView, place: vec2f) -> vec2f {
    let l = tiling();
    let side = v.resolution;
    let tile = laid_tile(texture_layer(face_of(v.axis.xyz)));
    let at = vec2f(tile) * side + place - 0.5 * side * vec2f(vec2u(l.columns, l.rows));
    return at / laid_scale() + 0.5 * vec2f(frame.size);
}

// The maps laid out, fitted into the picture; near bright. Borders in the face's colour; what was not drawn is dark.
fn unfolded(pixel: vec2u) -> f32 {
    let at = laid_out(vec2f(pixel) + 0.5);
    if !at.inside {
        return drawn(white, 0.0);
    }
    let inner = at.place;
    let i = face_at(at.layer, inner);
    // The seam: where another face takes over.
    let v = light_views[i];
    let step = 1.5 * at.scale;
    let here = face_of(ray_of(v, inner));
    let seam = here == i && (face_of(ray_of(v, inner + vec2f(step, 0.0))) != i || face_of(ray_of(v, inner - vec2f(step, 0.0))) != i
        || face_of(ray_of(v, inner + vec2f(0.0, step))) != i || face_of(ray_of(v, inner - vec2f(0.0, step))) != i);
    if seam || at.rim {
        return drawn(i, select(0.3, 0.9, face_drawn(i)));
    }
    if !face_drawn(i) {
        return drawn(white, 0.03);
    }
    return drawn(white, (0.05 + 0.9 * nearness(i, vec2u(inner))) * select(0.5, 1.0, here == i));
}

// Bars: of each face its share of the view samples (left) and of the scene's triangles (right).
fn face_load(pixel: vec2u) -> f32 {
    let size = vec2f(frame.size);
    let at = ((vec2f(pixel) + 0.5) / size - 0.05) / 0.9;
    if any(at < vec2f(0.0)) || any(at > vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    var all = 0u;
    for (var i = 0u; i < faces.count; i++) {
        all += face_samples[i];
    }
    let i = min(u32(at.x * f32(faces.count)), faces.count - 1u);
    let inner = at.x * f32(faces.count) - f32(i);
    let drawn_triangles = f32(face_draws[10u * i] + face_draws[10u * i + 5u]) / 3.0 * f32(face_draws[10u * i + 1u]);
    let shares = vec2f(f32(face_samples[i]) / max(f32(all), 1.0), drawn_triangles / max(f32(faces.triangles), 1.0));
    let y = 1.0 - at.y;
    let tenth = abs(fract(10.0 * y + 0.5) - 0.5) / 10.0 < 0.5 / (0.9 * size.y);
    if inner > 0.1 && inner < 0.48 && y < shares.x {
        return drawn(i, 0.9);
    }
    if inner > 0.52 && inner < 0.9 && y < shares.y {
        return drawn(i, 0.4);
    }
    return drawn(white, select(0.05, 0.2, tenth));
}

// A chart along the middle of the map that the probed surface lies in: solid angle of its texels over the place in the map, relative
// to an even share of all directions; from 1/8 to 8, logarithmic.
fn angle_chart(pixel: vec2u) -> f32 {
    let size = vec2f(frame.size);
    let at = ((vec2f(pixel) + 0.5) / size - 0.05) / 0.9;
    if any(at < vec2f(0.0)) || any(at > vec2f(1.0)) {
        return drawn(white, 0.0);
    }
    let s = load_surface(probed_pixel());
    let i = select(0u, choose(s).layer, s.valid);
    let v = light_views[i];
    let step = 1.0 / (0.9 * size.x);
    var ends: vec2f;
    for (var k = 0u; k < 2u; k++) {
        let ray = ray_of(v, v.resolution * vec2f(at.x + f32(k) * step, 0.5));
        ends[k] = (log2(solid_angle_of(v, ray) * texels_of_all() / 12.566371) + 3.0) / 6.0;
    }
    let y = 1.0 - at.y;
    let half = 0.5 * max(1.0, size.y / 400.0) / (0.9 * size.y);
    if y > min(ends.x, ends.y) - half && y < max(ends.x, ends.y) + half {
        return drawn(1u, 1.0);
    }
    let octave = abs(fract(6.0 * y + 0.5) - 0.5) / 6.0 < half * 0.7;
    return drawn(white, select(select(0.05, 0.2, octave), 0.5, abs(y - 0.5) < half));
}
