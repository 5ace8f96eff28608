//! Fetch's left and right: what a mirror does to each field, and how exactly the arm keeps it.
//!
//! `cargo test --release -p fetch-env --test symmetry -- --nocapture` prints the deviations that
//! `FetchEnv::robot_symmetry` documents.

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

fn symmetry(env: &impl GoalEnv) -> Result<Symmetry> {
    Ok(env.symmetry().ok_or("no symmetry")?)
}

/// What the mirror at y = `plane` does to the elements of a field, by its name.
fn expected(name: &str, values: &[f64], plane: f64) -> Vec<f64> {
    match (name, values) {
        ("grip_pos" | "object_pos", [x, y, z]) => vec![*x, 2.0 * plane - y, *z],
        ("object_rel_pos" | "object_velp" | "grip_velp", [x, y, z]) => vec![*x, -y, *z],
        ("object_rot" | "object_velr", [x, y, z]) => vec![-x, *y, -z],
        ("gripper_state" | "gripper_vel", [right, left]) => vec![*left, *right],
        _ => panic!("{name} has {} elements", values.len()),
    }
}

#[test]
fn each_field_is_mirrored_as_it_should_be() -> Result {
    for id in ids() {
        let env = make_kinematic(id)?;
        let plane = env.inner().simulator().settled().gripper_position.y;
        let Symmetry { observation, goal, action } = symmetry(&env)?;
        let mut mirrored = vec![f64::NAN; observation.len()];
        let numbers: Vec<f64> = (1..=observation.len()).map(|index| 0.1 * index as f64).collect();
        observation.write(&numbers, &mut mirrored)?;
        for field in observation_fields(id.task) {
            let range = field.range.clone();
            let expected = expected(field.name, &numbers[range.clone()], plane);
            assert_eq!(mirrored[range], expected, "{id}: {}", field.name);
        }
        let mut mirrored = [0.0; 3];
        goal.write(&[1.0, 0.5, 0.25], &mut mirrored)?;
        assert_eq!(mirrored, [1.0, 2.0 * plane - 0.5, 0.25]);
        let mut mirrored = [0.0; 4];
        action.write(&[0.1, 0.2, 0.3, 0.4], &mut mirrored)?;
        assert_eq!(mirrored, [0.1, -0.2, 0.3, 0.4]);
    }
    Ok(())
}

#[test]
fn the_reward_is_the_same_in_the_mirror() -> Result {
    let env = make_kinematic("FetchPushDense-v4")?;
    let goal = symmetry(&env)?.goal;
    let mut random = NpRandom::new(3);
    let mut draw = || [0.0; 3].map(|_: f64| random.uniform(0.0, 1.5));
    for _ in 0..100 {
        let (achieved, desired) = (draw(), draw());
        let [mut other, mut wanted] = [[0.0; 3]; 2];
        goal.write(&achieved, &mut other)?;
        goal.write(&desired, &mut wanted)?;
        let pairs = [(achieved, desired), (other, wanted)];
        let rewards = pairs.map(|(achieved, desired)| env.compute_reward(&achieved, &desired));
        let [one, other] = rewards;
        assert!((one? - other?).abs() < 1e-12);
    }
    Ok(())
}

