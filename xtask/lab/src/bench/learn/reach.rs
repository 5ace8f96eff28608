//! How soon Reach is learned, here and by Stable-Baselines3's SAC with hindsight: the seconds of
//! training until two evaluations in a row succeed in all of 100 episodes.

use std::ops::ControlFlow;

use anyhow::ensure;
use baselines::learn::{Target, TrainSettings, Trainer};
use fetch_cli::shared::json::Metric;
use fetch_env::{Task, make};

use super::{LEARNERS, Orders, Peer};
use crate::{bench::interleaved::Contender, shared::python};

const SEED: u64 = 0;
const THREADS: usize = 2;
/// More steps than any run has needed.
const MOST_STEPS: u64 = 10_000;

pub fn measure(peers: bool) -> anyhow::Result<Vec<(String, Metric)>> {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.schedule.evaluation_episodes = 100;
    let mut trainer = Trainer::new(|| Ok(make("FetchReach-v4")?), settings, SEED, THREADS)?;
    let target = Target { success_rate: 1.0, evaluations: 2 };
    trainer.run(MOST_STEPS, Some(target), |_, _| ControlFlow::Continue(()))?;
    ensure!(target.is_reached(trainer.rows()), "Reach is not learned after {MOST_STEPS} steps");
    let counters = trainer.counters();
    let mut figures = vec![
        ("steps".to_owned(), Metric::new(counters.steps as f64, "1")),
        ("seconds".to_owned(), Metric::new(counters.seconds, "s")),
    ];
    if peers {
        let python = python::environment("python-learners", &python::LEARNERS)?;
        let model = tempfile::tempdir()?;
        let path = model.path().join("model.zip").display().to_string();
        let arguments = ["reach".into(), SEED.to_string(), path];
        let peer = Peer::start(&python, LEARNERS, &arguments, "disable")?;
        let timed = Orders::new(&peer, "go".into()).timed()?;
        let times = timed.wall / counters.seconds;
        figures.push(("stable-baselines3/steps".to_owned(), Metric::new(timed.done as f64, "1")));
        figures.push(("stable-baselines3/seconds".to_owned(), Metric::new(timed.wall, "s")));
        figures.push(("times-sooner".to_owned(), Metric::new(times, "1")));
    }
    Ok(figures)
}
