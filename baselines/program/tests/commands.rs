//! The commands as a user runs them: exit codes, output and files.

mod program;

use std::{fs, path::Path, process::Command};

use baselines::{ScriptedPolicy, buffer_config, collect};
use fetch_env::{Task, make_kinematic};
use her_relabel::HerBuffer;
use program::fetch;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

#[test]
fn figures_are_written_with_opengl_and_without() -> Result {
    for gl in ["egl", "disable"] {
        let folder = tempfile::tempdir()?;
        output_of(fetch("figures --out").arg(folder.path()).env("MUJOCO_GL", gl))?;
        for name in ["reach", "push", "pick_and_place", "slide", "observation", "rewards"] {
            let path = |ending: &str| folder.path().join(format!("{name}.{ending}"));
            assert!(fs::read(path("png"))?.starts_with(b"\x89PNG"), "{name}");
            let svg = fs::read_to_string(path("svg"))?;
            assert!(svg.ends_with("</svg>\n") || svg.ends_with("</svg>"), "{name}");
            // A picture of the scene, or the packages to install.
            let (drawn, missing) = (svg.contains("data:image/png"), svg.contains("libegl1"));
            assert_eq!(drawn || missing, !["observation", "rewards"].contains(&name), "{name}");
            assert!(!(drawn && gl == "disable"), "{name}");
        }
    }
    Ok(())
}

#[test]
fn curves_of_robustness_do_not_depend_on_the_threads() -> Result {
    let folder = tempfile::tempdir()?;
    let runs = folder.path().join("runs");
    let train = "train --seeds 2 --steps 100 --target 2 --set hidden=[8,8] --set \
                 evaluation_episodes=1 --out";
    output_of(fetch(train).arg(&runs))?;
    let runs = runs.display().to_string();
    let measure = |threads: usize| -> Result<_> {
        let [csv, json] = ["csv", "json"].map(|ending| folder.path().join(format!("r.{ending}")));
        let table = output_of(
            fetch(&format!(
                "robustness --env-id FetchReach-v4 --policy scripted,{runs} --episodes 5 --threads \
                 {threads} --factor observation_noise=0,0.5 --factor gravity=5 --with action_delay=1 \
                 --pair action_noise=0,1 action_scale=0,1,2"
            ))
            .arg("--out")
            .arg(folder.path())
            .arg("--csv")
            .arg(&csv)
            .arg("--json")
            .arg(&json),
        )?;
        let names = ["observation_noise", "gravity", "action_noise-action_scale-2"];
        let files = names.iter().flat_map(|name| ["svg", "png"].map(|end| format!("{name}.{end}")));
        let files = files.chain(["robustness.html".into()]);
        let files = files.map(|name| fs::read(folder.path().join(name)));
        let files = files.collect::<Result<Vec<_>, _>>()?;
        Ok((table, fs::read_to_string(csv)?, read_json(&json)?, files))
    };
    let (table, csv, json, files) = measure(1)?;
    assert_eq!(measure(3)?, (table.clone(), csv.clone(), json.clone(), files.clone()));
    let page = String::from_utf8(files.last().ok_or("a page")?.clone())?;
    for part in ["<h2 id=\"gravity\">gravity</h2>", "runs, mean of 2 runs", "data:image/svg+xml"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(table.contains("| action_noise \\ action_scale | 0 | 1 | 2 |"), "{table}");
    // A line for each policy and value, also of each run, and one with the columns.
    assert_eq!(csv.lines().count(), 1 + 4 * 3);
    assert!(csv.contains("\nscripted,observation_noise,0,1,"), "{csv}");
    let results = json["results"].as_array().ok_or("results")?;
    let value = |name: &str| {
        let result = results.iter().find(|result| result["name"] == name);
        result.and_then(|result| result["value"].as_f64()).ok_or_else(|| name.to_owned())
    };
    assert_eq!(value("robustness/scripted/observation_noise/0/success_rate")?, 1.0);
    let distances = csv.lines().filter(|line| line.contains(",observation_noise,0,"));
    let distances: Vec<f64> =
        distances.filter_map(|line| line.rsplit(',').next()?.parse().ok()).collect();
    let [_, one, other, mean] = distances[..] else { return Err("four policies".into()) };
    assert_ne!(one, other);
    assert!((mean - (one + other) / 2.0).abs() < 1e-12, "{mean}");
    let pair = |scale: u8| format!("robustness/scripted/action_noise=0/action_scale={scale}");
    assert_eq!(value(&format!("{}/success_rate", pair(1)))?, 1.0);
    assert!(value(&format!("{}/success_any_rate", pair(0)))? < 1.0, "it cannot move");
    let area = value("robustness/scripted/observation_noise/success_rate/area")?;
    let noisy = value("robustness/scripted/observation_noise/0.5/success_rate")?;
    assert!((area - 0.5 * (1.0 + noisy) / 2.0).abs() < 1e-12, "{area}");
    assert!(table.contains("| observation_noise | success at the end |"), "{table}");
    assert!(!table.contains("NaN"), "{table}");
    Ok(())
}

#[test]
fn the_tables_of_the_book_are_one_command() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("book.json");
    let text = output_of(fetch("robustness --book --episodes 1 --json").arg(&path))?;
    assert_eq!(text.matches("### Chapter").count(), 14);
    // The book's row above ours, of one episode.
    let book = "| the book, any time | 100 | 98 | 97 | 94 | 11 | 5 | 5 |\n| any time | ";
    assert!(text.contains(book), "{text}");
    assert!(text.contains("| the book, energy | 58.1 | 46.4 |"), "{text}");
    assert!(text.contains("Planning gap, at any time: 0 points in Reach, "), "{text}");
    let output = read_json(&path)?;
    let results = output["results"].as_array().ok_or("results")?;
    let name = "robustness/book/Reach/trained/action_scale/1/success_rate";
    let rate = results.iter().find(|result| result["name"] == name).ok_or("a figure")?;
    assert_eq!(rate["value"], 1.0);
    Ok(())
}

