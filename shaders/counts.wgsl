//!include lib/frame.wgsl
//!include lib/counting.wgsl
// Draws the counts of view samples: the maps side by side, fitted into the picture.

var map_out: texture_storage_2d<r32float, write>;

// Beside the maps.
const nothing = -1.0;

@compute @workgroup_size(8, 8)
fn draw_counts(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= frame.size.y {
        return;
    }
    let columns = u32(ceil(sqrt(f32(counting.layers))));
    let rows = (counting.layers + columns - 1u) / columns;
    let whole = vec2f(counting.size * vec2u(columns, rows));
    let picture = vec2f(frame.size);
    let scale = max(whole.x / picture.x, whole.y / picture.y);
    let middle = (vec2f(id.xy) + 0.5 - 0.5 * picture) * scale + 0.5 * whole;
    if any(middle < vec2f(0.0)) || any(middle >= whole) {
        textureStore(map_out, id.xy, vec4f(nothing));
        return;
    }
    let tile = vec2u(middle) / counting.size;
    let layer = tile.y * columns + tile.x;
    let inner = middle - vec2f(tile * counting.size);
    // Texels larger than a pixel: the one under its middle; smaller: the mean of those that it covers, at 32 × 32 places
    // at most.
    let half = select(0.0, 0.5 * scale, scale > 1.0);
    let steps = select(1u, u32(clamp(2.0 * ceil(scale), 1.0, 32.0)), scale > 1.0);
    var sum = 0.0;
    var seen = 0.0;
    for (var i = 0u; i < steps * steps; i++) {
        let at = (vec2f(vec2u(i % steps, i / steps)) + 0.5) / f32(steps);
        let texel = clamp(inner + (2.0 * at - 1.0) * half, vec2f(0.0), vec2f(counting.size) - 0.5);
        let cell = vec2u(texel);
        let index = (layer * counting.size.y + cell.y) * counting.size.x + cell.x - counting.first;
        if index < counting.count {
            sum += f32(atomicLoad(&counts[index]));
            seen += 1.0;
        }
    }
    // Each band of texels draws its own pixels.
    let first = (layer * counting.size.y + u32(inner.y)) * counting.size.x + u32(inner.x) - counting.first;
    // A line of a pixel parts neighbouring maps.
    let parted = counting.layers > 1u && any(inner < vec2f(scale));
    let side = select(0u, counting.sides[min(layer, 7u) / 4u][min(layer, 7u) % 4u], layer < 8u);
    let beside = side > 0u && any(inner >= vec2f(f32(side)));
    if beside || layer >= counting.layers || parted {
        textureStore(map_out, id.xy, vec4f(nothing));
    } else if first < counting.count {
        textureStore(map_out, id.xy, vec4f(sum / seen));
    }
}
