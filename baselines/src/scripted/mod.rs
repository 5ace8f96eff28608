//! Controllers written by hand, one for each task, that see only what a learning agent sees.

mod control;
mod pick_and_place;
mod proportional;
mod push;
mod slide;
mod strike;

use fetch_env::{GoalObservation, Space, Task};
use her_relabel::Scalar;

use self::{
    control::{Columns, Command, OPEN, View},
    pick_and_place::Phase,
};
use crate::policy::{Policy, PolicyError};

pub use proportional::ProportionalPolicy;
pub(crate) use strike::Strike;

/// A policy that solves a task by a few rules, with gains found by trial.
///
/// | task | what it does |
/// |---|---|
/// | Reach | moves straight to the goal |
/// | Push | goes behind the object, as seen from the goal, and pushes, more slowly near the goal |
/// | PickAndPlace | comes from above, grasps, carries |
/// | Slide | goes behind the puck, and strikes it at the speed at which friction stops it at the goal |
///
/// It acts on every observation that begins with the task's
/// [columns](fetch_env::observation_fields) and whose goal begins with a position, such as those of
/// your own task that adds columns.
#[derive(Clone, Debug)]
pub struct ScriptedPolicy {
    task: Task,
    columns: Columns,
    /// The state of PickAndPlace; the other tasks need none.
    phase: Phase,
}

impl ScriptedPolicy {
    /// Returns the policy for a task.
    #[must_use]
    pub fn new(task: Task) -> Self {
        Self { task, columns: Columns::of(task), phase: Phase::default() }
    }
}

impl<O: GoalObservation<Element: Scalar>> Policy<O> for ScriptedPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        self.columns.check_spaces(self.task, observation_space, action_space)
    }

    fn reset(&mut self) {
        self.phase = Phase::default();
    }

    fn act(&mut self, observation: &O, action: &mut [f32]) {
        let command = View::new(&self.columns, observation).and_then(|view| match self.task {
            Task::Reach => Some(Command::toward(view.goal - view.gripper, OPEN)),
            Task::Push => Some(push::act(&view, &view.object?)),
            Task::PickAndPlace => Some(self.phase.act(&view, &view.object?)),
            Task::Slide => Some(slide::act(&view, &view.object?)),
        });
        Command::write(command, action);
    }
}
