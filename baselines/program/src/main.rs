//! The program: `fetch-env <command>`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(fetch_cli::main(std::env::args_os().skip(1)))
}
