//! Mirror symmetries of Fetch: what a mirror does to each field, and how exactly the arm keeps
//! them.
//!
//! `cargo test --release -p fetch-env --test symmetry -- --nocapture` prints the deviations that
//! `FetchEnv::robot_symmetries` documents.

use fetch_env::goal_reward::Mirror;
use fetch_env::wrappers::{ClipAction, RecordEpisodeStatistics, TransformReward};
use fetch_env::{
    Env, EnvExt, EnvId, FetchEnv, FetchObservation, FetchResetOptions, GoalEnv, GoalEnvExt,
    GoalObservation, NpRandom, Symmetry, Task, TimeLimit, make_kinematic, observation_fields,
};
use fetch_sim::{Extension, KinematicSimulator, ModelSource, SimConfig, SimError, Simulator};
use testing::Result;

/// The sparse environments of all tasks.
fn ids() -> impl Iterator<Item = EnvId> {
    let is_sparse = |id: &EnvId| !id.to_string().contains("Dense");
    EnvId::ALL.into_iter().filter(is_sparse)
}

/// Mirrors the elements of the named field across y at `plane`.
fn across_y(name: &str, values: &[f64], plane: f64) -> Vec<f64> {
    match (name, values) {
        ("grip_pos" | "object_pos" | "goal", [x, y, z]) => vec![*x, 2.0 * plane - y, *z],
        ("object_rel_pos" | "object_velp" | "grip_velp", [x, y, z]) => vec![*x, -y, *z],
        ("object_rot" | "object_velr", [x, y, z]) => vec![-x, *y, -z],
        ("gripper_state" | "gripper_vel", [right, left]) => vec![*left, *right],
        ("action", [x, y, z, fingers]) => vec![*x, -y, *z, *fingers],
        _ => panic!("{name} has {} elements", values.len()),
    }
}

/// Mirrors the elements of the named field across x at `plane`.
fn across_x(name: &str, values: &[f64], plane: f64) -> Vec<f64> {
    match (name, values) {
        ("grip_pos" | "object_pos" | "goal", [x, y, z]) => vec![2.0 * plane - x, *y, *z],
        ("object_rel_pos" | "object_velp" | "grip_velp", [x, y, z]) => vec![-x, *y, *z],
        ("object_rot" | "object_velr", [x, y, z]) => vec![*x, -y, -z],
        ("gripper_state" | "gripper_vel", [right, left]) => vec![*right, *left],
        ("action", [x, y, z, fingers]) => vec![-x, *y, *z, *fingers],
        _ => panic!("{name} has {} elements", values.len()),
    }
}

fn image(mirror: &Mirror, values: &[f64]) -> Result<Vec<f64>> {
    let mut mirrored = vec![f64::NAN; values.len()];
    mirror.write(values, &mut mirrored)?;
    Ok(mirrored)
}

#[test]
fn each_field_is_mirrored_as_it_should_be() -> Result {
    for id in ids() {
        let env = make_kinematic(id)?;
        let start = env.inner().simulator().settled().gripper_position;
        let expected = |symmetry: usize, name: &str, values: &[f64]| {
            let values =
                if symmetry == 1 { values.to_vec() } else { across_y(name, values, start.y) };
            if symmetry == 0 { values } else { across_x(name, &values, start.x) }
        };
        let symmetries = env.symmetries();
        assert_eq!(
            symmetries.len(),
            match id.task {
                Task::Push | Task::PickAndPlace => 3,
                _ => 1,
            }
        );
        for (at, Symmetry { observation, goal, action }) in symmetries.iter().enumerate() {
            let numbers: Vec<f64> =
                (1..=observation.len()).map(|index| 0.1 * index as f64).collect();
            let mirrored = image(observation, &numbers)?;
            for field in observation_fields(id.task) {
                let range = field.range.clone();
                let expected = expected(at, field.name, &numbers[range.clone()]);
                assert_eq!(mirrored[range], expected, "{id}: {}", field.name);
            }
            let numbers = [1.0, 0.5, 0.25];
            assert_eq!(image(goal, &numbers)?, expected(at, "goal", &numbers));
            let numbers = [0.1, 0.2, 0.3, 0.4];
            assert_eq!(image(action, &numbers)?, expected(at, "action", &numbers));
        }
    }
    Ok(())
}

