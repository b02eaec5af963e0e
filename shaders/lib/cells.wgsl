// A cell's column and row (below 16384) in one float of `map_out`: as bits, since 24 bits of precision are too few.

fn cell_value(cell: vec2u) -> f32 {
    return bitcast<f32>(0x10000000u | (cell.y << 14u) | cell.x);
}

fn cell_of(value: f32) -> vec2u {
    let bits = bitcast<u32>(value);
    return vec2u(bits & 16383u, (bits >> 14u) & 16383u);
}
