//! The processes that an MPI launcher starts.

use std::env;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ::mpi::Threading;
use ::mpi::environment::Universe;
use ::mpi::request::{Request, Scope, scope};
use ::mpi::topology::{Process, SimpleCommunicator};
use ::mpi::traits::{Communicator, Destination, Source};

use super::watch::Watch;
use super::{Workers, share, share_of};

/// The environment variables in which launchers pass the rank: Open MPI, Slurm and PMIx, and MPICH.
const LAUNCHERS: [&str; 3] = ["OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"];

/// The maximum length of an MPI message, whose length has 31 bits.
const MAX_LEN: usize = 1 << 30;

/// Error returned when MPI cannot be started.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum MpiError {
    /// No launcher started this process.
    #[error(
        "no MPI launcher started this process: start it with `mpirun -n 2` before its name, or \
         with srun; Debian has mpirun in the package openmpi-bin"
    )]
    NoLauncher,
    /// MPI was already started in this process.
    #[error("MPI was already started in this process: clone the first MpiWorkers")]
    Started,
    /// The MPI library does not let threads take turns.
    #[error(
        "this MPI library does not let threads take turns (MPI_THREAD_SERIALIZED): use one that \
         does, such as Open MPI or MPICH"
    )]
    Threads,
    /// The watch over the other processes could not be started.
    #[error("a thread could not be started")]
    Watch(#[from] std::io::Error),
}

debug_as_display!(MpiError);

/// A process has not answered in time.
#[derive(Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{awaited} for {} s: it is slow, stopped or unreachable", limit.as_secs_f64())]
#[non_exhaustive]
pub struct Late {
    /// What has not arrived.
    pub awaited: Awaited,
    /// The process that has waited for it.
    pub by: usize,
    /// How long it has waited.
    pub limit: Duration,
}

debug_as_display!(Late);

/// What a process waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Awaited {
    /// An answer from this process.
    Rank(usize),
    /// All processes, when MPI starts. It does not say which one is late.
    Start,
    /// All processes, when MPI ends. It does not say which one is late.
    End,
}

impl fmt::Display for Awaited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rank(rank) => write!(f, "rank {rank} has not answered"),
            Self::Start => f.write_str("another rank has not started MPI"),
            Self::End => f.write_str("another rank has not ended MPI"),
        }
    }
}

/// The processes that `mpirun`, `mpiexec` or `srun` starts.
///
/// A run that ends normally calls [`finish`](Self::finish). If the last clone is dropped without
/// it, because of an error or a panic, MPI ends all processes, so that none waits forever for one
/// that is gone.
#[derive(Clone)]
pub struct MpiWorkers {
    session: Arc<Session>,
    rank: usize,
    size: usize,
    /// What the other processes sent, in the order of ranks.
    parts: Vec<f32>,
    seconds: f64,
}

struct Session {
    universe: Mutex<Option<Universe>>,
    is_finished: AtomicBool,
    watch: Watch,
}

impl fmt::Debug for MpiWorkers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MpiWorkers").field("rank", &self.rank).field("size", &self.size).finish()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.watch.waits_for(Awaited::End);
        if !self.is_finished.load(Ordering::Acquire) {
            SimpleCommunicator::world().abort(1);
        }
        if let Ok(universe) = self.universe.get_mut() {
            drop(universe.take());
        }
    }
}

impl MpiWorkers {
    /// Starts MPI, which a process can do only once.
    ///
    /// If another process has not answered for `limit`, because it is slow, stopped or unreachable,
    /// `on_late` is called on a separate thread. The waiting call cannot be interrupted: `on_late`
    /// must report the late process and end this one, and the launcher then ends the others. The
    /// limit also applies while MPI starts, in this call, and while it ends.
    ///
    /// # Errors
    /// [`MpiError`].
    pub fn start(
        limit: Duration,
        on_late: impl Fn(Late) + Send + 'static,
    ) -> Result<Self, MpiError> {
        let by = launched_rank().ok_or(MpiError::NoLauncher)?;
        let watch = Watch::start(limit, move |awaited| on_late(Late { awaited, by, limit }))?;
        let started = watch.over(|| {
            watch.waits_for(Awaited::Start);
            ::mpi::initialize_with_threading(Threading::Serialized)
        });
        let (universe, threading) = started.ok_or(MpiError::Started)?;
        if threading < Threading::Serialized {
            return Err(MpiError::Threads);
        }
        let world = SimpleCommunicator::world();
        let [rank, size] = [world.rank(), world.size()].map(|number| number as usize);
        let session = Session {
            universe: Mutex::new(Some(universe)),
            is_finished: AtomicBool::new(false),
            watch,
        };
        let session = Arc::new(session);
        Ok(Self { session, rank, size, parts: Vec::new(), seconds: 0.0 })
    }

    /// Marks the run as ended normally: when the last clone is dropped, MPI shuts down cleanly.
    pub fn finish(self) {
        self.session.is_finished.store(true, Ordering::Release);
    }

    /// Returns the ranks of the other processes.
    fn others(&self) -> impl Iterator<Item = usize> + use<> {
        let rank = self.rank;
        (0..self.size).filter(move |other| *other != rank)
    }
}

