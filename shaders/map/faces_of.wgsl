//!include constants.wgsl
// The faces of a map that looks in all directions, or a paraboloid's sides: see `Faces` in src/map/faces.rs.

struct Faces {
    count: u32,
    triangles: u32,
    // Those that no mask cuts holes into come first.
    opaque: u32,
    // 1: each face has a list of its triangles; 0: there is no room for them, and faces draw all.
    listed: u32,
    // Bit i: the camera's frustum meets face i.
    met: u32,
    // Vertices that a triangle of a paraboloid's side is drawn with; 0: only its corners are moved, and edges stay straight.
    vertices: u32,
    // How far from a receiver what its filter looks up may lie: an angle at the light, and metres on top.
    angle: f32,
    metres: f32,
    // Of each face the axis: a direction is looked up in the face whose axis lies nearest. w: its layer of the texture.
    axes: array<vec4f, most_layers>,
    // Of each face two half planes of the map, which it draws into: as `region` in map/casters.wgsl.
    regions: array<vec4f, 16>,
    // The camera's frustum: products with a point are positive inside.
    frustum: array<vec4f, 6>,
}

var<uniform> faces: Faces;

// The face that holds a direction from the light.
fn face_of(direction: vec3f) -> u32 {
    var best = 0u;
    var most = dot(faces.axes[0].xyz, direction);
    for (var i = 1u; i < faces.count; i++) {
        let near = dot(faces.axes[i].xyz, direction);
        best = select(best, i, near > most);
        most = max(most, near);
    }
    return best;
}
