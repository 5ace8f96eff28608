//! The environment checker on every environment.

use fetch_env::{
    EnvId,
    check::{CheckOptions, check_snapshot_env},
};

use super::{Backend, Result, make};

pub(crate) fn the_checker_finds_nothing<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let report = check_snapshot_env(|| make::<B>(id), &CheckOptions::default());
        assert!(report.passed(), "{id}:\n{report}");
    }
    Ok(())
}
