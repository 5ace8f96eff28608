//! The identity of a stored transition.

use std::num::NonZeroU64;

/// The number of a stored transition.
///
/// Numbers rise in the order of storing and are never reused, not even after
/// [`HerBuffer::clear`](crate::HerBuffer::clear). Those of an episode are consecutive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TransitionId(NonZeroU64);

impl TransitionId {
    /// Creates an identity from a number that [`get`](Self::get) returned, for learners that keep
    /// plain numbers; `None` for 0. Whether it was ever stored is checked where it is used.
    #[must_use]
    pub const fn new(number: u64) -> Option<Self> {
        match NonZeroU64::new(number) {
            Some(number) => Some(Self(number)),
            None => None,
        }
    }

    /// Returns the number, at least 1.
    #[inline]
    #[must_use]
    pub const fn get(self) -> u64 {
        self.0.get()
    }

    /// Returns the identity of the transition with the internal number `number`, which counts from
    /// 0.
    #[inline(always)]
    pub(crate) fn of(number: u64) -> Self {
        Self(NonZeroU64::MIN.saturating_add(number))
    }

    /// [`of`](Self::of) if `is_some`, without a branch.
    #[inline(always)]
    pub(crate) fn of_if(number: u64, is_some: bool) -> Option<Self> {
        NonZeroU64::new((number + 1) * u64::from(is_some)).map(Self)
    }

    /// Returns the internal number, which counts from 0.
    #[inline(always)]
    pub(crate) fn number(self) -> u64 {
        self.get() - 1
    }
}
