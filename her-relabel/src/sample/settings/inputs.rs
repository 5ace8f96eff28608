//! The inputs of networks: joined goals, normalizers and the symmetry.

use goal_reward::Symmetry;
use serde::{Deserialize, Serialize};

use crate::normalizer::Normalizer;

/// The goal that [`Sampler::with_joined_goal`](crate::Sampler::with_joined_goal) appends to each
/// observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JoinedGoal {
    /// The goal to pursue.
    Desired,
    /// The goal to pursue minus the goal achieved in the state of the observation, computed in
    /// `f64` from the buffer's own numbers.
    Relative,
}

/// The normalizers of a draw; [`Sampler::sample_into`](crate::Sampler::sample_into) has an example.
/// Parts without a normalizer are written as they are stored, and [`Default`] has no normalizers.
///
/// The numbers are those of [`Normalizer::normalize_into`], bit for bit, without a second pass over
/// the batch. Rewards and success are computed from the stored goals.
#[derive(Clone, Copy, Debug, Default)]
pub struct Normalizers<'a> {
    /// The normalizer of observations, before and after the step.
    pub observation: Option<&'a Normalizer>,
    /// The normalizer of goals, achieved and desired. With [`JoinedGoal::Relative`], it normalizes
    /// only the relative goals: the columns of achieved and desired goals are as they are stored.
    pub goal: Option<&'a Normalizer>,
}

/// The changes that [`Sampler::sample_into`](crate::Sampler::sample_into) makes to rows while it
/// writes them. [`Default`] changes nothing, and [`Normalizers`] alone convert with [`From`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Transforms<'a> {
    /// The normalizers, which also apply to mirrored rows.
    pub normalizers: Normalizers<'a>,
    /// The symmetry of the task, by which the sampler
    /// [mirrors rows](crate::Sampler::with_mirrored).
    pub symmetry: Option<&'a Symmetry>,
}

impl<'a> From<Normalizers<'a>> for Transforms<'a> {
    fn from(normalizers: Normalizers<'a>) -> Self {
        Self { normalizers, symmetry: None }
    }
}
