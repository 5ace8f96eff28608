use super::model::Model;
use crate::{SimError, Task};

/// Compiles the built-in model of a task's scene: the files of the crate's folder `model`.
pub(super) fn load(task: Task) -> Result<Model, SimError> {
    let scene = match task {
        Task::Reach => ("reach.xml", include_str!("../../model/reach.xml")),
        Task::Push => ("push.xml", include_str!("../../model/push.xml")),
        Task::PickAndPlace => {
            ("pick_and_place.xml", include_str!("../../model/pick_and_place.xml"))
        }
        Task::Slide => ("slide.xml", include_str!("../../model/slide.xml")),
    };
    Model::from_files(&[
        scene,
        ("settings.xml", include_str!("../../model/settings.xml")),
        ("robot.xml", include_str!("../../model/robot.xml")),
    ])
}
