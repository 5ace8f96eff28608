//! Loading a task's scene for one of its purposes.

use super::model::Model;
use crate::{config::SimConfig, error::SimError, task::Task};

/// Loads the configured scene for physics. The built-in one comes without its visual shapes: they
/// change no bit, but make steps slower.
pub(super) fn load(config: &SimConfig) -> Result<Model, SimError> {
    load_as(config, PHYSICS)
}

/// Loads the configured scene for pictures of up to `side` pixels a side.
#[cfg(feature = "render")]
pub(super) fn load_for_pictures(config: &SimConfig, side: u32) -> Result<Model, SimError> {
    load_as(config, if side <= SMALL_SIDE { SMALL_PICTURE } else { PICTURE })
}

/// Loads the built-in scene with its visual shapes.
pub(super) fn load_visible(task: Task) -> Result<Model, SimError> {
    load_as(&SimConfig::new(task), PICTURE)
}

fn load_as(config: &SimConfig, main: &str) -> Result<Model, SimError> {
    if let Some(path) = config.model().scene_path(config.task())? {
        return Model::from_path(&path);
    }
    let mut model = Model::from_files(&[
        ("main.xml", main),
        ("scene.xml", config.task().spec().scene_xml),
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

/// Has fewer facets than MuJoCo's default, because software OpenGL is slow.
const PICTURE: &str = r#"
<mujoco>
  <visual><quality numslices="24" numstacks="6" numquads="1"/></visual>
  <include file="scene.xml"/>
</mujoco>"#;

/// The largest side, in pixels, of a picture that needs even fewer facets.
#[cfg(feature = "render")]
const SMALL_SIDE: u32 = 128;

/// Has just enough facets for the goal's ball not to fall between the pixels.
#[cfg(feature = "render")]
const SMALL_PICTURE: &str = r#"
<mujoco>
  <visual><quality numslices="8" numstacks="4" numquads="1"/></visual>
  <include file="scene.xml"/>
</mujoco>"#;
