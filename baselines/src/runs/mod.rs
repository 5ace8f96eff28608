//! Runs of training, in folders (feature `runs`).
//!
//! A [`NewRun`] begins in a folder, a [`RunPlan`] says where it ends and is the loop that takes it
//! there, and [`Ready::resume`] continues it after whatever has stopped it, with the same bits. A
//! [`NewStudent`] is a run that distills a teacher, or whose policy sees pictures. A [`Grid`] is
//! every choice of settings with every seed, and a [`Group`] the curves of runs that differ in their
//! seeds alone. The program `fetch-env train` and the Python package write the same folders.
//!
//! ```no_run
//! use std::ops::ControlFlow;
//!
//! use baselines::learn::Preset;
//! use baselines::runs::{BuiltInTasks, NewRun, Ready, RunDescription, RunPlan, RunsError};
//! use baselines::workers::OneProcess;
//! use fetch_env::EnvId;
//!
//! let env_id: EnvId = "FetchReach-v4".parse()?;
//! let description = RunDescription::new(env_id, Preset::Fast, 0);
//! let settings = Preset::Fast.settings(env_id.task);
//! let plan = RunPlan::of(&description);
//! let new = NewRun { description, settings, start: None, overwrite: false };
//! let Ready { mut trainer, folder, .. } =
//!     new.begin(&BuiltInTasks, "reach", 2, Box::new(OneProcess), |_| Ok::<_, RunsError>(()))?;
//! plan.run(&mut trainer, Some(&folder), &mut |_: &_, row: Option<&_>| {
//!     println!("{row:?}");
//!     ControlFlow::Continue(())
//! })?;
//! println!("{}", plan.finish(&BuiltInTasks, &mut trainer, &folder, 2, || true)?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod curve;
mod description;
mod envs;
mod error;
mod finish;
mod folder;
mod grid;
mod grid_folder;
mod grid_runs;
mod group;
mod lock;
#[cfg(feature = "page")]
mod page;
mod plan;
mod start;
mod student;
mod table;
mod tensorboard;

pub use curve::{CurveLine, curve_csv};
pub use description::{RunDescription, RunModel, RunTeacher};
pub use envs::{BuiltInTasks, MakeEnvs, RunEnv};
pub use error::{FolderError, GridError, RunsError, TeacherError};
pub use finish::Outcome;
pub use folder::RunFolder;
pub use grid::{Choice, Grid};
pub use grid_folder::GridFolder;
pub use grid_runs::{GridEvent, GridRun, WatchGrid, run_grid};
pub use group::{Band, Group, Point};
pub use plan::{Cycles, Length, RunPlan, Watch};
pub use start::{NewRun, Ready};
pub use student::{Lessons, NewStudent, Student, Teacher};
pub use table::{GridEnd, GridRow, GridTable};
pub use tensorboard::TensorBoard;
