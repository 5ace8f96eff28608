//! Many environments at once: evaluation and collecting give what single environments give.

use baselines::{
    Collector, CollectorError, Episode, Evaluation, EvaluationError, Policy, RandomPolicy,
    VecPolicy, ZeroPolicy, buffer_config, evaluate, evaluate_vec,
};
use fetch_env::wrappers::{KeepsGoals, Resetting, Stateless, TransformReward, Wrapped, Wrapper};
use fetch_env::{
    ActionElement, Env, EnvError, EnvExt, FetchObservation, GoalEnv, GoalObservation, KinematicEnv,
    Reset, Space, Step, VecEnv, make_kinematic,
    vec_env::{AutoresetMode, VecConfig, VecStep, VecStepOf},
};
use her_relabel::{AddError, HerBuffer};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const MODES: [AutoresetMode; 3] =
    [AutoresetMode::NextStep, AutoresetMode::SameStep, AutoresetMode::Disabled];

fn envs(count: usize, mode: AutoresetMode) -> Result<VecEnv<KinematicEnv>> {
    let envs = (0..count).map(|_| make_kinematic("FetchReachDense-v4"));
    let config = VecConfig::default().with_num_threads(2).with_autoreset(mode);
    Ok(VecEnv::new(envs.collect::<Result<Vec<_>, _>>()?, config)?)
}

/// Moves toward the goal, more slowly the nearer it is.
fn approach(achieved_goal: &[f64], desired_goal: &[f64], action: &mut [f32]) {
    for axis in 0..3 {
        action[axis] = (3.0 * (desired_goal[axis] - achieved_goal[axis])) as f32;
    }
}

fn approach_one(observation: &FetchObservation, action: &mut [f32]) {
    approach(observation.achieved_goal(), observation.desired_goal(), action);
}

fn approach_all(batch: &VecStep<FetchObservation>, actions: &mut [f32]) {
    let achieved = batch.achieved_goal().chunks_exact(3);
    let goals = achieved.zip(batch.desired_goal().chunks_exact(3));
    for ((achieved, desired), action) in goals.zip(actions.chunks_exact_mut(4)) {
        approach(achieved, desired, action);
    }
}

#[test]
fn evaluating_many_environments_gives_the_episodes_of_one() -> Result {
    let mut env = make_kinematic("FetchReachDense-v4")?;
    let expected = evaluate(&mut env, &mut approach_one, 7, 20, |_| ())?;
    for mode in MODES {
        for count in [1, 3, 7, 10] {
            let mut envs = envs(count, mode)?;
            let mut seen = 0;
            let found = evaluate_vec(&mut envs, &mut approach_all, 7, 20, |_| seen += 1)?;
            assert_eq!((found, seen), (expected.clone(), 7), "{mode:?}, {count} environments");
        }
    }
    Ok(())
}

#[test]
fn every_step_is_collected_in_every_autoreset_mode() -> Result {
    let config = buffer_config(10_000, &make_kinematic("FetchReach-v4")?)?.with_num_envs(3);
    for mode in MODES {
        let mut buffer = HerBuffer::<f32>::new(config.clone())?;
        let mut collector = Collector::new(envs(3, mode)?);
        let mut episodes: Vec<(usize, Episode)> = Vec::new();
        collector.reset(Some(5), &mut buffer)?;
        // In two parts, of which the first ends in the middle of an episode.
        for steps in [30, 120] {
            collector.collect(steps, &mut approach_all, &mut buffer, |env_id, episode| {
                episodes.push((env_id, episode.clone()));
            })?;
        }
        // The autoreset takes a step of its own in one mode.
        let per_env = if mode == AutoresetMode::NextStep { 148 } else { 150 };
        assert_eq!(buffer.num_episodes(), 3 * (per_env / 50));
        assert_eq!(buffer.len(), 3 * (per_env / 50) * 50);
        let under_way = buffer.unfinished_steps(0)?;
        assert_eq!(under_way.unwrap_or(0), per_env % 50, "{mode:?}");

        let mut env = make_kinematic("FetchReachDense-v4")?;
        let first = evaluate(&mut env, &mut approach_one, 3, 5, |_| ())?.episodes;
        // Collecting does not measure the controls.
        let first = first.into_iter().map(|episode| Episode { controls: None, ..episode });
        let first: Vec<_> = first.collect();
        let collected: Vec<Episode> =
            episodes.iter().take(3).map(|(_, episode)| episode.clone()).collect();
        assert_eq!(collected, first, "the first episodes have the seeds of the reset");
        assert!(episodes[3..].iter().all(|(_, episode)| episode.seed.is_none()));
        assert_eq!(episodes.len(), buffer.num_episodes());
    }
    Ok(())
}

