//! The options that leave something out have the documented probabilities: rows whose goal was
//! already achieved, and motionless episodes.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::common::{DIMS, Result, Telling, assert_distribution, draw};
use goal_reward::GoalReward;
use her_relabel::{
    Batch, BufferConfig, ConfigError, EpisodeData, GoalStrategy, HerBuffer, LoadError,
    MotionlessEpisodes, Priorities, PriorityUnit, Sampler, StepData, TransitionId, UnitInterval,
};

/// The goals achieved in the states of the episode: the object moves twice.
const GOALS: [f64; 8] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0];
const STEPS: usize = GOALS.len() - 1;

/// A state achieves the goals that are not ahead of it, so that the two goals are told apart.
struct AtLeast;

impl GoalReward for AtLeast {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        f64::from(u8::from(self.is_success(achieved_goal, desired_goal))) - 1.0
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal[0] >= desired_goal[0]
    }
}

/// Adds an episode with these goals. The desired one is achieved in the middle.
fn add(buffer: &mut HerBuffer<f64>, goals: &[f64]) -> Result {
    let steps = goals.len() - 1;
    let achieved: Vec<f64> = goals.iter().flat_map(|goal| [*goal, 0.0, 0.5]).collect();
    buffer.add_episode(&EpisodeData {
        observation: &(0..2 * goals.len()).map(|at| (at / 2) as f64).collect::<Vec<_>>(),
        achieved_goal: &achieved,
        desired_goal: &[1.0, 0.0, 0.5],
        action: &vec![0.0; steps],
        reward: &vec![-1.0; steps],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    Ok(())
}

/// A row: its step, and the step that achieved its goal if the goal is new.
type Drawn = (usize, Option<usize>);

fn count(
    buffer: &HerBuffer<f64>,
    sampler: &Sampler,
    counts: &mut BTreeMap<Drawn, u64>,
) -> Result<Batch<f64>> {
    let mut batch = Batch::<f64>::new();
    let first = buffer.transition_ids().ok_or("empty")?.0.get();
    for seed in 0..200 {
        sampler.sample(buffer, &AtLeast, seed, &mut batch)?;
        for (transition, source) in batch.transition().iter().zip(batch.goal_source()) {
            let step = (transition.get() - first) as usize;
            let source = source.map(|source| (source.get() - first) as usize);
            *counts.entry((step, source)).or_default() += 1;
        }
    }
    Ok(batch)
}

#[test]
fn achieved_goals_are_drawn_with_the_documented_probability() -> Result {
    let weights: Vec<f64> = (0..STEPS).map(|step| 1.0 + step as f64 / 2.0).collect();
    let config =
        BufferConfig::new(STEPS, DIMS).with_priorities(Priorities::new(PriorityUnit::Transition));
    let mut buffer = HerBuffer::<f64>::new(config)?;
    add(&mut buffer, &GOALS)?;
    let ratio = UnitInterval::new(0.6)?;
    let plain = Sampler::new(500, GoalStrategy::Future, ratio);
    let mut batch = Batch::<f64>::new();
    plain.sample(&buffer, &AtLeast, 0, &mut batch)?;
    let first = buffer.transition_ids().ok_or("empty")?.0;
    let ids: Vec<_> =
        (0..STEPS as u64).filter_map(|step| TransitionId::new(first.get() + step)).collect();
    buffer.set_priorities(&ids, &weights)?;
    for (kept, by_priority) in [(0.2, false), (0.0, false), (0.7, true), (1.0, true)] {
        let beta = by_priority.then_some(UnitInterval::ONE);
        let sampler =
            plain.with_keep_already_achieved(UnitInterval::new(kept)?).with_priorities(beta);
        // The probability of each row without the option, and whether its goal was achieved before
        // the step.
        let mut rows = Vec::new();
        for step in 0..STEPS {
            let share = match by_priority {
                true => weights[step] / weights.iter().sum::<f64>(),
                false => 1.0 / STEPS as f64,
            };
            rows.push(((step, None), share * (1.0 - ratio.get()), GOALS[step] == 1.0));
            for source in step..STEPS {
                let q = share * ratio.get() / (STEPS - step) as f64;
                rows.push(((step, Some(source)), q, GOALS[source + 1] == GOALS[step]));
            }
        }
        let p: f64 = rows.iter().filter(|(.., already)| *already).map(|(_, q, _)| q).sum();
        let r = p * (1.0 - kept);
        let s = 1.0 + r + r * r;
        let probability = |q: f64, already| q * (if already { kept * s } else { s } + r.powi(3));
        let shares: Vec<f64> =
            rows.iter().map(|(_, q, already)| probability(*q, *already)).collect();
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let mut counts = BTreeMap::new();
        let batch = count(&buffer, &sampler, &mut counts)?;
        let counts: Vec<u64> =
            rows.iter().map(|(row, ..)| counts.get(row).copied().unwrap_or(0)).collect();
        assert_distribution(&counts, &shares, &format!("kept {kept}"));
        // The weights correct for the priorities alone.
        if by_priority {
            let of = |row: usize| weights[(batch.transition()[row].get() - first.get()) as usize];
            let least = (0..batch.len()).map(of).fold(f64::INFINITY, f64::min);
            for (row, weight) in batch.importance_weight().iter().enumerate() {
                assert_eq!(*weight, least / of(row));
            }
        }
    }
    Ok(())
}

#[test]
fn the_option_off_changes_no_batch_and_bounded_work_ends() -> Result {
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(100, DIMS))?;
    // Every goal is achieved before every step.
    add(&mut buffer, &[1.0; 9])?;
    let sampler = Sampler::new(300, GoalStrategy::Future, UnitInterval::from_k(4));
    let (mut batch, mut off) = (Batch::<f64>::new(), Batch::<f64>::new());
    sampler.sample(&buffer, &AtLeast, 1, &mut batch)?;
    sampler.with_keep_already_achieved(UnitInterval::ONE).sample(&buffer, &AtLeast, 1, &mut off)?;
    assert_eq!(batch, off);
    let none = sampler.with_keep_already_achieved(UnitInterval::ZERO);
    none.sample(&buffer, &AtLeast, 1, &mut off)?;
    assert_eq!(off.len(), 300);
    assert_ne!(batch, off, "the fourth draws");
    Ok(())
}

#[test]
fn rows_are_drawn_four_times_at_most() -> Result {
    struct Counted(AtomicU32);

    impl GoalReward for Counted {
        fn reward(&self, _: &[f64], _: &[f64]) -> f64 {
            0.0
        }
        fn is_success(&self, _: &[f64], _: &[f64]) -> bool {
            self.0.fetch_add(1, Ordering::Relaxed);
            true
        }
    }

    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(100, DIMS))?;
    add(&mut buffer, &GOALS)?;
    let sampler = Sampler::new(50, GoalStrategy::Future, UnitInterval::from_k(4))
        .with_keep_already_achieved(UnitInterval::ZERO);
    let counted = Counted(AtomicU32::new(0));
    sampler.sample(&buffer, &counted, 1, &mut Batch::<f64>::new())?;
    // The fourth draw is taken whatever its goal.
    assert_eq!(counted.0.into_inner(), 3 * 50);
    Ok(())
}

