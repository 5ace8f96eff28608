//! The Python module `fetch_env._native`: the crates' environments, buffer and learner with numpy
//! arrays. What Python users see is in the package's Python files.

mod acting;
mod arrays;
mod config;
mod datasets;
mod env;
mod episode_options;
mod error;
mod evaluate;
mod exclusive;
mod her;
mod integer;
mod learn;
mod mirror;
mod model;
mod new_run;
mod pictures;
mod policy;
mod program;
mod reset;
mod results;
mod signals;
mod task;
mod variation;
mod vec_env;
mod warnings;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    use super::{Bound, PyModule, PyResult};

    #[pymodule_export]
    use crate::config::Config;
    #[pymodule_export]
    use crate::datasets::{NamedPolicy, write_dataset};
    #[pymodule_export]
    use crate::env::Env;
    #[pymodule_export]
    use crate::error::{MujocoError, SimulationError};
    #[pymodule_export]
    use crate::evaluate::{evaluate, robustness};
    #[pymodule_export]
    use crate::her::Buffer;
    #[pymodule_export]
    use crate::learn::Trainer;
    #[pymodule_export]
    use crate::model::{has_reference_model, library_path, unpack_reference_model, use_library};
    #[pymodule_export]
    use crate::policy::Policy;
    #[pymodule_export]
    use crate::program::run_program;
    #[pymodule_export]
    use crate::task::Sim;
    #[pymodule_export]
    use crate::vec_env::VecEnv;
    #[pymodule_export]
    use crate::warnings::MujocoWarning;

    /// The version of gymnasium-robotics from which the reference's model comes.
    #[pymodule_export]
    const REFERENCE_VERSION: &str = "1.4.2";

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::warnings::collect();
        crate::exclusive::count_forks(module.py())
    }
}
