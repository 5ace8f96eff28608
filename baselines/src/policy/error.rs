//! The error of a policy in the wrong environment.

use std::error::Error;

use fetch_env::{Space, Task, spaces::SpaceError};

/// Error returned when a policy does not fit an environment.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum PolicyError {
    /// A [`TrainedPolicy`](crate::TrainedPolicy) was trained for an environment with other lengths.
    #[error(
        "the policy is for {env_id} (lengths of observation, goal and action {expected:?}), not \
         for {actual:?}"
    )]
    Trained {
        /// The environment of the policy.
        env_id: String,
        /// Its lengths of observation, goal and action.
        expected: [usize; 3],
        /// The lengths of the other environment.
        actual: [usize; 3],
    },
    /// The environment does not have the columns that a
    /// [`ScriptedPolicy`](crate::ScriptedPolicy) or a
    /// [`ProportionalPolicy`](crate::ProportionalPolicy) reads, or takes other actions.
    #[error(
        "a controller of {task} needs at least {} columns of observation, at least {} of a goal and \
         {} elements of an action, not {actual:?}: choose that of a task whose columns the \
         observation begins with",
        expected[0], expected[1], expected[2]
    )]
    Scripted {
        /// The task of the policy.
        task: Task,
        /// The lengths of observation, goal and action that it needs.
        expected: [usize; 3],
        /// Those of the environment.
        actual: [usize; 3],
    },
    /// A [`RandomPolicy`](crate::RandomPolicy) draws from a different action space.
    #[error(
        "the random policy draws from {expected:?}, and the environment takes {actual:?}: make \
         the policy from the environment's action_space()"
    )]
    ActionSpace {
        /// The space of the policy.
        expected: Box<Space>,
        /// The space of the environment.
        actual: Box<Space>,
    },
    /// A [`PlannedPolicy`](crate::PlannedPolicy) plays actions of a different length.
    #[error(
        "the plan has an action of {actual} elements, and the environment takes {expected}: play \
         it in the environment for which it was made"
    )]
    Planned {
        /// The number of elements of the environment's actions that are `f32`.
        expected: usize,
        /// The number of elements of the plan's.
        actual: usize,
    },
    /// A `PixelPolicy` sees pictures of another shape.
    #[error(
        "the policy sees pictures of height, width and channels {expected:?}, and the environment \
         shows {actual:?}: wrap it with AddRenderObservation and the policy's own pixel options"
    )]
    Picture {
        /// The shape that the policy sees.
        expected: [usize; 3],
        /// That of the environment's pictures; `None` without any, or with several views.
        actual: Option<[usize; 3]>,
    },
    /// A `PixelPolicy` was trained with another view.
    #[cfg(feature = "render")]
    #[error(
        "the policy was trained with the view {expected:?}, not {actual:?}: show it its own pixel \
         options"
    )]
    View {
        /// The view of the policy.
        expected: Box<fetch_env::PixelOptions>,
        /// The other view.
        actual: Box<fetch_env::PixelOptions>,
    },
    /// The environment does not observe numbers and goals.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// The error of your own policy.
    #[error(transparent)]
    Other(Box<dyn Error + Send + Sync>),
}

debug_as_display!(PolicyError);
