//! The subject of a measurement: a task on a model.

use std::fmt;

use fetch_env::{FetchConfig, Task};
use goal_reward::RewardKind;
use serde::Serialize;

use crate::shared::choice::{ModelChoice, flag_name, task_name};

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
    pub fn config(self) -> FetchConfig {
        FetchConfig::new(self.task, RewardKind::Sparse).with_model(self.model.source())
    }

    /// Returns the flags that select it, with a space between them.
    pub fn flags(self) -> String {
        format!("--task {} --model {}", flag_of(self.task), flag_name(self.model))
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", flag_of(self.task), flag_name(self.model))
    }
}

fn parse_task(name: &str) -> Result<Task, String> {
    let found = Task::ALL.into_iter().find(|task| flag_of(*task) == name);
    found.ok_or_else(|| format!("the tasks are {}", Task::ALL.map(flag_of).join(", ")))
}

fn flag_of(task: Task) -> String {
    task_name(task).replace('_', "-")
}
