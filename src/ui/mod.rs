//! The window.
//!
//! A pass runs from `shell::layout` (input to changes of the `Model`) to `canvas` (what changed of picture and panel onto
//! the surface). The scene is rendered by a thread of its own, `stage`, which decides which picture to render, and when.
//! What else takes long runs in `work`.

mod advice;
mod animating;
mod camera;
mod canvas;
mod captures;
mod chart;
mod compare;
mod controls;
mod cropping;
mod drawer;
mod errors;
pub mod flatland;
mod freeze;
mod gizmo;
mod history;
mod inspect;
pub mod journal;
mod lamps;
mod legend;
mod lesson;
mod lighting;
mod lost;
mod maps;
mod model;
mod needs;
mod own_path;
mod panel;
mod picker;
mod pictures;
mod plotting;
pub mod recent;
mod results;
mod sheets;
mod shell;
mod stage;
mod start;
mod style;
mod sweep;
mod timeline;
mod viewport;
mod views;
mod window;
mod words;
mod work;

pub use advice::Advising;
pub use controls::marked_place;
pub use lesson::Running;
pub use lost::Lost;
pub use model::{Action, Facts, Job, Model, Reading, Sweeping, Tab, Traced};
pub use picker::Picker;
pub use pictures::{Picture, Pictures, Subject};
pub use recent::Recent;
pub use sheets::Builder;
pub use shell::layout;
pub use start::Start;
pub use style::apply as apply_style;
pub use words::Words;

use crate::message;
use anyhow::{Context, Result};
use std::io::IsTerminal;
use winit::event_loop::EventLoop;

/// How the window ended.
pub enum Ended {
    Closed,
    /// There is nothing to open a window on; the reason in words.
    NoDisplay(String),
}

/// Opens the window on a scene, a set-up or a capture (`bench` if none is named) and runs it until it is closed.
///
/// # Errors
/// No adapter that can draw in a window, or a device that fails at the start.
pub fn run(what: Option<&str>, adapter: Option<&str>) -> Result<Ended> {
    let set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    if cfg!(all(unix, not(target_os = "macos"))) && !set("DISPLAY") && !set("WAYLAND_DISPLAY") {
        return Ok(Ended::NoDisplay("neither DISPLAY nor WAYLAND_DISPLAY is set".into()));
    }
    let event_loop = match EventLoop::new() {
        Ok(event_loop) => event_loop,
        Err(e) => return Ok(Ended::NoDisplay(e.to_string().replace('\n', " "))),
    };
    let mut app = window::App::new(what, adapter, event_loop.create_proxy());
    event_loop.run_app(&mut app).context("the window system stopped")?;
    let ended = app.ended();
    // Who started it without a terminal would read nothing.
    if let (Err(e), false, false) = (&ended, std::io::stdin().is_terminal(), std::io::stderr().is_terminal()) {
        let dialog = rfd::MessageDialog::new().set_level(rfd::MessageLevel::Error).set_title("Shadowscope");
        dialog.set_description(message::sentence(e)).show();
    }
    ended
}
