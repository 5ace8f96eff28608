//! A user's own task and reward: goals of another length, and more to observe.

use std::{cell::Cell, error::Error};

use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::goal_reward::goal_distance;
use fetch_env::variation::Variation;
use fetch_env::vec_env::VecConfig;
use fetch_env::{
    DistanceReward, Env, EnvError, FetchConfig, FetchEnv, FetchResetOptions, FetchTask, GoalEnvExt,
    GoalObservation, GoalReward, KinematicEnv, KinematicSimulator, MakeError, NpRandom, RewardKind,
    SimConfig, SimError, Simulator, SnapshotEnv, Task, VecEnv, make_kinematic,
};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

/// Bring the gripper to a point and the object to another, with closed fingers: 7 elements.
#[derive(Clone, Debug)]
struct Both;

impl<S: Simulator> FetchTask<S> for Both {
    type Memory = ();

    fn goal_len(&self) -> usize {
        7
    }

    fn extra_len(&self) -> usize {
        2
    }

    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut S,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let start = simulator.settled().gripper_position;
        let object = simulator.object().ok_or_else(|| EnvError::other("no object"))?.position;
        let range = config.target_range();
        let mut near = |center: f64| center + random.uniform(-range, range);
        let drawn = [start.x, start.y, start.z, object.x, object.y, object.z].map(&mut near);
        desired_goal[..6].copy_from_slice(&drawn);
        desired_goal[6] = 0.0;
        Ok(())
    }

    fn achieved_goal(&self, simulator: &S, _: &(), goal: &mut [f64]) -> Result<(), EnvError> {
        let object = simulator.object().ok_or_else(|| EnvError::other("no object"))?;
        goal[..3].copy_from_slice(simulator.gripper().position.as_slice());
        goal[3..6].copy_from_slice(object.position.as_slice());
        goal[6] = simulator.gripper().finger_positions[0];
        Ok(())
    }

    fn observe_extra(&self, simulator: &S, _: &(), extra: &mut [f64]) -> Result<(), EnvError> {
        let gripper = simulator.gripper().position;
        extra.copy_from_slice(&[gripper.norm(), gripper.z]);
        Ok(())
    }
}

/// A reward of minus twice the distance, which ends the episode at the goal.
#[derive(Clone, Debug)]
struct EndsThere;

impl GoalReward for EndsThere {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        -2.0 * goal_distance(achieved_goal, desired_goal)
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        goal_distance(achieved_goal, desired_goal) < 0.2
    }

    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.is_success(achieved_goal, desired_goal)
    }
}

fn both() -> Result<KinematicEnv<EndsThere, Both>, EnvError> {
    let config = FetchConfig::new(Task::PickAndPlace, RewardKind::Sparse);
    let simulator = KinematicSimulator::new(config.sim());
    let env = FetchEnv::new(config, simulator)?.with_goal_reward(EndsThere).with_task(Both)?;
    Ok(env.time_limited())
}

#[test]
fn an_own_task_passes_every_check() {
    let options = CheckOptions::default();
    let report = check_goal_env(both, &options);
    assert!(report.passed(), "{report}");
}

#[test]
fn goals_and_observations_have_the_tasks_lengths() -> Result {
    let mut env = both()?;
    let start = env.reset(Some(3))?.observation;
    assert_eq!(start.desired_goal().len(), 7);
    assert_eq!(start.achieved_goal()[3..6], start.object_position().ok_or("no object")?);
    assert_eq!(start.observation().len(), 25 + 2);
    let [x, y, z] = start.grip_position();
    assert_eq!(start.observation()[25..], [nalgebra::Vector3::new(x, y, z).norm(), z]);
    let step = env.step(&[0.3; 4])?;
    let next = &step.observation;
    assert_eq!(step.reward, env.compute_reward(next.achieved_goal(), next.desired_goal())?);
    assert_eq!(env.inner().goal_positions().len(), 2);
    Ok(())
}

#[test]
fn the_first_goal_is_the_tasks_own_also_among_many() -> Result {
    let goal = both()?.reset(Some(5))?.observation.desired_goal().to_vec();
    assert_eq!(goal[6], 0.0);
    let envs = (0..2).map(|_| both()).collect::<Result<Vec<_>, _>>()?;
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    let first = envs.reset(Some(5))?;
    assert_eq!(first.desired_goal()[..7], goal);
    Ok(())
}

#[test]
fn only_a_goal_of_the_tasks_length_may_be_set() -> Result {
    let mut env = both()?;
    let goal = [0.5; 7];
    let options = FetchResetOptions::default().with_desired_goal(goal);
    assert_eq!(env.reset_with(Some(0), &options)?.observation.desired_goal(), goal);
    let short = FetchResetOptions::default().with_desired_goal([0.5; 3]);
    let expected = EnvError::OptionLength { option: "desired_goal", expected: 7, actual: 3 };
    assert_eq!(env.reset_with(Some(0), &short), Err(expected));
    Ok(())
}

