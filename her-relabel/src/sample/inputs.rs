//! The inputs of networks: the goal behind each observation, the normalizers, the mirror.

use goal_reward::Symmetry;
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

/// The normalizers of a draw, of which [`Sampler::sample_into`](crate::Sampler::sample_into) has an
/// example. Parts without a normalizer are written as they are stored, and [`Default`]
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

/// What [`Sampler::sample_into`](crate::Sampler::sample_into) borrows to write rows otherwise than
/// they are stored. [`Default`] has nothing, and [`Normalizers`] alone are [`From`] them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Transforms<'a> {
    /// The normalizers, of mirrored rows as well.
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
