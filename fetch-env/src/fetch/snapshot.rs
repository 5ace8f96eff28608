//! Snapshots of a Fetch environment.

use fetch_sim::{SimConfig, Simulator, Substeps};
use goal_reward::GoalReward;
use serde::{Deserialize, Serialize};

use super::observation::{FetchObservation, Goal, check_goal};
use super::{env::FetchEnv, interface::Interface, task::FetchTask, variation::Varied};
use crate::gym::{env::SnapshotEnv, error::EnvError, np_random::NpRandom};

/// Snapshot of a [`FetchEnv`]: the simulation, the goal, the task's memory and the random numbers.
///
/// `S` is the simulator's own snapshot, and `M` the task's [memory](FetchTask::Memory). Formats that
/// write every bit of a number preserve it exactly; serde_json needs its feature `float_roundtrip`. A
/// snapshot fits every environment whose simulator is made the same way (task, model, number of
/// substeps) and whose goals have the same length, whatever its rewards and ranges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FetchSnapshot<S, M = ()> {
    sim: SimConfig,
    simulator: S,
    random: Option<NpRandom>,
    goal: Option<Goal>,
    #[serde(default)]
    memory: M,
    #[serde(default)]
    varied: Varied,
    #[serde(default)]
    varied_episodes: u64,
    #[serde(default)]
    interface: Interface,
}

impl<S: Simulator, R: GoalReward, T: FetchTask<S>> SnapshotEnv for FetchEnv<S, R, T> {
    type Snapshot = FetchSnapshot<S::Snapshot, T::Memory>;

    fn snapshot(&self) -> Self::Snapshot {
        FetchSnapshot {
            sim: self.config.sim().clone(),
            simulator: self.simulator.snapshot(),
            random: self.random.clone(),
            goal: self.goal.clone(),
            memory: self.memory.clone(),
            varied: self.varied.clone(),
            varied_episodes: self.varied_episodes,
            interface: self.interface.clone(),
        }
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        let foreign = |reason| Err(EnvError::ForeignSnapshot { reason });
        let (theirs, ours) = (&snapshot.sim, self.config.sim());
        if theirs.task() != ours.task() {
            return foreign(format!("it is from {}, this is {}", theirs.task(), ours.task()));
        }
        let (theirs, ours) = (theirs.n_substeps(), ours.n_substeps());
        if theirs != ours {
            let [theirs, ours] = [theirs, ours].map(Substeps::get);
            return foreign(format!("it was taken with {theirs} substeps, this has {ours}"));
        }
        if let Some(goal) = &snapshot.goal {
            let (theirs, ours) = (goal.len(), self.lengths.goal);
            if theirs != ours {
                return foreign(format!("its goal has {theirs} elements, this one's has {ours}"));
            }
            if check_goal(goal).is_err() {
                return foreign(format!("its goal is {goal:?}"));
            }
            if snapshot.random.is_none() {
                return foreign("it has a goal but no random numbers".into());
            }
        }
        let (varied, interface) = (&snapshot.varied, &snapshot.interface);
        let len = FetchObservation::len_of(self.config.task()) + self.lengths.extra;
        let len = snapshot.goal.as_ref().map(|_| len);
        if let Err(reason) =
            varied.check(self.task.factors()).and_then(|()| interface.check(&varied.interface, len))
        {
            return foreign(reason);
        }
        self.simulator.restore(&snapshot.simulator)?;
        self.varied.clone_from(varied);
        // Only the simulator knows what it restored.
        self.varied.physics = self.simulator.physics();
        self.varied_episodes = snapshot.varied_episodes;
        self.interface.clone_from(interface);
        self.random.clone_from(&snapshot.random);
        self.goal.clone_from(&snapshot.goal);
        self.memory.clone_from(&snapshot.memory);
        Ok(())
    }

    fn last_observation(&self) -> Option<FetchObservation> {
        self.observe().ok()
    }
}
