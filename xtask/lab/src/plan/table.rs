//! The table of all starts, by the distance of the goal.

use baselines::Plan;
use fetch_env::Task;

use super::start::{Failure, PLAYERS, Start};
use crate::shared::json::Metric;

/// The distances at which the table of Slide is divided (meters).
const RINGS: [f64; 4] = [0.3, 0.5, 0.6, 0.7];

const HEAD: &str = "\
| goal's distance | starts | planned | scripted | trained | short | past | untouched | \
 steps to the goal: planned | scripted | trained | rollouts | seconds |
|---|---|---|---|---|---|---|---|---|---|---|---|---|";

/// Returns the lines of the table, and adds its figures.
pub fn lines(
    task: Task,
    starts: &[Start],
    title: &str,
    figures: &mut Vec<(String, Metric)>,
) -> Vec<String> {
    let mut lines = vec![HEAD.to_owned()];
    let rings = if task == Task::Slide { &RINGS[..] } else { &[] };
    for (index, end) in rings.iter().chain([&f64::INFINITY]).enumerate() {
        let begin = if index == 0 { 0.0 } else { rings[index - 1] };
        let ring = starts.iter().filter(|start| (begin..*end).contains(&start.distance));
        let ring: Vec<_> = ring.collect();
        if !rings.is_empty() && !ring.is_empty() {
            lines.push(row(&label(begin, *end), &ring, title, figures));
        }
    }
    let all: Vec<_> = starts.iter().collect();
    if !all.is_empty() {
        lines.push(row("all", &all, title, figures));
    }
    lines
}

fn label(begin: f64, end: f64) -> String {
    if end.is_infinite() { format!("from-{begin}-m") } else { format!("{begin}-to-{end}-m") }
}

fn row(label: &str, starts: &[&Start], title: &str, figures: &mut Vec<(String, Metric)>) -> String {
    let mut line = format!("| {} | {} |", label.replace('-', " "), starts.len());
    let mut add = |name: String, text: String, figure: Metric| {
        line += &format!(" {text} |");
        figures.push((format!("{title}/{label}/{name}"), figure));
    };
    for (index, player) in PLAYERS.iter().enumerate() {
        let solved = starts.iter().filter(|start| start.plans[index].episode.success).count();
        let share = solved as f64 / starts.len() as f64;
        add(format!("{player}/success_rate"), format!("{share:.3}"), Metric::new(share, "1"));
    }
    for failure in Failure::ALL {
        let count = starts.iter().filter(|start| start.failure() == Some(failure)).count();
        add(failure.name().to_owned(), count.to_string(), Metric::count(count));
    }
    for (index, player) in PLAYERS.iter().enumerate() {
        let steps = |plan: &Plan| plan.steps_to_goal.map(|steps| steps as f64);
        let mean = mean(starts.iter().filter_map(|start| steps(&start.plans[index])));
        add(format!("{player}/steps_to_goal"), format!("{mean:.1}"), Metric::new(mean, "1"));
    }
    let rollouts = mean(starts.iter().map(|start| start.planned().rollouts as f64));
    add("rollouts".to_owned(), format!("{rollouts:.0}"), Metric::new(rollouts, "1"));
    let seconds = mean(starts.iter().map(|start| start.seconds));
    add("seconds".to_owned(), format!("{seconds:.1}"), Metric::new(seconds, "s"));
    line
}

/// Returns the mean; NaN if there are no numbers.
fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = numbers.fold((0.0, 0.0), |(sum, count), number| (sum + number, count + 1.0));
    sum / count
}
