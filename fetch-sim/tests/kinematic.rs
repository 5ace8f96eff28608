//! The stand-in for the physics does what tests of the layers above count on.

use fetch_sim::{Control, KinematicSimulator, SimConfig, SimError, Simulator, Task};
use nalgebra::Vector3;
use proptest::prelude::*;

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
    fn a_snapshot_goes_on_bit_for_bit(
        task in tasks(),
        before in controls(),
        after in controls(),
    ) {
        let mut simulator = simulator(task);
        for control in &before {
            simulator.step(control).expect("finite");
        }
        let snapshot = simulator.snapshot();
        let mut other = KinematicSimulator::new(&SimConfig::new(task));
        other.restore(&snapshot).expect("of the same configuration");
        for control in &after {
            simulator.step(control).expect("finite");
            other.step(control).expect("finite");
            prop_assert_eq!(&simulator, &other);
        }
    }

    #[test]
    fn the_state_stays_possible(
        task in tasks(),
        xy in [1.1..1.5, 0.5..1.0],
        controls in controls(),
    ) {
        let mut simulator = simulator(task);
        simulator.reset(task.has_object().then_some(xy)).expect("a possible place");
        let period = simulator.control_period();
        for control in &controls {
            let before = simulator.gripper();
            simulator.step(control).expect("finite");
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
fn a_closed_gripper_pushes_the_object() {
    let mut simulator = simulator(Task::Push);
    let start = simulator.settled().gripper_position;
    simulator.reset(Some([start.x + 0.1, start.y])).expect("a cube");
    for _ in 0..4 {
        simulator.step(&control(0.03, 0.0, 0.0, 0.0)).expect("finite");
    }
    let (object, gripper) = (simulator.object().expect("a cube"), simulator.gripper());
    assert!(object.position.x > gripper.position.x && object.position.x > start.x + 0.12);
    assert_eq!(object.position.y, start.y);
    simulator.step(&control(0.0, 0.0, 0.0, 0.0)).expect("finite");
    assert_eq!(simulator.object().expect("a cube").linear_velocity, Vector3::zeros());
}

#[test]
fn a_cube_is_grasped_lifted_and_dropped() {
    let mut simulator = simulator(Task::PickAndPlace);
    let settled = simulator.settled();
    let start = settled.gripper_position;
    let rest = settled.object_height.expect("a cube");
    simulator.reset(Some([start.x, start.y])).expect("a cube");
    let mut run = |steps: u32, control: Control| {
        for _ in 0..steps {
            simulator.step(&control).expect("finite");
        }
        simulator.object().expect("a cube").position.z
    };
    assert_eq!(run(2, control(0.0, 0.0, 0.0, 1.0)), rest);
    assert_eq!(run(3, control(0.0, 0.0, -0.0367, 1.0)), rest);
    assert_eq!(run(3, control(0.0, 0.0, 0.0, -1.0)), rest);
    let lifted = run(4, control(0.0, 0.0, 0.05, -1.0));
    assert!((lifted - rest - 0.2).abs() < 1e-9, "it was lifted by {} m", lifted - rest);
    let falling = run(2, control(0.0, 0.0, 0.0, 1.0));
    assert!(rest < falling && falling < lifted, "it is at {falling} m");
    assert_eq!(run(10, control(0.0, 0.0, 0.0, 1.0)), rest);
}

#[test]
fn a_struck_puck_slides_on_and_comes_to_rest() {
    let mut simulator = simulator(Task::Slide);
    let start = simulator.settled().gripper_position;
    simulator.reset(Some([start.x + 0.1, start.y])).expect("a puck");
    for _ in 0..2 {
        simulator.step(&control(0.05, 0.0, 0.0, 0.0)).expect("finite");
    }
    let mut speeds = Vec::new();
    for _ in 0..40 {
        simulator.step(&control(0.0, 0.0, 0.0, 0.0)).expect("finite");
        speeds.push(simulator.object().expect("a puck").linear_velocity.norm());
    }
    assert!(speeds[0] > 1.0, "{speeds:?}");
    assert!(speeds.is_sorted_by(|earlier, later| earlier >= later), "{speeds:?}");
    assert_eq!(speeds.last(), Some(&0.0));
}

#[test]
fn what_cannot_be_is_refused() {
    let mut reach = simulator(Task::Reach);
    let before = reach.clone();
    assert_eq!(reach.reset(Some([1.3, 0.7])), Err(SimError::NoObject { task: Task::Reach }));
    for bad in [control(f64::NAN, 0.0, 0.0, 0.0), control(0.0, 0.0, 0.0, f64::INFINITY)] {
        assert!(matches!(reach.step(&bad), Err(SimError::Unstable { .. })));
    }
    for task in [Task::Push, Task::Slide] {
        let refusal = reach.restore(&simulator(task).snapshot());
        assert!(matches!(refusal, Err(SimError::ForeignSnapshot { .. })), "{refusal:?}");
    }
    assert_eq!(reach, before);
}
