//! Random events, applied to a list of episodes and to a buffer alike.

use her_relabel::rand_core::Rng;
use her_relabel::{
    AddError, BufferConfig, Dims, EpisodeData, FieldRows, HerBuffer, Recorded, Scalar, StartData,
    StepData, StepRows,
};
use proptest::sample::Index;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::events::Event;
use crate::list::{Episode, List, State, Taken};

/// Numbers, some of which differ only in the last bits, and some of which are equal once rounded to
/// `f32`.
const NUMBERS: [f64; 10] =
    [-2.0, -1.25, -0.0, 0.0, 0.1, 0.100_000_000_000_1, 0.100_000_001_490_116_12, 1e-40, 1.5, 3.25];

/// Desired goals have other numbers, also once rounded, so that no goal is both.
const DESIRED: [f64; 4] = [-1.75, 0.05, 0.0999, 2.5];

/// Rewards whose sums are exact.
const REWARDS: [f64; 5] = [-1.0, -0.0, 0.0, 0.25, 3.5];

/// The events in an environment's row: a step, the state after it, the start of an episode, and the
/// goal after the step.
type Life = (Taken, State, Episode, Vec<f64>);

/// The list, and the generator of the events' numbers.
pub(crate) struct World {
    config: BufferConfig,
    pub(crate) list: List,
    rng: ChaCha8Rng,
}

/// Rounds numbers to the buffer's type.
fn stored<S: Scalar>(numbers: &[f64]) -> Vec<f64> {
    numbers.iter().map(|number| S::from_f64(*number).to_f64()).collect()
}

