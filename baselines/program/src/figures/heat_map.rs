//! A picture of success rates in rows and columns, darker where they are higher.

use baselines::Estimate;
use plotters::prelude::*;

use super::{
    canvas::{BLUE, FAINT, INK, bold, centered, text},
    picture::{Area, Backend, DrawError, Drawing},
};

pub struct HeatMap {
    pub title: String,
    /// What all cells have in common.
    pub fixed: String,
    /// The lines of each row's label.
    pub row_labels: Vec<Vec<String>>,
    pub column_labels: Vec<Vec<String>>,
    /// The success rates and a remark on each, row after row.
    pub cells: Vec<(Estimate, String)>,
}

/// Sizes in pixels.
const CELL_HEIGHT: usize = 56;
const LINE: usize = 18;
const LETTER: usize = 8;
const MARGIN: usize = 20;
const TOP: usize = 76;

impl HeatMap {
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

/// Returns the number of letters of the longest line.
fn longest(labels: &[Vec<String>]) -> usize {
    labels.iter().flatten().map(|line| line.chars().count()).max().unwrap_or(0)
}

impl Drawing for HeatMap {
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
                let (rate, remark) = &self.cells[row * self.column_labels.len() + column];
                let x = left + column_width * column;
                let corners = [(x, y), (x + column_width - 2, y + row_height - 2)];
                let corners = corners.map(|(x, y)| pixels(x, y));
                area.draw(&Rectangle::new(corners, BLUE.mix(rate.value).filled()))?;
                area.draw(&Rectangle::new(corners, FAINT.mix(0.4)))?;
                let ink = if rate.value > 0.7 { WHITE } else { INK };
                let x = x + column_width / 2;
                let middle = y + row_height / 2;
                let value = format!("{:.2} ({:.2} to {:.2})", rate.value, rate.low, rate.high);
                area.draw_text(&value, &centered(14, ink), pixels(x, middle - LINE / 2))?;
                area.draw_text(remark, &centered(12, ink), pixels(x, middle + LINE / 2))?;
            }
        }
        Ok(())
    }
}
