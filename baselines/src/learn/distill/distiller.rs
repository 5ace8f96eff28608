//! Distilling a teacher into a student.

use std::fmt;
use std::path::PathBuf;

use fetch_env::vec_env::{AutoresetMode, VecConfig, VecEnvError, VecStepOf};
use fetch_env::{EnvError, Info, VecEnv};
use her_relabel::Dims;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Deserialize, Serialize};

use super::frames::Frames;
use super::settings::DistillSettings;
use super::student::{Student, StudentNetwork};
use crate::evaluate::{EvaluationError, check_vec_policy};
use crate::learn::error::TrainError;
use crate::learn::run::curve::{Counters, CurveRow};
use crate::learn::run::env::LearnEnv;
use crate::learn::run::eyes::SightOf;
use crate::learn::run::inputs::{Inputs, check_left_out};
use crate::learn::run::seeds::{SeedUse, seed_for};
use crate::learn::run::trainer::vec_env;
use crate::network::perceptron::Shape;
use crate::policy::VecPolicy;
use crate::trained::{PolicyHeader, TrainedPolicy, TrainedPolicyError};
use crate::workers::OneProcess;

/// Distills a teacher into a student: a policy on the state into a network, such as one that a
/// planner's rules or a big network made, by imitation on the states to which the student leads.
///
/// In each round, all environments begin new episodes. In the first rounds the teacher acts, with
/// noise; then the student acts alone. The teacher labels every state, and updates lower the mean
/// squared error of the student's actions on states of all rounds. Source: Ross, Gordon and Bagnell,
/// *A reduction of imitation learning and structured prediction to no-regret online learning*, 2011
/// (DAgger).
///
/// The same settings and the same seed give the same curve and the same student, bit for bit, on any
/// number of threads, and whether or not the run was stopped and [resumed](Self::resume).
///
/// ```
/// use std::ops::ControlFlow;
///
/// use baselines::TrainedPolicy;
/// use baselines::learn::{DistillSettings, Distiller};
/// use fetch_env::{Task, make_kinematic};
///
/// let teacher = Box::new(TrainedPolicy::shipped(Task::Reach)?);
/// let settings = DistillSettings::of_task(Task::Reach, false);
/// let make = || Ok(make_kinematic("FetchReach-v4")?);
/// # let settings = settings.with("evaluation_episodes=4")?.with("batch_size=32")?;
/// let mut distiller = Distiller::new(make, teacher, settings, 0, 2)?;
/// distiller.run(1_600, None, |_, row| {
///     println!("{} steps: {:?}", row.counters.steps, row.success_rate);
///     ControlFlow::Continue(())
/// })?;
/// let policy = distiller.policy("FetchReach-v4")?;
/// # assert_eq!(policy.header().steps, 1_600);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Distiller<E: LearnEnv> {
    pub(super) run_id: u64,
    pub(super) settings: DistillSettings,
    pub(super) seed: u64,
    pub(super) template: E,
    pub(super) envs: VecEnv<E>,
    pub(super) evaluation_envs: VecEnv<E>,
    pub(super) teacher: Box<dyn VecPolicy<E::Observation, E::Info> + Send>,
    /// Returns the pictures of a batch, nothing for a student that sees none.
    pub(super) pictures: Pictures<E>,
    pub(super) dims: Dims,
    pub(super) inputs: Inputs,
    pub(super) columns: Columns,
    /// What a student that sees pictures sees.
    pub(super) sight: Option<SightOf>,
    pub(super) student: Student,
    pub(super) frames: Frames,
    pub(super) threads: ThreadPool,
    pub(super) workers: OneProcess,
    pub(super) counters: Counters,
    pub(super) recent: Recent,
    pub(super) rows: Vec<CurveRow>,
    pub(super) last_checkpoint: Option<PathBuf>,
}

/// The places of the numbers that a student sees, among all inputs; `None` for all.
pub(super) type Columns = Option<Vec<usize>>;

/// What returns the pictures of a batch.
pub(super) type Pictures<E> = fn(&VecStepOf<E>) -> &[u8];

/// Sums since the last evaluation.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Recent {
    pub(super) episodes: u64,
    pub(super) successes: u64,
    pub(super) updates: u64,
    pub(super) error: f64,
}

impl<E: LearnEnv> fmt::Debug for Distiller<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Distiller")
            .field("settings", &self.settings)
            .field("seed", &self.seed)
            .field("counters", &self.counters)
            .finish_non_exhaustive()
    }
}

