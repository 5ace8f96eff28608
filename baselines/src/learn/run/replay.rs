//! The part of a run that holds transitions and draws them.

use std::iter::repeat_n;
use std::num::NonZeroUsize;
use std::ops::RangeInclusive;

use fetch_env::vec_env::VecEnvError;
use goal_reward::{GoalReward, Symmetry};
use her_relabel::{
    Batch, ColumnsMut, GoalMixture, GoalNoise, GoalPart, GoalStrategy, HerBuffer,
    MotionlessEpisodes, NStep, Sampler, StateRows, Transforms, UnitInterval,
};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::demonstrated::Demonstrated;
use super::env::LearnEnv;
use super::inputs::{Inputs, check_left_out};
use super::last_cycle::LastCycle;
use super::seeds::{SeedUse, seed_for};
use super::stricter::Stricter;
use crate::collect::buffer_config;
use crate::learn::algorithm::interface::{Algorithm, Transitions};
use crate::learn::error::{RunError, TrainError};
use crate::learn::settings::train::{InputSettings, ReplaySettings};

/// The buffer of a run, and how batches are drawn from it.
pub(crate) struct Replay<E: LearnEnv> {
    /// An environment that has the reward as a function of goals.
    pub(crate) template: E,
    pub(crate) buffer: HerBuffer<f32>,
    pub(crate) inputs: Inputs,
    pub(crate) demonstrated: Demonstrated,
    /// What an on-policy algorithm learns from, instead of draws from the buffer.
    pub(super) last_cycle: Option<LastCycle>,
    /// The symmetries by which some rows are mirrored; batches take them in turn.
    symmetries: Vec<Symmetry>,
    sampler: Sampler,
    n_step_updates: Option<u64>,
    settings: InputSettings,
    distance_factor: f64,
    /// The seed of this process.
    pub(super) seed: u64,
    /// The last batch; its vectors are reused.
    batch: Batch<f32>,
    input: Vec<f32>,
    next_input: Vec<f32>,
    /// What the actor sees of both, where it sees noise.
    noisy: [Vec<f32>; 2],
    is_demonstrated: Vec<bool>,
}

impl<E: LearnEnv> Replay<E> {
    /// Prepares for transitions of environments like `template`, for no algorithm until
    /// [`set_algorithm`](Self::set_algorithm).
    pub(super) fn new(
        template: E,
        num_envs: usize,
        replay: &ReplaySettings,
        inputs: &InputSettings,
        seed: u64,
    ) -> Result<Self, TrainError> {
        let config = buffer_config(replay.capacity, &template).map_err(VecEnvError::from)?;
        let mut config = config.with_num_envs(num_envs);
        if let Some(still) = still_episodes(replay)? {
            let seed = seed_for(seed, SeedUse::MotionlessEpisodes, 0);
            config = config.with_motionless_episodes(still.with_seed(seed));
        }
        let dims = config.dims();
        check_left_out(&inputs.left_out, dims)?;
        let sampler = sampler(replay)?;
        Ok(Self {
            demonstrated: Demonstrated::default(),
            last_cycle: None,
            inputs: Inputs::new(inputs, dims)?,
            symmetries: symmetries(&template, replay)?,
            template,
            buffer: HerBuffer::new(config)?,
            sampler,
            n_step_updates: replay.n_step_updates,
            settings: inputs.clone(),
            distance_factor: replay.distance_factor,
            seed,
            batch: Batch::new(),
            input: Vec::new(),
            next_input: Vec::new(),
            noisy: Default::default(),
            is_demonstrated: Vec::new(),
        })
    }

    /// Returns the number of symmetries by which rows are mirrored.
    pub(super) const fn num_symmetries(&self) -> usize {
        self.symmetries.len()
    }

    /// Sets what the algorithm determines: the discount of a step, and what it learns from.
    pub(super) fn set_algorithm(&mut self, algorithm: &dyn Algorithm) -> Result<(), TrainError> {
        self.sampler = self.sampler.with_discount(share("gamma", algorithm.gamma())?);
        let config = self.buffer.config();
        let last_cycle =
            || LastCycle::new(config.num_envs(), config.dims(), algorithm.gamma() as f32);
        self.last_cycle = algorithm.is_on_policy().then(last_cycle);
        Ok(())
    }

    /// Whether there is something to learn from.
    pub(super) fn can_draw(&self) -> bool {
        self.last_cycle.as_ref().map_or(!self.buffer.is_empty(), |steps| !steps.is_empty())
    }

