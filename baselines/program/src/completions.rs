//! `completions`: prints the completions of a shell.

use std::str;

use clap_complete::{Shell, generate};

#[derive(clap::Args)]
pub struct Args {
    /// The shell that reads them
    shell: Shell,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let mut script = Vec::new();
    generate(args.shell, &mut crate::command(), "fetch-env", &mut script);
    say!("{}", str::from_utf8(&script)?.trim_end())?;
    Ok(true)
}
