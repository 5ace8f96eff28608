//! Data sets of training runs.

use std::collections::BTreeSet;
use std::fs;
use std::sync::{Arc, Mutex};

use baselines::Evaluation;
use baselines::datasets::{
    DatasetError, DatasetWriter, EpisodeRecord, Metadata, OgBenchWriter, ReplayError, write_replay,
};
use baselines::learn::{AlgorithmSettings, DdpgSettings, TrainSettings};
use fetch_env::{FetchObservation, Task, make};

use crate::Result;

/// Settings that learn nothing, but do so quickly.
fn settings() -> TrainSettings {
    let mut settings = TrainSettings::fast(Task::Slide);
    let hidden = vec![8, 8];
    settings.algorithm =
        AlgorithmSettings::Ddpg(DdpgSettings { hidden, ..DdpgSettings::default() });
    settings.replay.batch_size = 16;
    settings.exploration.random_episodes = 6;
    settings.schedule.num_envs = 4;
    settings.schedule.updates_per_cycle = 3;
    settings
}

fn write(
    settings: TrainSettings,
    seed: u64,
    writer: Box<dyn DatasetWriter>,
) -> Result<Evaluation, ReplayError> {
    let mut writers = [writer];
    let make = || Ok(make("FetchSlide-v4")?);
    let evaluation = write_replay(make, settings, seed, 18, &mut writers, |_| ())?;
    writers.into_iter().try_for_each(|writer| writer.finish())?;
    Ok(evaluation)
}

fn metadata() -> Result<Metadata> {
    Ok(Metadata::new("fetch/slide/replay-v0", &make("FetchSlide-v4")?, "a run", "")?)
}

#[test]
fn a_run_is_the_same_bytes_again() -> Result {
    let bytes = |seed: u64| -> Result<Vec<u8>> {
        let folder = tempfile::tempdir()?;
        let writer = OgBenchWriter::create(folder.path(), metadata()?)?;
        let evaluation = write(settings(), seed, Box::new(writer))?;
        assert_eq!(evaluation.episodes.len(), 18);
        let name = "fetch-slide-replay-v0";
        Ok(fs::read(folder.path().join(name).join(format!("{name}.npz")))?)
    };
    let first = bytes(3)?;
    assert!(bytes(3)? == first);
    assert!(bytes(4)? != first);
    Ok(())
}

/// A writer that keeps the episodes.
#[derive(Default)]
struct Keep(Arc<Mutex<Vec<EpisodeRecord>>>);

impl DatasetWriter for Keep {
    fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        self.0.lock().expect("no thread panics").push(episode.clone());
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        Ok(())
    }
}

#[test]
fn each_episode_is_that_of_its_seed_and_its_actions() -> Result {
    let keep = Keep::default();
    let records = Arc::clone(&keep.0);
    write(settings(), 3, Box::new(keep))?;
    let records = records.lock().expect("no thread panics");
    let seeds: BTreeSet<u64> = records.iter().map(|record| record.seed).collect();
    assert_eq!(seeds.len(), 18);
    let mut env = make("FetchSlide-v4")?;
    for record in &*records {
        let mut actions = record.actions.chunks(4);
        let mut replay = |_: &FetchObservation, action: &mut [f32]| {
            action.copy_from_slice(actions.next().unwrap_or(&[f32::NAN; 4]));
        };
        let mut again = EpisodeRecord::default();
        again.record(&mut env, &mut replay, record.seed)?;
        assert_eq!(&again, record);
    }
    Ok(())
}
