//! Data sets of the episodes that a training run collects.

use std::cell::Cell;
use std::sync::mpsc::{Sender, channel};

use fetch_env::wrappers::{KeepsGoals, Resetting, Wrapper};
use fetch_env::{
    BoxSpace, EnvError, EnvExt, FetchObservation, FetchResetOptions, Info, Reset, Space, Step,
};
use rand::Rng;

use super::episode::EpisodeRecord;
use super::error::DatasetError;
use super::writer::{DatasetWriter, record_for};
use crate::evaluate::{Episode, Evaluation};
use crate::learn::{TrainError, TrainSettings, Trainer};
use crate::on_mujoco::OnMujoco;
use crate::reset_seeds::ResetSeeds;

/// Error returned by [`write_replay`].
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The run failed.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// An episode could not be recorded or written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}

debug_as_display!(ReplayError);

/// Trains on environments that `make` makes, writes the first `count` episodes that the run
/// collects, from random ones to those of the learned policy, with all writers, and calls
/// `progress` after each. It does not finish the writers.
///
/// Each episode is reset with its own seed, which its record contains. Otherwise the run is that of
/// a [`Trainer`], in which each episode continues the random numbers of the last. The episodes are
/// the same for the same settings and seed.
///
/// # Errors
/// [`ReplayError`].
///
/// ```no_run
/// # #[cfg(feature = "ogbench")] {
/// use baselines::datasets::{Metadata, DatasetWriter, OgBenchWriter, write_replay};
/// use baselines::learn::TrainSettings;
/// use fetch_env::{Task, make};
///
/// let make = || Ok(make("FetchPush-v4")?);
/// let metadata = Metadata::new("fetch/push/replay-v0", &make()?, "a run of DDPG", "")?;
/// let writer = OgBenchWriter::create("data", metadata)?;
/// let mut writers: [Box<dyn DatasetWriter>; 1] = [Box::new(writer)];
/// let settings = TrainSettings::fast(Task::Push);
/// write_replay(make, settings, 0, 2_000, &mut writers, |_| ())?;
/// writers.into_iter().try_for_each(|writer| writer.finish())?;
/// # }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_replay<E: OnMujoco + Send + 'static>(
    make: impl Fn() -> Result<E, EnvError>,
    settings: TrainSettings,
    seed: u64,
    count: usize,
    writers: &mut [Box<dyn DatasetWriter>],
    mut progress: impl FnMut(&Episode),
) -> Result<Evaluation, ReplayError> {
    let (sender, receiver) = channel();
    let number = Cell::new(0);
    let keeping = || {
        number.set(number.get() + 1);
        let record = record_for(writers);
        make()?.wrap(Keeping::new(number.get(), record, sender.clone()))
    };
    let mut trainer = Trainer::new(keeping, settings, seed, 1)?;
    let mut episodes = Vec::new();
    while episodes.len() < count {
        trainer.cycle()?;
        let mut kept: Vec<Kept> = receiver.try_iter().collect();
        // The episodes of one environment stay in the order of time.
        kept.sort_by_key(|kept| kept.env);
        kept.truncate(count - episodes.len());
        for Kept { record, episode, .. } in kept {
            for writer in &mut *writers {
                writer.write(&record)?;
            }
            progress(&episode);
            episodes.push(episode);
        }
    }
    Ok(Evaluation { episodes })
}

/// An episode of a run.
struct Kept {
    /// The number of its environment.
    env: usize,
    record: EpisodeRecord,
    episode: Episode,
}

/// A wrapper that resets an environment with a seed for each episode, and sends finished episodes.
struct Keeping {
    env: usize,
    seeds: ResetSeeds,
    record: EpisodeRecord,
    episode: Episode,
    sender: Sender<Kept>,
}

impl Keeping {
    fn new(env: usize, record: EpisodeRecord, sender: Sender<Kept>) -> Self {
        Self { env, seeds: ResetSeeds::default(), record, episode: Episode::new(None), sender }
    }
}

impl<E: OnMujoco> Wrapper<E> for Keeping {
    type Observation = FetchObservation;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> Result<Reset<FetchObservation, Info>, EnvError> {
        let seeds = self.seeds.after(seed);
        let seed = seed.unwrap_or_else(|| seeds.rng().next_u64());
        let reset = env.reset_with(Some(seed), options)?;
        self.seeds = seeds;
        self.episode = Episode::new(Some(seed));
        self.record.start(&**env, seed, &reset);
        Ok(reset)
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[f32],
    ) -> Result<Step<FetchObservation, Info>, EnvError> {
        let step = env.step(action)?;
        self.record.step(env, action, &step);
        self.episode.add(step.reward, &step.info);
        if step.is_last() {
            let (record, episode) = (self.record.clone(), self.episode.clone());
            // Nobody waits for the episodes of an environment that outlives the run.
            let _ = self.sender.send(Kept { env: self.env, record, episode });
        }
        Ok(step)
    }

    fn action_space<'a>(&'a self, env: &'a E) -> &'a BoxSpace<f32> {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        env.observation_space()
    }
}

impl KeepsGoals for Keeping {
    const KEEPS_SYMMETRIES: bool = true;
}
