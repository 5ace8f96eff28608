//! The worker threads, and the queues that carry jobs to them and back.
//!
//! # Why no result is lost or read early
//! - *Owners.* A job is a box that moves: from the caller into a queue `todo`, from there to the
//!   one thread that pops it, into the queue `done`, and back to the caller. The thread that
//!   holds the box owns the job, so no thread reads what another writes.
//! - *Contents.* A pop of an `ArrayQueue` acquires what the push released: the thread sees all that
//!   the caller wrote to the job, and the caller all that the thread wrote.
//! - *The caller's sleep.* The caller stores `wanted` and then reads the length of `done`. A thread
//!   pushes to `done` and then reads its length and `wanted`. All of these accesses, that of the
//!   queue's tail in the push included, are sequentially consistent, so they have one order. Take
//!   the last push for which the caller waits: its thread counts all of them. If the thread reads
//!   `wanted` after the caller's store, it unparks the caller. If it reads before, its push comes
//!   before the caller reads the length, and the caller does not sleep. A `Parker` keeps an unpark
//!   that comes before its park.
//! - *Half a push.* A push moves the tail before it writes the box, so `done` can count a box that
//!   is still on its way. A pop waits for that one.
//! - *A thread's sleep.* A thread parks after it has found all queues empty. The caller unparks
//!   every thread after its pushes, and a park after that returns at once.
//! - *A panic.* [`Job::run`] must not unwind. If it does, the job is lost with its thread; `Alarm`
//!   sets `lost` and wakes the caller, whose calls return [`VecEnvError::WorkerLost`] from then on.
//! - *The end.* A drop sets `stop` and joins the threads. The queues then drop the jobs in them.
//! - *A fork.* The child has the queues as they were at some moment, perhaps with half a push, and
//!   none of the threads. It leaves them alone: calls compare the process id and fail, and a drop
//!   joins no thread. The threads' own references to the queues are never dropped there, so neither
//!   are the queues.

use std::{
    mem, process,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
        mpsc,
    },
    thread::{self, JoinHandle, Thread},
};

use crossbeam_queue::ArrayQueue;
use crossbeam_utils::{
    Backoff,
    sync::{Parker, Unparker},
};

use crate::gym::vec_env::error::VecEnvError;

/// A piece of work for a thread.
pub(super) trait Job: Send {
    /// Does the work, without unwinding.
    fn run(&mut self);
}

/// Where jobs run.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Caller,
    Threads,
}

/// Threads that borrow jobs and return them.
///
/// Jobs are owned boxes, so a thread never shares the job it runs. Each thread has its own queue,
/// which keeps a job's memory near one core, and takes jobs from the other queues once its own is
/// empty. The queues are lock-free and never grow.
pub(super) struct Pool<J> {
    shared: Arc<Shared<J>>,
    parker: Parker,
    workers: Vec<Thread>,
    handles: Vec<JoinHandle<()>>,
    /// The process that has the threads.
    process: u32,
}

struct Shared<J> {
    todo: Vec<ArrayQueue<Box<J>>>,
    done: ArrayQueue<Box<J>>,
    /// The number of finished jobs for which the caller waits.
    wanted: AtomicUsize,
    caller: Unparker,
    stop: AtomicBool,
    /// Whether a thread died, and its job with it.
    lost: AtomicBool,
}

/// Stack of each thread, in bytes: Rust's default, but independent of `RUST_MIN_STACK`. Making an
/// environment on MuJoCo takes less than 96 KiB of it, stepping less than 64 KiB; the rest is for
/// environments of other crates, and costs nothing until it is used.
pub(crate) const STACK_SIZE: usize = 2 << 20;

/// The value of `wanted` while the caller does not wait.
const NOT_WAITING: usize = usize::MAX;

impl<J: Job + 'static> Pool<J> {
    /// Starts threads for up to `jobs` jobs at a time.
    pub(super) fn new(threads: usize, jobs: usize, pin: bool) -> Result<Self, VecEnvError> {
        let cores = if pin { core_affinity::get_core_ids() } else { Some(Vec::new()) };
        let cores = cores.ok_or(VecEnvError::Pinning)?;
        let mut pool = Self::with_queues(threads, jobs);
        let (report, pinned) = mpsc::channel();
        for index in 0..threads {
            let core = cores.get(index % cores.len().max(1)).copied();
            let (shared, report) = (Arc::clone(&pool.shared), report.clone());
            let handle = thread::Builder::new()
                .name(format!("vec-env-{index}"))
                .stack_size(STACK_SIZE)
                .spawn(move || {
                    let _ = report.send(core.is_none_or(core_affinity::set_for_current));
                    shared.work(index);
                })
                .map_err(|error| VecEnvError::Thread { reason: error.to_string() })?;
            pool.workers.push(handle.thread().clone());
            pool.handles.push(handle);
        }
        if pinned.iter().take(threads).all(|pinned| pinned) {
            Ok(pool)
        } else {
            Err(VecEnvError::Pinning)
        }
    }

    /// Creates the queues of a pool whose threads are not started yet.
    fn with_queues(threads: usize, jobs: usize) -> Self {
        let parker = Parker::new();
        let shared = Arc::new(Shared {
            todo: (0..threads).map(|_| ArrayQueue::new(jobs.div_ceil(threads))).collect(),
            done: ArrayQueue::new(jobs),
            wanted: AtomicUsize::new(NOT_WAITING),
            caller: parker.unparker().clone(),
            stop: AtomicBool::new(false),
            lost: AtomicBool::new(false),
        });
        let (workers, handles, process) = (Vec::new(), Vec::new(), process::id());
        Self { shared, parker, workers, handles, process }
    }

    pub(super) fn threads(&self) -> usize {
        self.workers.len()
    }

    /// Checks that this process has the threads, and that none has died.
    pub(super) fn check(&self) -> Result<(), VecEnvError> {
        if self.process != process::id() {
            return Err(VecEnvError::Forked);
        }
        self.check_threads()
    }

    fn check_threads(&self) -> Result<(), VecEnvError> {
        if self.shared.lost.load(SeqCst) { Err(VecEnvError::WorkerLost) } else { Ok(()) }
    }

    /// Queues a job for a thread, which starts it after [`wake`](Self::wake). The jobs must be
    /// spread evenly over the threads.
    pub(super) fn lend(&self, thread: usize, job: Box<J>) {
        let queued = self.shared.todo[thread].push(job);
        assert!(queued.is_ok(), "a queue has room for all jobs of its thread");
    }

    pub(super) fn wake(&self) {
        self.workers.iter().for_each(Thread::unpark);
    }

    /// Waits until `count` of the lent jobs are done: spins briefly, then sleeps. Call
    /// [`check`](Self::check) first, because a forked process would wait forever.
    pub(super) fn wait(&self, count: usize) -> Result<(), VecEnvError> {
        let shared = &*self.shared;
        shared.wanted.store(count, SeqCst);
        let backoff = Backoff::new();
        while shared.done.len() < count {
            self.check_threads()?;
            // A job that finishes after this check wakes the caller or keeps it awake.
            if backoff.is_completed() { self.parker.park() } else { backoff.snooze() }
        }
        shared.wanted.store(NOT_WAITING, SeqCst);
        Ok(())
    }

    /// Returns a finished job.
    pub(super) fn take(&self) -> Option<Box<J>> {
        self.shared.done.pop()
    }
}

