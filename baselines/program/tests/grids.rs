//! Grids of training as a user writes, runs, kills and stops them.

mod program;

use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use program::fetch;
use tempfile::tempdir;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

/// Two settings with two seeds, small networks and short evaluations.
const GRID: &str = r#"{
    "env_id": "FetchReach-v4",
    "preset": "fast",
    "steps": 600,
    "target": 0.0,
    "set": {
        "gamma": [0.9, 0.95],
        "hidden": [[32, 32]],
        "evaluation_episodes": [5],
        "evaluation_interval": [300]
    },
    "seeds": [3, 1]
}"#;

fn train(file: &Path, out: &Path) -> Command {
    let mut command = fetch("train --checkpoint-seconds 0 --grid");
    command.arg(file).arg("--out").arg(out);
    command
}

/// Returns the table without the columns of seconds.
fn table(out: &Path) -> Result<Vec<String>> {
    let text = fs::read_to_string(out.join("table.csv"))?;
    let without = |line: &str| line.rsplitn(4, ',').last().unwrap_or_default().to_owned();
    Ok(text.lines().map(without).collect())
}

fn num_policies(out: &Path) -> usize {
    let folders = |path: &Path| fs::read_dir(path).into_iter().flatten().flatten();
    let runs = folders(&out.join("runs")).flat_map(|choice| folders(&choice.path()));
    runs.filter(|run| run.path().join("policy.safetensors").exists()).count()
}

/// Returns the number of hidden files below a folder.
fn hidden(folder: &Path) -> Result<usize> {
    let mut count = 0;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        count += usize::from(entry.file_name().as_encoded_bytes().starts_with(b"."));
        if entry.file_type()?.is_dir() {
            count += hidden(&entry.path())?;
        }
    }
    Ok(count)
}

#[test]
fn a_grid_completes_what_is_missing_and_removes_its_unfinished_files_alone() -> Result {
    let folder = tempdir()?;
    let [file, out] = ["grid.json", "out"].map(|name| folder.path().join(name));
    fs::write(&file, GRID.replace("[0.9, 0.95]", "[0.95]"))?;
    output_of(&mut train(&file, &out))?;
    let lines = table(&out)?;
    let [first, second] = [1, 3].map(|seed| out.join(format!("runs/preset/seed-{seed}")));
    let policy = fs::read(second.join("policy.safetensors"))?;
    // The first run has its results, but the second must begin again.
    fs::remove_file(first.join("page.html"))?;
    for name in ["page.html", "policy.safetensors"] {
        fs::remove_file(second.join(name))?;
    }
    // What a process leaves that is killed while it writes, beside files of the user.
    let mut own = Vec::new();
    for (folder, name) in [(&out, "table.csv"), (&second, "curve.csv")] {
        let lock = fs::read_to_string(folder.join("run.lock"))?;
        let mark = lock.trim_end().rsplit(' ').next().ok_or("no mark")?;
        for left in [format!(".{name}.{mark}"), format!("..{name}.{mark}.AbCdEf")] {
            fs::write(folder.join(left), "half of it")?;
        }
        for kept in [format!(".{name}.backup"), format!("{name}.{mark}")] {
            own.push(folder.join(kept));
        }
    }
    for path in &own {
        fs::write(path, "the user's")?;
    }
    output_of(&mut train(&file, &out))?;
    assert_eq!(table(&out)?, lines);
    assert!(fs::read(second.join("policy.safetensors"))? == policy);
    assert!(second.join("page.html").exists() && !first.join("page.html").exists());
    assert_eq!(hidden(&out)?, 2);
    for path in own {
        assert_eq!(fs::read_to_string(path)?, "the user's");
    }
    Ok(())
}

#[test]
fn planted_links_and_pipes_in_the_folder_of_a_grid_lead_to_no_victim() -> Result {
    let folder = tempdir()?;
    let [file, out, victim] = ["grid.json", "out", "victim"].map(|name| folder.path().join(name));
    fs::write(&file, GRID.replace("[0.9, 0.95]", "[0.95]").replace("[3, 1]", "[3]"))?;
    output_of(&mut train(&file, &out))?;
    fs::write(&victim, "the user's")?;
    for name in ["success.svg", "success.png", "table.csv"] {
        fs::remove_file(out.join(name))?;
        symlink("../victim", out.join(name))?;
    }
    output_of(&mut train(&file, &out))?;
    assert_eq!(fs::read_to_string(&victim)?, "the user's");
    for name in ["success.svg", "success.png", "table.csv"] {
        assert!(out.join(name).symlink_metadata()?.is_file(), "{name}");
    }
    // Neither a description nor a curve that never ends is waited for.
    for name in ["grid.json", "runs/preset/seed-3/run.json", "runs/preset/seed-3/curve.csv"] {
        let text = fs::read(out.join(name))?;
        fs::remove_file(out.join(name))?;
        symlink("/dev/zero", out.join(name))?;
        let output = train(&file, &out).output()?;
        let errors = errors_of(&output);
        assert!(!output.status.success() || name.ends_with(".csv"), "{name}: {errors}");
        fs::remove_file(out.join(name))?;
        fs::write(out.join(name), text)?;
    }
    let output = train(Path::new("/dev/zero"), &out).output()?;
    assert!(errors_of(&output).contains("not a regular file"), "{}", errors_of(&output));
    Ok(())
}

