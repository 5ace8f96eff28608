//! `completions`: prints the completions of a shell.

use std::str;

use clap_complete::{Shell, generate};

#[derive(clap::Args)]
pub struct Args {
    /// The shell that reads them
    shell: Shell,
}

pub fn run(args: &Args, command: &mut clap::Command) -> anyhow::Result<bool> {
    let mut script = Vec::new();
    generate(args.shell, command, "fetch-env", &mut script);
    say!("{}", str::from_utf8(&script)?.trim_end())?;
    Ok(true)
}
