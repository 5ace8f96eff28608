//! The table of all starts, by the stratum of the goal.

use baselines::{strata_of, stratum};
use fetch_env::Task;

use super::start::{Failure, PLAYERS, Start};
use crate::shared::json::Metric;

/// The head of the table. Steps are means over the episodes that achieve their goals.
pub const HEAD: &str = "\
| goal | starts | planned | scripted | trained | short | past | untouched | \
 steps planned | steps scripted | steps trained | rollouts | seconds |
|---|---|---|---|---|---|---|---|---|---|---|---|---|";

/// A row: the starts whose goals are in the same stratum.
pub struct Row {
    /// The stratum, as in the names of figures.
    label: String,
    starts: usize,
    cells: Vec<Cell>,
}

struct Cell {
    name: String,
    decimals: usize,
    /// `None` for the mean of no numbers.
    figure: Option<Metric>,
}

/// Returns the rows; the last one is of all starts.
pub fn rows(task: Task, starts: &[Start]) -> Vec<Row> {
    let mut rows = Vec::new();
    for &name in strata_of(task) {
        let part =
            starts.iter().filter(|start| stratum(task, &start.planned().episode) == Some(name));
        rows.push(Row::new(name.replace(' ', "-"), &part.collect::<Vec<_>>()));
    }
    rows.push(Row::new("all".to_owned(), &starts.iter().collect::<Vec<_>>()));
    rows
}

impl Row {
    fn new(label: String, starts: &[&Start]) -> Self {
        let mut row = Self { label, starts: starts.len(), cells: Vec::new() };
        for (index, player) in PLAYERS.iter().enumerate() {
            let success = |start: &&Start| f64::from(u8::from(start.plans[index].episode.success));
            row.add_mean(format!("{player}/success_rate"), 3, "1", starts.iter().map(success));
        }
        for failure in Failure::ALL {
            let count = starts.iter().filter(|start| start.failure() == Some(failure)).count();
            let figure = Some(Metric::count(count));
            row.cells.push(Cell { name: failure.name().to_owned(), decimals: 0, figure });
        }
        for (index, player) in PLAYERS.iter().enumerate() {
            let steps = starts.iter().filter_map(|start| start.plans[index].steps_to_goal);
            let name = format!("{player}/steps_to_goal");
            row.add_mean(name, 1, "1", steps.map(|steps| steps as f64));
        }
        let rollouts = starts.iter().map(|start| start.planned().rollouts as f64);
        row.add_mean("rollouts".to_owned(), 0, "1", rollouts);
        row.add_mean("seconds".to_owned(), 1, "s", starts.iter().map(|start| start.seconds));
        row
    }

    fn add_mean(
        &mut self,
        name: String,
        decimals: usize,
        unit: &'static str,
        numbers: impl Iterator<Item = f64>,
    ) {
        let (sum, count) = numbers.fold((0.0, 0.0), |(sum, n), number| (sum + number, n + 1.0));
        let figure = (count > 0.0).then(|| Metric::new(sum / count, unit));
        self.cells.push(Cell { name, decimals, figure });
    }

    /// Returns the row as a line of the table.
    pub fn line(&self) -> String {
        let mut line = format!("| {} | {} |", self.label.replace('-', " "), self.starts);
        for Cell { decimals, figure, .. } in &self.cells {
            line += &figure
                .map_or(" - |".to_owned(), |figure| format!(" {:.decimals$} |", figure.value));
        }
        line
    }

    /// Returns the figures of the row.
    pub fn figures(&self, title: &str) -> impl Iterator<Item = (String, Metric)> {
        let starts = ("starts".to_owned(), Metric::count(self.starts));
        let cells = self.cells.iter();
        let figures = cells.filter_map(|cell| Some((cell.name.clone(), cell.figure?)));
        let title = format!("{title}/{}", self.label);
        std::iter::once(starts)
            .chain(figures)
            .map(move |(name, figure)| (format!("{title}/{name}"), figure))
    }
}
