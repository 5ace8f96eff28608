//! `robustness`: how the success of policies depends on noise, delays, physics and other factors.

mod book;
mod drawing;
mod measured;
mod output;
mod page;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use baselines::robustness::RobustnessCurve;
use fetch_env::{EnvId, FetchConfig, variation::Variation};
use serde::Serialize;

use self::{
    drawing::{Curves, heat_map},
    measured::{Measured, Pair, Rates, Values, by_factor},
    page::Page,
};
use crate::figures::save;
use crate::output::usage;
use crate::shared::{
    choice::policies_of,
    episodes::{EpisodeArgs, check_variation},
    json::{write_results, write_text},
    progress,
    tasks::Tasks,
};

#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct Args {
    /// Environment
    #[arg(long, value_name = "ID", default_value = "FetchPush-v4")]
    env_id: EnvId,
    /// Policies, separated by commas: random, proportional (or proportional=GAIN), scripted,
    /// trained, robust, pixels (sees pictures), zero, files of trained ones, or folders of runs, such
    /// as those of several seeds, which give the mean over their policies
    #[arg(long, value_delimiter = ',', default_value = "trained")]
    policy: Vec<String>,
    /// Factor to sweep, and its values, such as observation_noise=0,0.01,0.02 or object_mass=1,2,4;
    /// can be given several times
    #[arg(long, value_name = "NAME=VALUE,...", required_unless_present_any = ["pair", "book"])]
    factor: Vec<Values>,
    /// Two factors to sweep together, such as object_mass=1,2 friction=0.5,1; can be given several
    /// times
    #[arg(long, value_names = ["NAME=VALUE,...", "NAME=VALUE,..."], num_args = 2)]
    pair: Vec<Values>,
    /// Factor that has one value throughout; can be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    with: Vec<Values>,
    /// All tables of a book on these tasks, chapters 6 to 8, that need no training
    #[arg(
        long,
        conflicts_with_all = ["env_id", "policy", "factor", "pair", "with", "out", "csv"]
    )]
    #[serde(skip)]
    book: bool,
    #[command(flatten)]
    #[serde(flatten)]
    episodes: EpisodeArgs,
    /// Also write a folder with pictures, SVG and PNG, and a page of all results
    #[arg(long, value_name = "FOLDER")]
    #[serde(skip)]
    out: Option<PathBuf>,
    /// Also write the curves as CSV
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    csv: Option<PathBuf>,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    json: Option<PathBuf>,
}

impl Args {
    /// Returns the settings of the environment in which factors have values.
    fn config(&self, values: &[(&str, f64)]) -> anyhow::Result<FetchConfig> {
        let mut variation = Variation::default();
        for with in &self.with {
            let [value] = with.values[..] else {
                bail!("--with {} has {} values: pass one", with.factor, with.values.len());
            };
            variation = variation.with(with.factor.as_str(), value)?;
        }
        for &(factor, value) in values {
            variation = variation.with(factor, value)?;
        }
        Ok(self.episodes.config(self.env_id).with_variation(variation))
    }

    /// Returns the factors of the rows and of the columns of each pair.
    fn pairs(&self) -> impl Iterator<Item = [&Values; 2]> {
        self.pair.chunks_exact(2).map(|pair| [&pair[0], &pair[1]])
    }

    /// Checks all values before any episode runs, and returns the number of evaluations of a policy.
    fn check(&self, tasks: &impl Tasks) -> anyhow::Result<usize> {
        let mut count = 0_usize;
        let mut check = |values: &[(&str, f64)]| {
            count += 1;
            check_variation(tasks, &self.config(values).map_err(usage)?)
        };
        for factor in &self.factor {
            factor.each().try_for_each(|value| check(&[value]))?;
        }
        for [rows, columns] in self.pairs() {
            let mut cells =
                rows.each().flat_map(|row| columns.each().map(move |column| [row, column]));
            cells.try_for_each(|cell| check(&cell))?;
        }
        Ok(count)
    }

