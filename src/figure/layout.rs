//! Where everything of a sheet lies, in whole pixels, so that each picture keeps its own.

use super::spec::{Inset, Place, Spec, WIDTHS, Width};
use anyhow::{Result, ensure};

/// A rectangle of whole pixels: left, top, width, height.
pub type Area = [u32; 4];

/// Widest and highest sheet, and most pixels of one.
const WIDEST: u32 = 32768;
const MOST_PIXELS: u64 = 1 << 28;

/// Lengths of a sheet, pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Of the whole sheet.
    pub width: u32,
    /// Size of the text.
    pub font: f64,
    /// Between cells, and between a picture and its insets.
    pub gap: u32,
    pub inner: u32,
    /// Room for the rows' labels.
    pub left: u32,
    /// A picture's width, and that of a cell with what stands beside.
    pub picture: u32,
    pub cell: u32,
}

/// A picture's insets: the texels that each shows, and where in its cell, counted from the picture's corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boxed {
    pub texels: Area,
    pub at: Area,
}

impl Grid {
    /// The lengths of a sheet of so many columns. `shapes`: height over width of all pictures; `labels`: lines of the rows' labels at most.
    ///
    /// # Errors
    /// No room for the pictures.
    pub fn new(spec: &Spec, columns: usize, shapes: &[f64], labels: usize) -> Result<Grid> {
        let font = spec.font_size * f64::from(spec.dpi) / 72.0;
        let mm = |mm: f64| (mm / 25.4 * f64::from(spec.dpi)).round() as u32;
        let gap = mm(spec.gap);
        let inner = gap.div_ceil(2);
        let left = if labels > 0 { (labels as f64 * LINE * font + 0.3 * font).round() as u32 } else { 0 };
        let columns = columns as u32;
        let around = left + columns.saturating_sub(1) * gap;
        // Beside a picture of width p and height r p stand n insets of one width, whose heights and gaps add up to its height.
        let beside = spec.insets_at == Place::Beside && !spec.insets.is_empty();
        let gaps = f64::from(inner) * (spec.insets.len().saturating_sub(1)) as f64;
        let slender = |r: f64| spec.insets.iter().map(|inset| r * inset.at[3] / inset.at[2]).sum::<f64>();
        let narrow = |p: f64, r: f64| ((r * p - gaps) / slender(r)).max(1.0);
        let cell_of = |p: u32| {
            let widths = shapes.iter().map(|r| narrow(p.into(), *r).round() as u32);
            if beside { p + inner + widths.max().unwrap_or(0) } else { p }
        };
        let (picture, cell, width) = match spec.width {
            Width::Picture(pixels) => (pixels, cell_of(pixels), around + columns * cell_of(pixels)),
            Width::Journal(_) | Width::Mm(_) => {
                let width = mm(spec.width.mm().unwrap_or(0.0));
                let cell = width.saturating_sub(around) / columns.max(1);
                let mut picture = cell;
                if beside {
                    let fits = |r: &f64| {
                        let s = slender(*r);
                        (f64::from(cell.saturating_sub(inner)) + gaps / s) / (1.0 + r / s)
                    };
                    picture = shapes.iter().map(fits).fold(f64::from(cell), f64::min).floor().max(0.0) as u32;
                }
                (picture, cell, width)
            }
        };
        ensure!(
            picture >= 16,
            "{width} pixels leave {picture} for each of {columns} pictures, and each needs 16: take a larger width or dpi, or fewer columns"
        );
        check_size([width, 1])?;
        Ok(Grid { width, font, gap, inner, left, picture, cell })
    }

    /// Left edge of a column's cells.
    pub fn column(&self, i: usize) -> u32 {
        self.left + i as u32 * (self.cell + self.gap)
    }

    /// Where a picture's insets lie, which is of this size.
    pub fn insets(&self, spec: &Spec, [w, h]: [u32; 2]) -> Vec<Boxed> {
        let texels = |inset: &Inset| {
            let part = |at: f64, length: f64, side: u32| {
                let start = ((at * f64::from(side)).round() as u32).min(side - 1);
                [start, ((length * f64::from(side)).round() as u32).clamp(1, side - start)]
            };
            let ([x, w], [y, h]) = (part(inset.at[0], inset.at[2], w), part(inset.at[1], inset.at[3], h));
            [x, y, w, h]
        };
        let texels: Vec<Area> = spec.insets.iter().map(texels).collect();
        let gaps = self.inner * (texels.len() as u32).saturating_sub(1);
        let shape = |[.., w, h]: &Area| f64::from(*w) / f64::from(*h);
        let mut out = Vec::new();
        match spec.insets_at {
            // One height, widths that add up to the picture's.
            Place::Below => {
                let all: f64 = texels.iter().map(shape).sum();
                let room = f64::from(w.saturating_sub(gaps));
                let height = (room / all).min(f64::from(h)).max(1.0);
                let mut sum = 0.0;
                for (i, texels) in texels.into_iter().enumerate() {
                    let start = sum;
                    sum += height * shape(&texels);
                    let (from, to) = (f64::round(start) as u32, f64::round(sum) as u32);
                    let at = [from + i as u32 * self.inner, h + self.inner, (to - from).max(1), height.round() as u32];
                    out.push(Boxed { texels, at });
                }
            }
            // One width, heights that add up to the picture's.
            Place::Beside => {
                let all: f64 = texels.iter().map(|t| 1.0 / shape(t)).sum();
                let room = f64::from(h.saturating_sub(gaps));
                let most = f64::from(self.cell.saturating_sub(w + self.inner));
                let width = (room / all).min(most).max(1.0);
                let mut sum = 0.0;
                for (i, texels) in texels.into_iter().enumerate() {
                    let start = sum;
                    sum += width / shape(&texels);
                    let (from, to) = (f64::round(start) as u32, f64::round(sum) as u32);
                    let at = [w + self.inner, from + i as u32 * self.inner, width.round() as u32, (to - from).max(1)];
                    out.push(Boxed { texels, at });
                }
            }
        }
        out
    }

    /// Height of so many lines of text of a size.
    pub fn lines(&self, count: usize, size: f64) -> u32 {
        (count as f64 * LINE * size).ceil() as u32
    }
}

/// Distance of two base lines over the text's size.
pub const LINE: f64 = 1.25;

impl Width {
    /// Millimetres; None: as wide as its pictures make it.
    pub fn mm(&self) -> Option<f64> {
        match self {
            Width::Journal(name) => WIDTHS.iter().find(|w| w.0 == *name).map(|w| w.1),
            Width::Mm(mm) => Some(*mm),
            Width::Picture(_) => None,
        }
    }
}

/// Refuses sheets that no program would open.
pub fn check_size([width, height]: [u32; 2]) -> Result<()> {
    ensure!(
        width <= WIDEST && height <= WIDEST && u64::from(width) * u64::from(height) <= MOST_PIXELS,
        "the sheet would have {width} × {height} pixels; take fewer rows or columns, smaller pictures or a smaller dpi"
    );
    Ok(())
}

/// The texel that each of so many pixels shows, of so many from `first` on: the nearest.
pub fn nearest(first: u32, texels: u32, pixels: u32) -> impl Iterator<Item = u32> {
    (0..u64::from(pixels)).map(move |i| first + ((2 * i + 1) * u64::from(texels) / (2 * u64::from(pixels))) as u32)
}
