//! The table of a grid: a row for each choice of values, over the seeds.

use anyhow::Context;
use baselines::Estimate;

use super::{
    description::{Choice, Grid},
    running::Ended,
};
use crate::{shared::json::Metric, train::curve_line::CurveLine};

/// Interquartile means over the seeds, with their 95 % bootstrap intervals.
pub struct Table {
    keys: Vec<String>,
    pub rows: Vec<Row>,
}

pub struct Row {
    name: String,
    /// The value of each key.
    pub values: Vec<String>,
    pub num_runs: usize,
    num_diverged: usize,
    /// The success rate at the end; 0 for a run that has diverged.
    pub success: Estimate,
    pub num_reached: usize,
    /// The mean over the runs that reached the target; `None` if none did.
    steps: Option<Estimate>,
    seconds: Option<Estimate>,
}

impl Table {
    /// Makes the table of runs that have ended, each with the number of its choice.
    pub fn new(
        grid: &Grid,
        choices: &[Choice<'_>],
        ended: &[(usize, Ended)],
    ) -> anyhow::Result<Self> {
        let rows = choices.iter().enumerate().map(|(number, choice)| {
            let own = ended.iter().filter(|(choice, _)| *choice == number);
            let values = choice.values.iter().map(ToString::to_string).collect();
            Row::new(choice.file_name(), values, &own.map(|(_, ended)| ended).collect::<Vec<_>>())
        });
        let keys = grid.axes.0.iter().map(|(key, _)| key.clone()).collect();
        Ok(Self { keys, rows: rows.collect::<anyhow::Result<_>>()? })
    }

    /// Returns the table as CSV.
    pub fn csv(&self) -> anyhow::Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let own = ["runs", "diverged", "success_rate", "success_low", "success_high", "reached"];
        let measured = ["steps", "steps_low", "steps_high", "seconds", "seconds_low"];
        let names = self.keys.iter().map(String::as_str).chain(own).chain(measured);
        writer.write_record(names.chain(["seconds_high"]))?;
        for row in &self.rows {
            let counts = [row.num_runs, row.num_diverged].map(|count| count.to_string());
            let cells = row.values.iter().cloned().chain(counts);
            let success = numbers(Some(row.success), 4);
            let (steps, seconds) = (numbers(row.steps, 0), numbers(row.seconds, 1));
            let reached = [row.num_reached.to_string()];
            writer.write_record(cells.chain(success).chain(reached).chain(steps).chain(seconds))?;
        }
        Ok(String::from_utf8(writer.into_inner()?)?)
    }

    /// Returns the table as Markdown.
    pub fn text(&self) -> String {
        let own = ["success at the end", "reached the target", "steps to it", "seconds to it"];
        let header = self.keys.iter().cloned().chain(own.map(str::to_owned));
        let lines = self.rows.iter().map(|row| {
            let diverged = match row.num_diverged {
                0 => String::new(),
                count => format!(", {count} diverged"),
            };
            let reached = format!("{} of {}{diverged}", row.num_reached, row.num_runs);
            let own = [
                interval(Some(row.success), 3),
                reached,
                interval(row.steps, 0),
                interval(row.seconds, 0),
            ];
            row.values.iter().cloned().chain(own).collect()
        });
        let mut lines: Vec<Vec<String>> = [header.collect()].into_iter().chain(lines).collect();
        let widths: Vec<usize> = (0..lines[0].len())
            .map(|column| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0))
            .collect();
        lines.insert(1, widths.iter().map(|width| "-".repeat(*width)).collect());
        let line = |cells: &Vec<String>| {
            let cells = cells.iter().zip(&widths).map(|(cell, width)| format!("| {cell:width$} "));
            cells.collect::<String>() + "|"
        };
        lines.iter().map(line).collect::<Vec<_>>().join("\n")
    }

    /// Returns what `--json` writes.
    pub fn figures(&self) -> impl Iterator<Item = (String, Metric)> {
        self.rows.iter().flat_map(|row| {
            let named = |name: &str, value: f64, unit| {
                (format!("train/grid/{}/{name}", row.name), Metric::new(value, unit))
            };
            let steps = row.steps.map(|steps| named("steps_to_target", steps.value, "1"));
            let seconds = row.seconds.map(|seconds| named("seconds_to_target", seconds.value, "s"));
            let success = named("success_rate", row.success.value, "1");
            let reached = named("reached", row.num_reached as f64, "1");
            [success, reached].into_iter().chain(steps).chain(seconds)
        })
    }
}

impl Row {
    fn new(name: String, values: Vec<String>, ended: &[&Ended]) -> anyhow::Result<Self> {
        let (mut success, mut lines, mut num_diverged) = (Vec::new(), Vec::new(), 0);
        for ended in ended {
            match ended {
                Ended::Finished { success_rate, reached } => {
                    success.push(*success_rate);
                    lines.extend(reached);
                }
                Ended::Diverged => {
                    success.push(0.0);
                    num_diverged += 1;
                }
            }
        }
        let mean = |value: fn(&CurveLine) -> f64| {
            let values: Vec<f64> = lines.iter().map(value).collect();
            (!values.is_empty()).then(|| Estimate::interquartile_mean(&values, 0)).transpose()
        };
        Ok(Self {
            name,
            values,
            num_runs: ended.len(),
            num_diverged,
            success: Estimate::interquartile_mean(&success, 0).context("a choice has no run")?,
            num_reached: lines.len(),
            steps: mean(|line| line.steps as f64)?,
            seconds: mean(|line| line.seconds)?,
        })
    }
}

/// Returns an estimate and the ends of its interval as text, which is empty without an estimate.
fn numbers(estimate: Option<Estimate>, decimals: usize) -> [String; 3] {
    let number = |number: f64| format!("{number:.decimals$}");
    estimate.map_or_else(Default::default, |Estimate { value, low, high, .. }| {
        [value, low, high].map(number)
    })
}

fn interval(estimate: Option<Estimate>, decimals: usize) -> String {
    let [value, low, high] = numbers(estimate, decimals);
    if estimate.is_some() { format!("{value} ({low} to {high})") } else { "-".to_owned() }
}
