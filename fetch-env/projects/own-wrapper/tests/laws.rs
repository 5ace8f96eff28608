//! The wrapper keeps the laws of the checker below and above a time limit, and everything that
//! takes environments takes it.

use std::num::NonZeroU32;

use baselines::{Collector, RandomPolicy, buffer_config};
use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::vec_env::{AutoresetMode, VecConfig};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    Env, EnvError, EnvExt, FetchResetOptions, KinematicEnv, TimeLimit, VecEnv, make_kinematic,
};
use her_relabel::HerBuffer;
use own_wrapper::Closest;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

fn make() -> Result<Wrapped<KinematicEnv, Closest>, EnvError> {
    make_kinematic("FetchReach-v4")?.wrap(Closest::new())
}

#[test]
fn the_wrapper_keeps_all_laws() {
    let options = CheckOptions::default();
    let report = check_goal_env(make, &options);
    assert!(report.passed(), "{report}");

    let limit = NonZeroU32::new(10).expect("not zero");
    let limited = || make()?.wrap(TimeLimit::new(limit));
    let options = options.with_max_episode_steps(Some(limit));
    let report = check_goal_env(limited, &options);
    assert!(report.passed(), "{report}");
}

#[test]
fn the_info_has_the_smallest_distance_of_the_episode() -> Result {
    let (mut wrapped, mut plain) = (make()?, make_kinematic("FetchReach-v4")?);
    for seed in 0..3 {
        let mut closest = plain.reset(Some(seed))?.info.distance;
        assert_eq!(wrapped.reset(Some(seed))?.info.closest, closest);
        loop {
            let (step, expected) = (wrapped.step(&[0.3; 4])?, plain.step(&[0.3; 4])?);
            closest = closest.min(expected.info.distance);
            assert_eq!((step.info.own, step.info.closest), (expected.info, closest));
            assert_eq!(step.reward, expected.reward);
            if step.is_last() {
                break;
            }
        }
    }
    Ok(())
}

#[test]
fn rows_of_many_environments_have_the_richer_info() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new([make()?, make()?], config)?;
    envs.reset(Some(0))?;
    for _ in 0..50 {
        let batch = envs.step(&[0.3; 8])?;
        for (row, distance) in batch.distance().enumerate() {
            let info = batch.step_info(row).ok_or("a step that failed")?;
            assert!(info.closest <= distance && info.own.distance == distance);
        }
    }
    // The episodes are over, and the infos of their last steps are kept.
    assert!(envs.last_step().final_info().iter().all(Option::is_some));
    Ok(())
}

#[test]
fn wrapped_environments_are_collected() -> Result {
    let envs = [make()?, make()?];
    let mut buffer = HerBuffer::<f32>::new(buffer_config(1000, &envs[0])?.with_num_envs(2))?;
    let mut policy = RandomPolicy::new(envs[0].action_space(), 0);
    let mut collector = Collector::new(VecEnv::new(envs, VecConfig::default())?);
    let mut episodes = 0;
    collector.collect(102, &mut policy, &mut buffer, |_, _| episodes += 1)?;
    assert_eq!((buffer.len(), episodes), (200, 4));
    Ok(())
}

/// The wrapper passes the options of resets on, so that a curriculum can choose the goals.
#[test]
fn a_curriculum_moves_the_goal_farther_away_with_each_episode() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new([make()?], config)?;
    let start = envs.reset(Some(0))?.achieved_goal().to_vec();
    let goal = move |episode: u64| [start[0] + 0.02 * episode as f64, start[1], start[2]];
    let choose = goal.clone();
    envs.set_autoreset_start(move |_, episode| {
        (None, FetchResetOptions::default().with_desired_goal(choose(episode)))
    })?;
    for episode in 1..4 {
        for _ in 0..50 {
            envs.step(&[0.0; 4])?;
        }
        assert_eq!(envs.last_step().desired_goal(), goal(episode));
    }
    Ok(())
}