#[test]
fn a_refused_environment_keeps_no_other_episode_from_being_reported() -> Result {
    let make = |is_wrong: bool| {
        let env = make_kinematic("FetchReach-v4")?;
        let reward = *env.goal_reward();
        let transform = move |reward: f64| if is_wrong { f64::NAN } else { reward };
        env.wrap(TransformReward::with_goal_reward(reward, transform))
    };
    for mode in MODES {
        let config = VecConfig::default().with_autoreset(mode);
        let envs = VecEnv::new([make(true)?, make(false)?], config)?;
        let config = buffer_config(1_000, &make(false)?)?.with_num_envs(2);
        let mut buffer = HerBuffer::<f32>::new(config)?;
        let mut policy = RandomPolicy::new(envs.single_action_space(), 0);
        let mut collector = Collector::new(envs);
        let (mut lengths, mut refusals) = (Vec::new(), 0);
        for _ in 0..110 {
            let collected = collector.collect(1, &mut policy, &mut buffer, |env_index, episode| {
                if env_index == 1 {
                    lengths.push(episode.episode_length);
                }
            });
            match collected {
                Ok(_) => {}
                Err(CollectorError::NotFinite { env_index: 0, .. }) => refusals += 1,
                Err(error) => return Err(error.into()),
            }
        }
        assert_eq!(lengths, [50, 50], "{mode:?}");
        assert_eq!(buffer.num_episodes(), 2);
        assert!(refusals > 0);
    }
    Ok(())
}

#[test]
fn one_policy_serves_one_environment_and_many() -> Result {
    let mut envs = envs(2, AutoresetMode::NextStep)?;
    envs.reset(Some(0))?;
    let (mut one, mut all) = ([0.0; 8], [0.0; 8]);
    let policy = RandomPolicy::new(envs.single_action_space(), 1);
    policy.clone().act(&(), &mut one);
    policy.clone().act_all(envs.last_step(), &mut all);
    assert_eq!(one, all);
    Ok(())
}

#[test]
fn a_buffer_for_fewer_environments_is_an_error() -> Result {
    let config = buffer_config(100, &make_kinematic("FetchReach-v4")?)?.with_num_envs(2);
    let mut buffer = HerBuffer::<f32>::new(config)?;
    let mut collector = Collector::new(envs(3, AutoresetMode::NextStep)?);
    let mut policy = RandomPolicy::new(collector.envs().single_action_space(), 0);
    let error = collector.collect(1, &mut policy, &mut buffer, |_, _| ()).err();
    let Some(CollectorError::Buffer(AddError::UnknownEnv { env_index: 2, .. })) = error else {
        return Err(format!("{error:?}").into());
    };
    Ok(())
}

/// An endless episode gives an error, in one environment and in many, for any number of episodes.
#[test]
fn an_episode_without_an_end_is_an_error() -> Result {
    let endless = || Ok::<_, EnvError>(make_kinematic("FetchReach-v4")?.into_inner());
    let error = evaluate(&mut endless()?, &mut ZeroPolicy, usize::MAX, 5, |_| ()).unwrap_err();
    let EvaluationError::Environment { episode: 0, seed: 5, source } = error else {
        return Err(error.into());
    };
    assert_eq!(source, EnvError::Endless { steps: 100_000 });
    let mut envs = VecEnv::new(vec![endless()?], VecConfig::default())?;
    let mut still = |_: &VecStep<FetchObservation>, actions: &mut [f32]| actions.fill(0.0);
    let error = evaluate_vec(&mut envs, &mut still, usize::MAX, 5, |_| ()).unwrap_err();
    assert!(matches!(error, EvaluationError::Environment { source: EnvError::Endless { .. }, .. }));
    Ok(())
}

