//! `learning-curves` as a user runs it, also on links, foreign files and numbers that no run has.

mod program;

use std::{fs, os::unix::fs::symlink, path::Path, process::Command};

use program::fetch;
use tempfile::tempdir;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

const HEADER: &str =
    "seed,steps,updates,seconds,success_rate,episode_return_mean,final_distance_mean";
const NAME: &str = "FetchReach-v4-fast";

fn learning_curves(folder: &Path) -> Command {
    let mut command = fetch("learning-curves --out");
    command.arg(folder);
    command
}

/// Writes the curve of a group with one line.
fn write_curve(folder: &Path, line: &str) -> Result {
    Ok(fs::write(folder.join(NAME).with_extension("csv"), format!("{HEADER}\n{line}\n"))?)
}

/// Writes the folder of a run whose curve has one line.
fn write_run(folder: &Path, line: &str) -> Result {
    fs::create_dir_all(folder)?;
    let description = r#"{ "env_id": "FetchReach-v4", "model": "builtin", "steps": 400,
        "updates": null, "target": 1.0, "seed": 7, "preset": "fast", "demos": null,
        "changes": [] }"#;
    fs::write(folder.join("run.json"), description)?;
    let header = "steps,episodes,discarded_episodes,updates,seconds,success_rate,success_low,\
                  success_high,episode_return_mean,final_distance_mean,collected_success,\
                  critic_loss,actor_loss,value";
    Ok(fs::write(folder.join("curve.csv"), format!("{header}\n{line}\n"))?)
}

#[test]
fn learning_curves_gather_runs() -> Result {
    let folder = tempdir()?;
    let (runs, curves) = (folder.path().join("runs"), folder.path().join("curves"));
    let mut train =
        fetch("train --seeds 2 --steps 400 --target 2 --set evaluation_episodes=5 --out");
    output_of(train.arg(&runs))?;
    let changes = &read_json(&runs.join("seed-1/run.json"))?["changes"];
    assert_eq!(changes[0], "evaluation_episodes=5");
    let text = output_of(fetch("learning-curves --out").args([&curves, &runs]))?;
    assert!(text.contains("FetchReach-v4-fast-evaluation_episodes=5: 0 of 2 runs"), "{text}");
    let csv = fs::read_to_string(curves.join("FetchReach-v4-fast-evaluation_episodes=5.csv"))?;
    assert!(csv.starts_with("seed,steps,updates,seconds,success_rate"), "{csv}");
    assert!(csv.lines().any(|line| line.starts_with("1,400,")), "{csv}");
    // The file alone gives the same pictures.
    let picture = || fs::read(curves.join("FetchReach-v4-fast-evaluation_episodes=5.svg"));
    let first = picture()?;
    assert!(output_of(fetch("learning-curves --out").arg(&curves))?.contains("0 of 2 runs"));
    assert!(picture()? == first, "the pictures differ");
    let nothing = fetch("learning-curves --out").arg(folder.path().join("nothing")).output()?;
    assert!(errors_of(&nothing).contains("has no curves"), "{}", errors_of(&nothing));
    Ok(())
}

#[test]
fn planted_links_lead_to_no_victim() -> Result {
    let folder = tempdir()?;
    let [curves, run, victim] =
        ["curves", "run", "victim.txt"].map(|name| folder.path().join(name));
    fs::create_dir(&curves)?;
    write_run(&run, "400,8,0,40,0.5,1.0,0.9,1.0,-2.0,0.01,,,,")?;
    // The curve is a link to a curve elsewhere, which stays as it is.
    write_curve(folder.path(), "0,200,20,0.25,0.5,-4.0,0.125")?;
    let elsewhere = folder.path().join(NAME).with_extension("csv");
    let before = fs::read_to_string(&elsewhere)?;
    symlink(&elsewhere, curves.join(NAME).with_extension("csv"))?;
    for (ending, target) in [("svg", "../victim.txt"), ("png", "../not-yet.txt")] {
        symlink(target, curves.join(NAME).with_extension(ending))?;
    }
    fs::write(&victim, "the user's")?;
    output_of(learning_curves(&curves).arg(&run))?;
    assert_eq!(fs::read_to_string(&victim)?, "the user's");
    assert_eq!(fs::read_to_string(&elsewhere)?, before);
    assert!(!folder.path().join("not-yet.txt").exists());
    for ending in ["csv", "svg", "png"] {
        let path = curves.join(NAME).with_extension(ending);
        assert!(path.symlink_metadata()?.is_file(), "{ending}");
    }
    let gathered = fs::read_to_string(curves.join(NAME).with_extension("csv"))?;
    assert_eq!(gathered, before + "7,400,40,0.5,1.0,-2.0,0.01\n");
    Ok(())
}

