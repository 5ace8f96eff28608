//! Checks of added data, and their error.

use goal_reward::Dims;
use thiserror::Error;

use crate::add::arguments::{EpisodeData, FieldRows, StartData, StepData, StepRows};
use crate::scalar::Scalar;
use crate::store::fields::{Field, Fields, UnknownField};
use crate::store::storage::Storage;

/// Error returned if something cannot be added. The buffer is unchanged.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum AddError {
    /// The environment does not exist.
    #[error(
        "environment {env_index} does not exist: there are {num_envs}, numbered from 0; set their \
         number when you make the buffer"
    )]
    UnknownEnv {
        /// The requested environment.
        env_index: usize,
        /// The number of environments.
        num_envs: usize,
    },
    /// Two rows of one call belong to the same environment.
    #[error("environment {env_index} has two rows: pass at most one row per environment")]
    RepeatedEnv {
        /// The environment.
        env_index: usize,
    },
    /// An episode begins although the previous one has not ended.
    #[error(
        "environment {env_index} is in the middle of an episode: call end_episode to keep its \
         steps, or discard_episode"
    )]
    EpisodeUnderWay {
        /// The environment.
        env_index: usize,
    },
    /// A step is added, or an episode ended, while none is under way.
    #[error(
        "environment {env_index} is not in an episode: call begin_episode after every reset, or \
         record the rows of the reset before those of its steps"
    )]
    NoEpisode {
        /// The environment.
        env_index: usize,
    },
    /// A row was recorded before: the same one, or a later one of its environment.
    #[error(
        "the row of environment {env_index} was recorded before: record what each call returned \
         once, in order"
    )]
    RecordedBefore {
        /// The environment.
        env_index: usize,
    },
    /// Rows before this one were not recorded, so that its step did not begin where the episode in
    /// the buffer stands.
    #[error(
        "{missing} rows of environment {env_index} before this one were not recorded: record what \
         each call returned, resets included; to go on, reset the environments and record that, \
         or call resume"
    )]
    RowsMissing {
        /// The environment.
        env_index: usize,
        /// The number of its steps, starts and failures that were not recorded.
        missing: u64,
    },
    /// A step does not belong to the episode that is under way in the buffer.
    #[error(
        "the step of environment {env_index} belongs to another episode than the one under way, \
         which was begun by hand, loaded from a file, or recorded from other environments: to go \
         on, reset these environments and record that, or call resume"
    )]
    OtherEpisode {
        /// The environment.
        env_index: usize,
    },
    /// Another buffer has transitions of another task.
    #[error("the other buffer is of {other:?}, this one of {own:?}: keep them apart")]
    OtherTask {
        /// The description of this buffer's task.
        own: String,
        /// The description of the other buffer's task.
        other: String,
    },
    /// A whole episode has no step.
    #[error("the episode has no steps: pass at least one reward")]
    EmptyEpisode,
    /// A whole episode is neither terminated nor truncated.
    #[error("the episode is neither terminated nor truncated: set `truncated` if it was cut off")]
    NotEnded,
    /// A vector has the wrong length.
    #[error("`{field}` has {actual} elements instead of {expected}: check the configured sizes")]
    WrongLength {
        /// The field.
        field: String,
        /// The length it should have.
        expected: usize,
        /// Its length.
        actual: usize,
    },
    /// An element is NaN or infinite, or becomes infinite when rounded to the buffer's type.
    #[error(
        "`{field}[{index}]` is {value:?}, which the buffer cannot store as a finite number: drop the \
         episode, or find the step that produced it"
    )]
    NotFinite {
        /// The field.
        field: String,
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A reward is finite, but so large that sums of such rewards could be infinite in `f32`.
    #[error(
        "`{field}[{index}]` is {value:?}: scale rewards, which may be at most 1e20 in magnitude"
    )]
    RewardTooLarge {
        /// The field.
        field: String,
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A given field is not in the configuration.
    #[error(transparent)]
    UnknownField(#[from] UnknownField),
    /// A field of the configuration is not given.
    #[error("the field `{name}` is missing: pass all configured fields with every step")]
    MissingField {
        /// Its name.
        name: String,
    },
    /// A field is given twice.
    #[error("the field `{name}` is given twice: pass it once")]
    RepeatedField {
        /// Its name.
        name: String,
    },
}
debug_as_display!(AddError);

// All checks of numbers apply to the values as rounded to the buffer's type `T`.

impl<O: Scalar, G: Scalar> StartData<'_, O, G> {
    pub(crate) fn check_lens(&self, dims: Dims) -> Result<(), AddError> {
        check_len("observation", self.observation.len(), dims.observation)?;
        check_len("achieved_goal", self.achieved_goal.len(), dims.goal)?;
        check_len("desired_goal", self.desired_goal.len(), dims.goal)
    }

    pub(crate) fn check_numbers<T: Scalar>(&self) -> Result<(), AddError> {
        check_finite::<T, O>("observation", self.observation)?;
        check_finite::<T, G>("achieved_goal", self.achieved_goal)?;
        check_finite::<T, G>("desired_goal", self.desired_goal)
    }
}

