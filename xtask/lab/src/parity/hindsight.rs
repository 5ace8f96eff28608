//! Compares the samples of our replay buffer with those of Stable-Baselines3's, from the same
//! episodes.

use std::{collections::HashMap, path::Path, process::Command};

use anyhow::ensure;
use baselines::statistics::chi_square;
use fetch_env::NpRandom;
use goal_reward::{DistanceReward, GoalReward};
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, Sampler, UnitInterval,
};
use serde::Serialize;

use super::{Found, npz::Npz};
use crate::shared::python;
use fetch_cli::shared::check::{self, Check};

const EPISODES: usize = 200;
const LONGEST: usize = 50;
const DIMS: Dims = Dims { observation: 2, goal: 2, action: 1 };
/// The p-value below which two distributions count as different.
const LEAST_P_VALUE: f64 = 0.001;

#[derive(clap::Args, Serialize)]
pub struct Args {
    /// Rows to sample from each buffer by each strategy
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1000..))]
    rows: u32,
}

/// Samples rows by each strategy from both buffers and compares them.
pub fn compare(args: &Args) -> anyhow::Result<Found> {
    let rows = args.rows as usize;
    let folder = tempfile::tempdir()?;
    let (episodes, sampled) = (folder.path().join("episodes.npz"), folder.path().join("rows.npz"));
    let buffer = numbered_episodes()?;
    buffer.export_npz(&episodes)?;
    sample_theirs(folder.path(), &episodes, &sampled, rows)?;
    let mut theirs = Npz::open(&sampled)?;
    let mut checks = Vec::new();
    for (name, strategy) in [
        ("future", GoalStrategy::Future),
        ("final", GoalStrategy::Final),
        ("episode", GoalStrategy::Episode),
    ] {
        let ours = Rows::ours(&buffer, strategy, rows, 0)?;
        let theirs = Rows::theirs(&mut theirs, name, rows)?;
        let of_strategy = ours.compare(&theirs, &lengths(), name)?;
        check::print(&format!("{name} goals, {rows} rows of each buffer"), &of_strategy)?;
        checks.extend(of_strategy);
    }
    Ok(Found::of_checks("hindsight/", checks))
}

/// Returns the length of every episode, from 1 to [`LONGEST`].
fn lengths() -> Vec<usize> {
    let mut random = NpRandom::new(0);
    (0..EPISODES).map(|_| random.uniform(1.0, LONGEST as f64 + 1.0) as usize).collect()
}

/// Returns a full buffer whose observations and achieved goals are the numbers of the episode and
/// the state, so that each sampled row shows the whole draw. The desired goals are negative.
fn numbered_episodes() -> anyhow::Result<HerBuffer<f64>> {
    let lengths = lengths();
    let mut buffer = HerBuffer::new(BufferConfig::new(lengths.iter().sum(), DIMS))?;
    for (episode, length) in lengths.into_iter().enumerate() {
        let states: Vec<f64> =
            (0..=length).flat_map(|state| [episode as f64, state as f64]).collect();
        buffer.add_episode(&EpisodeData {
            observation: &states,
            achieved_goal: &states,
            desired_goal: &[-1.0 - episode as f64, 0.0],
            action: &vec![0.0; length],
            reward: &vec![-1.0; length],
            terminated: false,
            truncated: true,
            fields: &[],
        })?;
    }
    Ok(buffer)
}

fn sample_theirs(folder: &Path, episodes: &Path, out: &Path, rows: usize) -> anyhow::Result<()> {
    let python = python::environment("python-sb3", &python::STABLE_BASELINES3)?;
    let script = folder.join("sb3.py");
    std::fs::write(&script, python::SB3_SCRIPT)?;
    python::run(
        Command::new(python)
            .args([&script, Path::new("sample"), episodes, out])
            .args(["--rows", &rows.to_string()]),
    )
}

/// The columns of sampled rows that show the draw.
struct Rows {
    observation: Vec<f64>,
    desired_goal: Vec<f64>,
    next_achieved_goal: Vec<f64>,
    reward: Vec<f64>,
    terminated: usize,
}

impl Rows {
    fn ours(
        buffer: &HerBuffer<f64>,
        strategy: GoalStrategy,
        rows: usize,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let mut batch = Batch::new();
        let sampler = Sampler::new(rows, strategy, UnitInterval::from_k(4));
        sampler.sample(buffer, &DistanceReward::sparse(), seed, &mut batch)?;
        Ok(Self {
            observation: batch.observation().to_vec(),
            desired_goal: batch.desired_goal().to_vec(),
            next_achieved_goal: batch.next_achieved_goal().to_vec(),
            reward: batch.reward().to_vec(),
            terminated: batch.terminated().iter().filter(|terminated| **terminated).count(),
        })
    }

    fn theirs(npz: &mut Npz, strategy: &str, rows: usize) -> anyhow::Result<Self> {
        let mut column = |name: &str, width| -> anyhow::Result<Vec<f64>> {
            let (values, shape) = npz.array(&format!("{strategy}_{name}"))?;
            ensure!(values.len() == rows * width, "the array {name} has the shape {shape:?}");
            Ok(values)
        };
        let desired_goal = column("desired_goal", DIMS.goal)?;
        ensure!(desired_goal == column("next_desired_goal", DIMS.goal)?, "the two goals differ");
        Ok(Self {
            observation: column("observation", DIMS.observation)?,
            desired_goal,
            next_achieved_goal: column("next_achieved_goal", DIMS.goal)?,
            reward: column("reward", 1)?,
            terminated: column("terminated", 1)?.iter().filter(|flag| **flag != 0.0).count(),
        })
    }

