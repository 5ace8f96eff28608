//! Evaluating policies.

use baselines::robustness::{RobustnessCurve, RobustnessPoint, SuccessAt};
use baselines::{AnyPolicy, PixelPolicy, Summary, evaluate_vec_while};
use fetch_env::{
    AddRenderObservation, EnvExt, FetchConfig, VecEnv, make_vec_while, vec_env::VecConfig,
};
use pyo3::prelude::*;
use serde_json::json;

use crate::acting::Acting;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::policy::Policy;
use crate::signals::Signals;
use crate::task::{self, Own, Simulated};
use crate::warnings::simulate;

/// Episodes of one policy.
struct Episodes {
    policy: Either,
    count: usize,
    seed: u64,
    threads: VecConfig,
    own: Option<Own>,
}

/// What acts on states, or on pictures.
enum Either {
    State(Acting),
    Pixels(Box<PixelPolicy>),
}

impl Either {
    fn take(policy: &Bound<'_, PyAny>, is_batched: bool) -> Result<Self> {
        if let Ok(trained) = policy.cast::<Policy>()
            && let AnyPolicy::Pixels(pixels) = trained.get().copy(policy.py())?
        {
            return Ok(Self::Pixels(pixels));
        }
        Ok(Self::State(Acting::take(policy, is_batched)?))
    }
}

impl Episodes {
    fn new(
        config: &Config,
        policy: &Bound<'_, PyAny>,
        batched: bool,
        count: Integer<usize>,
        seed: Integer<u64>,
        num_threads: Integer<usize>,
    ) -> Result<Self> {
        let threads = VecConfig::default().with_num_threads(num_threads.0);
        let policy = Either::take(policy, batched)?;
        Ok(Self { policy, count: count.0, seed: seed.0, threads, own: config.own(false) })
    }

    fn run(&mut self, config: FetchConfig, signals: &mut Signals) -> Result<Summary> {
        let Self { policy, count, seed, threads, own } = self;
        let own = own.as_ref();
        let make = |config| task::make(config, own).map(Simulated::time_limited);
        let policy = match policy {
            Either::State(policy) => policy,
            Either::Pixels(policy) => {
                let env = || {
                    let pictures = AddRenderObservation::new(policy.sight().pixels.clone());
                    make(config.clone())?.wrap(pictures)
                };
                let envs = (0..(*count).clamp(1, 16)).map(|_| env());
                let mut envs =
                    VecEnv::new(envs.collect::<std::result::Result<Vec<_>, _>>()?, *threads)?;
                let run =
                    evaluate_vec_while(&mut envs, &mut **policy, *count, *seed, || signals.go_on());
                own.map_or(Ok(()), |own| own.task.check())?;
                return run.and_then(|evaluation| evaluation.summary()).map_err(Error::chain);
            }
        };
        let most = if policy.is_batched() { 16 } else { 1 };
        let mut envs =
            make_vec_while(config, (*count).clamp(1, most), *threads, make, || signals.go_on())?;
        let run = evaluate_vec_while(&mut envs, policy, *count, *seed, || signals.go_on());
        own.map_or(Ok(()), |own| own.task.check())?;
        let run = run.and_then(|evaluation| evaluation.summary()).map_err(Error::chain);
        policy.or_error(run)
    }
}

/// Runs episodes of a policy, and returns their summary as JSON.
#[pyfunction]
pub(crate) fn evaluate(
    py: Python<'_>,
    config: &Config,
    policy: &Bound<'_, PyAny>,
    batched: bool,
    episodes: Integer<usize>,
    seed: Integer<u64>,
    num_threads: Integer<usize>,
) -> Result<String> {
    let mut episodes = Episodes::new(config, policy, batched, episodes, seed, num_threads)?;
    let mut signals = Signals::new();
    let summary = simulate(py, || episodes.run(config.config.clone(), &mut signals));
    signals.finish()?;
    Ok(serde_json::to_string(&summary?)?)
}

/// Runs episodes of a policy at each value of a factor, and returns the curve as JSON.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the Python function has as many")]
pub(crate) fn robustness(
    py: Python<'_>,
    config: &Config,
    policy: &Bound<'_, PyAny>,
    batched: bool,
    factor: &str,
    values: Vec<f64>,
    episodes: Integer<usize>,
    seed: Integer<u64>,
    num_threads: Integer<usize>,
) -> Result<String> {
    let mut episodes = Episodes::new(config, policy, batched, episodes, seed, num_threads)?;
    // A wrong value is refused before any episode.
    let configs = values.iter().map(|&value| {
        let variation = config.config.variation().clone().with(factor, value);
        Ok(config.config.clone().with_variation(variation.map_err(Error::value)?))
    });
    let mut configs = configs.collect::<Result<Vec<_>>>()?.into_iter();
    let mut signals = Signals::new();
    let curve = simulate(py, || -> Result<_> {
        let mut curve = RobustnessCurve { factor: factor.to_owned(), points: Vec::new() };
        for (&value, config) in values.iter().zip(&mut configs) {
            let summary = episodes.run(config, &mut signals)?;
            curve.points.push(RobustnessPoint { value, summary });
        }
        Ok(curve)
    });
    signals.finish()?;
    let curve = curve?;
    let points = curve.points.iter().map(|point| {
        let mut row = serde_json::to_value(point.summary)?;
        row["value"] = point.value.into();
        Ok(row)
    });
    let sums = |at| {
        let number = |number: f64| number.is_finite().then_some(number);
        json!({
            "critical_value": curve.critical_value(at, 0.5),
            "slope": number(curve.slope(at)),
            "area": number(curve.area(at)),
        })
    };
    let curve = json!({
        "factor": factor,
        "points": points.collect::<serde_json::Result<Vec<_>>>()?,
        "success": sums(SuccessAt::End),
        "success_any": sums(SuccessAt::AnyTime),
    });
    Ok(curve.to_string())
}
