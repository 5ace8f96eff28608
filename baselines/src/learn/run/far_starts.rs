//! Episodes that begin far from their goal.

use fetch_env::wrappers::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use fetch_env::{EnvError, GoalObservation, Reset, Space, Step};
use goal_reward::goal_distance;
use rand::{Rng, RngExt};

use crate::collector::CollectEnv;
use crate::reset_seeds::ResetSeeds;

/// The number of starts from which the farthest is taken.
const NUM_STARTS: usize = 4;

/// A wrapper that begins a share of the episodes at the one of several starts that is farthest from
/// its goal.
///
/// It only resets the environment with its own seeds, so it needs no knowledge of the task. An
/// episode that is reset with a seed begins where that seed puts it.
#[derive(Clone, Debug)]
pub(crate) struct FarStarts {
    share: f64,
    seeds: ResetSeeds,
}

impl FarStarts {
    /// Begins the share `share` of the episodes far from their goal.
    pub(super) fn new(share: f64) -> Self {
        Self { share, seeds: ResetSeeds::default() }
    }
}

impl<E: CollectEnv> Wrapper<E> for FarStarts {
    type Observation = E::Observation;
    type Info = E::Info;
    type ActionSpace = E::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        let next = self.seeds.after(seed);
        let mut rng = next.rng();
        let is_far = seed.is_none() && rng.random::<f64>() < self.share;
        let mut first_seed = seed;
        if is_far {
            let mut farthest = f64::NEG_INFINITY;
            for _ in 0..NUM_STARTS {
                // One of 2^64: it is practically never the seed of an evaluation.
                let seed = rng.next_u64();
                let observation = env.reset_with(Some(seed), options)?.observation;
                let goals = (observation.achieved_goal(), observation.desired_goal());
                let distance = goal_distance(goals.0, goals.1);
                if distance > farthest {
                    (farthest, first_seed) = (distance, Some(seed));
                }
            }
        }
        let reset = env.reset_with(first_seed, options)?;
        self.seeds = next;
        Ok(reset)
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[fetch_env::ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        env.step(action)
    }

    fn action_space<'a>(&'a self, env: &'a E) -> &'a E::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        env.observation_space()
    }
}

impl KeepsGoals for FarStarts {
    const KEEPS_SYMMETRIES: bool = true;
}

impl SnapshotWrapper for FarStarts {
    type State = ResetSeeds;

    fn state(&self) -> ResetSeeds {
        self.seeds
    }

    fn check_state(&self, _: &ResetSeeds) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, state: &ResetSeeds) {
        self.seeds = *state;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fetch_env::{Env, EnvExt, SnapshotEnv, make_kinematic};

    /// Returns the distances of the goals of episodes that begin without a seed.
    fn distances(env: &mut impl Env<Observation: GoalObservation>, count: usize) -> Vec<f64> {
        let starts = (0..count).map(|_| env.reset(None).unwrap().observation);
        starts.map(|start| goal_distance(start.achieved_goal(), start.desired_goal())).collect()
    }

    #[test]
    fn a_share_of_the_episodes_begins_farther_from_the_goal() {
        let mean = |share: f64| {
            let mut env =
                make_kinematic("FetchSlide-v4").unwrap().wrap(FarStarts::new(share)).unwrap();
            env.reset(Some(3)).unwrap();
            distances(&mut env, 400).iter().sum::<f64>() / 400.0
        };
        let [none, half, all] = [0.0, 0.5, 1.0].map(mean);
        assert!(all > 1.25 * none, "{none} {all}");
        assert!((half - 0.5 * (none + all)).abs() < 0.03, "{none} {half} {all}");
    }

    #[test]
    fn without_a_share_episodes_begin_as_without_the_wrapper() {
        let mut plain = make_kinematic("FetchPush-v4").unwrap();
        let mut env = make_kinematic("FetchPush-v4").unwrap().wrap(FarStarts::new(0.0)).unwrap();
        let seeded = plain.reset(Some(9)).unwrap();
        assert_eq!(env.reset(Some(9)).unwrap(), seeded);
        assert_eq!(distances(&mut env, 20), distances(&mut plain, 20));
    }

    #[test]
    fn a_snapshot_continues_with_the_same_starts() {
        let mut env = make_kinematic("FetchPush-v4").unwrap().wrap(FarStarts::new(0.5)).unwrap();
        env.reset(Some(1)).unwrap();
        distances(&mut env, 5);
        let snapshot = env.snapshot();
        let expected = distances(&mut env, 20);
        let mut other = make_kinematic("FetchPush-v4").unwrap().wrap(FarStarts::new(0.5)).unwrap();
        other.restore(&snapshot).unwrap();
        assert_eq!(distances(&mut other, 20), expected);
        other.reset(Some(2)).unwrap();
        assert_ne!(distances(&mut other, 20), expected);
    }
}
