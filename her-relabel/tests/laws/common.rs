//! Episodes in which every number identifies its place, and checks of the rows drawn from them.

use goal_reward::GoalReward;
use her_relabel::{
    AddError, Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, Sampler, StartData,
    StepData, UnitInterval,
};

pub(crate) type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

pub(crate) const DIMS: Dims = Dims { observation: 2, goal: 3, action: 1 };

pub(crate) fn buffer(capacity: usize) -> HerBuffer<f64> {
    HerBuffer::new(BufferConfig::new(capacity, DIMS)).unwrap()
}

/// State `t` of episode `episode`.
pub(crate) fn observation(episode: u32, t: u32) -> [f64; 2] {
    [f64::from(episode), f64::from(t)]
}

pub(crate) fn achieved_goal(episode: u32, t: u32) -> [f64; 3] {
    [f64::from(episode), f64::from(t), 0.25]
}

pub(crate) fn desired_goal(episode: u32) -> [f64; 3] {
    [f64::from(episode), -1.0, 0.5]
}

/// Step `t` of episode `episode`, from state `t` to state `t + 1`.
pub(crate) fn action(episode: u32, t: u32) -> [f64; 1] {
    [f64::from(episode * 1000 + t) + 0.125]
}

pub(crate) fn reward(episode: u32, t: u32) -> f64 {
    -f64::from(episode * 1000 + t) - 0.5
}

pub(crate) fn begin(buffer: &mut HerBuffer<f64>, env: usize, episode: u32) -> Result<(), AddError> {
    buffer.begin_episode(
        env,
        &StartData {
            observation: &observation(episode, 0),
            achieved_goal: &achieved_goal(episode, 0),
            desired_goal: &desired_goal(episode),
        },
    )
}

/// Adds step `t`; `ends` is (terminated, truncated).
pub(crate) fn step(
    buffer: &mut HerBuffer<f64>,
    env: usize,
    episode: u32,
    t: u32,
    ends: (bool, bool),
) -> Result<(), AddError> {
    buffer.add_step(
        env,
        &StepData {
            action: &action(episode, t),
            reward: reward(episode, t),
            next_observation: &observation(episode, t + 1),
            next_achieved_goal: &achieved_goal(episode, t + 1),
            terminated: ends.0,
            truncated: ends.1,
            fields: &[],
        },
    )
}

/// Adds a whole episode of `len` steps.
pub(crate) fn add(buffer: &mut HerBuffer<f64>, episode: u32, len: u32, ends: (bool, bool)) {
    let observations: Vec<f64> = (0..=len).flat_map(|t| observation(episode, t)).collect();
    let achieved_goals: Vec<f64> = (0..=len).flat_map(|t| achieved_goal(episode, t)).collect();
    let actions: Vec<f64> = (0..len).flat_map(|t| action(episode, t)).collect();
    let rewards: Vec<f64> = (0..len).map(|t| reward(episode, t)).collect();
    buffer
        .add_episode(&EpisodeData {
            observation: &observations,
            achieved_goal: &achieved_goals,
            desired_goal: &desired_goal(episode),
            action: &actions,
            reward: &rewards,
            terminated: ends.0,
            truncated: ends.1,
            fields: &[],
        })
        .unwrap();
}

/// A reward that depends on both arguments and never equals a stored reward.
pub(crate) struct Telling;

impl GoalReward for Telling {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        1e6 + 1e3 * achieved_goal[1] + desired_goal[1]
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal == desired_goal
    }
}

/// A row of a batch, read back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) id: u64,
    pub(crate) episode: u32,
    /// The step: from state `t` to state `t + 1`.
    pub(crate) t: u32,
    pub(crate) ends: (bool, bool),
    /// The episode and the state in which the new goal was achieved.
    pub(crate) new_goal: Option<(u32, u32)>,
    /// The number of transitions by which the goal's source lies ahead.
    pub(crate) ahead: Option<i64>,
}

/// Reads a row back and checks that all its numbers belong together.
pub(crate) fn read(batch: &Batch<f64>, row: usize) -> Row {
    let vector = |column: &[f64], dim: usize| column[row * dim..][..dim].to_vec();
    let seen = vector(batch.observation(), 2);
    let (episode, t) = (seen[0] as u32, seen[1] as u32);
    assert_eq!(seen, observation(episode, t));
    assert_eq!(vector(batch.achieved_goal(), 3), achieved_goal(episode, t));
    assert_eq!(vector(batch.action(), 1), action(episode, t));
    assert_eq!(vector(batch.next_observation(), 2), observation(episode, t + 1));
    assert_eq!(vector(batch.next_achieved_goal(), 3), achieved_goal(episode, t + 1));
    let id = batch.transition()[row].get();
    let goal = vector(batch.desired_goal(), 3);
    let source = batch.goal_source()[row];
    let new_goal = if source.is_some() {
        let (goal_episode, state) = (goal[0] as u32, goal[1] as u32);
        assert_eq!(goal, achieved_goal(goal_episode, state));
        let expected = Telling.reward(&achieved_goal(episode, t + 1), &goal);
        assert_eq!(batch.reward()[row], expected);
        Some((goal_episode, state))
    } else {
        assert_eq!(goal, desired_goal(episode));
        assert_eq!(batch.reward()[row].to_bits(), reward(episode, t).to_bits());
        None
    };
    let ends = (batch.terminated()[row], batch.truncated()[row]);
    let ahead = source.map(|source| source.get() as i64 - id as i64);
    Row { id, episode, t, ends, new_goal, ahead }
}

pub(crate) fn rows(batch: &Batch<f64>) -> Vec<Row> {
    assert!(batch.relabeled().eq(batch.goal_source().iter().map(Option::is_some)));
    (0..batch.len()).map(|row| read(batch, row)).collect()
}

/// Draws the batch of a seed and reads its rows back.
pub(crate) fn draw(buffer: &HerBuffer<f64>, sampler: &Sampler, seed: u64) -> Vec<Row> {
    let mut batch = Batch::<f64>::new();
    sampler.sample(buffer, &Telling, seed, &mut batch).unwrap();
    rows(&batch)
}

/// Settings that relabel every row.
pub(crate) fn relabel_all(batch_size: usize, strategy: GoalStrategy) -> Sampler {
    Sampler::new(batch_size, strategy, UnitInterval::ONE)
}

/// Asserts that counts fit a uniform distribution: Pearson's chi-square is below a bound that
/// chance exceeds about once in a million (Wilson and Hilferty's approximation).
pub(crate) fn assert_uniform(counts: &[u64], what: &str) {
    let total: u64 = counts.iter().sum();
    let shares = vec![1.0 / counts.len() as f64; counts.len()];
    assert!(total >= 20 * counts.len() as u64, "{what}: too few draws to judge");
    assert_distribution(counts, &shares, what);
}

/// Asserts that counts fit a distribution, given by its probabilities.
pub(crate) fn assert_distribution(counts: &[u64], shares: &[f64], what: &str) {
    assert_eq!(counts.len(), shares.len());
    let total: f64 = counts.iter().sum::<u64>() as f64;
    let statistic: f64 = counts
        .iter()
        .zip(shares)
        .map(|(count, share)| (*count as f64 - total * share).powi(2) / (total * share))
        .sum();
    let freedom = counts.len() as f64 - 1.0;
    if freedom == 0.0 {
        return;
    }
    let ninth = 2.0 / (9.0 * freedom);
    let bound = freedom * (1.0 - ninth + 4.75 * ninth.sqrt()).powi(3);
    assert!(statistic < bound, "{what}: chi-square {statistic:.1}, at most {bound:.1}: {counts:?}");
}
