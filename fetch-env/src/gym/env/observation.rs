//! Observations: with goals or plain, of one environment or of many, row after row.

use std::fmt::Debug;

use crate::gym::spaces::{Space, Value, box_space::Element, element::ArrayElement};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// An observation that can be a row of a [`VecStep`](crate::vec_env::VecStep).
///
/// Most observations can use existing rows: [`GoalRows`] take any
/// [`GoalObservation`](crate::GoalObservation), [`ArrayRows`] any array of numbers.
///
/// ```
/// use fetch_env::{GoalObservation, vec_env::{BatchObservation, GoalRows}};
///
/// #[derive(Clone, Debug, PartialEq)]
/// struct Point { at: [f32; 2], achieved: [f64; 2], desired: [f64; 2] }
///
/// impl GoalObservation for Point {
///     type Element = f32;
///     fn observation(&self) -> &[f32] { &self.at }
///     fn achieved_goal(&self) -> &[f64] { &self.achieved }
///     fn desired_goal(&self) -> &[f64] { &self.desired }
/// }
///
/// impl BatchObservation for Point {
///     type Rows = GoalRows<f32>;
/// }
/// ```
pub trait BatchObservation: Clone + Debug + PartialEq {
    /// Many of these observations, each part contiguous.
    type Rows: Rows<Self>;

    /// Returns the observation as a value of its space.
    ///
    /// # Errors
    /// [`SpaceError::MissingPart`] or [`EnvError::ObservationLength`] if the observation does
    /// not have the parts or the shape of that space.
    fn to_value(&self, space: &Space) -> Result<Value, EnvError> {
        let mut row = Self::Rows::new(space, 1)?;
        row.write_row(0, self)?;
        Ok(row.value(0))
    }
}

/// An observation with two goals; see the example of [`BatchObservation`].
pub trait GoalObservation:
    BatchObservation<Rows: AsRef<GoalRows<<Self as GoalObservation>::Element>>>
{
    /// Precision of the observation: `f32` or `f64`. Goals are `f64`, like rewards.
    type Element: Element;

    /// Returns the part of the state that a policy sees.
    fn observation(&self) -> &[Self::Element];

    /// Returns the goal that the state achieves.
    fn achieved_goal(&self) -> &[f64];

    /// Returns the goal to achieve; constant throughout an episode, unless a
    /// [`MovingGoal`](crate::MovingGoal) was set.
    fn desired_goal(&self) -> &[f64];

    /// Returns the position of what the actions move, in meters, from the elements of an
    /// `observation`: the gripper's in the Fetch tasks. `None`, the default, if they do not show it.
    #[must_use]
    fn position(observation: &[Self::Element]) -> Option<[f64; 3]> {
        let _ = observation;
        None
    }
}

/// Many observations of the type `O`, row after row. [`GoalRows`] and [`ArrayRows`] implement it.
///
/// ```
/// use fetch_env::vec_env::{BatchObservation, Rows};
/// use fetch_env::{BoxSpace, EnvError, Space};
///
/// /// Writes one observation and returns it as a value of its space.
/// fn written<O: BatchObservation>(space: &Space, observation: &O) -> Result<Space, EnvError> {
///     let mut rows = O::Rows::new(space, 1)?;
///     rows.write_row(0, observation)?;
///     assert!(space.contains(&rows.value(0)));
///     Ok(space.clone())
/// }
/// written(&BoxSpace::<f32>::unbounded(2)?.into(), &[1.0_f32, 2.0])?;
/// # Ok::<(), EnvError>(())
/// ```
pub trait Rows<O>: Clone + Debug + Send {
    /// Creates `num_rows` rows for observations of a space. Floating-point numbers are NaN.
    ///
    /// # Errors
    /// [`SpaceError::MissingPart`] if the rows cannot hold observations of that space.
    fn new(space: &Space, num_rows: usize) -> Result<Self, SpaceError>;

    /// Writes an observation to `row`.
    ///
    /// # Errors
    /// [`EnvError::ObservationLength`] if the observation does not have the shape of its space.
    fn write_row(&mut self, row: usize, observation: &O) -> Result<(), EnvError>;

    /// Copies row `from_row` of `from`, which was made for the same space, to `row`.
    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize);

    /// Returns a row as a value of its space.
    fn value(&self, row: usize) -> Value;
}

/// Observations, achieved and desired goals, each row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalRows<T> {
    observation: Matrix<T>,
    achieved_goal: Matrix<f64>,
    desired_goal: Matrix<f64>,
}

impl<T: Element> GoalRows<T> {
    /// Returns the observations of the first `num_rows` rows.
    #[must_use]
    pub fn observation(&self, num_rows: usize) -> &[T] {
        self.observation.rows(num_rows)
    }

    /// Returns the achieved goals of the first `num_rows` rows.
    #[must_use]
    pub fn achieved_goal(&self, num_rows: usize) -> &[f64] {
        self.achieved_goal.rows(num_rows)
    }

