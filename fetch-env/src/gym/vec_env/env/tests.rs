//! Tests that look into a vector, and the counting of its threads' allocations.

use std::thread::JoinHandle;

use super::*;
use crate::fetch::kinematic::make_kinematic;
use crate::gym::error::EnvError;

impl<E: Env<Observation: BatchObservation> + Send + 'static> VecEnv<E> {
    /// Replaces the threads by ones that count their allocations and return the count when the
    /// vector is dropped.
    pub(crate) fn count_allocations(&mut self) -> Vec<JoinHandle<u64>> {
        let (pool, counts) = Pool::counting(self.num_threads(), self.num_envs());
        self.pool = pool;
        counts
    }
}

#[test]
fn without_one_of_its_threads_a_vector_asks_for_new_environments() -> Result<(), EnvError> {
    let envs = [make_kinematic("FetchReach-v4")?, make_kinematic("FetchReach-v4")?];
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    envs.reset(Some(0))?;
    envs.send(&[0.0; 4], &[1])?;
    envs.pool.lose_a_thread();
    let lost = Some(VecEnvError::WorkerLost);
    assert_eq!(envs.reset(None).err(), lost);
    assert_eq!(envs.step(&[0.0; 8]).err(), lost);
    assert_eq!(envs.send(&[0.0; 4], &[0]).err(), lost);
    assert_eq!(envs.send_reset(None).err(), lost);
    assert_eq!(envs.recv(1).err(), lost);
    assert_eq!(envs.snapshot().err(), lost);
    Ok(())
}
