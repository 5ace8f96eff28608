//! The program: `fetch-env <command>`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = std::env::args_os().skip(1);
    #[cfg(feature = "full")]
    let code = fetch_cli::main(&baselines::runs::BuiltInTasks, arguments);
    #[cfg(not(feature = "full"))]
    let code = fetch_cli::main(arguments);
    ExitCode::from(code)
}