#[test]
fn a_snapshot_of_goals_of_another_length_is_refused() -> Result {
    let (mut own, mut built_in) = (both()?, make_kinematic("FetchPickAndPlace-v4")?);
    own.reset(Some(0))?;
    built_in.reset(Some(0))?;
    let refused = own.inner().clone().restore(&built_in.inner().snapshot());
    let reason = refused.expect_err("another length").to_string();
    assert!(reason.contains("its goal has 3 elements, this one's has 7"), "{reason}");
    Ok(())
}

/// A task that says and does what a test asks.
#[derive(Clone, Debug)]
struct Odd {
    goal_len: fn() -> usize,
    extra_len: fn() -> usize,
    begin_episode: fn(&mut KinematicSimulator, &mut [f64]),
}

/// A task that does nothing.
const NOTHING: Odd = Odd { goal_len: || 3, extra_len: || 0, begin_episode: |_, _| () };

impl FetchTask<KinematicSimulator> for Odd {
    type Memory = ();
    fn goal_len(&self) -> usize {
        (self.goal_len)()
    }
    fn extra_len(&self) -> usize {
        (self.extra_len)()
    }
    fn begin_episode(
        &self,
        _: &FetchConfig,
        simulator: &mut KinematicSimulator,
        _: &mut NpRandom,
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        (self.begin_episode)(simulator, goal);
        Ok(())
    }
    fn achieved_goal(&self, _: &KinematicSimulator, _: &(), _: &mut [f64]) -> Result<(), EnvError> {
        Ok(())
    }
}

impl Odd {
    fn env(self) -> Result<FetchEnv<KinematicSimulator, DistanceReward, Self>, MakeError> {
        make_kinematic("FetchReach-v4")?.into_inner().with_task(self)
    }
}

#[test]
fn a_task_without_goals_or_with_too_many_elements_is_refused() {
    let refused = Odd { goal_len: || 0, ..NOTHING }.env();
    assert!(matches!(refused, Err(MakeError::EmptyGoal)));
    let all = || usize::MAX;
    for task in [Odd { goal_len: all, ..NOTHING }, Odd { extra_len: all, ..NOTHING }] {
        let refused = task.env().map(drop);
        assert!(matches!(refused, Err(MakeError::Space(_))), "{refused:?}");
    }
}

#[test]
fn a_task_is_asked_for_its_lengths_once() -> Result {
    /// Returns 3, and afterwards a length for which there is no memory.
    fn at_first() -> usize {
        thread_local!(static ASKED: Cell<bool> = const { Cell::new(false) });
        if ASKED.replace(true) { usize::MAX } else { 3 }
    }
    for task in [Odd { goal_len: at_first, ..NOTHING }, Odd { extra_len: at_first, ..NOTHING }] {
        // Each thread is asked anew.
        let run = || -> Result<(), EnvError> {
            let mut env = task.env()?;
            env.reset(Some(0))?;
            env.step(&[0.0; 4])?;
            let snapshot = env.snapshot();
            env.restore(&snapshot)
        };
        std::thread::scope(|scope| scope.spawn(run).join().expect("no panic"))?;
    }
    Ok(())
}

#[test]
fn a_goal_that_a_snapshot_refuses_is_refused_by_the_reset() -> Result {
    let bad: [fn(&mut KinematicSimulator, &mut [f64]); 4] = [
        |_, goal| goal[0] = f64::NAN,
        |_, goal| goal[1] = 1e308,
        |_, goal| goal[2] = -1.1e10,
        |_, goal| goal.fill(f64::NEG_INFINITY),
    ];
    for begin_episode in bad {
        let mut env = Odd { begin_episode, ..NOTHING }.env()?;
        let refused = env.reset(Some(0)).expect_err("a bad goal");
        let reason = refused.downcast_ref();
        assert!(matches!(reason, Some(SimError::OutOfRange { .. })), "{refused}");
        assert_eq!(env.step(&[0.0; 4]), Err(EnvError::ResetNeeded));
        // The caller's goal replaces it.
        env.reset_with(None, &FetchResetOptions::default().with_desired_goal([1.0; 3]))?;
    }
    let mut env = Odd { begin_episode: |_, goal| goal.fill(1e10), ..NOTHING }.env()?;
    env.reset(Some(0))?;
    let snapshot = env.snapshot();
    Ok(env.restore(&snapshot)?)
}

#[test]
fn a_task_that_exchanges_the_simulator_is_refused() -> Result {
    let begin_episode = |simulator: &mut KinematicSimulator, _: &mut [f64]| {
        *simulator = KinematicSimulator::new(&SimConfig::new(Task::Slide));
    };
    let refused = Odd { begin_episode, ..NOTHING }.env()?.reset(Some(0)).expect_err("Slide");
    let reason = refused.downcast_ref();
    assert!(matches!(reason, Some(MakeError::SimulatorMismatch { .. })), "{refused}");
    Ok(())
}

/// A task that cannot see what it needs.
#[test]
fn a_task_that_fails_demands_a_reset() -> Result {
    let env = make_kinematic("FetchReach-v4")?.into_inner();
    let mut env = env.with_task(Both)?;
    let failed = env.reset(Some(0)).expect_err("no object in Reach");
    assert_eq!(failed.to_string(), "no object");
    assert_eq!(env.step(&[0.0; 4]), Err(EnvError::ResetNeeded));
    Ok(())
}

