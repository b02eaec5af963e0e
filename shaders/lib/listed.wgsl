// Pixels whose visibility a ray is to decide.

struct Listed {
    // x, and y times 65536.
    pixel: u32,
    // Parameter of its shadow ray beyond which nothing can block it.
    end: f32,
}

var<storage, read_write> listed: array<Listed>;
var<storage, read_write> listed_count: atomic<u32>;

// Most workgroups of 64 pixels along x.
const listed_row = 32768u;

// Which of the listed pixels a thread takes, of how many.
fn listed_index(id: vec3u) -> u32 {
    return id.x + id.y * listed_row * 64u;
}

fn listed_number() -> u32 {
    return min(atomicLoad(&listed_count), arrayLength(&listed));
}

fn listed_pixel(i: u32) -> vec2u {
    let both = listed[i].pixel;
    return vec2u(both & 0xffffu, both >> 16u);
}

// The order in the list changes nothing: each ray writes its own pixel.
fn list_ray(pixel: vec2u, end: f32) {
    let i = atomicAdd(&listed_count, 1u);
    if i < arrayLength(&listed) {
        listed[i] = Listed(pixel.x | (pixel.y << 16u), end);
    }
}
