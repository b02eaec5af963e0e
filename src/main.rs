fn main() -> std::process::ExitCode {
    shadowscope::cli::main(&[])
}
