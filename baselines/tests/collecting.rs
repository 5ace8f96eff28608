//! Episodes of environments, collected into a buffer.

use baselines::{CollectError, Policy, RandomPolicy, buffer_config, collect};
use fetch_env::wrappers::{KeepsGoals, Resetting, Wrapper};
use fetch_env::{
    ActionElement, BoxSpace, Env, EnvError, EnvExt, FetchObservation, GoalEnv, GoalEnvExt,
    GoalObservation, MovingGoal, Reset, Space, Step, make_kinematic,
};
use her_relabel::{AddError, Batch, GoalStrategy, HerBuffer, Sampler, UnitInterval};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const EPISODES: usize = 4;
const STEPS: usize = 50;

/// Fills a buffer and compares it with the environment, stepped again.
fn check<E: GoalEnv<Observation = FetchObservation, ActionSpace = BoxSpace<f32>>>(
    mut env: E,
    episodes: usize,
) -> Result {
    let mut buffer = HerBuffer::<f64>::new(buffer_config(1000, &env)?)?;
    let mut policy = RandomPolicy::new(env.action_space(), 3);
    let collected = collect(&mut env, &mut policy, EPISODES, 10, &mut buffer, 0, |_| ())?;
    assert_eq!(collected.episodes.len(), EPISODES);
    assert_eq!((buffer.len(), buffer.num_episodes()), (EPISODES * STEPS, episodes));

    let mut batch = Batch::new();
    let sampler = Sampler::new(2000, GoalStrategy::Future, UnitInterval::from_k(4));
    sampler.sample(&buffer, env.goal_reward(), 1, &mut batch)?;
    let goal = |goals: &[f64], row: usize| goals[row * 3..][..3].to_vec();
    let mut rewards = Vec::new();
    for row in 0..batch.len() {
        let achieved = goal(batch.next_achieved_goal(), row);
        let desired = goal(batch.desired_goal(), row);
        let reward = env.compute_reward(&achieved, &desired)?;
        assert_eq!(batch.reward()[row].to_bits(), reward.to_bits());
        assert!(!batch.terminated()[row]);
        rewards.push(reward);
    }
    assert!(rewards.iter().any(|reward| *reward != rewards[0]));
    assert!(batch.truncated().contains(&true));

    // The first transition of the first episode is the environment's.
    let mut policy = RandomPolicy::new(env.action_space(), 3);
    let start = env.reset(Some(10))?.observation;
    let mut action = [0.0; 4];
    policy.act(&start, &mut action);
    let step = env.step(&action)?;
    let oldest = buffer.transition_ids().ok_or("no transition")?.0;
    let row =
        batch.transition().iter().position(|id| *id == oldest).ok_or("the oldest was not drawn")?;
    let dim = start.observation().len();
    assert_eq!(&batch.observation()[row * dim..][..dim], start.observation());
    assert_eq!(&batch.next_observation()[row * dim..][..dim], step.observation.observation());
    assert_eq!(batch.action()[row * 4..][..4], action.map(f64::from));
    Ok(())
}

/// Moves the goal before each third step of an episode.
struct Moves(u8);

impl<E: MovingGoal + Env> Wrapper<E> for Moves {
    type Observation = E::Observation;
    type Info = E::Info;
    type ActionSpace = E::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        self.0 = 0;
        env.reset_with(seed, options)
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        self.0 += 1;
        if self.0.is_multiple_of(3) {
            env.set_desired_goal(&[1.3, 0.7, 0.5 + 0.001 * f64::from(self.0)])?;
        }
        env.step(action)
    }

    fn action_space<'a>(&'a self, env: &'a E) -> &'a E::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        env.observation_space()
    }
}

impl KeepsGoals for Moves {}

#[test]
fn each_goal_of_an_episode_has_an_episode_in_the_buffer() -> Result {
    check(make_kinematic("FetchPushDense-v4")?.wrap(Moves(0))?, EPISODES * (1 + STEPS / 3))
}

#[test]
fn episodes_of_the_kinematic_simulator_are_collected() -> Result {
    for id in ["FetchReach-v4", "FetchPushDense-v4"] {
        check(make_kinematic(id)?, EPISODES)?;
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
fn episodes_of_mujoco_are_collected() -> Result {
    for id in ["FetchReachDense-v4", "FetchPickAndPlace-v4"] {
        check(fetch_env::make(id)?, EPISODES)?;
    }
    Ok(())
}

#[test]
fn a_buffer_that_does_not_fit_is_an_error() -> Result {
    let mut reach = make_kinematic("FetchReach-v4")?;
    let mut push = make_kinematic("FetchPush-v4")?;
    let mut buffer = HerBuffer::<f32>::new(buffer_config(1000, &reach)?)?;
    let mut policy = RandomPolicy::new(reach.action_space(), 0);
    let error = collect(&mut push, &mut policy, usize::MAX, 5, &mut buffer, 0, |_| ()).err();
    let Some(CollectError::Buffer { episode: 0, seed: 5, source }) = error else {
        return Err(format!("{error:?}").into());
    };
    assert!(matches!(source, AddError::WrongLength { .. }), "{source}");
    // Nothing is left over, and the buffer accepts the next episode.
    collect(&mut reach, &mut policy, 1, 0, &mut buffer, 0, |_| ())?;
    assert_eq!(buffer.len(), STEPS);
    Ok(())
}
