//! Environments whose pictures show the gripper, which nothing else does.

use baselines::Sight;
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    AddRenderObservation, Camera, EnvError, EnvExt, FreeCamera, MujocoEnv, PixelOptions,
    RenderOptions, Task, make as make_on_mujoco,
};

pub(crate) type PixelEnv = Wrapped<MujocoEnv, AddRenderObservation>;

/// The fingers, and a near picture in which the gripper is.
pub(crate) fn sight(size: u32) -> Sight {
    let camera = FreeCamera { distance: 1.0, elevation: -30.0, ..FreeCamera::REFERENCE };
    let view = RenderOptions::default()
        .with_width(size)
        .with_height(size)
        .with_samples(0)
        .with_goals_shown(false)
        .with_camera(Camera::Free(camera));
    let mut sight = Sight::robot(Task::Reach, PixelOptions::default().with_render(view));
    sight.fields.retain(|field| field.name == "gripper_state");
    sight
}

/// Returns what makes environments with the pictures of a sight.
pub(crate) fn maker<'a>(
    id: &'a str,
    sight: &'a Sight,
) -> impl Fn() -> Result<PixelEnv, EnvError> + 'a {
    move || make_on_mujoco(id)?.wrap(AddRenderObservation::new(sight.pixels.clone()))
}
