//! Environments whose pictures show the gripper, which nothing else does, and the policies that come
//! with the crate.

use baselines::Sight;
#[cfg(feature = "pixel-policies")]
use baselines::{PixelPolicy, evaluate_vec};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    AddRenderObservation, Camera, EnvError, EnvExt, FreeCamera, MujocoEnv, PixelOptions,
    RenderOptions, Task, make as make_on_mujoco,
};
#[cfg(feature = "pixel-policies")]
use fetch_env::{EnvId, RewardKind, VecEnv, vec_env::VecConfig};
#[cfg(feature = "pixel-policies")]
use testing::unless_blind;

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

#[cfg(feature = "pixel-policies")]
#[test]
fn the_policies_of_this_crate_are_of_their_tasks_and_succeed() -> testing::Result {
    for task in [Task::Push, Task::PickAndPlace] {
        let mut policy = PixelPolicy::shipped(task)?;
        let env_id = EnvId { task, reward: RewardKind::Sparse };
        assert_eq!(policy.header().env_id, env_id.to_string());
        assert_eq!(*policy.sight(), Sight::of_task(task));
        assert!(policy.to_bytes()?.len() < 700_000);
        let pixels = policy.sight().pixels.clone();
        let make = |_| make_on_mujoco(env_id)?.wrap(AddRenderObservation::new(pixels.clone()));
        let envs: Result<Vec<_>, EnvError> = (0..8).map(make).collect();
        let Some(envs) = unless_blind(envs)? else { return Ok(()) };
        let mut envs = VecEnv::new(envs, VecConfig::default())?;
        let measured = evaluate_vec(&mut envs, &mut policy, 16, 1 << 52, |_| ())?.summary()?;
        assert!(measured.success_rate.value >= 0.8, "{env_id}: {measured:?}");
    }
    let error = PixelPolicy::shipped(Task::Slide).expect_err("none comes with it");
    assert!(error.to_string().starts_with("no policy of Slide that sees pictures"), "{error}");
    Ok(())
}
