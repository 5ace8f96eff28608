//! The policies of the published sets.

use fetch_env::{BoxSpace, FetchObservation, Space};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::error::DatasetError;
use super::writer::{DatasetWriter, record_for};
use crate::evaluate::{Episode, Evaluation, seeds};
use crate::normal::standard_normal;
use crate::on_mujoco::OnMujoco;
use crate::policy::{Policy, PolicyError, RandomPolicy};
use crate::scripted::ScriptedPolicy;
use crate::trained::{TrainedPolicy, TrainedPolicyError};

/// The kind of policy that acts in a set of episodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SetKind {
    /// A [`RandomPolicy`].
    Random,
    /// A [`ScriptedPolicy`].
    Scripted,
    /// The [trained policy](TrainedPolicy::shipped) that comes with the crate.
    Expert,
    /// The same, exploring: an action is random with probability 0.3, and otherwise Gaussian noise
    /// with the standard deviation 0.2 is added to each of its elements.
    ///
    /// Source of both numbers: Plappert et al., *Multi-goal reinforcement learning*, 2018.
    ExpertNoisy,
    /// These four in turn: the seed of an episode, modulo 4, decides which one acts.
    Mixed,
}

/// Standard deviation of the noise of [`SetKind::ExpertNoisy`].
const NOISE: f32 = 0.2;
/// Share of its actions that are random.
const RANDOM_SHARE: f32 = 0.3;

impl SetKind {
    /// All sets.
    pub const ALL: [Self; 5] =
        [Self::Random, Self::Scripted, Self::Expert, Self::ExpertNoisy, Self::Mixed];

    /// Returns the name of the set, as it appears in a data set's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Scripted => "scripted",
            Self::Expert => "expert",
            Self::ExpertNoisy => "expert-noisy",
            Self::Mixed => "mixed",
        }
    }

    /// Returns the kind that acts in the episode with this seed.
    const fn of_episode(self, seed: u64) -> Self {
        match (self, seed % 4) {
            (Self::Mixed, 0) => Self::Random,
            (Self::Mixed, 1) => Self::Scripted,
            (Self::Mixed, 2) => Self::ExpertNoisy,
            (Self::Mixed, _) => Self::Expert,
            (other, _) => other,
        }
    }
}

/// Runs the episodes of a set, reset with the seeds `first_seed`, `first_seed + 1`, ..., writes
/// each with all writers and calls `progress` after it. It does not finish the writers.
///
/// # Errors
/// [`DatasetError`].
pub fn write_set(
    env: &mut impl OnMujoco,
    policy: &mut SetPolicy,
    count: usize,
    first_seed: u64,
    writers: &mut [Box<dyn DatasetWriter>],
    mut progress: impl FnMut(&Episode),
) -> Result<Evaluation, DatasetError> {
    let mut record = record_for(writers);
    let mut episodes = Vec::new();
    for seed in seeds(first_seed).take(count) {
        policy.begin(seed);
        let episode = record.record(env, policy, seed)?;
        writers.iter_mut().try_for_each(|writer| writer.write(&record))?;
        progress(&episode);
        episodes.push(episode);
    }
    Ok(Evaluation { episodes })
}

/// The policy of a set, whose actions in an episode depend on the seed of that episode alone.
#[derive(Debug)]
pub struct SetPolicy {
    kind: SetKind,
    /// The kind that acts in the episode.
    acting: SetKind,
    space: BoxSpace<f32>,
    random: RandomPolicy,
    scripted: ScriptedPolicy,
    trained: TrainedPolicy,
    noise: ChaCha8Rng,
}

impl SetPolicy {
    /// Creates the policy of a set for an environment; call [`begin`](Self::begin) next.
    ///
    /// # Errors
    /// As [`TrainedPolicy::shipped`].
    pub fn new(kind: SetKind, env: &impl OnMujoco) -> Result<Self, TrainedPolicyError> {
        let task = env.config().task();
        let space = env.action_space().clone();
        Ok(Self {
            kind,
            acting: kind.of_episode(0),
            random: RandomPolicy::new(&space, 0),
            space,
            scripted: ScriptedPolicy::new(task),
            trained: TrainedPolicy::shipped(task)?,
            noise: ChaCha8Rng::seed_from_u64(0),
        })
    }

    /// Begins the episode with a seed.
    pub fn begin(&mut self, seed: u64) {
        self.acting = self.kind.of_episode(seed);
        self.random = RandomPolicy::new(&self.space, seed);
        self.noise = ChaCha8Rng::seed_from_u64(seed);
        // A different stream from that of the random actions.
        self.noise.set_stream(1);
    }

    /// Returns a description of the policy.
    #[must_use]
    pub const fn describe(&self) -> &'static str {
        match self.kind {
            SetKind::Random => "a uniformly random policy",
            SetKind::Scripted => "a scripted policy",
            SetKind::Expert => "a policy trained with DDPG and hindsight",
            SetKind::ExpertNoisy => {
                "a policy trained with DDPG and hindsight that explores (noise of 0.2, three \
                 random actions in ten)"
            }
            SetKind::Mixed => {
                "four policies in turn (random, scripted, trained and exploring, trained)"
            }
        }
    }

    /// Lets the trained policy explore.
    fn explore(&mut self, observation: &FetchObservation, action: &mut [f32]) {
        if self.noise.random::<f32>() < RANDOM_SHARE {
            self.random.act(observation, action);
            return;
        }
        self.trained.act(observation, action);
        for element in action {
            *element = (*element + NOISE * standard_normal(&mut self.noise)).clamp(-1.0, 1.0);
        }
    }
}

impl Policy for SetPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        let policies: &[&dyn Policy] = match self.kind {
            SetKind::Random => &[&self.random],
            SetKind::Scripted => &[&self.scripted],
            SetKind::Expert => &[&self.trained],
            SetKind::ExpertNoisy => &[&self.random, &self.trained],
            SetKind::Mixed => &[&self.random, &self.scripted, &self.trained],
        };
        policies.iter().try_for_each(|policy| policy.check_spaces(observation_space, action_space))
    }

    fn reset(&mut self) {
        Policy::<FetchObservation, f32>::reset(&mut self.scripted);
    }

    fn act(&mut self, observation: &FetchObservation, action: &mut [f32]) {
        match self.acting {
            SetKind::Random | SetKind::Mixed => self.random.act(observation, action),
            SetKind::Scripted => self.scripted.act(observation, action),
            SetKind::Expert => self.trained.act(observation, action),
            SetKind::ExpertNoisy => self.explore(observation, action),
        }
    }
}
