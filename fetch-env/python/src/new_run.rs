//! Runs of the learner that begin, and what Python says of them.

use std::path::{Path, absolute};

use baselines::{
    Sight, TrainedPolicy,
    learn::{DistillSettings, Preset, TrainSettings},
    runs::{
        Lessons, NewRun, NewStudent, Ready, RunDescription, RunFolder, RunModel, RunsError,
        Student, Teacher,
    },
    workers::OneProcess,
};
use fetch_env::{Camera, FreeCamera, ModelSource, Task};
use pyo3::{prelude::*, types::PyMapping};

use crate::config::Config;
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::pictures::free_camera;
use crate::policy::Policy;
use crate::task::AnyTasks;

/// A run that begins.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
pub(crate) enum New {
    Trainer(NewRun),
    Student(NewStudent),
}

impl New {
    /// A run that learns from rewards, of a policy that sees the state or pictures.
    pub(crate) fn trainer(
        config: &Config,
        settings: &str,
        seed: u64,
        ends: (u64, f64),
        start: Option<TrainedPolicy>,
        observation_noise: Option<f64>,
        pixels: Option<Pixels<'_>>,
    ) -> Result<Self> {
        let task = config.config.task();
        let mut settings = if settings.starts_with('{') {
            TrainSettings::from_json(settings).map_err(Error::chain)?
        } else {
            let preset = settings.parse::<Preset>().map_err(Error::chain)?;
            let mut settings = preset.settings(task);
            if config.task.as_ref().is_some_and(|task| task.mirror.is_none()) {
                // Nothing says how the task looks in a mirror.
                settings.replay.mirrored = 0.0;
            }
            settings
        };
        if let Some(std) = observation_noise {
            settings.inputs.actor_observation_noise = std;
        }
        if pixels.is_some() && settings.pixels.is_none() {
            settings = settings.with_pixels(task);
        }
        let (model, own) = (model_of(config)?, config.config.clone());
        let mut description = RunDescription::of_settings(config.id, model, own, &settings, seed);
        (description.steps, description.target) = ends;
        if let Some(pixels) = pixels {
            description.sight = Some(pixels.sight(task)?);
            let lessons = Lessons::Rewards(settings);
            return Ok(Self::Student(NewStudent { description, lessons, overwrite: false }));
        }
        let new = NewRun { description, settings, start, overwrite: false };
        Ok(Self::Trainer(new))
    }

    /// A run with a teacher.
    pub(crate) fn student(
        py: Python<'_>,
        config: &Config,
        settings: &str,
        seed: u64,
        ends: (u64, f64),
        teacher: TeacherOf<'_>,
        pixels: Option<Pixels<'_>>,
    ) -> Result<Self> {
        let task = config.config.task();
        let settings = if settings.starts_with('{') {
            serde_json::from_str(settings)?
        } else if settings == Preset::Fast.name() {
            let settings = DistillSettings::of_task(task, pixels.is_some());
            // How low an object of another task may be is not known.
            let fallen_below = settings.fallen_below.filter(|_| config.task.is_none());
            DistillSettings { fallen_below, ..settings }
        } else {
            return Err(Error::value(format!(
                "the preset {settings} is of a learner without a teacher: leave it out, or pass settings"
            )));
        };
        let teacher = match teacher {
            TeacherOf::Policy(policy) => Teacher::Policy(policy.state(py, "teacher")?),
            TeacherOf::Name(name) => Teacher::named(&name, task).map_err(Error::chain)?,
        };
        let (model, own) = (model_of(config)?, config.config.clone());
        let mut description = RunDescription::of_student(config.id, model, own, seed);
        (description.steps, description.target) = ends;
        description.sight = pixels.map(|pixels| pixels.sight(task)).transpose()?;
        let lessons = Lessons::Teacher(teacher, settings);
        Ok(Self::Student(NewStudent { description, lessons, overwrite: false }))
    }

    pub(crate) fn description(&self) -> &RunDescription {
        match self {
            Self::Trainer(new) => &new.description,
            Self::Student(new) => &new.description,
        }
    }

    /// Prepares the run without a folder.
    pub(crate) fn learner(
        &self,
        tasks: &AnyTasks,
        num_threads: usize,
    ) -> std::result::Result<Student, RunsError> {
        match self {
            Self::Trainer(new) => {
                Ok(Box::new(new.trainer(tasks, num_threads, Box::new(OneProcess))?))
            }
            Self::Student(new) => new.student(tasks, num_threads),
        }
    }

    /// Begins the run in a folder, or continues it.
    pub(crate) fn ready(
        self,
        tasks: &AnyTasks,
        path: &Path,
        num_threads: usize,
        resume: bool,
    ) -> std::result::Result<(Student, RunFolder), RunsError> {
        match self {
            Self::Trainer(new) => {
                let ready = match resume {
                    true => new.resume_or_begin(tasks, path, num_threads),
                    false => new.begin(tasks, path, num_threads, Box::new(OneProcess), |_| Ok(())),
                };
                let Ready { trainer, folder, .. } = ready?;
                Ok((Box::new(trainer), folder))
            }
            Self::Student(new) => {
                let ready = match resume {
                    true => new.resume_or_begin(tasks, path, num_threads),
                    false => new.begin(tasks, path, num_threads),
                };
                let Ready { trainer, folder, .. } = ready?;
                Ok((trainer, folder))
            }
        }
    }
}

/// A teacher in Python.
#[derive(FromPyObject)]
pub(crate) enum TeacherOf<'py> {
    Policy(PyRef<'py, Policy>),
    Name(String),
}

/// What a student sees, in Python: `camera`, `size` and `marker`.
#[derive(FromPyObject)]
pub(crate) struct Pixels<'py>(Bound<'py, PyAny>, Integer<u32>, bool);

impl Pixels<'_> {
    fn sight(self, task: Task) -> Result<Sight> {
        let Self(camera, Integer(size), marker) = self;
        let camera = if let Ok(numbers) = camera.cast::<PyMapping>() {
            Some(free_camera(numbers)?)
        } else {
            match camera.extract::<String>().ok().as_deref() {
                Some("near") => None,
                Some("reference") => Some(FreeCamera::REFERENCE),
                _ => {
                    return Err(Error::value(format!(
                        "camera is {}: pass \"near\", \"reference\", or a dictionary with distance, \
                         azimuth, elevation and lookat",
                        Error::shown(&camera)
                    )));
                }
            }
        };
        if !(16..=512).contains(&size) {
            return Err(Error::value(format!("size is {size}: pass a number from 16 to 512")));
        }
        Ok(Sight::of_task(task).with_view(|view| {
            let view = view.with_width(size).with_height(size).with_goals_shown(marker);
            match camera {
                Some(camera) => view.with_camera(Camera::Free(camera)),
                None => view,
            }
        }))
    }
}

/// Returns the model as the folder of a run describes it.
fn model_of(config: &Config) -> Result<RunModel> {
    Ok(match config.config.sim().model() {
        ModelSource::Reference => RunModel::Reference,
        // The run may be resumed from another current folder.
        ModelSource::Folder(folder) => RunModel::Folder(absolute(folder).map_err(Error::chain)?),
        _ => RunModel::Builtin,
    })
}