/// Fails in episodes of some seeds.
#[derive(Clone, Copy)]
struct Failing {
    reset: Option<u64>,
    step: Option<u64>,
    /// The seed of the episode.
    seed: Option<u64>,
}

impl Wrapper<KinematicEnv> for Failing {
    type Observation = FetchObservation;
    type Info = <KinematicEnv as Env>::Info;
    type ActionSpace = <KinematicEnv as Env>::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, KinematicEnv>,
        seed: Option<u64>,
        options: &<KinematicEnv as Env>::ResetOptions,
    ) -> Result<Reset<FetchObservation, Self::Info>, EnvError> {
        self.seed = seed;
        self.check(self.reset)?;
        env.reset_with(seed, options)
    }

    fn step(
        &mut self,
        env: &mut KinematicEnv,
        action: &[ActionElement<KinematicEnv>],
    ) -> Result<Step<FetchObservation, Self::Info>, EnvError> {
        self.check(self.step)?;
        env.step(action)
    }

    fn action_space<'a>(&'a self, env: &'a KinematicEnv) -> &'a Self::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a KinematicEnv) -> &'a Space {
        env.observation_space()
    }
}

impl KeepsGoals for Failing {}
impl Stateless for Failing {}

impl Failing {
    fn check(&self, failing: Option<u64>) -> Result<(), EnvError> {
        if failing.is_some() && failing == self.seed {
            return Err(EnvError::other(std::io::Error::other("it fails")));
        }
        Ok(())
    }

    fn make(self) -> Result<Wrapped<KinematicEnv, Self>> {
        Ok(make_kinematic("FetchReach-v4")?.wrap(self)?)
    }

    /// Evaluates seven episodes from seed 20, one at a time and three at a time, and returns the
    /// episode and the seed of the failure.
    fn failures(self) -> Result<[Option<(usize, u64)>; 2]> {
        let failure = |evaluation: Result<Evaluation, EvaluationError>| {
            let Err(EvaluationError::Environment { episode, seed, .. }) = evaluation else {
                assert_eq!(evaluation.expect("no other error").episodes.len(), 7);
                return None;
            };
            Some((episode, seed))
        };
        let one = evaluate(&mut self.make()?, &mut ZeroPolicy, 7, 20, |_| ());
        let envs = (0..3).map(|_| self.make()).collect::<Result<Vec<_>>>()?;
        let mut envs = VecEnv::new(envs, VecConfig::default())?;
        let mut still = |_: &VecStepOf<Wrapped<KinematicEnv, Self>>, actions: &mut [f32]| {
            actions.fill(0.0);
        };
        let many = evaluate_vec(&mut envs, &mut still, 7, 20, |_| ());
        Ok([failure(one), failure(many)])
    }
}

#[test]
fn a_failure_has_the_episode_and_the_seed_where_it_happened() -> Result {
    let none = Failing { reset: None, step: None, seed: None };
    assert_eq!(none.failures()?, [None; 2]);
    for seed in 20..27 {
        let failure = Some((seed as usize - 20, seed));
        assert_eq!(Failing { reset: Some(seed), ..none }.failures()?, [failure; 2]);
        assert_eq!(Failing { step: Some(seed), ..none }.failures()?, [failure; 2]);
    }
    // Environments beyond the last episode may fail.
    for seed in [27, 28] {
        assert_eq!(Failing { reset: Some(seed), ..none }.failures()?, [None; 2]);
        assert_eq!(Failing { step: Some(seed), ..none }.failures()?, [None; 2]);
    }
    Ok(())
}

#[test]
fn seeds_go_on_behind_the_greatest() -> Result {
    let mut env = make_kinematic("FetchReach-v4")?;
    let evaluation = evaluate(&mut env, &mut ZeroPolicy, 3, u64::MAX - 1, |_| ())?;
    let seeds: Vec<_> = evaluation.episodes.iter().map(|episode| episode.seed).collect();
    assert_eq!(seeds, [Some(u64::MAX - 1), Some(u64::MAX), Some(0)]);
    Ok(())
}
