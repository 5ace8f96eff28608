//! Learning.

use std::ffi::CString;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use baselines::{
    learn::CurveRow,
    runs::{
        self, Cycles, FolderError, Length, RunFolder, RunPlan, RunsError, Student, TensorBoard,
    },
};
use pyo3::{
    Borrowed,
    exceptions::{PyRuntimeWarning, PyTypeError},
    prelude::*,
    types::PyBool,
};

use crate::config::Config;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::new_run::{New, Pixels, TeacherOf};
use crate::policy::Policy;
use crate::signals::Signals;
use crate::task::AnyTasks;
use crate::warnings::simulate;

/// A success rate, from 0 to 1.
pub(crate) struct Rate(f64);

impl<'a, 'py> FromPyObject<'a, 'py> for Rate {
    type Error = PyErr;

    fn extract(number: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if number.is_instance_of::<PyBool>() {
            return Err(PyTypeError::new_err("a success rate is a number from 0 to 1"));
        }
        match number.extract() {
            Ok(rate @ 0.0..=1.0) => Ok(Self(rate)),
            Ok(rate) => Err(Error::value(format!(
                "{rate} is no success rate: pass a number from 0 to 1, or None to use all steps"
            ))
            .into()),
            Err(error) => Err(error),
        }
    }
}

/// A run of the learner.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Trainer {
    run: Exclusive<Run>,
    env_id: String,
    num_threads: usize,
}

/// A run and the folder where it is saved, if it is.
struct Run {
    trainer: Student,
    tasks: AnyTasks,
    plan: RunPlan,
    cycles: Cycles,
    folder: Option<RunFolder>,
    board: Option<TensorBoard>,
    /// Whether a cycle has failed: the run cannot go on, and is not saved.
    has_failed: bool,
}

#[pymethods]
impl Trainer {
    /// `settings` is JSON, or the name of a preset. With `resume`, it continues the run in the folder
    /// `out`, if there is one.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the Python function has as many")]
    fn new(
        py: Python<'_>,
        config: &Config,
        settings: &str,
        seed: Integer<u64>,
        steps: Integer<u64>,
        target: Option<Rate>,
        num_threads: Integer<usize>,
        out: Option<PathBuf>,
        resume: bool,
        start: Option<PyRef<'_, Policy>>,
        tensorboard: Option<PathBuf>,
        observation_noise: Option<f64>,
        teacher: Option<TeacherOf<'_>>,
        pixels: Option<Pixels<'_>>,
    ) -> Result<Self> {
        let Integer(seed) = seed;
        let num_threads = match num_threads.0 {
            0 => available_parallelism().map_or(1, NonZero::get),
            number => number,
        };
        // No success rate is 2.
        let ends = (steps.0, target.map_or(2.0, |Rate(rate)| rate));
        let new = match teacher {
            Some(teacher) => New::student(py, config, settings, seed, ends, teacher, pixels)?,
            None => {
                let start = start.map(|policy| policy.state(py, "start")).transpose()?;
                New::trainer(config, settings, seed, ends, start, observation_noise, pixels)?
            }
        };
        let tasks = config.tasks();
        let mut run = simulate(py, || Run::new(tasks, new, num_threads, out, resume))?;
        if let Some(folder) = tensorboard {
            let board = TensorBoard::create(&folder);
            run.board = Some(board.map_err(|error| Error::chain(error).at(&folder))?);
        }
        if let Some(folder) = run.folder.as_ref().filter(|folder| folder.is_shared()) {
            let path = folder.path().display();
            let text = format!(
                "{path} is on a file system without locks: let no other process write there"
            );
            let text = CString::new(text).map_err(Error::value)?;
            PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), &text, 2)?;
        }
        Ok(Self { run: Exclusive::new(run), env_id: config.env_id(), num_threads })
    }

    /// Takes the next cycle. Returns whether the run goes on, and a row of the learning curve as JSON
    /// if there was an evaluation. An exception of a signal handler stops the cycle, which the next
    /// call finishes.
    fn cycle(&self, py: Python<'_>) -> Result<(bool, Option<String>)> {
        let Run { trainer, tasks, cycles, folder, board, has_failed, .. } =
            &mut *self.run.lock(py)?;
        let folder = folder.as_ref();
        let mut watch = Watch { signals: Signals::new(), row: None };
        let next = simulate(py, || {
            let next = cycles.next(&mut **trainer, folder, &mut watch);
            next.map_err(|error| {
                *has_failed = matches!(error, RunsError::Train(_));
                in_python(error, folder.map(RunFolder::path))
            })
        });
        tasks.check().inspect_err(|_| *has_failed = true)?;
        watch.signals.finish()?;
        if let (Some(board), Some(row)) = (board, &watch.row) {
            board.write(row).map_err(Error::chain)?;
        }
        let row = watch.row.map(|row| serde_json::to_string(&row)).transpose()?;
        Ok((next?.is_continue(), row))
    }

    /// Saves a checkpoint in the folder, if there is one and no cycle has failed.
    fn save(&self, py: Python<'_>) -> Result<()> {
        let run = &mut *self.run.lock(py)?;
        let Some(folder) = run.folder.as_ref().filter(|_| !run.has_failed) else { return Ok(()) };
        let path = folder.path();
        simulate(py, || {
            let saved = run.trainer.save(path);
            saved.map(drop).map_err(|error| in_python(error.into(), Some(path)))
        })
    }

    /// Writes the policy and the page into the folder, if there is one and the run has reached its
    /// end.
    fn finish(&self, py: Python<'_>) -> Result<()> {
        let Run { trainer, tasks, plan, folder, .. } = &mut *self.run.lock(py)?;
        let Some(folder) = folder.as_ref().filter(|_| plan.is_over(&**trainer)) else {
            return Ok(());
        };
        let (threads, mut signals) = (self.num_threads, Signals::new());
        let finished = simulate(py, || {
            let finished = plan.finish(tasks, &mut **trainer, folder, threads, || signals.go_on());
            finished.map(drop).map_err(|error| in_python(error, Some(folder.path())))
        });
        tasks.check()?;
        signals.finish()?;
        finished
    }

    /// Leaves the folder to others.
    fn close(&self, py: Python<'_>) -> Result<()> {
        self.run.lock(py)?.folder = None;
        Ok(())
    }

    /// The number of steps so far.
    fn steps(&self, py: Python<'_>) -> Result<u64> {
        Ok(self.run.lock(py)?.trainer.counters().steps)
    }

    /// The rows of the learning curve as JSON.
    fn curve(&self, py: Python<'_>) -> Result<String> {
        Ok(serde_json::to_string(self.run.lock(py)?.trainer.rows())?)
    }

    /// The settings as JSON.
    fn settings(&self, py: Python<'_>) -> Result<String> {
        Ok(self.run.lock(py)?.trainer.settings_json())
    }

    /// The policy that the run has learned.
    fn policy(&self, py: Python<'_>) -> Result<Policy> {
        let policy = self.run.lock(py)?.trainer.any_policy(&self.env_id);
        let policy = policy.map_err(Error::chain)?;
        Ok(policy.into())
    }
}

