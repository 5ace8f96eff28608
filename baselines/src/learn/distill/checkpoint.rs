//! Checkpoints of distilling, which are taken between rounds: no episode is unfinished.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use fetch_env::{EnvError, Info, SnapshotEnv};
use safetensors::SafeTensors;
use serde::{Deserialize, Serialize};

use super::distiller::{Columns, Distiller, Recent, SightOf};
use super::frames::Frames;
use super::settings::DistillSettings;
use crate::learn::checkpoint::environment::EnvMark;
use crate::learn::checkpoint::format::{
    ENVIRONMENT, NETWORKS, STATE, VERSION, check_counts, checkpoint_path,
};
use crate::learn::checkpoint::load::CheckpointFile;
use crate::learn::checkpoint::save::{json, write_checkpoint};
use crate::learn::error::CheckpointError as Error;
use crate::learn::run::curve::{Counters, CurveRow};
use crate::learn::run::env::LearnEnv;
use crate::learn::run::inputs::Inputs;
use crate::learn::run::learner::SaveLearner;
use crate::policy::VecPolicy;
use crate::trained::file::{from_bytes, to_bytes};

/// The states with the teacher's actions.
const FRAMES: &str = "frames.bytes";

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
    /// The bytes of a picture.
    picture_len: usize,
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
            picture_len: self.frames.pictures.len() / self.frames.len().max(1),
        };
        let state = json(&saved).map_err(unreadable)?;
        let environment = json(&EnvMark::of(&self.template, self.dims.goal)).map_err(unreadable)?;
        let vectors = vectors_mut(self);
        let tensors =
            vectors.iter().map(|(name, vector)| (name.clone(), vec![vector.len()], vector));
        let tensors = tensors.map(|(name, shape, vector)| (name, shape, vector.as_slice()));
        let networks = to_bytes(tensors.collect(), None);
        let networks = networks.map_err(|error| unreadable(error.to_string()))?;
        write_checkpoint(folder, steps, run_id, |archive| {
            archive.part(STATE)?.write_all(&state)?;
            archive.part(NETWORKS)?.write_all(&networks)?;
            archive.part(ENVIRONMENT)?.write_all(&environment)?;
            let Frames { pictures, observation, achieved_goal, desired_goal, action, .. } =
                &self.frames;
            let part = archive.part(FRAMES)?;
            part.write_all(pictures)?;
            for number in [observation, achieved_goal, desired_goal].into_iter().flatten() {
                part.write_all(&number.to_le_bytes())?;
            }
            action.iter().try_for_each(|number| part.write_all(&number.to_le_bytes()))
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
        if saved.sight != own.sight {
            let sees = saved.sight.map_or("no pictures".to_owned(), |sight| sight.to_string());
            return Err(Error::OtherSight { path, sees });
        }
        let foreign = |reason: String| Error::Foreign { path: path.clone(), reason };
        let environment = file.entry(ENVIRONMENT)?;
        EnvMark::read(&environment)
            .and_then(|mark| mark.check(&mut own.template, own.dims.goal))
            .map_err(foreign)?;
        if saved.inputs.dim() != own.inputs.dim() || saved.columns != own.columns {
            return Err(foreign("its student sees other numbers".to_owned()));
        }
        let networks = file.entry(NETWORKS)?;
        let tensors =
            SafeTensors::deserialize(&networks).map_err(|error| file.damaged(error.to_string()))?;
        for (name, vector) in vectors_mut(&mut own) {
            let tensor = tensors.tensor(&name).map_err(|error| file.damaged(error.to_string()))?;
            if tensor.data().len() != 4 * vector.len() {
                return Err(foreign("a network does not fit".to_owned()));
            }
            vector.clear();
            vector.extend(from_bytes(tensor.data()));
        }
        own.frames.total = saved.frames;
        let (rows, dims) = (own.frames.len(), own.dims);
        let bytes = file.entry(FRAMES)?;
        let doubles = rows * (dims.observation + 2 * dims.goal);
        let len = [rows * saved.picture_len, 8 * doubles, 4 * rows * dims.action];
        if bytes.len() != len.iter().sum::<usize>() {
            return Err(file.damaged("it has states of another length".to_owned()));
        }
        let (pictures, bytes) = bytes.split_at(len[0]);
        let (states, actions) = bytes.split_at(len[1]);
        let (states, _) = states.as_chunks::<8>();
        let mut states = states.iter().map(|number| f64::from_le_bytes(*number));
        own.frames.pictures = pictures.to_vec();
        own.frames.observation = states.by_ref().take(rows * dims.observation).collect();
        own.frames.achieved_goal = states.by_ref().take(rows * dims.goal).collect();
        own.frames.desired_goal = states.collect();
        own.frames.action = from_bytes(actions).collect();
        own.run_id = saved.run_id;
        own.counters = saved.counters;
        own.recent = saved.recent;
        own.rows = saved.rows;
        own.inputs = saved.inputs;
        own.last_checkpoint = Some(path);
        Ok(own)
    }
}

/// Returns all that was learned, each vector with its name.
fn vectors_mut<E: LearnEnv>(distiller: &mut Distiller<E>) -> BTreeMap<String, &mut Vec<f32>> {
    let student = &mut distiller.student;
    let learning = student.learning.vectors_mut().into_iter();
    let averaged = student.averaged.vectors_mut().into_iter();
    let adam = student.adam.vectors_mut().into_iter();
    let learning = learning.chain(adam).map(|(name, vector)| (format!("learning.{name}"), vector));
    learning.chain(averaged.map(|(name, vector)| (format!("averaged.{name}"), vector))).collect()
}
