//! Recording every batch in a hindsight buffer stores what each environment does alone.

use std::collections::{BTreeMap, BTreeSet};

use fetch_env::{
    Env, EnvError, FetchResetOptions, GoalObservation, MovingGoal,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecReset},
};
use fetch_sim::{KinematicSimulator, SimError};
use goal_reward::{DistanceReward, GoalReward};
use her_relabel::{
    Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, StartData, StepData, UnitInterval,
};
use testing::Faulty;

use crate::common::{MODES, Result, TestEnv, action, actions, envs, kinematic, vec_env};

const COUNT: usize = 5;
const STEPS: usize = 40;
const DIMS: Dims = Dims { observation: 25, goal: 3, action: 4 };

fn buffer() -> Result<HerBuffer<f64>> {
    Ok(HerBuffer::new(BufferConfig::new(10_000, DIMS).with_num_envs(COUNT))?)
}

fn bytes(buffer: &HerBuffer<f64>) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes)?;
    Ok(bytes)
}

/// Environments one after another, recorded episode by episode by hand.
struct ByHand {
    envs: Vec<TestEnv<KinematicSimulator>>,
    needs_reset: [bool; COUNT],
    buffer: HerBuffer<f64>,
}

impl ByHand {
    fn new() -> Result<Self> {
        Ok(Self { envs: envs(COUNT, kinematic)?, needs_reset: [true; COUNT], buffer: buffer()? })
    }

    fn begin(&mut self, env_index: usize, seed: Option<u64>) -> Result {
        let start = self.envs[env_index].reset(seed)?.observation;
        self.needs_reset[env_index] = false;
        Ok(self.buffer.begin_episode(
            env_index,
            &StartData {
                observation: start.observation(),
                achieved_goal: start.achieved_goal(),
                desired_goal: start.desired_goal(),
            },
        )?)
    }

    fn step(&mut self, env_index: usize, action: &[f32]) -> Result {
        let step = self.envs[env_index].step(action)?;
        self.needs_reset[env_index] = step.is_last();
        Ok(self.buffer.add_step(
            env_index,
            &StepData {
                action,
                reward: step.reward,
                next_observation: step.observation.observation(),
                next_achieved_goal: step.observation.achieved_goal(),
                terminated: step.terminated,
                truncated: step.truncated,
                fields: &[],
            },
        )?)
    }

    /// Does what a vectorized environment does with an action.
    fn act(&mut self, env_index: usize, action: &[f32], mode: AutoresetMode) -> Result {
        if self.needs_reset[env_index] {
            return self.begin(env_index, None);
        }
        self.step(env_index, action)?;
        if self.needs_reset[env_index] && mode != AutoresetMode::NextStep {
            self.begin(env_index, None)?;
        }
        Ok(())
    }
}

#[test]
fn a_recorded_vector_stores_what_its_environments_do_alone() -> Result {
    for mode in MODES {
        let config = VecConfig::default().with_num_threads(2).with_autoreset(mode);
        let (mut envs, mut buffer, mut by_hand) =
            (vec_env(COUNT, config)?, buffer()?, ByHand::new()?);
        buffer.record(envs.reset(Some(4))?)?.check()?;
        for (env_index, seed) in (0..COUNT).zip(4..) {
            by_hand.begin(env_index, Some(seed))?;
        }
        for step in 0..STEPS {
            let actions: Vec<f32> =
                (0..COUNT).flat_map(|env_index| action(env_index, step)).collect();
            let batch = envs.step(&actions)?;
            buffer.record(batch)?.check()?;
            let over: Vec<bool> = batch.truncated().to_vec();
            if mode == AutoresetMode::Disabled && over.contains(&true) {
                let reset = VecReset { mask: Some(&over), ..VecReset::default() };
                buffer.record(envs.reset_with(&reset)?)?.check()?;
            }
            for env_index in 0..COUNT {
                by_hand.act(env_index, &action(env_index, step), mode)?;
            }
            assert!(bytes(&buffer)? == bytes(&by_hand.buffer)?, "{mode:?}, step {step}");
        }
        assert!(buffer.num_episodes() >= COUNT * 4);
    }
    Ok(())
}

