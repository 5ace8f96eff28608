//! Pushing around a wall, as its example defines it.

#[allow(dead_code, reason = "the example's own main")]
#[path = "../examples/obstacle.rs"]
mod obstacle;

use std::error::Error;

use baselines::{Policy, ScriptedPolicy, page::episode_page};
use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::{Env, GoalEnv, GoalObservation, GoalReward, Task};

use obstacle::obstacle;

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

#[test]
fn it_passes_every_check() {
    let options = CheckOptions::default();
    let report = check_goal_env(obstacle, &options);
    assert!(report.passed(), "{report}");
}

/// The wall stands between the block and its place, at another position in each episode.
#[test]
fn the_wall_is_drawn_with_each_reset() -> Result {
    let mut env = obstacle()?;
    let mut walls = Vec::new();
    for seed in 0..5 {
        let start = env.reset(Some(seed))?.observation;
        let (block, goal) = (start.achieved_goal(), start.desired_goal());
        for axis in 0..2 {
            let middle = 0.5 * (block[axis] + goal[axis]);
            assert!((block[3 + axis] - middle).abs() < 1e-9);
        }
        assert_eq!(block[3..], goal[3..]);
        walls.push(goal[3..].to_vec());
    }
    walls.dedup();
    assert_eq!(walls.len(), 5);
    Ok(())
}

/// A policy that knows nothing about the wall pushes the block against it and around it, but never
/// through it.
#[test]
fn the_wall_stops_the_block() -> Result {
    let mut env = obstacle()?;
    let bounds = env.goal_reward().bounds();
    let mut near = 0;
    for seed in 0..10 {
        let mut policy = ScriptedPolicy::new(Task::Push);
        let mut observation = env.reset(Some(seed))?.observation;
        let wall = observation.achieved_goal()[3..].to_vec();
        let mut action = [0.0; 4];
        for _ in 0..50 {
            policy.act(&observation, &mut action);
            let step = env.step(&action)?;
            assert!(bounds.contains(&step.reward));
            near += usize::from(step.reward == -2.0);
            observation = step.observation;
            assert_eq!(observation.achieved_goal()[3..], wall[..]);
            let &[way_x, way_y, across_x, across_y] = &observation.observation()[25..] else {
                return Err("other columns".into());
            };
            let from_face = (way_x * across_x + way_y * across_y).abs();
            let along = (way_y * across_x - way_x * across_y).abs();
            let is_on_table = (0.42..0.43).contains(&observation.achieved_goal()[2]);
            assert!(!is_on_table || from_face > 0.03 || along > 0.05, "{from_face}, {along}");
        }
    }
    assert!(near > 10, "{near} steps near the wall");
    Ok(())
}

#[test]
fn it_is_played_back() -> Result {
    let page = episode_page(&mut obstacle()?, &mut ScriptedPolicy::new(Task::Push), 0)?;
    assert!(page.contains("\"goals\":[["));
    Ok(())
}