impl<O: Scalar, G: Scalar, A: Scalar> StepData<'_, O, G, A> {
    /// Checks all lengths except those of the fields.
    pub(crate) fn check_lens(&self, dims: Dims) -> Result<(), AddError> {
        check_len("action", self.action.len(), dims.action)?;
        check_len("next_observation", self.next_observation.len(), dims.observation)?;
        check_len("next_achieved_goal", self.next_achieved_goal.len(), dims.goal)
    }

    /// Checks the numbers. Those of the fields are in row `at` of each field, whose length must
    /// have been checked.
    pub(crate) fn check_numbers<T: Scalar>(
        &self,
        fields: &Fields,
        at: usize,
    ) -> Result<(), AddError> {
        check_finite::<T, A>("action", self.action)?;
        check_rewards("reward", &[self.reward])?;
        check_finite::<T, O>("next_observation", self.next_observation)?;
        check_finite::<T, G>("next_achieved_goal", self.next_achieved_goal)?;
        self.fields.iter().try_for_each(|(name, values)| {
            let len = fields.place(name)?.len();
            check_finite::<T, G>(name, &values[at * len..][..len])
        })
    }
}

impl<O: Scalar, G: Scalar, A: Scalar> EpisodeData<'_, O, G, A> {
    /// Checks everything.
    pub(crate) fn check<T: Scalar>(&self, storage: &Storage<T>) -> Result<(), AddError> {
        let dims = storage.layout.dims();
        let steps = self.reward.len();
        if steps == 0 {
            return Err(AddError::EmptyEpisode);
        }
        if !(self.terminated || self.truncated) {
            return Err(AddError::NotEnded);
        }
        let states = |len: usize| (steps + 1).saturating_mul(len);
        check::<T, O>("observation", self.observation, states(dims.observation))?;
        check::<T, G>("achieved_goal", self.achieved_goal, states(dims.goal))?;
        check::<T, G>("desired_goal", self.desired_goal, dims.goal)?;
        check::<T, A>("action", self.action, steps.saturating_mul(dims.action))?;
        check_rewards("reward", self.reward)?;
        check_fields(&storage.fields, self.fields, steps)?;
        self.fields.iter().try_for_each(|(name, values)| check_finite::<T, G>(name, values))
    }
}