#[test]
fn rows_are_recorded_in_the_order_in_which_they_arrive() -> Result {
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep] {
        let config = VecConfig::default().with_num_threads(2).with_autoreset(mode);
        let (mut envs, mut buffer, mut by_hand) =
            (vec_env(COUNT, config)?, buffer()?, ByHand::new()?);
        let mut steps = [0; COUNT];
        envs.send_reset(Some(4))?;
        let mut started = [false; COUNT];
        for _ in 0..100 {
            let batch = envs.recv(2)?;
            buffer.record(batch)?.check()?;
            let env_index = batch.env_index().to_vec();
            let mut actions = Vec::new();
            for &env_index in &env_index {
                if started[env_index] {
                    by_hand.act(env_index, &action(env_index, steps[env_index] - 1), mode)?;
                } else {
                    by_hand.begin(env_index, Some(4 + env_index as u64))?;
                    started[env_index] = true;
                }
                actions.extend(action(env_index, steps[env_index]));
                steps[env_index] += 1;
            }
            envs.send(&actions, &env_index)?;
            assert!(bytes(&buffer)? == bytes(&by_hand.buffer)?, "{mode:?}");
        }
        assert!(buffer.num_episodes() > COUNT);
    }
    Ok(())
}

#[test]
fn a_failed_environment_loses_its_own_episode_only() -> Result {
    const DOWN: [f32; 4] = [0.1, 0.1, -1.0, 0.0];
    const STAY: [f32; 4] = [0.1, 0.1, 0.0, 0.0];
    let diverged = || Err(SimError::Unstable { reason: "the gripper went down".into() });
    let panics = || panic!("the gripper went down");
    let faults: [fn() -> Result<(), SimError>; 2] = [diverged, panics];
    for (mode, fault) in MODES.into_iter().flat_map(|mode| faults.map(|fault| (mode, fault))) {
        let config = VecConfig::default().with_num_threads(2).with_autoreset(mode);
        let simulator = |config: &fetch_sim::SimConfig| Faulty::new(config, fault);
        let mut envs = VecEnv::new(envs(COUNT, simulator)?, config)?;
        let mut buffer = buffer()?;
        buffer.record(envs.reset(Some(4))?)?.check()?;
        let with = |third: [f32; 4]| [STAY, STAY, third, STAY, STAY].concat();
        for _ in 0..2 {
            assert_eq!(buffer.record(envs.step(&with(STAY))?)?.recorded_steps, COUNT);
        }
        // A refused action loses nothing.
        let batch = envs.step(&with([f32::NAN; 4]))?;
        assert!(matches!(batch.error(2), Some(EnvError::ActionNotFinite { .. })));
        let recorded = buffer.record(batch)?;
        assert_eq!((recorded.recorded_steps, recorded.discarded_episodes), (COUNT - 1, 0));
        assert_eq!(buffer.unfinished_steps(2)?, Some(2));

        let recorded = buffer.record(envs.step(&with(DOWN))?)?;
        assert_eq!((recorded.recorded_steps, recorded.discarded_episodes), (COUNT - 1, 1));
        assert!(recorded.first_refusal.is_none());
        for env_index in [0, 1, 3, 4] {
            assert_eq!(buffer.unfinished_steps(env_index)?, Some(4));
        }
        // The next episode of the environment, if it has one, is recorded from its start.
        buffer.record(envs.step(&with(STAY))?)?.check()?;
        let unfinished = buffer.unfinished_steps(2)?;
        let goes_on = envs.env(2).is_some() && mode != AutoresetMode::Disabled;
        match mode {
            AutoresetMode::NextStep => assert_eq!(unfinished, goes_on.then_some(0)),
            _ => assert_eq!(unfinished, goes_on.then_some(1)),
        }
    }
    Ok(())
}

