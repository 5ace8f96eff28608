//! `exercise`: answers the chapter's exercises 1 to 4 by running them.

use anyhow::Context;
use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, GoalObservation, ObservationField, make, observation_fields};
use fetch_sim::Task;
use nalgebra::Vector3;

use super::random_episodes::evaluate_random;
use crate::shared::env_id::DENSE_REACH;

#[derive(clap::Args)]
pub struct Args {
    /// Number of the exercise, 1 to 4
    #[arg(value_parser = numbered)]
    number: Exercise,
    /// Seed of the first reset, and of the random policy
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// An exercise: prints its answer, and returns whether it is as expected.
type Exercise = fn(u64) -> anyhow::Result<bool>;

pub fn run(args: &Args) -> anyhow::Result<bool> {
    (args.number)(args.seed)
}

fn numbered(number: &str) -> Result<Exercise, &'static str> {
    Ok(match number {
        "1" => observations,
        "2" => rewards,
        "3" => push,
        "4" => thresholds,
        _ => return Err("the exercises are 1 to 4"),
    })
}

/// Answers exercise 1: the observation's structure over five seeds, and the range of the goals.
fn observations(seed: u64) -> anyhow::Result<bool> {
    const RESETS: usize = 5;
    say!("Exercise 1: FetchReachDense-v4 over {RESETS} seeds")?;
    let mut env = make("FetchReachDense-v4")?;
    let mut goals = Vec::new();
    let mut same_shapes = true;
    for seed in (seed..).take(RESETS) {
        let observation = env.reset(Some(seed))?.observation;
        let goal = observation.desired_goal().to_vec();
        same_shapes &= observation.observation().len() == 10
            && observation.achieved_goal().len() == 3
            && goal.len() == 3;
        say!("  seed {seed}: observation (10,), achieved_goal (3,), desired_goal (3,) {goal:.3?}")?;
        goals.push(goal);
    }
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let along = || goals.iter().map(|goal| goal[axis]);
        let (low, high) = (along().fold(f64::MAX, f64::min), along().fold(f64::MIN, f64::max));
        say!("  desired_goal {name}: {low:.3} to {high:.3} m")?;
    }
    let differ = goals.windows(2).all(|pair| pair[0] != pair[1]);
    say!("Same keys and shapes: {same_shapes}. Goals differ: {differ}.")?;
    Ok(same_shapes && differ)
}

/// One episode of Reach with both rewards.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// The rewards of its steps.
    pub steps: Vec<StepRewards>,
    /// Whether both environments gave the same observations, and the dense reward is the negative
    /// distance.
    pub same: bool,
}

/// Both rewards of a step.
#[derive(Clone, Copy, Debug)]
pub struct StepRewards {
    /// Distance to the goal, in meters.
    pub distance: f64,
    /// The dense reward.
    pub dense: f64,
    /// The sparse reward.
    pub sparse: f64,
}

impl Trajectory {
    /// Steps FetchReachDense-v4 and FetchReach-v4 with the same actions.
    ///
    /// # Errors
    /// An environment cannot be made or stepped.
    pub fn of(policy: &mut impl Policy, seed: u64) -> anyhow::Result<Self> {
        let mut dense = make("FetchReachDense-v4")?;
        let mut sparse = make("FetchReach-v4")?;
        let mut observation = dense.reset(Some(seed))?.observation;
        let mut same = observation == sparse.reset(Some(seed))?.observation;
        let (mut steps, mut action) = (Vec::new(), [0.0; 4]);
        loop {
            policy.act(&observation, &mut action);
            let d = dense.step(&action)?;
            let s = sparse.step(&action)?;
            let is_last = d.is_last();
            observation = d.observation;
            let distance = d.info.distance;
            same &= observation == s.observation && d.reward == -distance;
            steps.push(StepRewards { distance, dense: d.reward, sparse: s.reward });
            if is_last {
                return Ok(Self { steps, same });
            }
        }
    }
}

