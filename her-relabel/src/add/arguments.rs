//! What is added to a buffer, and what can be wrong with it.

use thiserror::Error;

use crate::Scalar;
use crate::store::config::Layout;
use crate::store::fields::{FieldRows, Fields, UnknownField};

/// The first state of an episode and the goal that it is about.
///
/// `S` may be `f32` or `f64`, whatever the buffer stores.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeStart<'a, S> {
    /// The observation, `dims.observation` elements.
    pub observation: &'a [S],
    /// The goal achieved in this state, `dims.goal` elements.
    pub achieved_goal: &'a [S],
    /// The goal of the whole episode, `dims.goal` elements.
    pub desired_goal: &'a [S],
}

/// One step of an environment.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a, S> {
    /// The action taken, `dims.action` elements.
    pub action: &'a [S],
    /// The reward for the episode's own goal.
    pub reward: S,
    /// The observation after the step: at an episode's end its terminal observation, never the first
    /// of the next episode. `dims.observation` elements.
    pub next_observation: &'a [S],
    /// The goal achieved after the step, `dims.goal` elements.
    pub next_achieved_goal: &'a [S],
    /// The task is over here: no later reward exists.
    pub terminated: bool,
    /// The episode was cut off here, by a time limit for example, though the task goes on.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order.
    pub fields: &'a [FieldRows<'a, S>],
}

/// A whole episode of `T` steps and `T + 1` states, in row-major matrices.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeData<'a, S> {
    /// The observations of states `0..=T`, `(T + 1) * dims.observation` elements.
    pub observations: &'a [S],
    /// The goals achieved in states `0..=T`, `(T + 1) * dims.goal` elements.
    pub achieved_goals: &'a [S],
    /// The goal of the episode, `dims.goal` elements.
    pub desired_goal: &'a [S],
    /// The actions, `T * dims.action` elements.
    pub actions: &'a [S],
    /// The rewards for the episode's own goal, `T` elements; they decide `T`.
    pub rewards: &'a [S],
    /// The last step ended the task.
    pub terminated: bool,
    /// The last step was cut off.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order; `T * len` elements each.
    pub fields: &'a [FieldRows<'a, S>],
}

/// Something that cannot be added. The buffer is as it was before the call.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AddError {
    /// There is no such environment.
    #[error(
        "environment {env} of {n_envs}: number environments from 0, and set `n_envs` of the configuration to how many there are"
    )]
    UnknownEnv {
        /// The environment asked for.
        env: usize,
        /// The number of environments.
        n_envs: usize,
    },
    /// A new episode begins although the last one has not ended.
    #[error(
        "environment {env} is in the middle of an episode; call end_episode to keep its steps, or discard_episode"
    )]
    EpisodeUnderWay {
        /// The environment.
        env: usize,
    },
    /// A step or an end comes without an episode.
    #[error("environment {env} has no episode under way; call begin_episode after every reset")]
    NoEpisode {
        /// The environment.
        env: usize,
    },
    /// A whole episode has no step.
    #[error("an episode without steps holds nothing to learn from; pass at least one reward")]
    EmptyEpisode,
    /// A whole episode is neither terminated nor truncated.
    #[error("the episode is neither terminated nor truncated; set `truncated` if it was cut off")]
    NotEnded,
    /// A vector has the wrong length.
    #[error(
        "`{field}` has {actual} elements and should have {expected}; check the sizes of the configuration"
    )]
    WrongLength {
        /// The field.
        field: String,
        /// The length it should have.
        expected: usize,
        /// Its length.
        actual: usize,
    },
    /// An element is NaN or infinite, or is so once rounded to the buffer's type.
    #[error(
        "`{field}[{index}]` is {value}, which the buffer cannot store as a finite number; drop the episode or find the step that made it"
    )]
    NotFinite {
        /// The field.
        field: String,
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A field is given that the buffer was not configured with.
    #[error(transparent)]
    UnknownField(#[from] UnknownField),
    /// A field of the configuration is not given.
    #[error("the field `{name}` is missing; every step needs all fields of the configuration")]
    MissingField {
        /// Its name.
        name: String,
    },
    /// A field is given twice.
    #[error("the field `{name}` is given twice; leave one out")]
    RepeatedField {
        /// Its name.
        name: String,
    },
}

impl<S: Scalar> EpisodeStart<'_, S> {
    /// Checks everything, as elements of `T`.
    pub(crate) fn check<T: Scalar>(&self, layout: &Layout) -> Result<(), AddError> {
        let dims = layout.dims();
        check::<T, S>("observation", self.observation, dims.observation)?;
        check::<T, S>("achieved_goal", self.achieved_goal, dims.goal)?;
        check::<T, S>("desired_goal", self.desired_goal, dims.goal)
    }
}

impl<S: Scalar> Step<'_, S> {
    /// Checks everything, as elements of `T`.
    pub(crate) fn check<T: Scalar>(
        &self,
        layout: &Layout,
        fields: &Fields,
    ) -> Result<(), AddError> {
        let dims = layout.dims();
        check::<T, S>("action", self.action, dims.action)?;
        check::<T, S>("reward", &[self.reward], 1)?;
        check::<T, S>("next_observation", self.next_observation, dims.observation)?;
        check::<T, S>("next_achieved_goal", self.next_achieved_goal, dims.goal)?;
        fields.check::<T, S>(self.fields, 1)
    }
}

impl<S: Scalar> EpisodeData<'_, S> {
    /// Checks everything, as elements of `T`.
    pub(crate) fn check<T: Scalar>(
        &self,
        layout: &Layout,
        fields: &Fields,
    ) -> Result<(), AddError> {
        let dims = layout.dims();
        let steps = self.rewards.len();
        if steps == 0 {
            return Err(AddError::EmptyEpisode);
        }
        if !(self.terminated || self.truncated) {
            return Err(AddError::NotEnded);
        }
        check::<T, S>(
            "observations",
            self.observations,
            (steps + 1).saturating_mul(dims.observation),
        )?;
        check::<T, S>(
            "achieved_goals",
            self.achieved_goals,
            (steps + 1).saturating_mul(dims.goal),
        )?;
        check::<T, S>("desired_goal", self.desired_goal, dims.goal)?;
        check::<T, S>("actions", self.actions, steps.saturating_mul(dims.action))?;
        check::<T, S>("rewards", self.rewards, steps)?;
        fields.check::<T, S>(self.fields, steps)
    }
}

/// Checks the length of a vector and that each element is finite as a `T`.
pub(crate) fn check<T: Scalar, S: Scalar>(
    field: &str,
    values: &[S],
    expected: usize,
) -> Result<(), AddError> {
    check_len(field, values.len(), expected)?;
    let is_bad = |value: &S| !T::from_f64(value.to_f64()).to_f64().is_finite();
    // Looks at every element, so that the loop is compiled to vector instructions.
    if values.iter().fold(false, |bad, value| bad | is_bad(value)) {
        let index = values.iter().position(is_bad).unwrap_or_default();
        let field = field.to_owned();
        return Err(AddError::NotFinite { field, index, value: values[index].to_f64() });
    }
    Ok(())
}

/// Checks the length of a vector.
pub(crate) fn check_len(field: &str, actual: usize, expected: usize) -> Result<(), AddError> {
    if actual == expected {
        return Ok(());
    }
    Err(AddError::WrongLength { field: field.to_owned(), expected, actual })
}
