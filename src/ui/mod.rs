//! The window.

use anyhow::Result;

/// How the window ended.
pub enum Ended {
    Closed,
    /// There is nothing to open a window on; the reason in words.
    NoDisplay(String),
}

/// Opens the window and runs it until it is closed.
pub fn run(_what: Option<&str>, _adapter: Option<&str>) -> Result<Ended> {
    Ok(Ended::NoDisplay("none".into()))
}
