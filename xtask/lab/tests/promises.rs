//! The page of promises names tests that exist.

use std::{error::Error, fs, path::Path};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const PAGE: &str = include_str!("../../../fetch-env/PROMISES.md");

/// Returns the pairs of file and function in a line: ``path`: `name`, `name``.
fn tests_in(line: &str) -> impl Iterator<Item = (&str, &str)> {
    line.split("; ").filter_map(|part| part.split_once("`: `")).flat_map(|(file, names)| {
        let file = file.rsplit('`').next().unwrap_or_default();
        names.split('`').step_by(2).map(move |name| (file, name))
    })
}

#[test]
fn every_promise_names_a_test() -> Result<(), Box<dyn Error>> {
    let mut promises = 0;
    // Their tables have two columns; that of the soak has more.
    let rows =
        PAGE.lines().filter(|line| line.starts_with("| ") && line.matches(" | ").count() == 1);
    for line in rows.filter(|line| !line.contains("| Test |")) {
        let tests: Vec<_> = tests_in(line).collect();
        assert!(!tests.is_empty(), "{line}");
        for (file, name) in tests {
            let source = fs::read_to_string(Path::new(ROOT).join(file))
                .map_err(|error| format!("{file}: {error}"))?;
            let is_there = [("fn", "("), ("fn", "<"), ("def", "(")]
                .iter()
                .any(|(keyword, next)| source.contains(&format!("{keyword} {name}{next}")));
            assert!(is_there, "{file} has no {name}");
        }
        promises += 1;
    }
    assert!(promises > 20, "{promises}");
    Ok(())
}
