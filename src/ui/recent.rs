//! The files opened last, kept in the user's folder for configuration.

use crate::files;
use crate::setup::one_line;
use anyhow::{Context, Result};
use etcetera::BaseStrategy;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How many are kept.
pub const MOST: usize = 12;
const FILE: &str = "recent.toml";

/// A file opened before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recent {
    /// Its path as [`files::name_of`] writes it.
    pub name: String,
    /// Why it cannot be opened now.
    pub missing: Option<String>,
}

/// The file as it is written; the newest first.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    files: Vec<String>,
}

/// The program's folder among the user's for configuration; None where there is no home.
pub fn folder() -> Option<PathBuf> {
    Some(etcetera::choose_base_strategy().ok()?.config_dir().join("shadowscope"))
}

fn list(folder: &Path) -> Result<List> {
    let path = folder.join(FILE);
    if !path.exists() {
        return Ok(List::default());
    }
    let text = files::read_text(&path)?;
    let list = toml::from_str(&text).map_err(|e| one_line(&e.to_string()));
    list.with_context(|| format!("{} is no list of recent files; delete it to begin anew", path.display()))
}

/// The files opened last, the newest first, with what became of them since.
///
/// # Errors
/// A list that cannot be read; it stays as it is.
pub fn read(folder: &Path) -> Result<Vec<Recent>> {
    let mut names = list(folder)?.files;
    names.truncate(MOST);
    let one = |name: String| {
        let about = std::fs::metadata(files::path_of(&name));
        let missing = match about {
            Err(error) => Some(files::reason(&error)),
            Ok(about) if !about.is_file() => Some("it is no file any more".into()),
            Ok(_) => None,
        };
        Recent { name, missing }
    };
    Ok(names.into_iter().map(one).collect())
}

/// Puts a file first.
///
/// # Errors
/// As [`read`], or a folder that cannot be written.
pub fn add(folder: &Path, name: &str) -> Result<Vec<Recent>> {
    let mut held = list(folder)?;
    let whole = std::path::absolute(files::path_of(name)).unwrap_or_else(|_| files::path_of(name));
    let name = files::name_of(whole.as_os_str());
    held.files.retain(|other| *other != name);
    held.files.insert(0, name);
    held.files.truncate(MOST);
    files::save(&folder.join(FILE), toml::to_string(&held)?.as_bytes())?;
    read(folder)
}
