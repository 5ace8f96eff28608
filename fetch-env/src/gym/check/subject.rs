//! The environment under test: making it, stepping it and comparing what it returns.

use std::num::NonZeroU32;

use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use super::report::Failure;
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::goal::GoalEnv;
use crate::gym::env::observation::BatchObservation;
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{ActionElement, Env, Reset, Step};
use crate::gym::error::EnvError;

/// Settings of the environment checker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[must_use]
pub struct CheckOptions {
    seed: u64,
    #[serde(rename = "steps")]
    num_steps: u32,
    max_episode_steps: Option<NonZeroU32>,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { seed: 0, num_steps: 60, max_episode_steps: NonZeroU32::new(50) }
    }
}

impl CheckOptions {
    settings! {
        /// Sets the seed of the episodes and, in a separate stream, of the actions. The default is
        /// 0.
        with_seed(seed: u64);
        /// Sets the number of random steps in each check that steps. The default, 60, exceeds an
        /// episode, so the steps include resets without a seed.
        with_num_steps(num_steps: u32);
        /// Sets the number of steps after which the environment must truncate an episode; `None` if
        /// only its own rules may. The default, 50, is that of the Fetch environments.
        with_max_episode_steps(max_episode_steps: Option<NonZeroU32>);

        /// Returns the seed of the episodes.
        seed: u64;
        /// Returns the number of random steps in each check that steps.
        num_steps: u32;
        /// Returns the number of steps after which the environment must truncate an episode.
        max_episode_steps: Option<NonZeroU32>;
    }
}

/// An environment that can be checked.
pub(super) trait Checked: Env<Observation: BatchObservation> {}

impl<E: Env<Observation: BatchObservation>> Checked for E {}

/// The environment under test.
pub(super) struct Subject<'a, E> {
    pub(super) make: &'a dyn Fn() -> Result<E, EnvError>,
    pub(super) options: &'a CheckOptions,
}

pub(super) type StepOf<E> = Step<<E as Env>::Observation, <E as Env>::Info>;
pub(super) type ResetOf<E> = Reset<<E as Env>::Observation, <E as Env>::Info>;

/// A random step with what came before it.
pub(super) struct Transition<'a, E: Env> {
    pub(super) env: &'a E,
    /// The observation before the step.
    pub(super) before: &'a E::Observation,
    pub(super) step: &'a StepOf<E>,
    /// The number of steps in this episode, including this one.
    pub(super) elapsed_steps: u32,
}

impl<E: GoalEnv> Transition<'_, E> {
    /// Returns the achieved and the desired goal after the step.
    pub(super) fn goals(&self) -> [&[f64]; 2] {
        [self.step.observation.achieved_goal(), self.step.observation.desired_goal()]
    }
}

impl<E: Env> Subject<'_, E> {
    /// Creates a new environment.
    pub(super) fn env(&self) -> Result<E, EnvError> {
        (self.make)()
    }

    /// Creates a new environment and resets it.
    pub(super) fn started(&self) -> Result<(E, ResetOf<E>), EnvError> {
        let mut env = self.env()?;
        let reset = env.reset(Some(self.options.seed))?;
        Ok((env, reset))
    }

    /// Returns the generator of actions and goals. Its stream differs from every environment's,
    /// whose numbers would reveal the goal to the policy.
    pub(super) fn rng(&self) -> Pcg64 {
        const STREAM: u128 = 0x5eed_0fac_7105;
        Pcg64::new(self.options.seed.into(), STREAM)
    }

    /// Takes random steps in a new environment, resets it at the end of each episode, and calls
    /// `visit` after each step. Returns the number of steps.
    pub(super) fn for_each_step(
        &self,
        mut visit: impl FnMut(Transition<'_, E>) -> Result<(), Failure>,
    ) -> Result<u32, Failure> {
        let (mut env, reset) = self.started()?;
        let mut rng = self.rng();
        let (mut before, mut elapsed_steps) = (reset.observation, 0);
        for _ in 0..self.options.num_steps {
            let step = env.step(&random_action(&env, &mut rng)?)?;
            elapsed_steps += 1;
            visit(Transition { env: &env, before: &before, step: &step, elapsed_steps })?;
            (before, elapsed_steps) = if step.is_last() {
                (env.reset(None)?.observation, 0)
            } else {
                (step.observation, elapsed_steps)
            };
        }
        Ok(self.options.num_steps)
    }
}

/// Draws an action.
pub(super) fn random_action<E: Env>(
    env: &E,
    rng: &mut Pcg64,
) -> Result<Vec<ActionElement<E>>, EnvError> {
    let space = env.action_space();
    let mut action = vec![ActionElement::<E>::default(); space.action_len()];
    space.sample_action(rng, &mut action)?;
    Ok(action)
}

/// Takes random steps from the environment's current state and resets it at the end of each
/// episode.
pub(super) fn random_steps<E: Env>(
    env: &mut E,
    rng: &mut Pcg64,
    num_steps: u32,
) -> Result<Vec<StepOf<E>>, EnvError> {
    steps(env, num_steps, |env| random_action(env, rng))
}

/// Takes the same action several times, which leads farther than as many random ones.
pub(super) fn same_steps<E: Env>(
    env: &mut E,
    action: &[ActionElement<E>],
) -> Result<Vec<StepOf<E>>, EnvError> {
    const NUM_STEPS: u32 = 10;
    steps(env, NUM_STEPS, |_| Ok(action.to_vec()))
}

/// Takes steps from the environment's current state and resets it at the end of each episode.
fn steps<E: Env>(
    env: &mut E,
    num_steps: u32,
    mut next_action: impl FnMut(&E) -> Result<Vec<ActionElement<E>>, EnvError>,
) -> Result<Vec<StepOf<E>>, EnvError> {
    (0..num_steps)
        .map(|_| {
            let step = env.step(&next_action(env)?)?;
            if step.is_last() {
                env.reset(None)?;
            }
            Ok(step)
        })
        .collect()
}
