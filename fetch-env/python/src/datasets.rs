//! The policies of data sets, and writing them.

use std::path::PathBuf;

use baselines::{
    Evaluation, Policy,
    datasets::{
        DatasetWriter, EpisodeRecord, Metadata, MinariWriter, OgBenchWriter, SetKind, SetPolicy,
    },
};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::acting::Acting;
use crate::config::{ACTION_LEN, Config};
use crate::env::Env;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::task::{self, Own};
use crate::warnings::simulate;

/// Writes a data set, and returns the summary of its episodes as JSON. `set` is the name of a policy,
/// or that of `policy`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the Python function has as many")]
pub(crate) fn write_dataset(
    py: Python<'_>,
    config: &Config,
    set: &str,
    policy: Option<&Bound<'_, PyAny>>,
    batched: bool,
    format: &str,
    folder: PathBuf,
    episodes: Integer<usize>,
    seed: Integer<u64>,
    snapshots: bool,
) -> Result<String> {
    let acting = policy.map(|policy| Acting::take(policy, batched)).transpose()?;
    let (config, id, own) = (config.config.clone(), config.id, config.own(false));
    let (Integer(episodes), Integer(seed)) = (episodes, seed);
    let path = folder.clone();
    let written = simulate(py, || -> Result<_> {
        let mut env = task::make(config, own.as_ref())?.time_limited();
        let mut actor = match acting {
            Some(acting) => Actor::Given(acting),
            None => {
                let policy = SetPolicy::new(kind_of(set)?, &env).map_err(Error::chain)?;
                Actor::Named(Box::new(policy))
            }
        };
        let policy = match &actor {
            Actor::Given(_) => format!("the policy {set}"),
            Actor::Named(policy) => policy.describe().to_owned(),
        };
        let metadata = match &own {
            None => Metadata::new(&Metadata::name_of(id, set), &env, policy, ""),
            Some(Own { task, .. }) => {
                let name = Metadata::name_of_own(task.name(), set);
                Metadata::of_own_task(&name, task.name(), &env, policy, "")
            }
        };
        let mut writer = writer(format, folder, metadata.map_err(Error::chain)?, snapshots)?;
        let mut record = EpisodeRecord::default();
        if snapshots {
            record = record.with_snapshots();
        }
        let mut evaluation = Evaluation { episodes: Vec::new() };
        for seed in (0..episodes as u64).map(|episode| seed.wrapping_add(episode)) {
            // Ctrl-C is an error like others: the writers remove what they have written.
            Python::attach(|py| py.check_signals())?;
            let recorded = match &mut actor {
                Actor::Given(policy) => {
                    let recorded = record.record(&mut env, policy, seed).map_err(Error::chain);
                    policy.or_error(recorded)
                }
                Actor::Named(policy) => {
                    policy.begin(seed);
                    record.record(&mut env, &mut **policy, seed).map_err(Error::chain)
                }
            };
            own.as_ref().map_or(Ok(()), |own| own.task.check())?;
            let episode = recorded?;
            writer.write(&record).map_err(Error::chain)?;
            evaluation.episodes.push(episode);
        }
        writer.finish().map_err(Error::chain)?;
        evaluation.summary().map_err(Error::chain)
    });
    let written = written.map_err(|error| error.at(&path))?;
    Ok(serde_json::to_string(&written)?)
}

/// Who acts in a data set.
enum Actor {
    Given(Acting),
    Named(Box<SetPolicy>),
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
        config.check_built_in("pass a policy of your own")?;
        let kind = kind_of(name)?;
        let config = config.config.clone();
        let env = simulate(py, || task::make(config, None))?.time_limited();
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
