//! What is drawn, as the pixels of a file: averaged, with alpha, and cut.

use crate::frame::Pixels;
use rayon::prelude::*;
use std::array::from_fn;

/// A byte of an sRGB channel, or what lies between two, as light: IEC 61966-2-1.
fn light(byte: f32) -> f32 {
    let c = byte / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// The other way round.
fn byte(light: f32) -> u8 {
    let c = if light <= 0.0031308 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (c * 255.0).round() as u8
}

/// Makes one pixel of each `n` × `n` of a picture whose colours are multiplied by their alpha, which those of the result are not.
///
/// Means are taken of light, not of the sRGB numbers that stand for it: half a white pixel beside half a black one sends out half the light of
/// white, which is the number 188 and not 128. Each pixel counts by its alpha; that of the result is the share that surfaces cover.
pub fn averaged(picture: &Pixels, n: u32) -> Pixels {
    let lights: [f32; 256] = from_fn(|i| light(i as f32));
    let size = picture.size.map(|side| side / n);
    let (n, width, wide) = (n as usize, size[0] as usize, picture.size[0] as usize);
    let one = |x: usize, y: usize| -> [u8; 4] {
        let (mut sum, mut covered, mut first) = ([0.0; 3], 0u32, None);
        for row in y * n..(y + 1) * n {
            let from = 4 * (row * wide + x * n);
            for p in picture.rgba[from..from + 4 * n].chunks_exact(4) {
                let alpha = u32::from(p[3]);
                covered += alpha;
                first.get_or_insert([p[0], p[1], p[2], p[3]]);
                match p[3] {
                    0 => {}
                    255 => (0..3).for_each(|i| sum[i] += lights[p[i] as usize]),
                    _ => {
                        let share = alpha as f32 / 255.0;
                        (0..3).for_each(|i| sum[i] += share * light((f32::from(p[i]) / share).min(255.0)));
                    }
                }
            }
        }
        match (first, covered) {
            // Nothing to average.
            (Some(pixel), 255) if n == 1 => pixel,
            (_, 0) => [0; 4],
            _ => {
                let [r, g, b] = sum.map(|sum| byte((sum * 255.0 / covered as f32).min(1.0)));
                [r, g, b, (covered as f32 / (n * n) as f32).round() as u8]
            }
        }
    };
    let mut rgba = vec![0; 4 * width * size[1] as usize];
    rgba.par_chunks_exact_mut(4 * width).enumerate().for_each(|(y, row)| {
        row.chunks_exact_mut(4).enumerate().for_each(|(x, pixel)| pixel.copy_from_slice(&one(x, y)));
    });
    Pixels { size, rgba }
}

/// The part of a list of values, one a pixel, rows from the top: left, top, width and height.
pub fn cut<T: Copy>(values: &[T], width: u32, [left, top, w, h]: [u32; 4]) -> Vec<T> {
    let rows = values.chunks_exact(width as usize).skip(top as usize).take(h as usize);
    rows.flat_map(|row| &row[left as usize..(left + w) as usize]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(size: [u32; 2], pixels: &[[u8; 4]]) -> Pixels {
        Pixels { size, rgba: pixels.concat() }
    }

    /// Half white, half black is half the light; what is not there takes no part in the colour, only in the alpha.
    #[test]
    fn means_are_of_light_and_of_what_is_there() {
        let [white, black, none] = [[255; 4], [0, 0, 0, 255], [0; 4]];
        let mean = |all: &[[u8; 4]]| averaged(&pixels([2, 2], all), 2).rgba;
        assert_eq!(mean(&[white, black, black, white]), [188, 188, 188, 255]);
        assert_eq!(mean(&[white, none, none, none]), [255, 255, 255, 64]);
        assert_eq!(mean(&[white, black, none, none]), [188, 188, 188, 128]);
        assert_eq!(mean(&[none; 4]), [0; 4]);
        // Half of a colour, multiplied by its alpha, is that colour.
        assert_eq!(averaged(&pixels([1, 1], &[[100, 50, 0, 128]]), 1).rgba, [199, 100, 0, 128]);
        for byte in 0..=255 {
            let flat = [byte, 255 - byte, byte, 255];
            assert_eq!(mean(&[flat; 4]), flat, "what is even stays as it is");
            assert_eq!(averaged(&pixels([1, 1], &[flat]), 1).rgba, flat);
        }
    }

    #[test]
    fn a_cut_is_a_part_of_the_rows() {
        let all: Vec<u32> = (0..20).collect();
        assert_eq!(cut(&all, 5, [1, 2, 3, 2]), [11, 12, 13, 16, 17, 18]);
        assert_eq!(cut(&all, 5, [0, 0, 5, 4]), all);
    }
}
