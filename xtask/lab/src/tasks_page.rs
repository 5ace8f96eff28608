//! `tasks-page`: writes the page of the tasks, from the tables in the code.

use std::fs;

use fetch_cli::shared::{json::write_text, reference::RandomReference};
use fetch_env::{EnvId, FetchConfig, FetchObservation, observation_fields};
use fetch_sim::Task;
use goal_reward::RewardKind;

#[derive(clap::Args)]
pub struct Args {
    /// Write nothing, and fail if the page is out of date
    #[arg(long)]
    check: bool,
}

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fetch-env/TASKS.md");

/// The displacement of the gripper by an action of 1, in meters.
const DISPLACEMENT: f64 = 0.05;
/// The least distance between the object's start and the gripper's, in meters.
const OBJECT_DISTANCE: f64 = 0.1;
/// The largest rise of a goal in the air, in meters.
const RISE: f64 = 0.45;

pub fn run(args: &Args) -> anyhow::Result<bool> {
    if !args.check {
        write_text(PAGE.as_ref(), &page())?;
        say!("wrote fetch-env/TASKS.md")?;
        return Ok(true);
    }
    let passed = fs::read_to_string(PAGE).is_ok_and(|known| known == page());
    if passed {
        say!("ok    fetch-env/TASKS.md")?;
    } else {
        say!("FAIL  fetch-env/TASKS.md is out of date: run `cargo xtask tasks-page`")?;
    }
    Ok(passed)
}

/// Returns the page, in Markdown.
fn page() -> String {
    let tasks = row("", |task| task.to_string());
    let rule = row("---", |_| "---".to_owned()).replace(' ', "");
    let pictures = row("", |task| {
        format!("![{task}](images/{}.png)", task.spec().scene_file.trim_end_matches(".xml"))
    });
    let ids = row("sparse rewards", |task| format!("`{}`", id(task, RewardKind::Sparse)));
    let dense_ids = row("dense rewards", |task| format!("`{}`", id(task, RewardKind::Dense)));
    // These numbers are those of every task.
    let config = config(Task::Push);
    let (steps, threshold) = (config.max_episode_steps(), config.distance_threshold().get());
    let (period, rate) = (config.control_period(), (1.0 / config.control_period()).round());
    let [reach, push] = [Task::Reach, Task::Push].map(FetchObservation::len_of);
    let (fields, starts, random) = (fields(), starts(), random());
    let offset = self::config(Task::Slide).target_offset()[0];
    format!(
        "# The tasks
{tasks}{rule}{pictures}{ids}{dense_ids}
A robot arm with seven joints acts at {rate} Hz. An episode is truncated after {steps} steps, and never
terminated: reaching the goal does not end it.

- **Reach**: the arm moves its gripper to a goal in the air. It is the easiest task: use it to try out an
  algorithm.
- **Push**: the arm pushes a cube to a goal on the table. The fingers stay closed, so it cannot grasp the cube.
- **PickAndPlace**: the arm brings a cube to a goal. Half of the goals are in the air: to reach those, the arm
  has to grasp the cube and lift it.
- **Slide**: the arm hits a puck, which slides to a goal that the arm cannot reach. It is the hardest task: after
  the hit, the arm cannot correct anything.

## Actions
The action space is `Box(-1.0, 1.0, (4,), float32)`. Elements outside -1 to 1 are clipped.

- Elements 0 to 2 move the gripper's target along the axes of the world: x forward from the robot's base, y to
  its left, z up. An element of 1 is {DISPLACEMENT} m.
- Element 3 moves both fingers in PickAndPlace: positive opens, negative closes. In the other tasks it does nothing.

## Observations
`observation` has {reach} elements in Reach and {push} in the other tasks. `achieved_goal` and `desired_goal` are x, y
and z in meters. All are `float64` without bounds.

{fields}
`achieved_goal` is `grip_pos` in Reach and `object_pos` in the other tasks. Velocities are per control step of
{period} s, in gymnasium-robotics too, although its own table says \"m/s\".

## Rewards
A sparse reward is -1 if the achieved goal is more than {threshold} m from the desired one, else 0. A dense reward is
minus this distance in meters. `is_success` in the info says whether the distance is below {threshold} m.

`compute_reward(achieved, desired)` gives the reward of any two goals, with the bits of a step: hindsight
relabeling needs it.

## Start of an episode
{tasks}{rule}{starts}
Objects and goals are uniform along each axis. An object is drawn again until it is at least {OBJECT_DISTANCE} m from
the gripper. Slide's goals lie around a point {offset} m in front of the gripper's start. A goal for an object has the
object's height; half of PickAndPlace's are raised by up to {RISE} m.

`reset(Some(seed))` gives the start that gymnasium-robotics gives with that seed. `FetchConfig` changes the numbers.

## Random actions
{} episodes of gymnasium-robotics with uniformly random actions:

{tasks}{rule}{random}
There is only v4, as in gymnasium-robotics 1.4.2. [Fidelity](FIDELITY.md) lists the differences from it.

<!-- `cargo xtask tasks-page` writes this page from the tables in the code. -->
",
        RandomReference::new(Task::Push, RewardKind::Sparse).episodes,
    )
}

