use super::{Command, OPEN, view::View};

pub(super) fn act(view: &View) -> Command {
    Command::toward(view.goal - view.gripper, OPEN)
}
