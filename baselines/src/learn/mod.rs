//! Learning with hindsight: algorithms, their settings, and the loop that trains.
//!
//! A [`Trainer`] collects steps of vectorized environments, relabels and draws them, and updates an
//! actor with an [`Algorithm`]: [`Ddpg`], [`Sac`], [`Ppo`] or your own. It takes any goal-conditioned
//! environment whose actions are a box from -1 to 1. The presets [`TrainSettings::fast`],
//! [`TrainSettings::authors`] and [`TrainSettings::book`] have settings for the Fetch tasks, and
//! [`TrainSettings::fast_ppo`] and [`TrainSettings::book_ppo`] for dense rewards.
//!
//! The same settings and the same seed give the same curve and the same policy, bit for bit, on any
//! number of threads, and whether or not the run was stopped and [resumed](Trainer::resume). They
//! are the same on every x86_64 (AVX-512, AVX2 or neither) and aarch64 processor if the environment
//! is: MuJoCo differs between the two architectures, the kinematic simulator does not. Tests run on
//! all of these, some of them in QEMU. A processor without fused multiply-add takes many times as
//! long, because a function of the C library replaces it.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use baselines::learn::{Target, TrainSettings, Trainer};
//! use fetch_env::{Task, make_kinematic};
//!
//! let mut settings = TrainSettings::fast(Task::Reach);
//! settings.schedule.evaluation_episodes = 10;
//! # settings.replay.batch_size = 32;
//! let make = || Ok(make_kinematic("FetchReach-v4")?);
//! let mut trainer = Trainer::new(make, settings, 0, 2)?;
//! let target = Target { success_rate: 1.0, evaluations: 2 };
//! # let target = Target { success_rate: 0.0, evaluations: 1 };
//! trainer.run(10_000, Some(target), |_, row| {
//!     println!("{} steps: {:?}", row.counters.steps, row.success_rate);
//!     ControlFlow::Continue(())
//! })?;
//! let policy = trainer.policy("FetchReach-v4")?;
//! # assert!(policy.header().steps <= 10_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Networks are small multilayer perceptrons in `f32`, computed on the processor.
//!
//! # Debug builds
//! Without optimization, learning is about 160 times slower, and [`Trainer::new`] warns through
//! `tracing`. Run with `--release`, or add to your project's `Cargo.toml`:
//!
//! ```toml
//! [profile.dev.package."*"]
//! opt-level = 3
//! ```

mod algorithm;
#[cfg(feature = "render")]
mod asymmetric;
mod checkpoint;
mod distill;
mod error;
mod run;
mod settings;

pub use crate::network;

pub use algorithm::{
    ddpg::Ddpg,
    interface::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions},
    ppo::Ppo,
    rollout::{Rollout, RolloutError},
    sac::Sac,
};
pub use checkpoint::{format::checkpoints, resume::Resumed};
pub use distill::{
    distiller::Distiller,
    settings::DistillSettings,
    teacher::{EachEnv, EnvState},
};
pub use error::{CheckpointError, RunError, TrainError};
#[cfg(feature = "runs")]
pub(crate) use run::learner::check_same;
#[cfg(all(feature = "render", feature = "runs"))]
pub(crate) use run::trainer::vec_env;
pub use run::{
    curve::{Counters, CurveRow, Evaluated, Target, UpdateSeconds},
    env::LearnEnv,
    learner::{Learner, SaveLearner},
    trainer::Trainer,
};
#[cfg(feature = "runs")]
pub(crate) use settings::train::each_setting;
pub use settings::{
    algorithm::{AlgorithmSettings, DdpgSettings, PpoSettings, SacSettings},
    by_name::{Preset, SettingError, limits, nearest},
    pixels::PixelActorSettings,
    train::{
        ExplorationSettings, HindsightGoals, InputSettings, ReplaySettings, ScheduleSettings,
        TrainSettings,
    },
};
