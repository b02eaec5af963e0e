//! Numbers that look random and are the same at every run.

use glam::{Vec2, Vec3, vec3};
use std::f32::consts::TAU;

/// Pseudo-random numbers (PCG32, O'Neill 2014), the same for a seed at every run.
pub struct Rng(u64);

impl Rng {
    pub fn new(seed: u64) -> Self {
        let mut rng = Self(seed.wrapping_add(0x853c_49e6_748f_ea9b));
        rng.bits();
        rng
    }

    /// 32 even bits.
    pub fn bits(&mut self) -> u32 {
        let old = self.0;
        self.0 = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((old >> 18) ^ old) >> 27) as u32;
        mixed.rotate_right((old >> 59) as u32)
    }

    /// From 0 to below 1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / 16_777_216.0
    }

    /// From `low` to below `high`.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// From 0 to below `count`.
    pub fn index(&mut self, count: usize) -> usize {
        ((u64::from(self.bits()) * count as u64) >> 32) as usize
    }

    /// Even over the unit sphere.
    pub fn direction(&mut self) -> Vec3 {
        let y = self.range(-1.0, 1.0);
        let angle = self.range(0.0, TAU);
        let r = (1.0 - y * y).max(0.0).sqrt();
        vec3(r * angle.cos(), y, r * angle.sin())
    }
}

/// Smooth value noise, 0 to 1, one hill per unit. `period` > 0: repeats after as many units.
pub fn noise(p: Vec2, seed: u32, period: i32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (3.0 - 2.0 * f);
    let value = |dx: i32, dy: i32| {
        let wrap = |v: i32| if period > 0 { v.rem_euclid(period) } else { v };
        let x = wrap(cell.x as i32 + dx) as u32;
        let y = wrap(cell.y as i32 + dy) as u32;
        let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
        h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
        ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
    };
    let low = value(0, 0) + (value(1, 0) - value(0, 0)) * s.x;
    let high = value(0, 1) + (value(1, 1) - value(0, 1)) * s.x;
    low + (high - low) * s.y
}

/// Noise of `octaves` sizes, each half the one before, about 0 to 1.
pub fn fbm(p: Vec2, seed: u32, period: i32, octaves: u32) -> f32 {
    let mut sum = 0.0;
    let mut weight = 0.5;
    for octave in 0..octaves {
        let scale = (1 << octave) as f32;
        sum += weight * noise(p * scale, seed + octave, period << octave);
        weight *= 0.5;
    }
    sum / (1.0 - 2.0 * weight)
}
