//! The inputs of networks: the goal behind each observation, and the normalizers.

use serde::{Deserialize, Serialize};

use crate::normalizer::Normalizer;

/// The goal that [`Sampler::with_joined_goal`](crate::Sampler::with_joined_goal) writes behind each
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

/// The normalizers of a draw, which [`Sampler::sample_into`](crate::Sampler::sample_into) borrows;
/// it has an example. Parts without a normalizer are written as they are stored, and [`Default`]
/// has none at all.
///
/// The numbers are those of [`Normalizer::normalize_into`], bit for bit, without a second pass over
/// the batch. Rewards and success are computed from the stored goals.
#[derive(Clone, Copy, Debug, Default)]
pub struct Normalizers<'a> {
    /// Of observations, before and after the step.
    pub observation: Option<&'a Normalizer>,
    /// Of goals, achieved and desired. With [`JoinedGoal::Relative`], of the relative goals alone:
    /// the columns of achieved and desired goals are as they are stored.
    pub goal: Option<&'a Normalizer>,
}