impl<J: Job> Shared<J> {
    fn work(&self, index: usize) {
        let _alarm = Alarm(self);
        let backoff = Backoff::new();
        while !self.stop.load(SeqCst) {
            match self.next(index) {
                Some(mut job) => {
                    job.run();
                    self.finish(job);
                    backoff.reset();
                }
                None if backoff.is_completed() => {
                    thread::park();
                    backoff.reset();
                }
                None => backoff.snooze(),
            }
        }
    }

    /// Returns the next job of the thread's own queue, or else of another's.
    fn next(&self, index: usize) -> Option<Box<J>> {
        let (before, from) = self.todo.split_at(index);
        from.iter().chain(before).find_map(ArrayQueue::pop)
    }

    fn finish(&self, job: Box<J>) {
        let queued = self.done.push(job);
        assert!(queued.is_ok(), "a queue has room for all jobs");
        if self.done.len() >= self.wanted.load(SeqCst) {
            self.caller.unpark();
        }
    }
}

/// Tells the caller when a thread dies, so that it does not wait forever.
struct Alarm<'a, J>(&'a Shared<J>);

impl<J> Drop for Alarm<'_, J> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.lost.store(true, SeqCst);
            self.0.caller.unpark();
        }
    }
}

impl<J> Drop for Pool<J> {
    fn drop(&mut self) {
        if self.process != process::id() {
            return mem::take(&mut self.handles).into_iter().for_each(mem::forget);
        }
        self.shared.stop.store(true, SeqCst);
        self.workers.iter().for_each(Thread::unpark);
        for handle in self.handles.drain(..) {
            // A panic has already been reported on standard error.
            let _ = handle.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::*;

    impl<J: Job + 'static> Pool<J> {
        /// Starts threads that count their allocations and return the count when the pool is
        /// dropped.
        pub(in crate::gym::vec_env) fn counting(
            threads: usize,
            jobs: usize,
        ) -> (Self, Vec<JoinHandle<u64>>) {
            let mut pool = Self::with_queues(threads, jobs);
            let start = |index| {
                let shared = Arc::clone(&pool.shared);
                let work = move || shared.work(index);
                let handle = thread::spawn(move || allocation_counter::measure(work).count_total);
                pool.workers.push(handle.thread().clone());
                handle
            };
            let counts = (0..threads).map(start).collect();
            (pool, counts)
        }
    }

    impl<J: Job + 'static> Pool<J> {
        pub(in crate::gym::vec_env) fn lose_a_thread(&self) {
            self.shared.lost.store(true, SeqCst);
        }
    }

    struct Unwinding;

    impl Job for Unwinding {
        fn run(&mut self) {
            panic!("a job that breaks its promise");
        }
    }

    #[test]
    fn a_thread_that_dies_wakes_the_caller() -> Result<(), VecEnvError> {
        let pool = Pool::new(2, 2, false)?;
        pool.lend(0, Box::new(Unwinding));
        pool.wake();
        assert_eq!(pool.wait(1), Err(VecEnvError::WorkerLost));
        assert_eq!(pool.check(), Err(VecEnvError::WorkerLost));
        Ok(())
    }

    struct Allocating;

    impl Job for Allocating {
        fn run(&mut self) {
            drop(black_box(vec![0_u8; 10]));
        }
    }

    #[test]
    fn the_counting_threads_count() -> Result<(), VecEnvError> {
        let (pool, counts) = Pool::counting(1, 3);
        for _ in 0..3 {
            pool.lend(0, Box::new(Allocating));
        }
        pool.wake();
        pool.wait(3)?;
        drop(pool);
        assert_eq!(
            counts.into_iter().map(|count| count.join().ok()).collect::<Vec<_>>(),
            [Some(3)]
        );
        Ok(())
    }
}
