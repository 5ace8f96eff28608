//! Many environments at once, on several threads.
//!
//! A [`VecEnv`] steps `N` environments on `T` threads and returns their results as one [`VecStep`]
//! of contiguous rows. Seeds, autoreset and order are those of Gymnasium's vector environments. The
//! results are those of `N` single environments, bit for bit, on any number of threads.
//!
//! ```
//! use fetch_env::{make_kinematic_vec, vec_env::VecConfig};
//!
//! // `make_vec` does the same on MuJoCo.
//! let config = VecConfig::default().with_num_threads(2);
//! let mut envs = make_kinematic_vec("FetchPush-v4", 16, config)?;
//! envs.reset(Some(42))?; // environment i has the seed 42 + i
//! let actions = vec![0.5; 16 * 4];
//! for _ in 0..50 {
//!     let step = envs.step(&actions)?;
//!     assert_eq!(step.observation().len(), 16 * 25);
//!     assert!(step.errors().next().is_none());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The environments step and reset on threads with stacks of 2 MiB. With one thread they do so on
//! the caller's instead, which avoids the handover.
//!
//! # Asynchronously
//! [`send`](VecEnv::send) starts some environments and [`recv`](VecEnv::recv) waits for the first
//! few that finish, as in EnvPool, so that a learner works while slower environments run. Timing
//! decides which environments finish first, but not what each of them returns.
//!
//! ```
//! # use fetch_env::{make_kinematic_vec, vec_env::VecConfig};
//! # let config = VecConfig::default().with_num_threads(2);
//! # let mut envs = make_kinematic_vec("FetchReach-v4", 16, config)?;
//! envs.send_reset(Some(42))?;
//! for _ in 0..100 {
//!     let ids = envs.recv(4)?.env_index().to_vec();
//!     envs.send(&vec![0.1; 4 * 4], &ids)?;
//! }
//! let last = envs.recv(envs.in_flight())?;
//! assert_eq!(last.len(), 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # After a `fork`
//! A child that a process forks has none of its threads. There each call of a vector that the
//! parent made returns [`VecEnvError::Forked`], and dropping it does not wait, so make a new vector
//! in the child. A single environment continues in both processes, and the child can make others,
//! whatever the threads of its parent were doing.

pub(crate) mod completion;
pub(crate) mod config;
pub(crate) mod env;
pub(crate) mod error;
#[cfg(feature = "her-relabel")]
mod her;
pub(crate) mod pool;
mod slot;
mod snapshot;
mod source;
pub(crate) mod step;

pub use self::{
    completion::Completion,
    config::{AutoresetMode, VecConfig, VecReset},
    env::VecEnv,
    error::VecEnvError,
    step::{VecStep, VecStepOf},
};
pub use crate::gym::env::observation::{ArrayRows, BatchObservation, GoalRows, Rows};
