//! The folders of runs: what is written, who may write, and what is never touched. How users start,
//! stop and resume runs is tested in the program.
#![allow(clippy::unwrap_used, reason = "a panic fails a test")]

use std::collections::BTreeMap;
use std::error::Error;
use std::ffi::OsString;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use baselines::learn::{CurveRow, DistillSettings, Preset, TrainSettings, Trainer};
use baselines::runs::{
    BuiltInTasks, FolderError, Grid, GridError, GridFolder, Group, Lessons, MakeEnvs, NewRun,
    NewStudent, Ready, RunDescription, RunFolder, RunModel, RunPlan, RunsError, Student, Teacher,
};
use baselines::workers::OneProcess;
use fetch_env::{EnvId, FetchConfig, MakeError, ModelSource, MujocoEnv, Task, make};
use tempfile::tempdir;

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

fn reach() -> EnvId {
    "FetchReach-v4".parse().unwrap()
}

/// A description of every kind of thing.
fn description() -> RunDescription {
    let mut description = RunDescription::new(reach(), Preset::Fast, 7);
    description.demos = Some("3".to_owned());
    description.changes = vec!["gamma=0.9".to_owned()];
    description
}

fn contents(folder: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    let file = |entry: fs::DirEntry| Ok((entry.file_name(), fs::read(entry.path())?));
    fs::read_dir(folder)?.map(|entry| file(entry?)).collect()
}

#[test]
fn the_description_of_a_run_is_as_it_always_was() -> Result {
    let folder = tempdir()?;
    drop(RunFolder::create(folder.path(), description(), false)?);
    let expected = r#"{
  "env_id": "FetchReach-v4",
  "model": "builtin",
  "steps": 10000,
  "updates": null,
  "target": 1.0,
  "seed": 7,
  "preset": "fast",
  "demos": "3",
  "changes": [
    "gamma=0.9"
  ]
}
"#;
    assert_eq!(fs::read_to_string(folder.path().join("run.json"))?, expected);
    assert_eq!(description().group(), "FetchReach-v4-fast-demos=3-gamma=0.9");
    Ok(())
}

#[test]
fn a_description_keeps_the_settings_of_the_environment() -> Result {
    let folder = tempdir()?;
    let mut description = description();
    let config = FetchConfig::from(reach()).with_distance_threshold(0.02)?;
    description.model = RunModel::Folder(folder.path().join("scenes"));
    description.config = Some(config.clone());
    drop(RunFolder::create(folder.path(), description.clone(), false)?);
    let read = RunDescription::read(folder.path())?;
    assert_eq!(read, description);
    assert_eq!(read.config(), config.with_model(description.model.source()));
    description.config = None;
    assert!(!read.differs_in_seed_alone(&description));
    Ok(())
}

#[test]
fn a_folder_is_of_one_process_until_it_is_dropped() -> Result {
    let folder = tempdir()?;
    let first = RunFolder::create(folder.path(), description(), false)?;
    for second in
        [RunFolder::create(folder.path(), description(), true), RunFolder::resume(folder.path())]
    {
        assert!(matches!(second, Err(FolderError::InUse { .. })), "{second:?}");
    }
    // Reading needs no lock, and cannot write.
    let read = RunFolder::open(folder.path())?;
    assert!(matches!(read.write_curve(&[]), Err(FolderError::ReadOnly { .. })));
    drop(first);
    drop(RunFolder::create(folder.path(), description(), false)?);
    Ok(())
}

#[test]
fn what_may_not_belong_to_a_run_is_refused_and_stays() -> Result {
    for (name, text, overwrite) in [
        ("thesis.txt", "a thesis", true),
        ("run.json", "{\"of\": \"another program\"}", true),
        ("run.json", "{\"of\": \"another program\"}", false),
        ("curve.csv", "a curve", false),
        ("checkpoint-000000000000.zip", "", true),
        ("run.lock", "the user's", false),
    ] {
        let folder = tempdir()?;
        fs::write(folder.path().join(name), text)?;
        let before = contents(folder.path())?;
        let refused = RunFolder::create(folder.path(), description(), overwrite);
        assert!(refused.is_err(), "{name}: {refused:?}");
        let mut after = contents(folder.path())?;
        if name != "run.lock" {
            after.remove(&OsString::from("run.lock"));
        }
        assert!(after == before, "{name}");
    }
    Ok(())
}

/// Small networks, short cycles and evaluations.
fn short() -> Result<TrainSettings> {
    let mut settings = Preset::Fast.settings(Task::Reach);
    for (name, value) in [
        ("hidden", serde_json::json!([16])),
        ("batch_size", 16.into()),
        ("evaluation_episodes", 4.into()),
        ("evaluation_interval", 100.into()),
    ] {
        settings = settings.with_value(name, value)?;
    }
    Ok(settings)
}