    fn draws(&self) -> impl Iterator<Item = Draw> + '_ {
        let goals = self.desired_goal.chunks_exact(DIMS.goal);
        self.observation.chunks_exact(DIMS.observation).zip(goals).map(|(state, goal)| Draw {
            episode: state[0] as usize,
            step: state[1] as usize,
            goal: (goal[0] >= 0.0).then_some((goal[0] as usize, goal[1] as usize)),
        })
    }

    fn compare(
        &self,
        theirs: &Self,
        lengths: &[usize],
        strategy: &str,
    ) -> anyhow::Result<Vec<Check>> {
        let faults = self.faults() + theirs.faults();
        let seen = format!("{faults} rows with a foreign goal, a wrong reward or a termination");
        let relabeled = |rows: &Self| rows.draws().filter(|draw| draw.goal.is_some()).count();
        let (ours, other) = (relabeled(self) as u64, relabeled(theirs) as u64);
        let (n, m) = (self.reward.len() as u64, theirs.reward.len() as u64);
        let (_, p) = chi_square(&[ours, n - ours], &[other, m - other])?;
        let share = ours as f64 / n as f64;
        let shares = format!("ours {share:.4}, theirs {:.4}, p {p:.3}", other as f64 / m as f64);
        let name = format!("{strategy}/relabel-share");
        let share = Check::of_test(name, p, LEAST_P_VALUE, shares);
        let offset = |draw: Draw| draw.goal.map(|(_, state)| state as i64 - draw.step as i64);
        let offset_and_rest = move |draw: Draw| {
            offset(draw).map(|offset| (offset, lengths[draw.episode] - draw.step, draw.step))
        };
        Ok(vec![
            Check::none_of(format!("{strategy}/faults"), faults, seen),
            share,
            self.same(theirs, strategy, "transitions", |draw| Some((draw.episode, draw.step)))?,
            self.same(theirs, strategy, "goal-offsets", offset)?,
            self.same(theirs, strategy, "goal-offsets-by-step-and-rest", offset_and_rest)?,
        ])
    }

    /// Tests whether both draw the categories equally often.
    fn same<K: Eq + std::hash::Hash>(
        &self,
        theirs: &Self,
        strategy: &str,
        name: &str,
        category: impl Fn(Draw) -> Option<K>,
    ) -> anyhow::Result<Check> {
        let mut counts: HashMap<K, [u64; 2]> = HashMap::new();
        for (which, rows) in [self, theirs].into_iter().enumerate() {
            for key in rows.draws().filter_map(&category) {
                counts.entry(key).or_default()[which] += 1;
            }
        }
        let of = |which: usize| counts.values().map(|both| both[which]).collect::<Vec<_>>();
        let (statistic, p) = chi_square(&of(0), &of(1))?;
        let n = counts.len();
        let seen = format!("chi-square {statistic:.3} per degree, p {p:.3}, {n} categories");
        Ok(Check::of_test(format!("{strategy}/{name}"), p, LEAST_P_VALUE, seen))
    }

    /// Returns the number of rows whose goal is another episode's, whose reward is not the goal's,
    /// or that are terminated.
    fn faults(&self) -> usize {
        let reward = DistanceReward::sparse();
        let goals = self.desired_goal.chunks_exact(DIMS.goal);
        let pairs = self.next_achieved_goal.chunks_exact(DIMS.goal).zip(goals);
        let foreign = self
            .draws()
            .filter(|draw| draw.goal.is_some_and(|(episode, _)| episode != draw.episode));
        let wrong = pairs.zip(&self.reward).filter(|((achieved, desired), given)| {
            reward.reward(achieved, desired).to_bits() != given.to_bits()
        });
        foreign.count() + wrong.count() + self.terminated
    }
}

/// The draw of a row: its episode and step and, if it is relabeled, the episode and state of its
/// goal.
#[derive(Clone, Copy)]
struct Draw {
    episode: usize,
    step: usize,
    goal: Option<(usize, usize)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_comparison_tells_strategies_apart_and_not_seeds() -> anyhow::Result<()> {
        let buffer = numbered_episodes()?;
        let rows = |strategy, seed| Rows::ours(&buffer, strategy, 20_000, seed);
        let future = rows(GoalStrategy::Future, 1)?;
        let same = future.compare(&rows(GoalStrategy::Future, 2)?, &lengths(), "future")?;
        assert!(same.iter().all(|check| check.passed), "{same:?}");
        let other = future.compare(&rows(GoalStrategy::Episode, 2)?, &lengths(), "future")?;
        let failed = other.iter().filter(|check| !check.passed).map(|check| check.name.as_str());
        assert_eq!(
            failed.collect::<Vec<_>>(),
            ["future/goal-offsets", "future/goal-offsets-by-step-and-rest"]
        );
        Ok(())
    }
}
