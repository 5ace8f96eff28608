//! Distilling a teacher into a student.

use std::ops::ControlFlow;

use baselines::learn::{DistillSettings, Distiller, EachEnv, RunError, TrainError, Trainer};
use baselines::{ScriptedPolicy, TrainedPolicy, VecPolicy, evaluate};
use fetch_env::vec_env::VecStep;
use fetch_env::{EnvError, FetchObservation, KinematicEnv, Task, make_kinematic};

type Teacher = Box<dyn VecPolicy + Send>;

fn make(id: &str) -> impl Fn() -> Result<KinematicEnv, EnvError> + '_ {
    move || Ok(make_kinematic(id)?)
}

/// A small student of a scripted teacher, which remembers whether it has grasped.
fn scripted() -> (Teacher, DistillSettings) {
    let mut settings = DistillSettings::of_task(Task::PickAndPlace, false);
    settings.hidden = vec![32];
    settings.num_envs = 3;
    settings.batch_size = 16;
    settings.steps_per_round = 70;
    settings.evaluation_interval = 300;
    settings.evaluation_episodes = 3;
    settings.capacity = 500;
    let teacher = EachEnv::new(ScriptedPolicy::new(Task::PickAndPlace), settings.num_envs);
    (Box::new(teacher), settings)
}

const ID: &str = "FetchPickAndPlace-v4";
const STEPS: u64 = 1_200;

fn distill(num_threads: usize) -> Result<Distiller<KinematicEnv>, TrainError> {
    let (teacher, settings) = scripted();
    let mut distiller = Distiller::new(make(ID), teacher, settings, 7, num_threads)?;
    distiller.run(STEPS, None, |_, _| ControlFlow::Continue(()))?;
    Ok(distiller)
}

#[test]
fn the_bits_depend_on_settings_and_seed_alone() {
    let [one, two] = [1, 2].map(|num_threads| distill(num_threads).unwrap());
    let policy = one.policy(ID).unwrap();
    assert_eq!(policy, two.policy(ID).unwrap());
    let rates = |distiller: &Distiller<_>| -> Vec<_> {
        let rows = distiller.rows().iter();
        rows.map(|row| (row.counters.steps, row.success_rate, row.diagnostics.clone())).collect()
    };
    assert_eq!(rates(&one), rates(&two));
    assert_eq!(one.rows().len(), 4);
    let (teacher, settings) = scripted();
    let mut other = Distiller::new(make(ID), teacher, settings, 8, 1).unwrap();
    other.run(STEPS, None, |_, _| ControlFlow::Continue(())).unwrap();
    assert_ne!(policy.layers(), other.policy(ID).unwrap().layers());
}

#[test]
fn a_stopped_run_ends_with_the_same_bits() {
    let whole = distill(1).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (teacher, settings) = scripted();
    let mut distiller = Distiller::new(make(ID), teacher, settings, 7, 1).unwrap();
    distiller.save(&folder).unwrap();
    let mut saves = 0;
    while !distiller.is_over(STEPS, None) {
        // Also in the middle of an evaluation.
        let mut steps = 0;
        distiller
            .cycle(STEPS, || {
                steps += 1;
                saves % 2 == 0 || steps < 3
            })
            .unwrap();
        distiller.save(&folder).unwrap();
        saves += 1;
        distiller = Distiller::resume(make(ID), scripted().0, &folder, 1).unwrap();
    }
    assert!(saves > whole.rows().len());
    assert_eq!(distiller.policy(ID).unwrap(), whole.policy(ID).unwrap());
    let rates = |distiller: &Distiller<_>| -> Vec<_> {
        distiller.rows().iter().map(|row| (row.counters.steps, row.success_rate)).collect()
    };
    assert_eq!(rates(&distiller), rates(&whole));
    let kept = std::fs::read_dir(&folder).unwrap().count();
    assert_eq!(kept, 2);

    // Neither another environment nor a learner without a teacher continues it.
    let error = Distiller::resume(make("FetchPush-v4"), scripted().0, &folder, 1).unwrap_err();
    assert!(error.to_string().contains("different environment"), "{error}");
    let error = Trainer::resume(make(ID), &folder, 1).unwrap_err();
    assert!(error.to_string().contains("damaged"), "{error}");
}

#[test]
fn a_student_learns_to_reach_from_less_than_its_teacher_sees() {
    let teacher = TrainedPolicy::shipped(Task::Reach).unwrap();
    let mut settings = DistillSettings::of_task(Task::Reach, false);
    settings.hidden = vec![64];
    settings.batch_size = 64;
    settings.evaluation_interval = 10_000;
    settings.evaluation_episodes = 10;
    // Velocities.
    settings.left_out = (5..10).collect();
    let make = make("FetchReach-v4");
    let mut distiller = Distiller::new(&make, Box::new(teacher), settings, 0, 2).unwrap();
    distiller.run(6_400, None, |_, _| ControlFlow::Continue(())).unwrap();
    assert_eq!(distiller.rows().len(), 1);
    let mut policy = distiller.policy("FetchReach-v4").unwrap();
    let result = evaluate(&mut make().unwrap(), &mut policy, 50, 0, |_| ()).unwrap();
    assert!(result.summary().unwrap().success_rate.value >= 0.98);
    // It does not see what is left out.
    let weights = &policy.layers()[0].weights;
    assert!(weights[5 * 64..10 * 64].iter().all(|weight| *weight == 0.0));
    assert!(weights[..5 * 64].iter().all(|weight| *weight != 0.0));
}

