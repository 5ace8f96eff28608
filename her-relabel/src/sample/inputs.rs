//! What networks see of the drawn rows: the goal behind observations, and the normalizers.

use serde::{Deserialize, Serialize};

use crate::normalizer::Normalizer;

/// The goal that [`Sampler::with_joined_goal`](crate::Sampler::with_joined_goal) writes behind each
/// observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JoinedGoal {
    /// The goal to pursue.
    Desired,
    /// The goal to pursue minus the goal achieved in the state of the observation: what is still
    /// missing. It is computed in `f64`, from the buffer's own numbers.
    Relative,
}

/// The normalizers of a draw, which [`Sampler::sample_into`](crate::Sampler::sample_into) borrows.
/// Parts without a normalizer are written as they are stored, and [`Default`] has none at all.
///
/// The numbers are those of [`Normalizer::normalize_into`], bit for bit, but no second pass over
/// the batch is needed. Rewards and success are computed from the stored goals.
///
/// # Example
/// ```
/// use goal_reward::DistanceReward;
/// use her_relabel::{Batch, BufferConfig, ColumnsMut, Dims, EpisodeData, GoalStrategy, HerBuffer};
/// use her_relabel::{JoinedGoal, Normalizer, NormalizerConfig, Normalizers, Sampler, UnitInterval};
///
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f64>::new(config)?;
/// buffer.add_episode(&EpisodeData {
///     observation: &[10.0, 30.0],
///     achieved_goal: &[0.0, 1.0],
///     desired_goal: &[4.0],
///     action: &[1.0_f32],
///     reward: &[-1.0],
///     terminated: false,
///     truncated: true,
///     fields: &[],
/// })?;
/// let mut observation = Normalizer::new(NormalizerConfig::new(1))?;
/// observation.update(&[10.0, 30.0])?;
/// let normalizers = Normalizers { observation: Some(&observation), goal: None };
/// let sampler = Sampler::new(1, GoalStrategy::Future, UnitInterval::ZERO)
///     .with_joined_goal(JoinedGoal::Relative);
/// let (reward, columns) = (DistanceReward::sparse(), ColumnsMut::default());
/// let mut batch = Batch::<f32>::new();
/// sampler.sample_into(&buffer, &reward, 7, &mut batch, normalizers, columns)?;
/// assert_eq!(batch.input(), [-1.0, 4.0]);
/// assert_eq!(batch.next_input(), [1.0, 3.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Normalizers<'a> {
    /// Of observations, before and after the step.
    pub observation: Option<&'a Normalizer>,
    /// Of goals, achieved and desired. With [`JoinedGoal::Relative`], of the relative goals alone:
    /// the columns of achieved and desired goals are as they are stored.
    pub goal: Option<&'a Normalizer>,
}