/// Answers exercise 2: dense and sparse rewards along one trajectory.
fn rewards(seed: u64) -> anyhow::Result<bool> {
    say!("Exercise 2: FetchReachDense-v4 and FetchReach-v4, seed {seed}, the same random actions")?;
    let mut policy = RandomPolicy::new(make(DENSE_REACH)?.action_space(), seed);
    let Trajectory { steps, same } = Trajectory::of(&mut policy, seed)?;
    say!("  step  distance     dense  sparse")?;
    for (t, step) in (1..).zip(&steps) {
        say!("  {t:4}  {:.4} m  {:8.4}  {:6}", step.distance, step.dense, step.sparse)?;
    }
    let dense_return: f64 = steps.iter().map(|step| step.dense).sum();
    let sparse_return: f64 = steps.iter().map(|step| step.sparse).sum();
    let (reached, missed): (Vec<&StepRewards>, Vec<&StepRewards>) =
        steps.iter().partition(|step| step.sparse == 0.0);
    let farthest_zero = reached.iter().map(|s| s.distance).fold(f64::NEG_INFINITY, f64::max);
    let nearest_minus_one = missed.iter().map(|s| s.distance).fold(f64::INFINITY, f64::min);
    say!(
        "(a) The dense return is {dense_return:.2}, the sparse one {sparse_return:.2}: the dense \
         return is not more negative."
    )?;
    say!("(b) The sparse reward is 0 in {} of {} steps.", reached.len(), steps.len())?;
    say!(
        "(c) It switches at 0.05 m: -1 from {nearest_minus_one:.4} m on in this episode, 0 up to \
         {farthest_zero:.4} m (-inf: never)."
    )?;
    Ok(same && nearest_minus_one > 0.05 && farthest_zero <= 0.05)
}

/// Answers exercise 3: the 25 numbers of FetchPush.
fn push(seed: u64) -> anyhow::Result<bool> {
    say!("Exercise 3: FetchPushDense-v4, seed {seed}")?;
    let mut env = make("FetchPushDense-v4")?;
    let first = env.reset(Some(seed))?.observation;
    for field in observation_fields(Task::Push) {
        let values = &first.observation()[field.range.clone()];
        let indices = format!("{}-{}", field.range.start, field.range.end - 1);
        say!("  {indices:>5}  {:<15} {:<8} {values:.4?}", field.name, field.unit)?;
    }
    let field = ObservationField::find(Task::Push, "object_pos").context("an unknown field")?;
    let object = &first.observation()[field.range.clone()];
    let tracks_object = first.achieved_goal() == object;
    say!(
        "(a) The object's position is at indices {} to {}: {object:.4?} m.",
        field.range.start,
        field.range.end - 1
    )?;
    say!("(b) achieved_goal is the object's position: {tracks_object}.")?;
    for _ in 0..49 {
        env.step(&[0.0; 4])?;
    }
    let last = env.step(&[0.0; 4])?.observation;
    let position = |goal: &[f64]| Vector3::from_column_slice(goal);
    let moved = (position(last.achieved_goal()) - position(first.achieved_goal())).norm();
    say!("(c) After 50 steps of [0, 0, 0, 0] the object has moved by {:.3} mm.", 1e3 * moved)?;
    Ok(tracks_object && moved < 1e-3)
}

/// Answers exercise 4: success against the distance threshold.
fn thresholds(seed: u64) -> anyhow::Result<bool> {
    const EPISODES: usize = 100;
    const THRESHOLDS: [f64; 5] = [0.01, 0.02, 0.05, 0.10, 0.20];
    let id = DENSE_REACH;
    say!("Exercise 4: {id}, {EPISODES} random episodes from seed {seed}")?;
    say!("  threshold  success at the last step (95 % interval)")?;
    let rates = evaluate_random(id, seed, EPISODES)?.success_at(&THRESHOLDS)?;
    for (threshold, rate) in THRESHOLDS.iter().zip(&rates) {
        say!("  {threshold:7.2} m  {:5.3}  ({:.3} to {:.3})", rate.value, rate.low, rate.high)?;
    }
    say!(
        "The wider the threshold, the easier the task; at the benchmark's 0.05 m random \
         actions hardly ever succeed."
    )?;
    Ok(rates.is_sorted_by(|a, b| a.value <= b.value) && rates[2].value < 0.1)
}
