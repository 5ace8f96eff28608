//! An actor that sees pictures and learns from a critic that sees the state. Without OpenGL, there is
//! nothing to test, unless `MUJOCO_GL` demands it.

use std::ops::ControlFlow;

use baselines::learn::{
    AlgorithmSettings, CheckpointError, CurveRow, PixelActorSettings, SacSettings, TrainError,
    TrainSettings, Trainer,
};
use baselines::{Sight, TrainedPolicyError, evaluate};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    AddRenderObservation, Camera, EnvError, EnvExt, FreeCamera, MujocoEnv, PixelOptions,
    RenderError, RenderOptions, Task, make as make_on_mujoco,
};

type PixelEnv = Wrapped<MujocoEnv, AddRenderObservation>;

const ID: &str = "FetchReachDense-v4";

/// The fingers, and a near picture in which the gripper is.
fn sight() -> Sight {
    let camera = FreeCamera { distance: 1.0, elevation: -30.0, ..FreeCamera::REFERENCE };
    let view = RenderOptions::default()
        .with_width(32)
        .with_height(32)
        .with_samples(0)
        .with_goals_shown(false)
        .with_camera(Camera::Free(camera));
    let mut sight = Sight::robot(Task::Reach, PixelOptions::default().with_render(view));
    sight.fields.retain(|field| field.name == "gripper_state");
    sight
}

fn make() -> Result<PixelEnv, EnvError> {
    make_on_mujoco(ID)?.wrap(AddRenderObservation::new(sight().pixels))
}

fn can_draw() -> Result<bool, EnvError> {
    match make() {
        Err(error)
            if matches!(error.downcast_ref(), Some(RenderError::NoOpenGl { .. }))
                && std::env::var_os("MUJOCO_GL").is_none() =>
        {
            Ok(false)
        }
        made => made.map(|_| true),
    }
}

fn settings() -> (TrainSettings, PixelActorSettings) {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.schedule.evaluation_interval = Some(100_000);
    let mut actor = PixelActorSettings::of_task(Task::Reach);
    actor.hidden = vec![64];
    actor.batch_size = 32;
    (settings, actor)
}

fn trainer(
    change: impl FnOnce(&mut TrainSettings, &mut PixelActorSettings),
    num_threads: usize,
) -> Result<Trainer<PixelEnv>, TrainError> {
    let (mut settings, mut actor) = settings();
    change(&mut settings, &mut actor);
    Trainer::with_pixels(make, &sight(), settings, actor, 0, num_threads)
}

#[test]
fn it_learns_to_reach_from_pictures_alone_with_the_same_bits_on_any_number_of_threads() {
    if !can_draw().unwrap() {
        return;
    }
    let run = |num_threads, steps| {
        let small = |settings: &mut TrainSettings, actor: &mut PixelActorSettings| {
            settings.schedule.evaluation_episodes = 4;
            actor.capacity = 500;
        };
        let mut trainer = trainer(small, num_threads).unwrap();
        trainer.run(steps, None, |_, _| ControlFlow::Continue(())).unwrap();
        trainer
    };
    let [one, two] = [1, 2].map(|num_threads| run(num_threads, 500));
    let policy = one.pixel_policy(ID).unwrap();
    assert_eq!(policy, two.pixel_policy(ID).unwrap());
    let rates = |trainer: &Trainer<_>| -> Vec<_> {
        let rows = trainer.rows().iter();
        rows.map(|row: &CurveRow| (row.success_rate, row.final_distance_mean)).collect()
    };
    assert_eq!(rates(&one), rates(&two));

    let mut whole = trainer(|_, _| (), 2).unwrap();
    whole.run(2_400, None, |_, _| ControlFlow::Continue(())).unwrap();
    // The policy is what was evaluated.
    let mut policy = whole.pixel_policy(ID).unwrap();
    let result = evaluate(&mut make().unwrap(), &mut policy, 20, 1 << 45, |_| ()).unwrap();
    let success = result.summary().unwrap().success_rate.value;
    // The first weights reach less than a tenth of the goals.
    assert!(success >= 0.4, "{success}, {:?}", rates(&whole));
    assert_eq!(policy.sight(), &sight());

    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(whole.save(&folder), Err(CheckpointError::PixelActor)));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
}

#[test]
fn what_cannot_learn_from_pictures_is_refused() {
    if !can_draw().unwrap() {
        return;
    }
    let (settings, actor) = settings();
    let error = trainer(|_, actor| actor.critic_updates = 0, 1).unwrap_err();
    assert!(matches!(error, TrainError::Setting { name: "critic_updates", .. }), "{error}");
    let sac = |settings: &mut TrainSettings, _: &mut PixelActorSettings| {
        settings.algorithm = AlgorithmSettings::Sac(SacSettings::default());
    };
    let error = trainer(sac, 1).unwrap_err();
    assert!(matches!(&error, TrainError::NoCritic { algorithm } if algorithm == "sac"), "{error}");
    let mut beyond = sight();
    beyond.fields[0].range = 8..11;
    let error = Trainer::with_pixels(make, &beyond, settings.clone(), actor, 0, 1).unwrap_err();
    assert!(matches!(error, TrainError::Setting { name: "fields", .. }), "{error}");
    let state = Trainer::new(make, settings, 0, 1).unwrap();
    assert!(matches!(state.pixel_policy(ID), Err(TrainedPolicyError::Sight { .. })));
}
