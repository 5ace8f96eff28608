//! Saving checkpoints.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use fetch_env::SnapshotEnv;
use her_relabel::files;
use serde::Serialize;

use super::environment::EnvMark;
use super::format::{
    ENVIRONMENT, EYES, FRAMES, NETWORKS, Own, STATE, Saved, VERSION, buffer_name, checkpoint_path,
    checkpoints_by_steps, own_name, parse,
};
use super::load::header;
use crate::archive::Archive;
use crate::learn::error::{CheckpointError as Error, TrainError};
use crate::learn::run::collecting::CollectedEnv;
use crate::learn::run::demonstrated::Demonstrated;
use crate::learn::run::env::LearnEnv;
use crate::learn::run::learner::SaveLearner;
use crate::learn::run::trainer::Trainer;
use crate::learn::run::updates::Updates;
use crate::workers::{gather_values, sum};

/// The number of checkpoints that are kept in a folder.
const KEPT: usize = 2;

impl<E: LearnEnv + SnapshotEnv> Trainer<E> {
    /// Saves a checkpoint in a folder, which it creates if needed, and removes this run's older
    /// checkpoints except the last one. Returns its path. The first process writes, and
    /// all wait for it.
    ///
    /// A run is what [`new`](Self::new) began, with everything that was [resumed](Self::resume)
    /// from it. Equal settings and seeds do not make two runs the same. Only one trainer at a time
    /// may save checkpoints in a folder.
    ///
    /// # Errors
    /// [`CheckpointError::OtherRun`](Error::OtherRun) if the folder has checkpoints of another run,
    /// or an unreadable file in the place of this one;
    /// [`CheckpointError::Unreadable`](Error::Unreadable) if no run could be resumed from this one,
    /// because your algorithm or environment has a state that cannot be read again; otherwise
    /// another [`CheckpointError`](Error). Earlier checkpoints stay whole, and none is removed.
    pub fn save(&mut self, folder: impl AsRef<Path>) -> Result<PathBuf, Error> {
        self.save_in(folder.as_ref())
    }

    // Shared as the cycle of a `RunPlan` is.
    #[inline(never)]
    fn save_in(&mut self, folder: &Path) -> Result<PathBuf, Error> {
        let path = checkpoint_path(folder, self.counters.steps);
        let failed = |source| Error::Write { path: path.clone(), source };
        let own = Own {
            explorer: self.collecting.explorer.state().clone(),
            last_batch: (self.counters.steps > 0).then(|| {
                self.collecting.explorer.last_batch(self.collecting.collector.envs().last_step())
            }),
            collector: self.collecting.collector.snapshot().map_err(Error::Envs)?,
        };
        let own = serde_json::to_vec(&own).map_err(|error| failed(error.into()))?;
        let is_first = self.workers.rank() == 0;
        let demonstrated = gather_values(&mut *self.workers, &self.replay.demonstrated)
            .map_err(TrainError::from)?;
        let others = self.gather_parts(&own).map_err(failed)?;
        let write = |trainer: &mut Self| trainer.write(folder, &path, demonstrated, &own, &others);
        let written = if is_first { write(self) } else { Ok(()) };
        let num_failed = sum(&mut *self.workers, u64::from(written.is_err()));
        written?;
        if num_failed.map_err(TrainError::from)? > 0 {
            return Err(failed(io::Error::other("the first process could not write it")));
        }
        self.last_checkpoint = Some(path.clone());
        Ok(path)
    }

    /// Returns the state and the buffer of each other process in the first process, and nothing in
    /// the others.
    fn gather_parts(&mut self, own: &[u8]) -> io::Result<Vec<[Vec<u8>; 2]>> {
        let (mut states, mut buffer) = (Vec::new(), Vec::new());
        if self.workers.rank() > 0 {
            states.extend_from_slice(own);
            self.replay.buffer.write_to(&mut buffer)?;
        }
        let states = self.workers.gather_first(states);
        let buffers = self.workers.gather_first(buffer);
        Ok(states.into_iter().zip(buffers).skip(1).map(|(state, buffer)| [state, buffer]).collect())
    }

    /// Writes a checkpoint and removes those that it makes obsolete.
    fn write(
        &mut self,
        folder: &Path,
        path: &Path,
        demonstrated: Vec<Demonstrated>,
        own: &[u8],
        others: &[[Vec<u8>; 2]],
    ) -> Result<(), Error> {
        let unreadable = |reason| Error::Unreadable { path: path.to_owned(), reason };
        let (steps, run_id) = (self.counters.steps, self.run_id);
        check_folder(folder, steps, run_id)?;
        let parts = self.parts(demonstrated, own, others).map_err(unreadable)?;
        write_checkpoint(folder, steps, run_id, |archive| {
            archive.part(STATE)?.write_all(&parts.state)?;
            archive.part(NETWORKS)?.write_all(&parts.networks)?;
            archive.part(ENVIRONMENT)?.write_all(&parts.environment)?;
            archive.part(&own_name(0))?.write_all(parts.own)?;
            if let (Some(eyes), Some(networks)) = (&self.eyes, &parts.eyes) {
                archive.part(EYES)?.write_all(networks)?;
                let last = self.collecting.collector.envs().last_step();
                eyes.write_memory((steps > 0).then_some(last), archive.part(FRAMES)?)?;
            }
            self.replay.buffer.write_to(archive.part(&buffer_name(0))?)?;
            for (rank, [state, buffer]) in (1..).zip(parts.others) {
                archive.part(&own_name(rank))?.write_all(state)?;
                archive.part(&buffer_name(rank))?.write_all(buffer)?;
            }
            Ok(())
        })
    }

