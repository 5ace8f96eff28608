//! Demonstrations, and learning from them alone.

use std::time::Instant;

use her_relabel::HerBuffer;

use super::env::LearnEnv;
use super::replay::Replay;
use super::seeds::SeedUse;
use super::trainer::Trainer;
use crate::learn::error::TrainError;
use crate::workers::{gather_values, share_of, sum};

impl<E: LearnEnv> Trainer<E> {
    /// Calls `add` with an empty buffer, and then adds the finished episodes that it has put there:
    /// demonstrations of a script, or episodes from a file. [`update`](Self::update) learns from
    /// them alone, and [`run`](Self::run) from them and from what it collects. Algorithms can tell
    /// which transitions are [demonstrated](crate::learn::Transitions::demonstrated).
    ///
    /// # Errors
    /// Those of `add`, [`TrainError::OnPolicy`], [`TrainError::Demonstrations`] and
    /// [`TrainError::Unreadable`]. If `add` fails, no episode is added.
    pub fn add_demonstrations<T, X: From<TrainError>>(
        &mut self,
        add: impl FnOnce(&mut HerBuffer<f32>) -> Result<T, X>,
    ) -> Result<T, X> {
        self.check_off_policy()?;
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

    /// Updates the actor `num_updates` times from the contents of the buffer, and collects nothing.
    /// With [demonstrations](Self::add_demonstrations), this is offline learning, which
    /// [`imitation_weight`](crate::learn::DdpgSettings::imitation_weight) is meant for. [`run`](Self::run)
    /// continues from there.
    ///
    /// # Errors
    /// [`TrainError`]: [`NothingToDraw`](TrainError::NothingToDraw) if the buffer of any process
    /// has no finished episode, [`OnPolicy`](TrainError::OnPolicy) if the algorithm is on-policy.
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
        self.check_off_policy()?;
        self.updates.check_process()?;
        let start = Instant::now();
        if sum(&mut *self.workers, u64::from(self.replay.buffer.is_empty()))? > 0 {
            return Err(TrainError::NothingToDraw);
        }
        self.see_demonstrations()?;
        self.counters.seconds += start.elapsed().as_secs_f64();
        self.update_while(num_updates, &mut || true)?;
        Ok(())
    }

    /// Checks that the algorithm can learn from steps that are not its own.
    fn check_off_policy(&self) -> Result<(), TrainError> {
        let algorithm = &self.updates.algorithm;
        match algorithm.is_on_policy() {
            true => Err(TrainError::OnPolicy { algorithm: algorithm.name().to_owned() }),
            false => Ok(()),
        }
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
                self.replay.seen(rows, (SeedUse::DemonstratedNormalizers, number), part as u64);
            let seen = seen.map_err(|error| self.failed(error))?;
            for seen in gather_values(&mut *self.workers, &seen)?.iter().flatten() {
                self.replay.inputs.merge(seen)?;
            }
        }
        Ok(())
    }
}
