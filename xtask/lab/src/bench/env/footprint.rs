//! Construction and memory of many environments.

use std::time::Instant;

use anyhow::Context;
use fetch_env::{FetchConfig, make_vec_with_config, vec_env::VecConfig};
use serde::{Deserialize, Serialize};

use super::episodes::{SEED, random_actions};
use crate::bench::{
    memory::{measure_in_new_process, resident_bytes},
    subject::Subject,
};

/// Steps of every environment, so that it has touched all of its memory.
const STEPS: usize = 10;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Footprint {
    /// Seconds until all environments are made and reset, including the model's compilation.
    pub construction: f64,
    /// Resident bytes of each environment beyond the first.
    pub further_env: f64,
}

impl Footprint {
    /// [Measures](Self::measure) in a new process.
    pub fn of(subject: Subject, envs: u16) -> anyhow::Result<Self> {
        let arguments = ["bench", "env", "--footprint", "--footprint-envs", &envs.to_string()];
        let arguments = arguments.map(str::to_owned);
        let text = measure_in_new_process(&[&arguments[..], &subject.flags()].concat())?;
        serde_json::from_str(&text).with_context(|| format!("no measurement: {text}"))
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
