//! The environments that can be learned.

use fetch_env::BoxSpace;

use crate::collector::CollectEnv;

/// An environment that a [`Trainer`](super::Trainer) learns: its actions are a box from -1 to 1.
pub trait LearnEnv: CollectEnv<ActionSpace = BoxSpace<f32>> {}

impl<E: CollectEnv<ActionSpace = BoxSpace<f32>>> LearnEnv for E {}
