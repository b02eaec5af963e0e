// What every pass may know: the camera, the light, the scene.
// The struct stands in src/frame.rs too; a test compares the two field by field.

struct Frame {
    view_proj: mat4x4f,
    // To clip space from what is given relative to the eye.
    eye_proj: mat4x4f,
    // The rays of the picture: their change from a pixel to the next on the right, to the next below, and the ray through the
    // upper left corner. Depth 1 along `forward`. Orthographic: where they start, relative to the eye.
    rays: mat3x3f,
    eye: vec3f,
    near: f32,
    forward: vec3f,
    far: f32,
    bounds_min: vec3f,
    seed: u32,
    bounds_max: vec3f,
    // Of the disc that shines and faces what it lights, around the light's position: metres. A directional light's lies at a
    // distance of 1: the tangent of its angular radius. 0 for a point, and for hemisphere and area lights.
    light_radius: f32,
    // A directional light's unit vector towards it, else its position.
    light_position: vec3f,
    light_kind: u32,
    // The direction in which a spot, hemisphere or area light shines; unit length.
    light_axis: vec3f,
    light_range: f32,
    light_color: vec3f,
    // Cosine of a spot's outer angle.
    light_cosine: f32,
    light_half_u: vec3f,
    view: u32,
    light_half_v: vec3f,
    map: u32,
    size: vec2u,
    // Rows that this dispatch covers: first and count.
    band: vec2u,
    // The camera that maps are fitted to: this one, or, while `frozen` is 1, one that stayed behind.
    shadow_eye: vec3f,
    frozen: u32,
    shadow_forward: vec3f,
    // As far as it sees of the scene's box, metres along its axis.
    shadow_far: f32,
    // Upwards in its picture, as long as 1 over the tangent of half its field of view; orthographic: over half its height.
    shadow_up: vec3f,
    // The pixel of the picture that charts are of: x, and y times 65536.
    probe: u32,
    // 1: the camera is orthographic; the same of the one that maps are fitted to.
    orthographic: u32,
    shadow_orthographic: u32,
    // What stands for the distance from an orthographic camera where a share of one is meant: to its target, metres.
    reach: f32,
    // From the light, or under the sun from the caster, to where the volumes of an orthographic picture end, metres.
    beyond: f32,
    padding: vec3u,
    // Of the scene.
    triangle_count: u32,
}

const directional = 0u;
const spot = 1u;
const omni = 2u;
const hemisphere = 3u;
const rect_area = 4u;

var<uniform> frame: Frame;

// The pixel of a thread, where the pass may be cut into bands of rows (`Run::in_bands` in Rust).
fn banded(id: vec2u) -> vec2u {
    return vec2u(id.x, frame.band.x + id.y);
}

// The pixel that charts are of.
fn probed_pixel() -> vec2u {
    return vec2u(frame.probe & 0xffffu, frame.probe >> 16u);
}

// The camera's ray through a place of the picture, pixels from its upper left corner; the length is 1 along `forward`.
fn pixel_ray(at: vec2f) -> vec3f {
    if frame.orthographic == 1u {
        return frame.forward;
    }
    return frame.rays * vec3f(at, 1.0);
}

// Where it starts.
fn ray_start(at: vec2f) -> vec3f {
    if frame.orthographic == 1u {
        return frame.eye + frame.rays * vec3f(at, 1.0);
    }
    return frame.eye;
}

// Towards the camera from a place: all the way, or of an orthographic one 1 m.
fn to_eye(position: vec3f) -> vec3f {
    return select(frame.eye - position, -frame.forward, frame.orthographic == 1u);
}

// How many times as large as at 1 m what the picture shows at a depth along the camera's axis is.
fn scale_at(depth: f32) -> f32 {
    return select(depth, 1.0, frame.orthographic == 1u);
}

// Side of a pixel there, metres.
fn pixel_at(depth: f32) -> f32 {
    return scale_at(depth) * length(frame.rays[1]);
}

// What 1 % of the distance is meant of: the depth, or of an orthographic camera, whose place means nothing, that of its target.
fn distance_at(depth: f32) -> f32 {
    return select(depth, frame.reach, frame.orthographic == 1u);
}

// A place in the picture of the camera that maps are fitted to, from -1 to 1 to the right and upwards, at a depth along its axis.
fn shadow_view_place(side: vec2f, depth: f32) -> vec3f {
    let up = frame.shadow_up / dot(frame.shadow_up, frame.shadow_up);
    let right = cross(frame.shadow_forward, up) * (f32(frame.size.x) / f32(frame.size.y));
    let wide = select(depth, 1.0, frame.shadow_orthographic == 1u);
    return frame.shadow_eye + depth * frame.shadow_forward + wide * (side.x * right + side.y * up);
}

struct LightSample {
    // Towards the light, not normalised: its length is the distance (1 for a directional light).
    to_light: vec3f,
    // Irradiance on a surface that faces the light.
    irradiance: vec3f,
    // Whether the light shines this way at all, before anything is in the way.
    reached: bool,
}

// The light as seen from a world position; an area light from its centre.
fn light_at(position: vec3f) -> LightSample {
    if frame.light_kind == directional {
        return LightSample(frame.light_position, frame.light_color, true);
    }
    let to_light = frame.light_position - position;
    let distance2 = max(dot(to_light, to_light), 1e-12);
    let cosine = dot(-to_light, frame.light_axis) * inverseSqrt(distance2);
    var reached = distance2 <= frame.light_range * frame.light_range;
    var falloff = 1.0;
    if frame.light_kind == spot {
        reached = reached && cosine >= frame.light_cosine;
    } else if frame.light_kind == hemisphere || frame.light_kind == rect_area {
        reached = reached && cosine > 0.0;
        falloff = max(cosine, 0.0);
    }
    return LightSample(to_light, frame.light_color * falloff / distance2, reached);
}

// Depth of a surface of the picture along the axis of the camera that maps are fitted to.
fn cascade_depth(position: vec3f, depth: f32) -> f32 {
    return select(depth, dot(position - frame.shadow_eye, frame.shadow_forward), frame.frozen == 1u);
}
