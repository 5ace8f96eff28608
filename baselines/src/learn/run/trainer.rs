//! A training run and its parts.

use std::fmt;
use std::path::PathBuf;

use fetch_env::vec_env::{AutoresetMode, VecConfig};
use fetch_env::{EnvError, EnvExt, VecEnv};
use goal_reward::GoalReward;
use her_relabel::Dims;
use serde::{Deserialize, Serialize};

use super::collecting::Collecting;
use super::curve::{Counters, CurveRow, Recent, UpdateSeconds};
use super::env::LearnEnv;
use super::eyes::Eyes;
use super::far_starts::FarStarts;
use super::replay::Replay;
use super::seeds::{SeedUse, seed_for, seed_of_rank};
use super::updates::Updates;
use crate::learn::algorithm::interface::{AlgorithmInit, Built};
use crate::learn::error::TrainError;
use crate::learn::settings::algorithm::AlgorithmSettings;
use crate::learn::settings::train::{TrainSettings, each_setting};
use crate::trained::{PolicyHeader, TrainedPolicy, TrainedPolicyError};
use crate::workers::{OneProcess, Workers, agree, share};

/// The rest of a cycle that was stopped after it had collected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Rest {
    /// The number of updates that are left.
    pub(crate) updates: u64,
    /// Whether the steps of the cycle have completed an interval between evaluations.
    pub(super) ends_interval: bool,
}

/// Trains an actor on goal-conditioned environments with hindsight.
///
/// It has three parts: one collects steps, one holds and draws transitions, and one updates the
/// actor. [`run`](Self::run) is the loop over them.
pub struct Trainer<E: LearnEnv> {
    /// Distinguishes the run from all others, even with the same settings and seed.
    pub(crate) run_id: u64,
    pub(crate) settings: TrainSettings,
    pub(crate) seed: u64,
    pub(crate) collecting: Collecting<E>,
    pub(crate) replay: Replay<E>,
    pub(crate) updates: Updates,
    /// An actor that sees pictures.
    pub(crate) eyes: Option<Box<dyn Eyes<E::Observation, E::Info>>>,
    pub(crate) evaluation_envs: VecEnv<E>,
    pub(crate) workers: Box<dyn Workers>,
    pub(crate) counters: Counters,
    pub(crate) recent: Recent,
    pub(crate) rows: Vec<CurveRow>,
    /// What is left of a cycle that was stopped.
    pub(crate) rest: Option<Rest>,
    pub(crate) last_checkpoint: Option<PathBuf>,
}

/// What to do about a debug build.
const UNOPTIMIZED: &str = "learning is about 160 times slower in a debug build: use --release, or \
     add the two lines [profile.dev.package.\"*\"] and opt-level = 3 to your Cargo.toml";

/// Makes environments that are stepped together.
pub(crate) fn vec_env<E: LearnEnv>(
    envs: impl Iterator<Item = Result<E, EnvError>>,
    config: VecConfig,
) -> Result<VecEnv<E>, TrainError> {
    let envs = envs.collect::<Result<Vec<_>, _>>().map_err(TrainError::Make)?;
    Ok(VecEnv::new(envs, config)?)
}

impl<E: LearnEnv> fmt::Debug for Trainer<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Trainer")
            .field("settings", &self.settings)
            .field("seed", &self.seed)
            .field("counters", &self.counters)
            .finish_non_exhaustive()
    }
}

impl<E: LearnEnv> Trainer<E> {
    /// Prepares a run on environments that `make` makes.
    ///
    /// `num_threads` threads step the environments and compute the updates. The results depend on
    /// the settings and the seed, not on the number of threads. In a debug build it warns through
    /// `tracing` that learning is [slow](crate::learn#debug-builds).
    ///
    /// # Errors
    /// [`TrainError`] if a setting is out of range or an environment cannot be made.
    pub fn new(
        make: impl Fn() -> Result<E, EnvError>,
        settings: TrainSettings,
        seed: u64,
        num_threads: usize,
    ) -> Result<Self, TrainError> {
        Self::with_workers(make, settings, seed, num_threads, Box::new(OneProcess))
    }

    /// Prepares a run that several processes share, as [`new`](Self::new) does in each of them.
    ///
    /// Each process has its own environments and buffer, and draws its part of each batch;
    /// [`per_rank`](crate::learn::ScheduleSettings::per_rank) decides how many. All call the same methods
    /// of their trainers in the same order. The same number of processes gives the same bits again,
    /// and one process those of [`new`](Self::new).
    ///
    /// # Errors
    /// [`TrainError`] as from [`new`](Self::new), and [`TrainError::Disagreement`] if the settings,
    /// the seeds or the versions of this crate differ between the processes.
    pub fn with_workers(
        make: impl Fn() -> Result<E, EnvError>,
        settings: TrainSettings,
        seed: u64,
        num_threads: usize,
        workers: Box<dyn Workers>,
    ) -> Result<Self, TrainError> {
        Self::with_algorithm(make, settings, seed, num_threads, workers, AlgorithmSettings::build)
    }

