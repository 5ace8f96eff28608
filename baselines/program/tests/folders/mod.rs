//! The folders of runs: what overwriting removes, who may write, and where links lead.

use std::{
    collections::BTreeMap, ffi::OsString, fs, os::unix::fs::symlink, path::Path, process::Stdio,
};

use tempfile::tempdir;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

use super::program::fetch;
use super::{num_checkpoints, resume, start, train, wait_for};

/// Returns the files of a folder and their contents.
fn contents(folder: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    let file = |entry: fs::DirEntry| Ok((entry.file_name(), fs::read(entry.path())?));
    fs::read_dir(folder)?.map(|entry| file(entry?)).collect()
}

#[test]
fn overwriting_removes_what_a_run_wrote_and_nothing_else() -> Result {
    let folder = tempdir()?;
    let [target, out] = ["target", "link"].map(|name| folder.path().join(name));
    fs::create_dir_all(target.join("photos"))?;
    fs::write(target.join("photos/1.jpg"), "a photo")?;
    fs::write(target.join("thesis.txt"), "a thesis")?;
    fs::write(target.join("checkpoint-best.zip"), "the user's")?;
    symlink("target", &out)?;
    output_of(&mut train("--steps 300 --seed 1", &out))?;
    let names: Vec<_> = contents_of_run(&out)?.into_keys().collect();
    assert_eq!(
        names,
        [
            "checkpoint-000000000200.zip",
            "checkpoint-000000000300.zip",
            "curve.csv",
            "page.html",
            "policy.safetensors",
            "run.json",
            "run.lock",
        ]
    );
    // Errors are found before anything is removed.
    let before = contents_of_run(&out)?;
    for (flags, words) in [
        ("", "has a run: continue it with --resume, replace it with --overwrite"),
        ("--overwrite --demos missing.npz", "--demos missing.npz: cannot read the archive"),
        ("--overwrite --set batch_size=0", "batch_size is 0"),
    ] {
        let output = train(flags, &out).output()?;
        let errors = errors_of(&output);
        assert!(!output.status.success() && errors.contains(words), "{flags}: {errors}");
        assert!(contents_of_run(&out)? == before, "{flags}");
    }
    output_of(&mut train("--steps 100 --seed 2 --overwrite", &out))?;
    assert!(out.is_symlink(), "the link is one still");
    assert_eq!(read_json(&out.join("run.json"))?["seed"], 2);
    assert_eq!(fs::read_to_string(target.join("photos/1.jpg"))?, "a photo");
    assert_eq!(fs::read_to_string(target.join("thesis.txt"))?, "a thesis");
    assert_eq!(fs::read_to_string(target.join("checkpoint-best.zip"))?, "the user's");
    let names: Vec<_> = contents_of_run(&out)?.into_keys().collect();
    assert!(!names.contains(&"checkpoint-000000000300.zip".into()), "{names:?}");
    Ok(())
}

/// Returns the contents of a folder, except the user's files of a test.
fn contents_of_run(out: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    let is_users = |name: &OsString| {
        ["photos", "thesis.txt", "checkpoint-best.zip"].iter().any(|other| name == other)
    };
    let names = fs::read_dir(out)?.map(|entry| Ok(entry?.file_name()));
    let names = names.filter(|name: &Result<_>| !name.as_ref().is_ok_and(is_users));
    names.map(|name| name.and_then(|name| Ok((name.clone(), fs::read(out.join(name))?)))).collect()
}

#[test]
fn a_folder_of_something_else_is_not_overwritten() -> Result {
    for (file, text, flags, words) in [
        ("thesis.txt", "a thesis", "--overwrite", "is not the folder of a run"),
        ("run.json", "{\"of\": \"another program\"}", "--overwrite", "run.json is damaged"),
        ("run.json", "{\"of\": \"another program\"}", "", "run.json is damaged"),
        ("policy.safetensors", "a policy", "", "there is no run.json beside it"),
        ("checkpoint-000000000000.zip", "", "--overwrite", "there is no run.json beside it"),
    ] {
        let out = tempdir()?;
        fs::write(out.path().join(file), text)?;
        let before = contents(out.path())?;
        let output = train(flags, out.path()).output()?;
        let errors = errors_of(&output);
        assert!(output.status.code() == Some(1) && errors.contains(words), "{file}: {errors}");
        assert!(contents(out.path())? == before, "{file}");
    }
    // A run may begin beside the user's files.
    let out = tempdir()?;
    fs::write(out.path().join("thesis.txt"), "a thesis")?;
    output_of(&mut train("--steps 100", out.path()))?;
    assert_eq!(fs::read_to_string(out.path().join("thesis.txt"))?, "a thesis");
    Ok(())
}