fn begin(path: &Path, overwrite: bool) -> Result<Ready<Trainer<MujocoEnv>>, RunsError> {
    let mut description = RunDescription::new(reach(), Preset::Fast, 7);
    (description.steps, description.target) = (200, 2.0);
    let settings = short().expect("they are settings");
    let new = NewRun { description, settings, start: None, overwrite };
    new.begin(&BuiltInTasks, path, 1, Box::new(OneProcess), |_| Ok(()))
}

#[test]
fn a_run_begins_ends_and_is_resumed_or_replaced() -> Result {
    let folder = tempdir()?;
    let watch = || |_: &Trainer<MujocoEnv>, _: Option<&CurveRow>| ControlFlow::Continue(());
    let Ready { mut trainer, folder: files, .. } = begin(folder.path(), false)?;
    let plan = RunPlan::of(files.description());
    plan.run(&mut trainer, Some(&files), &mut watch())?;
    let stopped = plan.finish(&BuiltInTasks, &mut trainer, &files, 1, || false);
    assert!(matches!(stopped, Err(RunsError::Evaluate(_))), "{stopped:?}");
    let outcome = plan.finish(&BuiltInTasks, &mut trainer, &files, 1, || true)?;
    assert_eq!((outcome.counters.steps, outcome.reached), (200, None));
    let policy = files.read_policy()?;
    assert_eq!(policy.header().success, outcome.success);
    assert_eq!(files.read_curve()?.len(), trainer.rows().len());
    drop(files);
    let refused = begin(folder.path(), false);
    let is_told = matches!(
        &refused,
        Err(RunsError::Folder(FolderError::HasRun { has_checkpoint: true, .. }))
    );
    assert!(is_told, "{refused:?}");
    // A run that has ended ends again in the same way.
    let Ready { mut trainer, folder: files, .. } = Ready::resume(&BuiltInTasks, folder.path(), 1)?;
    plan.run(&mut trainer, Some(&files), &mut watch())?;
    assert_eq!(
        plan.finish(&BuiltInTasks, &mut trainer, &files, 1, || true)?.success,
        outcome.success
    );
    assert!(files.read_policy()?.to_bytes()? == policy.to_bytes()?);
    files.remove_checkpoints()?;
    drop(files);
    assert!(RunFolder::is_finished(folder.path())?);
    let nothing = Ready::resume(&BuiltInTasks, folder.path(), 1);
    assert!(
        matches!(nothing, Err(RunsError::Folder(FolderError::NoCheckpoint { .. }))),
        "{nothing:?}"
    );
    drop(begin(folder.path(), true)?);
    assert!(!folder.path().join("policy.safetensors").exists());
    Ok(())
}

