//! The failure of one environment does not affect the others.

use std::{
    panic::panic_any,
    sync::atomic::{AtomicUsize, Ordering::SeqCst},
    thread,
    time::Duration,
};
use testing::{Fault, Faulty};

use fetch_env::{
    BoxSpace, Env, EnvError, FetchObservation, FetchResetOptions, Reset, Space, Step,
    vec_env::{AutoresetMode, VecConfig, VecEnv},
};
use fetch_sim::{KinematicSimulator, SimConfig, SimError};

use crate::common::{MODES, Result, TestEnv, actions, envs, kinematic, row_of, singles, vec_env};

/// A panic payload whose drop panics with another.
struct Bomb;

impl Drop for Bomb {
    fn drop(&mut self) {
        panic_any(Self);
    }
}

static LONG_STEPS: AtomicUsize = AtomicUsize::new(0);

fn take_long() -> Result<(), SimError> {
    LONG_STEPS.fetch_add(1, SeqCst);
    thread::sleep(Duration::from_millis(20));
    Ok(())
}

fn diverged() -> SimError {
    SimError::Unstable { reason: "the gripper went down".into() }
}

fn faulty_vec(count: usize, fault: Fault, mode: AutoresetMode) -> Result<VecEnv<TestEnv<Faulty>>> {
    let config = VecConfig::default().with_num_threads(2).with_autoreset(mode);
    let simulator = |config: &SimConfig| Faulty::new(config, fault);
    let mut made = VecEnv::new(envs(count, simulator)?, config)?;
    made.reset(Some(0))?;
    Ok(made)
}

/// Actions of four environments, of which the third goes down.
const DOWN: [f32; 16] =
    [0.5, 0.5, 0.5, 0.0, 0.5, 0.5, 0.5, 0.0, 0.5, 0.5, -1.0, 0.0, 0.5, 0.5, 0.5, 0.0];
const STAY: [f32; 16] = [0.0; 16];

#[test]
fn a_wrong_action_changes_nothing_in_its_row_and_nothing_elsewhere() -> Result {
    const COUNT: usize = 5;
    for mode in MODES {
        let mut together =
            vec_env(COUNT, VecConfig::default().with_num_threads(2).with_autoreset(mode))?;
        together.reset(Some(0))?;
        let mut singles = singles(COUNT, mode, kinematic)?;
        for (seed, env) in (0..).zip(&mut singles) {
            env.reset(Some(seed))?;
        }
        let mut with_nan = actions(COUNT, 0);
        with_nan[2 * 4 + 1] = f32::NAN;
        let before = together.last_step().observation()[2 * 25..3 * 25].to_vec();
        let batch = together.step(&with_nan)?;
        let (row, error) = batch.errors().next().ok_or("no error")?;
        assert_eq!((row, batch.errors().count()), (2, 1));
        assert!(matches!(error, EnvError::ActionNotFinite { index: 1, .. }));
        assert_eq!(batch.observation()[2 * 25..3 * 25], before);
        assert!(batch.reward()[2].is_nan() && !batch.truncated()[2] && batch.info()[2].is_none());
        for (env_index, single) in
            singles.iter_mut().enumerate().filter(|(env_index, _)| *env_index != 2)
        {
            assert_eq!(row_of(batch, env_index), single.step(env_index)?);
        }
        // The refused action does not count: the next is the environment's first.
        let mut next = actions(COUNT, 1);
        next[8..12].copy_from_slice(&actions(COUNT, 0)[8..12]);
        let batch = together.step(&next)?;
        for (env_index, single) in singles.iter_mut().enumerate() {
            assert_eq!(row_of(batch, env_index), single.step(env_index)?);
        }
    }
    Ok(())
}

#[test]
fn a_simulation_that_diverges_ends_its_episode_alone() -> Result {
    for mode in MODES {
        let mut envs = faulty_vec(4, || Err(diverged()), mode)?;
        let goal = envs.last_step().desired_goal()[6..9].to_vec();
        let batch = envs.step(&DOWN)?;
        assert_eq!(batch.errors().collect::<Vec<_>>(), [(2, &EnvError::from(diverged()))]);
        assert_eq!(batch.truncated(), [false, false, true, false]);
        assert_eq!(batch.final_info()[2], None);
        let is_reset = batch.desired_goal()[6..9] != goal;
        assert_eq!(is_reset, mode == AutoresetMode::SameStep);
        let batch = envs.step(&STAY)?;
        let expected = (mode == AutoresetMode::Disabled).then_some(EnvError::ResetNeeded);
        assert_eq!(batch.error(2), expected.as_ref());
        assert_eq!(batch.errors().count(), usize::from(expected.is_some()));
        let is_reset = batch.desired_goal()[6..9] != goal;
        assert_eq!(is_reset, mode != AutoresetMode::Disabled);
    }
    Ok(())
}

