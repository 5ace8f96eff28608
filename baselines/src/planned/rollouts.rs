//! Simulates candidates from the same state on several threads.

use std::{panic, thread};

use fetch_env::{BoxSpace, EnvError, GoalEnv, GoalObservation, SnapshotEnv};
use her_relabel::Scalar;

use super::{error::PlannerError, plan::Plan};
use crate::policy::Policy;

/// A goal-conditioned environment in which a [`Planner`](crate::Planner) simulates: it takes
/// snapshots, and its actions are a box of `f32`.
///
/// Every such environment that can be sent to a thread implements this trait. A function that takes
/// any of them:
///
/// ```
/// use baselines::{PlanEnv, Planner, PlannerError, PlannerSettings, ZeroPolicy};
///
/// /// Returns how near to its goal the best plan comes.
/// fn nearest<E: PlanEnv>(env: &mut E, seed: u64) -> Result<f64, PlannerError> {
///     let start = env.reset(Some(seed))?.observation;
///     let planner = Planner::new(PlannerSettings::default())?;
///     let plan = planner.plan(std::slice::from_mut(env), &start, &mut ZeroPolicy)?;
///     Ok(plan.episode.final_distance)
/// }
/// ```
pub trait PlanEnv:
    GoalEnv<Observation: GoalObservation<Element: Scalar> + Sync, ActionSpace = BoxSpace<f32>>
    + SnapshotEnv<Snapshot: Sync>
    + Send
{
}

impl<E> PlanEnv for E where
    E: GoalEnv<Observation: GoalObservation<Element: Scalar> + Sync, ActionSpace = BoxSpace<f32>>
        + SnapshotEnv<Snapshot: Sync>
        + Send
{
}

/// Environments that simulate candidates from one state, each on its own thread.
pub(super) struct Rollouts<'a, E: PlanEnv> {
    envs: &'a mut [E],
    start: E::Snapshot,
    observation: &'a E::Observation,
    /// The number of candidates that were simulated.
    count: usize,
}

impl<'a, E: PlanEnv> Rollouts<'a, E> {
    /// Prepares to simulate from the state of the first environment, which has this observation.
    pub(super) fn new(
        envs: &'a mut [E],
        observation: &'a E::Observation,
    ) -> Result<Self, PlannerError> {
        let start = envs.first().ok_or(PlannerError::NoEnvironment)?.snapshot();
        Ok(Self { envs, start, observation, count: 0 })
    }

    /// Simulates one candidate.
    pub(super) fn one(
        &mut self,
        policy: &mut (impl Policy<E::Observation> + ?Sized),
    ) -> Result<Plan, PlannerError> {
        let env = self.envs.first_mut().ok_or(PlannerError::NoEnvironment)?;
        self.count += 1;
        Ok(simulate(env, &self.start, self.observation, policy)?)
    }

    /// Simulates candidates, and returns their plans in the same order.
    pub(super) fn all<P: Policy<E::Observation> + Send>(
        &mut self,
        mut candidates: Vec<P>,
    ) -> Result<Vec<Plan>, PlannerError> {
        self.count += candidates.len();
        let share = candidates.len().div_ceil(self.envs.len()).max(1);
        let (start, observation) = (&self.start, self.observation);
        thread::scope(|scope| {
            let parts = self.envs.iter_mut().zip(candidates.chunks_mut(share));
            let threads: Vec<_> = parts
                .map(|(env, part)| {
                    let run = move || -> Result<Vec<_>, EnvError> {
                        part.iter_mut().map(|p| simulate(env, start, observation, p)).collect()
                    };
                    thread::Builder::new()
                        .spawn_scoped(scope, run)
                        .map_err(|error| PlannerError::Thread { reason: error.to_string() })
                })
                .collect();
            let mut plans = Vec::new();
            for thread in threads {
                let part = thread?.join().unwrap_or_else(|payload| panic::resume_unwind(payload));
                plans.extend(part?);
            }
            Ok(plans)
        })
    }

    /// Returns all environments to the state, and the number of candidates that were simulated.
    pub(super) fn end(self) -> Result<usize, PlannerError> {
        for env in self.envs {
            env.restore(&self.start)?;
        }
        Ok(self.count)
    }
}

fn simulate<E: PlanEnv>(
    env: &mut E,
    start: &E::Snapshot,
    observation: &E::Observation,
    policy: &mut (impl Policy<E::Observation> + ?Sized),
) -> Result<Plan, EnvError> {
    env.restore(start)?;
    Plan::record(env, observation, policy)
}
