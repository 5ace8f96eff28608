//! The part of a run that updates the actor.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::curve::UpdateSeconds;
use super::env::LearnEnv;
use super::eyes::Eyes;
use super::replay::Replay;
use crate::learn::algorithm::interface::{Algorithm, Losses};
use crate::learn::algorithm::state_file::StateForm;
use crate::learn::error::{RunError, TrainError};
use crate::workers::Workers;

/// The number of threads that can share the work of an update.
const MAX_THREADS: usize = 2;

/// An algorithm, and the threads that compute its updates.
pub(crate) struct Updates {
    pub(crate) algorithm: Box<dyn Algorithm>,
    /// The form of its state when it was built.
    pub(crate) form: StateForm,
    threads: ThreadPool,
    /// The process that has the threads.
    process: u32,
    pub(super) seconds: UpdateSeconds,
}

impl Updates {
    pub(super) fn new(
        mut algorithm: Box<dyn Algorithm>,
        num_threads: usize,
    ) -> Result<Self, TrainError> {
        let form = StateForm::of(&algorithm.state_mut().vectors);
        let form = form.map_err(|reason| TrainError::State {
            algorithm: algorithm.name().to_owned(),
            reason,
        })?;
        let threads =
            ThreadPoolBuilder::new().num_threads(num_threads.clamp(1, MAX_THREADS)).build();
        Ok(Self {
            algorithm,
            form,
            threads: threads.map_err(TrainError::Threads)?,
            process: std::process::id(),
            seconds: UpdateSeconds::default(),
        })
    }

    /// Checks that the threads are in this process: in a forked one, nothing would answer.
    pub(super) fn check_process(&self) -> Result<(), TrainError> {
        if self.process == std::process::id() { Ok(()) } else { Err(TrainError::Forked) }
    }

    /// Performs the updates with these numbers, counted from 0, and calls `check` with the losses
    /// of each. What `eyes` learns follows.
    pub(super) fn perform<E: LearnEnv>(
        &mut self,
        numbers: Range<u64>,
        replay: &mut Replay<E>,
        workers: &mut dyn Workers,
        mut eyes: Option<&mut (dyn Eyes<E::Observation, E::Info> + 'static)>,
        mut check: impl FnMut(Losses) -> Result<(), RunError> + Send,
    ) -> Result<(), RunError> {
        let Self { algorithm, threads, seconds, .. } = self;
        let (start, exchanging) = (Instant::now(), workers.seconds());
        // One call for all, so that the threads stay awake between two updates.
        threads.install(|| {
            for number in numbers {
                let batch = replay.draw(number)?;
                check(algorithm.update(batch, &mut |numbers| workers.average(numbers)))?;
                if let Some(eyes) = &mut eyes {
                    eyes.update(number, &mut **algorithm, &replay.inputs, &replay.reward())?;
                }
            }
            Ok::<_, RunError>(())
        })?;
        seconds.total += start.elapsed().as_secs_f64();
        seconds.exchanging += workers.seconds() - exchanging;
        Ok(())
    }

    /// Returns a checksum of everything that later updates depend on.
    pub(super) fn checksum(&mut self) -> u64 {
        let mut hasher = DefaultHasher::new();
        let state = self.algorithm.state_mut();
        state.num_updates.hash(&mut hasher);
        for number in state.vectors.iter().flat_map(|(_, vector)| vector.iter()) {
            hasher.write_u32(number.to_bits());
        }
        hasher.finish()
    }
}
