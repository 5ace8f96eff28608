//! Writing data sets.

use std::path::PathBuf;

use baselines::datasets::{
    About, DatasetError, DatasetWriter, MinariWriter, OgBenchWriter, SetKind, SetPolicy,
    write_replay, write_set,
};
use baselines::learn::TrainSettings;
use fetch_env::{EnvId, make};
use pyo3::prelude::*;

use crate::config::Config;
use crate::error::{Error, Result};

/// The set of a training run's own episodes, and what acts in it.
const REPLAY: &str = "replay";
const REPLAYED: &str = "a policy that DDPG with hindsight trains";

/// Writes a data set, and returns the summary of its episodes as JSON.
#[pyfunction]
pub(crate) fn write_dataset(
    py: Python<'_>,
    config: &Config,
    set: &str,
    format: &str,
    folder: PathBuf,
    episodes: usize,
    seed: u64,
    snapshots: bool,
) -> Result<String> {
    let kind = SetKind::ALL.into_iter().find(|kind| kind.name() == set);
    if kind.is_none() && set != REPLAY {
        let names = SetKind::ALL.map(SetKind::name).join(", ");
        let message = format!("there is no set {set}: choose from {names}, {REPLAY}");
        return Err(Error::value(message));
    }
    let config = config.config.clone();
    let written = py.detach(|| -> Result<_> {
        let task = config.task();
        let env_id = EnvId { task, reward: config.distance_reward().kind() };
        let mut env = make(config.clone())?;
        let policy = kind.map(|kind| SetPolicy::new(kind, &env)).transpose();
        let mut policy = policy.map_err(Error::chain)?;
        let describe = policy.as_ref().map_or(REPLAYED, SetPolicy::describe);
        let about = About::new(&About::name_of(env_id, set), &env, describe, "");
        let about = about.map_err(Error::chain)?;
        let mut writers = [writer(format, folder, about, snapshots)?];
        let evaluation = match &mut policy {
            Some(policy) => write_set(&mut env, policy, episodes, seed, &mut writers, |_| ())
                .map_err(of_writing)?,
            None => {
                let make = || Ok(make(config.clone())?);
                let settings = TrainSettings::fast(task);
                write_replay(make, settings, seed, episodes, &mut writers, |_| ())
                    .map_err(Error::chain)?
            }
        };
        writers.into_iter().try_for_each(DatasetWriter::finish).map_err(Error::chain)?;
        evaluation.summary().map_err(Error::chain)
    })?;
    Ok(serde_json::to_string(&written)?)
}

/// Begins a data set.
fn writer(
    format: &str,
    folder: PathBuf,
    about: About,
    snapshots: bool,
) -> Result<Box<dyn DatasetWriter>> {
    match format {
        "minari" => {
            let writer = MinariWriter::create(folder, about).map_err(Error::chain)?;
            Ok(Box::new(if snapshots { writer.with_snapshots() } else { writer }))
        }
        "ogbench" if snapshots => Err(Error::value("only the format minari has snapshots")),
        "ogbench" => Ok(Box::new(OgBenchWriter::create(folder, about).map_err(Error::chain)?)),
        other => {
            Err(Error::value(format!("there is no format {other}: choose from minari, ogbench")))
        }
    }
}

fn of_writing(error: DatasetError) -> Error {
    match error {
        DatasetError::Environment { source, .. } => source.into(),
        error => Error::chain(error),
    }
}
