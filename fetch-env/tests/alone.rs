//! A user's program needs no crate but fetch-env: its interface names nothing that it does not
//! export.

use std::{error::Error, num::NonZeroU32};

use fetch_env::{
    BoxSpace, DistanceReward, Env, EnvExt, FetchConfig, FetchEnv, GoalEnv, GoalEnvExt,
    GoalObservation, GoalPairs, GoalReward, KinematicSimulator, NpRandom, RewardKind, SimConfig,
    Simulator, Task, TimeLimit, rand_core::Rng,
};

#[test]
fn an_environment_is_made_stepped_and_relabeled() -> Result<(), Box<dyn Error>> {
    let config = FetchConfig::new(Task::Push, RewardKind::Dense);
    let sim: SimConfig = config.sim().clone();
    let simulator = KinematicSimulator::new(&sim);
    assert_eq!(simulator.task(), Task::Push);
    let limit = NonZeroU32::new(10).ok_or("not zero")?;
    let mut env = FetchEnv::new(config, simulator)?.wrap(TimeLimit::new(limit))?;
    let mut random = NpRandom::new(3);
    env.reset(Some(random.next_u64()))?;
    let reward: DistanceReward = *env.goal_reward();
    loop {
        let step = env.step(&env.action_space().sample(&mut random))?;
        let observation = &step.observation;
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        assert_eq!(step.reward, env.compute_reward(achieved, desired)?);
        assert_eq!(step.reward, reward.try_reward(achieved, desired)?);
        let mut batch = [0.0];
        env.compute_reward_batch(GoalPairs::new(achieved, desired, 3)?, &mut batch)?;
        assert_eq!(batch, [step.reward]);
        if step.is_last() {
            assert_eq!(env.elapsed_steps(), 10);
            return Ok(());
        }
    }
}

#[test]
fn numpys_generator_samples_spaces_and_counts_its_draws() -> Result<(), Box<dyn Error>> {
    let space = BoxSpace::<f64>::uniform(vec![5], 0.0, 1.0)?;
    let (mut words, mut numbers) = (NpRandom::new(1), NpRandom::new(1));
    let expected: Vec<f64> = (0..5).map(|_| numbers.random()).collect();
    assert_eq!(space.sample(&mut words), expected);
    assert_eq!(words, numbers, "the same position in the stream");
    words.fill_bytes(&mut [0; 12]);
    words.next_u32();
    for _ in 0..3 {
        numbers.next_u64();
    }
    assert_eq!(words, numbers, "twelve bytes take two draws");
    Ok(())
}
