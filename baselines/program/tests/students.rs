//! Runs with a teacher, and of policies that see pictures, as a user starts and resumes them.

mod program;

use std::{fs, path::Path, process::Command};

use baselines::{AnyPolicy, Sight};
use fetch_env::{Camera, FreeCamera, RenderEnv, RenderOptions, Task, make};
use program::fetch;
use tempfile::tempdir;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
    unless_blind,
};

/// Few and small updates and evaluations, of rounds of 200 steps.
const SHORT: &str = "--set hidden=[16] --set batch_size=8 --set updates_per_step=1 --set \
                     evaluation_episodes=3 --set evaluation_interval=200 --envs 4 --target 2 --seed 3";

/// The same without a teacher.
const SHORT_ALONE: &str = "--set hidden=[16] --set batch_size=8 --set pixel_hidden=[16] --set \
                           pixel_batch_size=4 --set updates_per_cycle=8 --set \
                           evaluation_episodes=3 --set evaluation_interval=200 --target 2 --seed 3";

fn train(flags: &str, out: &Path) -> Command {
    begin(&format!("{SHORT} {flags}"), out)
}

fn begin(flags: &str, out: &Path) -> Command {
    let mut command = fetch(&format!("train {flags} --out"));
    command.arg(out);
    command
}

fn resume(flags: &str, out: &Path) -> Command {
    let mut command = fetch(&format!("train {flags} --resume"));
    command.arg(out);
    command
}

fn policy(out: &Path) -> Result<AnyPolicy> {
    Ok(AnyPolicy::load(out.join("policy.safetensors"))?)
}

/// Returns the columns of a curve, without the time.
fn curve(out: &Path) -> Result<Vec<Vec<String>>> {
    let text = fs::read_to_string(out.join("curve.csv"))?;
    let rows = text.lines().map(|line| {
        let cells = line.split(',').enumerate().filter(|(column, _)| *column != 4);
        cells.map(|(_, cell)| cell.to_owned()).collect()
    });
    Ok(rows.collect())
}

fn can_see() -> Result<bool> {
    Ok(unless_blind(make("FetchReach-v4")?.renderer(RenderOptions::default()))?.is_some())
}

#[test]
fn a_student_of_pictures_is_resumed_to_the_same_bits_with_the_same_camera_alone() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let folder = tempdir()?;
    let [whole, stopped] = ["whole", "stopped"].map(|name| folder.path().join(name));
    let board = folder.path().join("board");
    let flags = "--env-id FetchReach-v4 --teacher trained --pixels --size 24 --goal-marker";
    let text = output_of(
        train(&format!("{flags} --steps 600 --threads 2"), &whole).arg("--tensorboard").arg(&board),
    )?;
    assert!(text.contains("of 3 episodes on new seeds succeed"), "{text}");
    assert_eq!(fs::read_dir(board.join("seed-3"))?.count(), 1);
    output_of(&mut train(&format!("{flags} --steps 200 --threads 1"), &stopped))?;
    output_of(&mut resume("--steps 600", &stopped))?;
    assert!(policy(&whole)? == policy(&stopped)?, "the policies differ");
    assert_eq!(curve(&whole)?, curve(&stopped)?);
    assert_eq!(curve(&whole)?.len(), 4);

    let AnyPolicy::Pixels(student) = policy(&whole)? else { panic!("it sees no pictures") };
    let size = |view: RenderOptions| view.with_width(24).with_height(24);
    let sight = Sight::of_task(Task::Reach).with_view(|view| size(view).with_goals_shown(true));
    assert_eq!(*student.sight(), sight);
    assert_eq!(student.header().success.map(|success| success.episodes), Some(3));
    let page = fs::read_to_string(whole.join("page.html"))?;
    assert!(page.contains("class=\"seen\"") && page.contains("imitates a teacher"));
    let run = read_json(&whole.join("run.json"))?;
    assert!(run["teacher"]["policy"].as_str().is_some_and(|name| name.contains("FetchReach-v4")));
    assert!(whole.join("teacher.safetensors").exists() && run.get("preset").is_none());

    // The description says another camera than the checkpoint.
    let text = serde_json::to_string(&serde_json::json!(sight))?;
    let far = sight.with_view(|view| view.with_camera(Camera::Free(FreeCamera::REFERENCE)));
    let run = fs::read_to_string(stopped.join("run.json"))?;
    let run = serde_json::to_string(&serde_json::from_str::<serde_json::Value>(&run)?)?;
    assert!(run.contains(&text), "{run}");
    fs::write(
        stopped.join("run.json"),
        run.replace(&text, &serde_json::to_string(&serde_json::json!(far))?),
    )?;
    let output = resume("--steps 800", &stopped).output()?;
    let errors = errors_of(&output);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("sees 24 x 24 pixels with the goal of a camera"), "{errors}");
    assert!(errors.contains("with the same camera, size and fields"), "{errors}");
    Ok(())
}

