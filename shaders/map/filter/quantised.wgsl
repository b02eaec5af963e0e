// Whole numbers hold four moments turned into a basis that fills them evenly (Peters, Klein 2015, section 3.4): each row of `b` times
// these columns, and back. All are from 0 to 1.

fn packed(b: vec4f) -> vec4f {
    return vec4f(dot(b, vec4f(-2.07224649, 32.23703778, -68.571074599, 39.3703274134)) + 0.035955884801,
                 dot(b, vec4f(13.7948857237, -59.4683975703, 82.0359750338, -35.364903257)),
                 dot(b, vec4f(0.105877704, -1.9077466311, 9.3496555107, -6.6543490743)),
                 dot(b, vec4f(9.7924062118, -33.7652110555, 47.9456096605, -23.9728048165)));
}

fn unpacked(packed: vec4f) -> vec4f {
    let p = packed - vec4f(0.035955884801, 0.0, 0.0, 0.0);
    return vec4f(dot(p, vec4f(0.2227744146, 0.0771972861, 0.7926986636, 0.0319417555)),
                 dot(p, vec4f(0.1549679261, 0.1394629426, 0.7963415838, -0.1722823173)),
                 dot(p, vec4f(0.1451988946, 0.2120202157, 0.7258694464, -0.2758014811)),
                 dot(p, vec4f(0.163127443, 0.2591432266, 0.6539092497, -0.3376131734)));
}
