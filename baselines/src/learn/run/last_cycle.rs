//! The steps of the last cycle, for an algorithm that learns from nothing else.

use fetch_env::{GoalObservation, vec_env::VecStep};
use her_relabel::{Dims, Scalar, StateRows};

use super::inputs::Inputs;
use crate::learn::algorithm::interface::Transitions;

/// The steps of the last cycle, each environment's in their order.
///
/// A step is what the actor saw and drew when it decided, and what the environment then returned: at
/// the end of an episode its last observation, and not the first one of the next.
pub(crate) struct LastCycle {
    dims: Dims,
    gamma: f32,
    /// The inputs and the noise of the decision whose step is under way; empty without one.
    input: Vec<f32>,
    noise: Vec<f32>,
    /// The input after a step.
    next_input: Vec<f32>,
    envs: Vec<Steps>,
    /// Those of all environments, one after the other.
    all: Steps,
}

/// Steps, a row for each.
#[derive(Clone, Default)]
struct Steps {
    input: Vec<f32>,
    noise: Vec<f32>,
    action: Vec<f32>,
    reward: Vec<f32>,
    discount: Vec<f32>,
    next_input: Vec<f32>,
    is_last: Vec<bool>,
}

impl LastCycle {
    pub(super) fn new(num_envs: usize, dims: Dims, gamma: f32) -> Self {
        Self {
            dims,
            gamma,
            input: Vec::new(),
            noise: Vec::new(),
            next_input: Vec::new(),
            envs: vec![Steps::default(); num_envs],
            all: Steps::default(),
        }
    }

    /// Whether there are no steps.
    pub(super) fn is_empty(&self) -> bool {
        self.envs.iter().all(|steps| steps.is_last.is_empty())
    }

    /// Begins a cycle.
    pub(super) fn clear(&mut self) {
        self.input.clear();
        self.envs.iter_mut().for_each(Steps::clear);
    }

    /// Keeps what all environments' next actions are made from.
    pub(super) fn decide(&mut self, input: &[f32], noise: &[f32]) {
        self.input.clear();
        self.input.extend_from_slice(input);
        self.noise.clear();
        self.noise.extend_from_slice(noise);
    }

    /// Adds the steps that followed the last decision of this cycle, if there was one.
    pub(super) fn step<O: GoalObservation<Element: Scalar>, I>(
        &mut self,
        batch: &VecStep<O, I>,
        inputs: &Inputs,
    ) {
        let Self { dims, gamma, input, noise, next_input, envs, .. } = self;
        let decided = !input.is_empty();
        for (env, steps) in envs.iter_mut().enumerate().filter(|_| decided) {
            let next = StateRows {
                observation: row(batch.next_observation(), dims.observation, env),
                achieved_goal: row(batch.next_achieved_goal(), dims.goal, env),
                desired_goal: row(batch.next_desired_goal(), dims.goal, env),
            };
            // The buffer has refused a step whose numbers are not finite.
            if batch.stepped()[env] && inputs.write(&next, next_input).is_ok() {
                steps.input.extend_from_slice(row(input, next_input.len(), env));
                steps.noise.extend_from_slice(row(noise, dims.action, env));
                steps.action.extend_from_slice(row(batch.action(), dims.action, env));
                steps.reward.push(batch.reward()[env] as f32);
                steps.discount.push(if batch.terminated()[env] { 0.0 } else { *gamma });
                steps.next_input.extend_from_slice(next_input);
                steps.is_last.push(batch.terminated()[env] || batch.truncated()[env]);
            } else if let Some(is_last) = steps.is_last.last_mut() {
                // The environment has failed, or was reset.
                *is_last = true;
            }
        }
        input.clear();
    }

    /// Returns all steps.
    pub(super) fn transitions(&mut self) -> Transitions<'_> {
        self.all.clear();
        for steps in &self.envs {
            self.all.append(steps);
        }
        let Steps { input, noise, action, reward, discount, next_input, is_last } = &self.all;
        Transitions {
            len: is_last.len(),
            input,
            actor_input: input,
            action,
            reward,
            discount,
            next_input,
            next_actor_input: next_input,
            demonstrated: &[],
            noise,
            is_last,
        }
    }
}

impl Steps {
    fn clear(&mut self) {
        let Self { input, noise, action, reward, discount, next_input, is_last } = self;
        for column in [input, noise, action, reward, discount, next_input] {
            column.clear();
        }
        is_last.clear();
    }

    /// Adds the steps of another environment.
    fn append(&mut self, other: &Self) {
        for (column, other) in [
            (&mut self.input, &other.input),
            (&mut self.noise, &other.noise),
            (&mut self.action, &other.action),
            (&mut self.reward, &other.reward),
            (&mut self.discount, &other.discount),
            (&mut self.next_input, &other.next_input),
        ] {
            column.extend_from_slice(other);
        }
        self.is_last.extend_from_slice(&other.is_last);
        if let Some(is_last) = self.is_last.last_mut() {
            *is_last = true;
        }
    }
}

/// Returns a row of a matrix; nothing where it has none.
pub(super) fn row<T>(all: &[T], len: usize, at: usize) -> &[T] {
    all.chunks_exact(len).nth(at).unwrap_or_default()
}
