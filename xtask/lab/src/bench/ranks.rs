//! `bench ranks`: measures how long ranks take to average as many numbers as gradients have.

use std::{
    hint::black_box,
    path::PathBuf,
    time::{Duration, Instant},
};

use baselines::workers::{Workers, sum};
use serde::Serialize;

use fetch_cli::output::usage;
use fetch_cli::shared::{
    json::{Metric, write_results},
    ranks::{RankArgs, share_run},
};

#[derive(clap::Args)]
pub struct Args {
    /// Seconds for each length
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
    #[command(flatten)]
    ranks: RankArgs,
}

#[derive(Serialize)]
struct Settings {
    num_ranks: usize,
    seconds: f64,
}

/// The numbers of parameters: one, and those of networks of about 2 and 3 layers of 256 units.
const LENS: [usize; 4] = [1, 10_000, 75_000, 150_000];

pub fn run(args: &Args, json: Option<&PathBuf>) -> anyhow::Result<bool> {
    let facts = [("command", "bench ranks".to_owned()), ("--seconds", args.seconds.to_string())];
    share_run(&args.ranks, &facts, |workers| {
        let workers = &mut *workers();
        let limit = Duration::try_from_secs_f64(args.seconds)
            .map_err(|error| usage(format_args!("--seconds {}: {error}", args.seconds)))?;
        let mut figures = Vec::new();
        for len in LENS {
            let seconds = average(workers, len, limit)?;
            figures.push((format!("ranks/average-{len}"), Metric::new(seconds * 1e6, "us")));
        }
        if workers.rank() == 0 {
            for (name, figure) in &figures {
                say!("{name:<45} {figure}")?;
            }
            let settings = Settings { num_ranks: workers.size(), seconds: args.seconds };
            write_results(json, settings, figures)?;
        }
        Ok(true)
    })
}

/// Returns the median time of averaging `len` numbers.
fn average(workers: &mut dyn Workers, len: usize, limit: Duration) -> anyhow::Result<f64> {
    let mut numbers = vec![1.0; len];
    let mut times = Vec::new();
    let start = Instant::now();
    loop {
        for _ in 0..50 {
            let call = Instant::now();
            workers.average(black_box(&mut numbers));
            times.push(call.elapsed().as_secs_f64());
        }
        // All ranks end at the same time.
        if sum(workers, u64::from(start.elapsed() > limit))? > 0 {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}
