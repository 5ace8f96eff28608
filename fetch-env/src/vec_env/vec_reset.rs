use super::VecEnvError;

/// How the environments of a [`VecEnv`](super::VecEnv) are reset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VecReset<'a, O> {
    /// The seed of each environment.
    pub seeds: Seeds<'a>,
    /// Which environments are reset, one element for each; all without a mask.
    pub mask: Option<&'a [bool]>,
    /// What is asked of every reset.
    pub options: O,
}

impl<O: Default> VecReset<'_, O> {
    /// All environments, the first with `seed`, the next with `seed + 1`, and so on.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        Self { seeds: Seeds::From(seed), mask: None, options: O::default() }
    }
}

/// The seeds of the environments of a [`VecEnv`](super::VecEnv).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seeds<'a> {
    /// No seeds: the random numbers go on, as in [`Env::reset_with`](crate::Env::reset_with).
    #[default]
    GoOn,
    /// Environment `i` gets this seed plus `i`.
    From(u64),
    /// One for each environment; without one its random numbers go on.
    Each(&'a [Option<u64>]),
}

impl From<Option<u64>> for Seeds<'_> {
    fn from(seed: Option<u64>) -> Self {
        seed.map_or(Self::GoOn, Self::From)
    }
}

impl Seeds<'_> {
    pub(super) fn of(&self, env_id: usize) -> Option<u64> {
        match self {
            Self::GoOn => None,
            Self::From(first) => Some(first + env_id as u64),
            Self::Each(seeds) => seeds[env_id],
        }
    }
}

impl<O> VecReset<'_, O> {
    pub(super) fn check(&self, num_envs: usize) -> Result<(), VecEnvError> {
        let each = match self.seeds {
            Seeds::Each(seeds) => Some(seeds.len()),
            Seeds::GoOn | Seeds::From(_) => None,
        };
        for (what, len) in [("seeds", each), ("mask", self.mask.map(<[bool]>::len))] {
            if let Some(actual) = len.filter(|&len| len != num_envs) {
                return Err(VecEnvError::Count { what, actual, num_envs });
            }
        }
        if let Seeds::From(first) = self.seeds
            && first.checked_add(num_envs as u64 - 1).is_none()
        {
            return Err(VecEnvError::SeedTooLarge { first, num_envs });
        }
        if self.mask.is_some_and(|mask| !mask.contains(&true)) {
            return Err(VecEnvError::EmptyMask);
        }
        Ok(())
    }
}
