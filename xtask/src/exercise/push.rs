//! Exercise 3: the 25 numbers of FetchPush.

use fetch_env::{Env, GoalObservation, Task, make, observation_fields};
use nalgebra::Vector3;

pub fn run(seed: u64) -> anyhow::Result<bool> {
    println!("Exercise 3: FetchPushDense-v4, seed {seed}");
    let mut env = make("FetchPushDense-v4")?;
    let first = env.reset(Some(seed))?.observation;
    for field in observation_fields(Task::Push) {
        let values = &first.observation()[field.range.clone()];
        let indices = format!("{}-{}", field.range.start, field.range.end - 1);
        println!("  {indices:>5}  {:<15} {:<8} {values:.4?}", field.name, field.unit);
    }
    let object = first.object_position().unwrap_or_default();
    let tracks_object = first.achieved_goal() == object;
    println!("(a) The object's position stands at indices 3 to 5: {object:.4?} m.");
    println!("(b) achieved_goal is the object's position: {tracks_object}.");
    let mut last = first;
    for _ in 0..50 {
        last = env.step(&[0.0; 4])?.observation;
    }
    let position = |goal: &[f64]| Vector3::from_column_slice(goal);
    let moved = (position(last.achieved_goal()) - position(first.achieved_goal())).norm();
    println!("(c) After 50 steps of [0, 0, 0, 0] the object has moved by {:.3} mm.", 1e3 * moved);
    Ok(tracks_object && moved < 1e-3)
}
