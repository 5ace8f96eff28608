//! The policies of data sets, and writing them.

use std::path::PathBuf;

use baselines::{
    Evaluation, Policy,
    datasets::{
        DatasetWriter, Metadata, MinariWriter, OgBenchWriter, SetKind, SetPolicy, write_set,
    },
};
use fetch_env::{EnvId, make};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::config::{ACTION_LEN, Config};
use crate::env::Env;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::warnings::simulate;

/// Writes a data set, and returns the summary of its episodes as JSON.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the Python function has as many")]
pub(crate) fn write_dataset(
    py: Python<'_>,
    config: &Config,
    set: &str,
    format: &str,
    folder: PathBuf,
    episodes: Integer<usize>,
    seed: Integer<u64>,
    snapshots: bool,
) -> Result<String> {
    let kind = kind_of(set)?;
    let config = config.config.clone();
    let (Integer(episodes), Integer(seed)) = (episodes, seed);
    let path = folder.clone();
    let written = simulate(py, || -> Result<_> {
        let env_id = EnvId { task: config.task(), reward: config.distance_reward().kind() };
        let mut env = make(config)?;
        let mut policy = SetPolicy::new(kind, &env).map_err(Error::chain)?;
        let name = Metadata::name_of(env_id, kind.name());
        let metadata = Metadata::new(&name, &env, policy.describe(), "").map_err(Error::chain)?;
        let mut writers = [writer(format, folder, metadata, snapshots)?];
        let mut evaluation = Evaluation { episodes: Vec::new() };
        for episode in 0..episodes as u64 {
            // Ctrl-C is an error like others: the writers remove what they have written.
            Python::attach(|py| py.check_signals())?;
            let seed = seed.wrapping_add(episode);
            let written = write_set(&mut env, &mut policy, 1, seed, &mut writers, |_| ());
            evaluation.episodes.extend(written.map_err(Error::chain)?.episodes);
        }
        writers.into_iter().try_for_each(DatasetWriter::finish).map_err(Error::chain)?;
        evaluation.summary().map_err(Error::chain)
    });
    let written = written.map_err(|error| error.at(&path))?;
    Ok(serde_json::to_string(&written)?)
}

/// Returns the kind of policy with this name.
fn kind_of(name: &str) -> Result<SetKind> {
    SetKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
        let names = SetKind::ALL.map(SetKind::name).join(", ");
        Error::value(format!("there is no policy {name}: choose from {names}"))
    })
}

/// A policy of data sets: its actions in an episode follow from the seed of the episode.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct NamedPolicy(Exclusive<SetPolicy>);

#[pymethods]
impl NamedPolicy {
    #[new]
    fn new(py: Python<'_>, config: &Config, name: &str) -> Result<Self> {
        let kind = kind_of(name)?;
        let config = config.config.clone();
        let env = simulate(py, || make(config))?;
        Ok(Self(Exclusive::new(SetPolicy::new(kind, &env).map_err(Error::chain)?)))
    }

    /// Begins the episode with a seed.
    fn begin(&self, py: Python<'_>, seed: Integer<u64>) -> Result<()> {
        let mut policy = self.0.lock(py)?;
        policy.begin(seed.0);
        Policy::<_, f32>::reset(&mut *policy);
        Ok(())
    }

    /// The action in the current state of an environment.
    fn act<'py>(&self, py: Python<'py>, env: &Env) -> Result<Bound<'py, PyArray1<f32>>> {
        let observation = env.observation(py)?;
        let mut action = [0.0; ACTION_LEN];
        self.0.lock(py)?.act(&observation, &mut action);
        Ok(PyArray1::from_slice(py, &action))
    }
}

/// Begins a data set.
fn writer(
    format: &str,
    folder: PathBuf,
    metadata: Metadata,
    snapshots: bool,
) -> Result<Box<dyn DatasetWriter>> {
    match format {
        "minari" => {
            let writer = MinariWriter::create(folder, metadata).map_err(Error::chain)?;
            Ok(Box::new(if snapshots { writer.with_snapshots() } else { writer }))
        }
        "ogbench" if snapshots => Err(Error::value("only the format minari has snapshots")),
        "ogbench" => Ok(Box::new(OgBenchWriter::create(folder, metadata).map_err(Error::chain)?)),
        other => {
            Err(Error::value(format!("there is no format {other}: choose from minari, ogbench")))
        }
    }
}