#[test]
fn wrong_usage_is_exit_code_2() -> Result {
    for arguments in [
        "nothing",
        "collect --episodes 0",
        "report --episodes 0",
        "train --seeds 0",
        "train --envs 0",
        "train --threads 0",
        "train --target inf",
        "train --checkpoint-seconds nan",
        "train --checkpoint-seconds inf",
        "train --checkpoint-seconds=-1",
        "train --set left_out=[999] --out nothing",
        "plan --starts 0",
        "train --vary gravity",
        "train --vary gravity=low",
        "train --vary gravity=9..8",
        "train --vary gravitation=9",
        "train --env-id FetchReach-v4 --vary object_mass=1",
        "train --noise observation",
        "train --noise object_pos=0.02",
        "train --noise action=-1",
        "robustness",
        "robustness --factor object_mass",
        "robustness --factor object_mas=1",
        "robustness --factor object_mass=0",
        "robustness --env-id FetchReach-v4 --factor object_mass=1",
        "robustness --factor gravity=9 --with friction=1,2",
        "robustness --factor gravity=9 --episodes 0",
        "robustness --factor gravity=9 --policy proportional=high",
        "robustness --pair gravity=9",
        "robustness --pair gravity=9 object_mas=1",
        "robustness --book --factor gravity=9",
        "play --policy nothing",
        "collect --format ogbench --out nothing --snapshots",
        "datasets --out nothing --only nothing",
        "datasets --out nothing --only FetchReach-v4/random --steps 50",
    ] {
        assert_eq!(fetch(arguments).output()?.status.code(), Some(2), "{arguments}");
    }
    Ok(())
}

#[test]
fn an_evaluation_starts_no_more_threads_than_it_has_episodes_and_never_thousands() -> Result {
    for command in ["evaluate", "robustness --factor gravity=9"] {
        let run = |episodes: &str| {
            fetch(&format!("{command} --policy zero --threads 40000 --episodes {episodes}"))
        };
        assert!(output_of(&mut run("2"))?.contains("2 episodes"), "{command}");
        let refused = errors_of(&run("40000").output()?);
        assert!(refused.contains("use at most 1024"), "{refused}");
    }
    Ok(())
}