impl<O, G, A> StepRows<'_, O, G, A> {
    /// Checks all lengths except those of the fields.
    pub(crate) fn check_lens(&self, dims: Dims) -> Result<(), AddError> {
        let n = self.env_index.len();
        check_len("stepped", self.stepped.len(), n)?;
        check_len("started", self.started.len(), n)?;
        check_len("truncated", self.truncated.len(), n)?;
        self.check_numbers_len()?;
        let check = |any_reads: bool, columns: &[(&str, usize, usize)]| {
            columns.iter().try_for_each(|&(name, len, width)| {
                let may_be_empty = !any_reads && len == 0;
                if may_be_empty { Ok(()) } else { check_len(name, len, n.saturating_mul(width)) }
            })
        };
        let steps = [
            ("action", self.action.len(), dims.action),
            ("reward", self.reward.len(), 1),
            ("next_observation", self.next_observation.len(), dims.observation),
            ("next_achieved_goal", self.next_achieved_goal.len(), dims.goal),
            ("terminated", self.terminated.len(), 1),
        ];
        let starts = [
            ("observation", self.observation.len(), dims.observation),
            ("achieved_goal", self.achieved_goal.len(), dims.goal),
            ("desired_goal", self.desired_goal.len(), dims.goal),
        ];
        check(self.stepped.contains(&true), &steps)?;
        check(false, &[("next_desired_goal", self.next_desired_goal.len(), dims.goal)])?;
        check(self.started.contains(&true), &starts)
    }

    /// Checks the lengths of the states that the rows show.
    pub(crate) fn check_state_lens(&self, dims: Dims) -> Result<(), AddError> {
        let n = self.env_index.len();
        check_len("observation", self.observation.len(), n.saturating_mul(dims.observation))?;
        check_len("achieved_goal", self.achieved_goal.len(), n.saturating_mul(dims.goal))?;
        check_len("desired_goal", self.desired_goal.len(), n.saturating_mul(dims.goal))?;
        self.check_numbers_len()
    }

    fn check_numbers_len(&self) -> Result<(), AddError> {
        match self.numbers {
            Some(numbers) => check_len("numbers", numbers.number.len(), self.env_index.len()),
            None => Ok(()),
        }
    }
}

/// Checks that the fields of the configuration, and no others, are given for `rows` steps.
pub(crate) fn check_fields<S>(
    fields: &Fields,
    given: &[FieldRows<'_, S>],
    rows: usize,
) -> Result<(), AddError> {
    for (at, (name, values)) in given.iter().enumerate() {
        let len = fields.place(name)?.len();
        if given[..at].iter().any(|(other, _)| other == name) {
            return Err(AddError::RepeatedField { name: (*name).to_owned() });
        }
        check_len(name, values.len(), rows.saturating_mul(len))?;
    }
    let is_missing = |field: &&Field| given.iter().all(|(name, _)| *name != field.name);
    match fields.places().map(|(field, _)| field).find(is_missing) {
        Some(field) => Err(AddError::MissingField { name: field.name.clone() }),
        None => Ok(()),
    }
}

/// Checks the length of a vector, and that each element is finite.
pub(crate) fn check<T: Scalar, S: Scalar>(
    field: &str,
    values: &[S],
    expected: usize,
) -> Result<(), AddError> {
    check_len(field, values.len(), expected)?;
    check_finite::<T, S>(field, values)
}

/// Checks that each element is finite.
fn check_finite<T: Scalar, S: Scalar>(field: &str, values: &[S]) -> Result<(), AddError> {
    let is_bad = |value: &S| !T::from_f64(value.to_f64()).to_f64().is_finite();
    // Without an early exit, the loop compiles to vector instructions.
    if values.iter().fold(false, |bad, value| bad | is_bad(value)) {
        let index = values.iter().position(is_bad).unwrap_or_default();
        let field = field.to_owned();
        return Err(AddError::NotFinite { field, index, value: values[index].to_f64() });
    }
    Ok(())
}

/// The largest magnitude of a reward. An episode has fewer than 2^58 steps, because the row of a
/// step takes at least 16 bytes, so no sum of its rewards is infinite in `f32`.
const MAX_REWARD: f32 = 1e20;

/// Returns whether a reward can be stored. It is compared in `f32`, whatever the buffer's type, so
/// a reward that is rounded when it is stored, saved or exported stays one.
pub(crate) fn is_reward(reward: f64) -> bool {
    (reward as f32).abs() <= MAX_REWARD
}

/// Checks that each reward can be stored.
fn check_rewards<S: Scalar>(field: &str, rewards: &[S]) -> Result<(), AddError> {
    let Some(index) = rewards.iter().position(|reward| !is_reward(reward.to_f64())) else {
        return Ok(());
    };
    let (field, value) = (field.to_owned(), rewards[index].to_f64());
    Err(if value.is_finite() {
        AddError::RewardTooLarge { field, index, value }
    } else {
        AddError::NotFinite { field, index, value }
    })
}

pub(crate) fn check_len(field: &str, actual: usize, expected: usize) -> Result<(), AddError> {
    if actual == expected {
        return Ok(());
    }
    Err(AddError::WrongLength { field: field.to_owned(), expected, actual })
}
