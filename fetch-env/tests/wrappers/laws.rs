//! Every wrapper, and compositions of them, pass the environment checker and can be vectorized.

use std::fmt::Debug;

use fetch_env::{
    ActionSpace, BatchObservation, BoxSpace, EnvError, EnvExt, FetchObservation, GoalEnv,
    GoalObservation, NpRandom, SnapshotEnv, VecEnv,
    check::{CheckOptions, CheckReport, check_env, check_goal_env, check_snapshots},
    make_kinematic,
    vec_env::{AutoresetMode, Rows, VecConfig},
    wrappers::{
        ActionNoise, ActionRepeat, ClipAction, DelayAction, DelayObservation, FilterObservation,
        FlattenObservation, FrameStack, LowPassAction, NormalizeObservation, ObservationNoise,
        RecordEpisodeStatistics, RescaleAction, RunningStatistics, ScaleAction,
        TimeAwareObservation, TimeLimit, TransformObservation, TransformReward,
    },
};

use super::{FRAMES, Result, STEPS, TWICE, push, transform};

fn options() -> CheckOptions {
    CheckOptions::default()
}

fn check_all<E>(make: impl Fn() -> Result<E, EnvError>, options: &CheckOptions) -> CheckReport
where
    E: SnapshotEnv<Observation: BatchObservation>,
{
    check_env(&make, options).and(check_snapshots(&make, options))
}

/// Fails unless several environments give the same results in a vector as alone, and continue from
/// snapshots that were written as JSON.
fn ensure_the_same_in_a_vector<E>(make: impl Fn() -> Result<E, EnvError>) -> Result
where
    E: SnapshotEnv<Observation: BatchObservation, Info: Debug> + Send + 'static,
{
    const NUM_ENVS: usize = 3;
    let mut single = (0..NUM_ENVS).map(|_| make()).collect::<Result<Vec<E>, _>>()?;
    let many = (0..NUM_ENVS).map(|_| make()).collect::<Result<Vec<E>, _>>()?;
    let config = VecConfig::default().with_num_threads(2).with_autoreset(AutoresetMode::SameStep);
    let mut many = VecEnv::new(many, config)?;
    many.reset(Some(7))?;
    for (env, seed) in single.iter_mut().zip(7..) {
        env.reset(Some(seed))?;
    }
    let space = single[0].observation_space().clone();
    let action_space = single[0].action_space().clone();
    let len = action_space.action_len();
    let (mut random, mut actions) = (NpRandom::new(1), vec![Default::default(); NUM_ENVS * len]);
    for round in 0..60 {
        for action in actions.chunks_exact_mut(len) {
            action_space.sample_action(&mut random, action)?;
        }
        let batch = many.step(&actions)?;
        for (row, (env, action)) in single.iter_mut().zip(actions.chunks_exact(len)).enumerate() {
            let step = env.step(action)?;
            assert_eq!(batch.reward()[row].to_bits(), step.reward.to_bits());
            assert_eq!(batch.terminated()[row], step.terminated);
            assert_eq!(batch.truncated()[row], step.truncated);
            let is_last = step.is_last();
            let next = step.observation.to_value(&space)?;
            assert_eq!(batch.next_observation_rows().value(row), next);
            if is_last {
                assert_eq!(batch.final_info()[row], Some(step.info));
                let first = env.reset(None)?.observation.to_value(&space)?;
                assert_eq!(batch.observation_rows().value(row), first);
            } else {
                assert_eq!(batch.info()[row], Some(step.info));
            }
        }
        if round == 20 {
            let json = serde_json::to_string(&single[0].snapshot())?;
            let mut copy = make()?;
            copy.restore(&serde_json::from_str(&json)?)?;
            assert_eq!(copy.snapshot(), single[0].snapshot());
            single[0] = copy;
        }
    }
    Ok(())
}

/// Defines a test of each wrapper, with the checks of a goal-conditioned or of a plain environment.
macro_rules! laws {
    ($($name:ident: $check:ident($options:expr), $make:expr;)*) => {$(
        #[test]
        fn $name() -> Result {
            let make = || $make;
            let report = $check(make, &$options);
            assert!(report.passed(), "{report}");
            ensure_the_same_in_a_vector(make)
        }
    )*};
}

