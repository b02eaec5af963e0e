use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(target_os = "linux")]
    give_runtime_folder();
    shadowscope::cli::run().unwrap_or_else(|error| {
        eprintln!("shadowscope: {}", shadowscope::message::sentence(&error));
        ExitCode::FAILURE
    })
}

/// Graphics drivers complain where a session has no folder for its sockets, as on machines without a display: makes one that
/// is the user's alone. Where that fails they may complain.
#[cfg(target_os = "linux")]
fn give_runtime_folder() {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt};
    const NAME: &str = "XDG_RUNTIME_DIR";
    if std::env::var_os(NAME).is_some_and(|folder| std::path::Path::new(&folder).is_dir()) {
        return;
    }
    let user = rustix::process::getuid().as_raw();
    let folder = std::env::temp_dir().join(format!("shadowscope-{user}"));
    // One that is there may be anybody's.
    let _ = std::fs::DirBuilder::new().mode(0o700).create(&folder);
    let private = |about: std::fs::Metadata| about.is_dir() && about.uid() == user && about.mode() & 0o077 == 0;
    if std::fs::symlink_metadata(&folder).is_ok_and(private) {
        // SAFETY: no other thread runs yet that could read the environment meanwhile.
        unsafe { std::env::set_var(NAME, folder) };
    }
}