/// Reach, whose goals are moved along z by a number that varies.
struct Raised;

impl<S: Simulator> FetchTask<S> for Raised {
    type Memory = ();

    fn goal_len(&self) -> usize {
        3
    }

    fn begin_episode(
        &self,
        _: &FetchConfig,
        _: &mut S,
        _: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        desired_goal.copy_from_slice(&[1.3, 0.75, 0.5]);
        Ok(())
    }

    fn factors(&self) -> &[&str] {
        &["height", "width"]
    }

    fn vary(
        &self,
        _: &mut S,
        numbers: &[Option<f64>],
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        desired_goal[2] += numbers[0].unwrap_or(0.0);
        desired_goal[1] += numbers[1].unwrap_or(0.0);
        Ok(())
    }

    fn achieved_goal(&self, simulator: &S, _: &(), goal: &mut [f64]) -> Result<(), EnvError> {
        goal.copy_from_slice(simulator.gripper().position.as_slice());
        Ok(())
    }
}

#[test]
fn numbers_of_an_own_task_vary_by_name() -> Result {
    let variation = Variation::default().with("height", 0.1..=0.2)?;
    let make = |variation: Variation| -> Result<KinematicEnv<DistanceReward, Raised>, EnvError> {
        let config = FetchConfig::new(Task::Reach, RewardKind::Sparse).with_variation(variation);
        let simulator = KinematicSimulator::new(config.sim());
        Ok(FetchEnv::new(config, simulator)?.with_task(Raised)?.time_limited())
    };
    let mut env = make(variation)?;
    let start = env.reset(Some(1))?.observation;
    let height = env.inner().variation().get("height").ok_or("it varies")?;
    assert!((0.1..=0.2).contains(&height));
    assert_eq!(start.desired_goal(), [1.3, 0.75, 0.5 + height]);
    // Each episode draws again, although the task itself draws nothing.
    env.reset(None)?;
    assert_ne!(env.inner().variation().get("height"), Some(height));
    let options = FetchResetOptions::default().with_factor("width", 0.25);
    let start = env.reset_with(Some(1), &options)?.observation;
    assert_eq!(start.desired_goal(), [1.3, 1.0, 0.5 + height]);
    let mut restored = make(Variation::default())?;
    restored.restore(&env.snapshot())?;
    assert_eq!(restored.inner().variation(), env.inner().variation());
    assert!(make_kinematic("FetchReach-v4")?.restore(&env.snapshot()).is_err());

    let unknown = Variation::default().with("heigth", 0.1)?;
    let error = make(unknown)?.reset(Some(0)).err().ok_or("reset")?.to_string();
    assert!(
        error.starts_with(r#"there is no factor "heigth": the nearest are height, "#),
        "{error}"
    );
    Ok(())
}

/// Reach, whose episode begins after another reset of the simulator.
struct Restarting;

impl<S: Simulator> FetchTask<S> for Restarting {
    type Memory = ();

    fn goal_len(&self) -> usize {
        3
    }

    fn begin_episode(
        &self,
        _: &FetchConfig,
        simulator: &mut S,
        _: &mut NpRandom,
        _: &mut [f64],
    ) -> Result<(), EnvError> {
        Ok(simulator.reset(None)?)
    }

    fn achieved_goal(&self, simulator: &S, _: &(), goal: &mut [f64]) -> Result<(), EnvError> {
        goal.copy_from_slice(simulator.gripper().position.as_slice());
        Ok(())
    }
}

#[test]
fn a_task_that_drops_the_varied_physics_is_refused() -> Result {
    let config = FetchConfig::new(Task::Reach, RewardKind::Sparse);
    let simulator = KinematicSimulator::new(config.sim());
    let mut env = FetchEnv::new(config, simulator)?.with_task(Restarting)?;
    env.reset(Some(0))?;
    let options = FetchResetOptions::default().with_factor("gravity", 5.0);
    let error = env.reset_with(None, &options).err().ok_or("reset")?.to_string();
    assert!(error.contains("call reset_varied()"), "{error}");
    Ok(())
}

#[test]
fn a_snapshot_after_a_failed_varied_reset_is_restored() -> Result {
    let config = FetchConfig::new(Task::Reach, RewardKind::Sparse);
    let simulator = KinematicSimulator::new(config.sim());
    let mut env = FetchEnv::new(config, simulator)?.with_task(Restarting)?;
    env.reset(Some(0))?;
    let options = FetchResetOptions::default().with_factor("action_delay", 3.0);
    env.reset_with(None, &options)?;
    let failing = FetchResetOptions::default().with_factor("gravity", 5.0);
    assert!(env.reset_with(None, &failing).is_err());
    let snapshot = env.snapshot();
    env.restore(&snapshot)?;
    assert_eq!(env.step(&[0.0; 4]), Err(EnvError::ResetNeeded));
    Ok(())
}
