//! Fetch environments on MuJoCo, whatever their task.

use fetch_env::{
    BoxSpace, FetchConfig, FetchObservation, FetchResetOptions, FetchTask, GoalEnv, GoalReward,
    Info, MujocoEnv, MujocoSimulator, SnapshotEnv,
};

/// A Fetch environment on MuJoCo with a time limit, of a built-in task or of one of your own without
/// [memory](FetchTask::Memory): each such [`MujocoEnv`] implements this trait.
pub trait OnMujoco:
    GoalEnv<
        Observation = FetchObservation,
        Info = Info,
        ActionSpace = BoxSpace<f32>,
        ResetOptions = FetchResetOptions,
    > + SnapshotEnv<Snapshot = <MujocoEnv as SnapshotEnv>::Snapshot>
{
    /// Returns the settings.
    fn config(&self) -> &FetchConfig;

    /// Returns the simulator.
    fn simulator(&self) -> &MujocoSimulator;
}

impl<R, T> OnMujoco for MujocoEnv<R, T>
where
    R: GoalReward,
    T: FetchTask<MujocoSimulator, Memory = ()>,
{
    fn config(&self) -> &FetchConfig {
        self.inner().config()
    }

    fn simulator(&self) -> &MujocoSimulator {
        self.inner().simulator()
    }
}
