//! A task of your own: stack two blocks. `cargo run --example stack` writes `stack.html`, which
//! plays an episode back.
//!
//! A goal has 6 elements, in meters: where the lower block and the upper one should be.

use std::error::Error;

use baselines::{RandomPolicy, page::episode_page};
use fetch_env::goal_reward::goal_distance;
use fetch_env::{
    Env, EnvError, Extension, FetchConfig, FetchEnv, FetchTask, GoalReward, ModelSource, MujocoEnv,
    MujocoSimulator, NpRandom, RewardKind, Simulator, Task,
};
use nalgebra::{UnitQuaternion, Vector3};

/// The second block; the first one is that of PickAndPlace.
const BLOCK: &str = r#"
    <worldbody>
      <body name="object1" pos="1.4 0.9 0.425">
        <joint type="free" damping="0.01"/>
        <geom type="box" size="0.025 0.025 0.025" mass="2" rgba="0.75 0.3 0.2 1"/>
      </body>
    </worldbody>"#;
const BLOCKS: [&str; 2] = ["object0", "object1"];
/// Length of a block's edge, in meters.
const EDGE: f64 = 0.05;

#[derive(Clone, Copy, Debug)]
pub struct Stack;

/// -1 for each block that is farther than 3 cm from its place.
impl GoalReward for Stack {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        let pairs = achieved_goal.chunks_exact(3).zip(desired_goal.chunks_exact(3));
        pairs.map(|(achieved, desired)| if is_there(achieved, desired) { 0.0 } else { -1.0 }).sum()
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        let mut pairs = achieved_goal.chunks_exact(3).zip(desired_goal.chunks_exact(3));
        achieved_goal.len() == desired_goal.len()
            && pairs.all(|(achieved, desired)| is_there(achieved, desired))
    }

    fn bounds(&self) -> std::ops::RangeInclusive<f64> {
        -2.0..=0.0
    }
}

fn is_there(achieved: &[f64], desired: &[f64]) -> bool {
    goal_distance(achieved, desired) < 0.03
}

impl FetchTask<MujocoSimulator> for Stack {
    type Memory = ();

    fn goal_len(&self) -> usize {
        6
    }

    fn extra_len(&self) -> usize {
        9
    }

    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut MujocoSimulator,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let center = simulator.settled().gripper_position;
        let first = simulator.object_state("object0")?.position;
        let mut draw = |range: f64| {
            let [x, y] = [center.x, center.y].map(|middle| middle + random.uniform(-range, range));
            Vector3::new(x, y, first.z)
        };
        // The second block starts next to the first one.
        let second = loop {
            let place = draw(config.object_range().unwrap_or_default());
            if (place - first).norm() > 2.0 * EDGE {
                break place;
            }
        };
        simulator.place_object("object1", second, UnitQuaternion::identity())?;
        let lower = draw(config.target_range());
        desired_goal[..3].copy_from_slice(lower.as_slice());
        desired_goal[3..].copy_from_slice((lower + EDGE * Vector3::z()).as_slice());
        Ok(())
    }

    fn achieved_goal(
        &self,
        simulator: &MujocoSimulator,
        _: &(),
        achieved_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        for (name, position) in BLOCKS.iter().zip(achieved_goal.chunks_exact_mut(3)) {
            position.copy_from_slice(simulator.object_state(name)?.position.as_slice());
        }
        Ok(())
    }

    /// The second block's position, also relative to the gripper, and its velocity.
    fn observe_extra(
        &self,
        simulator: &MujocoSimulator,
        _: &(),
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        let block = simulator.object_state("object1")?;
        let gripper = simulator.gripper();
        let velocity = (block.linear_velocity - gripper.velocity) * simulator.control_period();
        let columns = [block.position, block.position - gripper.position, velocity];
        for (extra, column) in extra.chunks_exact_mut(3).zip(columns) {
            extra.copy_from_slice(column.as_slice());
        }
        Ok(())
    }
}

pub fn stack() -> Result<MujocoEnv<Stack, Stack>, EnvError> {
    let model = ModelSource::Extended(Extension::default().with_xml(BLOCK));
    let config = FetchConfig::new(Task::PickAndPlace, RewardKind::Sparse)
        .with_model(model)
        .with_max_episode_steps(100)?;
    Ok(FetchEnv::on_mujoco(config)?.with_goal_reward(Stack).with_task(Stack)?.time_limited())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut env = stack()?;
    let mut policy = RandomPolicy::new(env.action_space(), 0);
    std::fs::write("stack.html", episode_page(&mut env, &mut policy, 0)?)?;
    Ok(())
}