    /// Returns the statistics of `num_rows` drawn transitions, as many as were added since the last
    /// call, with relabeled goals, as the authors do; `None` if there are none, or the inputs take
    /// in no more. `draw` determines the draw, and the symmetries take turns by the number `turn`.
    pub(super) fn seen(
        &self,
        num_rows: usize,
        draw: (SeedUse, u64),
        turn: u64,
    ) -> Result<Option<Inputs>, RunError> {
        if self.inputs.are_fixed() || self.buffer.is_empty() || num_rows == 0 {
            return Ok(None);
        }
        let (seed_use, number) = draw;
        let seed = seed_for(self.seed, seed_use, number);
        let sampler = self.sampler.with_batch_size(num_rows);
        let mut batch = Batch::<f32>::new();
        let symmetry = symmetry_of(&self.symmetries, turn);
        let transforms = Transforms { symmetry, ..Transforms::default() };
        let (reward, columns) = (self.reward(), ColumnsMut::default());
        sampler.sample_into(&self.buffer, &reward, seed, &mut batch, transforms, columns)?;
        let mut seen = Inputs::new(&self.settings, self.buffer.config().dims())?;
        seen.update(&StateRows {
            observation: batch.observation(),
            achieved_goal: batch.achieved_goal(),
            desired_goal: batch.desired_goal(),
        })?;
        Ok(Some(seen))
    }

    /// Returns the reward of training.
    pub(super) fn reward(&self) -> Stricter<'_, E::GoalReward> {
        Stricter { reward: self.template.goal_reward(), distance_factor: self.distance_factor }
    }

    /// Returns the sampler of update `number`, counted from 0.
    pub(super) fn sampler(&self, number: u64) -> Sampler {
        if self.n_step_updates.is_none_or(|updates| number < updates) {
            return self.sampler;
        }
        let discount = self.sampler.discount();
        self.sampler.with_n_step(discount.map(|gamma| NStep::new(NonZeroUsize::MIN, gamma)))
    }

    /// Draws the batch of update `number`, counted from 0; for an on-policy algorithm it is the last
    /// cycle.
    pub(super) fn draw(&mut self, number: u64) -> Result<Transitions<'_>, RunError> {
        let sampler = self.sampler(number);
        let Self { template, buffer, inputs, symmetries, distance_factor, .. } = self;
        let Self { last_cycle, batch, input, next_input, noisy, .. } = self;
        if let Some(last_cycle) = last_cycle {
            let batch = last_cycle.transitions();
            check_rewards(batch.reward, template.goal_reward().bounds())?;
            return Ok(batch);
        }
        let sampler = sampler.with_joined_goal(inputs.joined_goal());
        let seed = seed_for(self.seed, SeedUse::Batches, number);
        let len = sampler.batch_size() * inputs.dim();
        input.resize(len, 0.0);
        next_input.resize(len, 0.0);
        let columns = ColumnsMut { input, next_input, ..ColumnsMut::default() };
        let reward = Stricter { reward: template.goal_reward(), distance_factor: *distance_factor };
        let transforms = Transforms {
            normalizers: inputs.normalizers(),
            symmetry: symmetry_of(symmetries, number),
        };
        sampler.sample_into(buffer, &reward, seed, batch, transforms, columns)?;
        inputs.leave_out(input);
        inputs.leave_out(next_input);
        if inputs.have_noise() {
            let seed = seed_for(self.seed, SeedUse::ObservationNoise, number);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            for (noisy, exact) in noisy.iter_mut().zip([&*input, &*next_input]) {
                noisy.clone_from(exact);
                inputs.add_noise(noisy, &mut rng);
            }
        }
        check_rewards(batch.reward(), sum_bounds(reward.bounds(), sampler.n_step()))?;
        self.is_demonstrated.clear();
        let demonstrated = batch.transition().iter().map(|id| self.demonstrated.contains(*id));
        self.is_demonstrated.extend(demonstrated);
        Ok(Transitions {
            len: batch.len(),
            input,
            actor_input: if inputs.have_noise() { &noisy[0] } else { input },
            action: batch.action(),
            reward: batch.reward(),
            discount: batch.discount(),
            next_input,
            next_actor_input: if inputs.have_noise() { &noisy[1] } else { next_input },
            demonstrated: &self.is_demonstrated,
            ..Transitions::default()
        })
    }
}

