//! Any sequence of calls leaves the buffer in the state of a plain list of episodes.
#![no_main]

mod common;
mod rows;

use arbitrary::Arbitrary;
use common::{DIMS, add_whole, begin, draw, step};
use her_relabel::{AddError, BufferConfig, HerBuffer, NewPriority, Priorities, PriorityUnit};
use libfuzzer_sys::fuzz_target;
use rows::{Row, record};

const NUM_ENVS: usize = 2;

#[derive(Arbitrary, Debug)]
enum Op {
    Step(bool, bool),
    Begin(bool),
    End(bool),
    Discard(bool),
    Whole(u8),
    /// A row of each environment: whether it holds a step, ends, starts an episode, and is finite.
    Record([(bool, bool, bool, bool); NUM_ENVS]),
    /// The priority of a live transition, counted from the oldest one.
    Prioritize(u16, u8),
    Clear,
    SaveAndLoad,
}

/// The expected contents of the buffer: the transitions of finished episodes as (episode, step),
/// and the episode of each environment with its steps so far.
#[derive(Default)]
struct Model {
    finished: Vec<(u8, u8)>,
    under_way: [Option<(u8, u8)>; NUM_ENVS],
    /// Whether the last episode of each environment was discarded.
    discarded: [bool; NUM_ENVS],
    episodes: u8,
}

impl Model {
    fn next(&mut self) -> u8 {
        self.episodes = self.episodes.wrapping_add(1);
        self.episodes
    }

    fn finish(&mut self, episode: u8, len: u8) {
        self.finished.extend((0..len).map(|t| (episode, t)));
    }

    /// Returns whether a step of the environment can be recorded or skipped.
    fn has_begun(&self, env: usize) -> bool {
        self.under_way[env].is_some() || self.discarded[env]
    }

    /// Returns the row of an environment, and applies its effects to the environment's episode.
    fn row(
        &mut self,
        env: usize,
        (steps, ends, starts, is_finite): (bool, bool, bool, bool),
    ) -> Row {
        let under_way = self.under_way[env];
        let (episode, t) = under_way.unwrap_or_default();
        let ends = ends || t == u8::MAX - 1;
        let is_refused = steps && !is_finite && under_way.is_some();
        self.discarded[env] |= is_refused || (!steps && ends);
        match under_way {
            Some(_) if is_refused || (!steps && ends) => self.under_way[env] = None,
            Some(_) if steps && ends => {
                self.under_way[env] = None;
                self.finish(episode, t + 1);
            }
            Some(_) if steps => self.under_way[env] = Some((episode, t + 1)),
            _ => {}
        }
        let start = starts.then(|| self.next());
        self.discarded[env] &= !starts;
        if let Some(start) = start
            && let Some((episode, len)) = self.under_way[env].replace((start, 0))
        {
            self.finish(episode, len);
        }
        let step = steps.then_some((episode, t));
        Row { step, ends, start, is_finite: !is_refused }
    }

