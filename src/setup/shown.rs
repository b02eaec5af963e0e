//! What captures make of a set-up's picture: how many pixels are drawn for one, and the part that the file shows.

use super::{MAX_SIZE, Setup};
use crate::view::View;
use anyhow::{Context, Result, bail, ensure};

/// Most pixels, across and down, that are drawn for one of a capture.
pub const MAX_SUPERSAMPLE: u32 = 4;

/// A rectangle of the picture: left, top, width and height as shares of its sides.
pub type Crop = [f32; 4];

impl Setup {
    /// Pixels, across and down, that are drawn for one of a capture: as many as it asks for, where what it shows is a picture whose pixels may
    /// be averaged. Values, classes and charts are drawn once a pixel: the mean of two colours of a scale or of two classes is the colour
    /// of neither.
    pub fn drawn_for_one(&self) -> u32 {
        if self.is_picture() { self.supersample } else { 1 }
    }

    /// Whether what is shown is a picture: of light and surfaces, or with what lies on surfaces over it.
    pub fn is_picture(&self) -> bool {
        match &self.overlay {
            Some(overlay) => self.find_view(&overlay.view).is_some_and(View::lies_on_surfaces),
            None => self.find_view(&self.view).is_some_and(View::is_picture),
        }
    }

    /// What of the set-up its captures leave aside, a sentence.
    pub fn left_aside(&self) -> Option<String> {
        let of = self.overlay.as_ref().map_or(&self.view, |overlay| &overlay.view);
        (self.supersample > self.drawn_for_one()).then(|| {
            format!("Not supersampled: {of} shows values, classes or a chart, whose colours mean nothing when mixed.")
        })
    }

    /// The set-up as it is drawn, `n` × `n` pixels for one: what is set in pixels of the file, or falls on one, still is and does.
    pub fn enlarged(&self, n: u32) -> Setup {
        let [width, height] = self.size;
        let line = (self.split * width as f32).round() / width as f32;
        Setup {
            size: [width * n, height * n],
            split: if n > 1 { line } else { self.split },
            error_dilation: self.error_dilation * n,
            ..self.clone()
        }
    }

    /// The part of the picture that captures show: left, top, width and height, pixels.
    pub fn part(&self) -> [u32; 4] {
        let [w, h] = self.size;
        let Some([x, y, across, down]) = self.crop else { return [0, 0, w, h] };
        let length = |share: f32, side: u32| ((share * side as f32).round() as u32).clamp(1, side.max(1));
        let start = |share: f32, side: u32, length: u32| ((share * side as f32).round() as u32).min(side - length);
        let size = [length(across, w), length(down, h)];
        [start(x, w, size[0]), start(y, h, size[1]), size[0], size[1]]
    }

    /// Lets captures show this part of the picture: left, top, width and height, pixels.
    pub fn crop_to(&mut self, [x, y, w, h]: [u32; 4]) {
        let [width, height] = self.size;
        let length = |length: u32, side: u32| length.clamp(1, side);
        let (w, h) = (length(w, width), length(h, height));
        let (x, y) = (x.min(width - w), y.min(height - h));
        let share = |pixels: u32, side: u32| pixels as f32 / side as f32;
        let all = [x, y, w, h] == [0, 0, width, height];
        self.crop = (!all).then(|| [share(x, width), share(y, height), share(w, width), share(h, height)]);
    }

    /// The size of the whole picture where the part that captures show has this size.
    pub fn size_around(&self, part: [u32; 2]) -> [u32; 2] {
        let Some([.., across, down]) = self.crop else { return part };
        // Sizes beyond all bounds are refused elsewhere.
        let whole = |part: u32, share: f32| (f64::from(part) / f64::from(share)).round() as u32;
        [whole(part[0], across), whole(part[1], down)]
    }

    /// Checks what only captures need.
    pub(super) fn check_shown(&self) -> Result<()> {
        let n = self.supersample;
        ensure!(
            (1..=MAX_SUPERSAMPLE).contains(&n),
            "supersample = {n} is not allowed; it takes 1 to {MAX_SUPERSAMPLE} pixels across and down"
        );
        let [w, h] = self.size;
        ensure!(
            w.max(h) * n <= MAX_SIZE,
            "supersample = {n} draws {} × {} pixels for {w} × {h}; {MAX_SIZE} a side is the most: take a smaller size or supersample less",
            w * n,
            h * n
        );
        if let Some([x, y, w, h]) = self.crop {
            let inside = [x, y, w, h].iter().all(|share| (0.0..=1.0).contains(share)) && w > 0.0 && h > 0.0;
            // Shares made of pixels may miss 1 by a rounding.
            ensure!(
                inside && x + w <= 1.0 + 1e-5 && y + h <= 1.0 + 1e-5,
                "crop = [{x}, {y}, {w}, {h}] is not allowed; it takes left, top, width and height of a part of the picture as shares of its \
                 sides, 0 to 1"
            );
        }
        Ok(())
    }
}

/// Reads `--crop`: left, top, width and height of a picture of this size, each as a share of the side or as pixels (`320px`).
pub fn parse_crop(text: &str, size: [u32; 2]) -> Result<Option<Crop>> {
    if text == "none" {
        return Ok(None);
    }
    let form = || {
        format!(
            "--crop {text}: write it as X,Y,WIDTH,HEIGHT in shares, such as 0.25,0,0.5,1, or in pixels, such as 320px,0px,640px,720px; or none"
        )
    };
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let [x, y, w, h] = parts[..] else { bail!(form()) };
    let share = |(text, side): (&str, u32)| match text.strip_suffix("px") {
        Some(pixels) => pixels.parse::<u32>().map(|pixels| pixels as f32 / side as f32).with_context(form),
        None => text.parse().with_context(form),
    };
    let shares = [(x, size[0]), (y, size[1]), (w, size[0]), (h, size[1])];
    Ok(Some([share(shares[0])?, share(shares[1])?, share(shares[2])?, share(shares[3])?]))
}
