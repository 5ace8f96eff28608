//! Data to add: starts, steps and episodes of one environment, and rows of many.
//!
//! `O` is the type of observations, `G` that of goals, rewards and fields, and `A` that of actions:
//! `f32` or `f64`, independent of each other and of the type that the buffer stores.

use goal_reward::Dims;

use crate::scalar::Scalar;
use crate::store::storage::RowNumber;

/// The name of a field and its numbers: `len` of them for one step, or a row-major matrix with
/// `len` columns for several.
pub type FieldRows<'a, G> = (&'a str, &'a [G]);

/// The first state of an episode, and the episode's goal.
///
/// The types of observations (`O`) and goals (`G`) are `f32` or `f64`, independent of each other
/// and of the type that the buffer stores.
#[derive(Clone, Copy, Debug)]
pub struct StartData<'a, O, G = O> {
    /// The observation, `dims.observation` elements.
    pub observation: &'a [O],
    /// The goal achieved in this state, `dims.goal` elements.
    pub achieved_goal: &'a [G],
    /// The goal of the whole episode, `dims.goal` elements.
    pub desired_goal: &'a [G],
}

/// One step of an environment.
///
/// The types of observations (`O`), of goals, rewards and fields (`G`) and of actions (`A`) are
/// `f32` or `f64`, independent of each other and of the type that the buffer stores: `f32` actions
/// beside `f64` observations need no copy.
#[derive(Clone, Copy, Debug)]
pub struct StepData<'a, O, G = O, A = O> {
    /// The action taken, `dims.action` elements.
    pub action: &'a [A],
    /// The reward for the episode's goal, which
    /// [`set_desired_goal`](crate::HerBuffer::set_desired_goal) changes: in `f32`, at most 1e20 in
    /// magnitude.
    pub reward: G,
    /// The observation after the step, `dims.observation` elements: at an episode's end its
    /// terminal observation, never the first one of the next episode.
    pub next_observation: &'a [O],
    /// The goal achieved after the step, `dims.goal` elements.
    pub next_achieved_goal: &'a [G],
    /// Whether the task ended here, so that no rewards follow.
    pub terminated: bool,
    /// Whether the episode was cut off here, by a time limit for example, although the task goes
    /// on.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order.
    pub fields: &'a [FieldRows<'a, G>],
}

/// A whole episode of `T` steps and `T + 1` states, in row-major matrices.
///
/// The element types are those of [`StepData`].
#[derive(Clone, Copy, Debug)]
pub struct EpisodeData<'a, O, G = O, A = O> {
    /// The observations of states `0..=T`, `(T + 1) * dims.observation` elements.
    pub observation: &'a [O],
    /// The goals achieved in states `0..=T`, `(T + 1) * dims.goal` elements.
    pub achieved_goal: &'a [G],
    /// The goal of the episode, `dims.goal` elements.
    pub desired_goal: &'a [G],
    /// The actions, `T * dims.action` elements.
    pub action: &'a [A],
    /// The rewards for the episode's own goal, `T` elements: in `f32`, at most 1e20 in magnitude.
    /// Their number determines `T`.
    pub reward: &'a [G],
    /// Whether the last step ended the task.
    pub terminated: bool,
    /// Whether the episode was cut off after the last step.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order; `T * len` elements each.
    pub fields: &'a [FieldRows<'a, G>],
}

