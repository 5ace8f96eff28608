//! Writing one data set in all chosen formats.

use std::{
    io,
    path::{Path, PathBuf},
};

use baselines::{
    Episode, Evaluation,
    datasets::{
        DatasetError, DatasetWriter, EpisodeRecord, SetKind, SetPolicy, write_replay, write_set,
    },
    learn::TrainSettings,
};
use fetch_env::EnvId;
use indicatif::ProgressBar;

use super::format::{Contents, Format};
use crate::shared::{choice::ModelChoice, signals::Signals, tasks::Tasks};

/// The source of the episodes of a data set.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Episodes of a policy.
    Acting(SetKind),
    /// Episodes of a training run.
    Replay,
}

impl Kind {
    /// Returns all kinds.
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        SetKind::ALL.into_iter().map(Self::Acting).chain([Self::Replay])
    }

    /// Returns the name of the kind, as in the name of a data set.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Acting(kind) => kind.name(),
            Self::Replay => "replay",
        }
    }
}

/// A data set to write.
#[derive(Clone, Copy, Debug)]
pub struct Set {
    pub env_id: EnvId,
    pub kind: Kind,
    pub model: ModelChoice,
    pub episodes: usize,
    pub first_seed: u64,
    pub snapshots: bool,
}

/// A data set that was written.
#[derive(Debug)]
pub struct Written {
    pub set: Set,
    pub steps: usize,
    pub evaluation: Evaluation,
    pub contents: Vec<(Format, Contents)>,
}

impl Set {
    /// Writes the set below a folder, which has a folder for each format, or removes it if this
    /// process receives a signal.
    pub fn write<M: Tasks>(
        self,
        tasks: &M,
        out: &Path,
        formats: &[Format],
        command: &str,
        bar: &ProgressBar,
        signals: &Signals,
    ) -> anyhow::Result<Written> {
        let Self { env_id, kind, model, episodes: count, first_seed, snapshots } = self;
        let make = || Ok(tasks.make(env_id.config().with_model(model.source()))?);
        let mut env = make()?;
        let name = tasks.set_name(env_id, kind.name());
        let begin = |env: &M::Env, policy: &str| {
            let metadata = tasks.metadata(&name, env, policy, command)?;
            let create =
                |format: &Format| format.create(&format.root(out), metadata.clone(), snapshots);
            let mut writers = formats.iter().map(create).collect::<Result<Vec<_>, _>>()?;
            writers.push(Box::new(UntilSignal { signals: signals.clone(), out: out.to_owned() }));
            Ok::<_, DatasetError>(writers)
        };
        let progress = |episode: &Episode| bar.inc(episode.episode_length as u64);
        let (evaluation, writers) = match kind {
            Kind::Acting(kind) => {
                let mut policy = SetPolicy::new(kind, &env)?;
                let mut writers = begin(&env, policy.describe())?;
                let (policy, writing) = (&mut policy, &mut writers);
                (write_set(&mut env, policy, count, first_seed, writing, progress)?, writers)
            }
            Kind::Replay => {
                let mut writers = begin(&env, "a policy that DDPG with hindsight trains")?;
                let settings = TrainSettings::fast(env_id.task);
                let writing = &mut writers;
                (write_replay(make, settings, first_seed, count, writing, progress)?, writers)
            }
        };
        writers.into_iter().try_for_each(|writer| writer.finish())?;
        let mut contents = Vec::new();
        for format in formats {
            contents.push((*format, Contents::of(&format.folder(&format.root(out), &name))?));
        }
        let steps = evaluation.episodes.iter().map(|episode| episode.episode_length).sum();
        Ok(Written { set: self, steps, evaluation, contents })
    }
}

/// Fails at the end of the episode in which this process receives a signal, and writes nothing.
struct UntilSignal {
    signals: Signals,
    /// The folder that the other writers write to.
    out: PathBuf,
}

impl DatasetWriter for UntilSignal {
    fn write(&mut self, _episode: &EpisodeRecord) -> Result<(), DatasetError> {
        match self.signals.received() {
            0 => Ok(()),
            _ => Err(DatasetError::File {
                path: self.out.clone(),
                source: io::ErrorKind::Interrupted.into(),
            }),
        }
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        Ok(())
    }
}