#[test]
fn a_killed_or_stopped_grid_goes_on_to_the_same_table() -> Result {
    let folder = tempdir()?;
    let file = folder.path().join("grid.json");
    let endless = GRID.replace("\"target\": 0.0", "\"target\": 2");
    fs::write(&file, endless)?;
    let whole = folder.path().join("whole");
    let text = output_of(
        train(&file, &whole)
            .args(["--threads", "1"])
            .arg("--json")
            .arg(folder.path().join("results.json")),
    )?;
    assert!(text.contains("| 0.95  |") && text.contains("0 of 2"), "{text}");
    let results = read_json(&folder.path().join("results.json"))?;
    assert_eq!(results["results"][0]["name"], "train/grid/gamma=0.9/success_rate");
    let lines = table(&whole)?;
    assert_eq!(lines.len(), 3);
    assert!(lines[0].starts_with("gamma,hidden,evaluation_episodes,"), "{lines:?}");
    for ending in ["svg", "png"] {
        assert!(whole.join("success").with_extension(ending).exists());
    }
    let run = whole.join("runs/gamma=0.95/seed-3");
    assert_eq!(read_json(&run.join("run.json"))?["changes"][0], "gamma=0.95");
    assert!(!run.join("checkpoint-000000000600.zip").exists(), "it is not to be resumed");

    for (signal, code) in [("-KILL", None), ("-INT", Some(130))] {
        let out = folder.path().join(signal);
        // The user's own file, beside the grid's files.
        fs::create_dir_all(&out)?;
        fs::write(out.join("thesis.txt"), "a thesis")?;
        let mut grid = train(&file, &out).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        while num_policies(&out) == 0 && grid.try_wait()?.is_none() {
            thread::sleep(Duration::from_millis(1));
        }
        let kill = format!("kill {signal} {}", grid.id());
        assert!(Command::new("sh").args(["-c", &kill]).status()?.success());
        let output = grid.wait_with_output()?;
        assert_eq!(output.status.code(), code, "{}", errors_of(&output));
        assert!(code.is_none() || errors_of(&output).contains("the same command continues"));
        assert!(!out.join("table.csv").exists(), "the grid has ended");
        let kept = num_policies(&out);
        assert!((1..4).contains(&kept), "{kept}");
        output_of(&mut train(&file, &out))?;
        assert_eq!(table(&out)?, lines);
        assert_eq!(hidden(&out)?, 0);
        assert_eq!(fs::read_to_string(out.join("thesis.txt"))?, "a thesis");
        // It has nothing left to run.
        output_of(&mut train(&file, &out))?;
        assert_eq!(table(&out)?, lines);
    }
    Ok(())
}

#[test]
fn runs_end_at_the_target_and_are_those_of_train() -> Result {
    let folder = tempdir()?;
    let [file, out, alone] = ["grid.json", "out", "alone"].map(|name| folder.path().join(name));
    fs::write(&file, GRID.replace("[0.9, 0.95]", "[0.95]"))?;
    let text = output_of(&mut train(&file, &out))?;
    assert!(text.contains("2 of 2"), "{text}");
    let flags = "train --preset fast --seed 1 --steps 600 --target 0 --set gamma=0.95 \
                 --set hidden=[32,32] --set evaluation_episodes=5 --set evaluation_interval=300 \
                 --out";
    output_of(fetch(flags).arg(&alone))?;
    let run = out.join("runs/preset/seed-1");
    for name in ["policy.safetensors", "run.json"] {
        assert!(fs::read(run.join(name))? == fs::read(alone.join(name))?, "{name}");
    }
    Ok(())
}

