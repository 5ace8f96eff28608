//! The observation of each task, element by element, with its range in the evaluated episodes.

use baselines::page::{Column, escape, table};
use fetch_env::{EnvId, Task, observation_fields};
use goal_reward::RewardKind;

use super::baseline::{Outcome, Ranges, include};

pub fn section(outcomes: &[Outcome]) -> String {
    let mut html = String::from(
        "<p>The lowest and the highest value of each element in the episodes of the random and of \
         the scripted policy, one line for each element.</p>\n",
    );
    for task in Task::ALL {
        let mut ranges = Ranges::new();
        let id = EnvId { task, reward: RewardKind::Dense };
        for outcome in outcomes.iter().filter(|outcome| outcome.id == id) {
            include(&mut ranges, &outcome.ranges);
        }
        html += &format!("<h3>Fetch{task}</h3>\n{}\n", task_table(task, &ranges));
    }
    html
}

fn task_table(task: Task, ranges: &Ranges) -> String {
    let (observation, goals) = ranges.split_at(ranges.len() - 6);
    let mut rows: Vec<_> = observation_fields(task)
        .iter()
        .map(|field| {
            let indices = format!("{}–{}", field.range.start, field.range.end - 1);
            let seen = &observation[field.range.clone()];
            row(&indices, field.name, field.description, field.unit, seen)
        })
        .collect();
    let achieved = if task.has_object() { "where the object is" } else { "where the gripper is" };
    rows.push(row("", "achieved_goal", achieved, "m", &goals[..3]));
    rows.push(row("", "desired_goal", "where it should be", "m", &goals[3..]));
    let columns = [
        Column::Text("Index"),
        Column::Text("Name"),
        Column::Text("Unit"),
        Column::Number("Lowest"),
        Column::Number("Highest"),
    ];
    table(columns, rows)
}

fn row(indices: &str, name: &str, meaning: &str, unit: &str, seen: &[(f64, f64)]) -> [String; 5] {
    let rounded = |value: f64| (1e4 * value).round() / 1e4 + 0.0; // not -0
    let lines = |end: fn(&(f64, f64)) -> f64| {
        let numbers: Vec<_> =
            seen.iter().map(|range| format!("{:.4}", rounded(end(range)))).collect();
        numbers.join("<br>")
    };
    let name = format!("<code>{}</code><br><small>{}</small>", escape(name), escape(meaning));
    [indices.into(), name, escape(unit), lines(|range| range.0), lines(|range| range.1)]
}
