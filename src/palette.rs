//! The colours of views, declared once: shaders get them as text, legends as values.

/// Red, green and blue, 0 to 1, sRGB-encoded.
pub type Rgb = [f32; 3];

/// Stops at equal distances, between which colours are mixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette {
    /// Name of the function in WGSL that gives the colour at a place from 0 to 1.
    pub name: &'static str,
    pub stops: &'static [Rgb],
}

/// From black to white.
pub const GREY: Palette = Palette { name: "grey", stops: &[[0.0; 3], [1.0; 3]] };

/// Dark violet over blue and green to yellow: steps of equal lightness, readable by the colour-blind.
pub const RAMP: Palette =
    Palette { name: "ramp", stops: &[[0.27, 0.00, 0.33], [0.19, 0.41, 0.56], [0.21, 0.72, 0.47], [0.99, 0.91, 0.14]] };

/// Powers of two: pale blue (2⁻⁴ and less) over green (1) and ochre (2) to dark red (2⁴ and more). Lightness falls all the
/// way, so that grey and the colour-blind's hues tell both sides apart.
pub const OCTAVES: Palette = Palette {
    name: "octaves",
    stops: &[
        [0.80, 0.90, 1.00],
        [0.66, 0.83, 0.97],
        [0.50, 0.76, 0.90],
        [0.37, 0.71, 0.72],
        [0.30, 0.65, 0.32],
        [0.72, 0.47, 0.08],
        [0.76, 0.28, 0.08],
        [0.58, 0.10, 0.12],
        [0.30, 0.03, 0.14],
    ],
};

/// Blue over pale grey to orange: less and more than the middle.
pub const DIVERGING: Palette = Palette {
    name: "diverging",
    stops: &[[0.02, 0.30, 0.62], [0.45, 0.68, 0.86], [0.93, 0.93, 0.93], [0.95, 0.65, 0.36], [0.70, 0.22, 0.02]],
};

/// Palettes that shaders draw with.
const DRAWN: [Palette; 3] = [RAMP, OCTAVES, DIVERGING];

/// Single colours that classes are told by: Okabe and Ito 2008, hues that the colour-blind tell apart; neighbours differ in
/// lightness too. The last is white. Cascades take them in this order.
pub const LABELS: [Rgb; 9] = [
    [0.84, 0.37, 0.00],
    [0.94, 0.89, 0.26],
    [0.00, 0.62, 0.45],
    [0.34, 0.71, 0.91],
    [0.00, 0.45, 0.70],
    [0.80, 0.47, 0.65],
    [0.90, 0.62, 0.00],
    [0.55, 0.55, 0.58],
    [1.0, 1.0, 1.0],
];

/// What caused an error, as [`crate::measure::causes::CAUSES`] has it.
pub const CAUSE_COLORS: [Rgb; 5] = [LABELS[6], LABELS[3], LABELS[4], LABELS[5], LABELS[2]];

/// Lit, but should be in shadow.
pub const LEAK: Rgb = [0.10, 0.25, 1.00];
/// In shadow, but should be lit.
pub const FALSE_SHADOW: Rgb = [0.95, 0.12, 0.10];

impl Palette {
    /// The colour at a place from 0 to 1.
    pub const fn at(&self, x: f32) -> Rgb {
        let last = self.stops.len() - 1;
        let t = x.clamp(0.0, 1.0) * last as f32;
        let i = if (t as usize) < last { t as usize } else { last - 1 };
        let (a, b, share) = (self.stops[i], self.stops[i + 1], t - i as f32);
        [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share]
    }
}

/// A colour as eight bits a channel.
pub fn bytes(color: Rgb) -> [u8; 3] {
    color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// The file `palettes.wgsl` that shaders include: `fn ramp(x: f32) -> vec3f` and so on, `fn label_color(i: u32)`, `fn
/// cause_color(i: u32)`, and the colours of errors.
pub fn wgsl() -> String {
    let vector = |c: &Rgb| format!("vec3f({:?}, {:?}, {:?})", c[0], c[1], c[2]);
    let array = |colors: &[Rgb]| {
        let all: Vec<String> = colors.iter().map(vector).collect();
        format!("array<vec3f, {}>({})", colors.len(), all.join(", "))
    };
    let mut out = String::new();
    for p in DRAWN {
        let last = p.stops.len() - 1;
        out += &format!(
            "fn {}(x: f32) -> vec3f {{\n    let stops = {};\n    let t = saturate(x) * {last}.0;\n    let i = min(u32(t), {}u);\n    return mix(stops[i], stops[i + 1u], t - f32(i));\n}}\n",
            p.name,
            array(p.stops),
            last - 1
        );
    }
    for (name, colors) in [("label_color", &LABELS[..]), ("cause_color", &CAUSE_COLORS)] {
        let last = colors.len() - 1;
        out += &format!(
            "fn {name}(i: u32) -> vec3f {{\n    let colors = {};\n    return colors[min(i, {last}u)];\n}}\n",
            array(colors)
        );
    }
    out + &format!("const leak_color = {};\nconst false_shadow_color = {};\n", vector(&LEAK), vector(&FALSE_SHADOW))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn palettes_run_through_their_stops() {
        for p in DRAWN.into_iter().chain([GREY]) {
            let last = (p.stops.len() - 1) as f32;
            for (i, stop) in p.stops.iter().enumerate() {
                let at = p.at(i as f32 / last);
                assert!((0..3).all(|c| (at[c] - stop[c]).abs() < 1e-5), "{} {i}: {at:?}", p.name);
            }
            assert_eq!(p.at(-1.0), p.stops[0]);
            assert_eq!(p.at(2.0), p.at(1.0));
        }
    }
}