impl World {
    pub(crate) fn new(config: &BufferConfig, seed: u64) -> Self {
        let list = List::new(config.capacity(), config.num_envs(), config.priorities());
        Self { config: config.clone(), list, rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    fn one_of(&mut self, numbers: &[f64]) -> f64 {
        numbers[self.rng.next_u32() as usize % numbers.len()]
    }

    fn numbers(&mut self, len: usize) -> Vec<f64> {
        (0..len).map(|_| self.one_of(&NUMBERS)).collect()
    }

    fn state(&mut self) -> State {
        let Dims { observation, goal, .. } = self.config.dims();
        State { observation: self.numbers(observation), achieved_goal: self.numbers(goal) }
    }

    fn taken(&mut self) -> Taken {
        let lens: Vec<usize> = self.config.fields().iter().map(|field| field.len).collect();
        Taken {
            action: self.numbers(self.config.dims().action),
            reward: self.one_of(&REWARDS),
            fields: lens.into_iter().map(|len| self.numbers(len)).collect(),
            priority: 0.0,
        }
    }

    fn desired_goal(&mut self) -> Vec<f64> {
        (0..self.config.dims().goal).map(|_| self.one_of(&DESIRED)).collect()
    }

    /// Returns the goal of an environment's next step, seldom a new one.
    fn next_goal(&mut self, env: usize) -> Vec<f64> {
        let new = self.desired_goal();
        let is_new = self.rng.next_u32().is_multiple_of(4);
        let old = self.list.under_way[env].as_ref().filter(|_| !is_new);
        old.map_or(new, |episode| episode.desired_goal.clone())
    }

    fn start(&mut self) -> Episode {
        Episode {
            desired_goal: self.desired_goal(),
            states: vec![self.state()],
            steps: Vec::new(),
            terminated: false,
            truncated: false,
            priority: 0.0,
        }
    }

    fn begin_in_list<S: Scalar>(&mut self, env: usize, start: &Episode) {
        let mut start = start.clone();
        start.desired_goal = stored::<S>(&start.desired_goal);
        start.states = start.states.iter().map(round_state::<S>).collect();
        self.list.under_way[env] = Some(start);
        self.list.discarded[env] = false;
    }

    fn step_in_list<S: Scalar>(&mut self, env: usize, taken: &Taken, next: &State) {
        if let Some(episode) = &mut self.list.under_way[env] {
            episode.steps.push(round_step::<S>(taken));
            episode.states.push(round_state::<S>(next));
        }
    }

    /// Applies an event to both.
    pub(crate) fn happen<S: Scalar>(&mut self, buffer: &mut HerBuffer<S>, event: &Event) {
        let num_envs = self.config.num_envs();
        match event {
            Event::Step(env, flags) => self.step(buffer, env % num_envs, *flags),
            Event::End(env) => {
                let env = env % num_envs;
                assert_eq!(buffer.end_episode(env).is_ok(), self.list.under_way[env].is_some());
                self.list.end(env, false, true);
            }
            Event::Discard(env) => {
                let env = env % num_envs;
                let discarded = self.list.under_way[env].take();
                assert_eq!(buffer.discard_episode(env).is_ok(), discarded.is_some());
                self.list.discarded[env] |= discarded.is_some();
            }
            Event::Whole(len, flags) => self.whole(buffer, *len, *flags),
            Event::Record(rows) => self.record(buffer, &rows[..num_envs]),
            Event::Prioritize(changes) => self.prioritize(buffer, changes),
            Event::Clear => {
                buffer.clear();
                self.list.clear();
            }
            Event::SaveAndLoad => {
                let mut bytes = Vec::new();
                buffer.write_to(&mut bytes).unwrap();
                *buffer = HerBuffer::read_from(&bytes[..]).unwrap();
            }
            Event::Append => {
                let other = buffer.clone();
                buffer.append(&other).unwrap();
                self.repeat();
            }
            Event::Import => {
                if import(buffer) {
                    self.repeat();
                }
            }
        }
    }

    /// Adds all finished episodes once more.
    fn repeat(&mut self) {
        for episode in self.list.finished.clone() {
            self.list.finish(episode);
        }
    }

    fn step<S: Scalar>(
        &mut self,
        buffer: &mut HerBuffer<S>,
        env: usize,
        (terminated, truncated): (bool, bool),
    ) {
        if self.list.under_way[env].is_none() {
            let start = self.start();
            let state = &start.states[0];
            let begin = StartData {
                observation: &state.observation,
                achieved_goal: &state.achieved_goal,
                desired_goal: &start.desired_goal,
            };
            buffer.begin_episode(env, &begin).unwrap();
            self.begin_in_list::<S>(env, &start);
        }
        let goal = self.next_goal(env);
        let has_ended = buffer.set_desired_goal(env, &goal).unwrap();
        assert_eq!(has_ended, self.list.set_goal(env, stored::<S>(&goal)));
        let (taken, next) = (self.taken(), self.state());
        let fields: Vec<FieldRows<'_, f64>> = self.named(&taken.fields);
        let step = StepData {
            action: &taken.action,
            reward: taken.reward,
            next_observation: &next.observation,
            next_achieved_goal: &next.achieved_goal,
            terminated,
            truncated,
            fields: &fields,
        };
        buffer.add_step(env, &step).unwrap();
        self.step_in_list::<S>(env, &taken, &next);
        if terminated || truncated {
            self.list.end(env, terminated, truncated);
        }
    }

    /// Names the fields, in a different order than the configuration.
    fn named<'a>(&'a self, fields: &'a [Vec<f64>]) -> Vec<FieldRows<'a, f64>> {
        let names = self.config.fields().iter().map(|field| &field.name[..]);
        names.zip(fields.iter().map(|field| &field[..])).rev().collect()
    }

    fn whole<S: Scalar>(
        &mut self,
        buffer: &mut HerBuffer<S>,
        len: usize,
        (terminated, truncated): (bool, bool),
    ) {
        let mut episode = self.start();
        for _ in 0..len {
            episode.steps.push(self.taken());
            episode.states.push(self.state());
        }
        let flat = |part: fn(&State) -> &[f64]| -> Vec<f64> {
            episode.states.iter().flat_map(|state| part(state).to_vec()).collect()
        };
        let fields: Vec<Vec<f64>> = (0..self.config.fields().len())
            .map(|at| episode.steps.iter().flat_map(|step| step.fields[at].clone()).collect())
            .collect();
        let actions: Vec<f64> = episode.steps.iter().flat_map(|step| step.action.clone()).collect();
        let rewards: Vec<f64> = episode.steps.iter().map(|step| step.reward).collect();
        let data = EpisodeData {
            observation: &flat(|state| &state.observation),
            achieved_goal: &flat(|state| &state.achieved_goal),
            desired_goal: &episode.desired_goal,
            action: &actions,
            reward: &rewards,
            terminated,
            truncated,
            fields: &self.named(&fields),
        };
        buffer.add_episode(&data).unwrap();
        episode.desired_goal = stored::<S>(&episode.desired_goal);
        episode.states = episode.states.iter().map(round_state::<S>).collect();
        episode.steps = episode.steps.iter().map(round_step::<S>).collect();
        self.list.finish(Episode { terminated, truncated, ..episode });
    }

    /// Records the rows of some environments, in any order. What must not be read is NaN.
    fn record<S: Scalar>(&mut self, buffer: &mut HerBuffer<S>, rows: &[[bool; 4]]) {
        let mut env_ids: Vec<usize> = (0..rows.len()).collect();
        env_ids.sort_by_cached_key(|_| self.rng.next_u32());
        env_ids.truncate(1 + self.rng.next_u32() as usize % rows.len());
        let is_unbegun = |env: &usize| rows[*env][0] && !self.list.has_begun(*env);
        if let Some(env_index) = env_ids.iter().copied().find(is_unbegun) {
            let refused = self.record_rows(buffer, &env_ids, rows);
            assert_eq!(refused, Err(AddError::NoEpisode { env_index }));
            // The others' rows and the starts, without the steps that are refused.
            let mut rows = rows.to_vec();
            for (env, row) in rows.iter_mut().enumerate() {
                row[0] &= self.list.has_begun(env);
            }
            return self.record(buffer, &rows);
        }
        self.record_rows(buffer, &env_ids, rows).unwrap();
    }

    fn record_rows<S: Scalar>(
        &mut self,
        buffer: &mut HerBuffer<S>,
        env_ids: &[usize],
        rows: &[[bool; 4]],
    ) -> Result<(), AddError> {
        let life = |env| (self.taken(), self.state(), self.start(), self.next_goal(env));
        let lives: Vec<Life> = (0..rows.len()).map(life).collect();
        let goals_change = self.rng.next_u32().is_multiple_of(2);
        let flag = |at: usize| -> Vec<bool> { env_ids.iter().map(|env| rows[*env][at]).collect() };
        let column = |at: usize, part: &dyn Fn(&Life) -> Vec<f64>| -> Vec<f64> {
            let values = |env: &usize| {
                let values = part(&lives[*env]);
                if rows[*env][at] { values } else { vec![f64::NAN; values.len()] }
            };
            env_ids.iter().flat_map(values).collect()
        };
        let (stepped, started) = (0, 3);
        let fields: Vec<Vec<f64>> = (0..self.config.fields().len())
            .map(|at| column(stepped, &|(taken, ..)| taken.fields[at].clone()))
            .collect();
        let next_desired_goal = column(stepped, &|(.., goal)| goal.clone());
        let columns = StepRows {
            env_index: env_ids,
            stepped: &flag(stepped),
            started: &flag(started),
            action: &column(stepped, &|(taken, ..)| taken.action.clone()),
            reward: &column(stepped, &|(taken, ..)| vec![taken.reward]),
            next_observation: &column(stepped, &|(_, next, ..)| next.observation.clone()),
            next_achieved_goal: &column(stepped, &|(_, next, ..)| next.achieved_goal.clone()),
            next_desired_goal: if goals_change { &next_desired_goal } else { &[] },
            terminated: &flag(1),
            truncated: &flag(2),
            observation: &column(started, &|(.., start, _)| start.states[0].observation.clone()),
            achieved_goal: &column(started, &|(.., start, _)| {
                start.states[0].achieved_goal.clone()
            }),
            desired_goal: &column(started, &|(.., start, _)| start.desired_goal.clone()),
            fields: &self.named(&fields),
            numbers: None,
        };
        let recorded = buffer.record(&columns)?;
        let mut expected = Recorded::default();
        for &env in env_ids {
            let ([stepped, terminated, truncated, started], (taken, next, start, goal)) =
                (rows[env], &lives[env]);
            let steps = |list: &List| list.under_way[env].as_ref().map(|e| e.steps.len());
            let is_under_way = steps(&self.list).is_some();
            if stepped && is_under_way {
                let ends = goals_change && self.list.set_goal(env, stored::<S>(goal));
                expected.finished_episodes += usize::from(ends);
                self.step_in_list::<S>(env, taken, next);
                expected.recorded_steps += 1;
                if terminated || truncated {
                    self.list.end(env, terminated, truncated);
                    expected.finished_episodes += 1;
                }
            } else if stepped {
                expected.skipped_steps += 1;
            } else if truncated {
                expected.discarded_episodes += usize::from(is_under_way);
                self.list.under_way[env] = None;
                self.list.discarded[env] = true;
            }
            if started {
                expected.finished_episodes += usize::from(steps(&self.list) > Some(0));
                self.list.end(env, false, true);
                self.begin_in_list::<S>(env, start);
            }
        }
        assert_eq!(recorded, expected);
        Ok(())
    }

    fn prioritize<S: Scalar>(&mut self, buffer: &mut HerBuffer<S>, changes: &[(Index, u8)]) {
        let Some((oldest, _)) = buffer.transition_ids().filter(|_| self.list.priorities.is_some())
        else {
            return;
        };
        let len = self.list.transitions().len();
        let places: Vec<usize> = changes.iter().map(|(index, _)| index.index(len)).collect();
        let ids: Vec<_> = places
            .iter()
            .map(|place| her_relabel::TransitionId::new(oldest.get() + *place as u64).unwrap())
            .collect();
        let priorities: Vec<f64> =
            changes.iter().map(|(_, priority)| f64::from(*priority)).collect();
        buffer.set_priorities(&ids, &priorities).unwrap();
        for (place, priority) in places.into_iter().zip(priorities) {
            self.list.set_priority(place, priority);
        }
    }
}

fn round_state<S: Scalar>(state: &State) -> State {
    State {
        observation: stored::<S>(&state.observation),
        achieved_goal: stored::<S>(&state.achieved_goal),
    }
}

fn round_step<S: Scalar>(step: &Taken) -> Taken {
    Taken {
        action: stored::<S>(&step.action),
        fields: step.fields.iter().map(|field| stored::<S>(field)).collect(),
        ..step.clone()
    }
}

/// Imports the buffer's own episodes; `false` without the feature.
#[cfg(feature = "npz")]
fn import<S: Scalar>(buffer: &mut HerBuffer<S>) -> bool {
    let mut archive = std::io::Cursor::new(Vec::new());
    buffer.write_npz(&mut archive).unwrap();
    let count = buffer.num_episodes() as u64;
    assert_eq!(buffer.import_npz_bytes(archive.get_ref()).unwrap(), count);
    true
}

#[cfg(not(feature = "npz"))]
fn import<S: Scalar>(_: &mut HerBuffer<S>) -> bool {
    false
}
