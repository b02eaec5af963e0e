//! Shadowscope: shadow techniques side by side with ray-traced truth.
//!
//! The map of the house, in the order of the data:
//! [`setup`] (what to draw), [`path`] (how it moves) → [`scene`] (glTF and built-in scenes, flattened) → [`frame`] (G-buffer,
//! technique, truth, picture) → [`measure`] (errors and times) → [`cli`] and [`ui`].
//! Underneath: [`gpu`] (device, passes bound by name), [`mod@params`] (declared once), [`light`],
//! [`map`] (where shadow maps look × how they are looked up), [`flatland`] (the same in two dimensions),
//! [`techniques`] (a file each), [`contact`] (shadows on top of any of them), [`truth`] (the exact shadow, band by band), [`view`] (ways to look, in colours of [`palette`], explained by a [`legend`]), [`capture`] (pictures with their set-up inside), [`figure`] (sheets of them for papers).
//! [`lessons`], [`glossary`] and [`gallery`] are files that explain.
//! [`files`] reads and writes, [`message`] quotes.

pub mod capture;
pub mod chart;
pub mod cli;
pub mod contact;
pub mod figure;
pub mod files;
pub mod flatland;
pub mod frame;
pub mod gallery;
pub mod glossary;
pub mod gpu;
pub mod legend;
pub mod lessons;
pub mod light;
pub mod listed_rays;
pub mod map;
pub mod measure;
pub mod message;
pub mod palette;
pub mod params;
pub mod path;
pub mod scene;
pub mod sequence;
pub mod setup;
pub mod techniques;
pub mod truth;
pub mod ui;
pub mod view;
