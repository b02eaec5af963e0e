//! The user's files: read without waiting and within bounds, and written whole or not at all.

use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{File, Metadata};
use std::io::{self, BufReader, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Most bytes of a file of text: a set-up, a world, a page.
pub const MOST_TEXT: u64 = 64 << 20;
/// Most bytes of any other: what the 32 bits of a .glb file can count.
pub const MOST_DATA: u64 = u32::MAX as u64;
/// Of a file of rows: 100,000 of them have a third of that, and all are held in memory, where they take several times as much.
pub const MOST_ROWS: u64 = 1 << 30;

/// Opens a file with contents of its own. A pipe or a device may have none yet, and none ever. What is read of it ends one byte
/// behind `most`, however it grows meanwhile.
///
/// # Errors
/// Also where it is none, or has more than `most` bytes.
pub fn open(path: &Path, most: u64) -> io::Result<BufReader<io::Take<File>>> {
    // Before it is opened, as opening a pipe waits too; and after, as another may stand in its place by then.
    check_contents(&std::fs::metadata(path)?, most)?;
    let file = File::open(path)?;
    check_contents(&file.metadata()?, most)?;
    Ok(BufReader::new(file.take(most + 1)))
}

fn check_contents(about: &Metadata, most: u64) -> io::Result<()> {
    if !about.is_file() {
        return Err(io::Error::other(format!("it is {}, not a file with contents", kind(about))));
    }
    if about.len() > most {
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        return Err(io::Error::other(format!("it has {} MiB, and up to {} are read", mib(about.len()), mib(most))));
    }
    Ok(())
}

/// What something is that is no file with contents.
pub fn kind(about: &Metadata) -> &'static str {
    if about.is_symlink() {
        return "a link";
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = about.file_type();
        if kind.is_fifo() {
            return "a pipe";
        } else if kind.is_socket() {
            return "a socket";
        }
    }
    if about.is_dir() { "a folder" } else { "a device" }
}

/// Reads all of a file with contents of its own, as [`open`].
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path, most)?.read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::other(format!("it has more than {} MiB, and still grows", most.div_ceil(1 << 20))));
    }
    Ok(bytes)
}

/// Reads a file that another one in `folder` names by a path from there, in capitals or small letters, as not all systems tell
/// them apart. It lies there in truth too: no link leads out.
pub fn read_beside(folder: &Path, relative: &Path) -> io::Result<Vec<u8>> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(relative).canonicalize().or_else(|_| in_any_case(folder, relative).canonicalize())?;
    if !path.starts_with(folder.canonicalize()?) {
        return Err(io::Error::other("it leads out of the folder, where nothing is read"));
    }
    read(&path, MOST_DATA)
}

/// The path of names that are there in other cases; of several the first.
fn in_any_case(folder: &Path, relative: &Path) -> PathBuf {
    let mut path = folder.to_path_buf();
    for name in relative {
        let same = |entry: io::Result<std::fs::DirEntry>| {
            entry.ok().map(|entry| entry.file_name()).filter(|there| there.eq_ignore_ascii_case(name))
        };
        let exact = path.join(name).exists();
        let others = (!exact).then(|| std::fs::read_dir(&path).ok()).flatten().into_iter().flatten().filter_map(same);
        let there = others.min();
        path.push(there.as_deref().unwrap_or(name));
    }
    path
}

/// As [`read`], of a text, in one sentence that names the file.
pub fn read_text(path: &Path) -> Result<String> {
    let text = read(path, MOST_TEXT).and_then(|bytes| {
        String::from_utf8(bytes).map_err(|_| io::Error::other("it is not text in UTF-8; save it as UTF-8"))
    });
    text.map_err(|error| anyhow::anyhow!("{} cannot be read: {}", path.display(), reason(&error)))
}

/// Why a file cannot be read or written, with advice where there is some.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "there is no permission".into(),
        ErrorKind::StorageFull => "the disk is full; free some space or write to another disk".into(),
        ErrorKind::ReadOnlyFilesystem => "the disk is read-only; write to another one".into(),
        ErrorKind::QuotaExceeded => "the quota is used up; free some space or write to another disk".into(),
        ErrorKind::OutOfMemory => "the memory is used up; close other programs or take a smaller file".into(),
        _ => error.to_string(),
    }
}

/// Writes a file whole or not at all: what was there stays until the new contents are safe on the disk.
pub fn save(path: &Path, contents: &[u8]) -> Result<()> {
    replace(path, |file| file.write_all(contents))
}

/// As [`save`], with what `write` writes.
pub fn replace(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> Result<()> {
    create_folder(path)?;
    replaced(path, write).map_err(|error| anyhow::anyhow!("{} cannot be written: {}", path.display(), reason(&error)))
}

fn replaced(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let held = std::fs::metadata(path).ok();
    if held.as_ref().is_some_and(|held| !held.is_file()) {
        // A pipe or a device has nothing to lose.
        return write(&mut File::options().write(true).open(path)?);
    }
    // A link stays one.
    let place = end_of(path);
    let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    clear_once(folder);
    let mut beside = tempfile::Builder::new();
    beside.prefix(UNFINISHED[0]).suffix(UNFINISHED[1]);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file, less what the user's mask takes off.
        beside.permissions(std::fs::Permissions::from_mode(0o666));
    }
    // It goes when it is dropped, with what is half written.
    let mut beside = beside.tempfile_in(folder)?;
    // Gone with the process, however that ends. Where there are no locks, others leave the file alone.
    _ = beside.as_file().try_lock();
    write(beside.as_file_mut())?;
    if let Some(held) = held {
        beside.as_file().set_permissions(held.permissions())?;
    }
    beside.as_file().sync_all()?;
    beside.persist(&place).map_err(|error| error.error)?;
    Ok(())
}

