//!include lib/frame.wgsl
//!include map/light_view.wgsl
// Which of `light_views` holds a place: around a lamp that of the cube's face whose axis lies nearest, else the only one.

fn lights_around() -> bool {
    return frame.light_kind == omni || frame.light_kind == hemisphere;
}

fn view_of(position: vec3f) -> u32 {
    var best = 0u;
    if lights_around() {
        let q = position - frame.light_position;
        for (var i = 1u; i < 6u; i++) {
            best = select(best, i, dot(light_views[i].axis.xyz, q) > dot(light_views[best].axis.xyz, q));
        }
    }
    return best;
}
