//! The ring, compared with a plain list of episodes.

use std::collections::{BTreeMap, BTreeSet};

use crate::common::{DIMS, Result, Row, Telling, add, assert_uniform, begin, buffer, rows, step};
use her_relabel::{
    Batch, BufferConfig, GoalMixture, GoalStrategy, HerBuffer, SampleError, Sampler, UnitInterval,
};
use proptest::prelude::*;

/// A finished transition: (episode, step, ends).
type Stored = (u32, u32, (bool, bool));

/// The expected contents of the buffer.
#[derive(Default)]
struct Model {
    capacity: usize,
    /// All finished transitions, oldest first.
    finished: Vec<Stored>,
    /// For each environment, the episode and its steps so far.
    under_way: BTreeMap<usize, (u32, u32)>,
    next_episode: u32,
}

#[derive(Clone, Debug)]
enum Op {
    /// A step, after a reset if one is due, with its flags.
    Step(usize, (bool, bool)),
    End(usize),
    Discard(usize),
    Whole(u32, (bool, bool)),
    Clear,
}

impl Model {
    fn live(&self) -> &[Stored] {
        &self.finished[self.finished.len().saturating_sub(self.capacity)..]
    }

    fn finish(&mut self, episode: u32, len: u32, ends: (bool, bool)) {
        for t in 0..len {
            self.finished.push((episode, t, if t + 1 == len { ends } else { (false, false) }));
        }
    }

    fn apply(&mut self, buffer: &mut HerBuffer<f64>, op: &Op) {
        match *op {
            Op::Step(env, ends) => {
                if !self.under_way.contains_key(&env) {
                    begin(buffer, env, self.next_episode).unwrap();
                    self.under_way.insert(env, (self.next_episode, 0));
                    self.next_episode += 1;
                }
                let (episode, t) = self.under_way[&env];
                step(buffer, env, episode, t, ends).unwrap();
                self.under_way.insert(env, (episode, t + 1));
                if ends.0 || ends.1 {
                    self.under_way.remove(&env);
                    self.finish(episode, t + 1, ends);
                }
            }
            Op::End(env) => {
                let under_way = self.under_way.remove(&env);
                assert_eq!(buffer.end_episode(env).is_ok(), under_way.is_some());
                if let Some((episode, len)) = under_way {
                    self.finish(episode, len, (false, true));
                }
            }
            Op::Discard(env) => {
                let under_way = self.under_way.remove(&env);
                assert_eq!(buffer.discard_episode(env).is_ok(), under_way.is_some());
            }
            Op::Whole(len, ends) => {
                add(buffer, self.next_episode, len, ends);
                self.finish(self.next_episode, len, ends);
                self.next_episode += 1;
            }
            Op::Clear => {
                buffer.clear();
                self.finished.clear();
                self.under_way.clear();
            }
        }
    }

    /// Checks that exactly the live transitions are drawn, each whole, and only goals from among
    /// them.
    fn check(&self, buffer: &HerBuffer<f64>) {
        let live = self.live();
        assert_eq!(buffer.len(), live.len());
        assert_eq!(buffer.is_empty(), live.is_empty());
        let episodes: BTreeSet<u32> = live.iter().map(|(episode, ..)| *episode).collect();
        assert_eq!(buffer.num_episodes(), episodes.len());
        let sampler = Sampler::new(30 * live.len().max(1), GoalStrategy::Future, UnitInterval::ONE);
        let mut batch = Batch::<f64>::new();
        if live.is_empty() {
            let result = sampler.sample(buffer, &Telling, 0, &mut batch);
            assert_eq!(result, Err(SampleError::NoFinishedEpisode));
            assert_eq!(buffer.transition_ids(), None);
            return;
        }
        let (oldest, newest) = buffer.transition_ids().unwrap();
        assert_eq!((newest.get() - oldest.get()) as usize + 1, live.len());
        let states: BTreeSet<(u32, u32)> = live.iter().map(|(e, t, _)| (*e, *t + 1)).collect();
        for strategy in [GoalStrategy::Future, GoalStrategy::Final, GoalStrategy::Episode] {
            let sampler = sampler.with_goals(GoalMixture::only(strategy));
            sampler.sample(buffer, &Telling, 0, &mut batch).unwrap();
            let drawn = rows(&batch);
            let found: BTreeSet<Stored> = drawn.iter().map(|r| (r.episode, r.t, r.ends)).collect();
            assert_eq!(found, live.iter().copied().collect());
            let mut goals = BTreeSet::new();
            for Row { id, episode, t, new_goal, .. } in drawn {
                assert_eq!(live[(id - oldest.get()) as usize].0, episode);
                assert_eq!(live[(id - oldest.get()) as usize].1, t);
                let goal = new_goal.unwrap();
                assert!(goal.0 == episode && states.contains(&goal));
                goals.insert(goal);
            }
            if strategy == GoalStrategy::Episode {
                assert_eq!(goals, states);
            }
        }
    }
}

