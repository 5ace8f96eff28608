//! The maze: it is a correct environment, it is learned, and an episode of it is played back.

#[allow(dead_code, reason = "the example's own main")]
#[path = "../examples/maze.rs"]
mod maze;

use std::error::Error;

use baselines::evaluate;
use baselines::learn::Trainer;
use baselines::page::episode_page;
use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::{Env, GoalObservation};

use maze::maze;

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

#[test]
fn it_passes_every_check() {
    let options = CheckOptions::default()
        .with_max_episode_steps(Some(maze::STEPS))
        .with_num_steps(2 * maze::STEPS.get());
    let report = check_goal_env(maze, &options);
    assert!(report.passed(), "{report}");
}

#[test]
fn walls_stop_the_point() -> Result {
    let mut env = maze()?;
    for seed in 0..20 {
        env.reset(Some(seed))?;
        for step in 0..50_u64 {
            let action = [(seed + step).is_multiple_of(3), step % 5 > 1]
                .map(|is_up| if is_up { 1.0 } else { -1.0 });
            let observation = env.step(&action)?.observation;
            let [x, y] = observation.achieved_goal() else { panic!("{observation:?}") };
            assert!((0.0..5.0).contains(x) && (0.0..5.0).contains(y), "{observation:?}");
            // The second and the fourth row are walls except for a cell at one end.
            assert!(!(1.0..2.0).contains(y) || *x >= 4.0, "{observation:?}");
            assert!(!(3.0..4.0).contains(y) || *x < 1.0, "{observation:?}");
        }
    }
    Ok(())
}

#[test]
fn it_is_learned_saved_and_played_back() -> Result {
    let folder = tempfile::tempdir()?;
    let mut trainer = maze::learn(0)?;
    assert!(trainer.rows().last().is_some_and(|row| row.success_rate.value >= 0.95));
    trainer.save(folder.path())?;
    let mut policy = Trainer::resume(maze, folder.path(), 2)?.policy("Maze")?;
    let summary = evaluate(&mut maze()?, &mut policy, 100, 1, |_| ())?.summary()?;
    assert!(summary.success_rate.value >= 0.95, "{:?}", summary.success_rate);
    let page = episode_page(&mut maze()?, &mut policy, 0)?;
    assert!(page.contains("data:image/png"));
    Ok(())
}
