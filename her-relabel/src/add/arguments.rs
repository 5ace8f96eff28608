//! The arguments of adding: starts, steps and episodes of one environment.

/// The name of a field and its numbers: `len` of them for one step, and a row-major matrix with
/// `len` columns for several.
pub type FieldRows<'a, S> = (&'a str, &'a [S]);

/// The first state of an episode, and the episode's goal.
///
/// `S` is `f32` or `f64`, independent of the type that the buffer stores.
#[derive(Clone, Copy, Debug)]
pub struct StartData<'a, S> {
    /// The observation, `dims.observation` elements.
    pub observation: &'a [S],
    /// The goal achieved in this state, `dims.goal` elements.
    pub achieved_goal: &'a [S],
    /// The goal of the whole episode, `dims.goal` elements.
    pub desired_goal: &'a [S],
}

/// One step of an environment.
///
/// `S` and the type `A` of the action are `f32` or `f64`, independent of the type that the buffer
/// stores: `f32` actions beside `f64` observations need no copy.
#[derive(Clone, Copy, Debug)]
pub struct StepData<'a, S, A = S> {
    /// The action taken, `dims.action` elements.
    pub action: &'a [A],
    /// The reward for the episode's own goal, at most 1e20 in magnitude.
    pub reward: S,
    /// The observation after the step, `dims.observation` elements: at an episode's end its
    /// terminal observation, never the first one of the next episode.
    pub next_observation: &'a [S],
    /// The goal achieved after the step, `dims.goal` elements.
    pub next_achieved_goal: &'a [S],
    /// Whether the task ended here, so that there is no later reward.
    pub terminated: bool,
    /// Whether the episode was cut off here, by a time limit for example, although the task goes
    /// on.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order.
    pub fields: &'a [FieldRows<'a, S>],
}

/// A whole episode of `T` steps and `T + 1` states, in row-major matrices.
///
/// `S` and the type `A` of the actions are `f32` or `f64`, independent of the type that the buffer
/// stores.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeData<'a, S, A = S> {
    /// The observations of states `0..=T`, `(T + 1) * dims.observation` elements.
    pub observation: &'a [S],
    /// The goals achieved in states `0..=T`, `(T + 1) * dims.goal` elements.
    pub achieved_goal: &'a [S],
    /// The goal of the episode, `dims.goal` elements.
    pub desired_goal: &'a [S],
    /// The actions, `T * dims.action` elements.
    pub action: &'a [A],
    /// The rewards for the episode's own goal, `T` elements of at most 1e20 in magnitude. Their
    /// number determines `T`.
    pub reward: &'a [S],
    /// Whether the last step ended the task.
    pub terminated: bool,
    /// Whether the episode was cut off after the last step.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order; `T * len` elements each.
    pub fields: &'a [FieldRows<'a, S>],
}