    fn apply(&mut self, buffer: &mut HerBuffer<f32>, op: &Op) {
        match *op {
            Op::Step(env, ends) => {
                let env = usize::from(env);
                let (episode, t) = self.under_way[env].unwrap_or_default();
                let added = step(buffer, env, episode, t, ends || t == u8::MAX - 1);
                assert_eq!(added.is_ok(), self.under_way[env].is_some());
                if added.is_err() {
                } else if ends || t == u8::MAX - 1 {
                    self.under_way[env] = None;
                    self.finish(episode, t + 1);
                } else {
                    self.under_way[env] = Some((episode, t + 1));
                }
            }
            Op::Begin(env) => {
                let env = usize::from(env);
                let episode = self.next();
                let begun = begin(buffer, env, episode);
                assert_eq!(begun.is_ok(), self.under_way[env].is_none());
                self.under_way[env].get_or_insert((episode, 0));
                self.discarded[env] = false;
            }
            Op::End(env) => {
                let ended = self.under_way[usize::from(env)].take();
                assert_eq!(buffer.end_episode(usize::from(env)).is_ok(), ended.is_some());
                if let Some((episode, len)) = ended {
                    self.finish(episode, len);
                }
            }
            Op::Discard(env) => {
                let discarded = self.under_way[usize::from(env)].take();
                let result = buffer.discard_episode(usize::from(env));
                assert_eq!(result.is_ok(), discarded.is_some());
                self.discarded[usize::from(env)] |= discarded.is_some();
            }
            Op::Whole(len) => {
                let episode = self.next();
                add_whole(buffer, episode, len.max(1));
                self.finish(episode, len.max(1));
            }
            Op::Record(mut flags) => {
                if let Some(env_index) =
                    (0..NUM_ENVS).find(|env| flags[*env].0 && !self.has_begun(*env))
                {
                    let row = |(steps, ends, ..): (bool, bool, bool, bool)| {
                        let step = steps.then_some((0, 0));
                        Row { step, ends, start: None, is_finite: true }
                    };
                    let refused = record(buffer, &flags.map(row));
                    assert_eq!(refused, Err(AddError::NoEpisode { env_index }));
                    for (env, flags) in flags.iter_mut().enumerate() {
                        flags.0 &= self.has_begun(env);
                    }
                }
                let rows = [0, 1].map(|env| self.row(env, flags[env]));
                let recorded = record(buffer, &rows).expect("rows of the right lengths");
                assert_eq!(recorded.first_refusal.is_some(), rows.iter().any(|row| !row.is_finite));
            }
            Op::Prioritize(at, priority) => {
                let Ok(batch) = draw(buffer) else { return };
                let id = batch.transition()[usize::from(at) % batch.len()];
                let result = buffer.set_priorities(&[id], &[f64::from(priority)]);
                assert_eq!(result.is_ok(), buffer.config().priorities().is_some());
            }
            Op::Clear => {
                buffer.clear();
                let discarded = [0, 1].map(|env| self.has_begun(env));
                *self = Self { episodes: self.episodes, discarded, ..Self::default() };
            }
            Op::SaveAndLoad => {
                let mut bytes = Vec::new();
                buffer.write_to(&mut bytes).expect("memory takes everything");
                let loaded = HerBuffer::read_from(&bytes[..]).expect("what was saved");
                assert_eq!(draw(buffer), draw(&loaded));
                *buffer = loaded;
            }
        }
    }

    fn check(&self, buffer: &HerBuffer<f32>) {
        let live = &self.finished[self.finished.len().saturating_sub(buffer.config().capacity())..];
        assert_eq!(buffer.len(), live.len());
        let mut episodes: Vec<u8> = live.iter().map(|(episode, _)| *episode).collect();
        episodes.dedup();
        assert_eq!(buffer.num_episodes(), episodes.len());
        let Ok(batch) = draw(buffer) else { return };
        let oldest = buffer.transition_ids().expect("a batch was drawn").0.get();
        for row in 0..batch.len() {
            let (episode, t) = live[(batch.transition()[row].get() - oldest) as usize];
            let state = [f32::from(episode), f32::from(t)];
            let next = [state[0], state[1] + 1.0];
            assert_eq!(batch.observation()[2 * row..][..2], state);
            assert_eq!(batch.next_observation()[2 * row..][..2], next);
            assert_eq!(batch.action()[row], state[1]);
            assert_eq!(batch.field("value").expect("the field")[row], state[1]);
            let goal = batch.desired_goal()[row];
            match batch.goal_source()[row] {
                None => assert_eq!((goal, batch.reward()[row]), (state[0], state[0])),
                Some(source) => {
                    let (_, t) = live[(source.get() - oldest) as usize];
                    assert_eq!(goal, f32::from(t) + 1.0);
                }
            }
        }
    }
}

fuzz_target!(|input: (u8, u8, Vec<Op>)| {
    let (capacity, unit, ops) = input;
    let priorities = match unit % 3 {
        0 => None,
        1 => Some(Priorities::new(PriorityUnit::Transition)),
        _ => {
            Some(Priorities::new(PriorityUnit::Episode).with_new_priority(NewPriority::Given(2.0)))
        }
    };
    let config = BufferConfig::new(usize::from(capacity).max(1), DIMS)
        .with_num_envs(NUM_ENVS)
        .with_field("value", 1)
        .with_priorities(priorities);
    let mut buffer = HerBuffer::new(config).expect("a buffer");
    let mut model = Model::default();
    for op in &ops {
        model.apply(&mut buffer, op);
        model.check(&buffer);
    }
});
