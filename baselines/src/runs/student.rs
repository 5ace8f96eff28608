//! Runs of students: they imitate a teacher, or see pictures.

use std::path::Path;

use fetch_env::vec_env::BatchObservation;
use fetch_env::{GoalObservation, Task};
use her_relabel::Scalar;

use super::description::{RunDescription, RunTeacher};
use super::envs::{MakeEnvs, maker};
use super::error::{RunsError, TeacherError};
use super::folder::RunFolder;
use super::start::{Ready, create, policy_name};
use crate::learn::{
    DistillSettings, Distiller, EachEnv, SaveLearner, TrainSettings, Trainer, check_same,
};
use crate::policy::VecPolicy;
use crate::scripted::ScriptedPolicy;
use crate::trained::{AnyPolicy, TrainedPolicy};

/// A [`Distiller`] or a [`Trainer`], whose policy sees the state or pictures.
pub type Student = Box<dyn SaveLearner + Send>;

/// Whom a student imitates.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a run has one")]
pub enum Teacher {
    /// The task's [`ScriptedPolicy`].
    Scripted,
    /// A policy that sees the state.
    Policy(TrainedPolicy),
}

/// What a student learns from.
#[derive(Clone, Debug)]
pub enum Lessons {
    /// A teacher, whom it imitates: a [`Distiller`].
    Teacher(Teacher, DistillSettings),
    /// Rewards alone: a [`Trainer`], which [`NewRun`](super::NewRun) can share between processes if
    /// its policy sees no pictures.
    Rewards(TrainSettings),
}

/// The most environments that a [`DistillSettings`] has.
const MOST_ENVS: usize = 1_024;

impl Teacher {
    /// Returns the teacher of a task with this name: `scripted`, `trained` (the policy that comes with
    /// this crate), or the file of a policy.
    ///
    /// # Errors
    /// [`TeacherError`] if there is no such teacher. The [`Planner`](crate::Planner) is none.
    pub fn named(name: &str, task: Task) -> Result<Self, TeacherError> {
        match name {
            "scripted" => Ok(Self::Scripted),
            "trained" => Ok(Self::Policy(TrainedPolicy::shipped(task)?)),
            "planned" => Err(TeacherError::Planned),
            _ if !name.contains(['.', '/']) && !Path::new(name).exists() => {
                Err(TeacherError::Unknown { name: name.to_owned() })
            }
            file => match AnyPolicy::load(file)? {
                AnyPolicy::State(policy) => Ok(Self::Policy(policy)),
                #[cfg(feature = "render")]
                AnyPolicy::Pixels(_) => Err(TeacherError::Pixels { name: name.to_owned() }),
            },
        }
    }

    fn description(&self) -> RunTeacher {
        match self {
            Self::Scripted => RunTeacher::Scripted,
            Self::Policy(policy) => RunTeacher::Policy(policy_name(policy)),
        }
    }

    /// Returns the policy in any number of environments.
    fn policy<O, I>(&self, task: Task) -> Box<dyn VecPolicy<O, I> + Send>
    where
        O: BatchObservation + GoalObservation<Element: Scalar>,
    {
        match self {
            Self::Scripted => Box::new(EachEnv::new(ScriptedPolicy::new(task), MOST_ENVS)),
            Self::Policy(policy) => Box::new(policy.clone()),
        }
    }
}

/// A run that begins, of a student: what its folder says, and how the student learns.
///
/// ```no_run
/// use std::ops::ControlFlow;
///
/// use baselines::learn::DistillSettings;
/// use baselines::runs::{
///     BuiltInTasks, Lessons, NewStudent, Ready, RunDescription, RunModel, RunPlan, Teacher,
/// };
/// use fetch_env::EnvId;
///
/// let env_id: EnvId = "FetchPush-v4".parse()?;
/// let settings = DistillSettings::of_task(env_id.task, true);
/// let config = env_id.config();
/// let mut description = RunDescription::of_student(env_id, RunModel::Builtin, config, 0);
/// # #[cfg(feature = "render")]
/// # {
/// description.sight = Some(baselines::Sight::of_task(env_id.task));
/// # }
/// let lessons = Lessons::Teacher(Teacher::named("trained", env_id.task)?, settings);
/// let new = NewStudent { description, lessons, overwrite: false };
/// let Ready { mut trainer, folder, .. } = new.begin(&BuiltInTasks, "push", 2)?;
/// let plan = RunPlan::of(folder.description());
/// plan.run(&mut *trainer, Some(&folder), &mut |_: &_, row: Option<&_>| {
///     println!("{row:?}");
///     ControlFlow::Continue(())
/// })?;
/// println!("{}", plan.finish(&BuiltInTasks, &mut *trainer, &folder, 2, || true)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct NewStudent {
    /// The description of the run. Its student sees pictures if it says which.
    pub description: RunDescription,
    /// What the student learns from.
    pub lessons: Lessons,
    /// Whether it replaces the run in its folder.
    pub overwrite: bool,
}

/// What a student begins with.
enum Start<'a> {
    New(&'a Lessons),
    /// The last checkpoint in a folder, and its teacher if it has one.
    Folder(&'a Path, Option<&'a Teacher>),
}

