//! Data sets of all that a training run sees.

use std::cell::Cell;
use std::sync::mpsc::{Sender, channel};

use fetch_env::wrappers::{KeepsGoals, Resetting, Wrapper};
use fetch_env::{
    ActionElement, Env, EnvError, EnvExt, FetchObservation, GoalObservation, MujocoEnv, Reset,
    Space, Step,
};
use rand::Rng;

use super::DatasetWriter;
use super::episode::EpisodeRecord;
use super::error::DatasetError;
use crate::evaluate::{Episode, Evaluation};
use crate::learn::seeds::ResetSeeds;
use crate::learn::{TrainError, TrainSettings, Trainer};

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
    /// An episode was another one when it was recorded.
    #[error(
        "the episode with seed {seed} ended elsewhere when it was recorded: it depends on more \
         than its seed and its actions"
    )]
    Differs {
        /// The seed of its reset.
        seed: u64,
    },
}

debug_as_display!(ReplayError);

/// Trains on environments that `make` makes, and writes the first `count` episodes that are
/// collected, from random ones to those of what was learned, with all writers; calls `progress`
/// after each. The writers have not finished then.
///
/// Each episode is reset with a seed of its own, which its record has; otherwise the run is that of
/// a [`Trainer`], whose episodes go on with the random numbers of the last.
/// The episodes are the same for the same settings and seed.
///
/// # Errors
/// [`ReplayError`].
///
/// ```no_run
/// # #[cfg(feature = "ogbench")] {
/// use baselines::datasets::{About, DatasetWriter, OgBenchWriter, write_replay};
/// use baselines::learn::TrainSettings;
/// use fetch_env::{Task, make};
///
/// let make = || Ok(make("FetchPush-v4")?);
/// let about = About::new("fetch/push/replay-v0", &make()?, "a run of DDPG", "")?;
/// let mut writers: [Box<dyn DatasetWriter>; 1] = [Box::new(OgBenchWriter::create("data", about)?)];
/// let settings = TrainSettings::fast(Task::Push);
/// write_replay(make, settings, 0, 2_000, &mut writers, |_| ())?;
/// writers.into_iter().try_for_each(|writer| writer.finish())?;
/// # }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_replay(
    make: impl Fn() -> Result<MujocoEnv, EnvError>,
    settings: TrainSettings,
    seed: u64,
    count: usize,
    writers: &mut [Box<dyn DatasetWriter>],
    mut progress: impl FnMut(&Episode),
) -> Result<Evaluation, ReplayError> {
    let mut env = make().map_err(TrainError::Make)?;
    let (sender, receiver) = channel();
    let number = Cell::new(0);
    let keeping = || {
        number.set(number.get() + 1);
        make()?.wrap(Keeping::new(number.get(), sender.clone()))
    };
    let mut trainer = Trainer::new(keeping, settings, seed, 1)?;
    let mut record = EpisodeRecord::default();
    let mut episodes = Vec::new();
    while episodes.len() < count {
        trainer.cycle()?;
        let mut kept: Vec<Kept> = receiver.try_iter().collect();
        // Of one environment they are in the order of time.
        kept.sort_by_key(|kept| kept.env);
        kept.truncate(count - episodes.len());
        for kept in kept {
            let episode = kept.record(&mut env, &mut record)?;
            for writer in &mut *writers {
                writer.write(&record)?;
            }
            progress(&episode);
            episodes.push(episode);
        }
    }
    Ok(Evaluation { episodes })
}

/// An episode of a run: what is needed to record it, and where it ended.
struct Kept {
    /// The number of its environment.
    env: usize,
    seed: u64,
    actions: Vec<f32>,
    achieved_goal: Vec<f64>,
}

impl Kept {
    /// Records the episode.
    fn record(
        &self,
        env: &mut MujocoEnv,
        record: &mut EpisodeRecord,
    ) -> Result<Episode, ReplayError> {
        let len = env.action_space().shape().iter().product();
        let mut actions = self.actions.chunks_exact(len);
        let mut policy = |_: &FetchObservation, action: &mut [f32]| {
            match actions.next() {
                Some(next) => action.copy_from_slice(next),
                // An episode that goes on has ended elsewhere, too.
                None => action.fill(0.0),
            }
        };
        let episode = record.record(env, &mut policy, self.seed)?;
        if record.actions != self.actions || !record.achieved_goals.ends_with(&self.achieved_goal) {
            return Err(ReplayError::Differs { seed: self.seed });
        }
        Ok(episode)
    }
}

/// Resets an environment with a seed for each episode, and sends the episodes that end.
struct Keeping {
    env: usize,
    sender: Sender<Kept>,
    seeds: ResetSeeds,
    /// Of the episode.
    seed: u64,
    actions: Vec<f32>,
}

impl Keeping {
    fn new(env: usize, sender: Sender<Kept>) -> Self {
        Self { env, sender, seeds: ResetSeeds::default(), seed: 0, actions: Vec::new() }
    }
}

impl Wrapper<MujocoEnv> for Keeping {
    type Observation = <MujocoEnv as Env>::Observation;
    type Info = <MujocoEnv as Env>::Info;
    type ActionSpace = <MujocoEnv as Env>::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, MujocoEnv>,
        seed: Option<u64>,
        options: &<MujocoEnv as Env>::ResetOptions,
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError> {
        let seeds = self.seeds.after(seed);
        let seed = seed.unwrap_or_else(|| seeds.rng().next_u64());
        let reset = env.reset_with(Some(seed), options)?;
        (self.seeds, self.seed) = (seeds, seed);
        self.actions.clear();
        Ok(reset)
    }

    fn step(
        &mut self,
        env: &mut MujocoEnv,
        action: &[ActionElement<MujocoEnv>],
    ) -> Result<Step<Self::Observation, Self::Info>, EnvError> {
        let step = env.step(action)?;
        self.actions.extend_from_slice(action);
        if step.is_last() {
            let actions = std::mem::take(&mut self.actions);
            let achieved_goal = step.observation.achieved_goal().to_vec();
            // Nobody waits for the episodes of an environment that outlives the run.
            let _ =
                self.sender.send(Kept { env: self.env, seed: self.seed, actions, achieved_goal });
        }
        Ok(step)
    }

    fn action_space<'a>(&'a self, env: &'a MujocoEnv) -> &'a Self::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a MujocoEnv) -> &'a Space {
        env.observation_space()
    }
}

impl KeepsGoals for Keeping {
    const KEEPS_SYMMETRIES: bool = true;
}
