//! The picture of a grid: the success rate of each choice of values, darker where it is higher.

use baselines::runs::{Grid, GridRow, GridTable};
use plotters::prelude::*;

use crate::figures::{
    canvas::{BLUE, FAINT, INK, bold, centered, text},
    picture::{Area, Backend, DrawError, Drawing},
};

pub struct HeatMap<'a> {
    title: String,
    /// What all cells have in common.
    fixed: String,
    /// A line for each setting that differs.
    row_labels: Vec<Vec<String>>,
    column_labels: Vec<Vec<String>>,
    cells: &'a [GridRow],
    target: f64,
}

/// Sizes in pixels.
const CELL_HEIGHT: usize = 56;
const LINE: usize = 18;
const LETTER: usize = 8;
const MARGIN: usize = 20;
const TOP: usize = 76;

/// The largest number of columns.
const MOST_COLUMNS: usize = 8;
/// The largest number of letters in a line of a label.
const MOST_LETTERS: usize = 48;

impl<'a> HeatMap<'a> {
    pub fn new(grid: &Grid, table: &'a GridTable) -> anyhow::Result<Self> {
        let lists = grid.axes().iter();
        let fixed = lists.clone().filter(|(_, values)| values.len() == 1);
        let fixed: Vec<_> = fixed.map(|(key, values)| label(key, &values[0])).collect();
        let axes: Vec<Vec<String>> = lists
            .filter(|(_, values)| values.len() > 1)
            .map(|(key, values)| values.iter().map(|value| label(key, value)).collect())
            .collect();
        // The last axes are columns, except the first of all axes.
        let (mut at, mut num_columns) = (axes.len(), 1);
        while at > 1 && num_columns * axes[at - 1].len() <= MOST_COLUMNS {
            at -= 1;
            num_columns *= axes[at].len();
        }
        let seeds = match grid.seeds().len() {
            1 => "one run".to_owned(),
            runs => format!("interquartile mean of {runs} seeds and its 95 % bootstrap interval"),
        };
        let (env_id, preset) = (grid.env_id()?, grid.preset()?);
        Ok(Self {
            title: format!("{env_id}, preset {preset}: success rate at the end, {seeds}"),
            fixed: fixed.join(", "),
            row_labels: combinations(&axes[..at]),
            column_labels: combinations(&axes[at..]),
            cells: table.rows(),
            target: grid.limits()?.1,
        })
    }

    fn row_height(&self) -> usize {
        CELL_HEIGHT.max(LINE * (self.row_labels[0].len() + 1))
    }

    /// Returns the position and the size of all cells together: x, y, width, height.
    fn cells_at(&self) -> [usize; 4] {
        let x = MARGIN + LETTER * (longest(&self.row_labels) + 1);
        let y = TOP + LINE * (self.column_labels[0].len() + 1);
        let width = (LETTER * (longest(&self.column_labels) + 2)).max(140);
        [x, y, width * self.column_labels.len(), self.row_height() * self.row_labels.len()]
    }
}

/// Returns a setting and its value, shortened.
fn label(key: &str, value: &serde_json::Value) -> String {
    let text = format!("{key} {value}");
    if text.chars().count() <= MOST_LETTERS {
        return text;
    }
    text.chars().take(MOST_LETTERS - 1).chain(['…']).collect()
}

/// Returns all combinations of one label of each axis; the last one changes first.
fn combinations(axes: &[Vec<String>]) -> Vec<Vec<String>> {
    axes.iter().fold(vec![Vec::new()], |all, labels| {
        let longer = |one: &Vec<String>, label: &String| {
            [one.as_slice(), std::slice::from_ref(label)].concat()
        };
        all.iter().flat_map(|one| labels.iter().map(move |label| longer(one, label))).collect()
    })
}

/// Returns the number of letters of the longest line.
fn longest(labels: &[Vec<String>]) -> usize {
    labels.iter().flatten().map(|line| line.chars().count()).max().unwrap_or(0)
}

impl Drawing for HeatMap<'_> {
    fn size(&self) -> (u32, u32) {
        let [x, y, width, height] = self.cells_at();
        // The title is in larger letters.
        let title = 11 * self.title.chars().count();
        let fixed = LETTER * self.fixed.chars().count();
        let width = (x + width).max(MARGIN + title).max(MARGIN + fixed) + MARGIN;
        (width as u32, (y + height + MARGIN) as u32)
    }

    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        let [left, top, width, _] = self.cells_at();
        let (row_height, column_width) = (self.row_height(), width / self.column_labels.len());
        let pixels = |x: usize, y: usize| (x as i32, y as i32);
        area.draw_text(&self.title, &bold(20), pixels(MARGIN, 26))?;
        area.draw_text(&self.fixed, &text(14, FAINT), pixels(MARGIN, 54))?;
        for (column, lines) in self.column_labels.iter().enumerate() {
            let x = left + column_width * column + column_width / 2;
            for (number, line) in lines.iter().enumerate() {
                area.draw_text(line, &centered(14, INK), pixels(x, TOP + LINE * number))?;
            }
        }
        for (row, lines) in self.row_labels.iter().enumerate() {
            let y = top + row_height * row;
            for (number, line) in lines.iter().enumerate() {
                let y = y + row_height / 2 + LINE * number - LINE * (lines.len() - 1) / 2;
                area.draw_text(line, &text(14, INK), pixels(MARGIN, y))?;
            }
            for column in 0..self.column_labels.len() {
                let GridRow { success, num_reached, num_runs, .. } =
                    &self.cells[row * self.column_labels.len() + column];
                let x = left + column_width * column;
                let corners = [(x, y), (x + column_width - 2, y + row_height - 2)];
                let corners = corners.map(|(x, y)| pixels(x, y));
                area.draw(&Rectangle::new(corners, BLUE.mix(success.value).filled()))?;
                area.draw(&Rectangle::new(corners, FAINT.mix(0.4)))?;
                let ink = if success.value > 0.7 { WHITE } else { INK };
                let x = x + column_width / 2;
                let middle = y + row_height / 2;
                let value =
                    format!("{:.2} ({:.2} to {:.2})", success.value, success.low, success.high);
                area.draw_text(&value, &centered(14, ink), pixels(x, middle - LINE / 2))?;
                let reached = format!("{num_reached} of {num_runs} reached {}", self.target);
                area.draw_text(&reached, &centered(12, ink), pixels(x, middle + LINE / 2))?;
            }
        }
        Ok(())
    }
}
