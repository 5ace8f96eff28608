//! The loop of a training run: collect, update, evaluate.

use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

use fetch_env::vec_env::{AutoresetMode, VecConfig, VecStep, VecStepOf};
use fetch_env::{BoxSpace, EnvError, GoalObservation, VecEnv};
use her_relabel::{Dims, HerBuffer, Sampler, Scalar};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::algorithm::Algorithm;
use super::curve::{Counters, CurveRow, Recent, Target, UpdateSeconds};
use super::error::TrainError;
use super::explorer::Explorer;
use super::inputs::Inputs;
use super::replay::{sampler, still_episodes};
use super::seeds::{Purpose, seed_for, seed_of_rank};
use super::settings::TrainSettings;
use super::train_batch::TrainBatch;
use crate::collect::buffer_config;
use crate::collector::{CollectEnv, Collector};
use crate::evaluate::evaluate_range;
use crate::policy::Policy;
use crate::trained::{PolicyHeader, TrainedPolicy, TrainedPolicyError};
use crate::workers::{OneProcess, UnreadableMessage, Workers, agree, gather_episodes, share, sum};

/// An environment that a [`Trainer`] learns: its actions are a box from -1 to 1.
pub trait LearnEnv: CollectEnv<ActionSpace = BoxSpace<f32>> {}

impl<E: CollectEnv<ActionSpace = BoxSpace<f32>>> LearnEnv for E {}

/// The seed of the first evaluation's first episode. The seeds of training are below 2^40.
const EVALUATION_SEED: u64 = 1 << 41;

/// The number of threads that can share the work of an update.
const MAX_THREADS: usize = 2;

/// Trains an actor on goal-conditioned environments with hindsight.
pub struct Trainer<E: LearnEnv> {
    /// Tells the run from others, also from those of the same settings and seed.
    pub(super) run_id: u64,
    pub(super) settings: TrainSettings,
    pub(super) seed: u64,
    /// The seed of what this process does by itself.
    pub(super) own_seed: u64,
    /// Has the reward as a function of goals.
    pub(super) template: E,
    pub(super) collector: Collector<E>,
    evaluation_envs: VecEnv<E>,
    pub(super) buffer: HerBuffer<f32>,
    pub(super) sampler: Sampler,
    pub(super) batch: TrainBatch,
    pub(super) inputs: Inputs,
    pub(super) explorer: Explorer,
    pub(super) algorithm: Box<dyn Algorithm>,
    pub(super) threads: Arc<ThreadPool>,
    /// The process that has the threads.
    process: u32,
    pub(super) workers: Box<dyn Workers>,
    pub(super) counters: Counters,
    pub(super) recent: Recent,
    pub(super) rows: Vec<CurveRow>,
    pub(super) last_checkpoint: Option<PathBuf>,
    pub(super) update_seconds: UpdateSeconds,
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
    /// Each process has environments and a buffer of its own, and draws its own part of each batch;
    /// [`per_rank`](super::ScheduleSettings::per_rank) tells how many of them. All call the same methods of
    /// their trainers in the same order. The same number of processes gives the same bits again, and
    /// one process those of a run without others.
    ///
    /// # Errors
    /// [`TrainError`] as from [`new`](Self::new), and [`TrainError::Disagreement`] if the processes
    /// have other settings, seeds or versions of this crate.
    pub fn with_workers(
        make: impl Fn() -> Result<E, EnvError>,
        settings: TrainSettings,
        seed: u64,
        num_threads: usize,
        mut workers: Box<dyn Workers>,
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
        let own_seed = seed_of_rank(seed, workers.rank());
        let template = make().map_err(TrainError::Make)?;
        let space = template.action_space();
        if space.low().iter().any(|low| *low != -1.0)
            || space.high().iter().any(|high| *high != 1.0)
        {
            return Err(TrainError::ActionSpace);
        }
        let num_envs = own.schedule.num_envs;
        let mut config = buffer_config(own.replay.capacity, &template)?.with_num_envs(num_envs);
        if let Some(still) = still_episodes(&own.replay)? {
            config = config.with_still_episodes(still.with_seed(seed_for(
                own_seed,
                Purpose::StillEpisodes,
                0,
            )));
        }
        let dims = config.dims();
        let sampler = sampler(&own.replay, settings.algorithm.gamma())?;
        let inputs = Inputs::new(&settings.inputs, dims)?;
        let algorithm_seed = seed_for(seed, Purpose::Algorithm, 0);
        let algorithm = settings.algorithm.build(inputs.dim(), dims.action, algorithm_seed)?;
        let vec_config = VecConfig::default().with_num_threads(num_threads);
        let envs = |count: usize, config| -> Result<VecEnv<E>, TrainError> {
            let envs = (0..count).map(|_| make()).collect::<Result<Vec<_>, _>>();
            Ok(VecEnv::new(envs.map_err(TrainError::Make)?, config)?)
        };
        let threads = ThreadPoolBuilder::new().num_threads(num_threads.min(MAX_THREADS)).build();
        let episodes = share(&*workers, settings.schedule.evaluation_episodes).len();
        Ok(Self {
            run_id: rand::random(),
            collector: Collector::new(envs(
                num_envs,
                vec_config.with_autoreset(AutoresetMode::SameStep),
            )?),
            evaluation_envs: envs(episodes.clamp(1, 20), vec_config)?,
            buffer: HerBuffer::new(config)?,
            sampler,
            batch: TrainBatch::default(),
            explorer: Explorer::new(
                own.exploration,
                seed_for(own_seed, Purpose::Exploration, 0),
                inputs.clone(),
                num_envs,
            ),
            inputs,
            algorithm,
            threads: Arc::new(threads.map_err(TrainError::Threads)?),
            process: std::process::id(),
            workers,
            counters: Counters::default(),
            recent: Recent::default(),
            rows: Vec::new(),
            last_checkpoint: None,
            update_seconds: UpdateSeconds::default(),
            template,
            settings,
            seed,
            own_seed,
        })
    }

