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

/// Breaks a text into lines of at most 100 characters.
pub(super) fn wrapped(text: &str) -> String {
    const WIDTH: usize = 100;
    let (mut lines, mut column) = (String::new(), 0);
    for word in text.split_whitespace() {
        let len = word.chars().count();
        let is_first = lines.is_empty();
        if !is_first && column + 1 + len > WIDTH {
            lines.push('\n');
            column = 0;
        } else if !is_first {
            lines.push(' ');
            column += 1;
        }
        lines += word;
        column += len;
    }
    lines
}
