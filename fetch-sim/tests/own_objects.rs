//! Your own objects: they are shown, placed and restored as the task's object is.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::sync::{Arc, OnceLock};

use fetch_sim::{
    Control, Extension, FetchModel, ModelSource, MujocoSimulator, ObjectState, SimConfig, SimError,
    Simulator, Task,
};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use testing::Result;

/// A second block with a site off its center, a block without a site, a hinged lid, and a wall.
const OBJECTS: &str = r#"
    <worldbody>
      <body name="object1" pos="1.2 0.9 0.425">
        <freejoint/><geom type="box" size="0.025 0.025 0.025" mass="2"/>
        <site name="object1" pos="0 0 0.01"/>
      </body>
      <body name="object2" pos="1.4 0.9 0.425">
        <freejoint/><geom name="object2" type="box" size="0.025 0.025 0.025" mass="2"/>
      </body>
      <body name="box" pos="1.5 0.6 0.42">
        <geom type="box" size="0.02 0.02 0.02"/>
        <body name="lid" pos="0 0 0.03">
          <joint axis="0 1 0" pos="-0.02 0 0"/><geom type="box" size="0.02 0.02 0.005" mass="0.1"/>
        </body>
      </body>
      <body name="wall" mocap="true" pos="1.3 0.75 5">
        <geom name="wall" type="box" size="0.01 0.1 0.05"/>
        <site name="object2" pos="0 0 0.05"/>
      </body>
    </worldbody>"#;

const NAMES: [&str; 7] = ["object0", "object1", "object2", "lid", "wall", "box", "table0"];

fn model(task: Task) -> Arc<FetchModel> {
    static MODELS: [OnceLock<Arc<FetchModel>>; 4] = [const { OnceLock::new() }; 4];
    let load = || {
        let extension = Extension::default().with_xml(OBJECTS);
        let config = SimConfig::new(task).with_model(ModelSource::Extended(extension));
        FetchModel::load(&config).expect("MuJoCo")
    };
    Arc::clone(MODELS[task as usize].get_or_init(load))
}

fn simulator(task: Task) -> Result<MujocoSimulator, SimError> {
    MujocoSimulator::from_model(model(task))
}

/// Returns everything that a simulator shows.
fn shown(simulator: &MujocoSimulator) -> Result<(String, Vec<ObjectState>), SimError> {
    let objects =
        NAMES.map(|name| simulator.object_state(name)).into_iter().collect::<Result<_, _>>();
    Ok((format!("{:?} {:?}", simulator.gripper(), simulator.object()), objects?))
}

fn control(step: u32) -> Control {
    let phase = f64::from(step);
    Control {
        displacement: 0.05 * Vector3::new(phase.sin(), (0.7 * phase).cos(), (1.3 * phase).sin()),
        fingers: 0.02 * (0.4 * phase).cos(),
    }
}

fn run(
    simulator: &mut MujocoSimulator,
    steps: u32,
) -> Result<Vec<(String, Vec<ObjectState>)>, SimError> {
    (0..steps)
        .map(|step| {
            simulator.step(&control(step))?;
            shown(simulator)
        })
        .collect()
}

/// Places a block beside the gripper and a wall across the table.
fn place(simulator: &mut MujocoSimulator, [x, y, turn]: [f64; 3]) -> Result<(), SimError> {
    simulator.reset(Some([1.25, 0.6]))?;
    let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, turn);
    simulator.place_object("wall", Vector3::new(x, y, 0.45), turned)?;
    simulator.place_object("object2", Vector3::new(y + 0.6, x - 0.5, 0.43), turned)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn a_restored_snapshot_shows_and_continues_the_same_bits(
        task in prop::sample::select(vec![Task::Push, Task::PickAndPlace, Task::Slide]),
        at in [1.2..1.5, 0.6..0.9, -1.0..1.0],
        steps in 0_u32..12,
    ) {
        let mut original = simulator(task)?;
        place(&mut original, at)?;
        run(&mut original, steps)?;
        let (snapshot, seen) = (original.snapshot(), shown(&original)?);
        let saved = serde_json::from_str(&serde_json::to_string(&snapshot)?)?;
        prop_assert_eq!(&snapshot, &saved);
        let expected = run(&mut original, 8)?;
        for mut simulator in [original, simulator(task)?] {
            simulator.restore(&saved)?;
            prop_assert!(simulator.snapshot() == snapshot);
            prop_assert_eq!(shown(&simulator)?, seen.clone());
            prop_assert_eq!(run(&mut simulator, 8)?, expected.clone());
        }
    }
}

