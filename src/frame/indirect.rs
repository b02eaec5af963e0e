//! Light that surfaces throw back, in a buffer of its own, which a technique offers beside its visibility.

use super::Frame;

/// Indirect light, and how much of the other light the shaded picture has beside it.
#[derive(Clone)]
pub struct Indirect {
    /// Irradiance of each pixel, relative to white, in the first three channels.
    pub view: wgpu::TextureView,
    /// Shares of the direct and of the constant ambient light, 0 to 1.
    pub direct: f32,
    pub ambient: f32,
}

impl Frame<'_> {
    /// Has the shaded picture add the light to what the visibility lets through.
    pub fn offer_indirect(&mut self, light: Indirect) {
        self.indirect = Some(light);
    }
}
