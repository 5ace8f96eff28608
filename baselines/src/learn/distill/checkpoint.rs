//! Checkpoints of distilling, which are taken between rounds: no episode is unfinished.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use fetch_env::{EnvError, Info, SnapshotEnv};
use serde::{Deserialize, Serialize};

use super::distiller::{Columns, Distiller, Recent};
use super::settings::DistillSettings;
use crate::learn::algorithm::state_file::StateFault;
use crate::learn::checkpoint::environment::EnvMark;
use crate::learn::checkpoint::format::{
    ENVIRONMENT, FRAMES, NETWORKS, STATE, VERSION, check_counts, check_sight, checkpoint_path,
};
use crate::learn::checkpoint::load::CheckpointFile;
use crate::learn::checkpoint::save::{json, write_checkpoint};
use crate::learn::error::CheckpointError as Error;
use crate::learn::run::curve::{Counters, CurveRow};
use crate::learn::run::env::LearnEnv;
use crate::learn::run::eyes::SightOf;
use crate::learn::run::inputs::Inputs;
use crate::learn::run::learner::SaveLearner;
use crate::policy::VecPolicy;

/// The state of a run, except its networks and its frames.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    version: u32,
    run_id: u64,
    settings: DistillSettings,
    seed: u64,
    counters: Counters,
    recent: Recent,
    rows: Vec<CurveRow>,
    inputs: Inputs,
    /// The number of all states so far.
    frames: u64,
    /// The places of the numbers that the student sees.
    columns: Columns,
    /// What a student that sees pictures sees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sight: Option<SightOf>,
}

impl<E: LearnEnv<Info: AsRef<Info>> + SnapshotEnv> SaveLearner for Distiller<E> {
    fn save(&mut self, folder: &Path) -> Result<PathBuf, Error> {
        Self::save(self, folder)
    }
}

impl<E: LearnEnv<Info: AsRef<Info>> + SnapshotEnv> Distiller<E> {
    /// Saves a checkpoint in a folder, which it creates if needed, and removes this run's older
    /// checkpoints except the last one. Returns its path. It has all states that are kept.
    ///
    /// # Errors
    /// As [`Trainer::save`](crate::learn::Trainer::save).
    pub fn save(&mut self, folder: impl AsRef<Path>) -> Result<PathBuf, Error> {
        let (folder, steps, run_id) = (folder.as_ref(), self.counters.steps, self.run_id);
        let path = checkpoint_path(folder, steps);
        let unreadable = |reason| Error::Unreadable { path: path.clone(), reason };
        let saved = Saved {
            version: VERSION,
            run_id,
            settings: self.settings.clone(),
            seed: self.seed,
            counters: self.counters,
            recent: self.recent,
            rows: self.rows.clone(),
            inputs: self.inputs.clone(),
            frames: self.frames.total,
            columns: self.columns.clone(),
            sight: self.sight.clone(),
        };
        let state = json(&saved).map_err(unreadable)?;
        let environment = json(&EnvMark::of(&self.template, self.dims.goal)).map_err(unreadable)?;
        let networks = self.student.write().map_err(unreadable)?;
        write_checkpoint(folder, steps, run_id, |archive| {
            archive.part(STATE)?.write_all(&state)?;
            archive.part(NETWORKS)?.write_all(&networks)?;
            archive.part(ENVIRONMENT)?.write_all(&environment)?;
            self.frames.write_to(archive.part(FRAMES)?)
        })?;
        self.last_checkpoint = Some(path.clone());
        Ok(path)
    }

    /// Continues the run of the last checkpoint in a folder, with the same teacher, on environments
    /// that `make` makes in the same way as those of the run. It ends with the same bits as a run
    /// that was never stopped.
    ///
    /// # Errors
    /// As [`Trainer::resume`](crate::learn::Trainer::resume).
    pub fn resume(
        make: impl Fn() -> Result<E, EnvError>,
        teacher: Box<dyn VecPolicy<E::Observation, E::Info> + Send>,
        folder: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, Error> {
        Self::resume_with(folder.as_ref(), |settings, seed| {
            Ok(Self::new(make, teacher, settings, seed, num_threads)?)
        })
    }

    /// Continues a run with the distiller that `build` makes from the settings and the seed.
    pub(super) fn resume_with(
        folder: &Path,
        build: impl FnOnce(DistillSettings, u64) -> Result<Self, Error>,
    ) -> Result<Self, Error> {
        let mut file = CheckpointFile::open(folder, 1)?;
        let state = file.entry(STATE)?;
        let saved: Saved =
            serde_json::from_slice(&state).map_err(|error| file.damaged(error.to_string()))?;
        let counts = check_counts(saved.counters.counts());
        counts
            .and(check_counts([("states", saved.frames)]))
            .map_err(|reason| file.damaged(reason))?;
        let mut own = build(saved.settings, saved.seed)?;
        let path = file.path.clone();
        check_sight(&path, saved.sight.as_ref(), own.sight.as_ref())?;
        let foreign = |reason: String| Error::Foreign { path: path.clone(), reason };
        let environment = file.entry(ENVIRONMENT)?;
        EnvMark::read(&environment)
            .and_then(|mark| mark.check(&mut own.template, own.dims.goal))
            .map_err(foreign)?;
        if saved.inputs.dim() != own.inputs.dim() || saved.columns != own.columns {
            return Err(foreign("its student sees other numbers".to_owned()));
        }
        let networks = file.entry(NETWORKS)?;
        own.student.restore(&networks).map_err(|fault| match fault {
            StateFault::Damaged(reason) => file.damaged(reason),
            StateFault::Foreign(reason) => foreign(reason),
        })?;
        let (picture_len, dims) = (own.student.picture_len(), own.dims);
        let memory = file.entry(FRAMES)?;
        let rest = own.frames.read(saved.frames, picture_len, dims, &memory);
        if rest.is_none_or(|rest| !rest.is_empty()) {
            return Err(file.damaged("it has states of another length".to_owned()));
        }
        own.run_id = saved.run_id;
        own.counters = saved.counters;
        own.recent = saved.recent;
        own.rows = saved.rows;
        own.inputs = saved.inputs;
        own.last_checkpoint = Some(path);
        Ok(own)
    }
}
