//! The page of a task.

use std::fmt::Write;

use fetch_env::{EnvId, FetchConfig, FetchObservation, ObservationField, observation_fields};
use fetch_sim::Task;
use goal_reward::RewardKind;

use super::words::{file_name, object, to_do, wrapped};
use fetch_cli::shared::reference::RandomReference;

/// The displacement of the gripper by an action of 1, in meters.
const DISPLACEMENT: f64 = 0.05;
/// The least distance between the object's start and the gripper's, in meters.
const OBJECT_DISTANCE: f64 = 0.1;
/// The largest rise of a goal in the air, in meters.
const RISE: f64 = 0.45;

/// Returns the page, in Markdown.
pub(super) fn page(task: Task) -> Result<String, std::fmt::Error> {
    let mut page = String::new();
    let ids = [RewardKind::Sparse, RewardKind::Dense].map(|reward| EnvId { task, reward });
    let [sparse, dense] = ids.map(|id| id.to_string());
    let config = ids[0].config();
    writeln!(
        page,
        "# Fetch{task}\n\n![{sparse} after a reset](../images/{}.png)\n",
        file_name(task)
    )?;
    writeln!(page, "{}\n", wrapped(to_do(task)))?;
    let observation = FetchObservation::len_of(task);
    writeln!(page, "| | |\n|---|---|")?;
    writeln!(page, "| ids | `{sparse}` (sparse reward), `{dense}` (dense reward) |")?;
    writeln!(page, "| action space | `Box(-1.0, 1.0, (4,), float32)` |")?;
    writeln!(
        page,
        "| observation space | `observation` ({observation}), `achieved_goal` (3), `desired_goal` \
         (3), each `float64` without bounds |"
    )?;
    writeln!(page, "| control | {} Hz |", (1.0 / config.control_period()).round())?;
    writeln!(page, "| episode | {} steps |\n", config.max_episode_steps())?;
    writeln!(page, "```rust\nlet mut env = fetch_env::make(\"{sparse}\")?;\n```\n")?;
    actions(&mut page, task)?;
    observations(&mut page, task)?;
    reward(&mut page, &config, [&sparse, &dense])?;
    start(&mut page, &config)?;
    end(&mut page, &config)?;
    random(&mut page, task)?;
    versions(&mut page)?;
    writeln!(
        page,
        "<!-- `cargo xtask task-pages` writes this page from the tables in the code. -->"
    )?;
    Ok(page)
}

/// Writes a paragraph, and an empty line below it.
fn paragraph(page: &mut String, text: &str) -> std::fmt::Result {
    writeln!(page, "{}\n", wrapped(text))
}

fn actions(page: &mut String, task: Task) -> std::fmt::Result {
    let fingers = if task.block_gripper() {
        "no effect: the fingers stay closed"
    } else {
        "moves both fingers; positive opens, negative closes"
    };
    writeln!(page, "## Actions\n| index | lowest | highest | effect |\n|---|---|---|---|")?;
    writeln!(
        page,
        "| 0 to 2 | -1 | 1 | move the gripper's target along x, y and z; 1 is {DISPLACEMENT} m |"
    )?;
    writeln!(page, "| 3 | -1 | 1 | {fingers} |\n")?;
    paragraph(
        page,
        "Elements outside -1 to 1 are clipped. The axes are those of the world: x forward from the \
         robot's base, y to its left, z up.",
    )
}

fn observations(page: &mut String, task: Task) -> std::fmt::Result {
    writeln!(page, "## Observations")?;
    writeln!(page, "| index | name | elements | unit | meaning |\n|---|---|---|---|---|")?;
    for field in observation_fields(task) {
        let ObservationField { name, range, unit, description, .. } = field;
        let elements = if range.len() == 2 { "right, left" } else { "x, y, z" };
        let (first, last) = (range.start, range.end - 1);
        writeln!(page, "| {first} to {last} | `{name}` | {elements} | {unit} | {description} |")?;
    }
    let achieved = if task.has_object() { "object_pos" } else { "grip_pos" };
    writeln!(page)?;
    paragraph(
        page,
        &format!(
            "`achieved_goal` is `{achieved}`. `desired_goal` is the episode's goal: x, y and z in \
             meters. Velocities are per control step of {} s, in gymnasium-robotics too, although \
             its own table says \"m/s\".",
            EnvId { task, reward: RewardKind::Sparse }.config().control_period()
        ),
    )
}

