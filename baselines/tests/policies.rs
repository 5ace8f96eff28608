//! The results of the policies on the real physics.
#![cfg(feature = "mujoco")]

use baselines::{Policy, RandomPolicy, ScriptedPolicy, ZeroPolicy, evaluate};
use fetch_env::{Env, EnvId, Task, make};
use goal_reward::RewardKind;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const EPISODES: usize = 40;

fn success_rate(task: Task, policy: &mut dyn Policy) -> Result<f64> {
    let id = EnvId { task, reward: RewardKind::Sparse };
    let mut env = make(id)?;
    let mut count = 0;
    let evaluation = evaluate(&mut env, policy, EPISODES, 1000, |_| count += 1)?;
    assert_eq!(count, EPISODES);
    assert!(evaluation.episodes.iter().all(|episode| episode.episode_length == 50));
    Ok(evaluation.summary()?.success_rate.value)
}

#[test]
fn scripted_policies_solve_their_tasks() -> Result {
    for (task, least) in [
        (Task::Reach, 0.95),
        (Task::PickAndPlace, 0.95),
        (Task::Push, 0.8),
        // Far above chance, which is 0.01, but no solution.
        (Task::Slide, 0.05),
    ] {
        let rate = success_rate(task, &mut ScriptedPolicy::new(task))?;
        assert!(rate >= least, "{task}: {rate}");
    }
    Ok(())
}

#[test]
fn doing_nothing_solves_nothing_that_is_not_solved_already() -> Result {
    assert!(success_rate(Task::PickAndPlace, &mut ZeroPolicy)? <= 0.1);
    Ok(())
}

#[test]
fn equal_seeds_give_equal_episodes_and_others_do_not() -> Result {
    let run = |seed| -> Result<_> {
        let id = EnvId { task: Task::Reach, reward: RewardKind::Dense };
        let mut env = make(id)?;
        let mut policy = RandomPolicy::new(env.action_space(), seed);
        Ok(evaluate(&mut env, &mut policy, 3, 7, |_| ())?)
    };
    assert_eq!(run(1)?, run(1)?);
    assert_ne!(run(1)?, run(2)?);
    Ok(())
}
