//! The parts of a run: collect, update, evaluate.

use std::time::Instant;

use fetch_env::GoalObservation;
use fetch_env::vec_env::{VecStep, VecStepOf};
use her_relabel::Scalar;
use serde::{Deserialize, Serialize};

use super::algorithm::Losses;
use super::curve::CurveRow;
use super::env::LearnEnv;
use super::error::{RunError, TrainError};
use super::inputs::Inputs;
use super::seeds::Purpose;
use super::trainer::Trainer;
use crate::evaluate::{Episode, evaluate_range};
use crate::policy::VecPolicy;
use crate::spread::gather_episodes;
use crate::workers::{agree, gather_values, share, share_of, sum};

/// The seed of the first evaluation's first episode. The seeds of training are below 2^40, except
/// those of far starts.
const EVALUATION_SEED: u64 = 1 << 41;

/// The number of updates between two questions whether to go on.
const UPDATES_AT_ONCE: u64 = 10;

/// What a process has collected in a cycle.
#[derive(Serialize, Deserialize)]
struct CollectedShare {
    steps: u64,
    episodes: u64,
    discarded_episodes: u64,
    /// The number of episodes that ended, including those that the buffer does not keep.
    ended: u64,
    successes: u64,
    /// The statistics of what was collected.
    seen: Option<Inputs>,
    /// Whether the process has transitions to draw.
    can_draw: bool,
}

impl<E: LearnEnv> Trainer<E> {
    /// Updates the actor `num_updates` times from the contents of the buffer, and collects nothing.
    /// With [demonstrations](Self::add_demonstrations), this is offline learning, which
    /// [`imitation_weight`](super::DdpgSettings::imitation_weight) is meant for. [`run`](Self::run)
    /// continues from there.
    ///
    /// # Errors
    /// [`TrainError`]: [`NothingToDraw`](TrainError::NothingToDraw) if the buffer of any process
    /// has no finished episode.
    ///
    /// ```
    /// use baselines::learn::{AlgorithmSettings, DdpgSettings, TrainSettings, Trainer};
    /// use baselines::{ScriptedPolicy, collect};
    /// use fetch_env::{Task, make_kinematic};
    ///
    /// let mut settings = TrainSettings::default();
    /// # settings.schedule.evaluation_episodes = 5;
    /// # let hidden = vec![32, 32];
    /// settings.algorithm = AlgorithmSettings::Ddpg(DdpgSettings {
    ///     imitation_weight: 100.0,
    /// #   hidden,
    ///     ..DdpgSettings::default()
    /// });
    /// let make = || Ok(make_kinematic("FetchReach-v4")?);
    /// let mut trainer = Trainer::new(make, settings, 0, 2)?;
    /// let mut script = ScriptedPolicy::new(Task::Reach);
    /// trainer.add_demonstrations(|buffer| -> Result<_, Box<dyn std::error::Error>> {
    ///     Ok(collect(&mut make()?, &mut script, 20, 0, buffer, 0, |_| ())?)
    /// })?;
    /// trainer.update(100)?;
    /// println!("{:?} without a step", trainer.evaluate()?.success_rate);
    /// # assert_eq!((trainer.counters().steps, trainer.counters().updates), (0, 100));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn update(&mut self, num_updates: u64) -> Result<(), TrainError> {
        self.learner.check_process()?;
        let start = Instant::now();
        if sum(&mut *self.workers, u64::from(self.replay.buffer.is_empty()))? > 0 {
            return Err(TrainError::NothingToDraw);
        }
        self.see_demonstrations()?;
        self.learn(num_updates, &mut || true)?;
        self.counters.seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Updates the normalizers with demonstrations that they have not taken in.
    fn see_demonstrations(&mut self) -> Result<(), TrainError> {
        let unseen = std::mem::take(&mut self.replay.demonstrated.unseen);
        // The buffer may have dropped some already.
        let num_rows = unseen.min(self.replay.buffer.len() as u64);
        // Each symmetry gets its share of them.
        let parts = self.replay.num_symmetries().max(1);
        for part in 0..parts {
            let rows = share_of(part, parts, num_rows as usize).len();
            let number = self.counters.updates + part as u64;
            let seen =
                self.replay.seen(rows, (Purpose::DemonstratedNormalizers, number), part as u64);
            let seen = seen.map_err(|error| self.failed(error))?;
            for seen in gather_values(&mut *self.workers, &seen)?.iter().flatten() {
                self.replay.inputs.merge(seen)?;
            }
        }
        Ok(())
    }

