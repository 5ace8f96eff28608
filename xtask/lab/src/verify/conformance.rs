//! The checks of fetch-env's environment checker.

use fetch_env::{
    EnvId, MujocoEnv,
    check::{CheckOptions, check_snapshot_env},
    make_with_config,
};

use crate::shared::{check::Check, json::Metric};

pub fn check(id: EnvId, _env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let options = CheckOptions::default().with_seed(seed);
    let report = check_snapshot_env(|| make_with_config(id.config()), &options);
    Ok(report
        .checks
        .iter()
        .map(|check| {
            let faults = usize::from(!check.passed);
            let name = format!("conformance/{}", check.name);
            Check::new(name, check.passed, &check.message, Metric::count(faults))
        })
        .collect())
}
