//! Loading a task's scene for one of its purposes.

use crate::mujoco::binding::{model::Model, version::MujocoVersion};
use crate::{config::SimConfig, error::SimError};

/// Settings for physics: without visual shapes, which change no bit but make steps slower.
pub(crate) const PHYSICS: &str = r#"<compiler discardvisual="true"/>"#;

/// Settings for pictures, with fewer facets than MuJoCo's default, because software OpenGL is slow.
pub(crate) const PICTURE: &str =
    r#"<visual><quality numslices="24" numstacks="6" numquads="1"/></visual>"#;

/// Settings for small pictures, with just enough facets for the goal's ball not to fall between the
/// pixels.
#[cfg(feature = "render")]
pub(crate) const SMALL_PICTURE: &str =
    r#"<visual><quality numslices="8" numstacks="4" numquads="1"/></visual>"#;

/// Loads the configured scene, the built-in one with `settings`.
pub(crate) fn load(config: &SimConfig, settings: &str) -> Result<Model, SimError> {
    if let Some(path) = config.model().scene_path(config.task())? {
        return Model::from_path(&path);
    }
    let support = if MujocoVersion::of_library()? < MujocoVersion::FOUR_SUPPORTS {
        include_str!("../../../model/three_supports.xml")
    } else {
        include_str!("../../../model/four_supports.xml")
    };
    let main = format!(r#"<mujoco>{settings}<include file="scene.xml"/></mujoco>"#);
    let mut model = Model::from_files(&[
        ("main.xml", &main),
        ("scene.xml", config.task().spec().scene_xml),
        ("settings.xml", include_str!("../../../model/settings.xml")),
        ("hulls.xml", include_str!("../../../model/hulls.xml")),
        ("support.xml", support),
        ("robot.xml", include_str!("../../../model/robot.xml")),
    ])?;
    model.disable_midphase();
    Ok(model)
}