#[test]
fn planned_starts_are_counted_by_the_distance_of_the_goal() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("plan.json");
    let text = output_of(fetch("plan --env-id FetchReach-v4 --starts 2 --json").arg(&path))?;
    assert!(text.contains("| all | 2 | 1.000 | 1.000 |"), "{text}");
    let output = read_json(&path)?;
    let results = output["results"].as_array().ok_or("no list")?;
    let value = |name: &str| {
        let result = results.iter().find(|result| result["name"] == name);
        result.and_then(|result| result["value"].as_f64()).ok_or(format!("no {name}"))
    };
    assert_eq!(value("plan/FetchReach-v4/all/planned/success_rate")?, 1.0);
    assert!(value("plan/FetchReach-v4/seed-1/planned/final_distance")? < 0.05);

    // Its goal is 0.22 m away. There are no more environments than candidates.
    let text = output_of(&mut fetch("plan --starts 1 --seed 3 --threads 40000"))?;
    assert!(text.contains("| 0 to 0.3 m | 1 | 1.000 |"), "{text}");
    assert!(text.contains("| from 0.7 m | 0 | - | - | - | 0 | 0 | 0 | - |"), "{text}");
    Ok(())
}

#[test]
fn demonstrations_are_scripted_archived_or_saved() -> Result {
    let folder = tempfile::tempdir()?;
    let mut env = make_kinematic("FetchReach-v4")?;
    let mut buffer = HerBuffer::<f64>::new(buffer_config(1_000, &env)?)?;
    let mut script = ScriptedPolicy::new(Task::Reach);
    collect(&mut env, &mut script, 3, 0, &mut buffer, 0, |_| ())?;
    let (archive, saved) = (folder.path().join("demos.npz"), folder.path().join("demos.buffer"));
    buffer.export_npz(&archive)?;
    buffer.save(&saved)?;
    for (run, demos) in [Path::new("3"), &archive, &saved].into_iter().enumerate() {
        let mut train = fetch("train --target 2 --steps 100 --set evaluation_episodes=5 --demos");
        train.arg(demos).arg("--out").arg(folder.path().join(run.to_string()));
        let text = output_of(&mut train)?;
        assert!(text.contains("3 episodes of demonstrations"), "{text}");
    }
    let missing =
        fetch("train --demos missing.buffer --out").arg(folder.path().join("4")).output()?;
    assert!(errors_of(&missing).contains("--demos missing.buffer"), "{}", errors_of(&missing));
    assert_eq!(missing.status.code(), Some(1));
    Ok(())
}

#[test]
fn a_file_that_cannot_be_written_is_named_and_leaves_nothing() -> Result {
    // No file can have more than 4 KiB, as if the disk was full.
    let full = "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"";
    for (name, format) in [
        ("episodes.npz", None),
        ("episodes.buffer", None),
        ("data", Some("minari")),
        ("data", Some("ogbench")),
    ] {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join(name);
        let mut collect = fetch("collect --episodes 30 --out");
        collect.arg(&path).args(format.map(|format| format!("--format={format}")));
        let output = Command::new("sh")
            .args(["-c", full])
            .arg(collect.get_program())
            .args(collect.get_args())
            .output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {errors}");
        let is_named = errors.contains(&path.display().to_string());
        assert!(is_named && errors.contains("File too large"), "{name}: {errors}");
        assert!(fs::read_dir(folder.path())?.next().is_none(), "{name} leaves nothing");
    }
    Ok(())
}

