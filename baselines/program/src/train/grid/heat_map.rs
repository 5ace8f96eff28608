//! The heat map of a grid.

use baselines::runs::{Grid, GridRow, GridTable};

use crate::figures::heat_map::HeatMap;

/// The largest number of columns.
const MOST_COLUMNS: usize = 8;
/// The largest number of letters in a line of a label.
const MOST_LETTERS: usize = 48;

/// Returns the heat map of a grid.
pub fn heat_map(grid: &Grid, table: &GridTable) -> anyhow::Result<HeatMap> {
    let lists = grid.axes().iter();
    let fixed = lists.clone().filter(|(_, values)| values.len() == 1);
    let fixed: Vec<_> = fixed.map(|(key, values)| label(key, &values[0])).collect();
    let axes: Vec<Vec<String>> = lists
        .filter(|(_, values)| values.len() > 1)
        .map(|(key, values)| values.iter().map(|value| label(key, value)).collect())
        .collect();
    // The last axes are columns, except the first of all axes.
    let (mut at, mut num_columns) = (axes.len(), 1);
    while at > 1 && num_columns * axes[at - 1].len() <= MOST_COLUMNS && !grid.is_one_at_a_time() {
        at -= 1;
        num_columns *= axes[at].len();
    }
    let seeds = match grid.seeds().len() {
        1 => "one run".to_owned(),
        runs => format!("interquartile mean of {runs} seeds and its 95 % bootstrap interval"),
    };
    let (env_id, preset) = (grid.env_id()?, grid.preset()?);
    let target = grid.limits()?.1;
    let cells = table.rows().iter().map(|row| {
        let GridRow { success, num_reached, num_runs, .. } = row;
        (*success, format!("{num_reached} of {num_runs} reached {target}"))
    });
    let row_labels = match grid.is_one_at_a_time() {
        true => table.rows().iter().map(|row| vec![changed(grid, row)]).collect(),
        false => combinations(&axes[..at]),
    };
    Ok(HeatMap {
        title: format!("{env_id}, preset {preset}: success rate at the end, {seeds}"),
        fixed: fixed.join(", "),
        row_labels,
        column_labels: combinations(&axes[at..]),
        cells: cells.collect(),
    })
}

/// Returns the setting that has another value than its first.
fn changed(grid: &Grid, row: &GridRow) -> String {
    let axes = grid.axes().iter().zip(&row.values);
    let mut changes = axes.filter(|((_, values), value)| *value != &values[0].to_string());
    let label =
        |((key, _), value): (&(String, Vec<serde_json::Value>), &String)| format!("{key} {value}");
    changes.next().map_or_else(|| "nothing changed".to_owned(), label)
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
