//! Pure reward, success, termination and truncation functions of goal-conditioned tasks.
//!
//! A goal-conditioned task asks for a `desired_goal` and reports the `achieved_goal`; both are
//! slices of `f64` whose elements have a fixed meaning. Everything here is a function of those two
//! slices alone, so hindsight relabeling can compute the reward that the environment *would have
//! given* for another goal, bit for bit.
//!
//! [`DistanceReward`] is the reward of the Fetch tasks. At the threshold it compares as
//! gymnasium-robotics does:
//!
//! | distance `d`, threshold `t` | sparse | dense | success |
//! |---|---|---|---|
//! | `d < t` | `-0.0` | `-d` | yes |
//! | `d == t` | `-0.0` | `-d` | **no** |
//! | `d > t` | `-1.0` | `-d` | no |
//! | NaN | `-1.0` | NaN | no |
//!
//! The zero is negative because the reference negates a boolean converted to a float. The last row
//! is the only deliberate difference: the reference gives `-0.0` for NaN, which means "solved".
//!
//! # Which type do I need?
//! | to | use |
//! |---|---|
//! | compute the reward of the Fetch tasks | [`DistanceReward`] |
//! | compute many rewards at once | [`GoalReward::reward_batch`] with [`GoalPairs`] |
//! | measure a distance as numpy does | [`goal_distance`] |
//! | refuse goals that are not finite | [`GoalReward::try_reward`] |
//! | write your own reward | [`GoalReward`] |
//! | describe the mirror symmetry of a task | [`Symmetry`] |
//! | say how long a task's vectors are | [`Dims`] |
//!
//! # Example
//! ```
//! use goal_reward::{DistanceReward, GoalPairs, GoalReward};
//!
//! let reward = DistanceReward::sparse(); // 0.05 m, as in all Fetch tasks
//! let gripper = [1.34, 0.75, 0.53];
//! assert_eq!(reward.reward(&gripper, &[1.34, 0.75, 0.56]), 0.0);
//! assert_eq!(reward.reward(&gripper, &[1.34, 0.75, 0.63]), -1.0);
//!
//! // A batch: two goals of three elements, row after row.
//! let achieved = [1.34, 0.75, 0.53, 1.34, 0.75, 0.53];
//! let desired = [1.34, 0.75, 0.56, 1.34, 0.75, 0.63];
//! let mut rewards = [0.0; 2];
//! reward.reward_batch(GoalPairs::new(&achieved, &desired, 3)?, &mut rewards)?;
//! assert_eq!(rewards, [0.0, -1.0]);
//!
//! // Checked calls return an error for a bad goal.
//! let error = reward.try_reward(&gripper, &[1.34, f64::NAN, 0.63]).unwrap_err();
//! assert!(error.to_string().contains("desired_goal[1] is NaN"));
//! # Ok::<(), goal_reward::GoalError>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

#[macro_use]
mod debug;

mod dims;
mod distance;
mod distance_reward;
mod error;
mod pairs;
mod reward;
mod symmetry;
mod threshold;

pub use dims::Dims;
pub use distance::goal_distance;
pub use distance_reward::{DistanceReward, ParseRewardKindError, RewardKind};
pub use error::{GoalError, GoalRole};
pub use pairs::{GoalPairs, check_goals};
pub use reward::GoalReward;
pub use symmetry::{Mirror, Mirrored, Symmetry, SymmetryError};
pub use threshold::{DistanceThreshold, ThresholdError};

/// The README's example, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
