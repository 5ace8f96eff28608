//! Continuing the run of a checkpoint.

use std::io;
use std::path::Path;

use fetch_env::{EnvError, SnapshotEnv};
use her_relabel::HerBuffer;

use super::environment::EnvMark;
use super::format::{Own, check_sight, checkpoints};
use super::load::Loaded;
use crate::learn::algorithm::interface::{AlgorithmInit, Built};
use crate::learn::algorithm::state_file::StateFault;
use crate::learn::error::{CheckpointError as Error, TrainError};
use crate::learn::run::curve::Counters;
use crate::learn::run::env::LearnEnv;
use crate::learn::run::eyes::SightOf;
use crate::learn::run::inputs::Inputs;
use crate::learn::run::learner::check_same;
use crate::learn::run::trainer::Trainer;
use crate::learn::run::updates::Updates;
use crate::learn::settings::algorithm::AlgorithmSettings;
use crate::learn::settings::pixels::PixelActorSettings;
use crate::learn::settings::train::TrainSettings;
use crate::workers::{OneProcess, Workers};

/// How a run continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Resumed {
    /// With the same bits as a run that was never stopped.
    Exactly,
    /// On a different number of processes. Networks, optimizers, normalizers and counters are those
    /// of the checkpoint. Each process continues with one or more of the checkpoint's buffers, and
    /// keeps as many of their newest finished episodes as fit into its own. Unfinished episodes are
    /// lost: the environments begin new ones, and all later random numbers differ.
    OnOtherRanks {
        /// The number of processes that wrote the checkpoint.
        before: usize,
    },
}

