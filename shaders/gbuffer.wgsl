//!include lib/frame.wgsl
//!include lib/gbuffer.wgsl
// The G-buffer. Each triangle has vertices of its own here, so that its number needs no device feature.
// The rasteriser says which triangle a pixel sees; where, the pixel's own ray says. Interpolated values would belong to
// corners that the rasteriser has moved (by up to half a 256th of a pixel), and lie past the triangle's edges.

struct Fragment {
    // Shadow volumes draw the same triangles once more.
    @invariant @builtin(position) clip: vec4f,
    // For its derivatives only.
    @location(0) uv: vec2f,
    @location(1) @interpolate(flat) triangle: u32,
    @location(2) @interpolate(flat) material: u32,
    // The first corner in world space, and from it to the two others.
    @location(3) @interpolate(flat) corner: vec3f,
    @location(4) @interpolate(flat) second: vec3f,
    @location(5) @interpolate(flat) third: vec3f,
    @location(6) @interpolate(flat) normal: vec3f,
    // Least weight of each corner: keeps samples off the edges by more than the rounding of a position.
    @location(7) @interpolate(flat) least: vec3f,
    @location(8) @interpolate(flat) uvs: vec4f,
    @location(9) @interpolate(flat) last_uv: vec2f,
    @location(10) @interpolate(flat) shading_normals: vec3u,
    @location(11) @interpolate(flat) colors: vec3u,
}

fn longest(a: vec3f) -> f32 {
    return max(abs(a.x), max(abs(a.y), abs(a.z)));
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let triangle = index / 3u;
    let corners = triangle_at(triangle);
    let a = vertex_at(corners.x);
    let b = vertex_at(corners.y);
    let c = vertex_at(corners.z);
    let ab = b.position - a.position;
    let ac = c.position - a.position;
    let normal = cross(ab, ac);
    let area = max(length(normal), 1e-37);
    let k = index % 3u;
    let p = select(select(a.position, b.position, k == 1u), c.position, k == 2u);
    var out: Fragment;
    out.clip = frame.eye_proj * vec4f(p - frame.eye, 1.0);
    out.uv = select(select(a.uv, b.uv, k == 1u), c.uv, k == 2u);
    out.triangle = triangle;
    out.material = a.material;
    out.corner = a.position;
    out.second = ab;
    out.third = ac;
    out.normal = normal / area;
    let rounding = 4.0 * unit * max(longest(a.position), max(longest(b.position), longest(c.position)));
    // Over the triangle's heights; a sliver's are too small for it.
    out.least = min(rounding / area * vec3f(distance(b.position, c.position), length(ac), length(ab)), vec3f(1e-3));
    out.uvs = vec4f(a.uv, b.uv);
    out.last_uv = c.uv;
    out.shading_normals = vec3u(a.normal, b.normal, c.normal);
    out.colors = vec3u(a.color, b.color, c.color);
    return out;
}

// The corners' weights at the point of a triangle that a ray from the eye meets; outside, at that of its border that the ray
// passes nearest. `a`: the first corner from the eye; `ab`, `ac`: from it to the others; `side`: 1 if the eye sees the front.
fn weights_at(ray: vec3f, a: vec3f, ab: vec3f, ac: vec3f, side: f32) -> vec3f {
    // Volumes spanned by the ray and the edges as the eye sees them: all positive in front of the eye and inside (Möller,
    // Trumbore 1997, whose determinant is the sum).
    let second = side * dot(ray, cross(a, ac));
    let third = side * dot(ray, cross(ab, a));
    let whole = -side * dot(ray, cross(ab, ac));
    let first = whole - second - third;
    if whole > 0.0 && min(first, min(second, third)) >= 0.0 {
        let w = vec2f(second, third) / whole;
        // Once more from the point found: what was lost to far corners, as of a long triangle, is small from there.
        let found = a + w.x * ab + w.y * ac;
        let better = max(w + side / whole * vec2f(dot(ray, cross(found, ac)), dot(ray, cross(ab, found))), vec2f(0.0));
        return vec3f(max(1.0 - better.x - better.y, 0.0), better);
    }
    // The edge that is passed by most.
    let is_second = second <= first && second <= third;
    let is_third = third < second && third <= first;
    let is_first = !is_second && !is_third;
    let start = select(a, a + ab, is_first);
    let edge = select(select(ab, ac, is_second), ac - ab, is_first);
    // Both seen along the ray.
    let along = ray / dot(ray, ray);
    let p = start - along * dot(start, ray);
    let e = edge - along * dot(edge, ray);
    let s = clamp(-dot(p, e) / max(dot(e, e), 1e-37), 0.0, 1.0);
    return select(select(vec3f(1.0 - s, s, 0.0), vec3f(1.0 - s, 0.0, s), is_second), vec3f(0.0, 1.0 - s, s), is_first);
}

struct Targets {
    @location(0) position: vec4f,
    @location(1) surface: vec4u,
}

@fragment
fn fragment(in: Fragment) -> Targets {
    let m = materials[in.material];
    let uv_dx = dpdx(in.uv);
    let uv_dy = dpdy(in.uv);
    // The winding decides, not the rasteriser: the same rule as for rays.
    let a = in.corner - ray_start(in.clip.xy);
    let front = dot(in.normal, to_eye(in.corner)) >= 0.0;
    let exact = weights_at(pixel_ray(in.clip.xy), a, in.second, in.third, select(-1.0, 1.0, front));
    let off_edges = max(exact, in.least);
    let w = off_edges / (off_edges.x + off_edges.y + off_edges.z);
    let uv = w.x * in.uvs.xy + w.y * in.uvs.zw + w.z * in.last_uv;
    let off = w.x * taken_off(in.colors.x) + w.y * taken_off(in.colors.y) + w.z * taken_off(in.colors.z);
    if masked_out(m, vec3f(uv, off.a)) || (!front && m.double_sided == 0u) {
        discard;
    }
    var albedo = m.base_color.rgb * (1.0 - off.rgb);
    if m.texture > 0u {
        albedo *= texture_seen(m, uv, uv_dx, uv_dy).rgb;
    }
    // From the first corner: however the weights are rounded, this lies on the triangle.
    let position = in.corner + (w.y * in.second + w.z * in.third);
    let normal = select(-in.normal, in.normal, front);
    // The projection has no far plane: the camera's is here.
    let depth = max(dot(position - frame.eye, frame.forward), 1e-3 * frame.near);
    if depth > frame.far {
        discard;
    }
    let n = in.shading_normals;
    var shading = w.x * octahedral_decode(n.x) + w.y * octahedral_decode(n.y) + w.z * octahedral_decode(n.z);
    shading = normalize(select(shading, in.normal, dot(shading, shading) < 1e-12));
    shading = select(-shading, shading, dot(shading, normal) >= 0.0);
    return Targets(vec4f(position, depth), surface_words(normal, shading, albedo, in.triangle));
}
