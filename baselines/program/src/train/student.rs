//! `train --teacher` and `train --pixels`: policies that imitate a teacher, or see pictures.

use std::path::Path;

use baselines::{
    Sight,
    learn::{DistillSettings, TrainSettings},
    runs::{Lessons, MakeEnvs, NewStudent, Ready, RunDescription, Student, Teacher},
};
use fetch_env::{Camera, FreeCamera};

use super::{Args, describe, errors::in_flags, path_of};
use crate::output::usage;
use crate::shared::tasks::Tasks;

/// The flags of a student.
#[derive(Clone, Debug, clap::Args)]
pub struct StudentArgs {
    /// Distill a teacher, which sees the state, instead of learning from rewards: scripted, trained (the
    /// policy that comes with the program) or the file of a policy. The planner of `plan` is none, because
    /// it would have to plan anew from each state to which the student leads
    #[arg(long, value_name = "NAME")]
    #[arg(conflicts_with_all = ["preset", "algorithm", "demos", "start", "updates", "noise"])]
    #[arg(conflicts_with_all = ["grid", "resume", "mpi"])]
    pub teacher: Option<String>,
    /// The policy sees pictures, the robot's own numbers and the goal, and not the object's. Without
    /// --teacher, it learns from a critic that sees the state
    #[arg(long, conflicts_with_all = ["demos", "start", "updates", "noise", "grid", "resume", "mpi"])]
    pub pixels: bool,
    /// Camera of the pictures
    #[arg(long, value_enum, default_value_t = CameraChoice::Near, requires = "pixels")]
    camera: CameraChoice,
    /// Width and height of the pictures
    #[arg(long, value_name = "PIXELS", default_value_t = 64, requires = "pixels")]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=512))]
    size: u32,
    /// Show the goal in the pictures, which a student of a teacher may see
    #[arg(long, requires_all = ["pixels", "teacher"])]
    goal_marker: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum CameraChoice {
    /// The goals and the gripper as large as they can be
    Near,
    /// The reference's
    Reference,
}

/// Returns the settings of a distiller that the flags describe.
pub fn taught_settings(args: &Args) -> anyhow::Result<DistillSettings> {
    let mut settings = DistillSettings::of_task(args.env_id.task, args.student.pixels);
    if let Some(num_envs) = args.envs {
        settings.num_envs = num_envs.get();
    }
    for assignment in &args.set {
        settings = settings
            .with(assignment)
            .map_err(|error| usage(format_args!("--set {assignment}: {error}")))?;
    }
    Ok(settings)
}

/// Begins a run. Without a teacher, the learner has these settings.
pub fn start(
    tasks: &impl Tasks,
    args: &Args,
    settings: &TrainSettings,
    seed: u64,
) -> anyhow::Result<Ready<Student>> {
    let mut description = describe(tasks, args, seed)?;
    let lessons = match &args.student.teacher {
        Some(teacher) => {
            let (env_id, model) = (args.env_id, args.model.of_run());
            let config = description.config.unwrap_or_else(|| env_id.config());
            description = RunDescription::of_student(env_id, model, config, seed);
            description.steps = args.steps.unwrap_or(description.steps);
            description.target = args.target.unwrap_or(description.target);
            let teacher = Teacher::named(teacher, env_id.task);
            let teacher = teacher.map_err(|error| usage(format_args!("--teacher: {error}")))?;
            Lessons::Teacher(teacher, taught_settings(args)?)
        }
        None => Lessons::Rewards(settings.clone()),
    };
    description.sight = args.student.sight(args);
    let new = NewStudent { description, lessons, overwrite: args.overwrite };
    let ready = new.begin(tasks, path_of(args, seed), args.threads.get());
    ready.map_err(|error| in_flags(error.into()))
}

/// Continues the run in a folder, if it has a teacher or sees pictures.
pub fn resume(
    tasks: &impl MakeEnvs,
    args: &Args,
    folder: &Path,
) -> anyhow::Result<Option<Ready<Student>>> {
    let is_student = |run: RunDescription| run.teacher.is_some() || run.sight.is_some();
    if !RunDescription::read(folder).is_ok_and(is_student) {
        return Ok(None);
    }
    let ready = Ready::resume_student(tasks, folder, args.threads.get());
    Ok(Some(ready.map_err(|error| in_flags(error.into()))?))
}

impl StudentArgs {
    /// Whether the run has a teacher, or a policy that sees pictures.
    pub const fn is_asked(&self) -> bool {
        self.teacher.is_some() || self.pixels
    }

    /// Returns what the student sees, if it sees pictures.
    fn sight(&self, args: &Args) -> Option<Sight> {
        let sight = Sight::of_task(args.env_id.task).with_view(|view| {
            let view = view.with_width(self.size).with_height(self.size);
            let view = view.with_goals_shown(self.goal_marker);
            match self.camera {
                CameraChoice::Near => view,
                CameraChoice::Reference => view.with_camera(Camera::Free(FreeCamera::REFERENCE)),
            }
        });
        self.pixels.then_some(sight)
    }
}
