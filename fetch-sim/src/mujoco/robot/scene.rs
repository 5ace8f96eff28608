//! Loading a task's scene for one of its purposes.

use crate::mujoco::binding::{model::Model, version::MujocoVersion};
use crate::{
    assets::ModelSource,
    config::SimConfig,
    error::SimError,
    extension::Extension,
    model_files::ModelFiles,
    task::{Task, spec::ObjectSpec},
};

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

/// File name of an extended scene.
const EXTENSION: &str = "extension.xml";

/// Torsional and rolling friction of the object, which are MuJoCo's defaults.
const OTHER_FRICTION: &str = "0.005 0.0001";

/// Loads the configured scene, with `settings` unless it is a file.
pub(crate) fn load(config: &SimConfig, settings: &str) -> Result<Model, SimError> {
    if let Some(path) = config.model().scene_path(config.task())? {
        return Model::from_path(&path);
    }
    let files = scene_files(config)?;
    let name = files.iter().next().map_or("", |(name, _)| name);
    let main = format!(r#"<mujoco>{settings}<include file="{name}"/></mujoco>"#);
    let main = ("main of fetch-sim.xml", main.as_str());
    let files: Vec<_> = [main].into_iter().chain(files.iter()).collect();
    let mut model = Model::from_files(&files).map_err(|error| match error {
        SimError::Model { reason, .. } => SimError::Model { name: name.into(), reason },
        other => other,
    })?;
    model.disable_midphase();
    Ok(model)
}

/// Returns the files of the configured scene, the main one first: of the built-in model if it is in a
/// [folder](ModelSource::scene_path).
///
/// # Errors
/// [`SimError`] if an [`Extension`] is wrong.
pub fn scene_files(config: &SimConfig) -> Result<ModelFiles, SimError> {
    match config.model() {
        ModelSource::Extended(extension) => extended(config.task(), extension),
        ModelSource::Files(files) => Ok(files.clone()),
        _ => Ok(builtin_files(config.task())),
    }
}

/// Returns the files of a task's built-in model, for the version of MuJoCo with which this crate
/// was built: first the scene, then what it includes. `object.xml` holds the object's geom and
/// site, `robot.xml` the robot, and `settings.xml` the rest.
///
/// To change what an [`Extension`] cannot, edit a file:
///
/// ```
/// use fetch_sim::{ModelSource, SimConfig, Task, builtin_files};
///
/// let files = builtin_files(Task::Push);
/// let scene = files.get("push.xml").expect("the scene").replace("0.25 0.35 0.2", "0.25 0.2 0.2");
/// let narrow_table = files.with_file("push.xml", scene);
/// let config = SimConfig::new(Task::Push).with_model(ModelSource::Files(narrow_table));
/// # #[cfg(not(fetch_sim_no_shim))]
/// fetch_sim::MujocoSimulator::new(&config)?;
/// # Ok::<(), fetch_sim::SimError>(())
/// ```
pub fn builtin_files(task: Task) -> ModelFiles {
    let support = if MujocoVersion::of_shim() < MujocoVersion::FOUR_SUPPORTS {
        include_str!("../../../model/three_supports.xml")
    } else {
        include_str!("../../../model/four_supports.xml")
    };
    let spec = task.spec();
    let files = ModelFiles::new(spec.scene_file, spec.scene_xml)
        .with_file("settings.xml", include_str!("../../../model/settings.xml"))
        .with_file("hulls.xml", include_str!("../../../model/hulls.xml"))
        .with_file("support.xml", support)
        .with_file("robot.xml", include_str!("../../../model/robot.xml"));
    match &spec.object {
        Some(object) => files.with_file("object.xml", object_xml(object)),
        None => files,
    }
}

/// Returns the files of the built-in model with additions and changes.
fn extended(task: Task, extension: &Extension) -> Result<ModelFiles, SimError> {
    extension.check()?;
    // MuJoCo would drop what follows it.
    if extension.xml().contains("</mujoco") {
        let reason = "it ends the root element: add its sections without one".into();
        return Err(SimError::Model { name: EXTENSION.into(), reason });
    }
    let builtin = builtin_files(task);
    let mut added = extension.xml().to_owned();
    let mut changed = None;
    if extension.changes_object() {
        let mut object = task.spec().object.ok_or(SimError::NoObject { task })?;
        object.shape = extension.object_shape().unwrap_or(object.shape);
        object.mass = extension.object_mass().unwrap_or(object.mass);
        if let Some(friction) = extension.object_friction() {
            object.friction = friction;
            // Between two geoms the greater coefficient applies, so the table's would.
            added += &format!(
                r#"<contact><pair geom1="table0" geom2="object0"
                     friction="{friction} {friction} {OTHER_FRICTION} 0.0001"/></contact>"#
            );
        }
        changed = Some(object_xml(&object));
    }
    let scene = task.spec().scene_file;
    let main = format!(r#"<mujoco><include file="{scene}"/>{added}</mujoco>"#);
    let files = builtin.iter().map(|(name, contents)| match (name, &changed) {
        ("object.xml", Some(object)) => (name, object.as_str()),
        _ => (name, contents),
    });
    Ok([(EXTENSION, main.as_str())].into_iter().chain(files).collect())
}

/// Returns the geom of an object, and the site at its center.
fn object_xml(object: &ObjectSpec) -> String {
    let ObjectSpec { shape, mass, friction, .. } = object;
    let (mjcf_type, count) = shape.mjcf_type();
    let sizes = shape.sizes();
    let size = sizes[..count].iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    // The site, a red ball, stays within the object.
    let site = sizes.into_iter().fold(0.02, f64::min);
    format!(
        r#"<mujocoinclude>
  <geom name="object0" type="{mjcf_type}" size="{size}" mass="{mass}" friction="{friction} {OTHER_FRICTION}"
        material="object"/>
  <site name="object0" size="{site}" rgba="1 0 0 1"/>
</mujocoinclude>
"#
    )
}
