//! A buffer stores nothing that did not happen, whichever results are recorded, forgotten or
//! recorded twice.

use std::collections::HashSet;

use fetch_env::{
    FetchObservation,
    vec_env::{VecConfig, VecEnv, VecReset, VecStep},
};
use fetch_sim::KinematicSimulator;
use goal_reward::DistanceReward;
use her_relabel::{
    AddError, Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, UnitInterval,
};
use rand_pcg::{
    Pcg64,
    rand_core::{Rng, SeedableRng},
};
use testing::bits;

use crate::common::{MODES, Result, TestEnv, actions, vec_env};

const COUNT: usize = 3;
const DIMS: Dims = Dims { observation: 25, goal: 3, action: 4 };

type Envs = VecEnv<TestEnv<KinematicSimulator>>;

fn buffer() -> Result<HerBuffer<f64>> {
    Ok(HerBuffer::new(BufferConfig::new(10_000, DIMS).with_num_envs(COUNT))?)
}

/// What really happened in the environments.
#[derive(Default)]
struct Truth {
    states: [Vec<u64>; COUNT],
    transitions: HashSet<Vec<u64>>,
}

/// Returns a row of a matrix.
fn row<T>(all: &[T], rows: usize, at: usize) -> &[T] {
    let len = all.len() / rows;
    &all[at * len..][..len]
}

impl Truth {
    fn watch(&mut self, batch: &VecStep<FetchObservation>) {
        let len = batch.len();
        for (at, &env_index) in batch.env_index().iter().enumerate() {
            let state = &mut self.states[env_index];
            if batch.stepped()[at] {
                let action: Vec<f64> =
                    row(batch.action(), len, at).iter().map(|&x| f64::from(x)).collect();
                let next = [
                    row(batch.next_observation(), len, at),
                    row(batch.next_achieved_goal(), len, at),
                ];
                let transition = [state.clone(), bits([&action[..]]), bits(next)].concat();
                self.transitions.insert(transition);
            }
            let parts = [batch.observation(), batch.achieved_goal(), batch.desired_goal()];
            *state = bits(parts.map(|part| row(part, len, at)));
        }
    }

    /// Checks all finished episodes of a buffer, and returns the number of its transitions.
    fn check(&self, buffer: &HerBuffer<f64>) -> Result<usize> {
        let sampler =
            Sampler::new(20 * buffer.len().max(1), GoalStrategy::Final, UnitInterval::ZERO);
        let mut batch = Batch::<f64>::new();
        sampler.sample(buffer, &DistanceReward::sparse(), 1, &mut batch)?;
        let len = batch.len();
        let mut stored = HashSet::new();
        for at in 0..len {
            let columns = [
                batch.observation(),
                batch.achieved_goal(),
                batch.desired_goal(),
                batch.action(),
                batch.next_observation(),
                batch.next_achieved_goal(),
            ];
            let transition = bits(columns.map(|column| row(column, len, at)));
            assert!(self.transitions.contains(&transition), "it never happened");
            stored.insert(transition);
        }
        Ok(stored.len())
    }
}

/// Does something with the environments; `what` decides.
fn act(envs: &mut Envs, what: u32, time: usize, snapshots: &mut Vec<Snapshot>) -> Result {
    let mask: Vec<bool> = (0..COUNT).map(|env_index| what >> (8 + env_index) & 1 == 1).collect();
    match what % 16 {
        0 => {
            envs.reset(None)?;
        }
        1 | 2 if mask.contains(&true) => {
            envs.reset_with(&VecReset { mask: Some(&mask), ..VecReset::default() })?;
        }
        3 => snapshots.push(envs.snapshot()?),
        4 => {
            if let Some(snapshot) = snapshots.pop() {
                envs.restore(&snapshot)?;
            }
        }
        5..=8 if mask.contains(&true) => {
            let chosen: Vec<usize> = (0..COUNT).filter(|env_index| mask[*env_index]).collect();
            envs.send(&actions(chosen.len(), time), &chosen)?;
            if what.is_multiple_of(2) {
                envs.recv(chosen.len())?;
            } else {
                envs.recv_all()?;
            }
        }
        _ => {
            envs.step(&actions(COUNT, time))?;
        }
    }
    Ok(())
}

type Snapshot = Vec<
    fetch_env::WrappedSnapshot<
        <TestEnv<KinematicSimulator> as fetch_env::SnapshotEnv>::Snapshot,
        u64,
    >,
>;