    /// Collects this process's share of steps, and exchanges what all have collected. Returns
    /// whether all have transitions to draw.
    pub(super) fn collect(&mut self) -> Result<bool, TrainError> {
        if self.counters.steps == 0 {
            self.begin_episodes()?;
        }
        let num_steps = self.settings.schedule.steps_per_cycle;
        let has_learned = self.counters.updates > 0;
        let actor = has_learned.then_some(&mut *self.learner.algorithm);
        let (inputs, buffer) = (&self.replay.inputs, &mut self.replay.buffer);
        let own = self
            .collecting
            .collect(num_steps, actor, inputs, buffer)
            .map_err(|error| self.failed(error.into()))?;
        let num_rows = own.collected.recorded_steps;
        let (first_failure, first_stuck) = (own.collected.first_failure, own.collected.first_stuck);
        let steps = self.counters.steps + num_rows as u64;
        let steps_of_cycle = (num_steps * self.collecting.collector.envs().num_envs()) as u64;
        let cycle = steps.div_ceil(steps_of_cycle * self.workers.size() as u64);
        let seen = self.replay.seen(num_rows, (Purpose::Normalizers, steps), cycle);
        let own = CollectedShare {
            steps: num_rows as u64,
            episodes: own.collected.finished_episodes as u64,
            discarded_episodes: own.collected.discarded_episodes as u64,
            ended: own.ended,
            successes: own.successes,
            seen: seen.map_err(|error| self.failed(error))?,
            can_draw: !self.replay.buffer.is_empty(),
        };
        let mut can_draw = true;
        for share in gather_values(&mut *self.workers, &own)? {
            self.counters.steps += share.steps;
            self.counters.episodes += share.episodes;
            self.counters.discarded_episodes += share.discarded_episodes;
            self.recent.add_episodes(share.ended, share.successes);
            if let Some(seen) = &share.seen {
                self.replay.inputs.merge(seen)?;
            }
            can_draw &= share.can_draw;
        }
        match (num_rows, first_failure, first_stuck) {
            (0, Some((env_index, source)), _) => {
                Err(self.failed(RunError::AllFailed { env_index, source }))
            }
            (_, _, Some((env_index, source))) => {
                Err(self.failed(RunError::Stuck { env_index, source }))
            }
            _ => Ok(can_draw),
        }
    }

    /// Begins an episode in each environment.
    pub(super) fn begin_episodes(&mut self) -> Result<(), TrainError> {
        self.collecting
            .begin_episodes(self.counters.steps, &mut self.replay.buffer)
            .map_err(|error| self.failed(error.into()))
    }

    fn failed(&self, error: RunError) -> TrainError {
        let (steps, checkpoint) = (self.counters.steps, self.last_checkpoint.clone());
        TrainError::Run { steps, checkpoint, source: Box::new(error) }
    }

    /// Draws and updates, up to `num_updates` times while `go_on` returns true. Returns the number
    /// of updates that are left.
    pub(super) fn learn(
        &mut self,
        num_updates: u64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<u64, TrainError> {
        let Self { replay, learner, workers, counters, recent, .. } = self;
        let end = counters.updates.saturating_add(num_updates);
        let mut goes_on = true;
        while goes_on && counters.updates < end {
            let first = counters.updates;
            let numbers = first..end.min(first.saturating_add(UPDATES_AT_ONCE));
            let learned = learner.update(numbers, replay, &mut **workers, |losses: Losses| {
                counters.updates += 1;
                if !losses.are_finite() {
                    let (update, Losses { critic, actor, .. }) = (counters.updates, losses);
                    return Err(RunError::Diverged { update, critic, actor });
                }
                recent.add(losses);
                Ok(())
            });
            if let Err(error) = learned {
                return Err(self.failed(error));
            }
            goes_on = go_on();
        }
        Ok(end - counters.updates)
    }

    /// Evaluates the greedy policy, as [`policy`](Self::policy) returns it, on episodes that no
    /// other evaluation uses.
    ///
    /// # Errors
    /// [`TrainError::Policy`], [`TrainError::Evaluate`], [`TrainError::Forked`], and
    /// [`TrainError::Run`] with [`RunError::EvaluationNotFinite`].
    pub fn evaluate(&mut self) -> Result<CurveRow, TrainError> {
        self.evaluate_while(&mut || true)
    }

    /// Evaluates as [`evaluate`](Self::evaluate) does while `go_on` returns true, and otherwise
    /// fails with [`EvaluationError::Stopped`](crate::EvaluationError::Stopped).
    pub(super) fn evaluate_while(
        &mut self,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<CurveRow, TrainError> {
        self.learner.check_process()?;
        let count = self.settings.schedule.evaluation_episodes;
        let seed = EVALUATION_SEED + self.counters.evaluations * count as u64;
        // The name matters only in a file.
        let mut policy = self.policy("")?;
        let mut first_bad = None;
        let mut greedy = |batch: &VecStepOf<E>, actions: &mut [f32]| {
            first_bad = first_bad.or_else(|| first_not_finite(batch));
            policy.act_all(batch, actions);
        };
        let own = share(&*self.workers, count);
        let envs = &mut self.evaluation_envs;
        let evaluation = evaluate_range(envs, &mut greedy, own, seed, |_| (), go_on);
        // The cause of what may follow: the policy cannot act on such an observation.
        if let Some(env_index) = first_bad {
            let what = "an observation";
            return Err(self.failed(RunError::EvaluationNotFinite { env_index, what }));
        }
        let evaluation = evaluation?;
        let is_bad = |episode: &Episode| !episode.episode_return.is_finite();
        if let Some(row) = evaluation.episodes.iter().position(is_bad) {
            let (env_index, what) = (row % self.evaluation_envs.num_envs(), "a reward");
            return Err(self.failed(RunError::EvaluationNotFinite { env_index, what }));
        }
        self.counters.evaluations += 1;
        let summary = gather_episodes(&mut *self.workers, &evaluation)?.summary()?;
        let recent = std::mem::take(&mut self.recent);
        let row = CurveRow {
            counters: self.counters,
            success_rate: summary.success_rate,
            episode_return_mean: summary.episode_return_mean.value,
            final_distance_mean: summary.final_distance_mean.value,
            collected_success: recent.success_rate(),
            losses: recent.losses(),
        };
        self.rows.push(row);
        Ok(row)
    }

    /// Checks that all processes have the same weights.
    pub(super) fn check_weights(&mut self) -> Result<(), TrainError> {
        if self.workers.size() == 1 {
            return Ok(());
        }
        let checksum = format!("{:016x}", self.learner.checksum());
        Ok(agree(&mut *self.workers, &[("checksum of its weights", checksum)])?)
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
