//! Laws of rewards.

use std::{error::Error, thread};

use fetch_env::{Env, EnvId, GoalEnvExt, GoalObservation};
use fetch_sim::Task;
use goal_reward::{GoalPairs, RewardKind};

use super::{Backend, Result, bits, make, random_steps};

/// Runs on all ids at once, because so many steps take a while in a debug build.
pub(crate) fn the_step_reward_is_the_reward_of_its_goals<B: Backend>() -> Result {
    thread::scope(|scope| {
        let runs = EnvId::ALL.map(|id| scope.spawn(move || step_rewards_are_computed::<B>(id)));
        runs.into_iter()
            .try_for_each(|run| run.join().expect("no panic").map_err(|error| error as _))
    })
}

fn step_rewards_are_computed<B: Backend>(id: EnvId) -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut env = make::<B>(id)?;
    env.reset(Some(11))?;
    let steps = random_steps::<B>(&mut env, 11, B::STEPS)?;
    let (mut achieved, mut desired) = (Vec::new(), Vec::new());
    for step in &steps {
        let observation = &step.observation;
        let goals = (observation.achieved_goal(), observation.desired_goal());
        let computed = env.compute_reward(goals.0, goals.1)?;
        assert_eq!(step.reward.to_bits(), computed.to_bits(), "{id}");
        let expected = match id.reward {
            RewardKind::Dense => -step.info.distance,
            RewardKind::Sparse if step.info.distance > 0.05 => -1.0,
            RewardKind::Sparse => -0.0,
        };
        assert_eq!(step.reward.to_bits(), expected.to_bits(), "{id}");
        assert_eq!(step.info.is_success, step.info.distance < 0.05, "{id}");
        achieved.extend_from_slice(goals.0);
        desired.extend_from_slice(goals.1);
    }
    let pairs = GoalPairs::new(&achieved, &desired, 3)?;
    let mut rewards = vec![0.0; B::STEPS];
    env.compute_reward_batch(pairs, &mut rewards)?;
    let step_rewards: Vec<f64> = steps.iter().map(|step| step.reward).collect();
    assert_eq!(rewards, step_rewards, "{id}");
    Ok(())
}

pub(crate) fn dense_and_sparse_see_the_same_trajectory<B: Backend>() -> Result {
    for task in Task::ALL {
        let steps = |reward| {
            let mut env = make::<B>(EnvId { task, reward })?;
            env.reset(Some(12))?;
            random_steps::<B>(&mut env, 12, 120)
        };
        for (sparse, dense) in steps(RewardKind::Sparse)?.iter().zip(&steps(RewardKind::Dense)?) {
            assert_eq!(bits(&sparse.observation), bits(&dense.observation), "{task}");
        }
    }
    Ok(())
}
