//! A training run and its parts.

use std::fmt;
use std::path::PathBuf;

use fetch_env::vec_env::{AutoresetMode, VecConfig};
use fetch_env::{EnvError, EnvExt, VecEnv};
use goal_reward::GoalReward;
use her_relabel::{Dims, HerBuffer};

use super::algorithm::{AlgorithmInit, Built};
use super::collecting::Collecting;
use super::curve::{Counters, CurveRow, Recent, UpdateSeconds};
use super::cycle::Rest;
use super::env::LearnEnv;
use super::error::TrainError;
use super::far_starts::FarStarts;
use super::learner::Learner;
use super::replay::Replay;
use super::seeds::{Purpose, seed_for, seed_of_rank};
use super::settings::{AlgorithmSettings, TrainSettings};
use crate::trained::{PolicyHeader, TrainedPolicy, TrainedPolicyError};
use crate::workers::{OneProcess, Workers, agree, share, sum};

/// Trains an actor on goal-conditioned environments with hindsight.
///
/// It has three parts: one collects steps, one holds and draws transitions, and one updates the
/// actor. [`run`](Self::run) is the loop over them.
pub struct Trainer<E: LearnEnv> {
    /// Distinguishes the run from all others, even with the same settings and seed.
    pub(super) run_id: u64,
    pub(super) settings: TrainSettings,
    pub(super) seed: u64,
    pub(super) collecting: Collecting<E>,
    pub(super) replay: Replay<E>,
    pub(super) learner: Learner,
    pub(super) evaluation_envs: VecEnv<E>,
    pub(super) workers: Box<dyn Workers>,
    pub(super) counters: Counters,
    pub(super) recent: Recent,
    pub(super) rows: Vec<CurveRow>,
    /// What is left of a cycle that was stopped.
    pub(super) rest: Option<Rest>,
    pub(super) last_checkpoint: Option<PathBuf>,
}

/// Makes environments that are stepped together.
fn vec_env<E: LearnEnv>(
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
    /// the settings and the seed, not on the number of threads.
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
    /// [`per_rank`](super::ScheduleSettings::per_rank) decides how many. All call the same methods
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
        let mut facts = vec![
            ("version of baselines", env!("CARGO_PKG_VERSION").to_owned()),
            ("seed", seed.to_string()),
            ("algorithm", settings.algorithm.name().to_owned()),
        ];
        let each = settings.each();
        facts.extend(each.iter().map(|(name, value)| (name.as_str(), value.clone())));
        agree(&mut *workers, &facts)?;
        settings.check()?;
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
            seed: seed_for(seed, Purpose::Algorithm, 0),
            rank: workers.rank(),
        };
        let algorithm = build(&settings.algorithm, init)?;
        replay.set_discount(algorithm.gamma())?;

        let vec_config = VecConfig::default().with_num_threads(num_threads);
        let evaluated =
            (0..share(&*workers, settings.schedule.evaluation_episodes).len().clamp(1, 20))
                .map(|_| make());
        let starts = FarStarts::new(own.exploration.far_starts);
        let collected = (0..num_envs).map(|_| make()?.wrap(starts.clone()));
        let same_step = vec_config.with_autoreset(AutoresetMode::SameStep);
        Ok(Self {
            run_id: rand::random(),
            collecting: Collecting::new(vec_env(collected, same_step)?, own.exploration, own_seed),
            replay,
            learner: Learner::new(algorithm, num_threads)?,
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
        self.learner.seconds
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

    /// Returns the greedy policy as it is now.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if the training has diverged.
    pub fn policy(&self, env_id: &str) -> Result<TrainedPolicy, TrainedPolicyError> {
        let Dims { observation, goal, action } = self.replay.buffer.config().dims();
        let header = PolicyHeader {
            version: PolicyHeader::VERSION,
            env_id: env_id.to_owned(),
            observation_len: observation,
            goal_len: goal,
            action_len: action,
            inputs: self.replay.inputs.parts(),
            observation_normalizer: Some(self.replay.inputs.observation.clone()),
            goal_normalizer: Some(self.replay.inputs.goal.clone()),
            algorithm: self.learner.algorithm.name().to_owned(),
            settings: self.settings.to_json(),
            seed: self.seed,
            steps: self.counters.steps,
            demonstrations: self.counters.demonstrations,
            success: None,
        };
        let mut layers = self.learner.algorithm.greedy_layers();
        if let Some(layer) = layers.first_mut() {
            self.replay.inputs.leave_out_weights(layer);
        }
        TrainedPolicy::new(header, &layers)
    }

    /// Calls `add` with an empty buffer, and then adds the finished episodes that it has put there:
    /// demonstrations of a script, or episodes from a file. [`update`](Self::update) learns from
    /// them alone, and [`run`](Self::run) from them and from what it collects. Algorithms can tell
    /// which transitions are [demonstrated](super::Transitions::demonstrated).
    ///
    /// # Errors
    /// Those of `add`, [`TrainError::Demonstrations`] and [`TrainError::Unreadable`]. If `add`
    /// fails, no episode is added.
    pub fn add_demonstrations<T, X: From<TrainError>>(
        &mut self,
        add: impl FnOnce(&mut HerBuffer<f32>) -> Result<T, X>,
    ) -> Result<T, X> {
        let Replay { buffer, demonstrated, .. } = &mut self.replay;
        // The run's own buffer has episodes under way, which `add` could end.
        let mut added = HerBuffer::new(buffer.config().clone()).map_err(TrainError::from)?;
        let result = add(&mut added).and_then(|result| {
            let newest = buffer.transition_ids().map(|(_, newest)| newest);
            buffer.append(&added).map_err(TrainError::from)?;
            demonstrated.add(buffer, newest);
            Ok(result)
        });
        let own = if result.is_ok() { added.num_episodes() as u64 } else { 0 };
        // The other processes wait for this number even if this one failed.
        let all = sum(&mut *self.workers, own).map_err(TrainError::from)?;
        self.counters.demonstrations += all;
        result
    }
}
