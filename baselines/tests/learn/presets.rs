//! The table of what the presets choose, in the documentation of `TrainSettings`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use baselines::learn::{AlgorithmSettings, PpoSettings, SacSettings, TrainSettings};
use fetch_env::Task;
use serde_json::Value;

use crate::runs::Result;

const TABLE: &str = include_str!("../../src/learn/settings/presets.md");

/// The parts of the settings, in the order of the table, with the type that documents each.
const PARTS: [(&str, &str); 7] = [
    ("ddpg", "DdpgSettings"),
    ("sac", "SacSettings"),
    ("ppo", "PpoSettings"),
    ("replay", "ReplaySettings"),
    ("inputs", "InputSettings"),
    ("exploration", "ExplorationSettings"),
    ("schedule", "ScheduleSettings"),
];

/// The settings of each part.
type Parts = BTreeMap<String, BTreeMap<String, Value>>;

/// Returns the settings by their part, with those of one algorithm.
fn parts(settings: &TrainSettings) -> Result<Parts> {
    // By way of text, in which an `f32` has its own digits.
    let text = serde_json::to_string(settings)?;
    let mut all: BTreeMap<String, Value> = serde_json::from_str(&text)?;
    let algorithm = all.remove("algorithm").unwrap_or_default();
    let algorithm = algorithm.as_object().into_iter().flatten();
    all.extend(algorithm.map(|(name, settings)| (name.clone(), settings.clone())));
    let of_part = |value: &Value| -> BTreeMap<String, Value> {
        let entries = value.as_object().into_iter().flatten();
        entries.map(|(name, value)| (name.clone(), value.clone())).collect()
    };
    Ok(all.iter().map(|(name, value)| (name.clone(), of_part(value))).collect())
}

/// Returns the cell of a value: nothing if it is the default, `-` if there is none.
fn cell(value: Option<&Value>, default: &Value) -> String {
    match value {
        None => "-".to_owned(),
        Some(value) if value == default => String::new(),
        Some(value) => shown(value),
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Array(numbers) if numbers.is_empty() => "none".to_owned(),
        Value::Array(numbers) => numbers.iter().map(shown).collect::<Vec<_>>().join(", "),
        Value::Number(number) if number.as_f64().is_some_and(|number| number.fract() == 0.0) => {
            let digits = number.as_f64().map(|number| format!("{number:.0}")).unwrap_or_default();
            let (sign, digits) =
                digits.strip_prefix('-').map_or(("", &*digits), |rest| ("-", rest));
            let groups: Vec<_> =
                digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy).collect();
            format!("{sign}{}", groups.join(","))
        }
        value => value.to_string(),
    }
}

fn find<'a>(parts: &'a Parts, part: &str, name: &str) -> Option<&'a Value> {
    parts.get(part)?.get(name)
}

/// Returns the table that the code makes.
fn table() -> Result<String> {
    let ddpg = TrainSettings::default();
    let mut defaults = BTreeMap::new();
    for algorithm in [
        AlgorithmSettings::Ppo(PpoSettings::default()),
        AlgorithmSettings::Sac(SacSettings::default()),
        ddpg.algorithm.clone(),
    ] {
        defaults.extend(parts(&TrainSettings { algorithm, ..ddpg.clone() })?);
    }
    let fast: Vec<_> =
        Task::ALL.iter().map(|task| parts(&TrainSettings::fast(*task))).collect::<Result<_>>()?;
    let books: Vec<_> =
        Task::ALL.iter().map(|task| parts(&TrainSettings::book(*task))).collect::<Result<_>>()?;
    let for_all_tasks =
        [TrainSettings::authors(), TrainSettings::fast_ppo(), TrainSettings::book_ppo()];
    let for_all_tasks = for_all_tasks.iter().map(parts).collect::<Result<Vec<_>>>()?;
    let mut table = String::from("| setting | default |");
    for task in Task::ALL {
        write!(table, " {task:?} |")?;
    }
    writeln!(
        table,
        " `book` | `authors` | `fast-ppo` | `book-ppo` |\n|---|---|{}",
        "---|".repeat(4 + Task::ALL.len())
    )?;
    for (part, settings) in PARTS {
        writeln!(
            table,
            "| **[`{settings}`](crate::learn::{settings})** |{}",
            " |".repeat(5 + Task::ALL.len())
        )?;
        for (name, default) in &defaults[part] {
            let of_tasks: Vec<_> = fast.iter().map(|parts| find(parts, part, name)).collect();
            let of_books: Vec<_> = books.iter().map(|parts| find(parts, part, name)).collect();
            let of_others = for_all_tasks.iter().map(|parts| find(parts, part, name));
            let of_others: Vec<_> = of_others.collect();
            let mut chosen = of_tasks.iter().chain(&of_books).chain(&of_others).flatten();
            if chosen.all(|value| *value == default) {
                continue;
            }
            write!(table, "| `{name}` | {} |", shown(default))?;
            for value in &of_tasks {
                write!(table, " {} |", cell(*value, default))?;
            }
            let book = if of_books == of_tasks && of_books.iter().any(|value| *value != of_books[0])
            {
                "as `fast`".to_owned()
            } else {
                let others = of_books[1];
                assert!(of_books[1..].iter().all(|value| *value == others), "{name}");
                match of_books[0] {
                    reach if reach == others => cell(reach, default),
                    reach => {
                        let [others, reach] = [others, reach].map(|value| value.map(shown));
                        format!(
                            "{}; Reach: {}",
                            others.ok_or("no value")?,
                            reach.ok_or("no value")?
                        )
                    }
                }
            };
            write!(table, " {book} |")?;
            for value in of_others {
                write!(table, " {} |", cell(value, default))?;
            }
            table.push('\n');
        }
    }
    Ok(table)
}

#[test]
fn the_table_of_presets_has_what_the_code_chooses() -> Result {
    assert_eq!(TABLE, table()?);
    Ok(())
}
