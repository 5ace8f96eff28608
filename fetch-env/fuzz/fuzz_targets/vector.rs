//! Calls on several environments at once.

use arbitrary::Arbitrary;
use fetch_env::{
    EnvError, EnvId, FetchObservation,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecEnvError, VecReset, VecStep},
};

use crate::{Kind, Options, TestEnv, make};

#[derive(Arbitrary, Debug)]
pub struct Setup {
    kinds: [Kind; 4],
    num_envs: u8,
    num_threads: u8,
    mode: u8,
    limit: u8,
}

#[derive(Arbitrary, Debug)]
pub enum Call {
    Step(Actions),
    Send(Actions, Vec<u8>),
    Reset(Option<u64>),
    SendReset { seeds: Vec<Option<u64>>, mask: Option<Vec<bool>>, options: Vec<Options> },
    Recv(u8),
    RecvAll,
    SetAutoresetStart(Option<u64>, Options),
    SaveAndRestore,
}

/// Up, down, or any numbers.
#[derive(Arbitrary, Debug)]
pub enum Actions {
    Each(u8),
    Any(Vec<f32>),
}

impl Actions {
    fn get(&self, rows: usize) -> Vec<f32> {
        match self {
            // A set bit lets an environment go down.
            Self::Each(bits) => (0..rows)
                .flat_map(|row| {
                    [0.1, 0.0, if bits >> (row % 8) & 1 == 1 { -1.0 } else { 1.0 }, 0.0]
                })
                .collect(),
            Self::Any(numbers) => numbers.clone(),
        }
    }
}

const MODES: [AutoresetMode; 3] =
    [AutoresetMode::NextStep, AutoresetMode::SameStep, AutoresetMode::Disabled];

pub fn run(setup: &Setup, calls: &[Call]) {
    let num_envs = usize::from(setup.num_envs) % setup.kinds.len() + 1;
    let config = VecConfig::default()
        .with_num_threads(usize::from(setup.num_threads) % 2 + 1)
        .with_autoreset(MODES[usize::from(setup.mode) % MODES.len()]);
    let id = EnvId::ALL[2];
    let singles = setup.kinds[..num_envs].iter().map(|kind| make(id, setup.limit, *kind));
    let mut vector = Vector {
        envs: VecEnv::new(singles, config).expect("environments of one kind"),
        in_flight: vec![false; num_envs],
        out_of_use: vec![false; num_envs],
        was_reset: vec![false; num_envs],
        reset_was_sent: vec![false; num_envs],
    };
    for call in calls.iter().take(40) {
        vector.call(call);
        assert_eq!(vector.envs.in_flight(), vector.num_in_flight());
    }
    vector.end();
}

struct Vector {
    envs: VecEnv<TestEnv>,
    in_flight: Vec<bool>,
    out_of_use: Vec<bool>,
    /// Whether a reset has succeeded, and whether one was asked for.
    was_reset: Vec<bool>,
    reset_was_sent: Vec<bool>,
}

impl Vector {
    fn num_in_flight(&self) -> usize {
        self.in_flight.iter().filter(|is_in_flight| **is_in_flight).count()
    }

