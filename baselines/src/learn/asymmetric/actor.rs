//! The actor that sees pictures.

use std::io::{self, Write};

use fetch_env::vec_env::{BatchObservation, VecStep};
use fetch_env::{GoalObservation, PictureRows};
use goal_reward::GoalReward;
use her_relabel::{Dims, NormalizerError, Scalar, StateRows};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::ThreadPool;

use super::memory::{Goals, Memory};
use crate::learn::algorithm::interface::Algorithm;
use crate::learn::algorithm::state_file::StateFault;
use crate::learn::distill::frames::Frames;
use crate::learn::distill::rounds::write;
use crate::learn::distill::student::{Student, StudentNetwork};
use crate::learn::error::RunError;
use crate::learn::run::eyes::{Eyes, EyesState};
use crate::learn::run::inputs::Inputs;
use crate::learn::run::seeds::{SeedUse, seed_for};
use crate::learn::settings::pixels::PixelActorSettings;
use crate::learn::settings::train::InputSettings;
use crate::trained::{PixelPolicy, PolicyHeader, Sight, TrainedPolicyError};

/// An actor that sees pictures, and learns actions of the highest value from a critic that sees the
/// state.
pub(super) struct PixelActor {
    pub(super) settings: PixelActorSettings,
    pub(super) sight: Sight,
    pub(super) columns: Vec<usize>,
    /// The statistics of the states before the first update.
    pub(super) inputs: Inputs,
    pub(super) student: Student,
    pub(super) memory: Memory,
    /// The batch that the next decision sees, after a resume, instead of the one that it gets.
    pub(super) resumed: Option<Memory>,
    pub(super) goals: Goals,
    pub(super) dims: Dims,
    pub(super) threads: ThreadPool,
    pub(super) seed: u64,
    pub(super) num_updates: u64,
}

impl PixelActor {
    /// Returns inputs without statistics. The achieved goal may be where the object is, so they
    /// have nothing of it.
    pub(super) fn new_inputs(dims: Dims) -> Result<Inputs, NormalizerError> {
        Inputs::new(&InputSettings { min_std: 0.01, ..InputSettings::default() }, dims)
    }

    /// Takes a step on a batch: up the values of the actions for its pictures. `inputs` are what the
    /// critic sees of it. Returns the loss.
    fn step(
        &mut self,
        batch: &Frames,
        numbers: &[f32],
        inputs: &[f32],
        critic: &mut dyn Algorithm,
    ) -> f32 {
        let action_l2 = self.settings.pixel_action_l2;
        let loss = |actions: &mut [f32]| loss(actions, inputs, action_l2, critic);
        self.student.update(self.num_updates, &batch.pictures, numbers, loss)
    }
}

/// Returns the mean square of actions times `action_l2`, minus their mean value, and replaces them by
/// the derivatives.
fn loss(actions: &mut [f32], inputs: &[f32], action_l2: f32, critic: &mut dyn Algorithm) -> f32 {
    let share = action_l2 / actions.len() as f32;
    let squares: f32 = actions.iter().map(|action| action * action).sum();
    let mut slopes = actions.to_vec();
    // A trainer with pixels has checked that there is such a critic.
    let value = critic.value_slopes(inputs, &mut slopes).unwrap_or(f32::NAN);
    for (action, slope) in actions.iter_mut().zip(slopes) {
        *action = 2.0 * share * *action - slope;
    }
    share * squares - value
}

