//! The subject of a measurement: a task on a model.

use std::fmt;

use fetch_env::{FetchConfig, Task};
use goal_reward::RewardKind;
use serde::Serialize;

use crate::shared::choice::ModelChoice;

/// The flags `--task` and `--model`.
#[derive(Clone, Copy, Debug, clap::Args, Serialize)]
pub struct Subjects {
    /// Measure this task only
    #[arg(long, value_parser = parse_task)]
    task: Option<Task>,
    /// Measure this model only
    #[arg(long, value_enum)]
    model: Option<ModelChoice>,
}

/// A task on a model.
#[derive(Clone, Copy, Debug)]
pub struct Subject {
    pub task: Task,
    pub model: ModelChoice,
}

impl Subjects {
    /// Returns all selected subjects, task by task.
    pub fn all(&self) -> Vec<Subject> {
        let tasks = self.task.map_or_else(|| Task::ALL.to_vec(), |task| vec![task]);
        let both = [ModelChoice::Builtin, ModelChoice::Reference];
        let models = self.model.map_or_else(|| both.to_vec(), |model| vec![model]);
        let of = |task| models.iter().map(move |&model| Subject { task, model });
        tasks.into_iter().flat_map(of).collect()
    }
}

impl Subject {
    pub fn config(self) -> anyhow::Result<FetchConfig> {
        Ok(FetchConfig::new(self.task, RewardKind::Sparse).with_model(self.model.source()))
    }

    /// Returns the flags that select it.
    pub const fn flags(self) -> [&'static str; 4] {
        ["--task", task_name(self.task), "--model", model_name(self.model)]
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", task_name(self.task), model_name(self.model))
    }
}

fn parse_task(name: &str) -> Result<Task, String> {
    let found = Task::ALL.into_iter().find(|task| task_name(*task) == name);
    found.ok_or_else(|| format!("the tasks are {}", Task::ALL.map(task_name).join(", ")))
}

const fn task_name(task: Task) -> &'static str {
    match task {
        Task::Reach => "reach",
        Task::Push => "push",
        Task::PickAndPlace => "pick-and-place",
        Task::Slide => "slide",
    }
}

const fn model_name(model: ModelChoice) -> &'static str {
    match model {
        ModelChoice::Builtin => "builtin",
        ModelChoice::Reference => "reference",
    }
}
