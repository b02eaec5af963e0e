//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
//!include lib/counting.wgsl
// The analysis pass of techniques with maps, which write `fn place(s: Surface, dx: vec3f, dy: vec3f) -> Place`.
// It takes the pixels whose visibility the technique looks up: those that face the light and are reached by it.

// Where a surface lies in the technique's maps, before any bias.
struct Place {
    // In the map, texels from its upper left corner; outside it where no map holds the surface.
    texel: vec2f,
    // Which of the maps.
    layer: u32,
    // Change of `texel` as the surface point moves by dx and by dy: the derivative, not a difference.
    along_x: vec2f,
    along_y: vec2f,
}

// Aliasing error m, its perspective and projection parts, and a texel's area in pixels; -1 where there is none.
var aliasing_out: texture_storage_2d<rgba32float, write>;
// Place in the maps, texels, and which map; -1 where there is none.
var places_out: texture_storage_2d<rgba32float, write>;

var<private> placed: vec4f = vec4f(-1.0);

// A texel's footprint in the image, A = J⁻¹ with J's columns p.along_x and p.along_y: its longest extent σmax(A) and
// its area |det A|. For a 2 × 2 matrix σmax(J⁻¹) = σmax(J) / |det J|.
fn footprint(p: Place) -> vec2f {
    let a = p.along_x;
    let b = p.along_y;
    let longest = 0.5 * (length(vec2f(a.x + b.y, a.y - b.x)) + length(vec2f(a.x - b.y, a.y + b.x)));
    let area = 1.0 / max(abs(a.x * b.y - a.y * b.x), 1e-30);
    return vec2f(longest * area, area);
}

// Adds a view sample to its texel; false if it is in none of the maps.
fn counted(p: Place) -> bool {
    // A sample on a map's very edge is in it, whatever the rounding.
    let spare = vec2f(0.02);
    let size = vec2f(counting.size);
    if !(all(p.texel >= -spare) && all(p.texel <= size + spare)) {
        return false;
    }
    let cell = min(vec2u(max(p.texel, vec2f(0.0))), counting.size - 1u);
    let index = (p.layer * counting.size.y + cell.y) * counting.size.x + cell.x - counting.first;
    if index < counting.count {
        atomicAdd(&counts[index], 1u);
    }
    return true;
}

// How far it is on the surface's plane to where the rays of this pixel's neighbours to the right and below meet it, metres.
fn pixel_steps(s: Surface) -> mat2x3f {
    let rays = frame.rays;
    let scale = scale_at(s.depth);
    let ray = -to_eye(s.position) / scale;
    let slope = dot(s.normal, ray);
    let along_normal = select(slope, select(-1e-7, 1e-7, slope >= 0.0), abs(slope) < 1e-7);
    return scale * mat2x3f(rays[0] - ray * (dot(s.normal, rays[0]) / along_normal),
                             rays[1] - ray * (dot(s.normal, rays[1]) / along_normal));
}

fn analysed(s: Surface) -> vec4f {
    let light = light_at(s.position);
    if !may_be_shadowed(s, light) {
        return vec4f(-1.0);
    }
    let steps = pixel_steps(s);
    let p = place(s, steps[0], steps[1]);
    if !counted(p) {
        return vec4f(-1.0);
    }
    placed = vec4f(p.texel, f32(p.layer), 0.0);
    // The same for a surface that faces both the light and the camera: what only distances decide.
    let to_light = normalize(light.to_light);
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(to_light.x) > 0.5);
    let u = normalize(cross(to_light, other));
    let pixel = pixel_at(s.depth);
    let facing = place(s, u * pixel, cross(to_light, u) * pixel);
    let whole = footprint(p);
    let perspective = footprint(facing).x;
    return vec4f(whole.x, perspective, whole.x / perspective, whole.y);
}

@compute @workgroup_size(8, 8)
fn analyse(@builtin(global_invocation_id) id: vec3u) {
    if id.x < frame.size.x && id.y < frame.size.y {
        textureStore(aliasing_out, id.xy, analysed(load_surface(id.xy)));
        textureStore(places_out, id.xy, placed);
    }
}
