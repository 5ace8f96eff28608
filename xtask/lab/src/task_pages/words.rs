//! The text of the pages that no table of the code has.

use fetch_sim::Task;

/// Returns the name of a task's files, such as `pick_and_place`.
pub(super) fn file_name(task: Task) -> &'static str {
    task.spec().scene_file.trim_end_matches(".xml")
}

/// Returns what there is to do in a task.
pub(super) const fn to_do(task: Task) -> &'static str {
    match task {
        Task::Reach => {
            "A robot arm with seven joints moves its gripper to a goal in the air. There is no \
             object. It is the easiest of the four tasks: use it to try out an algorithm."
        }
        Task::Push => {
            "A robot arm with seven joints pushes a cube to a goal on the table. The fingers stay \
             closed, so the arm cannot grasp the cube: it has to move around it and push."
        }
        Task::PickAndPlace => {
            "A robot arm with seven joints brings a cube to a goal on the table or in the air. \
             Half of the goals are in the air: to reach those, it has to grasp the cube and lift \
             it."
        }
        Task::Slide => {
            "A robot arm with seven joints hits a puck so that it slides along a table to a goal \
             that the arm cannot reach. The fingers stay closed. It is the hardest of the four \
             tasks: after the hit, the arm cannot correct anything."
        }
    }
}

/// Returns the name of a task's object, if there is one.
pub(super) const fn object(task: Task) -> &'static str {
    match task {
        Task::Slide => "puck",
        _ => "cube",
    }
}

/// The differences from gymnasium-robotics that all tasks have.
pub(super) const DIFFERENCES: [&str; 3] = [
    "An action with NaN or infinity is an error, and so is a simulation that diverges; there, \
     an episode continues with wrong numbers.",
    "A step before the first reset or after the end of an episode is an error.",
    "The model of the robot is the project's own unless you choose `ModelSource::Reference`. With \
     that one, observations have the same bits, except for two quantities that Python rounds \
     differently depending on the processor.",
];

/// Returns the differences that only this task has.
pub(super) const fn own_difference(task: Task) -> Option<&'static str> {
    match task {
        Task::Reach | Task::Push => None,
        Task::PickAndPlace => Some(
            "Rendering changes no bit of the simulation; there, it moves later states by up to 8 \
             mm.",
        ),
        Task::Slide => Some(
            "Actions are `f32`. There, the same actions as `float64` lead to other states: up to \
             0.17 m apart at the end of an episode.",
        ),
    }
}

/// Breaks a text into lines of at most 100 characters. Each line after the first begins with
/// `indent`, and the caller writes as many characters before the first one.
pub(super) fn wrapped(text: &str, indent: &str) -> String {
    const WIDTH: usize = 100;
    let (mut lines, mut column) = (String::new(), indent.len());
    for word in text.split_whitespace() {
        let len = word.chars().count();
        let is_first = lines.is_empty();
        if !is_first && column + 1 + len > WIDTH {
            lines += &format!("\n{indent}");
            column = indent.len();
        } else if !is_first {
            lines.push(' ');
            column += 1;
        }
        lines += word;
        column += len;
    }
    lines
}
