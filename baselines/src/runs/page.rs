//! The page of a run: its curve, its settings, and episodes of the policy.

use super::curve::diagnostic_names;
use super::description::{RunDescription, RunTeacher};
use super::envs::MakeEnvs;
use super::error::RunsError;
use crate::learn::{CurveRow, Learner};
use crate::page::{Axis, Document, Ink, PageError, Playback, Plot, escape};
use crate::trained::AnyPolicy;

/// The number of episodes of the final evaluation that are played back.
const NUM_PLAYED: u64 = 3;

/// Returns the page.
pub(super) fn html(
    tasks: &impl MakeEnvs,
    description: &RunDescription,
    learner: &dyn Learner,
    mut policy: AnyPolicy,
) -> Result<String, RunsError> {
    let title = format!("{}, learned in {} steps", description.title(), policy.header().steps);
    let mut page = Document::new(&title);
    page.section("curve", "Learning curve", &curves(learner)?);
    page.section("diagnostics", "Diagnostics", &diagnostics(learner.rows())?);
    if let Some(teacher) = &description.teacher {
        let of = match teacher {
            RunTeacher::Scripted => "the scripted policy",
            RunTeacher::Policy(policy) => policy,
        };
        let text = format!(
            "The student imitates a teacher, which sees the state: {of}. The student needs the \
             teacher only while it learns."
        );
        page.section("teacher", "Teacher", &format!("<p>{}</p>", escape(&text)));
    }
    #[cfg(feature = "render")]
    if description.teacher.is_none() && description.sight.is_some() {
        let text = "A critic and another actor, which see the state, learn beside the policy, which \
                    sees pictures. The policy needs them only while it learns.";
        page.section("critic", "Critic", &format!("<p>{text}</p>"));
    }
    let mut episodes = String::new();
    let first_seed = policy.header().success.map_or(0, |success| success.first_seed);
    for seed in first_seed..first_seed + NUM_PLAYED {
        let mut env = tasks.make(description.config())?;
        let playback = match &mut policy {
            AnyPolicy::State(policy) => Playback::record(&mut env, policy, seed, |_, _, _| ()),
            #[cfg(feature = "render")]
            AnyPolicy::Pixels(policy) => Playback::record_seen(env, policy, seed, |_, _, _| ()),
        }?;
        let name = format!("The learned policy, seed {seed}");
        episodes += &playback.with_title(&name).html()?;
    }
    page.section("episodes", "Episodes on new seeds", &episodes);
    let settings = escape(&learner.settings_json());
    page.section("settings", "Settings", &format!("<pre>{settings}</pre>"));
    Ok(page.html())
}

/// Draws the success rate over steps and over seconds of training.
fn curves(learner: &dyn Learner) -> Result<String, PageError> {
    let (mut html, rows) = (String::new(), learner.rows());
    let episodes = learner.evaluation_episodes();
    let legend = format!("{episodes} greedy episodes, with the 95 % interval");
    let steps: fn(&CurveRow) -> f64 = |row| row.counters.steps as f64;
    let seconds: fn(&CurveRow) -> f64 = |row| row.counters.seconds;
    for (label, x) in [("environment steps", steps), ("seconds of training", seconds)] {
        let last = rows.last().map_or(1.0, x);
        let title = format!("Success rate over {label}");
        let mut plot =
            Plot::new(&title, Axis::new(label, 0.0, last), Axis::new("success rate", 0.0, 1.0));
        let band: Vec<_> =
            rows.iter().map(|row| (x(row), row.success_rate.low, row.success_rate.high)).collect();
        plot.band(Ink::Blue, &band);
        plot.line(Ink::Blue, rows.iter().map(|row| (x(row), row.success_rate.value)));
        plot.legend(Ink::Blue, &legend);
        html += &plot.svg()?;
    }
    Ok(html)
}

/// Draws the diagnostics over steps, each in a small chart.
fn diagnostics(rows: &[CurveRow]) -> Result<String, PageError> {
    let mut html = String::from("<div class=\"grid\">");
    for name in diagnostic_names(rows) {
        let value = |row: &CurveRow| {
            Some((row.counters.steps as f64, f64::from(*row.diagnostics.get(name)?)))
        };
        let points: Vec<_> = rows.iter().filter_map(value).collect();
        let last = rows.last().map_or(1.0, |row| row.counters.steps as f64);
        let values = points.iter().map(|(_, value)| *value);
        let mut plot =
            Plot::new(name, Axis::new("environment steps", 0.0, last), Axis::around("", values));
        plot.line(Ink::Blue, points);
        html += &format!("<div>{}</div>", plot.svg()?);
    }
    Ok(html + "</div>")
}
