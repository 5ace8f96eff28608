//! The settings of a draw.

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use crate::sample::settings::goals::{GoalMixture, GoalStrategy};
use crate::sample::settings::inputs::JoinedGoal;
use crate::sample::settings::n_step::NStep;
use crate::sample::settings::noise::GoalNoise;
use crate::sample::settings::termination::Termination;
use crate::unit_interval::UnitInterval;

/// Settings of the batches that [`sample`](Self::sample) draws. To change one for a single call,
/// derive a sampler, such as `sampler.with_ratio(UnitInterval::ZERO)`.
///
/// Each row is drawn independently: first a stored transition, uniformly (or by its priority) and
/// with replacement; then, with the probability of the ratio, a new goal by the strategy. A
/// relabeled row gets the new goal and the reward `f(next_achieved_goal, new_goal)`. Everything
/// else is as stored, unless a setting says otherwise.
///
/// The time of a draw is proportional to the size of the batch and does not depend on how much is
/// stored.
///
/// # Example
/// ```
/// use goal_reward::DistanceReward;
/// use her_relabel::{Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer};
/// use her_relabel::{Priorities, PriorityUnit, Sampler, UnitInterval};
/// use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
///
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 })
///     .with_priorities(Priorities::new(PriorityUnit::Transition));
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// buffer.add_episode(&EpisodeData {
///     observation: &[0.0, 1.0, 2.0],
///     achieved_goal: &[0.0, 1.0, 2.0],
///     desired_goal: &[9.0],
///     action: &[1.0, 1.0],
///     reward: &[-1.0, -1.0],
///     terminated: false,
///     truncated: true,
///     fields: &[],
/// })?;
/// // Prioritized replay, with the last achieved goal in every row.
/// let sampler = Sampler::new(32, GoalStrategy::Final, UnitInterval::ONE)
///     .with_priorities(UnitInterval::new(0.4)?);
/// let mut batch = Batch::<f32>::new();
/// let mut random = ChaCha8Rng::seed_from_u64(1);
/// sampler.sample(&buffer, &DistanceReward::sparse(), &mut random, &mut batch)?;
/// assert!(batch.desired_goal().iter().all(|goal| *goal == 2.0));
/// // ... a learner computes its errors from the batch, weighted by batch.importance_weight() ...
/// let errors = [0.5_f32; 32];
/// buffer.set_priorities(batch.transition(), &errors.map(|error| error.abs().powf(0.6)))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampler {
    batch_size: usize,
    goals: GoalMixture,
    ratio: UnitInterval,
    termination: Termination,
    success: bool,
    n_step: Option<NStep>,
    priorities: Option<UnitInterval>,
    parallel: bool,
    joined_goal: Option<JoinedGoal>,
    keep_already_achieved: UnitInterval,
    recomputed_rewards: bool,
    mirrored: UnitInterval,
    goal_noise: Option<GoalNoise>,
}

impl Sampler {
    /// Creates a sampler of batches of `batch_size` rows, at least 1, in which the share `ratio` of
    /// the rows gets a new goal by `strategy`.
    #[must_use]
    pub const fn new(batch_size: usize, strategy: GoalStrategy, ratio: UnitInterval) -> Self {
        Self {
            batch_size,
            goals: GoalMixture::only(strategy),
            ratio,
            termination: Termination::Stored,
            success: false,
            n_step: None,
            priorities: None,
            parallel: false,
            joined_goal: None,
            keep_already_achieved: UnitInterval::ONE,
            recomputed_rewards: false,
            mirrored: UnitInterval::ZERO,
            goal_noise: None,
        }
    }

