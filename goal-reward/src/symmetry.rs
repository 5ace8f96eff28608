//! Symmetries of tasks: mirror images of observations, goals and actions.

use thiserror::Error;

/// The rule for one element of a mirrored vector: `sign * x + offset`, where `x` is the element at
/// `source`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Mirrored {
    source: usize,
    sign: f64,
    offset: f64,
}

impl Mirrored {
    /// Copies the element at `source`, which is the element's own index if it does not change, or
    /// the index of the element with which it swaps places.
    pub const fn same(source: usize) -> Self {
        // -0.0 is the additive identity: the element keeps its bits.
        Self { source, sign: 1.0, offset: -0.0 }
    }

    /// Negates the element at `source`: a difference or a velocity across the plane, or a rotation
    /// about an axis in it.
    pub const fn negated(source: usize) -> Self {
        Self { source, sign: -1.0, offset: -0.0 }
    }

    /// Mirrors the coordinate `x` at `source` across `plane`, which has the same unit:
    /// `2 * plane - x`.
    pub const fn across(source: usize, plane: f64) -> Self {
        Self { source, sign: -1.0, offset: 2.0 * plane }
    }

    /// Returns the mirrored element of a vector whose elements `element` returns.
    #[inline(always)]
    pub fn of(&self, element: impl FnOnce(usize) -> f64) -> f64 {
        self.sign * element(self.source) + self.offset
    }

    /// Returns the rule for a vector that follows `further` other elements.
    const fn behind(self, further: usize) -> Self {
        Self { source: self.source + further, ..self }
    }
}

/// The mirror image of vectors of one length. Mirroring a vector twice gives the same vector, up to
/// rounding.
///
/// ```
/// use goal_reward::{Mirror, Mirrored};
///
/// // Two fingers change places, and y is mirrored at 0.75.
/// let mirror = Mirror::new([Mirrored::same(1), Mirrored::same(0), Mirrored::across(2, 0.75)])?;
/// let mut mirrored = [0.0; 3];
/// mirror.write(&[0.01, 0.02, 0.5], &mut mirrored)?;
/// assert_eq!(mirrored, [0.02, 0.01, 1.0]);
/// // The second element would come from the first one, which stays.
/// assert!(Mirror::new([Mirrored::same(0), Mirrored::same(0)]).is_err());
/// # Ok::<(), goal_reward::SymmetryError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Mirror {
    elements: Vec<Mirrored>,
}

impl Mirror {
    /// Creates a mirror from one rule per element of a vector.
    ///
    /// # Errors
    /// [`SymmetryError`] if a source is not an element, an offset is not finite, or mirroring twice
    /// would not give the same vector.
    pub fn new(elements: impl Into<Vec<Mirrored>>) -> Result<Self, SymmetryError> {
        let elements = elements.into();
        for (index, element) in elements.iter().enumerate() {
            let Mirrored { source, sign, offset } = *element;
            let Some(back) = elements.get(source) else {
                let len = elements.len();
                return Err(SymmetryError::Outside { index, from: source, len });
            };
            if !offset.is_finite() {
                return Err(SymmetryError::NotFinite { index, offset });
            }
            if back.source != index || back.sign != sign || sign * back.offset != -offset {
                return Err(SymmetryError::NotInverse { index, from: source });
            }
        }
        Ok(Self { elements })
    }

    /// Returns the mirror of vectors that consist of one of this mirror's vectors and one of
    /// `further`'s.
    pub fn followed_by(mut self, further: &Self) -> Self {
        let len = self.elements.len();
        self.elements.extend(further.elements.iter().map(|element| element.behind(len)));
        self
    }

    /// Returns the rule of each element.
    pub fn elements(&self) -> &[Mirrored] {
        &self.elements
    }

    /// Returns the number of elements of a vector.
    #[must_use]
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// Returns whether vectors have no elements.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    /// Writes the mirror image of `vector` to `mirrored`.
    ///
    /// # Errors
    /// [`SymmetryError::WrongLength`] if one of them does not have [`len`](Self::len) elements;
    /// then nothing has been written.
    pub fn write(&self, vector: &[f64], mirrored: &mut [f64]) -> Result<(), SymmetryError> {
        let expected = self.len();
        for actual in [vector.len(), mirrored.len()] {
            if actual != expected {
                return Err(SymmetryError::WrongLength { expected, actual });
            }
        }
        for (mirrored, element) in mirrored.iter_mut().zip(&self.elements) {
            *mirrored = element.of(|index| vector[index]);
        }
        Ok(())
    }
}

/// A symmetry of a task: from the mirror image of a state, the mirror image of an action leads to
/// the mirror image of the next state, with the same reward and the same ending.
///
/// The mirror image of an experience is therefore another experience to learn from. How exactly
/// this holds depends on the task.
///
/// ```
/// use goal_reward::{Mirror, Mirrored, Symmetry};
///
/// // A point on a plane that is pushed in x and y: left and right are the same.
/// let symmetry = Symmetry {
///     observation: Mirror::new([Mirrored::same(0), Mirrored::negated(1)])?,
///     goal: Mirror::new([Mirrored::same(0), Mirrored::negated(1)])?,
///     action: Mirror::new([Mirrored::same(0), Mirrored::negated(1)])?,
/// };
/// let mut mirrored = [0.0; 2];
/// symmetry.action.write(&[0.5, 1.0], &mut mirrored)?;
/// assert_eq!(mirrored, [0.5, -1.0]);
/// # Ok::<(), goal_reward::SymmetryError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetry {
    /// The mirror image of observations.
    pub observation: Mirror,
    /// The mirror image of goals, achieved and desired.
    pub goal: Mirror,
    /// The mirror image of actions.
    pub action: Mirror,
}

/// Error returned for rules that do not form a [`Mirror`].
#[derive(Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SymmetryError {
    /// An element comes from an element that does not exist.
    #[error(
        "mirrored element {index} comes from element {from} of {len}: pass an index below {len}"
    )]
    Outside {
        /// The mirrored element.
        index: usize,
        /// Where it comes from.
        from: usize,
        /// The number of elements.
        len: usize,
    },
    /// An offset is NaN or infinite.
    #[error("the offset of mirrored element {index} is {offset}: pass a plane that is finite")]
    NotFinite {
        /// The mirrored element.
        index: usize,
        /// Its offset.
        offset: f64,
    },
    /// An element does not return to its place.
    #[error(
        "mirrored element {index} comes from element {from}, but mirroring twice does not return \
         it: swap two elements by the same rule, or leave each in its place"
    )]
    NotInverse {
        /// The mirrored element.
        index: usize,
        /// Where it comes from.
        from: usize,
    },
    /// A vector and the mirror have different lengths.
    #[error("a vector has {actual} elements and its mirror {expected}: pass the same number")]
    WrongLength {
        /// The mirror's length.
        expected: usize,
        /// The vector's length.
        actual: usize,
    },
}
debug_as_display!(SymmetryError);
