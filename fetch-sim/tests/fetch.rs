//! The Fetch operations on MuJoCo, with the built-in model.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::{fs, ops::Range, path::Path, sync::Arc, thread};

use fetch_sim::{
    Control, FetchModel, ModelSource, MujocoSimulator, MujocoVersion, SimConfig, SimError,
    Simulator, Task,
};
use nalgebra::Vector3;
use testing::Result;

fn simulator(task: Task) -> Result<MujocoSimulator, SimError> {
    MujocoSimulator::new(&SimConfig::new(task))
}

/// The stack that the documentation asks of a thread.
const ENOUGH_STACK: usize = 256 << 10;

#[test]
fn a_thread_with_a_small_stack_is_enough() -> Result {
    let episode = || -> Result<(), SimError> {
        let mut simulator = simulator(Task::PickAndPlace)?;
        start(&mut simulator)?;
        (0..50).try_for_each(|step| simulator.step(&control(step)))?;
        let snapshot = simulator.snapshot();
        simulator.restore(&snapshot)
    };
    let thread = thread::Builder::new().stack_size(ENOUGH_STACK).spawn(episode)?;
    thread.join().expect("no panic")?;
    Ok(())
}

fn start(simulator: &mut MujocoSimulator) -> Result<(), SimError> {
    let object = simulator.task().has_object().then_some([1.30, 0.70]);
    simulator.reset(object)
}

/// Returns a command that differs in every step and moves everything.
fn control(step: u32) -> Control {
    let phase = f64::from(step);
    Control {
        displacement: 0.05 * Vector3::new(phase.sin(), (0.7 * phase).cos(), (1.3 * phase).sin()),
        fingers: (0.4 * phase).cos(),
    }
}

fn run(simulator: &mut MujocoSimulator, steps: Range<u32>) -> Result<Vec<f64>, SimError> {
    for step in steps {
        simulator.step(&control(step))?;
    }
    Ok([simulator.data().qpos(), simulator.data().qvel()].concat())
}

/// A task, the settled position of its gripper, and the settled height of its object.
type Start = (Task, [f64; 3], Option<f64>);

/// Recorded from gymnasium-robotics 1.4.2 on MuJoCo 2.2.2.
const STARTS_2_2_2: [Start; 4] = [
    (Task::Reach, [1.34185502, 0.74910051, 0.53470695], None),
    (Task::Push, [1.34820577, 0.74894884, 0.41361829], Some(0.42469975)),
    (Task::PickAndPlace, [1.34195502, 0.7491005, 0.53470695], Some(0.42469975)),
    (Task::Slide, [0.99611983, 0.74890587, 0.41266618], Some(0.41401894)),
];

/// The same on MuJoCo 3.6.0.
const STARTS_3_6_0: [Start; 4] = [
    (Task::Reach, [1.34183502, 0.74910104, 0.53472395], None),
    (Task::Push, [1.34550711, 0.74902525, 0.41599857], Some(0.42489222)),
    (Task::PickAndPlace, [1.34193502, 0.74910105, 0.53472396], Some(0.42489222)),
    (Task::Slide, [0.99268027, 0.74903899, 0.41551225], Some(0.41353633)),
];

/// The same on MuJoCo 3.11.0.
const STARTS_3_11_0: [Start; 4] = [
    (Task::Reach, [1.3418337, 0.74910102, 0.53473237], None),
    (Task::Push, [1.36312667, 0.74909933, 0.41601132], Some(0.42489222)),
    (Task::PickAndPlace, [1.3419337, 0.74910104, 0.53473238], Some(0.42489222)),
    (Task::Slide, [1.01327141, 0.74915319, 0.41550024], Some(0.41999955)),
];

/// The same on MuJoCo 3.17.0 and 4.0.0, on which gymnasium-robotics needs help to start.
const STARTS_4_0: [Start; 4] = [
    (Task::Reach, [1.34181322, 0.74910098, 0.53472178], None),
    (Task::Push, [1.36285049, 0.74910046, 0.41601312], Some(0.42489222)),
    (Task::PickAndPlace, [1.34191322, 0.74910101, 0.53472179], Some(0.42489222)),
    (Task::Slide, [1.01300271, 0.74915414, 0.4155027], Some(0.41999941)),
];

#[test]
fn the_scene_settles_where_the_reference_does() -> Result {
    let starts = match MujocoVersion::of_library()?.to_string().as_str() {
        "2.2.2" => STARTS_2_2_2,
        "3.6.0" => STARTS_3_6_0,
        "3.11.0" => STARTS_3_11_0,
        "3.17.0" | "4.0.0" | "4.0.1" => STARTS_4_0,
        _ => return Ok(()), // not recorded
    };
    for (task, gripper, height) in starts {
        let settled = simulator(task)?.settled();
        let off = (settled.gripper_position - Vector3::from(gripper)).amax();
        assert!(off < 1e-6, "{task}: {off}");
        match (settled.object_height, height) {
            (Some(ours), Some(theirs)) => assert!((ours - theirs).abs() < 1e-6, "{task}: {ours}"),
            (ours, theirs) => assert_eq!(ours, theirs, "{task}"),
        }
    }
    Ok(())
}

