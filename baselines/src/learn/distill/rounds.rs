//! The loop of a distiller: rounds of steps and updates, and evaluations.

use std::ops::ControlFlow;
use std::time::Instant;

use fetch_env::Info;
use fetch_env::vec_env::{VecReset, VecStepOf};
use her_relabel::{Scalar, StateRows};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::distiller::{Distiller, Recent};
use super::frames::Frames;
use super::settings::DistillSettings;
use super::student::squared_error;
use crate::evaluate::{EvaluationError, evaluate_range};
use crate::learn::error::{RunError, TrainError};
use crate::learn::run::curve::{Counters, CurveRow, Target};
use crate::learn::run::env::LearnEnv;
use crate::learn::run::evaluation::EVALUATION_SEED;
use crate::learn::run::inputs::Inputs;
use crate::learn::run::learner::{self, Learner};
use crate::learn::run::seeds::{SeedUse, seed_for};
use crate::learn::settings::train::json_text;
use crate::normal::standard_normal;
use crate::trained::{AnyPolicy, TrainedPolicyError};
use crate::workers::Workers;

impl<E: LearnEnv<Info: AsRef<Info>>> Distiller<E> {
    /// Runs until `num_steps` steps have been taken in total, the target is reached, or `watch`,
    /// which gets each row of the learning curve, breaks.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn run(
        &mut self,
        num_steps: u64,
        target: Option<Target>,
        watch: impl FnMut(&mut Self, &CurveRow) -> ControlFlow<()>,
    ) -> Result<(), TrainError> {
        learner::run(self, num_steps, target, watch)
    }

    /// Whether a run of `num_steps` steps has ended: it has taken them, and the student was
    /// evaluated after them; or its target is reached.
    #[must_use]
    pub fn is_over(&self, num_steps: u64, target: Option<Target>) -> bool {
        Learner::is_over(self, num_steps, target)
    }

    /// Evaluates the student if that is due, and returns a row of the learning curve; otherwise
    /// takes a round. `go_on` is called before each step of an evaluation, which begins again in the
    /// next call if it returns false.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn cycle(
        &mut self,
        num_steps: u64,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<CurveRow>, TrainError> {
        if self.is_due(num_steps) {
            return match self.evaluate(&mut go_on) {
                Err(TrainError::Evaluate(EvaluationError::Stopped)) => Ok(None),
                row => row.map(Some),
            };
        }
        let start = Instant::now();
        self.round()?;
        self.update()?;
        self.counters.seconds += start.elapsed().as_secs_f64();
        Ok(None)
    }

    fn is_due(&self, num_steps: u64) -> bool {
        let (interval, steps) = (self.settings.evaluation_interval, self.counters.steps);
        let evaluated = self.rows.last().map_or(0, |row| row.counters.steps);
        steps / interval > evaluated / interval || (steps >= num_steps && evaluated < steps)
    }

    /// Takes the steps of a round, labels their states, and keeps them.
    fn round(&mut self) -> Result<(), TrainError> {
        let DistillSettings { num_envs, steps_per_round, teacher_noise, .. } = self.settings;
        let round_steps = (num_envs * steps_per_round) as u64;
        let is_taught = self.counters.steps < self.settings.teacher_rounds * round_steps;
        // Below the seeds of all evaluations.
        let first_seed = seed_for(self.seed, SeedUse::Episodes, self.counters.steps) >> 24;
        let noise_seed = seed_for(self.seed, SeedUse::Exploration, self.counters.steps);
        let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
        self.envs.reset(Some(first_seed))?;
        self.teacher.reset_all();
        let mut labels = vec![0.0; num_envs * self.dims.action];
        let mut actions = labels.clone();
        let mut numbers = Vec::new();
        for step in 1..=steps_per_round {
            let batch = self.envs.last_step();
            if let Some((env_index, error)) = batch.errors().next() {
                let source = error.clone();
                return Err(self.failed(RunError::Environment { env_index, source }));
            }
            let observation: Vec<f64> =
                batch.observation().iter().map(|number| number.to_f64()).collect();
            let states = StateRows {
                observation: &observation,
                achieved_goal: batch.achieved_goal(),
                desired_goal: batch.desired_goal(),
            };
            let pictures = (self.pictures)(batch);
            self.teacher.act_all(batch, &mut labels);
            if let Some(at) = labels.iter().position(|label| !label.is_finite()) {
                let env_index = at / self.dims.action;
                return Err(self.failed(RunError::Teacher { env_index }));
            }
            self.frames.add(num_envs, pictures, &states, &labels);
            if is_taught {
                for (action, label) in actions.iter_mut().zip(&labels) {
                    let noise = teacher_noise * standard_normal(&mut rng);
                    *action = (label + noise).clamp(-1.0, 1.0);
                }
            } else {
                write(&self.inputs, self.columns.as_deref(), &states, &mut numbers);
                let student = &mut self.student;
                self.threads.install(|| student.explore(pictures, &numbers, &mut actions));
            }
            self.envs.step(&actions)?;
            self.end_episodes(step < steps_per_round)?;
        }
        self.counters.steps += round_steps;
        if is_taught {
            self.inputs = Inputs::new(&self.settings.inputs(), self.dims)?;
            self.inputs.update(&self.frames.states())?;
            self.student.measure(&self.frames.pictures);
        }
        Ok(())
    }

    /// Counts the episodes that have ended, and begins the next ones if the round goes on.
    fn end_episodes(&mut self, goes_on: bool) -> Result<(), TrainError> {
        let batch = self.envs.last_step();
        let goals = batch.achieved_goal().chunks_exact(self.dims.goal);
        let has_fallen = |goal: &[f64]| {
            let height = goal.last().copied().unwrap_or_default();
            self.settings.fallen_below.is_some_and(|limit| height < limit)
        };
        let ends = batch.terminated().iter().zip(batch.truncated());
        let mask: Vec<bool> = ends
            .zip(goals)
            .map(|((terminated, truncated), goal)| *terminated || *truncated || has_fallen(goal))
            .collect();
        for (_, success) in mask.iter().zip(batch.success()).filter(|(ended, _)| **ended) {
            self.counters.episodes += 1;
            self.recent.episodes += 1;
            self.recent.successes += u64::from(success);
        }
        if goes_on && mask.contains(&true) {
            self.envs.reset_with(&VecReset { mask: Some(&mask), ..VecReset::default() })?;
        }
        Ok(())
    }

    /// Updates the student with batches of all states.
    fn update(&mut self) -> Result<(), TrainError> {
        let DistillSettings { batch_size, updates_per_step, steps_per_round, .. } = self.settings;
        let mut batch = Frames::new(batch_size);
        let mut numbers = Vec::new();
        for _ in 0..updates_per_step * steps_per_round {
            let seed = seed_for(self.seed, SeedUse::Batches, self.counters.updates);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let len = self.frames.len();
            let rows: Vec<usize> = (0..batch_size).map(|_| rng.random_range(0..len)).collect();
            batch.gather(&self.frames, &rows);
            write(&self.inputs, self.columns.as_deref(), &batch.states(), &mut numbers);
            self.counters.updates += 1;
            let (student, number) = (&mut self.student, self.counters.updates);
            let loss = |actions: &mut [f32]| squared_error(actions, &batch.action);
            let error =
                self.threads.install(|| student.update(number, &batch.pictures, &numbers, loss));
            if !error.is_finite() {
                let diverged = RunError::Diverged { update: number, critic: 0.0, actor: error };
                return Err(self.failed(diverged));
            }
            self.recent.updates += 1;
            self.recent.error += f64::from(error);
        }
        Ok(())
    }

    /// Evaluates the student on episodes that no other evaluation uses.
    fn evaluate(&mut self, go_on: &mut dyn FnMut() -> bool) -> Result<CurveRow, TrainError> {
        let count = self.settings.evaluation_episodes;
        let seed = EVALUATION_SEED + self.counters.evaluations * count as u64;
        let Self { student, inputs, columns, threads, pictures, .. } = self;
        let mut numbers = Vec::new();
        let mut greedy = |batch: &VecStepOf<E>, actions: &mut [f32]| {
            let states = StateRows::from(batch);
            if !write(inputs, columns.as_deref(), &states, &mut numbers) {
                return actions.fill(f32::NAN);
            }
            let pictures = pictures(batch);
            threads.install(|| student.act(pictures, &numbers, actions));
        };
        let envs = &mut self.evaluation_envs;
        let evaluation = evaluate_range(envs, &mut greedy, 0..count, seed, |_| (), go_on)?;
        self.counters.evaluations += 1;
        let summary = evaluation.summary()?;
        let Recent { episodes, successes, updates, error } = std::mem::take(&mut self.recent);
        let row = CurveRow {
            counters: self.counters,
            success_rate: summary.success_rate,
            episode_return_mean: summary.episode_return_mean.value,
            final_distance_mean: summary.final_distance_mean.value,
            collected_success: (episodes > 0).then(|| successes as f64 / episodes as f64),
            losses: None,
            diagnostics: [("update/imitation_error".to_owned(), (error / updates as f64) as f32)]
                .into_iter()
                .filter(|(_, error)| error.is_finite())
                .collect(),
        };
        self.rows.push(row.clone());
        Ok(row)
    }

    fn failed(&self, error: RunError) -> TrainError {
        let (steps, checkpoint) = (self.counters.steps, self.last_checkpoint.clone());
        TrainError::Run { steps, checkpoint, source: Box::new(error) }
    }
}

