//! The policy of a file, whatever it sees.

use std::path::Path;

use super::error::TrainedPolicyError as Error;
use super::header::{PolicyHeader, SuccessRate};
#[cfg(all(feature = "learn", feature = "render"))]
use super::pixels::PixelPolicy;
use super::{TrainedPolicy, file};

/// A trained policy, whatever it sees.
///
/// ```
/// use baselines::{AnyPolicy, TrainedPolicy};
/// use fetch_env::Task;
///
/// let contents = TrainedPolicy::shipped(Task::Push)?.to_bytes()?;
/// let AnyPolicy::State(policy) = AnyPolicy::from_bytes(&contents)? else { panic!("it sees pictures") };
/// assert_eq!(policy.header().env_id, "FetchPush-v4");
/// # Ok::<(), baselines::TrainedPolicyError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    all(feature = "learn", feature = "render"),
    expect(clippy::large_enum_variant, reason = "there are few, and most are these")
)]
pub enum AnyPolicy {
    /// It sees the state.
    State(TrainedPolicy),
    /// It sees pictures.
    #[cfg(all(feature = "learn", feature = "render"))]
    Pixels(Box<PixelPolicy>),
}

/// Evaluates an expression for either kind of policy.
macro_rules! of_either {
    ($any:expr, $policy:ident => $value:expr) => {
        match $any {
            AnyPolicy::State($policy) => $value,
            #[cfg(all(feature = "learn", feature = "render"))]
            AnyPolicy::Pixels($policy) => $value,
        }
    };
}

impl AnyPolicy {
    /// Loads a policy from a file.
    ///
    /// # Errors
    /// [`TrainedPolicyError`](Error) if the file cannot be read, is damaged, or is not a policy.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        file::load(path.as_ref(), Self::from_bytes)
    }

    /// Creates a policy from the contents of a file.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        match TrainedPolicy::from_bytes(bytes) {
            #[cfg(all(feature = "learn", feature = "render"))]
            Err(Error::Kind { .. }) => Ok(Self::Pixels(Box::new(PixelPolicy::from_bytes(bytes)?))),
            policy => policy.map(Self::State),
        }
    }

    /// Returns the contents of a file with this policy.
    ///
    /// # Errors
    /// As [`TrainedPolicy::to_bytes`].
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        of_either!(self, policy => policy.to_bytes())
    }

    /// Saves the policy to a file, as [`TrainedPolicy::save`] does.
    ///
    /// # Errors
    /// As [`TrainedPolicy::save`].
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        of_either!(self, policy => policy.save(path))
    }

    /// Returns how the policy was trained, and for what.
    #[must_use]
    pub const fn header(&self) -> &PolicyHeader {
        of_either!(self, policy => policy.header())
    }

    /// Sets the success rate that an evaluation has measured.
    #[must_use]
    pub fn with_success(self, success: SuccessRate) -> Self {
        match self {
            Self::State(policy) => Self::State(policy.with_success(success)),
            #[cfg(all(feature = "learn", feature = "render"))]
            Self::Pixels(policy) => Self::Pixels(Box::new(policy.with_success(success))),
        }
    }
}
