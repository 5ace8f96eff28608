//! The help of the program, and the pages that list its commands.

mod program;

use std::collections::BTreeSet;

use program::fetch;
use testing::{Result, program::output_of};

#[test]
fn every_command_says_what_it_does_and_has_an_example_that_parses() -> Result {
    for command in fetch_cli::command().get_subcommands() {
        let name = command.get_name();
        assert!(command.get_about().is_some(), "{name}");
        let example = command.get_after_help().ok_or_else(|| format!("{name} has no example"))?;
        let example = example.to_string();
        let words = example.strip_prefix("Example: fetch-env ").ok_or("no example")?;
        let words: Vec<_> = words.split(' ').collect();
        assert_eq!(words[0], name);
        let parsed = fetch_cli::command().try_get_matches_from(&words);
        assert!(parsed.is_ok(), "{example}: {}", parsed.err().ok_or("no error")?);
        assert!(output_of(&mut fetch(&format!("help {name}")))?.contains(&example));
    }
    Ok(())
}

#[test]
fn the_readme_lists_every_command_and_no_other() {
    let rows = include_str!("../README.md").lines().filter(|line| line.starts_with("| `"));
    let listed: BTreeSet<_> = rows
        .filter_map(|row| row.split_once("`fetch-env ")?.1.split([' ', '`']).next())
        .map(str::to_owned)
        .collect();
    let command = fetch_cli::command();
    let names = command.get_subcommands().map(|command| command.get_name().to_owned());
    assert_eq!(listed, names.collect());
}

#[test]
fn completions_know_every_command() -> Result {
    let script = output_of(&mut fetch("completions bash"))?;
    for command in fetch_cli::command().get_subcommands() {
        assert!(script.contains(command.get_name()), "{}", command.get_name());
    }
    Ok(())
}