    /// Prepares a run with an algorithm that `build` makes from the
    /// [settings](TrainSettings::algorithm), which are [`AlgorithmSettings::Other`] for your own;
    /// otherwise as [`with_workers`](Self::with_workers), with [`OneProcess`] for a single process.
    ///
    /// # Errors
    /// [`TrainError`] as from [`with_workers`](Self::with_workers), and the errors of `build`.
    pub fn with_algorithm(
        make: impl Fn() -> Result<E, EnvError>,
        settings: TrainSettings,
        seed: u64,
        num_threads: usize,
        mut workers: Box<dyn Workers>,
        build: impl FnOnce(&AlgorithmSettings, AlgorithmInit) -> Built,
    ) -> Result<Self, TrainError> {
        if cfg!(unoptimized) {
            tracing::warn!(target: "baselines::learn", "{UNOPTIMIZED}");
        }
        let mut facts = vec![
            ("version of baselines", env!("CARGO_PKG_VERSION").to_owned()),
            ("seed", seed.to_string()),
            ("algorithm", settings.algorithm.name().to_owned()),
        ];
        let each = each_setting(&settings);
        facts.extend(each.iter().map(|(name, value)| (name.as_str(), value.clone())));
        agree(&mut *workers, &facts)?;
        settings.check()?;
        if settings.pixels.is_some() {
            return Err(TrainError::Setting {
                name: "pixels",
                value: "set".to_owned(),
                expected: "begin the run with Trainer::with_pixels",
            });
        }
        let own = settings.of_one(workers.size())?;
        own.check()?;

        let template = make().map_err(TrainError::Make)?;
        let space = template.action_space();
        if space.low().iter().any(|low| *low != -1.0)
            || space.high().iter().any(|high| *high != 1.0)
        {
            return Err(TrainError::ActionSpace);
        }
        let own_seed = seed_of_rank(seed, workers.rank());
        let num_envs = own.schedule.num_envs;
        let mut replay = Replay::new(template, num_envs, &own.replay, &own.inputs, own_seed)?;
        let init = AlgorithmInit {
            num_inputs: replay.inputs.dim(),
            num_actions: replay.buffer.config().dims().action,
            reward_bounds: replay.template.goal_reward().bounds(),
            seed: seed_for(seed, SeedUse::Algorithm, 0),
            rank: workers.rank(),
        };
        let algorithm = build(&settings.algorithm, init)?;
        if algorithm.is_on_policy() {
            settings.check_on_policy(algorithm.name())?;
        }
        replay.set_algorithm(&*algorithm)?;

        let vec_config = VecConfig::default().with_num_threads(num_threads);
        let evaluated =
            (0..share(&*workers, settings.schedule.evaluation_episodes).len().clamp(1, 20))
                .map(|_| make());
        let starts = FarStarts::new(own.exploration.far_start_share);
        let collected = (0..num_envs).map(|_| make()?.wrap(starts.clone()));
        let same_step = vec_config.with_autoreset(AutoresetMode::SameStep);
        Ok(Self {
            run_id: rand::random(),
            collecting: Collecting::new(vec_env(collected, same_step)?, own.exploration, own_seed),
            replay,
            updates: Updates::new(algorithm, num_threads)?,
            eyes: None,
            evaluation_envs: vec_env(evaluated, vec_config)?,
            workers,
            counters: Counters::default(),
            recent: Recent::default(),
            rows: Vec::new(),
            rest: None,
            last_checkpoint: None,
            settings,
            seed,
        })
    }

    /// Returns the time that updates have taken.
    #[must_use]
    pub const fn update_seconds(&self) -> UpdateSeconds {
        self.updates.seconds
    }

    /// Returns the processes that share the run.
    pub fn workers(&mut self) -> &mut dyn Workers {
        &mut *self.workers
    }

    /// Returns the counts of the run so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Returns the rows of the learning curve so far.
    #[must_use]
    pub fn rows(&self) -> &[CurveRow] {
        &self.rows
    }

    /// Returns the settings.
    #[must_use]
    pub const fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// Returns the seed.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the greedy policy that sees the state, as it is now.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if the training has diverged.
    pub fn policy(&self, env_id: &str) -> Result<TrainedPolicy, TrainedPolicyError> {
        let mut layers = self.updates.algorithm.greedy_layers();
        if let Some(layer) = layers.first_mut() {
            self.replay.inputs.leave_out_weights(layer);
        }
        TrainedPolicy::new(self.header(env_id), &layers)
    }

    /// Describes the policy.
    pub(in crate::learn) fn header(&self, env_id: &str) -> PolicyHeader {
        let Dims { observation, goal, action } = self.replay.buffer.config().dims();
        PolicyHeader {
            version: PolicyHeader::VERSION,
            env_id: env_id.to_owned(),
            observation_len: observation,
            goal_len: goal,
            action_len: action,
            inputs: self.replay.inputs.parts(),
            observation_normalizer: Some(self.replay.inputs.observation.clone()),
            goal_normalizer: Some(self.replay.inputs.goal.clone()),
            algorithm: self.updates.algorithm.name().to_owned(),
            settings: self.settings.to_json(),
            seed: self.seed,
            steps: self.counters.steps,
            demonstrations: self.counters.demonstrations,
            success: None,
        }
    }
}
