//! Sending and receiving give each environment the results that it gives alone.

use fetch_env::vec_env::{AutoresetMode, VecConfig, VecEnv, VecReset};
use fetch_sim::KinematicSimulator;
use proptest::prelude::*;

use crate::common::{
    MODES, Result, Row, TestEnv, action, kinematic, row_of, rows, singles, vec_env,
};

/// The results of each environment, in its own order.
struct Histories {
    envs: VecEnv<TestEnv<KinematicSimulator>>,
    rows: Vec<Vec<Row>>,
}

impl Histories {
    fn new(count: usize, threads: usize, mode: AutoresetMode) -> Self {
        let config = VecConfig::default().with_num_threads(threads).with_autoreset(mode);
        let mut envs = vec_env(count, config).expect("a vector");
        envs.send_reset(Some(5)).expect("a reset");
        Self { envs, rows: vec![Vec::new(); count] }
    }

    fn recv(&mut self, batch_size: usize) -> Vec<usize> {
        let batch = self.envs.recv(batch_size).expect("a batch");
        assert_eq!(batch.len(), batch_size);
        for (row, &env_index) in batch.env_index().iter().enumerate() {
            assert_eq!(batch.error(row), None);
            self.rows[env_index].push(row_of(batch, row));
        }
        batch.env_index().to_vec()
    }

    /// Sends each environment its next action, which depends on its own number of steps.
    fn send(&mut self, env_index: &[usize]) {
        let next = |&env_index: &usize| action(env_index, self.rows[env_index].len() - 1);
        let actions: Vec<f32> = env_index.iter().flat_map(next).collect();
        self.envs.send(&actions, env_index).expect("idle environments");
    }

    fn check(&self, mode: AutoresetMode) {
        let singles = singles(self.rows.len(), mode, kinematic).expect("environments");
        for (env_index, (mut single, rows)) in singles.into_iter().zip(&self.rows).enumerate() {
            let mut expected = Vec::with_capacity(rows.len());
            for row in 0..rows.len() {
                let row = match row {
                    0 => single.reset(Some(5 + env_index as u64)),
                    _ => single.step(env_index),
                };
                expected.push(row.expect("a row"));
            }
            assert_eq!(*rows, expected, "environment {env_index}, {mode:?}");
        }
    }
}

#[test]
fn batches_of_those_that_finish_first_have_the_bits_of_single_environments() {
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep] {
        for threads in [1, 2, 3, 8] {
            let mut histories = Histories::new(10, threads, mode);
            for _ in 0..60 {
                let ids = histories.recv(3);
                histories.send(&ids);
            }
            histories.recv(histories.envs.in_flight());
            histories.check(mode);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_interleaving_gives_the_same_bits(
        count in 1_usize..12,
        threads in 1_usize..5,
        mode in prop::sample::select(MODES.to_vec()),
        moves in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 1..60),
    ) {
        let mut histories = Histories::new(count, threads, mode);
        let mut idle: Vec<usize> = Vec::new();
        for (amount, sends) in moves {
            if sends && !idle.is_empty() {
                let ids: Vec<usize> = idle.drain(..=amount.index(idle.len())).collect();
                // Another test covers resets by the caller; here these environments stay idle.
                let over = |id: &usize| {
                    mode == AutoresetMode::Disabled
                        && histories.rows[*id].last().is_some_and(|row| row.truncated)
                };
                let ids: Vec<usize> = ids.into_iter().filter(|id| !over(id)).collect();
                histories.send(&ids);
            } else {
                let in_flight = histories.envs.in_flight();
                idle.extend(histories.recv(amount.index(in_flight + 1)));
            }
        }
        histories.recv(histories.envs.in_flight());
        prop_assert_eq!(histories.envs.in_flight(), 0);
        histories.check(mode);
    }
}

#[test]
fn a_masked_reset_can_be_in_flight_beside_steps() -> Result {
    let mut envs = vec_env(3, VecConfig::default().with_num_threads(2))?;
    let expected = rows(envs.reset(Some(0))?);
    envs.send(&action(1, 0), &[1])?;
    let (seeds, mask) = ([Some(0), None, Some(2)], [true, false, true]);
    let again = VecReset { seeds: Some(&seeds), mask: Some(&mask), options: None };
    envs.send_reset_with(&again)?;
    let batch = envs.recv(3)?;
    for (row, &env_index) in batch.env_index().iter().enumerate() {
        assert_eq!(row_of(batch, row) == expected[env_index], env_index != 1);
    }
    Ok(())
}
