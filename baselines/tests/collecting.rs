//! Episodes of environments, collected into a buffer.

use baselines::{CollectError, RandomPolicy, buffer_config, collect};
use fetch_env::{Env, FetchObservation, GoalEnv, GoalObservation, make_kinematic};
use her_relabel::{AddError, Batch, GoalStrategy, HerBuffer, Sampler, UnitInterval};

const EPISODES: usize = 4;
const STEPS: usize = 50;

/// Fills a buffer and holds it against the environment, played again.
fn check<E: GoalEnv<Observation = FetchObservation>>(mut env: E) {
    let first = env.reset(Some(0)).expect("a reset").observation;
    let mut buffer = HerBuffer::<f64>::new(buffer_config(1000, &first)).expect("a buffer");
    let collected = collect(&mut env, &mut RandomPolicy::new(3), EPISODES, 10, &mut buffer, 0);
    assert_eq!(collected.expect("episodes").episodes.len(), EPISODES);
    assert_eq!((buffer.len(), buffer.num_episodes()), (EPISODES * STEPS, EPISODES));

    let mut batch = Batch::new();
    let sampler = Sampler::new(2000, GoalStrategy::Future, UnitInterval::from_k(4));
    sampler.sample(&buffer, env.goal_reward(), 1, &mut batch).expect("a batch");
    let goal = |goals: &[f64], row: usize| goals[row * 3..][..3].to_vec();
    let mut rewards = Vec::new();
    for row in 0..batch.len() {
        let achieved = goal(batch.next_achieved_goal(), row);
        let desired = goal(batch.desired_goal(), row);
        let reward = env.compute_reward(&achieved, &desired).expect("finite goals");
        assert_eq!(batch.reward()[row].to_bits(), reward.to_bits());
        assert!(!batch.terminated()[row]);
        rewards.push(reward);
    }
    assert!(rewards.iter().any(|reward| *reward != rewards[0]));
    assert!(batch.truncated().contains(&true));

    // The first transition of the first episode is what the environment does.
    let mut policy = RandomPolicy::new(3);
    let start = env.reset(Some(10)).expect("a reset").observation;
    let action = baselines::Policy::act(&mut policy, &start);
    let step = env.step(&action).expect("a step");
    let oldest = buffer.transition_ids().expect("transitions").0;
    let row = batch.transition().iter().position(|id| *id == oldest).expect("a row of 200");
    let dim = start.observation().len();
    assert_eq!(&batch.observation()[row * dim..][..dim], start.observation());
    assert_eq!(&batch.next_observation()[row * dim..][..dim], step.observation.observation());
    assert_eq!(batch.action()[row * 4..][..4], action.map(f64::from));
}

#[test]
fn episodes_of_the_stand_in_are_collected() {
    for id in ["FetchReach-v4", "FetchPushDense-v4"] {
        check(make_kinematic(id).expect("an environment"));
    }
}

#[cfg(feature = "mujoco")]
#[test]
fn episodes_of_mujoco_are_collected() {
    for id in ["FetchReachDense-v4", "FetchPickAndPlace-v4"] {
        check(fetch_env::make(id).expect("an environment"));
    }
}

#[test]
fn a_buffer_that_does_not_fit_is_told() {
    let mut reach = make_kinematic("FetchReach-v4").expect("an environment");
    let mut push = make_kinematic("FetchPush-v4").expect("an environment");
    let first = reach.reset(Some(0)).expect("a reset").observation;
    let mut buffer = HerBuffer::<f32>::new(buffer_config(1000, &first)).expect("a buffer");
    let mut policy = RandomPolicy::new(0);
    let error = collect(&mut push, &mut policy, 1, 5, &mut buffer, 0).expect_err("other sizes");
    let CollectError::Buffer { episode: 0, seed: 5, source } = error else {
        panic!("{error}");
    };
    assert!(matches!(source, AddError::WrongLength { .. }), "{source}");
    // Nothing is left over, and the next episode goes in.
    collect(&mut reach, &mut policy, 1, 0, &mut buffer, 0).expect("an episode");
    assert_eq!(buffer.len(), STEPS);
}
