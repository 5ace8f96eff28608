//! `robustness`: how the success of policies depends on noise, delays, physics and other factors.

use std::{fmt::Write as _, path::PathBuf, str::FromStr};

use anyhow::{Context, bail};
use baselines::robustness::{RobustnessCurve, SuccessAt};
use fetch_env::{EnvId, FetchConfig, variation::Variation};
use serde::Serialize;

use crate::output::usage;
use crate::shared::{
    episodes::{EpisodeArgs, check_variation},
    json::{Metric, write_results, write_text},
    progress,
};

/// The success rate below which a value is critical.
const CRITICAL: f64 = 0.5;

#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct Args {
    /// Environment
    #[arg(long, value_name = "ID", default_value = "FetchPush-v4")]
    env_id: EnvId,
    /// Policies, separated by commas: random, scripted, trained, zero, or files of trained ones
    #[arg(long, value_delimiter = ',', default_value = "trained")]
    policy: Vec<String>,
    /// Factor to sweep, and its values, such as observation_noise=0,0.01,0.02 or object_mass=1,2,4;
    /// can be given several times
    #[arg(long, value_name = "NAME=VALUE,...", required = true)]
    factor: Vec<Values>,
    /// Factor that has one value throughout; can be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    with: Vec<Values>,
    #[command(flatten)]
    #[serde(flatten)]
    episodes: EpisodeArgs,
    /// Also write the curves as CSV
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    csv: Option<PathBuf>,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    json: Option<PathBuf>,
}

/// A factor, and values of it.
#[derive(Clone, Debug, Serialize)]
struct Values {
    factor: String,
    values: Vec<f64>,
}

impl FromStr for Values {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (factor, values) = text.split_once('=').context("write NAME=VALUE,...")?;
        let value =
            |text: &str| text.trim().parse().with_context(|| format!("{text:?} is no number"));
        Ok(Self {
            factor: factor.into(),
            values: values.split(',').map(value).collect::<Result<_, _>>()?,
        })
    }
}

impl Args {
    /// Returns the settings of the environment in which a factor has a value.
    fn config(&self, factor: &str, value: f64) -> anyhow::Result<FetchConfig> {
        let mut variation = Variation::default();
        for with in &self.with {
            let [value] = with.values[..] else {
                bail!("--with {} has {} values: pass one", with.factor, with.values.len());
            };
            variation = variation.with(with.factor.as_str(), value)?;
        }
        let variation = variation.with(factor, value)?;
        Ok(self.episodes.config(self.env_id).with_variation(variation))
    }

    /// Checks all values before any episode runs.
    fn check(&self) -> anyhow::Result<()> {
        for Values { factor, values } in &self.factor {
            for &value in values {
                check_variation(&self.config(factor, value).map_err(usage)?)?;
            }
        }
        Ok(())
    }
}

/// The curve of a policy.
struct Measured {
    policy: String,
    curve: RobustnessCurve,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    args.check()?;
    let run = &args.episodes;
    let threads = run.threads()?;
    let values: usize = args.factor.iter().map(|factor| factor.values.len()).sum();
    let evaluations = values.saturating_mul(args.policy.len());
    let bar = progress::bar(run.episodes.get().saturating_mul(evaluations), "episodes");
    let mut measured = Vec::new();
    for Values { factor, values } in &args.factor {
        for policy in &args.policy {
            let evaluate = |value: f64| -> anyhow::Result<_> {
                run.evaluate(&args.config(factor, value)?, policy, &threads, &bar)
            };
            let curve = RobustnessCurve::measure(factor, values, evaluate)?;
            measured.push(Measured { policy: policy.clone(), curve });
        }
    }
    bar.finish_and_clear();
    print(args, &measured)?;
    if let Some(path) = &args.csv {
        write_text(path, &csv(&measured)?)?;
    }
    write_results(args.json.as_ref(), args, measured.iter().flat_map(figures))?;
    Ok(true)
}

/// Prints a table for each curve, and what sums it up.
fn print(args: &Args, measured: &[Measured]) -> anyhow::Result<()> {
    for Measured { policy, curve } in measured {
        let factor = &curve.factor;
        say!(
            "{}, {policy}, {} episodes for each value; 95 % intervals",
            args.env_id,
            args.episodes.episodes
        )?;
        say!(
            "| {factor} | success at the end | success at any time | final distance (m) |\n|---|---|---|---|"
        )?;
        for point in &curve.points {
            let [end, any, distance] = [
                point.summary.success_rate,
                point.summary.success_any_rate,
                point.summary.final_distance_mean,
            ];
            let rate = |rate: baselines::Estimate| {
                format!("{:.2} ({:.2} to {:.2})", rate.value, rate.low, rate.high)
            };
            say!("| {} | {} | {} | {:.3} |", point.value, rate(end), rate(any), distance.value)?;
        }
        for (name, at) in TIMES {
            let critical = match curve.critical_value(at, CRITICAL) {
                Some(value) => format!("below {CRITICAL} at {value}"),
                None => format!("never below {CRITICAL}"),
            };
            // One value has neither a slope nor an area.
            let sums = match curve.points.len() {
                ..2 => String::new(),
                _ => format!(", slope {:.3}, area {:.4}", curve.slope(at), curve.area(at)),
            };
            say!("success at {name}: {critical}{sums}")?;
        }
        say!("")?;
    }
    Ok(())
}

const TIMES: [(&str, SuccessAt); 2] =
    [("the end", SuccessAt::End), ("any time", SuccessAt::AnyTime)];

/// Returns all curves, a line for each value.
fn csv(measured: &[Measured]) -> anyhow::Result<String> {
    let mut text = "policy,factor,value,success_rate,success_rate_low,success_rate_high,\
                    success_any_rate,success_any_rate_low,success_any_rate_high,final_distance\n"
        .to_owned();
    for Measured { policy, curve } in measured {
        for point in &curve.points {
            let (end, any) = (point.summary.success_rate, point.summary.success_any_rate);
            let distance = point.summary.final_distance_mean.value;
            writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{distance}",
                quoted(policy),
                quoted(&curve.factor),
                point.value,
                end.value,
                end.low,
                end.high,
                any.value,
                any.low,
                any.high,
            )?;
        }
    }
    Ok(text)
}

/// Returns a field as CSV has it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}

fn figures(Measured { policy, curve }: &Measured) -> Vec<(String, Metric)> {
    let name = format!("robustness/{policy}/{}", curve.factor);
    let mut figures = Vec::new();
    for point in &curve.points {
        let name = format!("{name}/{}", point.value);
        let rate = |rate: f64| Metric::new(rate, "1");
        figures.push((format!("{name}/success_rate"), rate(point.summary.success_rate.value)));
        let any = point.summary.success_any_rate.value;
        figures.push((format!("{name}/success_any_rate"), rate(any)));
    }
    for (at, suffix) in [(SuccessAt::End, "success_rate"), (SuccessAt::AnyTime, "success_any_rate")]
    {
        figures.push((format!("{name}/{suffix}/area"), Metric::new(curve.area(at), "1")));
        figures.push((format!("{name}/{suffix}/slope"), Metric::new(curve.slope(at), "1")));
        if let Some(value) = curve.critical_value(at, CRITICAL) {
            figures.push((format!("{name}/{suffix}/critical"), Metric::new(value, "1")));
        }
    }
    figures.retain(|(_, figure)| figure.value.is_finite());
    figures
}