/// Where links lead, to a file that may not be there yet.
fn end_of(path: &Path) -> PathBuf {
    let mut place = path.to_path_buf();
    for _ in 0..LINKS {
        match std::fs::read_link(&place) {
            Ok(next) => place = place.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return place,
        }
    }
    // A ring of links leads nowhere: a file takes the place of the first.
    path.to_path_buf()
}

/// Links in a row that are followed, as many as Linux does.
const LINKS: usize = 40;

/// What the name of a file begins and ends with that is not yet written whole.
const UNFINISHED: [&str; 2] = [".shadowscope-", ".part"];

/// Removes what processes that were killed left half written in a folder; the first time that this one writes there. A file that
/// someone still writes is locked, or so young that it may be about to be.
fn clear_once(folder: &Path) {
    static CLEARED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    if !CLEARED.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf()) {
        return;
    }
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let [begin, end] = UNFINISHED;
        if !(name.starts_with(begin) && name.ends_with(end)) {
            continue;
        }
        let old = entry.metadata().is_ok_and(|about| {
            about.is_file() && about.modified().is_ok_and(|at| at.elapsed().is_ok_and(|age| age >= STALE))
        });
        if old && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Age from which a file that nobody has locked is nobody's.
const STALE: Duration = Duration::from_secs(60);

/// Makes the folder that a file is to lie in.
pub fn create_folder(file: &Path) -> Result<()> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("the folder {} cannot be made", folder.display()))?;
    }
    Ok(())
}

/// Makes sure that a file can be written later, so that no work is lost to a wrong path. Nothing is changed or left behind.
/// Returns what is to be said of a folder that will have to be made.
///
/// # Errors
/// Why it cannot be written.
pub fn check_target(path: &Path) -> Result<Option<String>> {
    let name = path.display();
    let folder_named = path.as_os_str().as_encoded_bytes().last().is_some_and(|b| std::path::is_separator(*b as char));
    ensure!(!path.is_dir() && !folder_named, "{name} is a folder; give the name of a file in it");
    let cannot = |error: io::Error| anyhow::anyhow!("{name} cannot be written: {}", reason(&error));
    if let Ok(held) = std::fs::metadata(path) {
        #[cfg(unix)]
        if std::os::unix::fs::FileTypeExt::is_fifo(&held.file_type()) {
            bail!("{name} is a pipe; give the name of a file");
        }
        if !held.is_file() {
            return Ok(None);
        }
        File::options().append(true).open(path).map_err(cannot)?;
    }
    check_place(path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")), path)
}

/// As [`check_target`] for a folder that files are to be written into.
///
/// # Errors
/// A file of that name, or a place where nothing can be made.
pub fn check_folder(folder: &Path) -> Result<Option<String>> {
    ensure!(!folder.exists() || folder.is_dir(), "{} is a file; give the name of a folder", folder.display());
    check_place(folder, folder)
}

/// Makes sure that something can be made in a folder, which is said if it is not there; `wanted` is what errors name.
fn check_place(folder: &Path, wanted: &Path) -> Result<Option<String>> {
    let name = wanted.display();
    let mut above = folder.ancestors().map(|at| if at.as_os_str().is_empty() { Path::new(".") } else { at });
    let Some(there) = above.find(|at| at.exists()) else { bail!("{name}: there is no such place") };
    ensure!(there.is_dir(), "{name} cannot be written: {} is not a folder", there.display());
    if let Err(error) = tempfile::tempfile_in(there) {
        bail!("{name} cannot be written: nothing can be made in {} ({})", there.display(), reason(&error));
    }
    Ok((!folder.exists()).then(|| format!("The folder {} is not there and will be made.", folder.display())))
}

/// A path as text that [`path_of`] turns back into the same path: bytes that are no UTF-8 stand as characters of a private
/// range, as do such characters themselves. (The range is that of MirBSD's OPTU encoding.)
#[cfg(unix)]
pub fn name_of(path: &OsStr) -> String {
    use std::os::unix::ffi::OsStrExt;
    let mut name = String::new();
    let byte = |b: &u8| char::from_u32(RAW + u32::from(*b)).unwrap_or(char::REPLACEMENT_CHARACTER);
    for part in path.as_bytes().utf8_chunks() {
        for c in part.valid().chars() {
            match raw_byte(c) {
                Some(_) => name.extend(c.encode_utf8(&mut [0; 4]).as_bytes().iter().map(byte)),
                None => name.push(c),
            }
        }
        name.extend(part.invalid().iter().map(byte));
    }
    name
}

/// The path that a name stands for ([`name_of`]).
#[cfg(unix)]
pub fn path_of(name: &str) -> PathBuf {
    use std::os::unix::ffi::OsStringExt;
    let mut bytes = Vec::with_capacity(name.len());
    for c in name.chars() {
        match raw_byte(c) {
            Some(byte) => bytes.push(byte),
            None => bytes.extend(c.encode_utf8(&mut [0; 4]).as_bytes()),
        }
    }
    std::ffi::OsString::from_vec(bytes).into()
}

/// Where the character of the byte 0 would stand.
#[cfg(unix)]
const RAW: u32 = 0xEF00;

/// The byte that a character stands for.
#[cfg(unix)]
fn raw_byte(c: char) -> Option<u8> {
    u32::from(c).checked_sub(RAW).filter(|b| (0x80..=0xFF).contains(b)).map(|b| b as u8)
}

#[cfg(not(unix))]
pub fn name_of(path: &OsStr) -> String {
    path.to_string_lossy().into_owned()
}

#[cfg(not(unix))]
pub fn path_of(name: &str) -> PathBuf {
    name.into()
}
