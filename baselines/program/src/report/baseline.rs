//! The baselines: evaluated, compared with the reference, and the distributions of their episodes.

use crate::shared::reference::RandomReference;
use baselines::{
    Episode, Estimate, Evaluation, Policy, evaluate,
    page::{Axis, Column, Ink, Plot, table},
};
use fetch_env::{EnvId, FetchObservation, GoalObservation, Task, make};
use goal_reward::RewardKind;
use rayon::prelude::*;

use crate::shared::{
    choice::{PolicyChoice, flag_name},
    progress,
};

pub struct Outcome {
    pub id: EnvId,
    pub policy: PolicyChoice,
    pub evaluation: Evaluation,
    pub ranges: Ranges,
}

impl Outcome {
    fn of(id: EnvId, policy: PolicyChoice, episodes: usize, seed: u64) -> anyhow::Result<Self> {
        let mut env = make(id)?;
        let mut watched = Watched { policy: policy.policy(&env, seed)?, ranges: Ranges::new() };
        let evaluation = evaluate(&mut env, &mut watched, episodes, seed, |_| ())?;
        Ok(Self { id, policy, evaluation, ranges: watched.ranges })
    }

    /// Returns the color of the policy in all plots.
    pub fn ink(&self) -> Ink {
        match self.policy {
            PolicyChoice::Random | PolicyChoice::Zero => Ink::Orange,
            PolicyChoice::Proportional | PolicyChoice::Scripted => Ink::Blue,
            PolicyChoice::Trained | PolicyChoice::Robust => Ink::Teal,
        }
    }
}

/// Evaluates the random policy in all eight environments, the scripted and the trained ones in
/// those with dense reward.
pub fn evaluate_all(episodes: usize, seed: u64) -> anyhow::Result<Vec<Outcome>> {
    let random = EnvId::ALL.map(|id| (id, PolicyChoice::Random));
    let others = Task::ALL.into_iter().flat_map(|task| {
        let id = EnvId { task, reward: RewardKind::Dense };
        [(id, PolicyChoice::Scripted), (id, PolicyChoice::Trained)]
    });
    let all: Vec<_> = random.into_iter().chain(others).collect();
    let bar = progress::bar(all.len(), "baselines");
    let outcomes = all
        .into_par_iter()
        .map(|(id, policy)| {
            let outcome = Outcome::of(id, policy, episodes, seed)?;
            bar.inc(1);
            progress::note(&bar, format_args!("evaluated {id}, {} policy", flag_name(policy)));
            Ok(outcome)
        })
        .collect();
    bar.finish_and_clear();
    outcomes
}

/// The lowest and the highest value of each element: observation, achieved goal, desired goal.
pub type Ranges = Vec<(f64, f64)>;

/// The range of no values.
const NONE: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

/// Widens ranges to include others.
pub fn include(ranges: &mut Ranges, others: &Ranges) {
    ranges.resize(others.len(), NONE);
    for (range, other) in ranges.iter_mut().zip(others) {
        *range = (range.0.min(other.0), range.1.max(other.1));
    }
}

/// A policy that records the ranges of its observations: all but the last of each episode.
struct Watched {
    policy: Box<dyn Policy>,
    ranges: Ranges,
}

impl Policy for Watched {
    fn reset(&mut self) {
        self.policy.reset();
    }

    fn act(&mut self, o: &FetchObservation, action: &mut [f32]) {
        let values = o.observation().iter().chain(o.achieved_goal()).chain(o.desired_goal());
        include(&mut self.ranges, &values.map(|&value| (value, value)).collect());
        self.policy.act(o, action);
    }
}

const BINS: usize = 24;

/// Compares the random policy with gymnasium-robotics 1.4.2 in each environment.
pub fn against_reference(outcomes: &[Outcome]) -> anyhow::Result<String> {
    let mut rows = Vec::new();
    for outcome in outcomes.iter().filter(|outcome| outcome.policy == PolicyChoice::Random) {
        let summary = outcome.evaluation.summary()?;
        let reference = RandomReference::new(outcome.id.task, outcome.id.reward);
        let intervals =
            [summary.episode_return_mean, summary.final_distance_mean, summary.success_rate];
        let names = ["return", "final distance (m)", "success rate"];
        for ((comparison, Estimate { low, high, .. }), name) in
            reference.compare(&outcome.evaluation)?.iter().zip(intervals).zip(names)
        {
            rows.push([
                outcome.id.to_string(),
                name.into(),
                format!("{:.3}", comparison.measured),
                format!("{low:.3} to {high:.3}"),
                format!("{:.3}", comparison.reference),
                format!("{:.2}", comparison.p_value),
            ]);
        }
    }
    let columns = [
        Column::Text("Environment"),
        Column::Text("Mean of"),
        Column::Number("Here"),
        Column::Number("95 % interval"),
        Column::Number("Reference"),
        Column::Number("p"),
    ];
    Ok(format!(
        "<p>Uniformly random actions, here and in 400 episodes of gymnasium-robotics 1.4.2. \
         p is the probability of a difference this large if both were the same environment: one in \
         twenty of these {} values is below 0.05 by chance.</p>\n{}",
        rows.len(),
        table(columns, rows),
    ))
}