fn id(task: Task, reward: RewardKind) -> EnvId {
    EnvId { task, reward }
}

fn config(task: Task) -> FetchConfig {
    id(task, RewardKind::Sparse).config()
}

/// Returns the row of a table with a cell for each task.
fn row(name: &str, cell: impl Fn(Task) -> String) -> String {
    let cells = Task::ALL.map(|task| format!(" {} |", cell(task)));
    format!("| {name} |{}\n", cells.concat()).replace("|  |", "| |")
}

/// Returns the table of what an observation holds.
fn fields() -> String {
    let in_reach = observation_fields(Task::Reach);
    let mut table = "| name | index | in Reach | elements | unit | meaning |\n".to_owned();
    table += "|---|---|---|---|---|---|\n";
    for field in observation_fields(Task::Push) {
        let indices =
            |range: &std::ops::Range<usize>| format!("{} to {}", range.start, range.end - 1);
        let reach = in_reach.iter().find(|other| other.name == field.name);
        let reach = reach.map_or_else(|| "-".to_owned(), |field| indices(&field.range));
        let elements = if field.range.len() == 2 { "right, left" } else { "x, y, z" };
        table += &format!(
            "| `{}` | {} | {reach} | {elements} | {} | {} |\n",
            field.name,
            indices(&field.range),
            field.unit,
            field.description
        );
    }
    table
}

/// Returns the rows of where episodes start.
fn starts() -> String {
    let or_none = |number: Option<String>| number.unwrap_or_else(|| "-".to_owned());
    row("gripper, at rest (m)", |task| {
        let [x, y, z] = task.spec().gripper_start;
        format!("{x:.3}, {y:.3}, {z:.3}")
    }) + &row("object's x and y: within this of the gripper's (m)", |task| {
        or_none(config(task).object_range().map(|range| range.to_string()))
    }) + &row("object's height (m)", |task| {
        or_none(task.spec().object.map(|object| format!("{:.3}", object.settled_at[2])))
    }) + &row("goal: within this of the gripper's start (m)", |task| {
        config(task).target_range().to_string()
    })
}

/// Returns the rows of what random actions reach.
fn random() -> String {
    let of = RandomReference::new;
    row("mean return, sparse", |task| {
        format!("{:.2}", of(task, RewardKind::Sparse).episode_return.mean)
    }) + &row("mean return, dense", |task| {
        format!("{:.2}", of(task, RewardKind::Dense).episode_return.mean)
    }) + &row("episodes that end in success", |task| {
        of(task, RewardKind::Sparse).successes.to_string()
    }) + &row("mean distance to the goal at the end (m)", |task| {
        format!("{:.2}", of(task, RewardKind::Sparse).final_distance.mean)
    })
}
#[cfg(test)]
mod tests {
    use fetch_env::{Env, GoalObservation, make_kinematic};

    use super::*;

    #[test]
    fn the_page_is_what_the_code_gives() -> anyhow::Result<()> {
        assert!(fs::read_to_string(PAGE)? == page(), "run `cargo xtask tasks-page`");
        Ok(())
    }

    #[test]
    fn what_the_page_says_of_every_task_is_so() {
        for task in Task::ALL {
            let shared = |config: FetchConfig| {
                let threshold = config.distance_threshold().get();
                (config.max_episode_steps(), config.control_period(), threshold)
            };
            assert_eq!(shared(config(task)), shared(config(Task::Push)), "{task}");
            assert_eq!(task.block_gripper(), task != Task::PickAndPlace, "{task}");
            assert_eq!(config(task).target_in_the_air(), task == Task::PickAndPlace, "{task}");
        }
    }

    /// Checks the numbers that the code does not export.
    #[test]
    fn starts_and_steps_have_the_numbers_of_the_page() -> anyhow::Result<()> {
        for task in Task::ALL {
            let mut env = make_kinematic(id(task, RewardKind::Sparse))?;
            let (mut nearest, mut highest) = (f64::INFINITY, 0.0_f64);
            for seed in 0..2_000 {
                let observation = env.reset(Some(seed))?.observation;
                let [x, y, _] = observation.grip_position();
                if let Some([object_x, object_y, height]) = observation.object_position() {
                    nearest = nearest.min((object_x - x).hypot(object_y - y));
                    highest = highest.max(observation.desired_goal()[2] - height);
                }
            }
            if task.has_object() {
                assert!((OBJECT_DISTANCE..1.01 * OBJECT_DISTANCE).contains(&nearest), "{nearest}");
                let rise = if config(task).target_in_the_air() { RISE } else { 0.0 };
                assert!((0.99 * rise..=rise + 1e-9).contains(&highest), "{task}: {highest}");
            }
            let before = env.reset(Some(0))?.observation.grip_position()[0];
            let after = env.step(&[0.5, 0.0, 0.0, 0.0])?.observation.grip_position()[0];
            assert!((after - before - 0.5 * DISPLACEMENT).abs() < 1e-9, "{}", after - before);
        }
        Ok(())
    }
}
