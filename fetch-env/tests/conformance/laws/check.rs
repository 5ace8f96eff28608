//! The environment checker on every environment.

use fetch_env::{
    EnvId,
    check::{CheckOptions, check_goal_env},
};

use super::{Backend, Result, make};

pub(crate) fn the_checker_finds_nothing<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let (make, options) = (|| make::<B>(id), CheckOptions::default());
        let report = check_goal_env(make, &options);
        assert!(report.passed(), "{id}:\n{report}");
    }
    Ok(())
}
