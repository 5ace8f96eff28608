//! The files of a run.

use std::{
    fmt, fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use baselines::{
    SuccessRate, TrainedPolicy,
    learn::{Counters, CurveRow},
};
use fetch_env::EnvId;
use serde::{Deserialize, Serialize};

use super::{
    Args,
    curve_line::{CurveLine, read_csv, write_csv},
    options::Preset,
};
use crate::shared::{
    choice::{ModelChoice, flag_name},
    json::{write_file, write_json},
};

/// The folder of a run.
pub struct RunFiles {
    pub folder: PathBuf,
    pub run: Run,
}

/// What a resumed run needs to know beside its checkpoint: `run.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    env_id: String,
    pub model: ModelChoice,
    /// Environment steps after which the run ends.
    pub steps: u64,
    /// Success rate at which the run ends.
    pub target: f64,
    pub seed: u64,
    preset: Preset,
    demos: Option<String>,
    /// What differs from the preset, as flags say it.
    changes: Vec<String>,
}

impl Run {
    /// Describes a new run.
    pub fn new(args: &Args, seed: u64) -> Self {
        let (steps, target) = super::limits(args.env_id.task);
        Self {
            env_id: args.env_id.to_string(),
            model: args.model,
            steps: args.steps.unwrap_or(steps),
            target: args.target.unwrap_or(target),
            seed,
            preset: args.preset,
            demos: args.demos.clone(),
            changes: changes(args),
        }
    }

    /// Reads the description of the run that a folder has.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(RUN);
        let text = fs::read_to_string(&path)
            .with_context(|| format!("{} is not the folder of a run", folder.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is damaged", path.display()))
    }

    pub fn env_id(&self) -> anyhow::Result<EnvId> {
        Ok(self.env_id.parse()?)
    }

    /// Names the runs that differ in their seeds alone, such as `FetchPush-v4-fast`.
    pub fn group(&self) -> String {
        // A number of episodes, or the name of their file.
        let demos = self.demos.as_ref().and_then(|demos| Path::new(demos).file_stem());
        let demos = demos.map(|demos| format!("demos={}", demos.display()));
        let parts = [self.env_id.clone(), flag_name(self.preset)].into_iter().chain(demos);
        parts.chain(self.changes.iter().cloned()).collect::<Vec<_>>().join("-")
    }
}

/// Returns the flags of a run that change what the preset says.
fn changes(args: &Args) -> Vec<String> {
    let algorithm = args.algorithm.map(flag_name);
    let num_envs = args.envs.map(|envs| format!("envs={envs}"));
    let model = (args.model != ModelChoice::Builtin).then(|| flag_name(args.model));
    [algorithm, num_envs, model].into_iter().flatten().chain(args.set.iter().cloned()).collect()
}

const RUN: &str = "run.json";
const CURVE: &str = "curve.csv";

impl RunFiles {
    /// Makes the folder of a new run.
    pub fn create(folder: &Path, args: &Args, seed: u64) -> anyhow::Result<Self> {
        let path = folder.join(RUN);
        if args.overwrite && path.exists() {
            fs::remove_dir_all(folder)
                .with_context(|| format!("cannot remove {}", folder.display()))?;
        }
        ensure!(
            !path.exists(),
            "{} has a run: continue it with --resume, replace it with --overwrite, or choose \
             another folder with --out",
            folder.display()
        );
        let run = Run::new(args, seed);
        write_json(&path, &run)?;
        Ok(Self { folder: folder.to_owned(), run })
    }

    /// Opens the folder of a run.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        Ok(Self { folder: folder.to_owned(), run: Run::read(folder)? })
    }

    /// Whether a folder is that of a run.
    pub fn is_run(folder: &Path) -> bool {
        folder.join(RUN).is_file()
    }

    /// Writes the curve so far.
    pub fn write_curve(&self, rows: &[CurveRow]) -> anyhow::Result<()> {
        write_csv(&self.folder.join(CURVE), rows.iter().map(CurveLine::from))
    }

    /// Reads the curve of a run.
    pub fn read_curve(&self) -> anyhow::Result<Vec<CurveLine>> {
        read_csv(&self.folder.join(CURVE))
    }

    pub fn write_policy(&self, policy: &TrainedPolicy) -> anyhow::Result<()> {
        write_file(&self.folder.join("policy.safetensors"), &policy.to_bytes()?)
    }
}

/// The result of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    pub env_id: String,
    pub seed: u64,
    pub counters: Counters,
    /// The success rate at which the run was to end; more than 1 for none.
    pub target: f64,
    /// The counters at the second of the evaluations that reached the target.
    pub reached: Option<Counters>,
    pub success: Option<SuccessRate>,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { env_id, seed, counters, reached, success, .. } = self;
        write!(f, "{env_id}, seed {seed}: ")?;
        match reached {
            Some(Counters { steps, seconds, .. }) => {
                write!(f, "reached the target after {steps} steps, {seconds:.1} s of training")?;
            }
            None => write!(f, "{} steps, {:.1} s of training", counters.steps, counters.seconds)?,
        }
        if let Some(SuccessRate { rate, episodes, .. }) = success {
            write!(f, "; {:.2} of {episodes} episodes on new seeds succeed", rate.value)?;
        }
        Ok(())
    }
}