/// How far the gripper is from the mirror image of a gripper that does the same in the mirror, in
/// millimeters, after each of 50 random steps of 20 episodes, in order; and the object likewise
/// after the last step of each. The elements of actions are at most `largest`.
fn deviations<S: Simulator>(
    id: EnvId,
    largest: f64,
    simulator: impl Fn(&SimConfig) -> std::result::Result<S, SimError>,
) -> Result<[Vec<f64>; 2]> {
    let make = || -> Result<FetchEnv<S>> {
        let config = id.config();
        let simulator = simulator(config.sim())?;
        Ok(FetchEnv::new(config, simulator)?)
    };
    let (mut here, mut there) = (make()?, make()?);
    let Symmetry { observation, goal, action } = symmetry(&here)?;
    let (mut grippers, mut objects) = (Vec::new(), Vec::new());
    for seed in 0..20 {
        let start = here.reset(Some(seed))?.observation;
        let mut mirrored = [0.0; 3];
        goal.write(start.desired_goal(), &mut mirrored)?;
        let mut options = FetchResetOptions::default().with_desired_goal(mirrored);
        if let Some(object) = start.object_position() {
            goal.write(&object, &mut mirrored)?;
            options = options.with_object_position([mirrored[0], mirrored[1]]);
        }
        there.reset_with(Some(seed), &options)?;
        let mut random = NpRandom::new(1000 + seed);
        for step in 0..50 {
            let numbers = [0.0; 4].map(|_: f64| random.uniform(-largest, largest));
            let mut mirrored = [0.0; 4];
            action.write(&numbers, &mut mirrored)?;
            let one = here.step(&numbers.map(|x| x as f32))?.observation;
            let other = there.step(&mirrored.map(|x| x as f32))?.observation;
            let mut image = vec![0.0; observation.len()];
            observation.write(one.observation(), &mut image)?;
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
fn the_stand_in_is_symmetric() -> Result {
    for id in ids() {
        // Its reach, which small actions stay within, is not as far to both sides.
        let simulator = |config: &SimConfig| Ok(KinematicSimulator::new(config));
        let [grippers, objects] = deviations(id, 0.5, simulator)?;
        for worst in [grippers.last(), objects.last()].into_iter().flatten() {
            assert!(*worst < 1e-4, "{id}: {worst} mm");
        }
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
#[allow(clippy::print_stdout, reason = "the documentation has its figures")]
fn the_arm_is_nearly_symmetric() -> Result {
    for id in ids() {
        let [grippers, objects] = deviations(id, 1.0, fetch_sim::MujocoSimulator::new)?;
        let share = |sorted: &[f64], percent: usize| {
            sorted.get(sorted.len().saturating_sub(1) * percent / 100).copied().unwrap_or_default()
        };
        let [median, most_of, worst] = [50, 95, 100].map(|percent| share(&grippers, percent));
        let object = [50, 100].map(|percent| share(&objects, percent));
        println!(
            "{id}: gripper {median:.1}, {most_of:.1} and {worst:.0} mm (median, 95 %, most), \
             object at the end {:.1} and {:.0} mm (median, most)",
            object[0], object[1]
        );
        assert!(median < 3.0 && most_of < 15.0, "{id}: {median} and {most_of} mm");
    }
    Ok(())
}

#[test]
fn wrappers_keep_it_if_they_change_neither_observations_nor_actions() -> Result {
    let make = || make_kinematic("FetchReach-v4");
    let symmetry = symmetry(&make()?)?;
    let limit = TimeLimit::new(10.try_into()?);
    let reward = *make()?.goal_reward();
    let kept = make()?
        .wrap(RecordEpisodeStatistics::new())?
        .wrap(limit)?
        .wrap(TransformReward::with_goal_reward(reward, |reward| 2.0 * reward))?;
    assert_eq!(kept.symmetry().as_ref(), Some(&symmetry));
    assert_eq!(make()?.wrap(ClipAction::new())?.symmetry(), None);
    // Through pointers.
    let mut kept = Box::new(kept);
    assert_eq!(kept.symmetry().as_ref(), Some(&symmetry));
    assert_eq!(GoalEnv::symmetry(&&mut kept).as_ref(), Some(&symmetry));
    Ok(())
}

#[test]
fn a_reward_a_task_or_a_model_of_one_s_own_has_what_is_said_of_it() -> Result {
    let make = || make_kinematic("FetchPush-v4").map(|env| env.into_inner());
    let robot = make()?.robot_symmetry()?;
    assert_eq!(make()?.symmetry().as_ref(), Some(&robot));
    let own_reward = make()?.with_goal_reward(*make()?.goal_reward());
    assert_eq!(own_reward.symmetry(), None);
    let own_task = make()?.with_task(Task::Push)?;
    assert_eq!(own_task.symmetry(), None);
    assert_eq!(own_task.with_symmetry(robot.clone()).symmetry().as_ref(), Some(&robot));
    assert_eq!(make()?.with_symmetry(None).symmetry(), None);
    // Whatever was added may stand on one side.
    let extended = make()?.config().clone().with_model(ModelSource::Extended(Extension::default()));
    let simulator = KinematicSimulator::new(extended.sim());
    let extended = FetchEnv::new(extended, simulator)?;
    assert_eq!(extended.symmetry(), None);
    assert_eq!(extended.robot_symmetry()?, robot);
    Ok(())
}

#[test]
fn an_observation_has_as_many_elements_as_its_mirror() -> Result {
    for id in EnvId::ALL {
        let symmetry = symmetry(&make_kinematic(id)?)?;
        assert_eq!(symmetry.observation.len(), FetchObservation::len_of(id.task));
        assert_eq!((symmetry.goal.len(), symmetry.action.len()), (3, 4));
    }
    Ok(())
}