    fn call(&mut self, call: &Call) {
        let num_envs = self.in_flight.len();
        let is_idle = self.num_in_flight() == 0;
        match call {
            Call::Step(actions) => {
                let actions = actions.get(num_envs);
                match self.envs.step(&actions).cloned() {
                    Ok(batch) => {
                        assert!(is_idle && actions.len() == 4 * num_envs);
                        assert!(!self.reset_was_sent.contains(&false));
                        self.look_at(&batch);
                    }
                    Err(VecEnvError::InFlight { .. }) => assert!(!is_idle),
                    Err(VecEnvError::ActionCount { .. }) => assert!(actions.len() != 4 * num_envs),
                    Err(VecEnvError::ResetNeeded { env_index }) => {
                        assert!(!self.reset_was_sent[env_index]);
                    }
                    Err(error) => panic!("{error}"),
                }
            }
            Call::Send(actions, ids) => {
                let ids: Vec<usize> = ids.iter().map(|id| usize::from(*id % 5)).collect();
                match self.envs.send(&actions.get(ids.len()), &ids) {
                    Ok(()) => ids.iter().for_each(|id| {
                        assert!(self.reset_was_sent[*id]);
                        assert!(!std::mem::replace(&mut self.in_flight[*id], true));
                    }),
                    Err(VecEnvError::ResetNeeded { env_index }) => {
                        assert!(!self.reset_was_sent[env_index]);
                    }
                    Err(VecEnvError::UnknownEnv { env_index, .. }) => {
                        assert!(env_index >= num_envs)
                    }
                    Err(VecEnvError::EnvInFlight { env_index }) => {
                        let named = ids.iter().filter(|id| **id == env_index).count();
                        assert!(self.in_flight[env_index] || named > 1);
                    }
                    Err(VecEnvError::ActionCount { .. }) => {}
                    Err(error) => panic!("{error}"),
                }
            }
            Call::Reset(seed) => match self.envs.reset(*seed).cloned() {
                Ok(batch) => {
                    assert!(is_idle);
                    self.reset_was_sent.fill(true);
                    self.look_at(&batch);
                }
                Err(VecEnvError::InFlight { .. }) => assert!(!is_idle),
                Err(VecEnvError::SeedTooLarge { .. }) => {
                    let first = seed.expect("a seed");
                    assert!(first.checked_add(num_envs as u64 - 1).is_none());
                }
                Err(error) => panic!("{error}"),
            },
            Call::SendReset { seeds, mask, options } => {
                let options: Vec<_> = options.iter().map(|options| options.get()).collect();
                let reset = VecReset {
                    seeds: (!seeds.is_empty()).then_some(&seeds[..]),
                    mask: mask.as_deref(),
                    options: (!options.is_empty()).then_some(&options[..]),
                };
                let chosen = |env_index: usize| {
                    mask.as_ref().is_none_or(|mask| mask.get(env_index) == Some(&true))
                };
                match self.envs.send_reset_with(&reset) {
                    Ok(()) => {
                        (0..num_envs).filter(|env_index| chosen(*env_index)).for_each(|env_index| {
                            self.reset_was_sent[env_index] = true;
                            assert!(!std::mem::replace(&mut self.in_flight[env_index], true));
                        })
                    }
                    Err(VecEnvError::EnvInFlight { env_index }) => {
                        assert!(self.in_flight[env_index])
                    }
                    Err(VecEnvError::Count { actual, .. }) => assert!(actual != num_envs),
                    Err(VecEnvError::EmptyMask) => {
                        assert!(mask.as_ref().is_some_and(|mask| !mask.contains(&true)));
                    }
                    Err(error) => panic!("{error}"),
                }
            }
            Call::Recv(size) => self.receive(usize::from(*size % 6)),
            Call::RecvAll => self.receive(self.num_in_flight()),
            Call::SetAutoresetStart(seed, options) => {
                let (seed, options) = (*seed, options.get());
                let set = self.envs.set_autoreset_start(move |_, _| (seed, options.clone()));
                assert_eq!(set.is_ok(), is_idle);
            }
            Call::SaveAndRestore => match self.envs.snapshot() {
                Ok(snapshot) => {
                    assert_eq!(self.envs.restore(&snapshot), Ok(()));
                    assert_eq!(self.envs.snapshot(), Ok(snapshot));
                    self.reset_was_sent.clone_from(&self.was_reset);
                }
                Err(VecEnvError::InFlight { .. }) => assert!(!is_idle),
                Err(VecEnvError::OutOfUse { env_index }) => assert!(self.out_of_use[env_index]),
                Err(error) => panic!("{error}"),
            },
        }
    }

    fn receive(&mut self, size: usize) {
        match self.envs.recv(size).cloned() {
            Ok(batch) => {
                assert_eq!(batch.len(), size);
                for env_index in batch.env_index() {
                    assert!(std::mem::replace(&mut self.in_flight[*env_index], false));
                }
                self.look_at(&batch);
            }
            Err(VecEnvError::BatchTooLarge { .. }) => assert!(size > self.num_in_flight()),
            Err(error) => panic!("{error}"),
        }
    }

    fn look_at(&mut self, batch: &VecStep<FetchObservation>) {
        for (row, &env_index) in batch.env_index().iter().enumerate() {
            if let Some(EnvError::Panicked { .. }) = batch.error(row) {
                self.out_of_use[env_index] = true;
            } else {
                assert!(!self.out_of_use[env_index]);
            }
            self.was_reset[env_index] |= batch.started()[row];
            let observation = &batch.observation()[25 * row..][..25];
            let is_finite = observation.iter().all(|number| number.is_finite());
            // A state that was restored after a failure has no observation until the next reset.
            assert!(is_finite == self.was_reset[env_index] || batch.error(row).is_some());
            assert!(batch.error(row).is_some() || batch.reward()[row].is_finite());
            assert!(!batch.stepped()[row] || batch.info()[row].is_some());
        }
        for (env_index, is_out_of_use) in self.out_of_use.iter().enumerate() {
            assert_eq!(
                self.envs.env(env_index).is_none(),
                *is_out_of_use || self.in_flight[env_index]
            );
        }
    }

    /// Every environment that has not panicked can be reset.
    fn end(&mut self) {
        self.receive(self.num_in_flight());
        let batch = self.envs.reset(Some(0)).expect("idle environments").clone();
        for (env_index, is_out_of_use) in self.out_of_use.clone().into_iter().enumerate() {
            assert_eq!(batch.error(env_index).is_some(), is_out_of_use);
        }
    }
}
