use super::model::Model;
use crate::{SimError, Task};

/// The built-in model of a task's scene, from the files of the crate's folder `model`, without the
/// shapes that are only seen: they change no bit, but make steps slower.
pub(super) fn load(task: Task) -> Result<Model, SimError> {
    load_as(PHYSICS, task)
}

/// The same model with the shapes that are only seen.
pub(super) fn load_visible(task: Task) -> Result<Model, SimError> {
    load_as(PICTURE, task)
}

/// The same for pictures of up to `side` pixels a side.
#[cfg(feature = "render")]
pub(super) fn load_for_pictures(task: Task, side: u32) -> Result<Model, SimError> {
    if side <= SMALL_SIDE { load_as(SMALL_PICTURE, task) } else { load_visible(task) }
}

fn load_as(main: &str, task: Task) -> Result<Model, SimError> {
    let mut model = Model::from_files(&[
        ("main.xml", main),
        ("scene.xml", task.spec().scene_xml),
        ("settings.xml", include_str!("../../model/settings.xml")),
        ("hulls.xml", include_str!("../../model/hulls.xml")),
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

/// Software OpenGL takes its time for every facet: these are fewer than MuJoCo's defaults.
const PICTURE: &str = r#"
<mujoco>
  <visual><quality numslices="24" numstacks="6" numquads="1"/></visual>
  <include file="scene.xml"/>
</mujoco>"#;

/// Pictures up to this size, in pixels a side, need fewer still, but not so few that the goal's ball
/// falls between the pixels.
#[cfg(feature = "render")]
const SMALL_SIDE: u32 = 128;

#[cfg(feature = "render")]
const SMALL_PICTURE: &str = r#"
<mujoco>
  <visual><quality numslices="8" numstacks="4" numquads="1"/></visual>
  <include file="scene.xml"/>
</mujoco>"#;
