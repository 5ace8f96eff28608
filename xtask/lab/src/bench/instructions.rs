//! `bench instructions`: counts the instructions of the hot path with valgrind. The count does not
//! depend on the load of the machine, so that a change of one per cent shows.

use std::{fs, path::PathBuf, process::Command, sync::Arc};

use anyhow::{Context, bail, ensure};
use clap::ValueEnum;
use serde::Serialize;

use super::{
    env::{
        contenders::{BareLoop, BareResets, Resets, Single},
        episodes::{Episodes, STEPS},
    },
    interleaved::Contender,
    subject::{Subject, Subjects},
};
use crate::shared::{
    choice::flag_name,
    json::{Metric, write_results},
};

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    subjects: Subjects,
    /// Also write the figures as JSON
    #[arg(long)]
    #[serde(skip)]
    json: Option<PathBuf>,
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
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let subjects = args.subjects.all();
    if let Some(part) = args.part {
        let episodes = Episodes::new(subjects[0].config()?)?;
        let mut contender = part.contender(&episodes)?;
        // The first calls resolve MuJoCo's symbols.
        contender.work()?;
        counted(&mut *contender)?;
        return Ok(true);
    }
    let mut figures = Vec::new();
    for subject in subjects {
        let mut counts = Vec::new();
        for part in Part::value_variants() {
            let name = flag_name(*part);
            let count = count(subject, &name)? / STEPS as f64;
            counts.push(count);
            figures.push((format!("instructions/{subject}/{name}"), Metric::new(count, "1")));
        }
        let [physics, single, reset_bare, reset] = counts[..] else { bail!("a count is missing") };
        let ratio = |name: &str, value| {
            (format!("instructions/{subject}/ratio/{name}"), Metric::new(value, "1"))
        };
        figures.push(ratio("above-physics", 1.0 - physics / single));
        figures.push(ratio("reset-cost-to-bare", reset / reset_bare));
        let of_subject = figures.len() - counts.len() - 2;
        for (name, figure) in &figures[of_subject..] {
            println!("{name:<54} {figure}");
        }
    }
    write_results(args.json.as_ref(), args, figures)?;
    Ok(true)
}

impl Part {
    fn contender(self, episodes: &Arc<Episodes>) -> anyhow::Result<Box<dyn Contender>> {
        Ok(match self {
            Self::Physics => Box::new(BareLoop::with_forward(episodes)?),
            Self::Single => Box::new(Single::new(episodes)?),
            Self::ResetBare => Box::new(BareResets(BareLoop::new(episodes)?)),
            Self::Reset => Box::new(Resets(Single::new(episodes)?)),
        })
    }
}

/// Does the work that valgrind counts: an episode, or as many resets as an episode has steps.
#[inline(never)]
fn counted(contender: &mut dyn Contender) -> anyhow::Result<usize> {
    contender.work()
}

/// Runs this program under valgrind.
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
        .args(subject.flags())
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