#[test]
fn batches_whose_rows_are_drawn_again_are_pinned() -> Result {
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(100, DIMS))?;
    add(&mut buffer, &GOALS)?;
    let sampler = Sampler::new(12, GoalStrategy::Future, UnitInterval::from_k(4))
        .with_keep_already_achieved(UnitInterval::new(0.25)?);
    let mut batch = Batch::<f64>::new();
    sampler.sample(&buffer, &AtLeast, 7, &mut batch)?;
    let first = buffer.transition_ids().ok_or("empty")?.0.get();
    let step = |id: TransitionId| id.get() - first;
    let sources = batch.goal_source().iter().map(|source| source.map(step));
    let drawn: Vec<_> = batch.transition().iter().map(|id| step(*id)).zip(sources).collect();
    // Computed by another program from the definition of SplitMix64. Rows 2, 5 and 6 are the second
    // draws, and row 3 is the third.
    let expected = [
        (2, Some(6)),
        (3, Some(4)),
        (2, Some(3)),
        (4, None),
        (6, Some(6)),
        (0, None),
        (1, Some(3)),
        (6, Some(6)),
        (2, Some(4)),
        (0, None),
        (4, None),
        (0, Some(3)),
    ];
    assert_eq!(drawn, expected);
    Ok(())
}

fn motionless_buffer(kept: f64, seed: u64) -> Result<HerBuffer<f64>> {
    let motionless = MotionlessEpisodes::new(0.5, UnitInterval::new(kept)?).with_seed(seed);
    Ok(HerBuffer::new(BufferConfig::new(100_000, DIMS).with_motionless_episodes(motionless))?)
}

/// The numbers of the kept episodes, which are their first goals.
fn kept(buffer: &HerBuffer<f64>) -> Result<Vec<u32>> {
    let sampler = Sampler::new(120_000, GoalStrategy::Future, UnitInterval::ZERO);
    let mut batch = Batch::<f64>::new();
    if sampler.sample(buffer, &Telling, 0, &mut batch).is_err() {
        return Ok(Vec::new());
    }
    let mut numbers: Vec<u32> =
        batch.achieved_goal().chunks_exact(3).map(|goal| goal[0] as u32).collect();
    numbers.sort_unstable();
    numbers.dedup();
    assert_eq!(numbers.len(), buffer.num_episodes());
    Ok(numbers)
}