/// Whenever it is killed, either the old run can be resumed or a new one started, and the other
/// command says what to do instead.
#[test]
fn a_killed_overwrite_leaves_a_run_to_resume_or_a_folder_to_start_in() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    output_of(&mut train("--steps 200", &out))?;
    let gone = |name: &str| !out.join(name).exists();
    let moments: [&dyn Fn() -> bool; 4] = [
        &|| gone("page.html"),
        &|| gone("curve.csv"),
        &|| gone("checkpoint-000000000100.zip"),
        &|| num_checkpoints(&out) == 0,
    ];
    for moment in moments {
        let mut run = train("--steps 200 --overwrite", &out).spawn()?;
        wait_for(&mut run, moment)?;
        run.kill()?;
        run.wait()?;
        let has_checkpoint = num_checkpoints(&out) > 0;
        let start = || train("--steps 200", &out);
        let (mut works, mut other, words) = match has_checkpoint {
            true => (resume(&out), start(), "continue it with --resume"),
            false => (start(), resume(&out), "start the run again, without --resume"),
        };
        let errors = errors_of(&other.output()?);
        assert!(errors.contains(words), "{errors}");
        output_of(&mut works)?;
    }
    // The same for a folder with only a description.
    for entry in fs::read_dir(&out)? {
        let path = entry?.path();
        if !path.ends_with("run.json") {
            fs::remove_file(path)?;
        }
    }
    assert!(errors_of(&resume(&out).output()?).contains("start the run again"));
    output_of(&mut train("--steps 200", &out))?;
    Ok(())
}

#[test]
fn one_process_at_a_time_writes_in_a_folder() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    let mut run = start("--steps 100000000", &out)?;
    let description = fs::read(out.join("run.json"))?;
    for mut second in [train("--overwrite --steps 100", &out), resume(&out)] {
        let output = second.output()?;
        let (errors, holder) = (errors_of(&output), format!("process {} on ", run.id()));
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains(&holder) && errors.contains("is using the folder"), "{errors}");
    }
    assert!(run.try_wait()?.is_none() && fs::read(out.join("run.json"))? == description);
    // A killed process no longer has the lock.
    run.kill()?;
    run.wait()?;
    output_of(resume(&out).args(["--steps", "1"]))?;
    Ok(())
}

#[test]
fn of_two_starts_at_the_same_time_one_has_the_folder() -> Result {
    for round in 0..3 {
        let folder = tempdir()?;
        let out = folder.path().join("run");
        let start = |seed: u32| {
            train(&format!("--steps 100 --seed {seed}"), &out)
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
        };
        let runs = [start(1)?, start(2)?];
        let mut succeeded = Vec::new();
        for (seed, run) in (1..).zip(runs) {
            let output = run.wait_with_output()?;
            let errors = errors_of(&output);
            if output.status.success() {
                succeeded.push(seed);
            } else {
                let is_told =
                    errors.contains("is using the folder") || errors.contains("has a run");
                assert!(is_told, "round {round}: {errors}");
            }
        }
        assert_eq!(succeeded.len(), 1, "round {round}");
        assert_eq!(read_json(&out.join("run.json"))?["seed"], succeeded[0]);
        let resumed = output_of(resume(&out).args(["--steps", "1"]))?;
        assert!(resumed.contains(&format!("seed {}: ", succeeded[0])), "{resumed}");
    }
    Ok(())
}

#[test]
fn links_in_a_folder_lead_to_no_victim() -> Result {
    let folder = tempdir()?;
    let [out, victim] = ["run", "victim.txt"].map(|name| folder.path().join(name));
    fs::write(&victim, "the user's")?;
    output_of(&mut train("--steps 100", &out))?;
    for name in ["curve.csv", "page.html", "policy.safetensors"] {
        fs::remove_file(out.join(name))?;
        symlink("../victim.txt", out.join(name))?;
    }
    symlink("../victim.txt", out.join("unfinished.zip"))?;
    output_of(resume(&out).args(["--steps", "200"]))?;
    assert!(!out.join("curve.csv").is_symlink());
    fs::remove_file(out.join("run.lock"))?;
    symlink("../victim.txt", out.join("run.lock"))?;
    let errors = errors_of(&resume(&out).output()?);
    assert!(errors.contains("cannot lock"), "{errors}");
    assert_eq!(fs::read_to_string(&victim)?, "the user's");
    Ok(())
}

#[test]
fn names_of_curves_lead_to_no_other_folder() -> Result {
    let folder = tempdir()?;
    let [run, curves] = ["run", "curves"].map(|name| folder.path().join(name));
    output_of(&mut train("--steps 100", &run))?;
    let description = fs::read_to_string(run.join("run.json"))?;
    let forged = |part: &str, forged: &str| -> Result {
        let mut value: serde_json::Value = serde_json::from_str(&description)?;
        value[part] = serde_json::from_str(forged)?;
        Ok(fs::write(run.join("run.json"), value.to_string())?)
    };
    for (part, value) in [
        ("changes", r#"["/../../pwned"]"#),
        ("changes", r#"["/tmp/pwned", "\u0000"]"#),
        ("changes", r#"["..%2F..%2Fpwned"]"#),
        ("demos", r#""pwned/..""#),
        ("demos", r#""/etc/pw\\ned""#),
        ("env_id", r#""FetchReach-v4/../../../pwned""#),
    ] {
        forged(part, value)?;
        // One that is refused writes nothing.
        fetch("learning-curves --out").args([&curves, &run]).output()?;
    }
    let names = |folder: &Path| -> Result<Vec<_>> {
        let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name()));
        names.collect::<Result<Vec<OsString>>>()
    };
    let mut beside = names(folder.path())?;
    beside.sort();
    assert_eq!(beside, ["curves", "run"]);
    assert_eq!(names(&curves)?.len(), 3 * 5, "{:?}", names(&curves)?);
    Ok(())
}
