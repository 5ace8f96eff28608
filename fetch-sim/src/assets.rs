//! Sources of the robot's model.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::{
    cache::reference_folder, error::SimError, extension::Extension, model_files::ModelFiles,
    task::Task,
};

/// Source of the robot's model.
///
/// # What a scene needs
/// The scenes of the sources [`Folder`](Self::Folder) and [`Files`](Self::Files) need
///
/// | kind | name | tasks | because |
/// |---|---|---|---|
/// | mocap body | `robot0:mocap` | all | an action moves it |
/// | body | `robot0:gripper_link` | all | an action starts from its pose |
/// | site | `robot0:grip` | all | its position and velocity are the gripper's |
/// | joint | `robot0:slide0`, `robot0:slide1`, `robot0:slide2` | all | they place the base |
/// | joint | `robot0:r_gripper_finger_joint` | all | the right finger is observed |
/// | joint | `robot0:l_gripper_finger_joint` | all | the left finger is observed |
/// | joint | `object0:joint` | not Reach | this free joint places the object |
/// | site | `object0` | not Reach | its pose and velocity are the object's |
///
/// and a weld, of any name, that holds the gripper's link at the mocap body; its offset is set to
/// zero, as in the reference. Each actuator must drive a slide or a hinge: its target is the
/// position of that joint plus [`Control::fingers`](crate::Control::fingers). A renderer moves the
/// sites `target0`, `target1` and so on, if they exist, to the goals.
///
/// A missing name is [`SimError::MissingName`], and a joint of another type
/// [`SimError::UnfitModel`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ModelSource {
    /// The crate's own model: the reference's numbers, simple shapes.
    #[default]
    Builtin,
    /// The reference's model with the vendor's meshes, from the user's cache, where
    /// `cargo xtask assets` puts it.
    Reference,
    /// A folder with a scene for each task that you simulate (`reach.xml`, `push.xml`,
    /// `pick_and_place.xml`, `slide.xml`) and the files that the scenes include. They are loaded
    /// exactly as they are.
    Folder(PathBuf),
    /// The built-in model with additions and changes.
    Extended(Extension),
    /// A scene of the task, held in memory; `builtin_files` returns files to start from. It is
    /// loaded as the built-in model is: for physics without visual shapes, and without MuJoCo 3's
    /// midphase. The same files in a folder step slower. If a shape that collides with nothing
    /// should have mass, give its body an `<inertial>`.
    Files(ModelFiles),
}

impl ModelSource {
    /// Returns the file of a task's scene; `None` for a model that is not a file.
    ///
    /// # Errors
    /// [`SimError::NoAssets`] if the file is missing.
    pub fn scene_path(&self, task: Task) -> Result<Option<PathBuf>, SimError> {
        let folder = match self {
            Self::Builtin | Self::Extended(_) | Self::Files(_) => return Ok(None),
            Self::Reference => {
                let no_home = || SimError::NoAssets { path: "the user's cache".into() };
                reference_folder().ok_or_else(no_home)?.join("fetch")
            }
            Self::Folder(folder) => folder.clone(),
        };
        let path = folder.join(task.spec().scene_file);
        if path.is_file() {
            Ok(Some(path))
        } else {
            Err(SimError::NoAssets { path: path.display().to_string() })
        }
    }
}