impl Workers for MpiWorkers {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    /// Each process takes the mean of a part of the numbers and sends it to the others. It adds in
    /// the order of ranks, so that the sum has the same bits in every MPI library. On two ranks of
    /// one machine this took 0.6 to 0.8 times as long as `MPI_Allreduce` of Open MPI 4.1.
    fn average(&mut self, numbers: &mut [f32]) {
        if self.size == 1 {
            return;
        }
        self.timed(|workers, world| {
            workers.average_own_part(numbers, world);
            workers.share_parts(numbers, world);
        });
    }

    fn exchange(&mut self, mut messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        self.timed(|workers, world| {
            let lens: Vec<_> = messages.iter().map(|message| message.len() as u64).collect();
            let mut received = scope(|scope| {
                let (mut sends, mut bytes) = (Vec::new(), Vec::new());
                for other in workers.others() {
                    let len = &lens[other..=other];
                    let process = workers.wait_for(world, other);
                    sends.push((other, process.immediate_send(scope, len)));
                    for piece in messages[other].chunks(MAX_LEN) {
                        bytes.push((other, process.immediate_send(scope, piece)));
                    }
                }
                let mut received = vec![Vec::new(); workers.size];
                for other in workers.others() {
                    let process = workers.wait_for(world, other);
                    received[other] = vec![0; process.receive::<u64>().0 as usize];
                    for piece in received[other].chunks_mut(MAX_LEN) {
                        process.receive_into(piece);
                    }
                }
                workers.complete(sends);
                workers.complete(bytes);
                received
            });
            received[workers.rank] = std::mem::take(&mut messages[workers.rank]);
            received
        })
    }

    fn seconds(&self) -> f64 {
        self.seconds
    }
}

impl MpiWorkers {
    /// Makes calls under the watch, and adds their time.
    fn timed<T>(&mut self, calls: impl FnOnce(&mut Self, &SimpleCommunicator) -> T) -> T {
        let start = Instant::now();
        let session = Arc::clone(&self.session);
        let result = session.watch.over(|| calls(self, &SimpleCommunicator::world()));
        self.seconds += start.elapsed().as_secs_f64();
        result
    }

    /// Replaces this process's part by the mean over all processes.
    fn average_own_part(&mut self, numbers: &mut [f32], world: &SimpleCommunicator) {
        let mut parts = std::mem::take(&mut self.parts);
        let own = share(self, numbers.len());
        parts.resize((self.size - 1) * own.len(), 0.0);
        let own_len = own.len().max(1);
        scope(|scope| {
            let mut sends = Vec::new();
            for other in self.others() {
                let part = &numbers[share_of(other, self.size, numbers.len())];
                if !part.is_empty() {
                    sends.push((other, self.wait_for(world, other).immediate_send(scope, part)));
                }
            }
            for (other, part) in self.others().zip(parts.chunks_exact_mut(own_len)) {
                self.wait_for(world, other).receive_into(part);
            }
            self.complete(sends);
        });
        let own = &mut numbers[own];
        let (before, after) = parts.split_at_mut(self.rank * own.len());
        if let Some((sum, others)) = before.split_at_mut_checked(own.len()) {
            others.chunks_exact(own_len).for_each(|part| add(sum, part));
            add(own, sum);
        }
        after.chunks_exact(own_len).for_each(|part| add(own, part));
        let share = 1.0 / self.size as f32;
        own.iter_mut().for_each(|number| *number *= share);
        self.parts = parts;
    }

    /// Sends this process's part to the others, and takes theirs.
    fn share_parts(&self, numbers: &mut [f32], world: &SimpleCommunicator) {
        let len = numbers.len();
        let mut parts = Vec::with_capacity(self.size);
        let mut rest = numbers;
        for rank in 0..self.size {
            let (part, after) = rest.split_at_mut(share_of(rank, self.size, len).len());
            parts.push(part);
            rest = after;
        }
        let own = &*std::mem::take(&mut parts[self.rank]);
        scope(|scope| {
            let send = |other| (other, self.wait_for(world, other).immediate_send(scope, own));
            let sends: Vec<_> = self.others().filter(|_| !own.is_empty()).map(send).collect();
            // The own part was taken and is now empty, like the parts that are never sent.
            for (other, part) in parts.into_iter().enumerate().filter(|(_, part)| !part.is_empty())
            {
                self.wait_for(world, other).receive_into(part);
            }
            self.complete(sends);
        });
    }

    /// Returns a process that the call waits for from now on.
    fn wait_for<'a>(&self, world: &'a SimpleCommunicator, rank: usize) -> Process<'a> {
        self.session.watch.waits_for(Awaited::Rank(rank));
        world.process_at_rank(rank as i32)
    }

    /// Waits until other processes have taken what was sent to them.
    fn complete<'a, D: ?Sized, S: Scope<'a>>(&self, sends: Vec<(usize, Request<'a, D, S>)>) {
        for (rank, send) in sends {
            self.session.watch.waits_for(Awaited::Rank(rank));
            send.wait_without_status();
        }
    }
}

fn add(sum: &mut [f32], numbers: &[f32]) {
    sum.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
}

/// Returns the rank of this process, if a launcher started it.
fn launched_rank() -> Option<usize> {
    LAUNCHERS.iter().find_map(|name| env::var(name).ok()?.parse().ok())
}