/// MuJoCo 4.0.0 factorizes sparse matrices wrongly. It uses them from 60 degrees of freedom on, or
/// if a model requests them.
#[test]
fn the_scenes_are_solved_without_sparse_matrices() -> Result {
    for task in Task::ALL {
        for source in [ModelSource::Builtin, ModelSource::Reference] {
            let config = SimConfig::new(task).with_model(source);
            let simulator = match MujocoSimulator::new(&config) {
                Err(SimError::NoAssets { .. }) => continue,
                simulator => simulator?,
            };
            let expected = if task.has_object() { 21 } else { 15 };
            assert_eq!(simulator.data().model().nv(), expected, "{task}");
            if let Some(path) = config.model().scene_path(task)? {
                assert!(!fs::read_to_string(path)?.contains("jacobian"), "{task}");
            }
        }
    }
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("model");
    for entry in fs::read_dir(model)? {
        let path = entry?.path();
        assert!(!fs::read_to_string(&path)?.contains("jacobian"), "{}", path.display());
    }
    Ok(())
}

#[test]
fn a_restored_snapshot_continues_bit_for_bit() -> Result {
    for task in Task::ALL {
        let mut original = simulator(task)?;
        start(&mut original)?;
        run(&mut original, 0..17)?;
        let snapshot = original.snapshot();
        let expected = run(&mut original, 17..40)?;
        // Into another simulator, and into the same one, whatever their state.
        let mut other = simulator(task)?;
        for simulator in [&mut original, &mut other] {
            simulator.restore(&snapshot)?;
            assert_eq!(simulator.snapshot(), snapshot, "{task}");
            assert_eq!(run(simulator, 17..40)?, expected, "{task}");
        }
    }
    Ok(())
}

#[test]
fn foreign_snapshots_are_rejected_and_change_nothing() -> Result {
    let mut push = simulator(Task::Push)?;
    start(&mut push)?;
    let before = push.snapshot();
    let foreign = simulator(Task::Slide)?.snapshot();
    assert!(matches!(push.restore(&foreign), Err(SimError::ForeignSnapshot { .. })));
    assert_eq!(push.snapshot(), before);
    Ok(())
}

#[test]
fn simulators_of_one_model_do_not_disturb_each_other() -> Result {
    let model = FetchModel::load(&SimConfig::new(Task::PickAndPlace))?;
    let run = move || {
        let mut simulator = MujocoSimulator::from_model(Arc::clone(&model))?;
        start(&mut simulator)?;
        run(&mut simulator, 0..30)
    };
    let expected = run()?;
    let threads: Vec<_> = (0..3).map(|_| thread::spawn(run.clone())).collect();
    for thread in threads {
        assert_eq!(thread.join().expect("no panic")?, expected);
    }
    Ok(())
}

#[test]
fn an_inspected_step_is_a_step() -> Result {
    let [mut plain, mut inspected] = [simulator(Task::Push)?, simulator(Task::Push)?];
    start(&mut plain)?;
    start(&mut inspected)?;
    for step in 0..5 {
        plain.step(&control(step))?;
        let mut substeps = 0;
        inspected.step_inspected(&control(step), |_| substeps += 1)?;
        assert_eq!(substeps, 20);
        assert_eq!(plain.snapshot(), inspected.snapshot());
    }
    Ok(())
}

#[test]
fn only_scenes_with_an_object_can_place_one() -> Result {
    let mut reach = simulator(Task::Reach)?;
    assert_eq!(reach.reset(Some([1.3, 0.7])), Err(SimError::NoObject { task: Task::Reach }));
    assert_eq!(reach.object(), None);
    let mut push = simulator(Task::Push)?;
    push.reset(Some([1.3, 0.7]))?;
    let position = push.object().ok_or("no object")?.position;
    assert!((position.xy() - nalgebra::Vector2::new(1.3, 0.7)).amax() < 1e-12);
    Ok(())
}

#[test]
fn a_diverged_step_is_an_error_until_the_next_reset() -> Result {
    let mut push = simulator(Task::Push)?;
    start(&mut push)?;
    let wild = Control { displacement: Vector3::repeat(1e9), fingers: 0.0 };
    let error = (0..50).find_map(|_| push.step(&wild).err()).ok_or("it is stable")?;
    assert!(matches!(error, SimError::Unstable { .. } | SimError::BufferFull { .. }), "{error}");
    start(&mut push)?;
    push.step(&control(0))?;
    Ok(())
}

#[test]
fn missing_and_foreign_models_are_errors_that_say_what_to_do() -> Result {
    let folder = tempfile::tempdir()?;
    let load = || {
        let model = ModelSource::Folder(folder.path().into());
        FetchModel::load(&SimConfig::new(Task::Reach).with_model(model))
    };
    let error = load().expect_err("nothing there");
    assert!(error.to_string().contains("cargo xtask assets"), "{error}");
    fs::write(folder.path().join("reach.xml"), "<mujoco/>")?;
    let error = load().expect_err("no robot in it");
    assert!(matches!(error, SimError::MissingName { .. }), "{error}");
    Ok(())
}
