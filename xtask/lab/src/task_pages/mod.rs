//! `task-pages`: writes a page for each task, from the tables in the code.

mod page;
mod words;

use std::{
    fs,
    path::{Path, PathBuf},
};

use fetch_cli::shared::json::write_text;
use fetch_sim::Task;

use self::page::page;

#[derive(clap::Args)]
pub struct Args {
    /// Write nothing, and fail if a page is out of date
    #[arg(long)]
    check: bool,
}

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fetch-env/tasks");

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let mut passed = true;
    for task in Task::ALL {
        let (path, text) = (path(task), page(task)?);
        let shown = Path::new("fetch-env/tasks").join(path.file_name().unwrap_or_default());
        if !args.check {
            write_text(&path, &text)?;
            say!("wrote {}", shown.display())?;
        } else if fs::read_to_string(&path).is_ok_and(|known| known == text) {
            say!("ok    {}", shown.display())?;
        } else {
            say!("FAIL  {} is out of date: run `cargo xtask task-pages`", shown.display())?;
            passed = false;
        }
    }
    Ok(passed)
}

/// Returns the path of a task's page, such as `PICK_AND_PLACE.md`.
fn path(task: Task) -> PathBuf {
    let name = words::file_name(task).to_uppercase();
    Path::new(FOLDER).join(format!("{name}.md"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pages_are_what_the_code_gives() -> anyhow::Result<()> {
        for task in Task::ALL {
            let known = fs::read_to_string(path(task))?;
            assert!(known == page(task)?, "{task}: run `cargo xtask task-pages`");
        }
        Ok(())
    }
}
