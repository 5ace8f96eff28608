//! `mutants`: changes the code in small ways, and checks that a test fails.

use std::{
    collections::BTreeSet,
    fs,
    num::{NonZeroU32, NonZeroUsize},
    path::Path,
    process::Command,
};

use anyhow::{Context, ensure};

use crate::tools::{ROOT, tool};

const MUTANTS: (&str, &str) = ("cargo-mutants", "27.1.0");

/// The share of mutants that tests must catch.
const CAUGHT: f64 = 0.97;

/// The crates, and which mutants of them are tested.
const CRATES: [(&str, &str); 4] = [
    ("goal-reward", "-p goal-reward"),
    ("her-relabel", "-p her-relabel --features npz"),
    (
        "fetch-baselines",
        "-p fetch-baselines --no-default-features -f baselines/src/statistics/** \
         -f baselines/src/evaluate/**",
    ),
    // Without the code that needs MuJoCo or OpenGL.
    (
        "fetch-env",
        "-p fetch-env --no-default-features --features her-relabel -e fetch-env/src/pictures/** \
         -e fetch-env/src/fetch/make.rs \
         --exclude-re MujocoEnv|RenderEnv|wrapper_mut",
    ),
];

/// The mutants that no test can catch, with the reason why each is equivalent to the code.
const EQUIVALENT: &str = include_str!("../equivalent_mutants.txt");

#[derive(clap::Args)]
pub struct Args {
    /// Only this crate: goal-reward, her-relabel, fetch-baselines or fetch-env
    #[arg(long = "crate", value_name = "CRATE", value_parser = known_crate)]
    only: Option<&'static str>,
    /// Only part K of N, counted from 0
    #[arg(long, value_name = "K/N", value_parser = checked_shard)]
    shard: Option<String>,
    /// Only what the last N commits changed
    #[arg(long, value_name = "N")]
    commits: Option<NonZeroU32>,
    /// At most N mutants of each crate, spread over the code
    #[arg(long, value_name = "N")]
    at_most: Option<NonZeroUsize>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let program = tool(MUTANTS)?;
    let mut passed = true;
    for (name, selection) in CRATES {
        if args.only.is_none_or(|only| only == name) {
            passed &= test(&program, name, selection, args)?;
        }
    }
    Ok(passed)
}

fn known_crate(name: &str) -> Result<&'static str, String> {
    let mut names = CRATES.into_iter().map(|(name, _)| name);
    let all = CRATES.map(|(name, _)| name).join(", ");
    names.find(|known| *known == name).ok_or_else(|| format!("the crates are {all}"))
}

fn checked_shard(shard: &str) -> Result<String, &'static str> {
    let numbers = shard.split_once('/').map(|(k, n)| (k.parse::<u32>(), n.parse::<u32>()));
    match numbers {
        Some((Ok(k), Ok(n))) if k < n => Ok(shard.to_owned()),
        _ => Err("a shard is k/n, with k from 0 to n - 1"),
    }
}

/// Tests the chosen mutants of a crate.
fn test(program: &Path, name: &str, selection: &str, args: &Args) -> anyhow::Result<bool> {
    let folder = Path::new(ROOT).join("target/mutants").join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder)?; // the tool writes nothing if there is no mutant
    }
    fs::create_dir_all(&folder)?;
    let mut chosen: Vec<_> = selection.split_whitespace().map(str::to_owned).collect();
    if let Some(commits) = args.commits {
        let path = folder.join("diff");
        fs::write(&path, diff_of(commits)?)?;
        chosen.push(format!("--in-diff={}", path.display()));
    }
    let mutants = |chosen: &[String]| {
        let mut mutants = Command::new(program);
        mutants.args(["mutants", "--colors=never"]).args(chosen).current_dir(ROOT);
        mutants
    };
    let mut shard = args.shard.clone();
    if let Some(most) = args.at_most {
        let list = mutants(&chosen).arg("--list").output()?;
        let count = String::from_utf8_lossy(&list.stdout).lines().count();
        shard = Some(format!("0/{}", count.div_ceil(most.get()).max(1)));
    }
    if let Some(shard) = shard {
        chosen.extend([format!("--shard={shard}"), "--sharding=round-robin".to_owned()]);
    }
    let mut test = mutants(&chosen);
    test.args(["--baseline=skip", "--timeout=120"])
        // A mutant in a constant can keep the compiler itself from ending.
        .arg("--build-timeout=300")
        .arg("--output")
        .arg(&folder)
        // Any failure catches a mutant: finding the smallest one takes long.
        .env("PROPTEST_MAX_SHRINK_ITERS", "0");
    let status = test.status().with_context(|| format!("{} did not start", program.display()))?;
    // 2: some were missed. 3: some timed out, as mutants that never end do.
    ensure!(matches!(status.code(), Some(0 | 2 | 3)), "{name}: cargo-mutants failed");
    Outcome::read(&folder).report(name)
}