#[test]
fn whatever_is_forgotten_or_recorded_twice_the_buffer_stores_what_happened() -> Result {
    for (mode, seed) in MODES.into_iter().flat_map(|mode| (0..4).map(move |seed| (mode, seed))) {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut envs =
            vec_env(COUNT, VecConfig::default().with_num_threads(1).with_autoreset(mode))?;
        let (mut buffer, mut truth, mut snapshots) = (buffer()?, Truth::default(), Vec::new());
        let mut refusals = HashSet::new();
        truth.watch(envs.reset(Some(seed))?);
        for time in 0..400 {
            act(&mut envs, random.next_u32(), time, &mut snapshots)?;
            let batch = envs.last_step();
            truth.watch(batch);
            let times = [1, 1, 1, 1, 1, 1, 1, 1, 0, 2][random.next_u32() as usize % 10];
            for _ in 0..times {
                if let Err(error) = buffer.record(batch) {
                    refusals.insert(std::mem::discriminant(&error));
                    if random.next_u32().is_multiple_of(2) {
                        buffer.resume(batch)?.check()?;
                    }
                }
            }
            if random.next_u32().is_multiple_of(50) {
                let mut bytes = Vec::new();
                buffer.write_to(&mut bytes)?;
                buffer = HerBuffer::read_from(&bytes[..])?;
            }
        }
        for env_index in 0..COUNT {
            if buffer.unfinished_steps(env_index)?.is_some() {
                buffer.end_episode(env_index)?;
            }
        }
        let (stored, all) = (truth.check(&buffer)?, truth.transitions.len());
        assert!(stored > all / 3, "{mode:?}: {stored} of {all}");
        assert!(refusals.len() >= 3, "{mode:?}: {refusals:?}");
    }
    Ok(())
}

#[test]
fn a_refusal_says_how_many_results_are_missing_and_changes_nothing() -> Result {
    for mode in MODES {
        let mut envs = vec_env(COUNT, VecConfig::default().with_autoreset(mode))?;
        let mut buffer = buffer()?;
        let actions = [0.1; 4 * COUNT];
        buffer.record(envs.reset(Some(4))?)?.check()?;
        buffer.record(envs.step(&actions)?)?.check()?;
        let twice = buffer.record(envs.last_step());
        assert_eq!(twice, Err(AddError::RecordedBefore { env_index: 0 }));
        envs.step(&actions)?;
        envs.reset(None)?;
        let refused = buffer.record(envs.step(&actions)?);
        assert_eq!(refused, Err(AddError::RowsMissing { env_index: 0, missing: 2 }));
        assert_eq!(buffer.unfinished_steps(0)?, Some(1));
        // It goes on in the state that it has now, or after a reset.
        buffer.resume(envs.last_step())?.check()?;
        assert_eq!((buffer.len(), buffer.unfinished_steps(0)?), (COUNT, Some(0)));
        buffer.record(envs.step(&actions)?)?.check()?;
        envs.step(&actions)?;
        buffer.record(envs.reset(None)?)?.check()?;
        assert_eq!((buffer.len(), buffer.unfinished_steps(0)?), (2 * COUNT, Some(0)));
    }
    Ok(())
}

#[test]
fn steps_of_other_environments_are_not_joined() -> Result {
    let config = VecConfig::default();
    let (mut one, mut other, mut buffer) =
        (vec_env(COUNT, config)?, vec_env(COUNT, config)?, buffer()?);
    let actions = [0.1; 4 * COUNT];
    assert_ne!(one.last_step().source(), other.last_step().source());
    buffer.record(one.reset(Some(4))?)?.check()?;
    other.reset(Some(4))?;
    let foreign = buffer.record(other.step(&actions)?);
    assert_eq!(foreign, Err(AddError::OtherEpisode { env_index: 0 }));
    buffer.record(one.step(&actions)?)?.check()?;
    buffer.record(other.reset(Some(5))?)?.check()?;
    buffer.record(other.step(&actions)?)?.check()?;
    let foreign = buffer.record(one.step(&actions)?);
    assert_eq!(foreign, Err(AddError::OtherEpisode { env_index: 0 }));
    // A copy of the environments goes on where the episode is, and a loaded buffer as well.
    one.restore(&other.snapshot()?)?;
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes)?;
    for mut buffer in [buffer, HerBuffer::read_from(&bytes[..])?] {
        let foreign = buffer.record(one.step(&actions)?);
        assert_eq!(foreign, Err(AddError::OtherEpisode { env_index: 0 }));
        one.restore(&other.snapshot()?)?;
        buffer.resume(one.last_step())?.check()?;
        assert_eq!((buffer.len(), buffer.unfinished_steps(0)?), (COUNT, Some(1)));
        buffer.record(one.step(&actions)?)?.check()?;
        assert_eq!(buffer.unfinished_steps(0)?, Some(2));
        one.restore(&other.snapshot()?)?;
    }
    Ok(())
}
