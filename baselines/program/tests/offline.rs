//! Runs that learn from a data set alone.

mod program;

use std::{fs, path::Path, process::Command};

use program::fetch;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

/// Returns the command of a run with small networks and short evaluations.
fn train(flags: &str, demos: &Path, out: &Path) -> Command {
    let mut command = fetch(
        "train --target 2 --threads 1 --set hidden=[16,16] \
         --set evaluation_episodes=5 --set imitation_weight=100",
    );
    command.args(flags.split_whitespace()).arg("--demos").arg(demos).arg("--out").arg(out);
    command
}

#[test]
fn a_run_learns_from_a_data_set_without_a_step() -> Result {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let write = "datasets --only FetchReach-v4/scripted --steps 500 --format ogbench --out";
    output_of(fetch(write).arg(path("data")))?;
    let set = path("data/ogbench/fetch-reach-scripted-v0/fetch-reach-scripted-v0.npz");
    let out = path("run");
    output_of(train("--updates 50", &set, &out).arg("--json").arg(path("run.json")))?;
    let curve = fs::read_to_string(out.join("curve.csv"))?;
    let last = curve.lines().last().ok_or("no line")?.split(',').collect::<Vec<_>>();
    // No steps, only the episodes of the set, and all updates.
    assert_eq!((last[0], last[1], last[3]), ("0", "0", "50"), "{curve}");
    let outcome = &read_json(&path("run.json"))?["settings"][0];
    assert_eq!(outcome["counters"]["demonstrations"], 9);
    assert!(
        outcome["episode_return_mean"].as_f64().is_some_and(|mean| (-50.0..=0.0).contains(&mean))
    );
    // The same from a copy of the set elsewhere.
    fs::copy(&set, path("copy.npz"))?;
    output_of(&mut train("--updates 50", &path("copy.npz"), &path("again")))?;
    let policies = [out, path("again")].map(|run| fs::read(run.join("policy.safetensors")));
    let [first, again] = policies;
    assert!(first? == again?, "the policies differ");
    Ok(())
}

#[test]
fn what_is_no_set_of_episodes_is_refused() -> Result {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let output = fetch("train --updates 50").output()?;
    assert_eq!(output.status.code(), Some(2));
    assert!(errors_of(&output).contains("--demos"), "{}", errors_of(&output));
    // An archive without any array.
    let mut empty = b"PK\x05\x06".to_vec();
    empty.resize(22, 0);
    fs::write(path("empty.npz"), empty)?;
    let output = train("--updates 50", &path("empty.npz"), &path("run")).output()?;
    assert_eq!(output.status.code(), Some(1));
    assert!(errors_of(&output).contains("episode_lengths"), "{}", errors_of(&output));
    Ok(())
}

#[test]
fn a_training_run_is_a_data_set() -> Result {
    let folder = tempfile::tempdir()?;
    let write = |name: &str| -> Result<String> {
        let flags = "datasets --only FetchReach-v4/replay --steps 100 --seed 3 --out";
        output_of(fetch(flags).arg(folder.path().join(name)))
    };
    let table = write("data")?;
    assert!(table.contains("| FetchReach-v4/replay | minari | 100 |"), "{table}");
    // With the checksums.
    assert_eq!(write("again")?, table);
    Ok(())
}
