//! Fetches MuJoCo, or the reference's model, into the user's cache:
//!
//!     cargo run -p fetch-sim --example download --features download -- mujoco 3.6.0
//!     cargo run -p fetch-sim --example download --features download -- mujoco system
//!     cargo run -p fetch-sim --example download --features download -- reference-model
//!
//! It builds without MuJoCo. Builds and programs take the version that it has fetched from then on.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::{env, error::Error, process::ExitCode};

use fetch_sim::download;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["mujoco", "system"] => {
            download::forget()?;
            println!("builds and programs take the system's MuJoCo");
        }
        ["mujoco", version] => {
            let folder = download::remember(version)?;
            println!("builds and programs take MuJoCo {version}, in {}", folder.display());
        }
        ["reference-model"] => {
            println!("the reference model is in {}", download::reference_model()?.display());
            println!("its meshes are under CC BY-NC-SA 4.0: not for commercial use");
        }
        _ => {
            return Err(
                "give `mujoco VERSION`, such as 3.6.0, `mujoco system`, or `reference-model`"
                    .into(),
            );
        }
    }
    Ok(())
}