laws! {
    time_limit: check_goal_env(options().with_max_episode_steps(Some(TWICE))),
        push()?.wrap(TimeLimit::new(TWICE));
    episode_statistics: check_goal_env(options()), push()?.wrap(RecordEpisodeStatistics::new());
    flattened_observations: check_all(options()), push()?.wrap(FlattenObservation::new());
    some_flattened_parts: check_all(options()),
        push()?.wrap(FlattenObservation::with_keys(["observation", "desired_goal"]));
    filtered_observations: check_goal_env(options()),
        push()?.wrap(FilterObservation::new((3..6).chain(0..3).chain([24])));
    frozen_normalization: check_goal_env(options()),
        push()?.wrap(NormalizeObservation::frozen(RunningStatistics::new(25)));
    time_aware_observations: check_goal_env(options()),
        push()?.wrap(TimeAwareObservation::new(STEPS));
    stacked_observations: check_goal_env(options()), push()?.wrap(FrameStack::new(FRAMES));
    transformed_observations: check_all(options()), {
        let space = BoxSpace::<f64>::unbounded(3).expect("small").into();
        let way = |observation: FetchObservation| {
            let (from, to) = (observation.achieved_goal(), observation.desired_goal());
            [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
        };
        make_kinematic("FetchReach-v4")?.wrap(TransformObservation::new(space, way))
    };
    transformed_rewards: check_all(options()),
        push()?.wrap(TransformReward::new(|reward| 10.0 * reward));
    transformed_rewards_of_goals: check_goal_env(options()),
        transform(make_kinematic("FetchPushDense-v4")?, |r| 1.0 + r.exp());
    rescaled_actions: check_goal_env(options()), push()?.wrap(RescaleAction::new(-0.25, 0.25));
    clipped_actions: check_goal_env(options()), push()?.wrap(ClipAction::new());
    repeated_actions: check_all(options().with_max_episode_steps(std::num::NonZeroU32::new(25))),
        push()?.wrap(ActionRepeat::new(TWICE));

    scaled_actions: check_goal_env(options()), push()?.wrap(ScaleAction::new(0.5));
    smoothed_actions: check_goal_env(options()), push()?.wrap(LowPassAction::new(0.25));
    noisy_actions: check_goal_env(options()), push()?.wrap(ActionNoise::new(0.1, 7));
    delayed_actions: check_goal_env(options()), push()?.wrap(DelayAction::new(2));
    noisy_observations: check_goal_env(options()), push()?.wrap(ObservationNoise::new(0.1, 7));
    delayed_observations: check_goal_env(options()), push()?.wrap(DelayObservation::new(2));

    goals_through_four_wrappers: check_goal_env(options()), {
        let env = push()?.wrap(ClipAction::new())?.wrap(RecordEpisodeStatistics::new())?;
        env.wrap(FrameStack::new(FRAMES))?.wrap(TimeAwareObservation::new(STEPS))
    };
    goals_through_everything_between_a_policy_and_the_robot: check_goal_env(options()), {
        let env = push()?.wrap(DelayAction::new(1))?.wrap(ActionNoise::new(0.05, 1))?;
        let env = env.wrap(ScaleAction::new(0.8))?.wrap(LowPassAction::new(0.5))?;
        env.wrap(ObservationNoise::new(0.01, 2))?.wrap(DelayObservation::new(1))
    };
    goals_through_four_others: check_goal_env(options()), {
        let env = push()?.wrap(RescaleAction::new(-1.0, 1.0))?;
        let env = transform(env, |reward| reward - 0.5)?;
        let env = env.wrap(RecordEpisodeStatistics::new())?.wrap(FilterObservation::new(0..9))?;
        env.wrap(NormalizeObservation::frozen(RunningStatistics::new(9)))
    };
    a_plain_environment_of_five_wrappers: check_all(options()), {
        let env = push()?.wrap(RecordEpisodeStatistics::new())?;
        let env = env.wrap(FlattenObservation::with_keys(["observation", "desired_goal"]))?;
        let env = env.wrap(TransformReward::new(|reward| 0.1 * reward))?;
        env.wrap(TimeAwareObservation::new(STEPS))?.wrap(FrameStack::new(FRAMES))
    };
    a_limit_outside_of_repeated_actions: check_all(options().with_max_episode_steps(Some(TWICE))),
        push()?.wrap(ActionRepeat::new(TWICE))?.wrap(TimeLimit::new(TWICE))?
            .wrap(RecordEpisodeStatistics::new());
}

#[test]
fn running_statistics_keep_every_law_but_that_a_seed_repeats_an_observation() -> Result {
    let make = || push()?.wrap(NormalizeObservation::new());
    let report = check_goal_env(make, &options());
    let failures: Vec<_> = report.failures().map(|check| check.name).collect();
    assert_eq!(failures, ["reset/deterministic", "step/deterministic"], "{report}");
    ensure_the_same_in_a_vector(make)
}

#[cfg(feature = "render")]
#[test]
fn a_wrapped_environment_can_be_rendered() -> Result {
    use fetch_env::{Env, EnvExt, RenderEnv, RenderOptions, make};
    let mut env = make("FetchReach-v4")?
        .wrap(FrameStack::new(FRAMES))?
        .wrap(RecordEpisodeStatistics::new())?;
    env.reset(Some(0))?;
    // Machines without OpenGL skip the pictures.
    if let Ok(mut renderer) = env.renderer(RenderOptions::default()) {
        let picture = env.render(&mut renderer)?.to_vec();
        assert_eq!(env.inner().inner().render(&mut renderer)?, picture);
    }
    Ok(())
}

#[cfg(feature = "her-relabel")]
#[test]
fn wrapped_observations_and_transformed_rewards_are_recorded_and_relabeled() -> Result {
    use fetch_env::her_relabel::{
        Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, UnitInterval,
    };
    const NUM_ENVS: usize = 3;
    let env = || {
        transform(push()?, |reward| 1.0 + reward)?
            .wrap(FrameStack::new(FRAMES))?
            .wrap(RecordEpisodeStatistics::new())?
            .wrap(NormalizeObservation::new())
    };
    let envs = (0..NUM_ENVS).map(|_| env()).collect::<Result<Vec<_>, _>>()?;
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    let dims = Dims { observation: 3 * 25, goal: 3, action: 4 };
    let config = BufferConfig::new(1000, dims).with_num_envs(NUM_ENVS);
    let mut buffer = HerBuffer::<f32>::new(config)?;
    buffer.record(envs.reset(Some(0))?)?.check()?;
    for _ in 0..50 {
        buffer.record(envs.step(&[0.1; 4 * NUM_ENVS])?)?.check()?;
    }
    assert_eq!(buffer.len(), 50 * NUM_ENVS);
    let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::new();
    let reward = env()?;
    sampler.sample(&buffer, reward.goal_reward(), 7, &mut batch)?;
    assert!(batch.reward().iter().all(|reward| [0.0, 1.0].contains(reward)));
    assert!(batch.reward().contains(&1.0), "seen in hindsight, some steps reached their goal");
    Ok(())
}