#[test]
fn the_reward_is_the_same_in_the_mirror() -> Result {
    let env = make_kinematic("FetchPushDense-v4")?;
    let mut random = NpRandom::new(3);
    let mut draw = || [0.0; 3].map(|_: f64| random.uniform(0.0, 1.5));
    for Symmetry { goal, .. } in env.symmetries() {
        for _ in 0..100 {
            let (achieved, desired) = (draw(), draw());
            let reward = env.compute_reward(&achieved, &desired)?;
            let other = env.compute_reward(&image(&goal, &achieved)?, &image(&goal, &desired)?)?;
            assert!((reward - other).abs() < 1e-12);
        }
    }
    Ok(())
}

/// Returns how far the gripper is from the mirror image of a gripper that takes the mirrored
/// actions, in millimeters, after each of 50 random steps of 20 episodes, sorted; and the same for
/// the object after the last step of each episode. The elements of actions are at most `largest`.
fn deviations<S: Simulator>(
    id: EnvId,
    symmetry: usize,
    largest: f64,
    simulator: impl Fn(&SimConfig) -> std::result::Result<S, SimError>,
) -> Result<[Vec<f64>; 2]> {
    let make = || -> Result<FetchEnv<S>> {
        let config = id.config();
        let simulator = simulator(config.sim())?;
        Ok(FetchEnv::new(config, simulator)?)
    };
    let (mut here, mut there) = (make()?, make()?);
    let Symmetry { observation, goal, action } = &here.symmetries()[symmetry];
    let (mut grippers, mut objects) = (Vec::new(), Vec::new());
    for seed in 0..20 {
        let start = here.reset(Some(seed))?.observation;
        let desired_goal = image(goal, start.desired_goal())?;
        let mut options = FetchResetOptions::default().with_desired_goal(desired_goal);
        if let Some(object) = start.object_position() {
            let object = image(goal, &object)?;
            options = options.with_object_position([object[0], object[1]]);
        }
        there.reset_with(Some(seed), &options)?;
        let mut random = NpRandom::new(1000 + seed);
        for step in 0..50 {
            let numbers = [0.0; 4].map(|_: f64| random.uniform(-largest, largest));
            let mirrored: Vec<f32> = image(action, &numbers)?.iter().map(|x| *x as f32).collect();
            let one = here.step(&numbers.map(|x| x as f32))?.observation;
            let other = there.step(&mirrored)?.observation;
            let image = image(observation, one.observation())?;
            let millimeters = |field: &str| {
                let field = observation_fields(id.task).iter().find(|known| known.name == field)?;
                let range = field.range.clone();
                let pairs = image[range.clone()].iter().zip(&other.observation()[range]);
                let squares: f64 = pairs.map(|(image, other)| (image - other).powi(2)).sum();
                Some(1000.0 * squares.sqrt())
            };
            grippers.extend(millimeters("grip_pos"));
            objects.extend(millimeters("object_pos").filter(|_| step == 49));
        }
    }
    grippers.sort_by(f64::total_cmp);
    objects.sort_by(f64::total_cmp);
    Ok([grippers, objects])
}

