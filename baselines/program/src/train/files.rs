//! The files of a run.

use std::{
    fmt, fs,
    num::NonZeroU64,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use baselines::{
    SuccessRate, TrainedPolicy,
    learn::{Counters, CurveRow, Preset, checkpoints, limits},
};
use fetch_env::EnvId;
use her_relabel::files::read_text;
use serde::{Deserialize, Serialize};

use super::{
    Args,
    curve_line::{CurveLine, csv_text, read_csv},
    lock::{LOCK, RunLock},
};
use crate::shared::{
    choice::{ModelChoice, flag_name},
    json::json_text,
};

/// The folder of a run.
pub struct RunFiles {
    pub folder: PathBuf,
    pub run: Run,
    /// Held where files are written: in the first rank.
    lock: Option<RunLock>,
}

/// What a resumed run needs besides its checkpoint: `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    env_id: String,
    pub model: ModelChoice,
    /// Environment steps after which the run ends.
    pub steps: u64,
    /// Updates after which the run ends, if it learns only from demonstrations.
    pub updates: Option<NonZeroU64>,
    /// Success rate at which the run ends.
    pub target: f64,
    pub seed: u64,
    preset: Preset,
    demos: Option<String>,
    /// The differences from the preset, as flags.
    changes: Vec<String>,
}

impl Run {
    /// Describes a new run.
    pub fn new(args: &Args, seed: u64) -> Self {
        let (steps, target) = limits(args.env_id.task);
        Self {
            env_id: args.env_id.to_string(),
            model: args.model,
            steps: args.steps.unwrap_or(steps),
            updates: args.updates,
            target: args.target.unwrap_or(target),
            seed,
            preset: args.preset,
            demos: args.demos.clone(),
            changes: changes(args),
        }
    }

    /// Reads the description of the run in a folder.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(RUN);
        let text = read_text(&path, LIMIT)
            .with_context(|| format!("{} is not the folder of a run", folder.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is damaged", path.display()))
    }

    pub fn env_id(&self) -> anyhow::Result<EnvId> {
        Ok(self.env_id.parse()?)
    }

    /// Returns the name of the runs that differ only in their seeds, such as `FetchPush-v4-fast`:
    /// the beginning of the names of files.
    pub fn group(&self) -> String {
        // A number of episodes, or the name of their file, in which the dash between parts is
        // escaped.
        let demos = self.demos.as_ref().map(|demos| {
            let stem = Path::new(demos).file_stem().unwrap_or(demos.as_ref());
            format!("demos={}", file_name(&stem.to_string_lossy()).replace('-', "%2D"))
        });
        let changes = self.changes.iter().map(|change| file_name(change));
        let parts = [file_name(&self.env_id), self.preset.to_string()];
        parts.into_iter().chain(demos).chain(changes).collect::<Vec<_>>().join("-")
    }

    /// Whether two runs may have the same name.
    pub fn differs_in_seed_alone(&self, other: &Self) -> bool {
        let same = |run: &Self| Self { seed: 0, steps: 0, target: 0.0, ..run.clone() };
        same(self) == same(other)
    }
}

/// Returns a text as part of a file name: characters with a meaning there become `%` and their
/// code, as in URLs.
pub fn file_name(text: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"=.,_-[]".contains(&byte);
    let escaped = |byte: u8| match is_plain(byte) {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    };
    text.bytes().map(escaped).collect()
}

/// Returns the flags of a run that change what the preset says.
fn changes(args: &Args) -> Vec<String> {
    let algorithm = args.algorithm.map(flag_name);
    let num_envs = args.envs.map(|envs| format!("envs={envs}"));
    let model = (args.model != ModelChoice::Builtin).then(|| flag_name(args.model));
    [algorithm, num_envs, model].into_iter().flatten().chain(args.set.iter().cloned()).collect()
}

/// The largest size of a run's description, in bytes.
const LIMIT: u64 = 1 << 20;

const RUN: &str = "run.json";
const CURVE: &str = "curve.csv";
const POLICY: &str = "policy.safetensors";
const PAGE: &str = "page.html";

/// Returns the files that a run has written in a folder, beside its description and its lock: those
/// that a resumed run writes again, and then the checkpoints, oldest first.
fn written(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let others = [PAGE, POLICY, CURVE].map(|name| folder.join(name));
    let mut paths: Vec<_> = others.into_iter().filter(|path| exists(path)).collect();
    let checkpoints = checkpoints(folder);
    paths.extend(checkpoints.with_context(|| format!("cannot read {}", folder.display()))?);
    Ok(paths)
}

/// Whether a path exists, even as a link to nothing.
fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

impl RunFiles {
    /// Checks that a new run may begin in a folder, and changes nothing there.
    pub fn check_free(folder: &Path, overwrite: bool) -> anyhow::Result<()> {
        let (written, shown) = (written(folder)?, folder.display());
        if exists(&folder.join(RUN)) {
            // The `run.json` of another program stays.
            Run::read(folder)?;
            // A start that was killed leaves only a description.
            if overwrite || written.is_empty() {
                return Ok(());
            }
            let resume =
                if Self::has_checkpoint(folder)? { "continue it with --resume, " } else { "" };
            bail!(
                "{shown} has a run: {resume}replace it with --overwrite, or choose another folder \
                 with --out"
            );
        }
        if let Some(path) = written.first() {
            bail!(
                "{} exists, but there is no {RUN} beside it, so it may not belong to a run: choose another folder with --out",
                path.display()
            );
        }
        let others = || fs::read_dir(folder).into_iter().flatten().flatten();
        ensure!(
            !overwrite || others().all(|entry| entry.file_name() == LOCK),
            "{shown} is not the folder of a run, and --overwrite replaces only runs: leave the \
             flag out, or choose another folder with --out"
        );
        Ok(())
    }

