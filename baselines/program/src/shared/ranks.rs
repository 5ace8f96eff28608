//! The flags `--mpi` and `--wait-seconds`: runs that several processes share.

use std::env;

use anyhow::ensure;
use baselines::workers::{OneProcess, Workers, agree};
use fetch_sim::MujocoVersion;

/// The flags.
#[derive(Clone, Debug, clap::Args)]
pub struct RankArgs {
    /// Share the work with the other ranks that mpirun or srun has started
    #[arg(long)]
    mpi: bool,
    /// Seconds that a rank waits for another one before the run ends
    #[arg(long, default_value_t = 60.0, requires = "mpi")]
    wait_seconds: f64,
}

/// Makes the processes that share a run: the same ones in every call.
pub type MakeWorkers<'a> = &'a dyn Fn() -> Box<dyn Workers>;

/// Runs a command, shared by all ranks if the flags say so. `facts` must be the same in all of
/// them.
///
/// A rank that fails reports its error and ends all ranks: the first rank at once, the others a
/// second later, so that an error of all ranks is reported once. If a signal stops them, all ranks
/// end together, which is not a failure.
pub fn share_run(
    args: &RankArgs,
    facts: &[(&str, String)],
    run: impl FnOnce(MakeWorkers) -> anyhow::Result<bool>,
) -> anyhow::Result<bool> {
    let started = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].iter().find_map(|name| env::var(name).ok());
    let started = started.and_then(|size| size.parse().ok()).unwrap_or(1);
    if !args.mpi {
        ensure!(
            started <= 1,
            "{started} of these processes were started together: add --mpi, so that they share one \
             run"
        );
        return run(&|| Box::new(OneProcess));
    }
    let versions = [
        ("version of this program", env!("CARGO_PKG_VERSION").to_owned()),
        ("version of MuJoCo", MujocoVersion::of_library()?.to_string()),
    ];
    let facts: Vec<_> = versions.into_iter().chain(facts.iter().cloned()).collect();
    let run = |make_workers: MakeWorkers| {
        agree(&mut *make_workers(), &facts)?;
        run(make_workers)
    };
    with_mpi(args.wait_seconds, run)
}

#[cfg(feature = "mpi")]
#[expect(clippy::exit, reason = "the main thread waits in a call of MPI that nothing interrupts")]
fn with_mpi(
    wait_seconds: f64,
    run: impl FnOnce(MakeWorkers) -> anyhow::Result<bool>,
) -> anyhow::Result<bool> {
    use baselines::workers::MpiWorkers;

    use super::signals::Stopped;
    use crate::output::usage;

    let limit = std::time::Duration::try_from_secs_f64(wait_seconds)
        .map_err(|error| usage(format_args!("--wait-seconds {wait_seconds}: {error}")))?;
    let workers = MpiWorkers::start(limit, |late| {
        tell(late.by, &late.to_string());
        std::process::exit(1);
    })?;
    let rank = workers.rank();
    match run(&|| Box::new(workers.clone())) {
        Err(error) if !error.is::<Stopped>() => {
            // Those of wrong flags are clap's, which begin with the word themselves.
            let error = format!("{error:#}");
            tell(rank, error.trim_start_matches("error: ").trim_end());
            // This ends all ranks.
            drop(workers);
            Ok(false)
        }
        ended => {
            workers.finish();
            if rank > 0 { Ok(true) } else { ended }
        }
    }
}

/// Prints an error: the first rank at once, the others a second later.
#[cfg(feature = "mpi")]
fn tell(rank: usize, error: &str) {
    if rank > 0 {
        std::thread::sleep(std::time::Duration::from_secs(1));
    }
    crate::output::tell(format_args!("error: rank {rank}: {error}"));
}

#[cfg(not(feature = "mpi"))]
fn with_mpi(_: f64, _: impl FnOnce(MakeWorkers) -> anyhow::Result<bool>) -> anyhow::Result<bool> {
    anyhow::bail!(
        "--mpi: this program was built without MPI: build it with `cargo install --path \
         baselines/program --features mpi`, which needs MPI and Clang: apt-get install libopenmpi-dev openmpi-bin \
         libclang-dev"
    )
}
