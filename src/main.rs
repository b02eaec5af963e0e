use std::process::ExitCode;

fn main() -> ExitCode {
    match shadowscope::cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("shadowscope: {error:#}");
            ExitCode::FAILURE
        }
    }
}
