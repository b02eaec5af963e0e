//! Figure sheets: rows × columns of pictures with labels, magnified insets, one legend and measured numbers, for papers.
//!
//! A [`Spec`] says what a sheet shows, [`draw`] renders its cells and lays them out ([`layout`]) as a [`Sheet`], and [`write()`] makes files of
//! it, each from the same list of items: PNG, SVG, PDF and a LaTeX snippet.

mod compose;
pub mod layout;
mod pdf;
mod spec;
mod tex;
mod write;

pub use compose::{Cell, Item, Sheet, draw};
pub use spec::{
    Axis, Change, FRAMES, Inset, Kind, MOST_INSETS, Place, Spec, WIDTHS, Width, has_sheet, is_figure, measurable,
};
pub use write::{Format, pixels, write};

/// The specs that come with the program, by name.
pub const BUILT_IN: [(&str, &str); 2] = [
    ("compare", include_str!("../../assets/figures/compare.toml")),
    ("tour", include_str!("../../assets/figures/tour.toml")),
];

/// Keyword of the PNG text chunk (iTXt) that holds a sheet's spec as TOML, and name of the SVG's element.
pub const KEYWORD: &str = "shadowscope-figure";