    /// Measures all curves and pairs.
    fn measure(&self, tasks: &impl Tasks) -> anyhow::Result<(Vec<Measured>, Vec<Pair>)> {
        let evaluations = self.check(tasks)?;
        let policies = self.policy.iter().map(|policy| Ok((policy, policies_of(policy)?)));
        let policies: Vec<_> = policies.collect::<anyhow::Result<_>>()?;
        let evaluations = evaluations * policies.iter().map(|(_, each)| each.len()).sum::<usize>();
        let run = &self.episodes;
        let threads = run.threads()?;
        let bar = progress::bar(run.episodes.get().saturating_mul(evaluations), "episodes");
        let sweep = |(policy, each): &(&String, Vec<String>),
                     Values { factor, values }: &Values,
                     fixed: Option<(&str, f64)>| {
            let curve = |policy: &String| {
                let curve = RobustnessCurve::measure(factor, values, |value| {
                    let values: Vec<_> =
                        fixed.into_iter().chain([(factor.as_str(), value)]).collect();
                    run.evaluate(tasks, &self.config(&values)?, policy, &threads, &bar)
                });
                anyhow::Ok((policy.clone(), curve?))
            };
            let curves = each.iter().map(curve).collect::<anyhow::Result<_>>()?;
            anyhow::Ok(Measured { policy: policy.to_string(), curves })
        };
        let (mut curves, mut pairs) = (Vec::new(), Vec::new());
        for factor in &self.factor {
            for policy in &policies {
                curves.push(sweep(policy, factor, None)?);
            }
        }
        for factors @ [rows, columns] in self.pairs() {
            for policy in &policies {
                let row = |row| Rates::of(&sweep(policy, columns, Some(row))?);
                let rows = rows.each().map(row).collect::<anyhow::Result<_>>()?;
                let (policy, factors) = (policy.0.clone(), factors.map(Clone::clone));
                pairs.push(Pair { policy, factors, rows });
            }
        }
        bar.finish_and_clear();
        Ok((curves, pairs))
    }
}

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    if args.book {
        write_results(args.json.as_ref(), &args.episodes, book::run(tasks, &args.episodes)?)?;
        return Ok(true);
    }
    let (measured, pairs) = args.measure(tasks)?;
    output::print(args, &measured, &pairs)?;
    if let Some(path) = &args.csv {
        write_text(path, &output::csv(&measured)?)?;
    }
    if let Some(folder) = &args.out {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        draw(args, &measured, &pairs, folder)?;
    }
    write_results(args.json.as_ref(), args, output::figures(&measured, &pairs)?)?;
    Ok(true)
}

/// Writes a picture of each factor and each pair, and the page.
fn draw(args: &Args, measured: &[Measured], pairs: &[Pair], folder: &Path) -> anyhow::Result<()> {
    let (env_id, episodes) = (args.env_id, args.episodes.episodes.get());
    let mut page = Page::new(env_id, episodes);
    for measured in by_factor(measured) {
        let factor = measured[0].factor();
        let curves = measured.iter().map(Rates::of).collect::<anyhow::Result<_>>()?;
        let curves = Curves { env_id, factor, episodes, curves };
        save(&curves, folder, factor)?;
        page.add_curves(&curves)?;
    }
    for (number, pair) in pairs.iter().enumerate() {
        // Several policies have the same pair.
        let [rows, columns] = &pair.factors;
        let number = number % args.policy.len() + 1;
        let policy = if args.policy.len() > 1 { format!("-{number}") } else { String::new() };
        let map = heat_map(env_id, episodes, pair);
        save(&map, folder, &format!("{}-{}{policy}", rows.factor, columns.factor))?;
        page.add_pair(&map)?;
    }
    let path = folder.join("robustness.html");
    write_text(&path, &page.html())?;
    say!("wrote {}", path.display())
}