    /// Returns the desired goals of the first `num_rows` rows.
    #[must_use]
    pub fn desired_goal(&self, num_rows: usize) -> &[f64] {
        self.desired_goal.rows(num_rows)
    }

    /// Replaces the achieved goal of a row, and the end of its observation.
    pub(crate) fn complete(&mut self, row: usize, achieved_goal: &[f64], extra: &[T]) {
        self.achieved_goal.row_mut(row).copy_from_slice(achieved_goal);
        let observation = self.observation.row_mut(row);
        let start = observation.len() - extra.len();
        observation[start..].copy_from_slice(extra);
    }
}

impl<O: GoalObservation> Rows<O> for GoalRows<O::Element> {
    fn new(space: &Space, num_rows: usize) -> Result<Self, SpaceError> {
        let part = |key| space.as_dict().and_then(|dict| dict.get(key));
        Ok(Self {
            observation: Matrix::new(part("observation"), "observation", num_rows)?,
            achieved_goal: Matrix::new(part("achieved_goal"), "achieved_goal", num_rows)?,
            desired_goal: Matrix::new(part("desired_goal"), "desired_goal", num_rows)?,
        })
    }

    fn write_row(&mut self, row: usize, observation: &O) -> Result<(), EnvError> {
        self.observation.write(row, observation.observation())?;
        self.achieved_goal.write(row, observation.achieved_goal())?;
        self.desired_goal.write(row, observation.desired_goal())
    }

    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        self.observation.copy_row(row, &from.observation, from_row);
        self.achieved_goal.copy_row(row, &from.achieved_goal, from_row);
        self.desired_goal.copy_row(row, &from.desired_goal, from_row);
    }

    fn value(&self, row: usize) -> Value {
        let parts = [
            ("achieved_goal", ArrayElement::value(self.achieved_goal.row(row))),
            ("desired_goal", ArrayElement::value(self.desired_goal.row(row))),
            ("observation", ArrayElement::value(self.observation.row(row))),
        ];
        Value::Dict(parts.map(|(key, part)| (key.into(), part)).into())
    }
}

impl<T> AsRef<Self> for GoalRows<T> {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// Arrays of numbers, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayRows<T>(Matrix<T>);

impl<T: ArrayElement> ArrayRows<T> {
    /// Returns the arrays of the first `num_rows` rows.
    #[must_use]
    pub fn array(&self, num_rows: usize) -> &[T] {
        self.0.rows(num_rows)
    }
}

impl<T> AsRef<Self> for ArrayRows<T> {
    fn as_ref(&self) -> &Self {
        self
    }
}

impl<T: ArrayElement, O: AsRef<[T]>> Rows<O> for ArrayRows<T> {
    fn new(space: &Space, num_rows: usize) -> Result<Self, SpaceError> {
        Ok(Self(Matrix::new(Some(space), "observation", num_rows)?))
    }

    fn write_row(&mut self, row: usize, observation: &O) -> Result<(), EnvError> {
        self.0.write(row, observation.as_ref())
    }

    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        self.0.copy_row(row, &from.0, from_row);
    }

    fn value(&self, row: usize) -> Value {
        T::value(self.0.row(row))
    }
}

impl<T: ArrayElement> BatchObservation for Vec<T> {
    type Rows = ArrayRows<T>;
}

impl<T: ArrayElement, const N: usize> BatchObservation for [T; N] {
    type Rows = ArrayRows<T>;
}

/// Rows of equal length.
#[derive(Clone, Debug, PartialEq)]
struct Matrix<T> {
    key: &'static str,
    len: usize,
    elements: Vec<T>,
}

impl<T: ArrayElement> Matrix<T> {
    /// Creates rows for members of `space`, the part `key` of an observation.
    fn new(space: Option<&Space>, key: &'static str, num_rows: usize) -> Result<Self, SpaceError> {
        let error = SpaceError::MissingPart { key, element: std::any::type_name::<T>() };
        let len = space.and_then(T::len_in).ok_or(error)?;
        Ok(Self { key, len, elements: vec![T::EMPTY; num_rows * len] })
    }
}

impl<T: Copy> Matrix<T> {
    fn rows(&self, num_rows: usize) -> &[T] {
        &self.elements[..num_rows * self.len]
    }

    fn row(&self, row: usize) -> &[T] {
        &self.elements[row * self.len..][..self.len]
    }

    fn row_mut(&mut self, row: usize) -> &mut [T] {
        &mut self.elements[row * self.len..][..self.len]
    }

    fn write(&mut self, row: usize, values: &[T]) -> Result<(), EnvError> {
        let (key, expected, actual) = (self.key, self.len, values.len());
        if actual != expected {
            return Err(EnvError::ObservationLength { key, expected, actual });
        }
        self.elements[row * expected..][..expected].copy_from_slice(values);
        Ok(())
    }

    fn copy_row(&mut self, row: usize, from: &Self, from_row: usize) {
        let values = &from.elements[from_row * self.len..][..self.len];
        self.elements[row * self.len..][..self.len].copy_from_slice(values);
    }
}
