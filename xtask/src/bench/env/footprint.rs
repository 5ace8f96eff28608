//! Construction and memory of many environments, in a process of their own: what was
//! allocated and freed before would blur them.

use std::{process::Command, time::Instant};

use anyhow::{Context, ensure};
use fetch_env::{FetchConfig, make_vec_with_config, vec_env::VecConfig};
use serde::{Deserialize, Serialize};

use super::super::resident_bytes;
use super::episodes::{SEED, random_actions};
use crate::bench::subject::Subject;

/// Steps of every environment, so that it has touched what it needs.
const STEPS: usize = 10;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Footprint {
    /// Seconds until all environments are made and reset, the model's compilation included.
    pub construction: f64,
    /// Resident bytes of each environment beyond the first.
    pub further_env: f64,
}

impl Footprint {
    /// Runs this command's own program to [measure](Self::measure).
    pub fn of(subject: Subject, envs: u16) -> anyhow::Result<Self> {
        let output = Command::new(std::env::current_exe()?)
            .args(["bench", "env", "--footprint"])
            .args(subject.flags())
            .args(["--footprint-envs", &envs.to_string()])
            .output()?;
        let text = String::from_utf8_lossy(&output.stdout);
        let errors = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "the measurement of memory failed: {errors}");
        serde_json::from_str(&text).with_context(|| format!("no measurement: {text}{errors}"))
    }

    pub fn measure(config: &FetchConfig, envs: u16) -> anyhow::Result<Self> {
        let envs = usize::from(envs);
        let actions = random_actions(envs)?.into_flattened();
        let start = Instant::now();
        let mut first = make_vec_with_config(config, 1, VecConfig::default())?;
        first.reset(Some(SEED))?;
        let first_made = start.elapsed();
        for _ in 0..STEPS {
            first.step(&actions[..4])?;
        }
        let one = resident_bytes()?;
        let start = Instant::now();
        let mut others = make_vec_with_config(config, envs - 1, VecConfig::default())?;
        others.reset(Some(SEED))?;
        let construction = (first_made + start.elapsed()).as_secs_f64();
        for _ in 0..STEPS {
            others.step(&actions[4..])?;
        }
        Ok(Self { construction, further_env: (resident_bytes()? - one) / (envs - 1) as f64 })
    }
}
