//! Boxes of environments, and references to them, are environments too.

use goal_reward::Symmetry;

use super::goal::{GoalEnv, MovingGoal};
use super::{ActionElement, Env, Reset, SnapshotEnv, Step};
use crate::gym::error::EnvError;
use crate::gym::spaces::Space;

macro_rules! forward {
    ($($pointer:ty),*) => {$(
        impl<E: Env + ?Sized> Env for $pointer {
            type Observation = E::Observation;
            type Info = E::Info;
            type ActionSpace = E::ActionSpace;
            type ResetOptions = E::ResetOptions;

            fn reset_with(
                &mut self,
                seed: Option<u64>,
                options: &E::ResetOptions,
            ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
                (**self).reset_with(seed, options)
            }

            fn step(
                &mut self,
                action: &[ActionElement<E>],
            ) -> Result<Step<E::Observation, E::Info>, EnvError> {
                (**self).step(action)
            }

            fn action_space(&self) -> &E::ActionSpace {
                (**self).action_space()
            }

            fn observation_space(&self) -> &Space {
                (**self).observation_space()
            }
        }

        impl<E: GoalEnv + ?Sized> GoalEnv for $pointer {
            type GoalReward = E::GoalReward;

            fn goal_reward(&self) -> &E::GoalReward {
                (**self).goal_reward()
            }

            fn symmetries(&self) -> Vec<Symmetry> {
                (**self).symmetries()
            }
        }

        impl<E: MovingGoal + ?Sized> MovingGoal for $pointer {
            fn set_desired_goal(&mut self, desired_goal: &[f64]) -> Result<(), EnvError> {
                (**self).set_desired_goal(desired_goal)
            }
        }

        impl<E: SnapshotEnv + ?Sized> SnapshotEnv for $pointer {
            type Snapshot = E::Snapshot;

            fn snapshot(&self) -> E::Snapshot {
                (**self).snapshot()
            }

            fn restore(&mut self, snapshot: &E::Snapshot) -> Result<(), EnvError> {
                (**self).restore(snapshot)
            }

            fn last_observation(&self) -> Option<E::Observation> {
                (**self).last_observation()
            }
        }
    )*};
}

forward!(Box<E>, &mut E);