    settings! {
        /// Sets the number of rows of a batch, at least 1.
        with_batch_size(batch_size: usize);
        /// Sets the strategies of new goals.
        with_goals(goals: GoalMixture);
        /// Sets the average share of rows that get a new goal. As each row is drawn independently,
        /// the share in one batch varies.
        with_ratio(ratio: UnitInterval);
        /// Sets the rule for the termination of relabeled rows. The default is
        /// [`Termination::Stored`], as in the paper: no learner bootstraps from a state that ended
        /// its task.
        with_termination(termination: Termination);
        /// Sets whether [`Batch::success`](crate::Batch::success) is computed. Off by default,
        /// because learning does not need it.
        with_success(success: bool);
        /// Sets the probability of keeping a row whose goal was already achieved before the step.
        /// The default is 1: all rows are kept. In most tasks such rows teach a learner little,
        /// because the next state achieves the goal whatever the action. Dropping them is a bias:
        /// it overrates steps that change something.
        ///
        /// The reward function's [`is_success`](goal_reward::GoalReward::is_success) decides which
        /// rows these are, from the goal achieved before the row's (first) step and the row's
        /// desired goal, new or not. A row that is not kept is drawn again as a whole: transition,
        /// goal and all. A row is drawn at most four times, and the fourth draw is always kept.
        ///
        /// Let `q` be the probability of a row without this setting, `p` the sum of `q` over all
        /// rows with an achieved goal, and `k` this setting. A draw is rejected with the
        /// probability `r = p * (1 - k)`. The probability of a row is then `q * (s + r^3)`, where
        /// `s = 1 + r + r^2`, and that of a row with an achieved goal `q * (k * s + r^3)`.
        ///
        /// The [importance weights](crate::Batch::importance_weight) of prioritized draws still
        /// correct for the priorities alone, as if no row had been drawn again. `is_success` is
        /// called once for each of the first three draws, with all rows that are drawn.
        with_keep_already_achieved(keep_already_achieved: UnitInterval);
        /// Sets whether the reward function computes the rewards of all rows, not only of relabeled
        /// ones: for a reward other than the stored one. The default is false.
        ///
        /// The rule of [termination](Self::with_termination) for relabeled rows then applies to all
        /// rows.
        with_recomputed_rewards(recomputed_rewards: bool);
        /// Sets the average share of rows that are mirrored: 0 by default, and 1/2 to see both
        /// sides equally often. A mirrored row is the row of the mirror image of its transition, by
        /// the [symmetry](crate::Transforms::symmetry) that each draw then needs.
        ///
        /// Observations, goals and actions are mirrored, in `f64` and before they are normalized.
        /// Everything else is as without this setting, bit for bit: which transitions and goals are
        /// drawn, rewards, success, flags and fields.
        with_mirrored(mirrored: UnitInterval);
        /// Sets whether batches are drawn on the threads of the current rayon pool. The batch is
        /// the same, whatever their number, and the reward function is called on the calling
        /// thread.
        ///
        /// Off by default, because only large batches gain; one of 512 rows or fewer is drawn on
        /// one thread. So is every batch in a process that was forked after such a draw, because
        /// the pool's threads do not exist there. If something else started the threads before the
        /// fork, leave this off in the child.
        with_parallel(parallel: bool);

        /// Returns the number of rows of a batch.
        batch_size: usize;
        /// Returns the average share of rows that get a new goal.
        ratio: UnitInterval;
        /// Returns the rule for the termination of relabeled rows.
        termination: Termination;
        /// Returns whether [`Batch::success`](crate::Batch::success) is computed.
        success: bool;
        /// Returns the windows of several steps.
        n_step: Option<NStep>;
        /// Returns the exponent of the importance weights; `None` for uniform draws.
        priorities: Option<UnitInterval>;
        /// Returns whether batches are drawn on several threads.
        parallel: bool;
        /// Returns the goal that is appended to each observation.
        joined_goal: Option<JoinedGoal>;
        /// Returns the probability of keeping a row whose goal was already achieved.
        keep_already_achieved: UnitInterval;
        /// Returns whether the reward function computes the rewards of all rows.
        recomputed_rewards: bool;
        /// Returns the average share of rows that are mirrored.
        mirrored: UnitInterval;
        /// Returns the noise in the goals of relabeled rows.
        goal_noise: Option<GoalNoise>;
    }