    /// The time that updates have taken.
    #[must_use]
    pub const fn update_seconds(&self) -> UpdateSeconds {
        self.update_seconds
    }

    /// The processes that share the run.
    pub fn workers(&mut self) -> &mut dyn Workers {
        &mut *self.workers
    }

    /// What has happened so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The rows of the learning curve so far.
    #[must_use]
    pub fn rows(&self) -> &[CurveRow] {
        &self.rows
    }

    /// The settings.
    #[must_use]
    pub const fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    /// The seed.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the greedy policy as it is now.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if the training has diverged.
    pub fn policy(&self, env_id: &str) -> Result<TrainedPolicy, TrainedPolicyError> {
        let Dims { observation, goal, action } = self.buffer.config().dims();
        let header = PolicyHeader {
            version: PolicyHeader::VERSION,
            env_id: env_id.to_owned(),
            observation_len: observation,
            goal_len: goal,
            action_len: action,
            inputs: self.inputs.parts(),
            observation_normalizer: Some(self.inputs.observation.clone()),
            goal_normalizer: Some(self.inputs.goal.clone()),
            algorithm: self.settings.algorithm.name().to_owned(),
            settings: self.settings.to_json(),
            seed: self.seed,
            steps: self.counters.steps,
            demonstrations: self.counters.demonstrations,
            success: None,
        };
        TrainedPolicy::new(header, &self.algorithm.greedy_layers())
    }

    /// Calls `add` to add episodes to the buffer before the run begins: demonstrations of a script,
    /// or episodes of a file.
    ///
    /// # Errors
    /// Those of `add`, and [`UnreadableMessage`].
    pub fn add_demonstrations<T, X: From<UnreadableMessage>>(
        &mut self,
        add: impl FnOnce(&mut HerBuffer<f32>) -> Result<T, X>,
    ) -> Result<T, X> {
        let before = self.buffer.num_episodes();
        let added = add(&mut self.buffer)?;
        let own = self.buffer.num_episodes().saturating_sub(before) as u64;
        self.counters.demonstrations += sum(&mut *self.workers, own)?;
        Ok(added)
    }