impl<O, I> Eyes<O, I> for PixelActor
where
    O: GoalObservation<Element: Scalar> + BatchObservation<Rows: AsRef<PictureRows>>,
{
    fn see(&mut self, batch: &VecStep<O, I>) {
        match self.resumed.take() {
            Some(resumed) => self.memory.append(&resumed),
            None => self.memory.add(batch),
        }
    }

    fn explore(&mut self, noise: &[f32], actions: &mut [f32]) {
        // Its first weights mean nothing.
        if self.num_updates == 0 {
            return;
        }
        let (mut own, mut numbers) = (vec![0.0; actions.len()], Vec::new());
        let (pictures, states) = self.memory.newest();
        write(&self.inputs, Some(&self.columns), &states, &mut numbers);
        self.threads.install(|| self.student.act(pictures, &numbers, &mut own));
        let num_envs = actions.len() / self.dims.action;
        let others = (num_envs as f64 * (1.0 - self.settings.acting_share)).round() as usize;
        let elements = actions.iter_mut().zip(own).zip(noise).skip(others * self.dims.action);
        // That it has diverged is the error of its next update.
        for ((action, own), noise) in elements.filter(|((_, own), _)| own.is_finite()) {
            *action = noise.mul_add(self.settings.pixel_noise, own).clamp(-1.0, 1.0);
        }
    }

    fn act(&mut self, batch: &VecStep<O, I>, actions: &mut [f32]) {
        let mut numbers = Vec::new();
        if !write(&self.inputs, Some(&self.columns), &StateRows::from(batch), &mut numbers) {
            return actions.fill(f32::NAN);
        }
        let (student, pictures) = (&mut self.student, batch.pixels());
        self.threads.install(|| student.act(pictures, &numbers, actions));
    }

    fn update(
        &mut self,
        number: u64,
        algorithm: &mut dyn Algorithm,
        inputs: &Inputs,
        reward: &dyn GoalReward,
    ) -> Result<(), RunError> {
        let PixelActorSettings { critic_updates, pixel_batch_size: batch_size, .. } = self.settings;
        if !(number + 1).is_multiple_of(critic_updates) || self.memory.frames.len() == 0 {
            return Ok(());
        }
        if self.num_updates == 0 {
            self.inputs = Self::new_inputs(self.dims)?;
            self.inputs.update(&self.memory.frames.states())?;
            self.student.measure(&self.memory.frames.pictures);
        }
        let seed = seed_for(self.seed, SeedUse::PixelBatches, self.num_updates);
        let mut batch = Frames::new(batch_size);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.memory.draw(self.goals, batch_size, reward, &mut rng, &mut batch);
        let (mut numbers, mut whole) = (Vec::new(), Vec::new());
        write(&self.inputs, Some(&self.columns), &batch.states(), &mut numbers);
        write(inputs, None, &batch.states(), &mut whole);
        self.num_updates += 1;
        let actor = self.step(&batch, &numbers, &whole, algorithm);
        if actor.is_finite() {
            Ok(())
        } else {
            Err(RunError::Diverged { update: number + 1, critic: 0.0, actor })
        }
    }

    fn state(&mut self) -> Result<(EyesState, Vec<u8>), String> {
        let networks = self.student.write()?;
        let state = EyesState {
            sight: self.sight.clone(),
            inputs: self.inputs.clone(),
            num_updates: self.num_updates,
            frames: self.memory.frames.total,
        };
        Ok((state, networks))
    }

    fn write_memory(&self, batch: Option<&VecStep<O, I>>, to: &mut dyn Write) -> io::Result<()> {
        self.memory.write_to(to)?;
        match (&self.resumed, batch) {
            (Some(resumed), _) => resumed.write_to(to),
            (None, Some(batch)) => Memory::of(batch).write_to(to),
            (None, None) => Ok(()),
        }
    }

    fn restore(
        &mut self,
        state: EyesState,
        networks: &[u8],
        memory: &[u8],
    ) -> Result<(), StateFault> {
        let lens = |inputs: &Inputs| (inputs.observation.dim(), inputs.goal.dim());
        if lens(&state.inputs) != lens(&self.inputs) {
            return Err(StateFault::Foreign("its actor sees other numbers".to_owned()));
        }
        self.student.restore(networks)?;
        let (dims, picture_len) = (Dims { action: 0, ..self.dims }, self.student.picture_len());
        let num_envs = self.memory.num_envs;
        let mut resumed = Memory::new(num_envs, num_envs);
        let rest = self.memory.read(state.frames, picture_len, dims, memory).and_then(|rest| {
            // There is nothing to see before the first step.
            let next = if rest.is_empty() { 0 } else { num_envs as u64 };
            resumed.read(next, picture_len, dims, rest)
        });
        if rest.is_none_or(|rest| !rest.is_empty()) {
            return Err(StateFault::Damaged("it has states of another length".to_owned()));
        }
        self.resumed = (resumed.frames.total > 0).then_some(resumed);
        self.inputs = state.inputs;
        self.num_updates = state.num_updates;
        Ok(())
    }

    fn policy(&self, header: PolicyHeader) -> Result<PixelPolicy, TrainedPolicyError> {
        let StudentNetwork::Pixels(network) = &self.student.averaged else {
            let reason = "the actor sees no pictures".to_owned();
            return Err(TrainedPolicyError::Sight { reason });
        };
        let header = PolicyHeader {
            inputs: self.inputs.parts(),
            observation_normalizer: Some(self.inputs.observation.clone()),
            goal_normalizer: Some(self.inputs.goal.clone()),
            ..header
        };
        PixelPolicy::new(header, self.sight.clone(), network.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::loss;
    use crate::learn::algorithm::ddpg::Ddpg;
    use crate::learn::algorithm::interface::{Algorithm, AlgorithmInit};
    use crate::learn::settings::algorithm::DdpgSettings;

    #[test]
    fn the_slopes_of_actions_agree_with_differences_of_the_loss() {
        let settings = DdpgSettings { hidden: vec![9, 7], ..DdpgSettings::default() };
        let reward_bounds = -1.0..=0.0;
        let init = AlgorithmInit { num_inputs: 3, num_actions: 2, reward_bounds, seed: 5, rank: 0 };
        let mut critic = Ddpg::new(settings, init).expect("the settings are in their ranges");
        let inputs = [0.3, -0.8, 0.5, -0.2, 0.9, 0.1];
        let actions = [0.7, -0.4, -0.6, 0.2];
        let mut slopes = actions;
        let value = loss(&mut slopes, &inputs, 0.0, &mut critic);
        assert_eq!(Some(-value), critic.value_slopes(&inputs, &mut actions.clone()));
        slopes = actions;
        loss(&mut slopes, &inputs, 0.3, &mut critic);
        for (index, slope) in slopes.into_iter().enumerate() {
            let [high, low] = [1e-2, -1e-2].map(|step| {
                let mut moved = actions;
                moved[index] += step;
                loss(&mut moved, &inputs, 0.3, &mut critic)
            });
            let difference = (high - low) / 2e-2;
            assert!((slope - difference).abs() < 1e-3, "{index}: {slope} {difference}");
            assert!(slope != 0.0);
        }
    }
}
