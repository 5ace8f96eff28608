//! Writing one data set in all formats that are asked for.

use std::path::Path;

use baselines::{
    Episode, Evaluation,
    datasets::{About, SetKind, SetPolicy, write_set},
};
use fetch_env::{EnvId, make};
use indicatif::ProgressBar;

use super::format::{Contents, Format};
use crate::shared::choice::ModelChoice;

/// A data set to write.
#[derive(Clone, Copy, Debug)]
pub struct Set {
    pub env_id: EnvId,
    pub kind: SetKind,
    pub model: ModelChoice,
    pub episodes: usize,
    pub first_seed: u64,
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
    /// Writes the set below a folder, which has one for each format.
    pub fn write(
        self,
        out: &Path,
        formats: &[Format],
        command: &str,
        bar: &ProgressBar,
    ) -> anyhow::Result<Written> {
        let mut env = make(self.env_id.config().with_model(self.model.source()))?;
        let mut policy = SetPolicy::new(self.kind, &env)?;
        let name = About::name_of(self.env_id, self.kind.name());
        let about = About::new(&name, &env, policy.describe(), command)?;
        let mut writers = Vec::new();
        for format in formats {
            writers.push(format.create(&format.root(out), about.clone())?);
        }
        let progress = |episode: &Episode| bar.inc(episode.episode_length as u64);
        let (count, seed) = (self.episodes, self.first_seed);
        let evaluation = write_set(&mut env, &mut policy, count, seed, &mut writers, progress)?;
        writers.into_iter().try_for_each(|writer| writer.finish())?;
        let mut contents = Vec::new();
        for format in formats {
            contents.push((*format, Contents::of(&format.folder(&format.root(out), &name))?));
        }
        let steps = evaluation.episodes.iter().map(|episode| episode.episode_length).sum();
        Ok(Written { set: self, steps, evaluation, contents })
    }
}