fn add_numbered(buffer: &mut HerBuffer<f64>, number: u32) -> Result {
    let start = f64::from(number);
    // One in four moves, and the others come back just in time or stay at the very bound.
    let farthest = [0.75, 0.0, 0.5, 0.25][number as usize % 4];
    add(buffer, &[start, start + farthest, start])
}

#[test]
fn the_documented_share_of_motionless_episodes_is_kept() -> Result {
    let total = 4000;
    let mut by_seed = Vec::new();
    for (share, seed) in [(0.1, 0), (0.1, 1), (0.5, 0), (0.0, 0), (1.0, 0)] {
        let mut buffer = motionless_buffer(share, seed)?;
        (0..total).try_for_each(|number| add_numbered(&mut buffer, number))?;
        let kept = kept(&buffer)?;
        let (moving, motionless): (Vec<u32>, Vec<u32>) =
            kept.iter().partition(|number| **number % 4 == 0);
        assert_eq!(moving.len(), total as usize / 4, "an episode that moves is always kept");
        let all = f64::from(total) * 0.75;
        let deviation = (all * share * (1.0 - share)).sqrt();
        assert!(
            (motionless.len() as f64 - all * share).abs() <= 5.0 * deviation,
            "{}",
            motionless.len()
        );
        by_seed.push(motionless);
    }
    assert_ne!(by_seed[0], by_seed[1]);
    Ok(())
}

#[test]
fn a_loaded_buffer_keeps_the_motionless_episodes_that_the_saved_one_would() -> Result {
    let mut never_saved = motionless_buffer(0.3, 7)?;
    let mut saved = never_saved.clone();
    for number in 0..200 {
        add_numbered(&mut never_saved, number)?;
        add_numbered(&mut saved, number)?;
        let mut bytes = Vec::new();
        saved.write_to(&mut bytes)?;
        saved = HerBuffer::read_from(&bytes[..])?;
        assert_eq!(saved.config(), never_saved.config());
    }
    assert_eq!(kept(&saved)?, kept(&never_saved)?);
    // An episode of steps is judged as a whole one is.
    let mut by_steps = motionless_buffer(0.3, 7)?;
    for number in 0..200_u32 {
        let start = f64::from(number);
        let farthest = [0.75, 0.0, 0.5, 0.25][number as usize % 4];
        let goals = [start, start + farthest, start].map(|goal| [goal, 0.0, 0.5]);
        by_steps.begin_episode(
            0,
            &her_relabel::StartData {
                observation: &[0.0; 2],
                achieved_goal: &goals[0],
                desired_goal: &[1.0, 0.0, 0.5],
            },
        )?;
        for (t, goal) in goals[1..].iter().enumerate() {
            by_steps.add_step(
                0,
                &StepData {
                    action: &[0.0],
                    reward: -1.0,
                    next_observation: &[t as f64 + 1.0; 2],
                    next_achieved_goal: goal,
                    terminated: false,
                    truncated: t == 1,
                    fields: &[],
                },
            )?;
        }
    }
    assert_eq!(kept(&by_steps)?, kept(&never_saved)?);
    Ok(())
}

#[test]
fn a_file_with_a_share_above_one_is_damaged() -> Result {
    let mut bytes = Vec::new();
    motionless_buffer(0.5, 0)?.write_to(&mut bytes)?;
    let at = bytes.windows(8).position(|word| word == 0.5_f64.to_le_bytes());
    let share = at.ok_or("no distance")? + 8;
    bytes[share..share + 8].copy_from_slice(&1.5_f64.to_le_bytes());
    let loaded = HerBuffer::<f64>::read_from(&crate::damaged::sealed(bytes)[..]);
    assert!(matches!(loaded, Err(LoadError::Damaged)));
    Ok(())
}

#[test]
fn a_distance_that_is_none_is_refused() -> Result {
    for distance in [-0.1, f64::NAN, f64::INFINITY] {
        let motionless = MotionlessEpisodes::new(distance, UnitInterval::ONE);
        let refused =
            HerBuffer::<f32>::new(BufferConfig::new(9, DIMS).with_motionless_episodes(motionless));
        assert!(matches!(refused, Err(ConfigError::BadDistance { .. })));
    }
    let config = BufferConfig::new(9, DIMS)
        .with_motionless_episodes(MotionlessEpisodes::new(0.01, UnitInterval::new(0.1)?));
    let text = serde_json::to_string(&config)?;
    assert_eq!(serde_json::from_str::<BufferConfig>(&text)?, config);
    // A batch of plain settings is as it was.
    let mut buffer = HerBuffer::new(config)?;
    crate::common::add(&mut buffer, 1, 5, (false, true));
    assert_eq!(draw(&buffer, &crate::common::relabel_all(9, GoalStrategy::Final), 0).len(), 9);
    Ok(())
}
