//! The table of a grid: a row for each choice of values, over the seeds.

use std::io;

use super::curve::CurveLine;
use super::error::GridError;
use super::grid::{Choice, Grid};
use crate::statistics::Estimate;

/// How a run ended, if it was not stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridEnd {
    /// It has reached its steps or its target.
    Finished {
        /// The success rate of the final evaluation.
        success_rate: f64,
        /// The evaluation with which the target was reached.
        reached: Option<CurveLine>,
    },
    /// Its losses or its weights are not finite.
    Diverged,
}

/// Interquartile means over the seeds, with their 95 % bootstrap intervals.
#[derive(Clone, Debug)]
pub struct GridTable {
    keys: Vec<String>,
    rows: Vec<GridRow>,
}

/// A row of the table of a grid.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GridRow {
    /// The name of the choice, as in the names of its folders.
    pub name: String,
    /// The value of each setting.
    pub values: Vec<String>,
    /// The number of its runs.
    pub num_runs: usize,
    /// The number of those that have diverged.
    pub num_diverged: usize,
    /// The success rate at the end; 0 for a run that has diverged.
    pub success: Estimate,
    /// The number of runs that reached the target.
    pub num_reached: usize,
    /// Their steps until then; `None` if none reached it.
    pub steps: Option<Estimate>,
    /// Their seconds of training until then.
    pub seconds: Option<Estimate>,
}

impl GridTable {
    /// Makes the table of runs that have ended, each with the number of its choice.
    ///
    /// # Errors
    /// [`GridError::Estimate`] if a choice has no run.
    pub fn new(
        grid: &Grid,
        choices: &[Choice<'_>],
        ended: &[(usize, GridEnd)],
    ) -> Result<Self, GridError> {
        let rows = choices.iter().enumerate().map(|(number, choice)| {
            let own = ended.iter().filter(|(choice, _)| *choice == number);
            let values = choice.values.iter().map(ToString::to_string).collect();
            GridRow::new(
                choice.file_name(),
                values,
                &own.map(|(_, ended)| ended).collect::<Vec<_>>(),
            )
        });
        let keys = grid.axes().iter().map(|(key, _)| key.clone()).collect();
        Ok(Self { keys, rows: rows.collect::<Result<_, _>>()? })
    }

    /// Returns the rows, in the order of the choices.
    #[must_use]
    pub fn rows(&self) -> &[GridRow] {
        &self.rows
    }

    /// Returns the table as CSV.
    pub(super) fn csv(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut writer = csv::Writer::from_writer(&mut bytes);
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
        writer.flush()?;
        drop(writer);
        Ok(bytes)
    }

    /// Returns the table as Markdown.
    #[must_use]
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
}

impl GridRow {
    fn new(name: String, values: Vec<String>, ended: &[&GridEnd]) -> Result<Self, GridError> {
        let (mut success, mut lines, mut num_diverged) = (Vec::new(), Vec::new(), 0);
        for ended in ended {
            match ended {
                GridEnd::Finished { success_rate, reached } => {
                    success.push(*success_rate);
                    lines.extend(reached);
                }
                GridEnd::Diverged => {
                    success.push(0.0);
                    num_diverged += 1;
                }
            }
        }
        let estimate = |values: &[f64]| {
            let invalid = |source| GridError::Estimate { choice: name.clone(), source };
            Estimate::interquartile_mean(values, 0).map_err(invalid)
        };
        let mean = |value: fn(&CurveLine) -> f64| {
            let values: Vec<f64> = lines.iter().map(value).collect();
            (!values.is_empty()).then(|| estimate(&values)).transpose()
        };
        let success = estimate(&success)?;
        let (steps, seconds) = (mean(|line| line.steps as f64)?, mean(|line| line.seconds)?);
        Ok(Self {
            name,
            values,
            num_runs: ended.len(),
            num_diverged,
            success,
            num_reached: lines.len(),
            steps,
            seconds,
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