#[test]
fn a_wrong_setting_is_wrong_usage_and_named_with_the_nearest() -> Result {
    for (flags, answer) in [
        ("train --set gama=0.9", "there is no setting gama; did you mean gamma?"),
        ("train --set gamma", "write KEY=VALUE"),
        ("train --set gamma=much", "\"much\" is not a value of gamma"),
        ("train --set hidden=0.5", "0.5 is not a value of hidden"),
        ("train --set batch_size=0", "batch_size is 0: choose from 1 to 8_192"),
        ("train --set noise=1e39", "noise is inf: choose from 0.0 to 10.0"),
        ("train --set hidden=[1000000000000]", "choose from 1 to 1_024 in at most 4 layers"),
        ("train --envs 1000000", "num_envs is 1000000: choose from 1 to 1_024"),
        ("train --demos 100000000000", "choose a whole number from 0 to 10000, or a file"),
        ("train --demos=-1", "choose a whole number from 0 to 10000, or a file"),
        ("train --env-id FetchPsh-v4", "FetchPush-v4"),
    ] {
        let folder = tempfile::tempdir()?;
        let output = fetch(flags).arg("--out").arg(folder.path().join("run")).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(2), "{flags}: {errors}");
        assert!(errors.contains(answer), "{flags}: {errors}");
        assert!(fs::read_dir(folder.path())?.next().is_none(), "{flags} leaves no folder");
    }
    Ok(())
}

#[test]
fn an_evaluation_is_the_same_on_any_number_of_threads() -> Result {
    let folder = tempfile::tempdir()?;
    let evaluate = |policy: &str, threads: usize| -> Result<_> {
        let path = folder.path().join("evaluation.json");
        let flags = format!(
            "evaluate --env-id FetchReach-v4,FetchPushDense-v4 --policy {policy} --episodes 7 \
             --seed 3 --threads {threads} --json"
        );
        let table = output_of(fetch(&flags).arg(&path))?;
        Ok((table, read_json(&path)?))
    };
    for policy in ["random", "scripted", "zero"] {
        let (table, output) = evaluate(policy, 1)?;
        assert_eq!(evaluate(policy, 3)?, (table.clone(), output.clone()), "{policy}");
        assert_eq!(table.matches("50.0 (50.0 to 50.0)").count(), 2, "{table}");
        let results = output["results"].as_array().ok_or("no list")?;
        let value = |name: &str| {
            let result = results.iter().find(|result| result["name"] == name);
            result.and_then(|result| result["value"].as_f64()).ok_or(format!("no {name}"))
        };
        let rate = value("evaluate/FetchReach-v4/success_rate")?;
        assert_eq!(rate, f64::from(u8::from(policy == "scripted")), "{policy}");
        let low = value("evaluate/FetchPushDense-v4/episode_return_mean/low")?;
        let high = value("evaluate/FetchPushDense-v4/episode_return_mean/high")?;
        assert!(low < high && high < 0.0, "{policy}: {low} to {high}");
    }
    // PickAndPlace has two kinds of goals, and ten episodes have both.
    let path = folder.path().join("strata.json");
    let flags =
        "evaluate --env-id FetchPickAndPlace-v4 --policy proportional=5 --episodes 10 --json";
    let table = output_of(fetch(flags).arg(&path))?;
    assert_eq!(table.matches("| FetchPickAndPlace-v4, air |").count(), 2, "{table}");
    assert_eq!(table.matches("| FetchPickAndPlace-v4, table |").count(), 2, "{table}");
    let output = read_json(&path)?;
    let results = output["results"].as_array().ok_or("no list")?;
    for name in ["success_rate", "air/path_mean/high", "table/energy_mean"] {
        let name = format!("evaluate/FetchPickAndPlace-v4/{name}");
        assert!(results.iter().any(|result| result["name"] == name), "{name}");
    }
    // The shipped policy is not one of two tasks, but a task's own in each.
    let (table, _) = evaluate("trained", 2)?;
    assert!(table.contains("| FetchReach-v4 | 1.000 (0.646 to 1.000) |"), "{table}");
    // A single episode has no interval of its mean.
    let one = output_of(&mut fetch("evaluate --episodes 1 --policy zero"))?;
    assert!(one.contains("(-inf to inf)"), "{one}");
    Ok(())
}