#[test]
fn a_step_whose_reset_fails_is_recorded() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new([ResetsOnce(envs(1, kinematic)?.remove(0), true)], config)?;
    let mut buffer = buffer()?;
    buffer.record(envs.reset(Some(0))?)?.check()?;
    for _ in 0..5 {
        buffer.record(envs.step(&[0.1; 4])?)?.check()?;
    }
    let batch = envs.last_step();
    assert_eq!(batch.error(0), Some(&EnvError::other("no second episode")));
    assert_eq!((batch.stepped(), batch.started()), (&[true][..], &[false][..]));
    assert!(batch.step_info(0).is_some() && batch.distance().all(f64::is_finite));
    assert_eq!((buffer.len(), buffer.num_episodes()), (5, 1));
    Ok(())
}

#[test]
fn a_restored_state_is_not_joined_to_the_steps_before() -> Result {
    for mode in MODES {
        let mut envs = vec_env(COUNT, VecConfig::default().with_autoreset(mode))?;
        let mut buffer = buffer()?;
        let actions = [0.1; 4 * COUNT];
        buffer.record(envs.reset(Some(4))?)?.check()?;
        buffer.record(envs.step(&actions)?)?.check()?;
        let snapshot = envs.snapshot()?;
        for _ in 0..2 {
            buffer.record(envs.step(&actions)?)?.check()?;
        }
        envs.restore(&snapshot)?;
        let recorded = buffer.record(envs.last_step())?;
        assert_eq!((recorded.recorded_steps, recorded.finished_episodes), (0, COUNT));
        assert_eq!((buffer.len(), buffer.unfinished_steps(0)?), (3 * COUNT, Some(0)));
        buffer.record(envs.step(&actions)?)?.check()?;
        assert_eq!(buffer.unfinished_steps(0)?, Some(1));
    }
    Ok(())
}

#[test]
fn each_row_of_a_goal_that_moves_has_the_goal_of_its_step() -> Result {
    for mode in MODES {
        let config = VecConfig::default().with_num_threads(2).with_autoreset(mode);
        let (mut envs, mut buffer) = (vec_env(COUNT, config)?, buffer()?);
        buffer.record(envs.reset(Some(4))?)?.check()?;
        // By action: the goal and the reward.
        let mut taken = BTreeMap::new();
        for step in 0..STEPS {
            // Never, each time, and seldom.
            for env_index in (1..COUNT).filter(|env_index| step % env_index == 0) {
                let goal = [1.3, 0.7, 0.5].map(|meters| meters + 0.01 * (step % 20) as f64);
                let env = envs.env_mut(env_index).ok_or("in flight")?;
                env.set_desired_goal(&goal)?;
            }
            let goal = |env_index| Some(envs.env(env_index)?.inner().desired_goal()?.to_vec());
            let goals: Vec<_> = (0..COUNT).map(goal).collect();
            let batch = envs.step(&actions(COUNT, step))?;
            for (env_index, goal) in
                goals.into_iter().enumerate().filter(|(env_index, _)| batch.stepped()[*env_index])
            {
                let action = action(env_index, step).map(f32::to_bits);
                taken.insert(action, (goal.ok_or("no goal")?, batch.reward()[env_index]));
            }
            buffer.record(batch)?.check()?;
            let over: Vec<bool> = batch.truncated().to_vec();
            if mode == AutoresetMode::Disabled && over.contains(&true) {
                let reset = VecReset { mask: Some(&over), ..VecReset::default() };
                buffer.record(envs.reset_with(&reset)?)?.check()?;
            }
        }
        for env_index in 0..COUNT {
            let _ = buffer.end_episode(env_index);
        }
        assert_eq!(buffer.len(), taken.len());
        let (mut batch, reward) = (Batch::<f64>::new(), DistanceReward::dense());
        for ratio in [UnitInterval::ZERO, UnitInterval::from_k(4)] {
            let sampler = Sampler::new(20 * taken.len(), GoalStrategy::Future, ratio);
            sampler.sample(&buffer, &reward, 0, &mut batch)?;
            let rows = batch.action().chunks(4).zip(batch.desired_goal().chunks(3));
            let rows = rows.zip(batch.next_achieved_goal().chunks(3)).enumerate();
            let mut drawn = BTreeSet::new();
            for (row, ((action, goal), achieved)) in rows {
                assert_eq!(batch.reward()[row], reward.reward(achieved, goal), "{mode:?}");
                if batch.goal_source()[row].is_none() {
                    let action = [0, 1, 2, 3].map(|at| (action[at] as f32).to_bits());
                    assert_eq!(taken[&action], (goal.to_vec(), batch.reward()[row]), "{mode:?}");
                    drawn.insert(action);
                }
            }
            assert!(ratio > UnitInterval::ZERO || drawn.len() == taken.len());
        }
    }
    Ok(())
}