#[test]
fn a_run_begins_or_is_resumed_and_is_no_other() -> Result {
    let folder = tempdir()?;
    let new = |seed: u64, settings: TrainSettings, config: FetchConfig| {
        let (model, id) = (RunModel::Builtin, reach());
        let mut description = RunDescription::of_settings(id, model, config, &settings, seed);
        (description.steps, description.target) = (200, 2.0);
        NewRun { description, settings, start: None, overwrite: false }.resume_or_begin(
            &BuiltInTasks,
            folder.path(),
            1,
        )
    };
    let config = || FetchConfig::from(reach());
    let Ready { mut trainer, folder: files, .. } = new(7, short()?, config())?;
    // Cycle by cycle it is the run of the loop.
    let mut cycles = RunPlan::of(files.description()).begin(&mut trainer, Some(&files))?;
    assert_eq!(files.read_curve()?, []);
    let mut steps = Vec::new();
    let mut watch = |trainer: &Trainer<MujocoEnv>, _: Option<&CurveRow>| {
        steps.push(trainer.counters().steps);
        if steps.len() == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    assert!(cycles.next(&mut trainer, Some(&files), &mut watch)?.is_continue());
    assert!(cycles.next(&mut trainer, Some(&files), &mut watch)?.is_break(), "watch stops it");
    trainer.save(files.path())?;
    drop(files);
    for (refused, what) in [
        (new(8, short()?, config()), "has the seed 7"),
        (new(7, short()?.with("gamma=0.5")?, config()), "has other settings:"),
        (new(7, short()?, config().with_target_range(0.1)?), "other settings of the environment"),
    ] {
        let error = refused.err().ok_or("it is another run")?;
        assert!(error.to_string().contains(what), "{error}");
    }
    let Ready { mut trainer, folder: files, .. } = new(7, short()?, config())?;
    assert_eq!(trainer.counters().steps, steps[1]);
    let plan = RunPlan::of(files.description());
    let mut watch = |_: &Trainer<MujocoEnv>, _: Option<&CurveRow>| ControlFlow::Continue(());
    plan.run(&mut trainer, Some(&files), &mut watch)?;
    let whole = tempdir()?;
    let Ready { trainer: mut other, folder: files, .. } = begin(whole.path(), false)?;
    plan.run(&mut other, Some(&files), &mut watch)?;
    let policies = [trainer, other].map(|trainer| trainer.policy("FetchReach-v4"));
    let [first, second] = policies.map(|policy| policy.unwrap().to_bytes().unwrap());
    assert!(first == second);
    Ok(())
}

/// Makes environments of a task that is not built in, by its name.
struct Own(&'static str);

impl MakeEnvs for Own {
    type Env = MujocoEnv;

    fn task(&self) -> Option<&str> {
        Some(self.0)
    }

    fn make(&self, config: FetchConfig) -> Result<MujocoEnv, MakeError> {
        make(config)
    }
}

#[test]
fn a_run_goes_on_with_its_own_task_alone() -> Result {
    let folder = tempdir()?;
    let description = RunDescription::new(reach(), Preset::Fast, 7);
    let new = NewRun { description, settings: short()?, start: None, overwrite: false };
    let begun = new
        .begin(&Own("Lift"), folder.path(), 1, Box::new(OneProcess), |_| Ok::<_, RunsError>(()))?;
    assert_eq!(begun.folder.description().title(), "Lift");
    drop(begun);
    let other = Ready::resume(&Own("Stack"), folder.path(), 1);
    for refused in [other, Ready::resume(&BuiltInTasks, folder.path(), 1)] {
        assert!(
            matches!(&refused, Err(RunsError::OtherTask { task, .. }) if task == "Lift"),
            "{refused:?}"
        );
    }
    Ready::resume(&Own("Lift"), folder.path(), 1)?;
    Ok(())
}

#[test]
fn settings_are_described_by_what_differs_from_the_nearest_preset() -> Result {
    let describe = |settings: &TrainSettings, model, config| {
        RunDescription::of_settings(reach(), model, config, settings, 3)
    };
    for preset in Preset::ALL {
        let settings = preset.settings(Task::Reach);
        let of_preset = describe(&settings, RunModel::Builtin, reach().config());
        assert_eq!(of_preset, RunDescription::new(reach(), preset, 3));
        let seeing = settings.clone().with_pixels(Task::Reach);
        assert_eq!(describe(&seeing, RunModel::Builtin, reach().config()), of_preset);
        let changed = settings.with("evaluation_episodes=31")?;
        let config = reach().config().with_distance_threshold(0.02)?;
        let changed = describe(&changed, RunModel::Reference, config.clone());
        assert_eq!(changed.preset, Some(preset));
        assert_eq!(
            changed.changes,
            ["evaluation_episodes=31", "reference", "distance_threshold=0.02"]
        );
        assert_eq!(changed.config(), config.with_model(ModelSource::Reference));
    }
    Ok(())
}

fn begin_student(path: &Path, teacher: Teacher) -> Result<Ready<Student>, RunsError> {
    let mut settings = DistillSettings::of_task(Task::Reach, false);
    (settings.hidden, settings.num_envs, settings.batch_size) = (vec![8], 2, 8);
    (settings.evaluation_interval, settings.evaluation_episodes) = (200, 3);
    let (model, config) = (RunModel::Builtin, reach().config());
    let mut description = RunDescription::of_student(reach(), model, config, 7);
    (description.steps, description.target) = (400, 2.0);
    let lessons = Lessons::Teacher(teacher, settings);
    NewStudent { description, lessons, overwrite: false }.resume_or_begin(&BuiltInTasks, path, 1)
}

#[test]
fn a_student_goes_on_with_its_own_teacher_alone() -> Result {
    let [whole, stopped] = [tempdir()?, tempdir()?];
    let trained = || Teacher::named("trained", Task::Reach);
    let Ready { mut trainer, folder, .. } = begin_student(whole.path(), trained()?)?;
    let plan = RunPlan::of(folder.description());
    plan.run(&mut *trainer, Some(&folder), &mut |_: &_, _: Option<&_>| ControlFlow::Continue(()))?;
    plan.finish(&BuiltInTasks, &mut *trainer, &folder, 1, || true)?;
    let name = folder.description().group();
    let begins = "FetchReach-v4-distilled-teacher=seed_";
    assert!(name.starts_with(begins) && name.ends_with("-num_envs=2"), "{name}");
    let Ready { mut trainer, folder: files, .. } = begin_student(stopped.path(), trained()?)?;
    let mut watch = |_: &_, _: Option<&_>| ControlFlow::Break(());
    plan.run(&mut *trainer, Some(&files), &mut watch)?;
    assert_eq!(trainer.counters().steps, 100);
    drop(files);
    let Ready { mut trainer, folder: files, .. } = begin_student(stopped.path(), trained()?)?;
    plan.run(&mut *trainer, Some(&files), &mut |_: &_, _: Option<&_>| ControlFlow::Continue(()))?;
    plan.finish(&BuiltInTasks, &mut *trainer, &files, 1, || true)?;
    assert_eq!(files.read_policy()?, folder.read_policy()?);
    drop((files, folder));

    let error = begin_student(stopped.path(), Teacher::Scripted).expect_err("another teacher");
    assert!(error.to_string().contains("has another teacher"), "{error}");
    let error = Ready::resume(&BuiltInTasks, stopped.path(), 1).expect_err("it has a teacher");
    assert!(matches!(error, RunsError::HasTeacher { .. }), "{error}");
    let taught = tempdir()?;
    drop(begin(taught.path(), false)?);
    let error = begin_student(taught.path(), trained()?).expect_err("it has none");
    assert!(error.to_string().contains("has no teacher"), "{error}");
    for (name, message) in [("planned", "plan anew"), ("tariner", "no teacher tariner")] {
        let error = Teacher::named(name, Task::Reach).expect_err("it is none");
        assert!(error.to_string().contains(message), "{error}");
    }
    Ok(())
}

const GRID: &str = r#"{ "env_id": "FetchReach-v4", "preset": "fast",
    "set": { "hidden": [[8]], "gamma": [0.9, 0.95], "batch_size": [32, 64] }, "seeds": [3, 1] }"#;

#[test]
fn a_grid_is_every_choice_with_every_seed() -> Result {
    let grid = Grid::parse(GRID)?;
    let preset = grid.preset()?.settings(Task::Reach);
    let choices = grid.choices(&preset)?;
    let parts: Vec<_> = choices.iter().map(|choice| choice.parts.join(" ")).collect();
    assert_eq!(parts.len(), 4);
    assert_eq!(parts[1], "gamma=0.9 batch_size=64", "the last one changes first");
    let folder = tempdir()?;
    let opened = GridFolder::open(folder.path(), &grid, &preset)?;
    let runs = grid.runs(&choices, &opened)?;
    assert_eq!(runs.len(), 8);
    assert!(runs[2].path.ends_with("runs/batch_size=64-gamma=0.9/seed-3"), "{:?}", runs[2].path);
    assert_eq!(runs[2].description.changes, ["hidden=[8]", "gamma=0.9", "batch_size=64"]);
    assert_eq!((runs[2].description.steps, runs[2].description.target), grid.limits()?);
    drop(opened);
    let other = Grid::parse(&GRID.replace("0.95", "0.97"))?;
    let changed = GridFolder::open(folder.path(), &other, &preset);
    assert!(
        matches!(&changed, Err(GridError::Changed { difference, .. })
            if difference == "grid.set.gamma"),
        "{changed:?}"
    );
    Ok(())
}

#[test]
fn a_grid_can_change_one_setting_at_a_time() -> Result {
    let text = GRID.replace("{ \"env_id\"", "{ \"one_at_a_time\": true, \"env_id\"");
    let grid = Grid::parse(&text.replace("[32, 64]", "[32, 64, 128]"))?;
    let preset = grid.preset()?.settings(Task::Reach);
    let choices = grid.choices(&preset)?;
    let parts: Vec<_> = choices.iter().map(|choice| choice.parts.join(" ")).collect();
    let expected = ["0.9 32", "0.9 64", "0.9 128", "0.95 32"];
    let expected = expected.map(|values| format!("gamma={}", values.replace(' ', " batch_size=")));
    assert_eq!(parts, expected);
    // Three choices, not four.
    let seeds = |count: u64| format!("{:?}", (0..count).collect::<Vec<_>>());
    let with_seeds = |count| Grid::parse(&text.replace("[3, 1]", &seeds(count)));
    assert!(with_seeds(333).is_ok());
    assert!(matches!(with_seeds(334), Err(GridError::TooMany { num_runs: 1_002, .. })));
    Ok(())
}

#[test]
fn a_group_has_the_name_of_an_environment() {
    for name in ["FetchPush-v4", "FetchPush-v4-fast-gamma=0.9"] {
        assert_eq!(Group::new(name).unwrap().name(), name);
    }
    for name in ["", "FetchPush", "FetchPish-v4-fast", "curves"] {
        assert!(Group::new(name).is_err(), "{name}");
    }
}