#[test]
fn a_restored_snapshot_has_the_activations_of_actuators() -> Result {
    let extension = Extension::default().with_xml(
        r#"<worldbody>
             <body name="lid" pos="1.5 0.6 0.6">
               <joint name="hinge" axis="0 1 0"/>
               <geom type="box" size="0.02 0.02 0.005" mass="0.1"/>
             </body>
           </worldbody>
           <actuator>
             <general joint="hinge" dyntype="filter" dynprm="0.5" gainprm="0.1"/>
           </actuator>"#,
    );
    let config = SimConfig::new(Task::Push).with_model(ModelSource::Extended(extension));
    let mut simulator = MujocoSimulator::new(&config)?;
    simulator.reset(None)?;
    // It is commanded as the fingers are.
    let turn = |simulator: &mut MujocoSimulator| -> Result<_> {
        (0..5).try_for_each(|step| simulator.step(&control(step)))?;
        Ok(simulator.object_state("lid")?)
    };
    turn(&mut simulator)?;
    let snapshot = serde_json::from_str(&serde_json::to_string(&simulator.snapshot())?)?;
    let expected = turn(&mut simulator)?;
    assert_ne!(simulator.object_state("lid")?.angular_velocity, Vector3::zeros());
    simulator.restore(&snapshot)?;
    assert_eq!(turn(&mut simulator)?, expected);
    Ok(())
}

#[test]
fn a_body_is_shown_as_the_object_is() -> Result {
    for task in [Task::Push, Task::PickAndPlace] {
        let mut simulator = simulator(task)?;
        simulator.reset(Some([1.3, 0.6]))?;
        simulator.step(&control(0))?;
        assert_eq!(Some(simulator.object_state("object0")?), simulator.object());
        let data = simulator.data();
        let model = data.model();
        // The site of the same name on the body, or else the body itself: a site on another body
        // does not count.
        let site = data.site_position(model.site("object1")?)?;
        assert_eq!(simulator.object_state("object1")?.position, site);
        let body = data.body_pose(model.body("object2")?)?;
        let state = simulator.object_state("object2")?;
        assert_eq!(state.position, body.0);
        let rotation = UnitQuaternion::from_quaternion(body.1).to_rotation_matrix();
        assert!((state.rotation - rotation.matrix()).amax() < 1e-12);
        let table = simulator.object_state("table0")?;
        assert_eq!(table.linear_velocity, Vector3::zeros());
        assert_eq!(table.position, data.body_pose(model.body("table0")?)?.0);
    }
    Ok(())
}

#[test]
fn a_velocity_is_that_of_the_body() -> Result {
    let mut simulator = simulator(Task::Push)?;
    simulator.reset(None)?;
    let high = Vector3::new(1.2, 1.0, 2.0);
    simulator.place_object("object2", high, UnitQuaternion::identity())?;
    let model = simulator.data().model();
    let geom = model.geom("object2")?;
    assert_eq!(model.body("object2")?, model.geom_body(geom)?);
    let (before, period) = (simulator.object_state("object2")?, simulator.control_period());
    assert_eq!((before.position, before.linear_velocity), (high, Vector3::zeros()), "at rest");
    simulator.step(&Control { displacement: Vector3::zeros(), fingers: 0.0 })?;
    let after = simulator.object_state("object2")?;
    let fallen = after.position - before.position;
    assert!((after.linear_velocity.z + 9.81 * period).abs() < 1e-3, "{after:?}");
    assert!((fallen.z + 9.81 * period * period / 2.0).abs() < 1e-3, "{fallen:?}");
    Ok(())
}

