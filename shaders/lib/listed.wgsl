// Pixels whose visibility a ray is to decide.

struct Listed {
    // x, and y times 65536.
    pixel: u32,
    // Parameter of its shadow ray beyond which nothing can block it.
    end: f32,
}

var<storage, read_write> listed: array<Listed>;
var<storage, read_write> listed_count: atomic<u32>;

// The order in the list changes nothing: each ray writes its own pixel.
fn list_ray(pixel: vec2u, end: f32) {
    let i = atomicAdd(&listed_count, 1u);
    if i < arrayLength(&listed) {
        listed[i] = Listed(pixel.x | (pixel.y << 16u), end);
    }
}
