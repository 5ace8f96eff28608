//! Wrappers: the laws that all of them keep, and what each of them does.

mod allocation;
mod effects;
mod interface;
mod laws;
mod refusals;
mod rewards;

use std::num::{NonZeroU32, NonZeroUsize};

use fetch_env::{
    EnvError, EnvExt, GoalEnv, KinematicEnv, make_kinematic,
    wrappers::{TransformReward, Wrapped},
};
use testing::Result;

/// The inner environment of most tests.
fn push() -> Result<KinematicEnv, EnvError> {
    Ok(make_kinematic("FetchPush-v4")?)
}

/// Transforms rewards, those of hindsight included.
fn transform<E: GoalEnv<GoalReward: Clone>, F: Fn(f64) -> f64>(
    env: E,
    transform: F,
) -> Result<Wrapped<E, TransformReward<F, E::GoalReward>>, EnvError> {
    let reward = env.goal_reward().clone();
    env.wrap(TransformReward::with_goal_reward(reward, transform))
}

const STEPS: NonZeroU32 = NonZeroU32::new(50).expect("not zero");
const TWICE: NonZeroU32 = NonZeroU32::new(2).expect("not zero");
const FRAMES: NonZeroUsize = NonZeroUsize::new(3).expect("not zero");