/// Checks that rewards are within their bounds.
fn check_rewards(rewards: &[f32], bounds: RangeInclusive<f64>) -> Result<(), RunError> {
    let (low, high) = bounds.into_inner();
    let is_outside = |reward: &&f32| !(low as f32..=high as f32).contains(*reward);
    match rewards.iter().find(is_outside) {
        Some(value) => Err(RunError::RewardOutside { value: f64::from(*value), low, high }),
        None => Ok(()),
    }
}

/// Returns the range of the sums of the rewards of a window, for rewards within `bounds`.
fn sum_bounds(bounds: RangeInclusive<f64>, n_step: Option<NStep>) -> RangeInclusive<f64> {
    let (low, high) = bounds.into_inner();
    let sums = |reward: f64| {
        let of = |reward: f64| {
            n_step.map_or(reward, |n_step| n_step.sum(repeat_n(reward, n_step.steps().get())).0)
        };
        // A window can be as short as one step, and stored rewards are rounded before the sum.
        [reward, of(reward), of(f64::from(reward as f32))]
    };
    let (lowest, highest) = (sums(low), sums(high));
    lowest.into_iter().fold(low, f64::min)..=highest.into_iter().fold(high, f64::max)
}

/// Returns the sampler of the settings, whose windows have no discount yet.
fn sampler(settings: &ReplaySettings) -> Result<Sampler, TrainError> {
    let ReplaySettings { batch_size, future_k, past_goal_weight, keep_already_achieved, .. } =
        *settings;
    let noise = share("goal_noise_share", settings.goal_noise_share)?;
    let noise = GoalNoise::new(settings.goal_noise, noise);
    if future_k == 0.0 && past_goal_weight > 0.0 {
        return Err(TrainError::Setting {
            name: "past_goal_weight",
            value: past_goal_weight.to_string(),
            expected: "choose 0, because with a future_k of 0 no transition gets another goal",
        });
    }
    let goals = GoalMixture::new(&[
        GoalPart::new(settings.goal_strategy.into(), 1.0),
        GoalPart::new(GoalStrategy::PastDesired, past_goal_weight),
    ]);
    let goals = goals.map_err(|_| TrainError::Setting {
        name: "past_goal_weight",
        value: past_goal_weight.to_string(),
        expected: "choose a finite number of at least 0",
    })?;
    let ratio = share("future_k", future_k / (future_k + 1.0))?;
    let n_step = NonZeroUsize::new(settings.n_step).unwrap_or(NonZeroUsize::MIN);
    Ok(Sampler::new(batch_size, GoalStrategy::Future, ratio)
        .with_n_step(NStep::new(n_step, UnitInterval::ONE))
        .with_goals(goals)
        .with_keep_already_achieved(share("keep_already_achieved", keep_already_achieved)?)
        .with_recomputed_rewards(settings.distance_factor != 1.0)
        .with_mirrored(share("mirrored", settings.mirrored)?)
        .with_goal_noise((noise.share() != UnitInterval::ZERO).then_some(noise)))
}

/// Returns the symmetries by which transitions are mirrored; empty if none are.
fn symmetries<E: LearnEnv>(
    template: &E,
    settings: &ReplaySettings,
) -> Result<Vec<Symmetry>, TrainError> {
    if settings.mirrored == 0.0 {
        return Ok(Vec::new());
    }
    let symmetries = template.symmetries();
    if symmetries.is_empty() {
        return Err(TrainError::Setting {
            name: "mirrored",
            value: settings.mirrored.to_string(),
            expected: "choose 0, because the environment has no GoalEnv::symmetries, or give it \
                 some",
        });
    }
    Ok(symmetries)
}

/// Returns the symmetry of batch `number`; they take turns.
fn symmetry_of(symmetries: &[Symmetry], number: u64) -> Option<&Symmetry> {
    let count = symmetries.len() as u64;
    symmetries.get(usize::try_from(number.checked_rem(count)?).ok()?)
}

/// Returns which still episodes are left out; `None` if none are.
fn still_episodes(settings: &ReplaySettings) -> Result<Option<MotionlessEpisodes>, TrainError> {
    let kept = share("keep_motionless", settings.keep_motionless)?;
    let still = MotionlessEpisodes::new(settings.still_distance, kept);
    Ok((kept != UnitInterval::ONE).then_some(still))
}

/// Checks a share.
fn share(name: &'static str, value: f64) -> Result<UnitInterval, TrainError> {
    UnitInterval::new(value).map_err(|_| TrainError::Setting {
        name,
        value: value.to_string(),
        expected: "choose a number from 0 to 1",
    })
}