#[test]
fn a_grid_goes_on_after_a_run_has_diverged() -> Result {
    let folder = tempdir()?;
    let [file, out] = ["grid.json", "out"].map(|name| folder.path().join(name));
    let diverging = r#""set": { "learning_rate": [1.0, 0.001], "initial_temperature": [1000],
        "target_entropy": [0.69], "updates_per_cycle": [200], "batch_size": [8],"#;
    let grid = GRID.replace("\"fast\"", "\"book\"").replace("\"set\": {", diverging);
    fs::write(&file, grid.replace("[0.9, 0.95]", "[0.95]").replace("[[32, 32]]", "[[8]]"))?;
    let output = train(&file, &out).output()?;
    let errors = errors_of(&output);
    assert!(output.status.success() && errors.contains("the losses diverged"), "{errors}");
    let lines = table(&out)?;
    assert_eq!(lines.len(), 3);
    output_of(&mut train(&file, &out))?;
    assert_eq!(table(&out)?, lines);
    Ok(())
}

#[test]
fn a_changed_grid_and_a_folder_of_something_else_are_refused() -> Result {
    let folder = tempdir()?;
    let [file, out, taken] = ["grid.json", "out", "taken"].map(|name| folder.path().join(name));
    fs::write(&file, GRID.replace("[0.9, 0.95]", "[0.95]").replace("[3, 1]", "[3]"))?;
    output_of(&mut train(&file, &out))?;
    // The order of keys is not a change.
    let before = table(&out)?;
    for (from, to, difference) in [
        ("[0.95]", "[0.9]", "grid.set.gamma"),
        ("\"seeds\": [3]", "\"seeds\": [3, 1]", "grid.seeds"),
        ("\"steps\": 600,", "", "grid.steps"),
    ] {
        let text = fs::read_to_string(&file)?;
        fs::write(&file, text.replace(from, to))?;
        let output = train(&file, &out).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains(&format!("differs in {difference}: choose another")), "{errors}");
        assert_eq!(table(&out)?, before);
        fs::write(&file, text)?;
    }
    for name in ["grid.json", "runs", "table.csv", "success.png"] {
        fs::create_dir_all(&taken)?;
        fs::write(taken.join(name), "the user's")?;
        let output = train(&file, &taken).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains("choose another folder"), "{errors}");
        assert_eq!(fs::read_to_string(taken.join(name))?, "the user's");
        assert_eq!(fs::read_dir(&taken)?.count(), 1, "{name}");
        fs::remove_dir_all(&taken)?;
    }
    Ok(())
}

#[test]
fn bad_grid_files_are_refused() -> Result {
    let folder = tempdir()?;
    let file = folder.path().join("grid.json");
    for (from, to, words) in [
        ("\"seeds\"", "\"seed\"", "there is no key seed; did you mean seeds?"),
        ("\"gamma\"", "\"gama\"", "there is no setting gama; did you mean gamma?"),
        ("FetchReach-v4", "FetchRech-v4", "FetchReach-v4"),
        ("\"fast\"", "\"author\"", "there is no preset author; did you mean authors?"),
        ("[0.9, 0.95]", "0.9", "gamma is 0.9: write a list, such as [0.9]"),
        ("[0.9, 0.95]", "[]", "gamma is empty"),
        ("[0.9, 0.95]", "[0.9, 2]", "gamma is 2.0: choose from 0.0 to 1.0"),
        ("[0.9, 0.95]", "[0.9, \"much\"]", "\"much\" is not a value of gamma"),
        ("[0.9, 0.95]", "[0.9, 0.90]", "gamma=0.9, hidden=[32,32]"),
        ("\"hidden\"", "\"gamma\"", "gamma appears twice"),
        ("[3, 1]", "[3, 1, 3]", "seed 3 appears twice"),
        ("[3, 1]", "[]", "seeds is empty"),
        ("\"seeds\": [3, 1]", "\"target\": 1", "duplicate field `target`"),
        (",\n    \"seeds\": [3, 1]", "", "missing field `seeds`"),
        ("\"steps\": 600", "\"steps\": -600", "invalid value: integer `-600`"),
        ("}\n}", "", "the file is not a grid"),
        ("[3, 1]", &format!("{:?}", (0..501).collect::<Vec<_>>()), "has 1002 runs"),
    ] {
        assert!(GRID.contains(from) || from == "}\n}", "{from}");
        fs::write(
            &file,
            if GRID.contains(from) { GRID.replace(from, to) } else { "{".to_owned() },
        )?;
        let output = train(&file, &folder.path().join("out")).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{to}: {errors}");
        assert!(errors.contains(words) && errors.contains("grid.json"), "{to}: {errors}");
        assert!(!folder.path().join("out").exists(), "{to}");
    }
    let mut flags = fetch("train --seed 1 --grid");
    assert_eq!(flags.arg(&file).output()?.status.code(), Some(2));
    Ok(())
}
