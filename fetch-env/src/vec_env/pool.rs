use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst},
        mpsc,
    },
    thread::{self, JoinHandle},
};

use crossbeam_queue::ArrayQueue;
use crossbeam_utils::{
    Backoff,
    sync::{Parker, Unparker},
};

use super::VecEnvError;

/// Work that a thread can do.
pub(super) trait Job: Send {
    fn run(&mut self);
}

/// Threads that jobs are lent to and come back from.
///
/// Jobs are owned boxes, so that a thread has whatever it works on to itself. Each thread has a
/// queue of its own, which keeps a job's memory near one core, and takes from the others' once that
/// is empty. The queues are lock-free and never grow.
pub(super) struct Pool<J> {
    shared: Arc<Shared<J>>,
    parker: Parker,
    workers: Vec<Worker>,
}

struct Worker {
    unparker: Unparker,
    thread: Option<JoinHandle<()>>,
}

struct Shared<J> {
    todo: Vec<ArrayQueue<Box<J>>>,
    done: ArrayQueue<Box<J>>,
    /// How many done jobs the caller waits for.
    wanted: AtomicUsize,
    caller: Unparker,
    stop: AtomicBool,
    /// A thread has died, with the job that it had.
    lost: AtomicBool,
}

/// Where nobody waits.
const NOT_WAITING: usize = usize::MAX;

impl<J: Job + 'static> Pool<J> {
    /// Starts threads for up to `jobs` jobs at a time.
    pub(super) fn new(threads: usize, jobs: usize, pin: bool) -> Result<Self, VecEnvError> {
        let cores = if pin { core_affinity::get_core_ids() } else { Some(Vec::new()) };
        let cores = cores.ok_or(VecEnvError::Pinning)?;
        let parker = Parker::new();
        let shared = Arc::new(Shared {
            todo: (0..threads).map(|_| ArrayQueue::new(jobs)).collect(),
            done: ArrayQueue::new(jobs),
            wanted: AtomicUsize::new(NOT_WAITING),
            caller: parker.unparker().clone(),
            stop: AtomicBool::new(false),
            lost: AtomicBool::new(false),
        });
        let mut pool = Self { shared, parker, workers: Vec::with_capacity(threads) };
        let (report, pinned) = mpsc::channel();
        for index in 0..threads {
            let core = cores.get(index % cores.len().max(1)).copied();
            let (shared, report, parker) =
                (Arc::clone(&pool.shared), report.clone(), Parker::new());
            let unparker = parker.unparker().clone();
            let thread = thread::Builder::new()
                .name(format!("vec-env-{index}"))
                .spawn(move || {
                    let _ = report.send(core.is_none_or(core_affinity::set_for_current));
                    shared.work(index, &parker);
                })
                .map_err(VecEnvError::from_spawn)?;
            pool.workers.push(Worker { unparker, thread: Some(thread) });
        }
        if pinned.iter().take(threads).all(|pinned| pinned) {
            Ok(pool)
        } else {
            Err(VecEnvError::Pinning)
        }
    }

    pub(super) fn threads(&self) -> usize {
        self.workers.len()
    }

    /// Gives a job to a thread; [`wake`](Self::wake) has it begun.
    pub(super) fn lend(&self, thread: usize, job: Box<J>) {
        let queued = self.shared.todo[thread].push(job);
        assert!(queued.is_ok(), "there is room for all jobs");
    }

    pub(super) fn wake(&self) {
        for worker in &self.workers {
            worker.unparker.unpark();
        }
    }

    /// Waits until `count` of the jobs that are lent are done: spins briefly, then sleeps.
    pub(super) fn wait(&self, count: usize) -> Result<(), VecEnvError> {
        let shared = &*self.shared;
        shared.wanted.store(count, SeqCst);
        let backoff = Backoff::new();
        while shared.done.len() < count {
            if shared.lost.load(SeqCst) {
                return Err(VecEnvError::WorkerLost);
            }
            // A job that is done after this look wakes the caller, or lets it not fall asleep.
            if backoff.is_completed() { self.parker.park() } else { backoff.snooze() }
        }
        shared.wanted.store(NOT_WAITING, SeqCst);
        Ok(())
    }

    /// A job that is done.
    pub(super) fn take(&self) -> Option<Box<J>> {
        self.shared.done.pop()
    }
}

impl<J: Job> Shared<J> {
    fn work(&self, index: usize, parker: &Parker) {
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
                    parker.park();
                    backoff.reset();
                }
                None => backoff.snooze(),
            }
        }
    }

    /// The thread's own next job, or else another's.
    fn next(&self, index: usize) -> Option<Box<J>> {
        let (before, from) = self.todo.split_at(index);
        from.iter().chain(before).find_map(ArrayQueue::pop)
    }

    fn finish(&self, job: Box<J>) {
        let queued = self.done.push(job);
        assert!(queued.is_ok(), "there is room for all jobs");
        if self.done.len() >= self.wanted.load(SeqCst) {
            self.caller.unpark();
        }
    }
}

/// Tells the caller when a thread dies, so that it waits for nothing.
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
        self.shared.stop.store(true, SeqCst);
        for worker in &self.workers {
            worker.unparker.unpark();
        }
        for worker in &mut self.workers {
            // A thread that has panicked has said so on standard error.
            let _ = worker.thread.take().map(JoinHandle::join);
        }
    }
}