#[test]
fn an_episode_goes_on_in_an_environment_that_a_call_leaves_out() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let (mut envs, mut buffer) = (vec_env(COUNT, config)?, buffer()?);
    buffer.record(envs.reset(Some(4))?)?.check()?;
    // The first episode of environment 0 ends, and its next one begins.
    for step in 0..5 {
        buffer.record(envs.step(&actions(COUNT, step))?)?.check()?;
    }
    assert_eq!(buffer.unfinished_steps(0)?, Some(0));
    let reset = VecReset { mask: Some(&[false, true, false, false, false]), ..VecReset::default() };
    let recorded = buffer.record(envs.reset_with(&reset)?)?;
    assert_eq!((recorded.finished_episodes, recorded.discarded_episodes), (1, 0));
    envs.send(&action(3, 5), &[3])?;
    assert_eq!(buffer.record(envs.recv_all()?)?.discarded_episodes, 0);
    buffer.record(envs.step(&actions(COUNT, 6))?)?.check()?;
    assert_eq!(buffer.unfinished_steps(0)?, Some(1));
    Ok(())
}

#[test]
fn a_reset_with_refused_options_changes_nothing() -> Result {
    let wrong = FetchResetOptions::default().with_desired_goal([f64::NAN; 3]);
    let mut options = vec![FetchResetOptions::default(); COUNT];
    options[0] = wrong;
    let mask = [true, false, false, false, false];
    let reset = VecReset { mask: Some(&mask), options: Some(&options), ..VecReset::default() };
    for mode in MODES {
        let mut envs = vec_env(COUNT, VecConfig::default().with_autoreset(mode))?;
        let mut buffer = buffer()?;
        buffer.record(envs.reset(Some(4))?)?.check()?;
        for step in 0..5 {
            if step > 0 {
                let batch = envs.reset_with(&reset)?;
                assert!(matches!(batch.error(0), Some(EnvError::OptionOutside { .. })));
                assert_eq!(buffer.record(batch)?.discarded_episodes, 0);
                assert_eq!(buffer.unfinished_steps(0)?, Some(step));
            }
            buffer.record(envs.step(&actions(COUNT, step))?)?.check()?;
        }
        // The episode is over, and the next one is still to begin.
        assert_eq!(buffer.record(envs.reset_with(&reset)?)?.discarded_episodes, 0);
        let batch = envs.step(&actions(COUNT, 5))?;
        assert_eq!(batch.started()[0], mode == AutoresetMode::NextStep);
        assert_eq!(batch.stepped()[0], mode == AutoresetMode::SameStep);
    }
    Ok(())
}

/// An environment whose second reset fails.
struct ResetsOnce(TestEnv<KinematicSimulator>, bool);

type Inner = TestEnv<KinematicSimulator>;

impl Env for ResetsOnce {
    type Observation = <Inner as Env>::Observation;
    type Info = <Inner as Env>::Info;
    type ActionSpace = <Inner as Env>::ActionSpace;
    type ResetOptions = <Inner as Env>::ResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &Self::ResetOptions,
    ) -> Result<fetch_env::Reset<Self::Observation, Self::Info>, EnvError> {
        if std::mem::take(&mut self.1) {
            self.0.reset_with(seed, options)
        } else {
            Err(EnvError::other("no second episode"))
        }
    }

    fn step(
        &mut self,
        action: &[f32],
    ) -> Result<fetch_env::Step<Self::Observation, Self::Info>, EnvError> {
        self.0.step(action)
    }

    fn action_space(&self) -> &Self::ActionSpace {
        self.0.action_space()
    }

    fn observation_space(&self) -> &fetch_env::Space {
        self.0.observation_space()
    }
}
