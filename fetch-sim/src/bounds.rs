//! Bounds of the numbers in a simulation.

use serde::{Deserialize, Serialize};

use crate::error::SimError;

/// The largest magnitude of a number in the state of a simulation: 1e10, in meters, seconds,
/// radians and their quotients.
///
/// It is MuJoCo's own bound (`mjMAXVAL`): a simulation with a larger position, velocity or
/// acceleration counts as unstable. No stable simulation comes near it, and no arithmetic on such
/// numbers overflows.
pub const LARGEST_NUMBER: f64 = 1e10;

/// Returns the first number that is NaN or exceeds [`LARGEST_NUMBER`].
pub(crate) fn first_outside<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> Option<f64> {
    let is_inside = |number: &f64| number.abs() <= LARGEST_NUMBER;
    numbers.into_iter().copied().find(|number| !is_inside(number))
}

/// Checks numbers that go into a simulation.
pub(crate) fn check_inside<'a>(
    what: &'static str,
    numbers: impl IntoIterator<Item = &'a f64>,
) -> Result<(), SimError> {
    let (least, most) = (-LARGEST_NUMBER, LARGEST_NUMBER);
    let outside = first_outside(numbers);
    outside.map_or(Ok(()), |value| Err(SimError::OutOfRange { what, value, least, most }))
}

/// Checks that a number lies between two others.
pub(crate) fn check_between(
    what: &'static str,
    value: f64,
    [least, most]: [f64; 2],
) -> Result<(), SimError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(SimError::OutOfRange { what, value, least, most })
}

/// Checks the position of an object, in meters.
pub(crate) fn check_object_position(xy: [f64; 2]) -> Result<(), SimError> {
    check_inside("the object's position", &xy)
}

/// The number of physics steps per control step, from 1 to 1,000.
///
/// A physics step takes 0.002 s, so a control step takes at most 2 s, in which every command has
/// long been carried out. The bound keeps the work of a single call small: making a model simulates
/// ten control steps, and other environments may wait for it.
///
/// ```
/// use fetch_sim::Substeps;
///
/// assert_eq!(Substeps::default(), Substeps::new(20)?);
/// assert!(Substeps::new(0).is_err() && Substeps::new(1001).is_err());
/// # Ok::<(), fetch_sim::SimError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Substeps(u32);

impl Substeps {
    /// The reference's number, 20, which gives 25 control steps per second.
    pub const REFERENCE: Self = Self(20);
    /// The largest number.
    pub const MAX: Self = Self(1000);

    /// Creates a number of physics steps.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] if it is 0 or exceeds [`MAX`](Self::MAX).
    pub const fn new(count: u32) -> Result<Self, SimError> {
        if count == 0 || count > Self::MAX.0 {
            let (value, most) = (count as f64, Self::MAX.0 as f64);
            return Err(SimError::OutOfRange { what: "n_substeps", value, least: 1.0, most });
        }
        Ok(Self(count))
    }

    /// Returns the number.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }
}

impl Default for Substeps {
    fn default() -> Self {
        Self::REFERENCE
    }
}

impl TryFrom<u32> for Substeps {
    type Error = SimError;

    fn try_from(count: u32) -> Result<Self, SimError> {
        Self::new(count)
    }
}

impl From<Substeps> for u32 {
    fn from(Substeps(count): Substeps) -> Self {
        count
    }
}