impl Run {
    fn new(
        tasks: AnyTasks,
        new: New,
        num_threads: usize,
        out: Option<PathBuf>,
        resume: bool,
    ) -> Result<Self> {
        let mut plan = RunPlan::of(new.description());
        let (mut trainer, folder) = match &out {
            None => {
                let trainer = new.learner(&tasks, num_threads);
                (trainer.map_err(|error| in_python(error, None))?, None)
            }
            Some(path) => {
                let ready = new.ready(&tasks, path, num_threads, resume);
                let (trainer, folder) = ready.map_err(|error| in_python(error, Some(path)))?;
                if let length @ Length::Updates(_) = RunPlan::of(folder.description()).length {
                    plan.length = length;
                }
                (trainer, Some(folder))
            }
        };
        let cycles = plan.begin(&mut *trainer, folder.as_ref());
        let cycles = cycles.map_err(|error| in_python(error, out.as_deref()))?;
        Ok(Self { trainer, tasks, plan, cycles, folder, board: None, has_failed: false })
    }
}

/// Looks for signals during a cycle, and keeps its row.
struct Watch {
    signals: Signals,
    row: Option<CurveRow>,
}

impl<L: ?Sized> runs::Watch<L> for Watch {
    fn go_on(&mut self) -> bool {
        self.signals.go_on()
    }

    fn cycle(&mut self, _: &L, row: Option<&CurveRow>) -> ControlFlow<()> {
        self.row = row.cloned();
        ControlFlow::Continue(())
    }
}

/// Returns the error of a run with Python's remedies.
fn in_python(error: RunsError, out: Option<&Path>) -> Error {
    let error = match error {
        RunsError::Folder(FolderError::HasRun { folder, has_checkpoint }) => {
            let resume = if has_checkpoint { "pass resume=True, or " } else { "" };
            Error::value(format_args!(
                "{} has a run: {resume}choose another folder",
                folder.display()
            ))
        }
        RunsError::HasTeacher { .. } => {
            Error::value("the run has a teacher: pass the same teacher")
        }
        RunsError::Train(error) => Error::chain(error),
        RunsError::Checkpoint(error) => Error::chain(error),
        RunsError::Make(error) => error.into(),
        error => Error::chain(error),
    };
    match out {
        Some(out) => error.at(out),
        None => error,
    }
}