impl<E: LearnEnv<Info: AsRef<Info>>> Learner for Distiller<E> {
    fn counters(&self) -> &Counters {
        &self.counters
    }

    fn rows(&self) -> &[CurveRow] {
        &self.rows
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn settings_json(&self) -> String {
        json_text(&self.settings)
    }

    fn evaluation_episodes(&self) -> usize {
        self.settings.evaluation_episodes
    }

    fn workers(&mut self) -> &mut dyn Workers {
        &mut self.workers
    }

    fn any_policy(&self, env_id: &str) -> Result<AnyPolicy, TrainedPolicyError> {
        #[cfg(feature = "render")]
        if self.sight.is_some() {
            return self.pixel_policy(env_id).map(|policy| AnyPolicy::Pixels(Box::new(policy)));
        }
        self.policy(env_id).map(AnyPolicy::State)
    }

    fn is_complete(&self, num_steps: u64) -> bool {
        self.counters.steps >= num_steps && !self.is_due(num_steps)
    }

    fn run_cycle_while(
        &mut self,
        num_steps: u64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<CurveRow>, TrainError> {
        self.cycle(num_steps, go_on)
    }

    /// It has no demonstrations.
    fn run_updates(&mut self, _: u64) -> Result<CurveRow, TrainError> {
        Err(TrainError::NothingToDraw)
    }
}

/// Replaces `numbers` with what a student sees of states: all inputs, or those in some places.
/// Returns `false` for states that are not finite, which environments return with an error alone.
pub(in crate::learn) fn write<S: Scalar>(
    inputs: &Inputs,
    columns: Option<&[usize]>,
    states: &StateRows<'_, S, f64>,
    numbers: &mut Vec<f32>,
) -> bool {
    let is_finite = inputs.write(states, numbers).is_ok();
    if let Some(columns) = columns {
        let rows = numbers.chunks_exact(inputs.dim());
        *numbers = rows.flat_map(|row| columns.iter().map(|column| row[*column])).collect();
    }
    is_finite
}