impl<E: LearnEnv<Info: AsRef<Info>>> Distiller<E> {
    /// Prepares to distill `teacher` into a network that sees the state, on environments that `make`
    /// makes. `num_threads` threads step the environments and compute the updates.
    ///
    /// # Errors
    /// [`TrainError`] if a setting is out of range, the teacher does not fit the environments, or
    /// one cannot be made.
    pub fn new(
        make: impl Fn() -> Result<E, EnvError>,
        teacher: Box<dyn VecPolicy<E::Observation, E::Info> + Send>,
        settings: DistillSettings,
        seed: u64,
        num_threads: usize,
    ) -> Result<Self, TrainError> {
        let student = |_: &E, dims: Dims, DistillSettings { hidden, .. }: &_, rates, seed| {
            let shape = Shape::new(dims.observation + dims.goal, hidden, dims.action, false);
            Ok((Student::of_state(shape, rates, seed), None))
        };
        Self::with_student(make, teacher, settings, seed, num_threads, None, student)
    }

    /// Prepares a run with a student that `student` makes from an environment, the lengths, the
    /// settings, its two rates and a seed, with the places of the numbers that it sees. `pictures`
    /// returns those of a batch.
    pub(super) fn with_student(
        make: impl Fn() -> Result<E, EnvError>,
        teacher: Box<dyn VecPolicy<E::Observation, E::Info> + Send>,
        settings: DistillSettings,
        seed: u64,
        num_threads: usize,
        pictures: Option<Pictures<E>>,
        student: impl FnOnce(
            &E,
            Dims,
            &DistillSettings,
            [f32; 2],
            u64,
        ) -> Result<(Student, Columns), TrainError>,
    ) -> Result<Self, TrainError> {
        settings.check_for(pictures.is_some())?;
        let template = make().map_err(TrainError::Make)?;
        let space = template.action_space();
        if space.low().iter().any(|low| *low != -1.0)
            || space.high().iter().any(|high| *high != 1.0)
        {
            return Err(TrainError::ActionSpace);
        }
        let dims = template.observation_space().dims(space.low().len());
        let dims = dims.map_err(VecEnvError::from)?;
        check_left_out(&settings.left_out, dims)?;
        let config = VecConfig::default().with_num_threads(num_threads);
        let own = config.with_autoreset(AutoresetMode::Disabled);
        let envs = vec_env((0..settings.num_envs).map(|_| make()), own)?;
        check_vec_policy(&envs, &*teacher).map_err(EvaluationError::from)?;
        let evaluated = (0..settings.evaluation_episodes.clamp(1, 20)).map(|_| make());
        let threads = ThreadPoolBuilder::new().num_threads(num_threads.max(1)).build();
        let rates = [settings.learning_rate, settings.average_fraction];
        let first_weights = seed_for(seed, SeedUse::Algorithm, 0);
        let (student, columns) = student(&template, dims, &settings, rates, first_weights)?;
        Ok(Self {
            run_id: rand::random(),
            evaluation_envs: vec_env(evaluated, config)?,
            envs,
            teacher,
            columns,
            sight: None,
            pictures: pictures.unwrap_or(|_| &[]),
            inputs: Inputs::new(&settings.inputs(), dims)?,
            student,
            frames: Frames::new(settings.capacity),
            dims,
            template,
            threads: threads.map_err(TrainError::Threads)?,
            workers: OneProcess,
            counters: Counters::default(),
            recent: Recent::default(),
            rows: Vec::new(),
            last_checkpoint: None,
            settings,
            seed,
        })
    }

    /// Returns the counts of the run so far.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Returns the rows of the learning curve so far. The mean squared error of the updates is the
    /// diagnostic `update/imitation_error`.
    #[must_use]
    pub fn rows(&self) -> &[CurveRow] {
        &self.rows
    }

    /// Returns the settings.
    #[must_use]
    pub const fn settings(&self) -> &DistillSettings {
        &self.settings
    }

    /// Returns the seed.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the student that is evaluated, as it is now.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if it has diverged, and [`TrainedPolicyError::Header`] if
    /// it sees pictures.
    pub fn policy(&self, env_id: &str) -> Result<TrainedPolicy, TrainedPolicyError> {
        let StudentNetwork::State(network) = &self.student.averaged else {
            let reason = "it is of a student that sees pictures".to_owned();
            return Err(TrainedPolicyError::Header { reason });
        };
        let mut layers = network.layer_weights();
        if let Some(layer) = layers.first_mut() {
            self.inputs.leave_out_weights(layer);
        }
        TrainedPolicy::new(self.header(env_id), &layers)
    }

    /// Describes the student.
    pub(super) fn header(&self, env_id: &str) -> PolicyHeader {
        let Dims { observation, goal, action } = self.dims;
        PolicyHeader {
            version: PolicyHeader::VERSION,
            env_id: env_id.to_owned(),
            observation_len: observation,
            goal_len: goal,
            action_len: action,
            inputs: self.inputs.parts(),
            observation_normalizer: Some(self.inputs.observation.clone()),
            goal_normalizer: Some(self.inputs.goal.clone()),
            algorithm: "distilled".to_owned(),
            settings: self.settings.to_json(),
            seed: self.seed,
            steps: self.counters.steps,
            demonstrations: 0,
            success: None,
        }
    }
}