#[test]
fn a_placed_body_is_in_contact_where_it_is_placed() -> Result {
    let mut simulator = simulator(Task::Push)?;
    simulator.reset(Some([1.3, 0.6]))?;
    let model = Arc::clone(simulator.data().model());
    let (wall, object) = (model.geom("wall")?, model.geom("object0")?);
    let touches = |simulator: &MujocoSimulator| {
        let pair = |(a, b)| (a, b) == (wall, object) || (a, b) == (object, wall);
        simulator.data().contacts().any(pair)
    };
    let gripper = simulator.gripper();
    assert!(!touches(&simulator));
    let at = Vector3::new(1.33, 0.6, 0.45);
    simulator.place_object("wall", at, UnitQuaternion::identity())?;
    assert!(touches(&simulator), "at once");
    assert_eq!(simulator.object_state("wall")?.position, at);
    assert_eq!(simulator.gripper(), gripper, "it stays where it was");
    simulator.reset(Some([1.3, 0.6]))?;
    assert!(!touches(&simulator), "a reset takes it away");
    assert_eq!(simulator.object_state("wall")?.position.z, 5.0);
    Ok(())
}

#[test]
fn a_wall_stops_the_object() -> Result {
    let slid_to = |wall: bool| -> Result<f64> {
        let mut simulator = simulator(Task::Push)?;
        simulator.reset(Some([1.30, 0.55]))?;
        if wall {
            let at = Vector3::new(1.365, 0.55, 0.45);
            simulator.place_object("wall", at, UnitQuaternion::identity())?;
        }
        let model = simulator.data().model();
        let dof = model.dof_address(model.joint("object0:joint")?)?;
        simulator.data_mut().qvel_mut()[dof] = 1.5;
        for _ in 0..10 {
            simulator.step(&Control { displacement: Vector3::zeros(), fingers: 0.0 })?;
        }
        Ok(simulator.object().ok_or("an object")?.position.x)
    };
    let (free, stopped) = (slid_to(false)?, slid_to(true)?);
    assert!(free > 1.38, "it slid to {free}");
    assert!(stopped < 1.34, "it stopped at {stopped}");
    Ok(())
}

#[test]
fn what_is_no_object_is_a_typed_error_that_changes_nothing() -> Result {
    let mut simulator = simulator(Task::Push)?;
    let before = simulator.snapshot();
    let (at, level) = (Vector3::new(1.3, 0.7, 0.45), UnitQuaternion::identity());
    for name in ["robot0:gripper_link", "robot0:mocap", "robot0:base_link"] {
        let error = simulator.object_state(name).unwrap_err();
        assert!(matches!(error, SimError::UnfitBody { .. }), "{name}: {error}");
        let error = simulator.place_object(name, at, level).unwrap_err();
        assert!(matches!(error, SimError::UnfitBody { .. }), "{name}: {error}");
    }
    for name in ["table0", "box", "lid"] {
        let error = simulator.place_object(name, at, level).unwrap_err();
        assert!(error.to_string().contains("free joint"), "{name}: {error}");
    }
    for name in ["", "object3", "a\0b"] {
        let missing = SimError::MissingName { kind: "body", name: name.into() };
        assert_eq!(simulator.object_state(name), Err(missing.clone()));
        assert_eq!(simulator.place_object(name, at, level), Err(missing));
    }
    for bad in [f64::NAN, f64::INFINITY, 1.1e10] {
        let turned = UnitQuaternion::new_unchecked([0.0, 0.0, bad, 1.0].into());
        for name in ["object0", "object1", "wall"] {
            for refused in [
                simulator.place_object(name, Vector3::new(1.3, bad, 0.5), level),
                simulator.place_object(name, at, turned),
            ] {
                assert!(matches!(refused, Err(SimError::OutOfRange { .. })), "{refused:?}");
            }
        }
    }
    assert_eq!(simulator.snapshot(), before);
    Ok(())
}
