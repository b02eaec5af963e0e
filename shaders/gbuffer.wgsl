//!include lib/frame.wgsl
//!include lib/scene.wgsl
//!include lib/color.wgsl
// The G-buffer. Each triangle has vertices of its own here, so that its number needs no device feature.

struct Fragment {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) shading_normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) @interpolate(flat) triangle: u32,
    @location(4) @interpolate(flat) material: u32,
    @location(5) @interpolate(flat) normal: vec3f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let triangle = index / 3u;
    let corners = triangles[triangle];
    let a = vertices[corners.x].position;
    let normal = cross(vertices[corners.y].position - a, vertices[corners.z].position - a);
    let v = vertices[corners[index % 3u]];
    var out: Fragment;
    out.clip = frame.view_proj * vec4f(v.position, 1.0);
    out.position = v.position;
    out.shading_normal = octahedral_decode(v.normal);
    out.uv = v.uv;
    out.triangle = triangle;
    out.material = v.material;
    out.normal = normal / max(length(normal), 1e-37);
    return out;
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
    let front = dot(in.normal, frame.eye - in.position) >= 0.0;
    if masked_out(m, in.uv) || (!front && m.double_sided == 0u) {
        discard;
    }
    var albedo = m.base_color.rgb;
    if m.texture > 0u {
        albedo *= textureSampleGrad(textures, texture_sampler, material_uv(m, in.uv), m.texture - 1u, uv_dx, uv_dy).rgb;
    }
    let normal = select(-in.normal, in.normal, front);
    var shading = normalize(in.shading_normal);
    shading = select(-shading, shading, dot(shading, normal) >= 0.0);
    // Albedo is kept sRGB-encoded: eight bits band less so.
    let packed = pack4x8unorm(vec4f(linear_to_srgb(saturate(albedo)), 1.0));
    let depth = dot(in.position - frame.eye, frame.forward);
    return Targets(vec4f(in.position, depth), vec4u(octahedral_encode(normal), octahedral_encode(shading), packed, in.triangle));
}
