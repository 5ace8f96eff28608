//! Runs that take milliseconds.

use arbitrary::Arbitrary;
use baselines::learn::{
    AlgorithmSettings, DdpgSettings, PpoSettings, SacSettings, TrainError, TrainSettings, Trainer,
};
use fetch_env::wrappers::Wrapped;
use fetch_env::{EnvError, FetchEnv, KinematicSimulator, Task, TimeLimit, make_kinematic};

pub type TestEnv = Wrapped<FetchEnv<KinematicSimulator>, TimeLimit>;

#[derive(Arbitrary, Clone, Copy, Debug)]
pub enum Algorithm {
    Ddpg,
    Sac,
    Ppo,
}

pub fn make() -> Result<TestEnv, EnvError> {
    Ok(make_kinematic("FetchReach-v4")?)
}

pub fn settings(algorithm: Algorithm) -> TrainSettings {
    let hidden = vec![4, 3];
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.algorithm = match algorithm {
        Algorithm::Ppo => {
            let ppo = PpoSettings { hidden, epochs: 2, minibatches: 3, ..PpoSettings::default() };
            let mut settings = TrainSettings::on_policy(AlgorithmSettings::Ppo(ppo));
            settings.schedule.num_envs = 2;
            settings.schedule.steps_per_cycle = 60;
            settings.schedule.evaluation_episodes = 1;
            return settings;
        }
        Algorithm::Ddpg => {
            AlgorithmSettings::Ddpg(DdpgSettings { hidden, ..DdpgSettings::default() })
        }
        Algorithm::Sac => AlgorithmSettings::Sac(SacSettings { hidden, ..SacSettings::default() }),
    };
    settings.replay.capacity = 150;
    settings.replay.batch_size = 8;
    settings.exploration.random_episodes = 1;
    settings.schedule.steps_per_cycle = 60;
    settings.schedule.updates_per_cycle = 2;
    settings.schedule.evaluation_episodes = 1;
    settings
}

/// Trains and evaluates. Numbers that were read may be too extreme to learn with, which is an
/// error.
pub fn train(trainer: &mut Trainer<TestEnv>) -> Result<(), TrainError> {
    trainer.cycle()?;
    trainer.evaluate().map(drop)
}
