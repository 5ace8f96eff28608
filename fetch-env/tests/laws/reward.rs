use fetch_env::{Env, EnvId, GoalEnv, GoalObservation};
use fetch_sim::Task;
use goal_reward::{GoalPairs, RewardKind};

use super::{Backend, bits, make, random_steps};

pub(crate) fn the_step_reward_is_the_reward_of_its_goals<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        env.reset(Some(11)).expect("a reset");
        let steps = random_steps::<B>(&mut env, 11, B::STEPS);
        let (mut achieved, mut desired) = (Vec::new(), Vec::new());
        for step in &steps {
            let observation = &step.observation;
            let goals = (observation.achieved_goal(), observation.desired_goal());
            let computed = env.compute_reward(goals.0, goals.1).expect("goals");
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
        let pairs = GoalPairs::new(&achieved, &desired, 3).expect("whole goals");
        let mut rewards = vec![0.0; B::STEPS];
        env.compute_reward_batch(pairs, &mut rewards).expect("finite goals");
        let step_rewards: Vec<f64> = steps.iter().map(|step| step.reward).collect();
        assert_eq!(rewards, step_rewards, "{id}");
    }
}

pub(crate) fn dense_and_sparse_see_the_same_trajectory<B: Backend>() {
    for task in Task::ALL {
        let [sparse, dense] = [RewardKind::Sparse, RewardKind::Dense].map(|reward| {
            let mut env = make::<B>(EnvId { task, reward });
            env.reset(Some(12)).expect("a reset");
            random_steps::<B>(&mut env, 12, 120)
        });
        for (sparse, dense) in sparse.iter().zip(&dense) {
            assert_eq!(bits(&sparse.observation), bits(&dense.observation), "{task}");
        }
    }
}
