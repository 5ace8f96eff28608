//! Whether a relabeled row ends its task.

use serde::{Deserialize, Serialize};

/// The rule that decides whether the task of a relabeled row has ended, so that a learner must not
/// bootstrap there.
///
/// A task ends because its goal is reached, or for a reason that has nothing to do with the goal,
/// such as the fall of a robot. A new goal changes only the former. A buffer stores that an episode
/// terminated, not why, so the right variant depends on the task:
///
/// | the task ends | choose |
/// |---|---|
/// | never, or for reasons that do not depend on the goal | [`Stored`](Self::Stored) |
/// | at the goal, and for other reasons | [`StoredOrRecomputed`](Self::StoredOrRecomputed) |
/// | at the goal only | [`Recomputed`](Self::Recomputed) |
///
/// The default is `Stored`, as in the paper: no learner bootstraps from a state that ended its
/// task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Termination {
    /// The row terminates as it was stored.
    #[default]
    Stored,
    /// The row terminates where it was stored to terminate, and where the reward function
    /// [ends the task](goal_reward::GoalReward::terminated) for the new goal.
    ///
    /// A row that terminated because it reached its own goal stays terminated, although the task
    /// would go on for the new goal: the learner never bootstraps from a terminal state.
    StoredOrRecomputed,
    /// The row terminates where the reward function
    /// [ends the task](goal_reward::GoalReward::terminated) for the new goal, and nowhere else.
    ///
    /// This is wrong for a task that also ends for other reasons: its learner would bootstrap from
    /// terminal states.
    Recomputed,
}
