//! Everything that does not depend on Fetch: environments, their spaces, wrappers and vectors, and
//! their checker.

pub mod check;
pub(crate) mod env;
pub(crate) mod error;
pub(crate) mod np_random;
pub(crate) mod registry;
pub mod spaces;
pub mod vec_env;
pub mod wrappers;