/// Histograms of return and final distance, and success against the threshold.
pub fn distributions(outcomes: &[Outcome]) -> anyhow::Result<String> {
    let mut html = String::from(
        "<p>The random, the scripted and the trained policy with the dense reward. The dashed line \
         is the random policy's mean in gymnasium-robotics 1.4.2, or the benchmark's threshold of \
         0.05 m. Success is counted at the last step; the pale areas are 95 % intervals.</p>\n\
         <div class=\"grid\">\n",
    );
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Dense };
        let policies: Vec<_> = outcomes.iter().filter(|outcome| outcome.id == id).collect();
        let reference = RandomReference::new(task, RewardKind::Dense);
        let returns = histogram(
            &format!("Fetch{task}: dense return"),
            "return (m, summed over steps)",
            &policies,
            |episode| episode.episode_return,
            reference.episode_return.mean,
        );
        let distances = histogram(
            &format!("Fetch{task}: final distance"),
            "distance after the last step (m)",
            &policies,
            |episode| episode.final_distance,
            reference.final_distance.mean,
        );
        for plot in [returns, distances, success(task, &policies)?] {
            html += &format!("<div>{}</div>\n", plot.svg()?);
        }
    }
    Ok(html + "</div>")
}

fn histogram(
    title: &str,
    label: &str,
    policies: &[&Outcome],
    value: fn(&Episode) -> f64,
    reference: f64,
) -> Plot {
    let values =
        |outcome: &Outcome| outcome.evaluation.episodes.iter().map(value).collect::<Vec<_>>();
    let all = policies.iter().flat_map(|outcome| values(outcome)).chain([reference]);
    let (low, high) = all.fold(NONE, |(low, high), value| (low.min(value), high.max(value)));
    let width = ((high - low) / BINS as f64).max(f64::MIN_POSITIVE);
    let counts: Vec<_> = policies
        .iter()
        .map(|outcome| {
            let mut counts = [0_usize; BINS];
            for value in values(outcome) {
                counts[(((value - low) / width) as usize).min(BINS - 1)] += 1;
            }
            let share = 100.0 / outcome.evaluation.episodes.len() as f64;
            (outcome, counts.map(|count| share * count as f64))
        })
        .collect();
    let highest = counts.iter().flat_map(|(_, shares)| *shares).fold(0.0, f64::max);
    let x = Axis::new(label, low, low + BINS as f64 * width);
    let mut plot = Plot::new(title, x, Axis::new("episodes (%)", 0.0, 1.1 * highest));
    for (outcome, shares) in counts {
        for (bin, share) in shares.into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
            let left = low + bin as f64 * width;
            plot.bar(outcome.ink(), (left, 0.0), (left + width, share));
        }
        plot.legend(outcome.ink(), &flag_name(outcome.policy));
    }
    plot.vertical(reference);
    plot
}

fn success(task: Task, policies: &[&Outcome]) -> anyhow::Result<Plot> {
    let thresholds: Vec<f64> = (0..=100).map(|i| 0.005 * f64::from(i)).collect();
    let mut plot = Plot::new(
        &format!("Fetch{task}: success against threshold"),
        Axis::new("distance threshold (m)", 0.0, 0.5),
        Axis::new("success rate", 0.0, 1.05),
    );
    for outcome in policies {
        let rates = outcome.evaluation.success_at(&thresholds)?;
        let over = || thresholds.iter().copied().zip(&rates);
        let ink = outcome.ink();
        plot.band(ink, &over().map(|(x, rate)| (x, rate.low, rate.high)).collect::<Vec<_>>());
        plot.line(ink, over().map(|(x, rate)| (x, rate.value)));
        plot.legend(ink, &flag_name(outcome.policy));
    }
    let id = EnvId { task, reward: RewardKind::Sparse };
    plot.vertical(id.config().distance_threshold().get());
    Ok(plot)
}
