//! A task of your own: push the block around a wall, which every reset moves. `cargo run --example
//! obstacle` writes `obstacle.html`, which plays an episode back.
//!
//! A goal has 5 elements, in meters: the block's position, and x and y of the wall. The wall is the
//! same in the achieved and in the desired goal, so the reward may depend on it and is still a
//! function of the two goals.

use std::error::Error;

use baselines::{ScriptedPolicy, page::episode_page};
use fetch_env::goal_reward::goal_distance;
use fetch_env::{
    EnvError, Extension, FetchConfig, FetchEnv, FetchTask, GoalReward, ModelSource, MujocoEnv,
    MujocoSimulator, NpRandom, RewardKind, Simulator, Task,
};
use nalgebra::{UnitQuaternion, Vector3};

/// A mocap body stays where it is placed. The contact is hard: MuJoCo's default lets the block,
/// which the robot pushes with force, sink in.
const WALL: &str = r#"
    <worldbody>
      <body name="wall" mocap="true" pos="1.3 0.75 0.42">
        <geom type="box" size="0.015 0.06 0.02" rgba="0.2 0.35 0.75 1"
             priority="1" solref="0.004 1" solimp="0.99 0.99 0.001"/>
      </body>
    </worldbody>"#;

#[derive(Clone, Copy, Debug)]
pub struct Obstacle;

/// -1 until the block is within 5 cm of its place, and another -1 near the wall.
impl GoalReward for Obstacle {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        let is_missing = !self.is_success(achieved_goal, desired_goal);
        let is_near = match achieved_goal {
            [x, y, _, wall @ ..] => goal_distance(&[*x, *y], wall) < 0.08,
            _ => false,
        };
        -f64::from(is_missing) - f64::from(is_near)
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        match (achieved_goal, desired_goal) {
            ([achieved @ .., x, y], [desired @ .., wall_x, wall_y]) => {
                [x, y] == [wall_x, wall_y] && goal_distance(achieved, desired) < 0.05
            }
            _ => false,
        }
    }

    fn bounds(&self) -> std::ops::RangeInclusive<f64> {
        -2.0..=0.0
    }
}

impl FetchTask<MujocoSimulator> for Obstacle {
    type Memory = ();

    fn goal_len(&self) -> usize {
        5
    }

    /// The wall's position relative to the block, and its direction.
    fn extra_len(&self) -> usize {
        4
    }

    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut MujocoSimulator,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let center = simulator.settled().gripper_position;
        let block = simulator.object_state("object0")?.position;
        let range = config.target_range();
        // Far enough away for a wall between the two.
        let goal = loop {
            let [x, y] = [center.x, center.y].map(|middle| middle + random.uniform(-range, range));
            let goal = Vector3::new(x, y, block.z);
            if (goal - block).norm() > 0.15 {
                break goal;
            }
        };
        let (wall, way) = (0.5 * (block + goal), goal - block);
        let across = UnitQuaternion::from_euler_angles(0.0, 0.0, way.y.atan2(way.x));
        simulator.place_object("wall", wall, across)?;
        desired_goal.copy_from_slice(&[goal.x, goal.y, goal.z, wall.x, wall.y]);
        Ok(())
    }

    fn achieved_goal(
        &self,
        simulator: &MujocoSimulator,
        _: &(),
        achieved_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let block = simulator.object_state("object0")?.position;
        let wall = simulator.object_state("wall")?.position;
        achieved_goal.copy_from_slice(&[block.x, block.y, block.z, wall.x, wall.y]);
        Ok(())
    }

    fn observe_extra(
        &self,
        simulator: &MujocoSimulator,
        _: &(),
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        let block = simulator.object_state("object0")?.position;
        let wall = simulator.object_state("wall")?;
        let (way, across) = (wall.position - block, wall.rotation.column(0));
        extra.copy_from_slice(&[way.x, way.y, across.x, across.y]);
        Ok(())
    }
}

pub fn obstacle() -> Result<MujocoEnv<Obstacle, Obstacle>, EnvError> {
    let model = ModelSource::Extended(Extension::default().with_xml(WALL));
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_model(model);
    Ok(FetchEnv::on_mujoco(config)?.with_goal_reward(Obstacle).with_task(Obstacle)?.time_limited())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut policy = ScriptedPolicy::new(Task::Push);
    std::fs::write("obstacle.html", episode_page(&mut obstacle()?, &mut policy, 0)?)?;
    Ok(())
}