impl<E: LearnEnv + SnapshotEnv> Trainer<E> {
    /// Continues the run of the last checkpoint in a folder, on environments that `make` makes in
    /// the same way as those of the run. It ends with the same bits as a run that was never
    /// stopped.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) if there is no checkpoint, or the last one is damaged or belongs
    /// to a different environment: one with different spaces, with different rewards for the same
    /// goals, or that rejects the checkpoint's snapshots; [`OtherSight`](Error::OtherSight) if its
    /// policy sees pictures: `resume_pixels` continues that run.
    pub fn resume(
        make: impl Fn() -> Result<E, EnvError>,
        folder: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, Error> {
        let workers = Box::new(OneProcess);
        Self::resume_with_workers(make, folder, num_threads, workers).map(|(trainer, _)| trainer)
    }

    /// Continues the run whose checkpoints are in a folder as [`resume`](Self::resume) does, or
    /// prepares a new one as [`new`](Self::new) does if there are none. [`save`](Self::save) in the
    /// same folder makes a program that can be stopped and started again.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) as [`resume`](Self::resume), and
    /// [`CheckpointError::OtherSettings`](Error::OtherSettings) if the run in the folder has other
    /// settings or another seed.
    ///
    /// ```no_run
    /// use std::ops::ControlFlow;
    ///
    /// use baselines::learn::{TrainSettings, Trainer};
    /// use fetch_env::{Task, make_kinematic};
    ///
    /// let folder = "push";
    /// let make = || Ok(make_kinematic("FetchPush-v4")?);
    /// let settings = TrainSettings::fast(Task::Push);
    /// let mut trainer = Trainer::resume_or_new(make, settings, 0, 2, folder)?;
    /// trainer.run(500_000, None, |trainer, row| {
    ///     println!("{} steps: {:?}", row.counters.steps, row.success_rate);
    ///     match trainer.save(folder) {
    ///         Ok(_) => ControlFlow::Continue(()),
    ///         Err(_) => ControlFlow::Break(()),
    ///     }
    /// })?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn resume_or_new(
        make: impl Fn() -> Result<E, EnvError>,
        settings: TrainSettings,
        seed: u64,
        num_threads: usize,
        folder: impl AsRef<Path>,
    ) -> Result<Self, Error> {
        let folder = folder.as_ref();
        match checkpoints(folder) {
            Ok(checkpoints) if !checkpoints.is_empty() => {}
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                return Err(Error::Read { path: folder.to_owned(), source });
            }
            _ => return Ok(Self::new(make, settings, seed, num_threads)?),
        }
        let trainer = Self::resume(make, folder, num_threads)?;
        check_same(&trainer, &settings, seed, folder)?;
        Ok(trainer)
    }

    /// Continues a run as [`resume`](Self::resume) does, shared by several processes. Returns
    /// whether it continues exactly: on the same number of processes that wrote the checkpoint. The
    /// first process reads it.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) as [`resume`](Self::resume).
    pub fn resume_with_workers(
        make: impl Fn() -> Result<E, EnvError>,
        folder: impl AsRef<Path>,
        num_threads: usize,
        workers: Box<dyn Workers>,
    ) -> Result<(Self, Resumed), Error> {
        let build = AlgorithmSettings::build;
        Self::resume_with_algorithm(make, folder, num_threads, workers, build)
    }

    /// Continues a run of [`with_algorithm`](Self::with_algorithm), otherwise as
    /// [`resume_with_workers`](Self::resume_with_workers). `build` gets the settings of the
    /// checkpoint.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) as [`resume`](Self::resume), and the errors of `build`.
    pub fn resume_with_algorithm(
        make: impl Fn() -> Result<E, EnvError>,
        folder: impl AsRef<Path>,
        num_threads: usize,
        workers: Box<dyn Workers>,
        build: impl FnOnce(&AlgorithmSettings, AlgorithmInit) -> Built,
    ) -> Result<(Self, Resumed), Error> {
        let blind = None::<(_, fn(&mut Self, _) -> _)>;
        Self::resume_seeing(make, folder.as_ref(), num_threads, workers, build, blind)
    }

    /// Continues a run whose actor sees something besides the state, if `seeing` says what, and adds
    /// that actor to a trainer.
    pub(in crate::learn) fn resume_seeing(
        make: impl Fn() -> Result<E, EnvError>,
        folder: &Path,
        num_threads: usize,
        mut workers: Box<dyn Workers>,
        build: impl FnOnce(&AlgorithmSettings, AlgorithmInit) -> Built,
        seeing: Option<(
            &SightOf,
            impl FnOnce(&mut Self, PixelActorSettings) -> Result<(), TrainError>,
        )>,
    ) -> Result<(Self, Resumed), Error> {
        let Loaded { path, before, mut saved, networks, environment, eyes, own, buffers } =
            Loaded::read(folder, &mut *workers)?;
        let of_eyes = saved.eyes.as_ref();
        let sight = seeing.as_ref().map(|(sight, _)| *sight);
        check_sight(&path, of_eyes.map(|eyes| &eyes.sight), sight)?;
        let actor = saved.settings.pixels.take();
        let damaged = |reason: String| {
            let (path, before) = (path.clone(), before.clone());
            Error::Damaged { path, reason, before }
        };
        let foreign =
            |reason: &str| Error::Foreign { path: path.clone(), reason: reason.to_owned() };
        let size = workers.size();
        let (settings, seed) = (saved.settings, saved.seed);
        let mut trainer = Self::with_algorithm(make, settings, seed, num_threads, workers, build)?;
        if let Some((_, open_eyes)) = seeing {
            open_eyes(&mut trainer, actor.unwrap_or_default())?;
        }
        let dims = trainer.replay.buffer.config().dims();
        EnvMark::read(&environment)
            .and_then(|mark| mark.check(&mut trainer.replay.template, dims.goal))
            .map_err(|reason| foreign(&reason))?;
        let mut replayed = Vec::new();
        for (number, bytes) in buffers {
            let buffer = HerBuffer::<f32>::read_from(bytes.as_slice());
            let buffer = buffer.map_err(|error| damaged(error.to_string()))?;
            replayed.push((buffer, saved.demonstrated.get(number).cloned().unwrap_or_default()));
        }
        let fault = |fault| match fault {
            StateFault::Damaged(reason) => damaged(reason),
            StateFault::Foreign(reason) => foreign(&reason),
        };
        let Updates { algorithm, form, .. } = &mut trainer.updates;
        let state = algorithm.state_mut();
        form.restore(state.vectors, &networks).map_err(fault)?;
        *state.num_updates = saved.num_updates;
        if let (Some(actor), Some(state)) = (&mut trainer.eyes, saved.eyes) {
            let [networks, memory] = &eyes;
            actor.restore(state, networks, memory).map_err(fault)?;
        }
        let Inputs { observation, goal, .. } = &saved.inputs;
        if (observation.dim(), goal.dim()) != (dims.observation, dims.goal) {
            return Err(foreign("a normalizer does not fit"));
        }
        trainer.run_id = saved.run_id;
        trainer.replay.inputs = saved.inputs;
        trainer.counters = saved.counters;
        trainer.recent = saved.recent;
        trainer.rows = saved.rows;
        trainer.rest = saved.rest;
        trainer.last_checkpoint = Some(path.clone());
        let resumed = if saved.num_ranks == size {
            let own = Own::read(&own).map_err(damaged)?;
            let (buffer, demonstrated) =
                replayed.pop().ok_or_else(|| damaged("it has no buffer".to_owned()))?;
            if buffer.config() != trainer.replay.buffer.config() {
                return Err(foreign("the buffer does not fit"));
            }
            trainer.replay.buffer = buffer;
            trainer.replay.demonstrated = demonstrated;
            trainer.collecting.collector.restore(&own.collector).map_err(Error::Envs)?;
            if let Some(last_batch) = own.last_batch {
                let (collecting, buffer) = (&mut trainer.collecting, &mut trainer.replay.buffer);
                let is_recorded = collecting.resume_recording(&last_batch, buffer).is_ok();
                if !is_recorded || !collecting.explorer.restore(own.explorer, last_batch, dims) {
                    return Err(foreign("the last batch does not fit"));
                }
            }
            Resumed::Exactly
        } else {
            for (buffer, demonstrated) in &replayed {
                let all = &mut trainer.replay.buffer;
                all.append(buffer).map_err(|_| foreign("the buffer does not fit"))?;
                let newest = [buffer, all].map(|buffer| buffer.transition_ids());
                if let [Some((_, others)), Some((_, own))] = newest {
                    trainer.replay.demonstrated.append(demonstrated, others, own);
                }
            }
            let Counters { steps, episodes, .. } = trainer.counters;
            trainer.collecting.explorer.skip(steps, episodes);
            trainer.begin_episodes()?;
            Resumed::OnOtherRanks { before: saved.num_ranks }
        };
        Ok((trainer, resumed))
    }
}
