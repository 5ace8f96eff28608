use super::model::Model;
use crate::{SimError, Task};

/// The built-in model of a task's scene, from the files of the crate's folder `model`, without the
/// shapes that are only seen: they change no bit and cost a third of the speed.
pub(super) fn load(task: Task) -> Result<Model, SimError> {
    load_as(PHYSICS, task)
}

/// The same model with the shapes that are only seen.
pub(super) fn load_visible(task: Task) -> Result<Model, SimError> {
    load_as(PICTURE, task)
}

fn load_as(main: &str, task: Task) -> Result<Model, SimError> {
    let scene = match task {
        Task::Reach => include_str!("../../model/reach.xml"),
        Task::Push => include_str!("../../model/push.xml"),
        Task::PickAndPlace => include_str!("../../model/pick_and_place.xml"),
        Task::Slide => include_str!("../../model/slide.xml"),
    };
    let mut model = Model::from_files(&[
        ("main.xml", main),
        ("scene.xml", scene),
        ("settings.xml", include_str!("../../model/settings.xml")),
        ("robot.xml", include_str!("../../model/robot.xml")),
    ])?;
    model.disable_midphase();
    Ok(model)
}

const PHYSICS: &str = r#"
<mujoco>
  <compiler discardvisual="true"/>
  <include file="scene.xml"/>
</mujoco>"#;

const PICTURE: &str = r#"<mujoco><include file="scene.xml"/></mujoco>"#;