fn ends() -> impl Strategy<Value = (bool, bool)> {
    prop_oneof![
        6 => Just((false, false)),
        1 => Just((true, false)),
        1 => Just((false, true)),
        1 => Just((true, true)),
    ]
}

fn op(num_envs: usize) -> impl Strategy<Value = Op> {
    prop_oneof![
        30 => (0..num_envs, ends()).prop_map(|(env, ends)| Op::Step(env, ends)),
        2 => (0..num_envs).prop_map(Op::End),
        1 => (0..num_envs).prop_map(Op::Discard),
        6 => (1_u32..25, 0..3_u8).prop_map(|(len, end)| Op::Whole(len, (end != 1, end != 0))),
        1 => Just(Op::Clear),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn the_newest_transitions_are_live(
        capacity in prop_oneof![1_usize..12, 60_usize..70, Just(200)],
        ops in (1_usize..4).prop_flat_map(|n| prop::collection::vec(op(n), 1..120)),
    ) {
        let config = BufferConfig::new(capacity, DIMS).with_num_envs(3);
        let mut buffer = HerBuffer::<f64>::new(config).unwrap();
        let mut model = Model { capacity, ..Model::default() };
        for (at, op) in ops.iter().enumerate() {
            model.apply(&mut buffer, op);
            if at % 40 == 0 {
                model.check(&buffer);
            }
        }
        model.check(&buffer);
    }
}

#[test]
fn every_live_transition_is_equally_likely() -> Result {
    // Ten full episodes of different lengths, and a part of the oldest.
    let mut buffer = buffer(100);
    for episode in 0..40 {
        add(&mut buffer, episode, 1 + episode * 13 % 17, (false, true));
    }
    let (oldest, newest) = buffer.transition_ids().unwrap();
    assert_eq!(newest.get() - oldest.get(), 99);
    let mut counts = vec![0; 100];
    let mut batch = Batch::<f64>::new();
    let sampler = Sampler::new(100_000, GoalStrategy::Future, UnitInterval::from_k(4));
    sampler.sample(&buffer, &Telling, 0, &mut batch)?;
    for id in batch.transition() {
        counts[(id.get() - oldest.get()) as usize] += 1;
    }
    assert_uniform(&counts, "transitions");
    Ok(())
}

#[test]
fn one_exact_lap_and_several_laps_keep_the_newest() {
    for laps in [1_u32, 2, 7] {
        let mut buffer = buffer(60);
        let mut model = Model { capacity: 60, ..Model::default() };
        for _ in 0..laps * 12 {
            model.apply(&mut buffer, &Op::Whole(5, (false, true)));
        }
        assert_eq!(buffer.num_episodes(), 12);
        model.check(&buffer);
    }
}

#[test]
fn an_episode_longer_than_the_buffer_keeps_its_end() -> Result {
    for capacity in [1, 3, 10] {
        for len in [capacity as u32, 11, 20, 21, 100] {
            let mut whole = buffer(capacity);
            let mut stepped = buffer(capacity);
            let mut model = Model { capacity, next_episode: 1, ..Model::default() };
            add(&mut whole, 1, len, (true, false));
            for t in 0..len {
                let ends = (t + 1 == len, false);
                model.apply(&mut stepped, &Op::Step(0, ends));
                assert!(stepped.unfinished_steps(0)?.unwrap_or(0) <= capacity);
            }
            // The model numbers its episodes differently.
            model.finished.iter_mut().for_each(|stored| stored.0 = 1);
            model.check(&whole);
            model.check(&stepped);
        }
    }
    Ok(())
}

#[test]
fn environments_that_end_at_different_times_do_not_mix() -> Result {
    let config = BufferConfig::new(50, DIMS).with_num_envs(4);
    let mut buffer = HerBuffer::<f64>::new(config)?;
    let mut model = Model { capacity: 50, ..Model::default() };
    for round in 0..200_usize {
        for env in 0..4 {
            let ends = (round % (env + 3) == env, false);
            model.apply(&mut buffer, &Op::Step(env, ends));
        }
        model.check(&buffer);
    }
    Ok(())
}

#[test]
fn a_cleared_buffer_is_empty_and_never_reuses_a_number() -> Result {
    let mut buffer = buffer(50);
    begin(&mut buffer, 0, 1)?;
    add(&mut buffer, 2, 5, (false, true));
    let (_, newest) = buffer.transition_ids().unwrap();
    buffer.clear();
    assert_eq!((buffer.len(), buffer.num_episodes()), (0, 0));
    assert_eq!(buffer.unfinished_steps(0), Ok(None));
    let sampler = Sampler::new(4, GoalStrategy::Future, UnitInterval::ONE);
    let result = sampler.sample(&buffer, &Telling, 0, &mut Batch::<f64>::new());
    assert_eq!(result, Err(SampleError::NoFinishedEpisode));
    add(&mut buffer, 3, 5, (false, true));
    assert!(buffer.transition_ids().unwrap().0 > newest);
    Ok(())
}
