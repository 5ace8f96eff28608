//! The kinematic simulator behaves as the tests of the layers above expect.

use fetch_sim::{Control, KinematicSimulator, SimConfig, SimError, Simulator, Task};
use nalgebra::Vector3;
use proptest::prelude::*;
use testing::Result;

fn simulator(task: Task) -> KinematicSimulator {
    KinematicSimulator::new(&SimConfig::new(task))
}

fn control(x: f64, y: f64, z: f64, fingers: f64) -> Control {
    Control { displacement: Vector3::new(x, y, z), fingers }
}

fn tasks() -> impl Strategy<Value = Task> {
    prop::sample::select(Task::ALL.to_vec())
}

fn controls() -> impl Strategy<Value = Vec<Control>> {
    let displacement = || -0.05..0.05;
    let one = (displacement(), displacement(), displacement(), -1.0..1.0);
    prop::collection::vec(one.prop_map(|(x, y, z, fingers)| control(x, y, z, fingers)), 1..80)
}

proptest! {
    #[test]
    fn a_restored_snapshot_continues_bit_for_bit(
        task in tasks(),
        before in controls(),
        after in controls(),
    ) {
        let mut simulator = simulator(task);
        for control in &before {
            simulator.step(control)?;
        }
        let snapshot = simulator.snapshot();
        let mut other = KinematicSimulator::new(&SimConfig::new(task));
        other.restore(&snapshot)?;
        for control in &after {
            simulator.step(control)?;
            other.step(control)?;
            prop_assert_eq!(&simulator, &other);
        }
    }

    #[test]
    fn the_state_stays_valid(
        task in tasks(),
        xy in [1.1..1.5, 0.5..1.0],
        controls in controls(),
    ) {
        let mut simulator = simulator(task);
        simulator.reset(task.has_object().then_some(xy))?;
        let period = simulator.control_period();
        for control in &controls {
            let before = simulator.gripper();
            simulator.step(control)?;
            let gripper = simulator.gripper();
            let moved = gripper.position - before.position;
            prop_assert!((gripper.velocity * period - moved).norm() < 1e-14);
            prop_assert!((0..3).all(|i| moved[i].abs() <= control.displacement[i].abs() + 1e-14));
            prop_assert!(gripper.position.z >= 0.41, "through the table");
            prop_assert!(gripper.finger_positions.iter().all(|q| (0.0..=0.05).contains(q)));
            if task.block_gripper() {
                prop_assert_eq!(gripper.finger_positions, [0.0; 2]);
            }
            prop_assert_eq!(simulator.object().is_some(), task.has_object());
            if let Some(object) = simulator.object() {
                prop_assert!(object.position.z > 0.0, "through the floor");
            }
        }
    }
}

#[test]
fn a_closed_gripper_pushes_the_object() -> Result {
    let mut simulator = simulator(Task::Push);
    let start = simulator.settled().gripper_position;
    simulator.reset(Some([start.x + 0.1, start.y]))?;
    for _ in 0..4 {
        simulator.step(&control(0.03, 0.0, 0.0, 0.0))?;
    }
    let (object, gripper) = (simulator.object().ok_or("no object")?, simulator.gripper());
    assert!(object.position.x > gripper.position.x && object.position.x > start.x + 0.12);
    assert_eq!(object.position.y, start.y);
    simulator.step(&control(0.0, 0.0, 0.0, 0.0))?;
    assert_eq!(simulator.object().ok_or("no object")?.linear_velocity, Vector3::zeros());
    Ok(())
}

#[test]
fn a_cube_is_grasped_lifted_and_dropped() -> Result {
    let mut simulator = simulator(Task::PickAndPlace);
    let settled = simulator.settled();
    let start = settled.gripper_position;
    let rest = settled.object_height.ok_or("no object")?;
    simulator.reset(Some([start.x, start.y]))?;
    let mut run = |steps: u32, control: Control| -> Result<f64> {
        for _ in 0..steps {
            simulator.step(&control)?;
        }
        Ok(simulator.object().ok_or("no object")?.position.z)
    };
    assert_eq!(run(2, control(0.0, 0.0, 0.0, 1.0))?, rest);
    assert_eq!(run(3, control(0.0, 0.0, -0.0367, 1.0))?, rest);
    assert_eq!(run(3, control(0.0, 0.0, 0.0, -1.0))?, rest);
    let lifted = run(4, control(0.0, 0.0, 0.05, -1.0))?;
    assert!((lifted - rest - 0.2).abs() < 1e-9, "it was lifted by {} m", lifted - rest);
    let falling = run(2, control(0.0, 0.0, 0.0, 1.0))?;
    assert!(rest < falling && falling < lifted, "it is at {falling} m");
    assert_eq!(run(10, control(0.0, 0.0, 0.0, 1.0))?, rest);
    Ok(())
}

#[test]
fn a_struck_puck_slides_on_and_comes_to_rest() -> Result {
    let mut simulator = simulator(Task::Slide);
    let start = simulator.settled().gripper_position;
    simulator.reset(Some([start.x + 0.1, start.y]))?;
    for _ in 0..2 {
        simulator.step(&control(0.05, 0.0, 0.0, 0.0))?;
    }
    let mut speeds = Vec::new();
    for _ in 0..40 {
        simulator.step(&control(0.0, 0.0, 0.0, 0.0))?;
        speeds.push(simulator.object().ok_or("no object")?.linear_velocity.norm());
    }
    assert!(speeds[0] > 1.0, "{speeds:?}");
    assert!(speeds.is_sorted_by(|earlier, later| earlier >= later), "{speeds:?}");
    assert_eq!(speeds.last(), Some(&0.0));
    Ok(())
}

#[test]
fn invalid_calls_are_rejected() {
    let mut reach = simulator(Task::Reach);
    let before = reach.clone();
    assert_eq!(reach.reset(Some([1.3, 0.7])), Err(SimError::NoObject { task: Task::Reach }));
    for bad in [control(f64::NAN, 0.0, 0.0, 0.0), control(0.0, 0.0, 0.0, f64::INFINITY)] {
        assert!(matches!(reach.step(&bad), Err(SimError::Unstable { .. })));
    }
    let mut push = simulator(Task::Push);
    for xy in [[f64::NAN, 0.7], [1.3, f64::NEG_INFINITY], [1.1e10, 0.7], [1.3, 1e308]] {
        let rejected = push.reset(Some(xy));
        assert!(matches!(rejected, Err(SimError::OutOfRange { .. })), "{rejected:?}");
    }
    assert_eq!(push, simulator(Task::Push));
    for task in [Task::Push, Task::Slide] {
        let rejected = reach.restore(&simulator(task).snapshot());
        assert!(matches!(rejected, Err(SimError::ForeignSnapshot { .. })), "{rejected:?}");
    }
    assert_eq!(reach, before);
}
