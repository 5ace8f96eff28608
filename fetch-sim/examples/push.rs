//! Pushes the cube with the closed gripper, and prints where both are:
//!
//!     cargo run -p fetch-sim --example push
//!     cargo run -p fetch-sim --example push --no-default-features
//!
//! The second command needs no MuJoCo: it runs on the kinematic simulator.
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::error::Error;

#[cfg(not(feature = "mujoco"))]
use fetch_sim::KinematicSimulator as Robot;
#[cfg(feature = "mujoco")]
use fetch_sim::MujocoSimulator as Robot;
use fetch_sim::{Control, SimConfig, Simulator, Task};
use nalgebra::Vector3;

/// Starts beside the cube, and pushes it along y.
fn push(simulator: &mut impl Simulator) -> Result<(), Box<dyn Error>> {
    let gripper = simulator.settled().gripper_position;
    simulator.reset(Some([gripper.x, gripper.y + 0.08]))?;
    println!("seconds  gripper y  cube y");
    for step in 0..=15 {
        let cube = simulator.object().ok_or("the task has no object")?;
        if step % 5 == 0 {
            let seconds = f64::from(step) * simulator.control_period();
            let gripper = simulator.gripper().position;
            println!("{seconds:7.2} {:10.3} {:7.3}", gripper.y, cube.position.y);
        }
        simulator.step(&Control { displacement: Vector3::new(0.0, 0.02, 0.0), fingers: 0.0 })?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let config = SimConfig::new(Task::Push);
    // Only MuJoCo can fail.
    #[cfg(feature = "mujoco")]
    let mut robot = Robot::new(&config)?;
    #[cfg(not(feature = "mujoco"))]
    let mut robot = Robot::new(&config);
    push(&mut robot)
}