#[test]
fn numbers_that_no_run_has_are_refused_with_their_file() -> Result {
    let folder = tempdir()?;
    let run = folder.path().join("run");
    for seconds in ["inf", "NaN", "-1.0", "1e300", "soon"] {
        write_curve(folder.path(), &format!("0,200,20,{seconds},0.5,-4.0,0.125"))?;
        let output = learning_curves(folder.path()).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(
            errors.contains(&format!("{NAME}.csv is not a curve: ")) && errors.contains("line: 2"),
            "{errors}"
        );
    }
    fs::remove_file(folder.path().join(NAME).with_extension("csv"))?;
    for (from, to) in [(",0.5,", ",inf,"), (",1.0,0.9", ",NaN,0.9"), (",1.0,0.9", ",1.5,0.9")] {
        let line = "400,8,0,40,0.5,1.0,0.9,1.0,-2.0,0.01,,,,".replace(from, to);
        write_run(&run, &line)?;
        let output = learning_curves(folder.path()).arg(&run).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains("curve.csv is not a curve: "), "{errors}");
    }
    // The least and the largest that are drawn.
    for line in ["0,0,0,0.0,0.0,0.0,0.0", "0,18446744073709551615,0,1e12,1.0,0.0,0.0"] {
        write_curve(folder.path(), line)?;
        output_of(&mut learning_curves(folder.path()))?;
    }
    Ok(())
}

#[test]
fn other_files_in_the_folder_stay() -> Result {
    let folder = tempdir()?;
    let run = folder.path().join("run");
    write_run(&run, "400,8,0,40,0.5,1.0,0.9,1.0,-2.0,0.01,,,,")?;
    let own = [("budget.csv", "item,price\nrobot,1\n"), ("FetchTea-v4-fast.csv", "cups\n3\n")];
    for (name, text) in own {
        fs::write(folder.path().join(name), text)?;
    }
    // A curve with columns of the user, which is not written again.
    let with_notes = format!("{HEADER},note\n0,200,20,0.25,0.5,-4.0,0.125,a thesis\n");
    let curve = folder.path().join(NAME).with_extension("csv");
    fs::write(&curve, &with_notes)?;
    let errors = errors_of(&learning_curves(folder.path()).arg(&run).output()?);
    let refused = errors.contains(&format!("{NAME}.csv is not a curve: "));
    assert!(refused && errors.contains("note"), "{errors}");
    assert_eq!(fs::read_to_string(&curve)?, with_notes);
    fs::remove_file(&curve)?;
    // A picture without a curve beside it.
    let picture = folder.path().join(NAME).with_extension("png");
    fs::write(&picture, "a photo")?;
    let errors = errors_of(&learning_curves(folder.path()).arg(&run).output()?);
    assert!(errors.contains(&format!("{NAME}.png exists")), "{errors}");
    assert_eq!(fs::read_to_string(&picture)?, "a photo");
    assert!(!curve.exists());
    fs::remove_file(&picture)?;
    output_of(learning_curves(folder.path()).arg(&run))?;
    for (name, text) in own {
        assert_eq!(fs::read_to_string(folder.path().join(name))?, text);
    }
    // Without a new run, the curve is not written again.
    let kept = fs::read_to_string(&curve)?.replace("0.01", "0.010");
    fs::write(&curve, &kept)?;
    output_of(&mut learning_curves(folder.path()))?;
    assert_eq!(fs::read_to_string(&curve)?, kept);
    Ok(())
}

#[test]
fn long_curves_are_drawn_and_endless_ones_refused() -> Result {
    let folder = tempdir()?;
    let curve = folder.path().join(NAME).with_extension("csv");
    let lines = |count: usize| {
        let line = |step| format!("{},{step},{step},{step}.5,0.5,-4.0,0.125\n", step % 2);
        format!("{HEADER}\n") + &(0..count).map(line).collect::<String>()
    };
    fs::write(&curve, lines(500))?;
    output_of(&mut learning_curves(folder.path()))?;
    fs::write(&curve, lines(200_000))?;
    let errors = errors_of(&learning_curves(folder.path()).output()?);
    assert!(errors.contains(&format!("{NAME}.csv has more than")), "{errors}");
    fs::remove_file(&curve)?;
    symlink("/dev/zero", &curve)?;
    let errors = errors_of(&learning_curves(folder.path()).output()?);
    assert!(errors.contains(&format!("{NAME}.csv is not a regular file")), "{errors}");
    Ok(())
}