    /// Begins a run in a folder, which is made if there is none, and removes what the run before it
    /// wrote. If this process is killed, the old run can be resumed until its last checkpoint is
    /// removed, and after that a new run can be started.
    pub fn create(folder: &Path, args: &Args, seed: u64) -> anyhow::Result<Self> {
        let lock = RunLock::take(folder)?;
        Self::check_free(folder, args.overwrite)?;
        for path in written(folder)? {
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
        let run = Run::new(args, seed);
        let files = Self { folder: folder.to_owned(), run, lock: Some(lock) };
        files.write(RUN, json_text(&files.run)?.as_bytes())?;
        Ok(files)
    }

    /// Opens the folder of a run to resume it.
    pub fn resume(folder: &Path) -> anyhow::Result<Self> {
        // This leaves no lock in a folder without a run.
        Run::read(folder)?;
        let lock = RunLock::take(folder)?;
        let files = Self { lock: Some(lock), ..Self::open(folder)? };
        ensure!(
            !checkpoints(folder)?.is_empty(),
            "{} has no checkpoint: start the run again, without --resume",
            folder.display()
        );
        Ok(files)
    }

    /// Opens the folder of a run to read it.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        Ok(Self::of_rank(folder, Run::read(folder)?))
    }

    /// Returns the folder of a run whose files another rank writes.
    pub fn of_rank(folder: &Path, run: Run) -> Self {
        Self { folder: folder.to_owned(), run, lock: None }
    }

    /// Whether a folder is the folder of a run.
    pub fn is_run(folder: &Path) -> bool {
        folder.join(RUN).is_file()
    }

    /// Whether the run in a folder has ended and [has no checkpoints](Self::remove_checkpoints):
    /// one with checkpoints can be continued, which ends it again in the same way.
    pub fn is_finished(folder: &Path) -> anyhow::Result<bool> {
        let has = |name| folder.join(name).is_file();
        Ok(has(RUN) && has(POLICY) && has(CURVE) && checkpoints(folder)?.is_empty())
    }

    /// Whether the run in a folder can be resumed.
    pub fn has_checkpoint(folder: &Path) -> anyhow::Result<bool> {
        Ok(Self::is_run(folder) && !checkpoints(folder)?.is_empty())
    }

    /// Removes the checkpoints of a run that will not be resumed.
    pub fn remove_checkpoints(&self) -> anyhow::Result<()> {
        for path in checkpoints(&self.folder)? {
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
        Ok(())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let lock = self.lock.as_ref().context("another process writes the files of the run")?;
        lock.replace(name, bytes)
    }

    /// Writes the curve so far.
    pub fn write_curve(&self, rows: &[CurveRow]) -> anyhow::Result<()> {
        self.write(CURVE, csv_text(rows.iter().map(CurveLine::from))?.as_bytes())
    }

    /// Reads the curve of a run.
    pub fn read_curve(&self) -> anyhow::Result<Vec<CurveLine>> {
        read_csv(&self.folder.join(CURVE))
    }

    pub fn write_policy(&self, policy: &TrainedPolicy) -> anyhow::Result<()> {
        self.write(POLICY, &policy.to_bytes()?)
    }

    pub fn read_policy(&self) -> anyhow::Result<TrainedPolicy> {
        Ok(TrainedPolicy::load(self.folder.join(POLICY))?)
    }

    pub fn write_page(&self, html: &str) -> anyhow::Result<()> {
        self.write(PAGE, html.as_bytes())
    }
}

/// The result of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    pub env_id: String,
    pub seed: u64,
    pub counters: Counters,
    /// The success rate at which the run ends; more than 1 for none.
    pub target: f64,
    /// The counters at the second of the evaluations that reached the target.
    pub reached: Option<Counters>,
    pub success: Option<SuccessRate>,
    /// The mean return of the same episodes as `success`.
    pub episode_return_mean: f64,
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