/// Rows of vectorized environments, for [`HerBuffer::record`](crate::HerBuffer::record): row-major,
/// `n` rows each, one row for each of the `n` environments in `env_index`.
///
/// A row may hold a step, the start of an episode, or both. The three autoreset modes of Gymnasium
/// differ in when the next episode starts:
///
/// | mode | `started` is set |
/// |---|---|
/// | next step | in the row after the episode's last step; `stepped` is not set in it |
/// | same step | in the row of the episode's last step |
/// | disabled | in the row of the reset that the caller requests |
///
/// The columns from `action` to `terminated` and the fields are read in rows with a step, and those
/// from `observation` to `desired_goal` in rows with a start. A column that no row needs may be
/// empty. [`Default`] has no rows. The element types are those of [`StepData`].
#[derive(Clone, Copy, Debug, Default)]
pub struct StepRows<'a, O, G = O, A = O> {
    /// The environment of each row, `n` elements: in any order, none twice.
    pub env_index: &'a [usize],
    /// Whether the row holds a step, `n` elements. Not set for a reset, for an environment that
    /// failed, and for one that refused its action.
    pub stepped: &'a [bool],
    /// Whether an episode starts in the row, by a requested or an automatic reset, `n` elements.
    pub started: &'a [bool],
    /// The actions taken, `n * dims.action` elements.
    pub action: &'a [A],
    /// The rewards for the goals after the step, `n` elements: in `f32`, at most 1e20 in magnitude.
    pub reward: &'a [G],
    /// The observations after the step, `n * dims.observation` elements: at an episode's end its
    /// terminal observation, never the first one of the next episode.
    pub next_observation: &'a [O],
    /// The goals achieved after the step, `n * dims.goal` elements.
    pub next_achieved_goal: &'a [G],
    /// The desired goals after the step, `n * dims.goal` elements, or none if goals never change
    /// within an episode.
    pub next_desired_goal: &'a [G],
    /// Whether the task ended with the step, `n` elements.
    pub terminated: &'a [bool],
    /// Whether the episode was cut off after the step, `n` elements. In a row without a step,
    /// whether the environment failed in the middle of its episode.
    pub truncated: &'a [bool],
    /// The first observations of episodes, `n * dims.observation` elements.
    pub observation: &'a [O],
    /// The goals achieved in these states, `n * dims.goal` elements.
    pub achieved_goal: &'a [G],
    /// The goals of the episodes that start, `n * dims.goal` elements.
    pub desired_goal: &'a [G],
    /// The fields of the configuration, by name, in any order; `n * len` elements each.
    pub fields: &'a [FieldRows<'a, G>],
    /// The numbers by which a row that is missing, or recorded twice, is noticed. Without them the
    /// caller answers for the order.
    pub numbers: Option<RowNumbers<'a>>,
}

/// What has rows that [`HerBuffer::record`](crate::HerBuffer::record) takes: [`StepRows`], and the
/// results of vectorized environments, such as those of `fetch-env` with its feature `her-relabel`.
///
/// ```compile_fail,E0277
/// use her_relabel::{BufferConfig, Dims, HerBuffer};
///
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// buffer.record(&[0.5])?.check()?; // the compiler says what has rows
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no rows for a hindsight buffer",
    label = "neither `StepRows` nor the result of vectorized environments",
    note = "results of `fetch_env::VecEnv` have rows with `features = [\"her-relabel\"]` of `fetch-env`",
    note = "results of other environments have them once they implement `AsStepRows`"
)]
pub trait AsStepRows {
    /// An element of an observation.
    type Observation: Scalar;
    /// An element of a goal, and a reward.
    type Goal: Scalar;
    /// An element of an action.
    type Action: Scalar;

    /// Returns the rows.
    fn as_step_rows(&self) -> StepRows<'_, Self::Observation, Self::Goal, Self::Action>;
}

impl<O: Scalar, G: Scalar, A: Scalar> AsStepRows for StepRows<'_, O, G, A> {
    type Observation = O;
    type Goal = G;
    type Action = A;

    fn as_step_rows(&self) -> StepRows<'_, O, G, A> {
        *self
    }
}

/// The numbers of rows: where each stands among all rows of its environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowNumbers<'a> {
    /// The vectorized environments that returned the rows: a number that no others have.
    pub source: u64,
    /// The numbers, `n` elements. Those of an environment count its steps, starts and failures: a
    /// row with one of them has the next number. The numbers of other rows are not read.
    pub number: &'a [u64],
}

impl RowNumbers<'_> {
    /// Returns the number of the row at `at`.
    pub(crate) fn row(&self, at: usize) -> RowNumber {
        RowNumber { source: self.source, number: self.number[at] }
    }
}

impl<'a, O, G: Copy, A> StepRows<'a, O, G, A> {
    /// Returns the step of the row at `at`, whose fields are those of all rows.
    pub(crate) fn step(&self, at: usize, dims: Dims) -> StepData<'a, O, G, A> {
        StepData {
            action: row(self.action, at, dims.action),
            reward: self.reward[at],
            next_observation: row(self.next_observation, at, dims.observation),
            next_achieved_goal: row(self.next_achieved_goal, at, dims.goal),
            terminated: self.terminated[at],
            truncated: self.truncated[at],
            fields: self.fields,
        }
    }

    /// Returns the desired goal after the step of the row at `at`, if it is given.
    pub(crate) fn next_desired_goal(&self, at: usize, dims: Dims) -> Option<&'a [G]> {
        let is_given = !self.next_desired_goal.is_empty();
        is_given.then(|| row(self.next_desired_goal, at, dims.goal))
    }

    /// Returns the start of the row at `at`.
    pub(crate) fn start(&self, at: usize, dims: Dims) -> StartData<'a, O, G> {
        StartData {
            observation: row(self.observation, at, dims.observation),
            achieved_goal: row(self.achieved_goal, at, dims.goal),
            desired_goal: row(self.desired_goal, at, dims.goal),
        }
    }
}

fn row<S>(matrix: &[S], at: usize, len: usize) -> &[S] {
    &matrix[at * len..][..len]
}