fn reward(page: &mut String, config: &FetchConfig, [sparse, dense]: [&str; 2]) -> std::fmt::Result {
    let threshold = config.distance_threshold().get();
    writeln!(page, "## Reward\n| id | reward of a step |\n|---|---|")?;
    writeln!(
        page,
        "| `{sparse}` | -1 if the achieved goal is more than {threshold} m from the desired one, \
         else 0 |"
    )?;
    writeln!(page, "| `{dense}` | minus the distance between the two goals, in meters |\n")?;
    paragraph(
        page,
        &format!(
            "`is_success` in the info says whether the distance is below {threshold} m. \
             `compute_reward(achieved, desired)` gives the reward of any two goals, with the same \
             bits as a step: hindsight relabeling needs it."
        ),
    )
}

fn start(page: &mut String, config: &FetchConfig) -> std::fmt::Result {
    let (task, spec) = (config.task(), config.task().spec());
    let [x, y, z] = spec.gripper_start;
    writeln!(page, "## Start of an episode")?;
    let mut text = format!("The gripper starts at rest at ({x:.3}, {y:.3}, {z:.3}) m.");
    if let Some(range) = config.object_range() {
        let object = object(task);
        text += &format!(
            " The {object} lies on the table: its x and y are uniform within {range} m of the \
             gripper's along each axis, and drawn again until they are at least {OBJECT_DISTANCE} \
             m away."
        );
    }
    let [offset, ..] = config.target_offset();
    let range = config.target_range();
    let from = if offset == 0.0 {
        "of the gripper's start".to_owned()
    } else {
        format!("of a point {offset} m in front of the gripper's start")
    };
    match spec.object {
        None => text += &format!(" The goal is uniform within {range} m {from} along each axis."),
        Some(object) => {
            text += &format!(
                " The goal's x and y are uniform within {range} m {from} along each axis. Its \
                 height is the object's, {:.3} m",
                object.settled_at[2]
            );
            text += &if config.target_in_the_air() {
                format!("; half of the goals are raised by up to {RISE} m.")
            } else {
                ".".to_owned()
            };
        }
    }
    text += " `reset(Some(seed))` gives the same start as gymnasium-robotics does with that seed.";
    paragraph(page, &text)
}

fn end(page: &mut String, config: &FetchConfig) -> std::fmt::Result {
    writeln!(page, "## End of an episode")?;
    paragraph(
        page,
        &format!(
            "An episode is truncated after {} steps, and never terminated: reaching the goal does \
             not end it.",
            config.max_episode_steps()
        ),
    )
}

fn random(page: &mut String, task: Task) -> std::fmt::Result {
    let [sparse, dense] =
        [RewardKind::Sparse, RewardKind::Dense].map(|kind| RandomReference::new(task, kind));
    let successes = match sparse.successes {
        0 => "None".to_owned(),
        some => some.to_string(),
    };
    writeln!(page, "## Results of random actions")?;
    paragraph(
        page,
        &format!(
            "In {} episodes of gymnasium-robotics with uniformly random actions, the mean return \
             is {:.2} with the sparse reward and {:.2} with the dense one. {} of them end in \
             success; the mean distance to the goal at the end is {:.2} m.",
            sparse.episodes,
            sparse.episode_return.mean,
            dense.episode_return.mean,
            successes,
            sparse.final_distance.mean
        ),
    )
}

fn versions(page: &mut String) -> std::fmt::Result {
    writeln!(page, "## Versions")?;
    paragraph(
        page,
        "There is only v4, as in gymnasium-robotics 1.4.2. `FetchConfig` changes the numbers \
         above. [Fidelity](../FIDELITY.md) lists the differences from gymnasium-robotics.",
    )
}

#[cfg(test)]
mod tests {
    use fetch_env::{Env, GoalObservation, make_kinematic};

    use super::*;

    /// Checks the numbers that the code does not export.
    #[test]
    fn starts_and_steps_have_the_numbers_of_the_pages() -> anyhow::Result<()> {
        for task in Task::ALL {
            let id = EnvId { task, reward: RewardKind::Sparse };
            let mut env = make_kinematic(id)?;
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
                let rise = if id.config().target_in_the_air() { RISE } else { 0.0 };
                assert!((0.99 * rise..=rise + 1e-9).contains(&highest), "{task}: {highest}");
            }
            let before = env.reset(Some(0))?.observation.grip_position()[0];
            let after = env.step(&[0.5, 0.0, 0.0, 0.0])?.observation.grip_position()[0];
            assert!((after - before - 0.5 * DISPLACEMENT).abs() < 1e-9, "{}", after - before);
        }
        Ok(())
    }
}
