//! The tables of a book on the Fetch tasks, chapters 6 to 8, that need no training, beside ours.

use std::num::NonZeroUsize;

use baselines::robustness::RobustnessCurve;
use baselines::{ControlSummary, Estimate, Evaluation, Summary, stratum};
use fetch_env::{EnvId, FetchConfig, Task, variation::Variation};
use goal_reward::RewardKind;
use indicatif::ProgressBar;

use super::measured::{Measured, TIMES};
use super::output::{rates, sums};
use crate::shared::{episodes::EpisodeArgs, json::Metric, progress, tasks::Tasks};

/// A table over one factor.
struct Sweep {
    title: &'static str,
    task: Task,
    policy: &'static str,
    factor: &'static str,
    /// A factor that has one value throughout.
    with: Option<(&'static str, f64)>,
    values: &'static [f64],
    /// The book's success rates at any time, in percent.
    success: &'static [f64],
    /// The book's steps to the first success, and its energy.
    controls: [&'static [f64]; 2],
    /// The book's summary of the curve.
    summary: &'static str,
}

const SCALES: &[f64] = &[0.25, 0.5, 0.75, 1.0, 1.5, 2.0];
const LOW_PASSES: &[f64] = &[0.2, 0.4, 0.6, 0.8, 1.0];
const SEEN: &[f64] = &[0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
const ACTED: &[f64] = &[0.0, 0.01, 0.025, 0.05, 0.1, 0.2, 0.35, 0.5];
const ALL: &[f64] = &[100.0; 8];

const PLAIN: Sweep = Sweep {
    title: "",
    task: Task::Push,
    policy: "trained",
    factor: "",
    with: None,
    values: &[],
    success: ALL,
    controls: [&[], &[]],
    summary: "",
};

const SWEEPS: [Sweep; 10] = [
    Sweep {
        title: "Chapter 7: scaled actions, Reach",
        task: Task::Reach,
        factor: "action_scale",
        values: SCALES,
        ..PLAIN
    },
    Sweep {
        title: "Chapter 7: scaled actions, Push",
        factor: "action_scale",
        values: SCALES,
        success: &[25.0, 66.0, 95.0, 100.0, 99.0, 98.0],
        controls: [&[29.0, 24.7, 18.7, 14.7, 13.7, 13.7], &[58.1, 46.4, 39.8, 34.2, 37.9, 37.1]],
        ..PLAIN
    },
    Sweep {
        title: "Chapter 7: low pass of actions, Reach",
        task: Task::Reach,
        factor: "action_low_pass",
        values: LOW_PASSES,
        ..PLAIN
    },
    Sweep {
        title: "Chapter 7: low pass of actions, Push",
        factor: "action_low_pass",
        values: LOW_PASSES,
        success: &[85.0, 97.0, 99.0, 99.0, 100.0],
        controls: [&[29.1, 20.5, 16.3, 15.3, 14.7], &[]],
        ..PLAIN
    },
    Sweep {
        title: "Chapter 8: noise of observations, Reach",
        task: Task::Reach,
        factor: "observation_noise",
        values: SEEN,
        success: &[100.0, 100.0, 100.0, 100.0, 100.0, 100.0, 87.0],
        ..PLAIN
    },
    Sweep {
        title: "Chapter 8: noise of observations, Reach, proportional controller",
        task: Task::Reach,
        policy: "proportional",
        factor: "observation_noise",
        values: SEEN,
        success: &[100.0, 100.0, 100.0, 100.0, 100.0, 100.0, 99.0],
        ..PLAIN
    },
    Sweep {
        title: "Chapter 8: noise of observations, Push",
        factor: "observation_noise",
        values: SEEN,
        success: &[100.0, 98.0, 97.0, 94.0, 11.0, 5.0, 5.0],
        summary: "below 0.5 at 0.05, slope -5.39, area 0.044",
        ..PLAIN
    },
    Sweep {
        title: "Chapter 8: noise of actions, Reach",
        task: Task::Reach,
        factor: "action_noise",
        values: ACTED,
        ..PLAIN
    },
    Sweep {
        title: "Chapter 8: noise of actions, Push",
        factor: "action_noise",
        values: ACTED,
        success: &[100.0, 100.0, 99.0, 100.0, 100.0, 99.0, 100.0, 97.0],
        summary: "area 0.496",
        ..PLAIN
    },
    Sweep {
        title: "Chapter 8: low pass before noise of actions of 0.5, Push",
        factor: "action_low_pass",
        with: Some(("action_noise", 0.5)),
        values: &[0.3, 0.5, 0.7, 1.0],
        success: &[79.0, 92.0, 94.0, 97.0],
        ..PLAIN
    },
];

/// The gains of the proportional controller.
const GAINS: [f64; 3] = [5.0, 10.0, 20.0];

/// How many times more episodes PickAndPlace has, because they are divided.
const MORE: NonZeroUsize = NonZeroUsize::new(10).unwrap();

/// The parts of PickAndPlace's goals.
const PARTS: [&str; 3] = ["all", "air", "table"];

/// PickAndPlace's conditions: the title, noise of observations and of actions, and what the book
/// has of each of the [`PARTS`].
const GOALS: [(&str, [f64; 2], [&str; 3]); 2] = [
    (
        "Chapter 6: PickAndPlace by its goals",
        [0.0, 0.0],
        ["100", "100; 12.6 steps, 9.2 mm", "100; 8.2 steps, 17.6 mm"],
    ),
    (
        "Chapter 6: PickAndPlace with noise of 0.01 on observations and 0.05 on actions",
        [0.01, 0.05],
        ["100, 99, 96", "100, 98.2, 92.9", "-"],
    ),
];

/// Runs the episodes of a policy.
type Evaluate<'a> = dyn Fn(&EpisodeArgs, &FetchConfig, &str) -> anyhow::Result<Evaluation> + 'a;

/// What measures the tables.
struct Runner<'a> {
    episodes: &'a EpisodeArgs,
    evaluate: &'a Evaluate<'a>,
    bar: &'a ProgressBar,
    figures: Vec<(String, Metric)>,
}

/// Measures and prints all tables, and returns their figures.
pub fn run(tasks: &impl Tasks, episodes: &EpisodeArgs) -> anyhow::Result<Vec<(String, Metric)>> {
    let threads = episodes.threads()?;
    let values: usize = SWEEPS.iter().map(|sweep| sweep.values.len()).sum();
    let evaluations = values + 2 * (GAINS.len() + 1) + MORE.get() * GOALS.len();
    let bar = progress::bar(episodes.episodes.get().saturating_mul(evaluations), "episodes");
    let evaluate = |episodes: &EpisodeArgs, config: &FetchConfig, policy: &str| {
        episodes.evaluate(tasks, config, policy, &threads, &bar)
    };
    let mut runner = Runner { episodes, evaluate: &evaluate, bar: &bar, figures: Vec::new() };
    GOALS.iter().try_for_each(|goals| runner.goals(goals))?;
    let (controls, noise) = SWEEPS.split_at(4);
    controls.iter().try_for_each(|sweep| runner.sweep(sweep))?;
    runner.gains()?;
    noise.iter().try_for_each(|sweep| runner.sweep(sweep))?;
    let figures = runner.figures;
    bar.finish_and_clear();
    Ok(figures)
}

impl Runner<'_> {
    fn evaluate(
        &self,
        episodes: &EpisodeArgs,
        task: Task,
        policy: &str,
        factors: &[(&str, f64)],
    ) -> anyhow::Result<Evaluation> {
        let id = EnvId { task, reward: RewardKind::Sparse };
        let none = Ok(Variation::default());
        let variation = factors.iter().fold(none, |all, &(name, value)| all?.with(name, value))?;
        let config = episodes.config(id).with_variation(variation);
        (self.evaluate)(episodes, &config, policy)
    }

    fn keep(&mut self, name: &str, summary: &Summary) {
        let both = [summary.success_rate, summary.success_any_rate];
        self.figures.extend(rates(&format!("robustness/book/{name}"), both));
    }

    /// Prints a table: its title, the heads of its columns, and a name and cells for each row.
    fn say(&self, title: &str, heads: &[String], rows: &[Row]) -> anyhow::Result<()> {
        let mut text = format!("### {title}\n\n| {} |\n|", heads.join(" | "));
        text += &"---|".repeat(heads.len());
        for (name, cells) in rows {
            text += &format!("\n| {name} | {} |", cells.join(" | "));
        }
        self.bar.suspend(|| say!("{text}\n"))
    }

    fn sweep(&mut self, sweep: &Sweep) -> anyhow::Result<()> {
        let Sweep { title, task, policy, factor, with, values, success, .. } = sweep;
        let curve = RobustnessCurve::measure(factor, values, |value| {
            let factors: Vec<_> = with.iter().copied().chain([(*factor, value)]).collect();
            self.evaluate(self.episodes, *task, policy, &factors)
        })?;
        let with = with.map_or(String::new(), |(name, value)| format!("{name}={value}/"));
        for point in &curve.points {
            let name = format!("{task}/{policy}/{with}{factor}/{}", point.value);
            self.keep(&name, &point.summary);
        }
        let summaries: Vec<_> = curve.points.iter().map(|point| point.summary).collect();
        let book = success[..values.len()].iter().map(f64::to_string).collect();
        let mut rows = rows((ANY_TIME, book), &summaries, 0);
        let [steps, energy] = sweep.controls.map(|book| book.iter().map(f64::to_string).collect());
        rows.extend(controls(steps, energy, &summaries));
        let heads = values.iter().map(f64::to_string);
        let heads: Vec<_> = [(*factor).to_owned()].into_iter().chain(heads).collect();
        self.say(title, &heads, &rows)?;
        if sweep.summary.is_empty() {
            return Ok(());
        }
        let policy = (*policy).to_owned();
        let measured = Measured { policy: policy.clone(), curves: vec![(policy, curve)] };
        let sum = |(name, at)| anyhow::Ok(format!("at {name} {}", sums(&measured, at)?));
        let [end, any] = TIMES.map(sum);
        let line = format!("The book: {}. Here: {}; {}.\n", sweep.summary, any?, end?);
        self.bar.suspend(|| say!("{line}"))
    }

    /// The proportional controller, and what the trained policy has over it.
    fn gains(&mut self) -> anyhow::Result<()> {
        let mut gaps = Vec::new();
        for (task, success, steps) in [
            (Task::Reach, ["100", "100", "100", "100"], ["6.0", "-", "2.6", "-"]),
            (Task::Push, ["5", "5", "5", "100"], ["-", "-", "-", "14.7"]),
        ] {
            let policies = GAINS.map(|gain| format!("proportional={gain}"));
            let heads = [&["policy".to_owned()], &policies[..], &["trained".to_owned()]].concat();
            let mut summaries = Vec::new();
            for policy in &heads[1..] {
                let summary = self.evaluate(self.episodes, task, policy, &[])?.summary()?;
                self.keep(&format!("{task}/{policy}"), &summary);
                summaries.push(summary);
            }
            let book = success.map(String::from).into();
            let mut rows = rows((ANY_TIME, book), &summaries, 0);
            rows.extend(controls(steps.map(String::from).into(), Vec::new(), &summaries));
            self.say(&format!("Chapter 7: proportional controller, {task}"), &heads, &rows)?;
            let rates: Vec<_> = summaries.iter().map(|s| s.success_any_rate.value).collect();
            let best = rates[..GAINS.len()].iter().copied().fold(0.0, f64::max);
            gaps.push(format!("{:.0} points in {task}", 100.0 * (rates[GAINS.len()] - best)));
        }
        let gaps = gaps.join(", ");
        let line = format!("Planning gap, at any time: {gaps} (the book: 0 and 95).\n");
        self.bar.suspend(|| say!("{line}"))
    }

    /// PickAndPlace by its goals.
    fn goals(&mut self, (title, noise, book): &(&str, [f64; 2], [&str; 3])) -> anyhow::Result<()> {
        let [seen, acted] = *noise;
        let episodes = self.episodes.times(MORE);
        let factors = [("observation_noise", seen), ("action_noise", acted)];
        let all = self.evaluate(&episodes, Task::PickAndPlace, "trained", &factors)?;
        let strata = all.strata(|episode| stratum(Task::PickAndPlace, episode));
        let strata = strata.into_iter().filter_map(|(name, part)| Some((name?, part)));
        let (mut heads, mut cells, mut summaries) = (vec!["goals".to_owned()], vec![], vec![]);
        for (name, part) in [("all", all)].into_iter().chain(strata) {
            let summary = part.summary()?;
            self.keep(&format!("PickAndPlace/noise={seen}/{name}"), &summary);
            heads.push(format!("{name}, {} episodes", part.episodes.len()));
            cells.extend(PARTS.iter().zip(book).find(|(part, _)| **part == name));
            summaries.push(summary);
        }
        let book = cells.into_iter().map(|(_, book)| book.to_string()).collect();
        let mut rows = rows(("the book, at the end", book), &summaries, 1);
        let distance = |s: &Summary| format!("{:.1}", 1e3 * s.final_distance_mean.value);
        rows.push(("final distance (mm)", summaries.iter().map(distance).collect()));
        rows.push(("steps to success", summaries.iter().map(steps).collect()));
        self.say(title, &heads, &rows)
    }
}

/// The name of the book's rows in chapters 7 and 8.
const ANY_TIME: &str = "the book, any time";

/// A row: its name and its cells.
type Row = (&'static str, Vec<String>);

/// Returns the book's row of success, and ours, in percent.
fn rows(book: Row, summaries: &[Summary], decimals: usize) -> Vec<Row> {
    let percent = |rate: Estimate| {
        let [value, low, high] = [rate.value, rate.low, rate.high].map(|number| 100.0 * number);
        format!("{value:.decimals$} ({low:.decimals$} to {high:.decimals$})")
    };
    let cells = |of: fn(&Summary) -> Estimate| summaries.iter().map(|s| percent(of(s))).collect();
    vec![
        book,
        ("any time", cells(|summary| summary.success_any_rate)),
        ("at the end", cells(|summary| summary.success_rate)),
    ]
}

/// Returns the rows of the book's figures of a controller and ours; none without the book's.
fn controls(book_steps: Vec<String>, book_energy: Vec<String>, summaries: &[Summary]) -> Vec<Row> {
    let cells = |decimals: usize, of: fn(&ControlSummary) -> Option<Estimate>| {
        let cell = |summary: &Summary| shown(summary.controls.as_ref().and_then(of), decimals);
        summaries.iter().map(cell).collect::<Vec<_>>()
    };
    let mut rows = Vec::new();
    if !book_steps.is_empty() {
        rows.push(("the book, steps to success", book_steps));
        rows.push(("steps to success", summaries.iter().map(steps).collect()));
        rows.push(("path (m)", cells(2, |controls| controls.path_mean)));
    }
    if !book_energy.is_empty() {
        rows.push(("the book, energy", book_energy));
        rows.push(("energy", cells(1, |controls| Some(controls.energy_mean))));
    }
    rows
}

fn steps(summary: &Summary) -> String {
    shown(summary.controls.and_then(|controls| controls.steps_to_success_mean), 1)
}

fn shown(estimate: Option<Estimate>, decimals: usize) -> String {
    estimate.map_or("-".to_owned(), |estimate| format!("{:.decimals$}", estimate.value))
}