#[test]
fn the_kinematic_simulator_is_symmetric() -> Result {
    for id in ids() {
        // It does not reach as far on both sides; small actions stay within its reach.
        let simulator = |config: &SimConfig| Ok(KinematicSimulator::new(config));
        for symmetry in 0..make_kinematic(id)?.symmetries().len() {
            let [grippers, objects] =
                deviations(id, symmetry, if symmetry == 0 { 0.5 } else { 0.2 }, simulator)?;
            for worst in [grippers.last(), objects.last()].into_iter().flatten() {
                assert!(*worst < 1e-4, "{id}, {symmetry}: {worst} mm");
            }
        }
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
#[allow(clippy::print_stdout, reason = "the documentation has its figures")]
fn the_arm_is_nearly_symmetric() -> Result {
    for id in ids() {
        for symmetry in 0..make_kinematic(id)?.symmetries().len() {
            let make = fetch_sim::MujocoSimulator::new;
            let [grippers, objects] = deviations(id, symmetry, 1.0, make)?;
            let share = |sorted: &[f64], percent: usize| {
                let at = sorted.len().saturating_sub(1) * percent / 100;
                sorted.get(at).copied().unwrap_or_default()
            };
            let [median, most_of, worst] = [50, 95, 100].map(|percent| share(&grippers, percent));
            let object = [50, 100].map(|percent| share(&objects, percent));
            println!(
                "{id}, {}: gripper {median:.1}, {most_of:.1} and {worst:.0} mm (median, 95 %, \
                 most), object at the end {:.1} and {:.0} mm (median, most)",
                ["left and right", "front and back", "both"][symmetry],
                object[0],
                object[1]
            );
            // The arm reaches less far to the front than to the back.
            let [most_median, most_most] = if symmetry == 0 { [3.0, 15.0] } else { [30.0, 150.0] };
            assert!(median < most_median && most_of < most_most, "{id}: {median}, {most_of} mm");
        }
    }
    Ok(())
}

#[test]
fn wrappers_keep_it_if_they_change_neither_observations_nor_actions() -> Result {
    let make = || make_kinematic("FetchReach-v4");
    let symmetries = make()?.symmetries();
    let limit = TimeLimit::new(10.try_into()?);
    let reward = *make()?.goal_reward();
    let kept = make()?
        .wrap(RecordEpisodeStatistics::new())?
        .wrap(limit)?
        .wrap(TransformReward::with_goal_reward(reward, |reward| 2.0 * reward))?;
    assert_eq!(kept.symmetries(), symmetries);
    assert_eq!(make()?.wrap(ClipAction::new())?.symmetries(), []);
    // Through pointers.
    let mut kept = Box::new(kept);
    assert_eq!(kept.symmetries(), symmetries);
    assert_eq!(GoalEnv::symmetries(&&mut kept), symmetries);
    Ok(())
}

#[test]
fn a_reward_a_task_or_a_model_of_one_s_own_has_what_is_said_of_it() -> Result {
    let make = || make_kinematic("FetchPush-v4").map(|env| env.into_inner());
    let robot = make()?.robot_symmetries()?;
    assert_eq!(make()?.symmetries(), robot);
    let own_reward = make()?.with_goal_reward(*make()?.goal_reward());
    assert_eq!(own_reward.symmetries(), []);
    let own_task = make()?.with_task(Task::Push)?;
    assert_eq!(own_task.symmetries(), []);
    assert_eq!(own_task.with_symmetries(robot.clone()).symmetries(), robot);
    assert_eq!(make()?.with_symmetries([]).symmetries(), []);
    // Whatever was added may stand on one side.
    let extended = make()?.config().clone().with_model(ModelSource::Extended(Extension::default()));
    let simulator = KinematicSimulator::new(extended.sim());
    let extended = FetchEnv::new(extended, simulator)?;
    assert_eq!(extended.symmetries(), []);
    assert_eq!(extended.robot_symmetries()?, robot);
    Ok(())
}

#[test]
fn an_observation_has_as_many_elements_as_its_mirror() -> Result {
    for id in EnvId::ALL {
        for Symmetry { observation, goal, action } in make_kinematic(id)?.symmetries() {
            assert_eq!(observation.len(), FetchObservation::len_of(id.task));
            assert_eq!((goal.len(), action.len()), (3, 4));
        }
    }
    Ok(())
}
