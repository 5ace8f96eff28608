//! The policies that come with this crate.

use fetch_env::Task;

#[cfg(feature = "pixel-policies")]
use super::pixels::PixelPolicy;
use super::{TrainedPolicy, error::TrainedPolicyError};

impl TrainedPolicy {
    /// Returns the policy that comes with this crate for a task. It was trained from sparse rewards
    /// on the built-in model, and its [header](Self::header) says how, and how often it succeeds.
    ///
    /// ```
    /// use baselines::{TrainedPolicy, evaluate};
    /// use fetch_env::{Task, make_kinematic};
    ///
    /// let mut policy = TrainedPolicy::shipped(Task::Reach)?;
    /// let mut env = make_kinematic("FetchReach-v4")?;
    /// let evaluation = evaluate(&mut env, &mut policy, 10, 0, |_| ())?;
    /// assert_eq!(evaluation.summary()?.success_rate.value, 1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`from_bytes`](Self::from_bytes), which the files of this crate do not cause.
    pub fn shipped(task: Task) -> Result<Self, TrainedPolicyError> {
        let bytes: &[u8] = match task {
            Task::Reach => include_bytes!("../../policies/reach.safetensors"),
            Task::Push => include_bytes!("../../policies/push.safetensors"),
            Task::PickAndPlace => include_bytes!("../../policies/pick_and_place.safetensors"),
            Task::Slide => include_bytes!("../../policies/slide.safetensors"),
        };
        Self::from_bytes(bytes)
    }

    /// Returns the policy that comes with this crate for a task in a world that varies. Push's was
    /// trained with objects of other masses, sizes and frictions, and PickAndPlace's with noise on
    /// observations and actions.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotRobust`] for the other tasks.
    pub fn robust(task: Task) -> Result<Self, TrainedPolicyError> {
        let bytes: &[u8] = match task {
            Task::Push => include_bytes!("../../policies/push_robust.safetensors"),
            Task::PickAndPlace => {
                include_bytes!("../../policies/pick_and_place_robust.safetensors")
            }
            Task::Reach | Task::Slide => return Err(TrainedPolicyError::NotRobust { task }),
        };
        Self::from_bytes(bytes)
    }
}

#[cfg(feature = "pixel-policies")]
impl PixelPolicy {
    /// Returns the policy that comes with this crate for a task, and sees pictures of 64 x 64 pixels,
    /// as [`Sight::of_task`](crate::Sight::of_task) describes. The policy that
    /// [sees the state](TrainedPolicy::shipped) was its teacher.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NoPixels`] for tasks other than Push and PickAndPlace.
    pub fn shipped(task: Task) -> Result<Self, TrainedPolicyError> {
        let bytes: &[u8] = match task {
            Task::Push => include_bytes!("../../policies/push_pixels.safetensors"),
            Task::PickAndPlace => {
                include_bytes!("../../policies/pick_and_place_pixels.safetensors")
            }
            Task::Reach | Task::Slide => return Err(TrainedPolicyError::NoPixels { task }),
        };
        Self::from_bytes(bytes)
    }
}