    /// Sets windows of several steps. The default is `None`: rows of one step.
    ///
    /// A row's window begins with its transition and ends with the episode at the latest. It has
    /// one goal, for which all its rewards are computed if the row is relabeled; a future goal is
    /// one of the states after the first step. [`Batch::reward`](crate::Batch::reward) is the
    /// discounted sum of the rewards, the next observation and the flags belong to the last step,
    /// and [`Batch::discount`](crate::Batch::discount) is the factor of the next value: 0 where the
    /// task ended. If [termination](Self::with_termination) is recomputed, a window ends with the
    /// first step that terminates.
    #[must_use]
    pub fn with_n_step(mut self, n_step: impl Into<Option<NStep>>) -> Self {
        self.n_step = n_step.into();
        self
    }

    /// Sets the discount per step, so that batches have
    /// [`Batch::discount`](crate::Batch::discount): the factor of the next value in a learner's
    /// target, which is 0 where the task ended. There is none by default, because not every learner
    /// needs it.
    ///
    /// This is the discount of [`with_n_step`](Self::with_n_step): windows keep their number of
    /// steps, and without windows, rows have one step.
    #[must_use]
    pub fn with_discount(mut self, gamma: UnitInterval) -> Self {
        let steps = self.n_step.map_or(NonZeroUsize::MIN, |n_step| n_step.steps());
        self.n_step = Some(NStep::new(steps, gamma));
        self
    }

    /// Sets the goal that is appended to each observation, as the input of a network:
    /// [`Batch::input`](crate::Batch::input) and [`Batch::next_input`](crate::Batch::next_input)
    /// take the place of the observations. The default is `None`.
    #[must_use]
    pub fn with_joined_goal(mut self, joined_goal: impl Into<Option<JoinedGoal>>) -> Self {
        self.joined_goal = joined_goal.into();
        self
    }

    /// Sets noise in the goals of relabeled rows. The default is `None`. The noise does not change
    /// which transitions and goals are drawn, unless rows are [drawn
    /// again](Self::with_keep_already_achieved), which depends on the moved goals.
    /// [`Batch::goal_source`](crate::Batch::goal_source) is the source of the goal before it was
    /// moved.
    #[must_use]
    pub fn with_goal_noise(mut self, noise: impl Into<Option<GoalNoise>>) -> Self {
        self.goal_noise = noise.into();
        self
    }

    /// Sets draws by the buffer's [`Priorities`](crate::Priorities), and the exponent `beta` of the
    /// [importance weights](crate::Batch::importance_weight), which correct for non-uniform draws:
    /// 0 for no correction (all weights are 1), 1 for full correction. The default is `None`:
    /// uniform draws.
    ///
    /// A row drawn with probability `P` from `N` transitions has the weight `(N * P)^-beta`,
    /// divided by the highest weight of the batch. Prioritized replay usually starts with a `beta`
    /// of 0.4 and raises it to 1 toward the end of training. The time of each draw grows with the
    /// logarithm of how much is stored. [`Sampler`] has an example.
    ///
    /// Source: Schaul et al., *Prioritized experience replay*, 2016, section 3.4. There the highest
    /// weight is that of the whole buffer; most libraries take the batch's, as here.
    #[must_use]
    pub fn with_priorities(mut self, beta: impl Into<Option<UnitInterval>>) -> Self {
        self.priorities = beta.into();
        self
    }

    /// Returns the strategies of new goals.
    #[inline]
    pub const fn goals(&self) -> &GoalMixture {
        &self.goals
    }

    /// Returns the discount per step.
    #[must_use]
    pub fn discount(&self) -> Option<UnitInterval> {
        self.n_step.map(|n_step| n_step.gamma())
    }

    /// Returns the maximal number of steps of a row.
    #[inline(always)]
    pub(crate) fn window(&self) -> usize {
        self.n_step.map_or(1, |n_step| n_step.steps().get())
    }
}
