//! The inputs of networks while acting: the same numbers as in a draw.

use goal_reward::Dims;
use thiserror::Error;

use crate::sample::rows::form::Formed;
use crate::sample::settings::inputs::{JoinedGoal, Normalizers};
use crate::scalar::Scalar;

/// States and their goals, for [`Normalizers::write_input`]: row-major, `n` rows each, one for each
/// environment.
///
/// The types of observations (`O`) and goals (`G`) are `f32` or `f64`, independent of each other.
#[derive(Clone, Copy, Debug)]
pub struct StateRows<'a, O, G = O> {
    /// The observations, `n * dims.observation` elements.
    pub observation: &'a [O],
    /// The goals achieved in these states, `n * dims.goal` elements.
    pub achieved_goal: &'a [G],
    /// The goals to pursue, `n * dims.goal` elements.
    pub desired_goal: &'a [G],
}

impl Normalizers<'_> {
    /// Writes the inputs of a network that acts: each observation followed by a goal, normalized;
    /// `n * (dims.observation + dims.goal)` elements for `n` states.
    ///
    /// They are the rows that a draw with this [joined goal](crate::Sampler::with_joined_goal) and
    /// these normalizers writes to [`Batch::input`](crate::Batch::input) for the same numbers, bit
    /// for bit. Note that a buffer of `f32` rounds the numbers of a state in `f64`.
    ///
    /// # Errors
    /// [`InputError`]; then nothing has been written.
    ///
    /// # Example
    /// ```
    /// use her_relabel::{Dims, JoinedGoal, Normalizer, NormalizerConfig, Normalizers, StateRows};
    ///
    /// let dims = Dims { observation: 2, goal: 1, action: 1 };
    /// let mut observation = Normalizer::new(NormalizerConfig::new(dims.observation))?;
    /// observation.update(&[0.0, 10.0, 2.0, 30.0])?;
    /// let normalizers = Normalizers { observation: Some(&observation), goal: None };
    ///
    /// let states = StateRows {
    ///     observation: &[2.0, 10.0, 1.0, 20.0],
    ///     achieved_goal: &[0.5, 0.0],
    ///     desired_goal: &[2.5, 1.0],
    /// };
    /// let mut input = [0.0_f32; 2 * 3];
    /// normalizers.write_input(JoinedGoal::Relative, dims, &states, &mut input)?;
    /// assert_eq!(input, [1.0, -1.0, 2.0, 0.0, 0.0, 1.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn write_input<O: Scalar, G: Scalar, T: Scalar>(
        &self,
        joined_goal: JoinedGoal,
        dims: Dims,
        states: &StateRows<'_, O, G>,
        input: &mut [T],
    ) -> Result<(), InputError> {
        let Self { observation, goal } = *self;
        let form = Formed { observation, goal, relative: joined_goal == JoinedGoal::Relative };
        if let Some((expected, actual)) = form.wrong_dim(dims) {
            return Err(InputError::NormalizerDim { expected, actual });
        }
        let num_rows = states.check(dims, input.len())?;
        let Dims { observation, goal, .. } = dims;
        for at in 0..num_rows {
            form.put_input(
                &mut input[at * (observation + goal)..][..observation + goal],
                &states.observation[at * observation..][..observation],
                &states.achieved_goal[at * goal..][..goal],
                &states.desired_goal[at * goal..][..goal],
            );
        }
        Ok(())
    }
}

impl<O: Scalar, G: Scalar> StateRows<'_, O, G> {
    /// Checks the lengths for an input of `len` elements, and that each element is finite. Returns
    /// the number of rows.
    fn check(&self, dims: Dims, len: usize) -> Result<usize, InputError> {
        let Dims { observation, goal, .. } = dims;
        let rows = self.observation.len().checked_div(observation).unwrap_or_default();
        check_len("observation", self.observation.len(), rows.saturating_mul(observation))?;
        check_len("achieved_goal", self.achieved_goal.len(), rows.saturating_mul(goal))?;
        check_len("desired_goal", self.desired_goal.len(), rows.saturating_mul(goal))?;
        check_len("input", len, rows.saturating_mul(observation.saturating_add(goal)))?;
        check_finite("observation", self.observation)?;
        check_finite("achieved_goal", self.achieved_goal)?;
        check_finite("desired_goal", self.desired_goal)?;
        Ok(rows)
    }
}

fn check_len(column: &'static str, actual: usize, expected: usize) -> Result<(), InputError> {
    if actual == expected {
        return Ok(());
    }
    Err(InputError::WrongLength { column, expected, actual })
}

fn check_finite<S: Scalar>(column: &'static str, values: &[S]) -> Result<(), InputError> {
    match values.iter().position(|value| !value.to_f64().is_finite()) {
        Some(index) => {
            let value = values[index].to_f64();
            Err(InputError::NotFinite { column, index, value })
        }
        None => Ok(()),
    }
}

/// Error returned if the inputs of a network cannot be written.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum InputError {
    /// A column has the wrong length.
    #[error(
        "`{column}` has {actual} elements instead of {expected}: pass a row for each observation"
    )]
    WrongLength {
        /// The column: a field of [`StateRows`], or `input`.
        column: &'static str,
        /// The length it should have.
        expected: usize,
        /// Its length.
        actual: usize,
    },
    /// A normalizer is for vectors of another length.
    #[error("a normalizer has {actual} elements instead of {expected}: pass one for these states")]
    NormalizerDim {
        /// The length of the vectors.
        expected: usize,
        /// The dimensions of the normalizer.
        actual: usize,
    },
    /// An element is NaN or infinite.
    #[error("`{column}[{index}]` is {value:?}: leave the state out, or find what produced it")]
    NotFinite {
        /// The column.
        column: &'static str,
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
}
debug_as_display!(InputError);