    /// Returns the parts of a checkpoint except the buffer, or why no run could be resumed from
    /// them: they are read as a resumed run reads them. A buffer takes nothing that it cannot read.
    fn parts<'a>(
        &mut self,
        demonstrated: Vec<Demonstrated>,
        own: &'a [u8],
        others: &'a [[Vec<u8>; 2]],
    ) -> Result<Parts<'a>, String> {
        let Updates { algorithm, form, .. } = &mut self.updates;
        let state = algorithm.state_mut();
        let (num_updates, networks) = (*state.num_updates, form.write(state.vectors)?);
        let eyes = self.eyes.as_mut().map(|eyes| eyes.state()).transpose()?;
        let (of_eyes, eyes) = eyes.unzip();
        let saved = Saved {
            version: VERSION,
            run_id: self.run_id,
            settings: self.settings.clone(),
            seed: self.seed,
            num_ranks: self.workers.size(),
            counters: self.counters,
            recent: self.recent.clone(),
            rows: self.rows.clone(),
            rest: self.rest,
            inputs: self.replay.inputs.clone(),
            num_updates,
            demonstrated,
            eyes: of_eyes,
        };
        let state = json(&saved)?;
        parse(&state)?;
        let goal_len = self.replay.buffer.config().dims().goal;
        let environment = json(&EnvMark::of(&self.replay.template, goal_len))?;
        EnvMark::read(&environment)?.check(&mut self.replay.template, goal_len)?;
        for own in std::iter::once(own).chain(others.iter().map(|[state, _]| &state[..])) {
            Own::<<CollectedEnv<E> as SnapshotEnv>::Snapshot>::read(own)?;
        }
        Ok(Parts { state, networks, environment, eyes, own, others })
    }
}

impl<E: LearnEnv + SnapshotEnv> SaveLearner for Trainer<E> {
    fn save(&mut self, folder: &Path) -> Result<PathBuf, Error> {
        self.save_in(folder)
    }
}

/// The parts of a checkpoint except the buffer of the first process.
struct Parts<'a> {
    state: Vec<u8>,
    networks: Vec<u8>,
    environment: Vec<u8>,
    /// The networks of an actor that sees pictures.
    eyes: Option<Vec<u8>>,
    own: &'a [u8],
    others: &'a [[Vec<u8>; 2]],
}

/// Writes a checkpoint of a run that has taken `steps` steps, and removes those that it makes
/// obsolete.
pub(crate) fn write_checkpoint(
    folder: &Path,
    steps: u64,
    run_id: u64,
    write: impl FnOnce(&mut Archive<'_>) -> io::Result<()>,
) -> Result<(), Error> {
    let path = checkpoint_path(folder, steps);
    let failed = |source| Error::Write { path: path.clone(), source };
    let older = check_folder(folder, steps, run_id)?;
    // Only this run's unfinished checkpoints have the mark.
    let mark = format!("{run_id:016x}");
    // What a killed process of this run has left.
    files::remove_unfinished(folder, &mark).map_err(failed)?;
    let written = files::replace_marked(&path, &mark, |file| {
        let mut archive = Archive::new(file);
        write(&mut archive)?;
        archive.finish()
    });
    written.map_err(failed)?;
    let stale = older.len().saturating_sub(KEPT - 1);
    for path in &older[..stale] {
        match fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            _ => {}
        }
    }
    Ok(())
}

/// Creates a folder if needed, and returns its checkpoints of a run before `steps` steps, oldest
/// first. One that cannot be read stays as it is.
fn check_folder(folder: &Path, steps: u64, run_id: u64) -> Result<Vec<PathBuf>, Error> {
    let path = checkpoint_path(folder, steps);
    fs::create_dir_all(folder).map_err(|source| Error::Write { path: path.clone(), source })?;
    let mut older = Vec::new();
    let all = checkpoints_by_steps(folder)
        .map_err(|source| Error::Read { path: folder.to_owned(), source })?;
    for (number, other) in all {
        match header(&other) {
            Ok(header) if header.version == VERSION && header.run_id == run_id => {
                if number < steps {
                    older.push(other);
                }
            }
            Err(_) if other != path => {}
            _ => return Err(Error::OtherRun { path: other }),
        }
    }
    Ok(older)
}

pub(crate) fn json(value: &impl Serialize) -> Result<Vec<u8>, String> {
    serde_json::to_vec(value).map_err(|error| error.to_string())
}
