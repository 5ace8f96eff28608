//! A batch of achieved and desired goals, and checks of goals.

use crate::error::{GoalError, GoalRole};

/// A batch of pairs of goals: two borrowed row-major matrices of `len` rows and `dim` columns.
///
/// # Example
/// ```
/// use goal_reward::GoalPairs;
///
/// let pairs = GoalPairs::new(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 2.0, 4.0], 2)?;
/// assert_eq!(pairs.len(), 2);
/// assert_eq!(pairs.iter().last(), Some((&[2.0, 3.0][..], &[2.0, 4.0][..])));
/// # Ok::<(), goal_reward::GoalError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalPairs<'a> {
    achieved: &'a [f64],
    desired: &'a [f64],
    dim: usize,
}

impl<'a> GoalPairs<'a> {
    /// Views two contiguous matrices as pairs of goals of `dim` elements. An empty batch is
    /// allowed.
    ///
    /// # Errors
    /// [`GoalError::LengthMismatch`] if the matrices differ in size, [`GoalError::Empty`] if `dim`
    /// is 0, [`GoalError::PartialRow`] if the last goal is incomplete. The values are not checked;
    /// see [`check_finite`](Self::check_finite).
    pub fn new(achieved: &'a [f64], desired: &'a [f64], dim: usize) -> Result<Self, GoalError> {
        if achieved.len() != desired.len() {
            let (achieved, desired) = (achieved.len(), desired.len());
            return Err(GoalError::LengthMismatch { achieved, desired });
        }
        if dim == 0 {
            return Err(GoalError::Empty);
        }
        if !achieved.len().is_multiple_of(dim) {
            return Err(GoalError::PartialRow { len: achieved.len(), dim });
        }
        Ok(Self { achieved, desired, dim })
    }

    /// Returns the number of pairs.
    #[inline]
    #[must_use]
    pub fn len(&self) -> usize {
        self.achieved.len() / self.dim
    }

    /// Returns whether the batch is empty.
    #[inline]
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.achieved.is_empty()
    }

    /// Returns the number of elements of one goal, at least 1.
    #[inline]
    #[must_use]
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Returns all achieved goals, `len * dim` elements.
    #[inline]
    #[must_use]
    pub fn achieved(&self) -> &'a [f64] {
        self.achieved
    }

    /// Returns all desired goals, `len * dim` elements.
    #[inline]
    #[must_use]
    pub fn desired(&self) -> &'a [f64] {
        self.desired
    }

    /// Iterates over the pairs in order, as `(achieved_goal, desired_goal)` of `dim` elements each.
    #[inline]
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&'a [f64], &'a [f64])> + use<'a> {
        let desired = self.desired.chunks_exact(self.dim);
        self.achieved.chunks_exact(self.dim).zip(desired)
    }

    /// Checks that every element of every goal is finite.
    ///
    /// # Errors
    /// [`GoalError::NotFinite`] with the position and value of the first that is not, achieved
    /// goals before desired ones.
    pub fn check_finite(&self) -> Result<(), GoalError> {
        check_finite(GoalRole::Achieved, self.achieved, self.dim)?;
        check_finite(GoalRole::Desired, self.desired, self.dim)
    }

    /// Writes `f` of every pair to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold [`len`](Self::len) elements; it is then
    /// left unchanged.
    #[inline]
    pub fn map_into<T>(
        &self,
        out: &mut [T],
        mut f: impl FnMut(&[f64], &[f64]) -> T,
    ) -> Result<(), GoalError> {
        self.check_output(out.len())?;
        for (slot, (achieved, desired)) in out.iter_mut().zip(self.iter()) {
            *slot = f(achieved, desired);
        }
        Ok(())
    }

    #[inline]
    pub(crate) fn check_output(&self, actual: usize) -> Result<(), GoalError> {
        let expected = self.len();
        if actual == expected { Ok(()) } else { Err(GoalError::OutputLength { expected, actual }) }
    }
}

/// Checks that two goals can be compared.
///
/// # Errors
/// [`GoalError::LengthMismatch`], [`GoalError::Empty`], or [`GoalError::NotFinite`] for the first
/// element that is NaN or infinite, the achieved goal's first.
pub fn check_goals(achieved_goal: &[f64], desired_goal: &[f64]) -> Result<(), GoalError> {
    GoalPairs::new(achieved_goal, desired_goal, achieved_goal.len())?.check_finite()
}

/// Returns an error for the first element of goals of `dim` elements that is not finite.
fn check_finite(role: GoalRole, goals: &[f64], dim: usize) -> Result<(), GoalError> {
    // Blocks without a branch inside, so that the compiler vectorizes them.
    const BLOCK: usize = 64;
    let is_bad = |block: &[f64]| block.iter().fold(false, |bad, value| bad | !value.is_finite());
    if !goals.chunks(BLOCK).any(is_bad) {
        return Ok(());
    }
    let Some(at) = goals.iter().position(|value| !value.is_finite()) else { return Ok(()) };
    Err(GoalError::NotFinite { role, row: at / dim, index: at % dim, value: goals[at] })
}