#[test]
fn an_environment_that_panics_is_out_of_use_and_the_others_continue() -> Result {
    for mode in MODES {
        let mut envs = faulty_vec(4, || panic!("the gripper went down"), mode)?;
        let batch = envs.step(&DOWN)?;
        let panicked = EnvError::Panicked { message: "the gripper went down".into() };
        assert_eq!(batch.errors().collect::<Vec<_>>(), [(2, &panicked)]);
        assert_eq!(batch.truncated(), [false, false, true, false]);
        for _ in 0..2 {
            let batch = envs.step(&STAY)?;
            assert_eq!(batch.errors().map(|(row, _)| row).collect::<Vec<_>>(), [2]);
        }
        assert_eq!(envs.reset(None)?.errors().count(), 1);
        assert!(envs.env(2).is_none() && envs.env(3).is_some());
    }
    Ok(())
}

#[test]
fn a_panic_whose_payload_panics_is_contained() -> Result {
    for mode in MODES {
        let mut envs = faulty_vec(4, || panic_any(Bomb), mode)?;
        for actions in [DOWN, STAY] {
            let batch = envs.step(&actions)?;
            let (row, error) = batch.errors().next().ok_or("no error")?;
            assert!(matches!(error, EnvError::Panicked { .. }), "{error:?}");
            assert_eq!((row, batch.errors().count()), (2, 1));
        }
        assert!(envs.env(2).is_none() && envs.env(3).is_some());
    }
    Ok(())
}

/// An environment that panics when it is dropped, and so does its info.
struct PanicsOnDrop(TestEnv<KinematicSimulator>);

impl Drop for PanicsOnDrop {
    fn drop(&mut self) {
        panic_any(Bomb);
    }
}

#[derive(Clone, Debug, PartialEq)]
struct PanickingInfo;

impl Drop for PanickingInfo {
    fn drop(&mut self) {
        if !thread::panicking()
            && thread::current().name().is_some_and(|n| n.starts_with("vec-env"))
        {
            panic_any(Bomb);
        }
    }
}

impl Env for PanicsOnDrop {
    type Observation = FetchObservation;
    type Info = PanickingInfo;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = FetchResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> Result<Reset<FetchObservation, PanickingInfo>, EnvError> {
        Ok(self.0.reset_with(seed, options)?.map_info(|_| PanickingInfo))
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<FetchObservation, PanickingInfo>, EnvError> {
        Ok(self.0.step(action)?.map_info(|_| PanickingInfo))
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        self.0.action_space()
    }

    fn observation_space(&self) -> &Space {
        self.0.observation_space()
    }
}

#[test]
fn panics_while_an_environment_and_its_info_are_dropped_are_contained() -> Result {
    let singles = envs(2, kinematic)?.into_iter().map(PanicsOnDrop);
    let mut envs = VecEnv::new(singles, VecConfig::default())?;
    assert_eq!(envs.reset(Some(0))?.errors().count(), 0);
    for _ in 0..2 {
        let batch = envs.step(&[0.0; 8])?;
        let panicked = |error: &EnvError| matches!(error, EnvError::Panicked { .. });
        assert_eq!(batch.errors().filter(|(_, error)| panicked(error)).count(), 2);
    }
    Ok(())
}

#[test]
fn a_drop_abandons_steps_that_have_not_begun() -> Result {
    let mut envs = faulty_vec(100, take_long, AutoresetMode::NextStep)?;
    let down = [0.0, 0.0, -1.0, 0.0].repeat(100);
    envs.send(&down, &(0..100).collect::<Vec<_>>())?;
    envs.recv(1)?;
    drop(envs);
    let begun = LONG_STEPS.load(SeqCst);
    assert!((1..100).contains(&begun), "{begun}");
    Ok(())
}

#[test]
fn a_vector_goes_to_another_thread_with_steps_in_flight() -> Result {
    let mut envs = vec_env(4, VecConfig::default().with_num_threads(2))?;
    envs.reset(Some(0))?;
    envs.send(&actions(4, 0), &[0, 1, 2, 3])?;
    let received = thread::spawn(move || envs.recv(4).map(|batch| batch.len()));
    assert_eq!(received.join().expect("no panic"), Ok(4));
    Ok(())
}