/// Returns what the last commits changed, or all commits if there are fewer.
fn diff_of(commits: NonZeroU32) -> anyhow::Result<Vec<u8>> {
    let git = |arguments: &[&str]| -> anyhow::Result<Vec<u8>> {
        let output = Command::new("git").args(arguments).current_dir(ROOT).output()?;
        ensure!(output.status.success(), "git failed: {}", String::from_utf8_lossy(&output.stderr));
        Ok(output.stdout)
    };
    let count = format!("--max-count={}", commits.saturating_add(1));
    let list = String::from_utf8(git(&["rev-list", "--first-parent", &count, "HEAD"])?)?;
    git(&["diff", list.lines().last().context("there is no commit")?])
}

/// The mutants of a run, by outcome.
struct Outcome {
    caught: usize,
    missed: Vec<String>,
}

impl Outcome {
    fn read(folder: &Path) -> Self {
        let lines = |name| -> Vec<String> {
            // There is no file if there are no mutants.
            let text = fs::read_to_string(folder.join("mutants.out").join(name));
            text.unwrap_or_default().lines().map(without_position).collect()
        };
        let caught = lines("caught.txt").len() + lines("timeout.txt").len();
        Self { caught, missed: lines("missed.txt") }
    }

    /// Prints the result, and returns whether tests catch enough mutants and survivors are known.
    fn report(&self, name: &str) -> anyhow::Result<bool> {
        let equivalent = equivalent()?;
        let unknown: Vec<_> =
            self.missed.iter().filter(|mutant| !equivalent.contains(mutant.as_str())).collect();
        let viable = self.caught + self.missed.len();
        let share = self.caught as f64 / viable.max(1) as f64;
        say!(
            "mutants of {name}: {} of {viable} caught ({:.1} %), {} equivalent, {} unknown",
            self.caught,
            100.0 * share,
            self.missed.len() - unknown.len(),
            unknown.len()
        )?;
        for mutant in &unknown {
            say!("  no test catches: {mutant}")?;
        }
        // A small part may have many of the equivalent mutants.
        let is_enough = viable < 100 || share >= CAUGHT;
        Ok(unknown.is_empty() && is_enough)
    }
}

/// Returns a mutant as the tool names it, without its line and column.
fn without_position(mutant: &str) -> String {
    let mut parts = mutant.splitn(4, ':');
    let (file, change) = (parts.next().unwrap_or_default(), parts.nth(2).unwrap_or_default());
    format!("{file}:{change}")
}

/// Returns the mutants that no test can catch: a line each, with the reason indented below it.
fn equivalent() -> anyhow::Result<BTreeSet<&'static str>> {
    let mut mutants = BTreeSet::new();
    let mut lines = EQUIVALENT.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    while let Some(mutant) = lines.next() {
        let reason = lines.next().filter(|line| line.starts_with("  "));
        ensure!(reason.is_some(), "equivalent_mutants.txt gives no reason for {mutant}");
        mutants.insert(mutant);
    }
    Ok(mutants)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mutants_are_known_by_what_they_change() {
        let mutant = "her-relabel/src/a.rs:33:5: replace A::b -> usize with 0";
        assert_eq!(without_position(mutant), "her-relabel/src/a.rs: replace A::b -> usize with 0");
    }

    #[test]
    fn the_files_of_the_crates_exist() {
        let flags = CRATES.map(|(_, flags)| flags.split_whitespace());
        for mut words in flags {
            while let Some(flag) = words.next() {
                if ["-f", "-e"].contains(&flag) {
                    let file = words.next().expect("a file").trim_end_matches("/**");
                    assert!(Path::new(ROOT).join(file).exists(), "{file}");
                }
            }
        }
    }

    #[test]
    fn every_equivalent_mutant_has_a_reason_and_a_file() {
        for mutant in equivalent().expect("reasons") {
            let (file, _) = mutant.split_once(": ").expect("a file and a change");
            assert!(Path::new(ROOT).join(file).exists(), "{mutant}");
        }
    }

    #[test]
    fn survivors_without_a_reason_and_too_many_survivors_fail() {
        let outcome = |caught, missed: usize| Outcome {
            caught,
            missed: vec!["a.rs: replace b with c".to_owned(); missed],
        };
        assert!(outcome(0, 0).report("nothing").expect("a list"));
        assert!(outcome(100, 0).report("all").expect("a list"));
        assert!(!outcome(99, 1).report("one unknown").expect("a list"));
    }

    #[test]
    fn a_shard_is_one_of_several() {
        assert_eq!(checked_shard("0/1").as_deref(), Ok("0/1"));
        for wrong in ["1/1", "2/1", "a/2", "1", "", "-1/2"] {
            assert!(checked_shard(wrong).is_err(), "{wrong}");
        }
    }
}
