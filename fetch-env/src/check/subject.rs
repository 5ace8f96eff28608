use rand_pcg::Pcg64;

use super::{CheckOptions, report::Failure, report::ensure};
use crate::{Env, EnvError, GoalEnv, GoalObservation, Info, Reset, Step};

/// The environment under test, as often as it is wanted.
pub(super) struct Subject<'a, F> {
    pub(super) make: F,
    pub(super) options: &'a CheckOptions,
}

pub(super) type StepOf<E> = Step<<E as Env>::Observation, Info>;
pub(super) type ResetOf<E> = Reset<<E as Env>::Observation, Info>;

/// What a random step came from and led to.
pub(super) struct Transition<'a, E: GoalEnv> {
    pub(super) env: &'a E,
    /// The observation before the step.
    pub(super) before: &'a E::Observation,
    pub(super) step: &'a StepOf<E>,
    /// Steps of this episode, this one included.
    pub(super) elapsed_steps: u32,
}

impl<E: GoalEnv, F: Fn() -> Result<E, EnvError>> Subject<'_, F> {
    /// A new environment.
    pub(super) fn env(&self) -> Result<E, EnvError> {
        (self.make)()
    }

    /// A new environment and its first observation.
    pub(super) fn started(&self) -> Result<(E, ResetOf<E>), EnvError> {
        let mut env = self.env()?;
        let reset = env.reset(Some(self.options.seed))?;
        Ok((env, reset))
    }

    /// Random numbers for actions and goals, from another stream than any environment's: numbers of
    /// the same stream would tell the policy the goal.
    pub(super) fn rng(&self) -> Pcg64 {
        const STREAM: u128 = 0x5eed_0fac_7105;
        Pcg64::new(self.options.seed.into(), STREAM)
    }

    /// Takes random steps in a new environment, with a reset where an episode ends, and shows each.
    /// Returns how many.
    pub(super) fn for_each_step(
        &self,
        mut visit: impl FnMut(Transition<'_, E>) -> Result<(), Failure>,
    ) -> Result<u32, Failure> {
        let (mut env, reset) = self.started()?;
        let mut rng = self.rng();
        let (mut before, mut elapsed_steps) = (reset.observation, 0);
        for _ in 0..self.options.steps {
            let step = env.step(&env.action_space().sample(&mut rng))?;
            elapsed_steps += 1;
            visit(Transition { env: &env, before: &before, step: &step, elapsed_steps })?;
            (before, elapsed_steps) = if step.is_last() {
                (env.reset(None)?.observation, 0)
            } else {
                (step.observation, elapsed_steps)
            };
        }
        Ok(self.options.steps)
    }
}

/// Random steps from where `env` is, with a reset where an episode ends.
pub(super) fn random_steps<E: GoalEnv>(
    env: &mut E,
    rng: &mut Pcg64,
    steps: u32,
) -> Result<Vec<StepOf<E>>, EnvError> {
    (0..steps)
        .map(|_| {
            let step = env.step(&env.action_space().sample(rng))?;
            if step.is_last() {
                env.reset(None)?;
            }
            Ok(step)
        })
        .collect()
}

pub(super) fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Whether two observations are equal to the last bit.
pub(super) fn same_observation<O: GoalObservation>(a: &O, b: &O) -> bool {
    same_bits(a.observation(), b.observation())
        && same_bits(a.achieved_goal(), b.achieved_goal())
        && same_bits(a.desired_goal(), b.desired_goal())
}

fn same_info(a: &Info, b: &Info) -> bool {
    a.is_success == b.is_success && a.distance.to_bits() == b.distance.to_bits()
}

/// Fails unless two steps are equal to the last bit.
pub(super) fn ensure_same_step<O: GoalObservation>(
    index: usize,
    a: &Step<O, Info>,
    b: &Step<O, Info>,
) -> Result<(), Failure> {
    let same = same_observation(&a.observation, &b.observation)
        && a.reward.to_bits() == b.reward.to_bits()
        && (a.terminated, a.truncated) == (b.terminated, b.truncated)
        && same_info(&a.info, &b.info);
    ensure(same, || format!("step {index} differs: {a:?} and {b:?}"))
}

/// Fails unless two resets are equal to the last bit.
pub(super) fn ensure_same_reset<O: GoalObservation>(
    what: &str,
    a: &Reset<O, Info>,
    b: &Reset<O, Info>,
) -> Result<(), Failure> {
    let same = same_observation(&a.observation, &b.observation) && same_info(&a.info, &b.info);
    ensure(same, || format!("{what} differ: {a:?} and {b:?}"))
}

/// Fails unless both trajectories are equal to the last bit.
pub(super) fn ensure_same_steps<O: GoalObservation>(
    a: &[Step<O, Info>],
    b: &[Step<O, Info>],
) -> Result<(), Failure> {
    ensure(a.len() == b.len(), || format!("{} steps and {}", a.len(), b.len()))?;
    for (index, (a, b)) in a.iter().zip(b).enumerate() {
        ensure_same_step(index, a, b)?;
    }
    Ok(())
}
