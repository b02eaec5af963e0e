use std::process::ExitCode;

fn main() -> ExitCode {
    shadowscope::cli::run().unwrap_or_else(|error| {
        eprintln!("shadowscope: {error:#}");
        ExitCode::FAILURE
    })
}
