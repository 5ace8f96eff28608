//! Stacking two blocks, as its example defines it.

#[allow(dead_code, reason = "the example's own main")]
#[path = "../examples/stack.rs"]
mod stack;

use std::{error::Error, num::NonZeroU32};

use baselines::learn::{TrainSettings, Trainer};
use baselines::page::episode_page;
use baselines::{Policy, RandomPolicy, TrainedPolicy, evaluate};
use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::vec_env::VecConfig;
use fetch_env::{Env, GoalObservation, RenderEnv, RenderOptions, VecEnv, make};

use stack::stack;

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

#[test]
fn it_passes_every_check() {
    let options =
        CheckOptions::default().with_max_episode_steps(NonZeroU32::new(100)).with_num_steps(110);
    let report = check_goal_env(stack, &options);
    assert!(report.passed(), "{report}");
}

#[test]
fn both_blocks_are_placed_and_seen() -> Result {
    let mut env = stack()?;
    let first = env.reset(Some(0))?.observation;
    let second = env.reset(Some(1))?.observation;
    assert_eq!(first.observation().len(), 25 + 9);
    assert_eq!(first.achieved_goal().len(), 6);
    assert_ne!(first.achieved_goal()[3..], second.achieved_goal()[3..]);
    // Both rest on the table.
    assert!((first.achieved_goal()[2] - first.achieved_goal()[5]).abs() < 1e-3);
    Ok(())
}

#[test]
fn many_give_the_bits_of_one() -> Result {
    let envs = (0..3).map(|_| stack()).collect::<std::result::Result<Vec<_>, _>>()?;
    let mut envs = VecEnv::new(envs, VecConfig::default().with_num_threads(2))?;
    let mut single = stack()?;
    let start = envs.reset(Some(5))?;
    assert_eq!(start.desired_goal()[6..12], *single.reset(Some(6))?.observation.desired_goal());
    let actions = [0.7, -0.3, -0.5, 1.0].repeat(3);
    for _ in 0..20 {
        let one = single.step(&actions[..4])?;
        let many = envs.step(&actions)?;
        assert_eq!(many.achieved_goal()[6..12], *one.observation.achieved_goal());
        assert_eq!(many.observation()[34..68], *one.observation.observation());
        assert_eq!(many.reward()[1], one.reward);
    }
    Ok(())
}

#[test]
fn it_is_rendered_and_played_back() -> Result {
    let mut env = stack()?;
    env.reset(Some(0))?;
    match env.renderer(RenderOptions::default().with_width(64).with_height(64)) {
        Ok(mut renderer) => assert_eq!(env.render(&mut renderer)?.len(), 64 * 64 * 3),
        Err(error) => eprintln!("not rendered: {error}"),
    }
    let mut policy = RandomPolicy::new(env.action_space(), 0);
    let page = episode_page(&mut env, &mut policy, 0)?;
    // A ball for each block's place.
    let (_, goals) = page.split_once("\"goals\":[[").ok_or("no goals")?;
    let (goals, _) = goals.split_once("]]").ok_or("no end of the goals")?;
    assert_eq!(goals.split("],[").count(), 2);
    Ok(())
}

#[test]
fn the_learner_runs_and_its_policy_acts_is_saved_and_refused_elsewhere() -> Result {
    let mut settings = TrainSettings::default();
    settings.replay.batch_size = 32;
    settings.schedule.num_envs = 2;
    settings.schedule.updates_per_cycle = 5;
    settings.schedule.evaluation_episodes = 2;
    settings.exploration.random_episodes = 2;
    let mut trainer = Trainer::new(stack, settings, 0, 2)?;
    trainer.run(800, None, |_, _| std::ops::ControlFlow::Continue(()))?;
    assert!(trainer.counters().updates > 0);
    assert!(!trainer.rows().is_empty());

    let trained = trainer.policy("Stack")?;
    let mut loaded = TrainedPolicy::from_bytes(&trained.to_bytes()?)?;
    let mut env = stack()?;
    let start = env.reset(Some(3))?.observation;
    let mut action = [f32::NAN; 4];
    loaded.act(&start, &mut action);
    assert!(action.iter().all(|element| element.abs() <= 1.0));
    assert_eq!(evaluate(&mut env, &mut loaded, 1, 0, |_| ())?.episodes.len(), 1);
    let refused = evaluate(&mut make("FetchPush-v4")?, &mut loaded, 1, 0, |_| ());
    assert!(refused.is_err());
    Ok(())
}