    /// Evaluates the greedy policy, as [`policy`](Self::policy) returns it, on episodes that no other
    /// evaluation has.
    ///
    /// # Errors
    /// [`TrainError::Policy`], [`TrainError::Evaluate`], [`TrainError::EvaluationNotFinite`] and
    /// [`TrainError::Forked`].
    pub fn evaluate(&mut self) -> Result<CurveRow, TrainError> {
        self.check_process()?;
        let count = self.settings.schedule.evaluation_episodes;
        let seed = EVALUATION_SEED + self.counters.evaluations * count as u64;
        // What is evaluated has no name in a file.
        let mut policy = self.policy("")?;
        let mut first_bad = None;
        let mut greedy = |batch: &VecStepOf<E>, actions: &mut [f32]| {
            first_bad = first_bad.or_else(|| first_not_finite(batch));
            policy.act(batch, actions);
        };
        let own = share(&*self.workers, count);
        let envs = &mut self.evaluation_envs;
        let evaluation = evaluate_range(envs, &mut greedy, own, seed, |_| ())?;
        let bad_reward = || {
            let row =
                evaluation.episodes.iter().position(|episode| !episode.return_sum.is_finite());
            row.map(|row| (row % self.evaluation_envs.num_envs(), "a reward"))
        };
        let bad = first_bad.map(|row| (row, "an observation")).or_else(bad_reward);
        if let Some((env_index, what)) = bad {
            return Err(TrainError::EvaluationNotFinite {
                env_index,
                what,
                steps: self.counters.steps,
                checkpoint: self.last_checkpoint.clone(),
            });
        }
        self.counters.evaluations += 1;
        let summary = gather_episodes(&mut *self.workers, &evaluation)?.summary()?;
        let recent = std::mem::take(&mut self.recent);
        let row = CurveRow {
            counters: self.counters,
            success_rate: summary.success_rate,
            return_mean: summary.return_mean.value,
            final_distance: summary.final_distance_mean.value,
            collected_success: recent.success_rate(),
            losses: recent.losses(),
        };
        self.rows.push(row);
        Ok(row)
    }

    /// Checks that the threads are in this process: in one that was forked, nothing would answer.
    pub(super) fn check_process(&self) -> Result<(), TrainError> {
        if self.process == std::process::id() { Ok(()) } else { Err(TrainError::Forked) }
    }

    /// Checks that all processes have the same weights.
    fn check_weights(&mut self) -> Result<(), TrainError> {
        if self.workers.size() == 1 {
            return Ok(());
        }
        let mut hasher = DefaultHasher::new();
        let state = self.algorithm.state_mut();
        state.num_updates.hash(&mut hasher);
        for number in state.vectors.iter().flat_map(|(_, vector)| vector.iter()) {
            hasher.write_u32(number.to_bits());
        }
        let facts = [("checksum of its weights", format!("{:016x}", hasher.finish()))];
        Ok(agree(&mut *self.workers, &facts)?)
    }

    /// Runs until `num_steps` steps have been collected in all, the target is reached, or `watch`
    /// breaks, in any process; `watch` gets this trainer and each row of the learning curve.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn run(
        &mut self,
        num_steps: u64,
        target: Option<Target>,
        mut watch: impl FnMut(&mut Self, &CurveRow) -> ControlFlow<()>,
    ) -> Result<(), TrainError> {
        let interval = self.settings.schedule.evaluation_interval;
        let is_reached = |rows: &[CurveRow]| target.is_some_and(|target| target.is_reached(rows));
        while self.counters.steps < num_steps && !is_reached(&self.rows) {
            let evaluations = self.counters.steps / interval;
            self.cycle()?;
            if self.counters.updates > 0 && self.counters.steps / interval > evaluations {
                let row = self.evaluate()?;
                self.check_weights()?;
                let is_over = watch(self, &row).is_break();
                if sum(&mut *self.workers, u64::from(is_over))? > 0 {
                    break;
                }
            }
        }
        Ok(())
    }
}

/// Returns the first environment that observes a number that is not finite.
fn first_not_finite<O: GoalObservation<Element: Scalar>, I>(
    batch: &VecStep<O, I>,
) -> Option<usize> {
    let row = |index: usize, len: usize| index * batch.len() / len;
    let observations = batch.observation();
    let observation = observations.iter().position(|number| !number.to_f64().is_finite());
    let observation = observation.map(|index| row(index, observations.len()));
    let goals = [batch.achieved_goal(), batch.desired_goal()].into_iter().filter_map(|goals| {
        let index = goals.iter().position(|number| !number.is_finite());
        index.map(|index| row(index, goals.len()))
    });
    observation.into_iter().chain(goals).min()
}