#[test]
fn a_policy_learns_from_pictures_without_a_teacher_and_is_resumed_to_the_same_bits() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let folder = tempdir()?;
    let [whole, stopped] = ["whole", "stopped"].map(|name| folder.path().join(name));
    let board = folder.path().join("board");
    let flags = "--env-id FetchReachDense-v4 --pixels --size 24 --camera reference";
    let flags = format!("{SHORT_ALONE} {flags}");
    output_of(
        begin(&format!("{flags} --steps 600 --threads 2"), &whole).arg("--tensorboard").arg(&board),
    )?;
    assert_eq!(fs::read_dir(board.join("seed-3"))?.count(), 1);
    output_of(&mut begin(&format!("{flags} --steps 300 --threads 1"), &stopped))?;
    output_of(&mut resume("--steps 600", &stopped))?;
    assert!(policy(&whole)? == policy(&stopped)?, "the policies differ");
    assert_eq!(curve(&whole)?, curve(&stopped)?);
    assert_eq!(curve(&whole)?.len(), 4);

    let AnyPolicy::Pixels(policy) = policy(&whole)? else { panic!("it sees no pictures") };
    let view = |view: RenderOptions| {
        view.with_width(24).with_height(24).with_camera(Camera::Free(FreeCamera::REFERENCE))
    };
    assert_eq!(*policy.sight(), Sight::of_task(Task::Reach).with_view(view));
    assert_eq!(policy.header().settings["pixels"]["pixel_hidden"][0], 16);
    let page = fs::read_to_string(whole.join("page.html"))?;
    assert!(page.contains("class=\"seen\"") && page.contains("Critic"));
    let run = read_json(&whole.join("run.json"))?;
    assert_eq!((&run["preset"], run.get("teacher")), (&"fast".into(), None));
    let two = folder.path().join("two");
    output_of(&mut begin(&format!("{flags} --steps 200 --seeds 2"), &two))?;
    assert!(two.join("seed-3/page.html").exists() && two.join("seed-4/page.html").exists());

    let output = begin(&format!("{flags} --algorithm sac"), &folder.path().join("sac")).output()?;
    assert_eq!(output.status.code(), Some(2));
    assert!(errors_of(&output).contains("choose ddpg"), "{}", errors_of(&output));
    let output = begin(&format!("{flags} --steps 900"), &whole).output()?;
    assert!(errors_of(&output).contains("--resume"), "{}", errors_of(&output));
    Ok(())
}

#[test]
fn a_small_student_of_the_state_is_taught_by_a_script_or_by_another_policy() -> Result {
    let folder = tempdir()?;
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let flags = "--env-id FetchPickAndPlace-v4 --steps 400 --vary gravity=9..10";
    output_of(&mut train(&format!("{flags} --teacher scripted"), &first))?;
    let student = policy(&first)?;
    let AnyPolicy::State(student) = &student else { panic!("it sees pictures") };
    assert_eq!(student.layers()[0].biases.len(), 16);
    assert!(!first.join("teacher.safetensors").exists());
    let file = first.join("policy.safetensors").display().to_string();
    output_of(&mut train(&format!("{flags} --teacher {file}"), &second))?;
    assert!(second.join("teacher.safetensors").exists());
    let before = policy(&second)?;
    output_of(&mut train(&format!("{flags} --teacher scripted --overwrite"), &second))?;
    assert!(!second.join("teacher.safetensors").exists());
    assert!(policy(&second)? == policy(&first)? && before != policy(&first)?);
    let output = train(&format!("{flags} --teacher scripted"), &second).output()?;
    assert!(errors_of(&output).contains("--overwrite"), "{}", errors_of(&output));
    Ok(())
}

#[test]
fn flags_without_a_meaning_are_refused_by_name() -> Result {
    let out = tempdir()?;
    for (flags, message) in [
        ("--teacher planned", "--teacher: the planner is no teacher"),
        ("--teacher nobody", "there is no teacher nobody: choose scripted, trained or the file"),
        ("--pixels --goal-marker", "--teacher <NAME>"),
        ("--pixels --demos 3", "'--demos <DEMOS>'"),
        ("--pixels --start F", "'--start <FILE>'"),
        ("--pixels --noise action=1", "'--noise <NAME=NUMBER>'"),
        ("--pixels --mpi", "'--mpi'"),
        ("--pixels --set pixel_batch_size=0", "pixel_batch_size is 0"),
        ("--set pixel_batch_size=8", "there is no setting pixel_batch_size"),
        ("--teacher trained --camera reference", "--pixels"),
        ("--teacher trained --size 32", "--pixels"),
        ("--teacher trained --goal-marker", "--pixels"),
        ("--teacher trained --preset book", "'--preset <PRESET>'"),
        ("--teacher trained --algorithm sac", "'--algorithm <ALGORITHM>'"),
        ("--teacher trained --demos 3", "'--demos <DEMOS>'"),
        ("--teacher trained --start F", "'--start <FILE>'"),
        ("--teacher trained --noise action=1", "'--noise <NAME=NUMBER>'"),
        ("--teacher trained --mpi", "'--mpi'"),
        ("--teacher trained --set gamma=0.9", "--set gamma=0.9: there is no setting gamma"),
        ("--teacher trained --pixels --size 4", "4 is not in 16..=512"),
        ("--teacher trained --pixels --set relative_goal=true", "relative_goal"),
    ] {
        let output = fetch(&format!("train {flags} --out")).arg(out.path()).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(2), "{flags}: {errors}");
        assert!(errors.contains(message), "{flags}: {errors}");
    }
    assert_eq!(fs::read_dir(out.path())?.count(), 0);
    Ok(())
}
