//! Choices: one, several at once, or several between true and false.

use rand_core::Rng;
use serde::{Deserialize, Serialize};

use super::{error::SpaceError, num_elements};

/// One of several choices, numbered from [`start`](Self::start). A member is an array of one `i64`.
///
/// ```
/// use fetch_env::{DiscreteSpace, NpRandom};
///
/// let moves = DiscreteSpace::new(4)?; // 0, 1, 2 or 3
/// assert!(moves.contains(&[3]) && !moves.contains(&[4]));
/// let drawn = moves.sample(&mut NpRandom::new(7));
/// assert!(moves.contains(&drawn));
/// # Ok::<(), fetch_env::spaces::SpaceError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Range")]
pub struct DiscreteSpace {
    n: u64,
    start: i64,
}

impl DiscreteSpace {
    /// Creates the space of the choices from 0 to `n - 1`.
    ///
    /// # Errors
    /// As [`from_start`](Self::from_start).
    pub fn new(n: u64) -> Result<Self, SpaceError> {
        Self::from_start(n, 0)
    }

    /// Creates the space of `n` choices, the first of which is `start`.
    ///
    /// # Errors
    /// [`SpaceError::Choices`] if there is no choice, or if the last one exceeds an `i64`.
    pub fn from_start(n: u64, start: i64) -> Result<Self, SpaceError> {
        let choices = Choices { n, start };
        choices.check(0)?;
        Ok(Self { n, start })
    }

    /// Returns the number of choices.
    #[must_use]
    pub const fn n(&self) -> u64 {
        self.n
    }

    /// Returns the smallest choice.
    #[must_use]
    pub const fn start(&self) -> i64 {
        self.start
    }

    /// Returns the largest choice.
    #[must_use]
    pub const fn last(&self) -> i64 {
        self.choices().last()
    }

    /// Whether `array` has one element, which is one of the choices.
    #[must_use]
    pub const fn contains(&self, array: &[i64]) -> bool {
        matches!(array, [choice] if self.choices().contains(*choice))
    }

    /// Draws a member: every choice with the same probability.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> [i64; 1] {
        [self.choices().sample(rng)]
    }

    pub(crate) const fn len(&self) -> usize {
        1
    }

    pub(crate) const fn choices(&self) -> Choices {
        Choices { n: self.n, start: self.start }
    }
}

/// Several choices at once, each from its own range. A member is an array of `i64`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Ranges")]
pub struct MultiDiscreteSpace {
    nvec: Vec<u64>,
    start: Vec<i64>,
}

impl MultiDiscreteSpace {
    /// Creates the space of arrays whose element `i` is from 0 to `nvec[i] - 1`.
    ///
    /// # Errors
    /// As [`from_start`](Self::from_start).
    pub fn new(nvec: Vec<u64>) -> Result<Self, SpaceError> {
        let start = vec![0; nvec.len()];
        Self::from_start(nvec, start)
    }

    /// Creates the space of arrays whose element `i` is one of `nvec[i]` choices, the first of
    /// which is `start[i]`.
    ///
    /// # Errors
    /// [`SpaceError::StartCount`] if the two differ in length; [`SpaceError::Choices`] if an
    /// element has no choice, or if its last one exceeds an `i64`.
    pub fn from_start(nvec: Vec<u64>, start: Vec<i64>) -> Result<Self, SpaceError> {
        if nvec.len() != start.len() {
            return Err(SpaceError::StartCount { expected: nvec.len(), actual: start.len() });
        }
        let space = Self { nvec, start };
        for (index, choices) in space.choices().enumerate() {
            choices.check(index)?;
        }
        Ok(space)
    }

    /// Returns the number of choices of each element.
    #[must_use]
    pub fn nvec(&self) -> &[u64] {
        &self.nvec
    }

    /// Returns the smallest choice of each element.
    #[must_use]
    pub fn start(&self) -> &[i64] {
        &self.start
    }

    /// Returns the number of elements.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.nvec.len()
    }

    /// Whether its arrays have no elements.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.nvec.is_empty()
    }

    /// Whether `array` has the right length and each element is one of its choices.
    #[must_use]
    pub fn contains(&self, array: &[i64]) -> bool {
        array.len() == self.len()
            && array.iter().zip(self.choices()).all(|(&x, choices)| choices.contains(x))
    }

    /// Draws a member, each element independently, every choice with the same probability.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<i64> {
        self.choices().map(|choices| choices.sample(rng)).collect()
    }

    pub(crate) fn choices(&self) -> impl Iterator<Item = Choices> + '_ {
        self.nvec.iter().zip(&self.start).map(|(&n, &start)| Choices { n, start })
    }
}