#[test]
fn what_cannot_be_distilled_is_refused() {
    let new = |teacher: Teacher, settings| Distiller::new(make(ID), teacher, settings, 0, 1);
    let (teacher, settings) = scripted();
    let bad = DistillSettings { left_out: vec![25], ..settings.clone() };
    let error = new(teacher, bad).unwrap_err();
    assert!(matches!(error, TrainError::Setting { name: "left_out", .. }), "{error}");
    let reach = Box::new(TrainedPolicy::shipped(Task::Reach).unwrap());
    assert!(matches!(new(reach, settings.clone()), Err(TrainError::Evaluate(_))));
    let lost = |_: &VecStep<FetchObservation>, actions: &mut [f32]| {
        actions.fill(f32::NAN);
    };
    let mut distiller = new(Box::new(lost), settings.clone()).unwrap();
    let error = distiller.run(1, None, |_, _| ControlFlow::Continue(())).unwrap_err();
    let TrainError::Run { source, .. } = error else { panic!("{error}") };
    assert!(matches!(*source, RunError::Teacher { env_index: 0 }), "{source}");
    // The third environment has no teacher.
    let two = Box::new(EachEnv::new(ScriptedPolicy::new(Task::PickAndPlace), 2));
    let error = new(two, settings.clone()).unwrap().cycle(1, || true).unwrap_err();
    let TrainError::Run { source, .. } = error else { panic!("{error}") };
    assert!(matches!(*source, RunError::Teacher { env_index: 2 }), "{source}");
    let error = settings.with("learning_rat=1").unwrap_err();
    assert!(error.to_string().contains("learning_rate"), "{error}");
    assert!(settings.with("batch_size=0").is_err());
}

/// Pictures of MuJoCo. Without OpenGL, there is nothing to test, unless `MUJOCO_GL` demands it.
#[cfg(feature = "render")]
mod pixels {
    use testing::unless_blind;

    use super::*;
    use crate::seeing::{PixelEnv, maker, sight};
    use baselines::TrainedPolicyError;

    type Teacher = Box<dyn VecPolicy<fetch_env::PixelObservation<FetchObservation>> + Send>;

    fn teacher() -> Result<Teacher, TrainedPolicyError> {
        Ok(Box::new(TrainedPolicy::shipped(Task::Reach)?))
    }

    #[test]
    fn a_student_learns_to_reach_from_pictures() {
        let sight = sight(24);
        let make = maker("FetchReach-v4", &sight);
        if unless_blind(make()).unwrap().is_none() {
            return;
        }
        let mut settings = DistillSettings::of_task(Task::Reach, true);
        settings.hidden = vec![64];
        settings.num_envs = 8;
        settings.batch_size = 32;
        settings.updates_per_step = 1;
        settings.evaluation_interval = 1_600;
        settings.evaluation_episodes = 10;
        let folder = tempfile::tempdir().unwrap();
        let run = |threads, stops: bool| {
            let mut student = Distiller::with_pixels(
                &make,
                teacher().unwrap(),
                &sight,
                settings.clone(),
                0,
                threads,
            )
            .unwrap();
            student
                .run(if stops { 1_600 } else { 3_200 }, None, |_, _| ControlFlow::Continue(()))
                .unwrap();
            student
        };
        let whole = run(2, false);
        run(1, true).save(&folder).unwrap();
        let mut stopped =
            Distiller::resume_pixels(&make, teacher().unwrap(), &sight, &folder, 1).unwrap();
        stopped.run(3_200, None, |_, _| ControlFlow::Continue(())).unwrap();
        let rates = |student: &Distiller<PixelEnv>| -> Vec<_> {
            let rows = student.rows().iter();
            rows.map(|row| (row.success_rate, row.diagnostics.clone())).collect()
        };
        assert_eq!(rates(&whole), rates(&stopped));
        let mut policy = whole.pixel_policy("FetchReach-v4").unwrap();
        assert_eq!(policy, stopped.pixel_policy("FetchReach-v4").unwrap());
        assert!(whole.policy("FetchReach-v4").is_err());
        // The policy is what was evaluated.
        let mut env = make().unwrap();
        let result = evaluate(&mut env, &mut policy, 20, 1 << 45, |_| ()).unwrap();
        let success = result.summary().unwrap().success_rate.value;
        assert!(success >= 0.4, "{success}, {:?}", rates(&whole));
    }
}
