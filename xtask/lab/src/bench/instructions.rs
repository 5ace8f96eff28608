//! `bench instructions`: counts the instructions of the hot path with valgrind. The count does not
//! depend on the load of the machine, so a change of one percent shows.

use std::{fs, process::Command};

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use serde::Serialize;

use super::{
    Subject, Subjects,
    env::{
        contenders::{BareLoop, Single, bare_resets, resets},
        episodes::{Episodes, STEPS},
        recording::Recording,
    },
    interleaved::Contender,
    report,
};
use fetch_cli::shared::{choice::flag_name, json::Metric};

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    subjects: Subjects,
    /// Run this part in this process, to be counted
    #[arg(long, hide = true, requires_all = ["task", "model"])]
    #[serde(skip)]
    part: Option<Part>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// `mj_step` and MuJoCo's other work in a step
    Physics,
    /// The environment's step
    Single,
    /// `mj_resetData` and `mj_forward`
    ResetBare,
    /// The environment's reset
    Reset,
    /// The environment's step with a model of its own, of the same numbers
    SingleVaried,
    /// The environment's reset with drawn friction, mass and size
    ResetVaried,
    /// Recording a step of a vectorized environment in a replay buffer
    Recording,
}

pub fn run(args: &Args) -> anyhow::Result<Vec<(String, Metric)>> {
    let subjects = args.subjects.all();
    if let Some(part) = args.part {
        let subject = subjects[0];
        let episodes = Episodes::new(match part {
            Part::SingleVaried => subject.varied(true)?,
            Part::ResetVaried => subject.varied(false)?,
            _ => subject.config(),
        })?;
        let mut contender: Box<dyn Contender> = match part {
            Part::Physics => Box::new(BareLoop::with_forward(&episodes)?),
            Part::Single | Part::SingleVaried => Box::new(Single::new(&episodes)?),
            Part::ResetBare => Box::new(bare_resets(&episodes)?),
            Part::Reset | Part::ResetVaried => Box::new(resets(&episodes)?),
            Part::Recording => Box::new(Recording::new(&episodes)?),
        };
        // The first calls resolve MuJoCo's symbols.
        contender.work()?;
        counted(&mut *contender)?;
        return Ok(Vec::new());
    }
    let mut figures = Vec::new();
    for subject in subjects {
        let mut counts = Vec::new();
        for part in Part::value_variants() {
            let name = flag_name(*part);
            let count = count(subject, &name)? / STEPS as f64;
            counts.push((name, count));
        }
        let counted: Vec<_> = counts.iter().map(|(_, count)| *count).collect();
        let [physics, single, reset_bare, reset, single_varied, reset_varied, recording] =
            counted[..]
        else {
            bail!("a count is missing")
        };
        let ratios = [
            ("above-physics", 1.0 - physics / single),
            ("reset-cost-to-bare", reset / reset_bare),
            ("varied-step-to-step", single_varied / single),
            ("varied-reset-to-reset", reset_varied / reset),
            ("recording-to-step", recording / single),
        ];
        counts.extend(ratios.map(|(name, ratio)| (format!("ratio/{name}"), ratio)));
        let measured = counts.into_iter().map(|(name, count)| (name, Metric::new(count, "1")));
        report(&mut figures, &format!("instructions/{subject}"), measured)?;
    }
    Ok(figures)
}

/// Does the work that valgrind counts: an episode, or as many resets as an episode has steps.
#[inline(never)]
fn counted(contender: &mut dyn Contender) -> anyhow::Result<usize> {
    contender.work()
}

fn count(subject: Subject, part: &str) -> anyhow::Result<f64> {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("callgrind.out");
    let output = Command::new("valgrind")
        .args([
            "--tool=callgrind",
            "--collect-atstart=no",
            "--toggle-collect=*instructions*counted*",
        ])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe()?)
        .args(["bench", "instructions", "--part", part])
        .args(subject.flags().split(' '))
        .output()
        .context("valgrind did not start: install it (apt-get install valgrind)")?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "the count of {subject}/{part} failed: {errors}");
    let text = fs::read_to_string(&out).context("valgrind wrote no counts")?;
    let total = text.lines().find_map(|line| line.strip_prefix("totals: "));
    let total: f64 = total.context("valgrind's counts have no total")?.trim().parse()?;
    ensure!(total > 0.0, "valgrind counted nothing: is the program stripped of its symbols?");
    Ok(total)
}