impl NewStudent {
    /// Begins the run in a folder, and saves its teacher and its first checkpoint.
    ///
    /// # Errors
    /// [`RunsError`] if the run cannot be set up, or its folder is not
    /// [free](RunFolder::check_free).
    pub fn begin(
        self,
        tasks: &impl MakeEnvs,
        path: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Ready<Student>, RunsError> {
        let path = path.as_ref();
        let mut trainer = self.student(tasks, num_threads)?;
        RunFolder::check_free(path, self.overwrite)?;
        let task = tasks.task().map(str::to_owned);
        let mut description = RunDescription { task, ..self.description };
        if let Lessons::Teacher(teacher, settings) = &self.lessons {
            description = description.with_teacher(teacher.description(), settings);
        }
        let teacher = match &self.lessons {
            Lessons::Teacher(Teacher::Policy(policy), _) => Some(policy),
            _ => None,
        };
        let folder = create(path, description, self.overwrite, teacher, &mut *trainer)?;
        Ok(Ready { trainer, folder })
    }

    /// Prepares the student of the run, without a folder.
    ///
    /// # Errors
    /// [`RunsError`] if the run cannot be set up.
    pub fn student(&self, tasks: &impl MakeEnvs, num_threads: usize) -> Result<Student, RunsError> {
        student(tasks, &self.description, num_threads, Start::New(&self.lessons))
    }

    /// Continues the run in a folder from its last checkpoint, or begins this one if there is none.
    /// The run in the folder keeps its own steps and target; everything else must be the same.
    ///
    /// # Errors
    /// Those of [`begin`](Self::begin) and [`Ready::resume_student`], and
    /// [`CheckpointError::OtherSettings`](crate::learn::CheckpointError::OtherSettings) if the run in
    /// the folder has another environment, teacher, picture, seed or settings.
    pub fn resume_or_begin(
        self,
        tasks: &impl MakeEnvs,
        path: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Ready<Student>, RunsError> {
        let path = path.as_ref();
        if !RunFolder::has_checkpoint(path)? {
            return self.begin(tasks, path, num_threads);
        }
        let ready = Ready::resume_student(tasks, path, num_threads)?;
        let found = ready.folder.description();
        found.check_environment(&self.description, path)?;
        let own = match &self.lessons {
            Lessons::Teacher(teacher, _) => Some(teacher.description()),
            Lessons::Rewards(_) => None,
        };
        match (&found.teacher, own) {
            (None, Some(_)) => return Err(RunsError::other(path, "no teacher")),
            (Some(_), None) => return Err(RunsError::other(path, "a teacher")),
            (found, own) if *found != own => return Err(RunsError::other(path, "another teacher")),
            _ => {}
        }
        #[cfg(feature = "render")]
        if found.sight != self.description.sight {
            let sees = found.sight.as_ref();
            let sees = sees.map_or("no pictures".to_owned(), ToString::to_string);
            return Err(RunsError::other(path, &format!("a student that sees {sees}")));
        }
        let (trainer, seed) = (&*ready.trainer, self.description.seed);
        match &self.lessons {
            Lessons::Teacher(_, settings) => check_same(trainer, settings, seed, path),
            Lessons::Rewards(settings) => check_same(trainer, settings, seed, path),
        }?;
        Ok(ready)
    }
}

impl Ready<Student> {
    /// Continues the run in a folder from its last checkpoint, whatever its policy sees and whether or
    /// not it has a teacher.
    ///
    /// # Errors
    /// [`RunsError`] if there is no run to resume, another process writes there, or the
    /// checkpoint is damaged or of a student that sees something else, and [`RunsError::OtherTask`] if
    /// `tasks` makes environments of another task.
    pub fn resume_student(
        tasks: &impl MakeEnvs,
        path: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, RunsError> {
        let path = path.as_ref();
        let folder = RunFolder::resume(path)?;
        let description = folder.description();
        description.check_task(tasks, path)?;
        let teacher = match description.teacher {
            Some(RunTeacher::Scripted) => Some(Teacher::Scripted),
            Some(RunTeacher::Policy(_)) => Some(Teacher::Policy(folder.read_teacher()?)),
            None => None,
        };
        let start = Start::Folder(path, teacher.as_ref());
        let trainer = student(tasks, description, num_threads, start)?;
        Ok(Self { trainer, folder })
    }
}

/// Prepares the student of a run.
fn student(
    tasks: &impl MakeEnvs,
    description: &RunDescription,
    threads: usize,
    start: Start<'_>,
) -> Result<Student, RunsError> {
    let (make, seed) = (maker(tasks, description.config()), description.seed);
    let task = description.env_id.task;
    #[cfg(feature = "render")]
    if let Some(sight) = &description.sight {
        let make = super::envs::maker_with_pictures(make, sight.pixels.clone());
        return Ok(match start {
            Start::New(Lessons::Teacher(teacher, settings)) => {
                let (teacher, settings) = (teacher.policy(task), settings.clone());
                Box::new(Distiller::with_pixels(make, teacher, sight, settings, seed, threads)?)
            }
            Start::New(Lessons::Rewards(settings)) => {
                Box::new(Trainer::with_pixels(make, sight, settings.clone(), seed, threads)?)
            }
            Start::Folder(path, Some(teacher)) => {
                let teacher = teacher.policy(task);
                Box::new(Distiller::resume_pixels(make, teacher, sight, path, threads)?)
            }
            Start::Folder(path, None) => {
                Box::new(Trainer::resume_pixels(make, sight, path, threads)?)
            }
        });
    }
    Ok(match start {
        Start::New(Lessons::Teacher(teacher, settings)) => {
            Box::new(Distiller::new(make, teacher.policy(task), settings.clone(), seed, threads)?)
        }
        Start::New(Lessons::Rewards(settings)) => {
            Box::new(Trainer::new(make, settings.clone(), seed, threads)?)
        }
        Start::Folder(path, Some(teacher)) => {
            Box::new(Distiller::resume(make, teacher.policy(task), path, threads)?)
        }
        Start::Folder(path, None) => Box::new(Trainer::resume(make, path, threads)?),
    })
}