/// Several choices between true and false. A member is an array of `bool`, row-major.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Shape")]
pub struct MultiBinarySpace {
    shape: Vec<usize>,
}

impl MultiBinarySpace {
    /// Creates the space of arrays of `shape`.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if the shape has more than 2^28 elements.
    pub fn new(shape: Vec<usize>) -> Result<Self, SpaceError> {
        num_elements(&shape)?;
        Ok(Self { shape })
    }

    /// Returns the length of each axis.
    #[must_use]
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Returns the number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether its arrays have no elements.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether `array` has the right length.
    #[must_use]
    pub fn contains(&self, array: &[bool]) -> bool {
        array.len() == self.len()
    }

    /// Draws a member, each element independently, true and false with the same probability.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<bool> {
        let mut array = vec![false; self.len()];
        fill(&mut array, rng);
        array
    }
}

/// Draws 64 elements from each word, the lowest bit first.
pub(crate) fn fill<R: Rng + ?Sized>(array: &mut [bool], rng: &mut R) {
    for elements in array.chunks_mut(64) {
        let word = rng.next_u64();
        for (bit, element) in elements.iter_mut().enumerate() {
            *element = word >> bit & 1 == 1;
        }
    }
}

/// The choices of an element: `n` integers from `start` on.
#[derive(Clone, Copy)]
pub(crate) struct Choices {
    n: u64,
    pub(crate) start: i64,
}

impl Choices {
    fn check(self, index: usize) -> Result<(), SpaceError> {
        let Self { n, start } = self;
        let last = i128::from(start) + i128::from(n) - 1;
        if n == 0 || last > i128::from(i64::MAX) {
            return Err(SpaceError::Choices { index, n, start });
        }
        Ok(())
    }

    /// Returns the largest choice. The sum is exact modulo 2^64, and the check keeps it in range.
    pub(crate) const fn last(self) -> i64 {
        self.start.wrapping_add_unsigned(self.n - 1)
    }

    pub(crate) const fn contains(self, choice: i64) -> bool {
        self.start <= choice && choice <= self.last()
    }

    /// Draws a choice by D. Lemire's method, "Fast random integer generation in an interval", 2019,
    /// on words of 64 bits: without bias, one word for nearly every draw.
    pub(crate) fn sample<R: Rng + ?Sized>(self, rng: &mut R) -> i64 {
        let mut draw = || u128::from(rng.next_u64()) * u128::from(self.n);
        let mut product = draw();
        if (product as u64) < self.n {
            let reject_below = self.n.wrapping_neg() % self.n;
            while (product as u64) < reject_below {
                product = draw();
            }
        }
        self.start.wrapping_add_unsigned((product >> 64) as u64)
    }
}

/// The serialized form of a [`DiscreteSpace`].
#[derive(Deserialize)]
#[serde(rename = "DiscreteSpace", deny_unknown_fields)]
struct Range {
    n: u64,
    start: i64,
}

impl TryFrom<Range> for DiscreteSpace {
    type Error = SpaceError;

    fn try_from(Range { n, start }: Range) -> Result<Self, SpaceError> {
        Self::from_start(n, start)
    }
}

/// The serialized form of a [`MultiDiscreteSpace`].
#[derive(Deserialize)]
#[serde(rename = "MultiDiscreteSpace", deny_unknown_fields)]
struct Ranges {
    nvec: Vec<u64>,
    start: Vec<i64>,
}

impl TryFrom<Ranges> for MultiDiscreteSpace {
    type Error = SpaceError;

    fn try_from(Ranges { nvec, start }: Ranges) -> Result<Self, SpaceError> {
        Self::from_start(nvec, start)
    }
}

/// The serialized form of a [`MultiBinarySpace`].
#[derive(Deserialize)]
#[serde(rename = "MultiBinarySpace", deny_unknown_fields)]
struct Shape {
    shape: Vec<usize>,
}

impl TryFrom<Shape> for MultiBinarySpace {
    type Error = SpaceError;

    fn try_from(Shape { shape }: Shape) -> Result<Self, SpaceError> {
        Self::new(shape)
    }
}
