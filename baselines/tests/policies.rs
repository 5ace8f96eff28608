//! What the policies achieve on the real physics.
#![cfg(feature = "mujoco")]

use baselines::{Policy, RandomPolicy, RandomReference, ScriptedPolicy, ZeroPolicy, evaluate};
use fetch_env::{EnvId, Task, make_with_config};
use goal_reward::RewardKind;

const EPISODES: usize = 40;

fn success_rate(task: Task, policy: &mut dyn Policy) -> f64 {
    let id = EnvId { task, reward: RewardKind::Sparse };
    let mut env = make_with_config(id.config()).expect("MuJoCo");
    let mut count = 0;
    let evaluation = evaluate(&mut env, policy, EPISODES, 1000, |_| count += 1).expect("episodes");
    assert_eq!(count, EPISODES);
    assert!(evaluation.episodes.iter().all(|episode| episode.length == 50));
    evaluation.summary().expect("episodes").success_rate.value
}

#[test]
fn scripted_policies_solve_their_tasks() {
    for (task, least) in [
        (Task::Reach, 0.95),
        (Task::PickAndPlace, 0.95),
        (Task::Push, 0.8),
        // Far above chance, which is 0.01, but no solution.
        (Task::Slide, 0.05),
    ] {
        let rate = success_rate(task, &mut ScriptedPolicy::new(task));
        assert!(rate >= least, "{task}: {rate}");
    }
}

#[test]
fn doing_nothing_solves_nothing_that_is_not_solved_already() {
    assert!(success_rate(Task::PickAndPlace, &mut ZeroPolicy) <= 0.1);
}

#[test]
fn equal_seeds_give_equal_episodes_and_others_do_not() {
    let run = |seed| {
        let id = EnvId { task: Task::Reach, reward: RewardKind::Dense };
        let mut env = make_with_config(id.config()).expect("MuJoCo");
        evaluate(&mut env, &mut RandomPolicy::new(seed), 3, 7, |_| ()).expect("episodes")
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn the_comparison_with_the_reference_tells_policies_apart() {
    let id = EnvId { task: Task::Reach, reward: RewardKind::Dense };
    let mut env = make_with_config(id.config()).expect("MuJoCo");
    let reference = RandomReference::new(id.task, id.reward);
    let random = evaluate(&mut env, &mut RandomPolicy::new(0), EPISODES, 0, |_| ());
    let compared = reference.compare(&random.expect("episodes")).expect("episodes");
    assert!(compared.iter().all(|figure| figure.p_value > 1e-4), "{compared:?}");
    let scripted = evaluate(&mut env, &mut ScriptedPolicy::new(id.task), EPISODES, 0, |_| ());
    let compared = reference.compare(&scripted.expect("episodes")).expect("episodes");
    assert!(compared.iter().all(|figure| figure.p_value < 1e-4), "{compared:?}");
}

/// A scripted policy in the wrong environment holds still.
#[test]
fn a_policy_of_another_task_does_no_harm() {
    assert!(success_rate(Task::Reach, &mut ScriptedPolicy::new(Task::Push)) < 0.2);
}
