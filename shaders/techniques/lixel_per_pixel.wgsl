//!include map/place/straight.wgsl
//!include map/look_up.wgsl
//!include map/tiles.wgsl
// Chong, Gortler 2004: the pixels of one plane have a map whose texels are pixels, all others an ordinary one.

const ordinary = 0u;
const planes_own = 1u;

var<uniform> lixel: LixelParams;
// The plane of the points X with dot(plane_of_interest, (X, -1)) = 0, its normal a unit vector; 0: there is no map of one.
var<uniform> plane_of_interest: vec4f;

fn near_plane(p: vec3f) -> bool {
    let plane = plane_of_interest;
    return any(plane.xyz != vec3f(0.0)) && abs(dot(plane.xyz, p) - plane.w) <= lixel.tolerance;
}

// Whether the plane's map holds a point.
fn plane_sees(p: vec3f) -> bool {
    let v = light_views[planes_own];
    let clip = light_clip(v, p);
    return clip.w > 0.0 && all(abs(clip.xy) < vec2f(clip.w));
}

fn choose(s: Surface) -> Chosen {
    return Chosen(select(ordinary, planes_own, near_plane(s.position) && plane_sees(s.position)), ordinary, 0.0);
}

fn texture_layer(layer: u32) -> u32 {
    return layer;
}

fn holds(layer: u32, texel: vec2f) -> bool {
    return true;
}

// Nothing: it is lit.
fn beside(r: Receiver, texel: vec2f) -> Beside {
    return Beside(1.0, light_views[r.layer].far);
}

fn inspect_map(s: Surface) -> f32 {
    if frame.map == shows_shadow_maps {
        return maps_picture(s.pixel, textureNumLayers(shadow_maps));
    }
    if !s.valid {
        return -1.0;
    }
    if frame.map == shows_plane {
        // Near the plane, but not in its map: the third colour.
        let layer = choose(s).layer;
        return label(select(layer, 2u, layer == ordinary && near_plane(s.position)), 0.5);
    }
    return inspect_filter(s);
}
