//! What a task remembers of an episode.

use std::sync::Mutex;

use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::vec_env::{AutoresetMode, VecConfig};
use fetch_env::{
    DistanceReward, Env, EnvError, FetchConfig, FetchSnapshot, FetchTask, GoalObservation,
    KinematicEnv, KinematicSimulator, NpRandom, Simulator, SnapshotEnv, VecEnv, make_kinematic,
};
use serde_json::Value;
use testing::Result;

/// Reach, of which `Lowest` keeps how low the gripper has been: in the memory, or beside it.
#[derive(Debug, Default)]
struct Lowest {
    hidden: Option<Mutex<f64>>,
}

impl FetchTask<KinematicSimulator> for Lowest {
    type Memory = Option<f64>;

    fn goal_len(&self) -> usize {
        1
    }

    fn extra_len(&self) -> usize {
        1
    }

    fn begin_episode(
        &self,
        _: &FetchConfig,
        simulator: &mut KinematicSimulator,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<Option<f64>, EnvError> {
        desired_goal[0] = simulator.settled().gripper_position.z - random.uniform(0.0, 0.1);
        if let Some(hidden) = &self.hidden {
            *hidden.lock().expect("no panic") = f64::INFINITY;
        }
        Ok(None)
    }

    fn remember(
        &self,
        simulator: &KinematicSimulator,
        memory: &mut Option<f64>,
    ) -> Result<(), EnvError> {
        let height = simulator.gripper().position.z;
        *memory = Some(memory.map_or(height, |lowest| lowest.min(height)));
        Ok(())
    }

    fn achieved_goal(
        &self,
        simulator: &KinematicSimulator,
        memory: &Option<f64>,
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        goal[0] = memory.ok_or_else(|| EnvError::other("nothing is remembered"))?;
        if let Some(hidden) = &self.hidden {
            let mut lowest = hidden.lock().expect("no panic");
            *lowest = lowest.min(simulator.gripper().position.z);
            goal[0] = *lowest;
        }
        Ok(())
    }

    fn observe_extra(
        &self,
        _: &KinematicSimulator,
        memory: &Option<f64>,
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        extra[0] = memory.ok_or_else(|| EnvError::other("nothing is remembered"))?;
        Ok(())
    }
}

fn lowest() -> Result<KinematicEnv<DistanceReward, Lowest>, EnvError> {
    Ok(make_kinematic("FetchReach-v4")?.into_inner().with_task(Lowest::default())?.time_limited())
}

const DOWN: [f32; 4] = [0.0, 0.0, -1.0, 0.0];
const UP: [f32; 4] = [0.0, 0.0, 1.0, 0.0];

#[test]
fn a_task_remembers_its_episode_and_no_other() -> Result {
    let mut env = lowest()?;
    let start = env.reset(Some(0))?.observation;
    assert_eq!(start.achieved_goal()[0], start.grip_position()[2], "the reset is remembered");
    let down = env.step(&DOWN)?.observation;
    let up = env.step(&UP)?.observation;
    assert!(down.grip_position()[2] < up.grip_position()[2]);
    assert_eq!(up.achieved_goal(), down.achieved_goal());
    assert_eq!(up.observation()[10], down.achieved_goal()[0]);
    assert_eq!(env.inner().observe()?, up, "looking again remembers nothing new");
    let again = env.reset(None)?.observation;
    assert_eq!(again.achieved_goal()[0], again.grip_position()[2]);
    let options = CheckOptions::default();
    let report = check_goal_env(lowest, &options);
    assert!(report.passed(), "{report}");
    Ok(())
}

#[test]
fn a_snapshot_holds_the_memory_and_one_of_another_memory_is_refused() -> Result {
    let mut env = lowest()?;
    env.reset(Some(0))?;
    env.step(&DOWN)?;
    let snapshot = serde_json::to_string(&env.snapshot())?;
    let up = env.step(&UP)?;
    let mut other = lowest()?;
    other.restore(&serde_json::from_str(&snapshot)?)?;
    assert_eq!(other.step(&UP)?, up);
    let read = |json: &str| serde_json::from_str::<FetchSnapshot<Value, Option<f64>>>(json);
    let json = serde_json::to_string(&env.inner().snapshot())?;
    assert!(read(&json).is_ok());
    let foreign = json.replacen("\"memory\":", "\"memory\":[true],\"other\":", 1);
    assert!(read(&foreign).is_err());
    Ok(())
}

#[test]
fn a_memory_is_that_of_its_environment_on_any_number_of_threads_and_ends_with_the_episode() -> Result
{
    const NUM_ENVS: usize = 5;
    let run = |num_threads| -> Result<Vec<Vec<f64>>> {
        let envs = (0..NUM_ENVS).map(|_| lowest()).collect::<Result<Vec<_>, _>>()?;
        let config = VecConfig::default()
            .with_num_threads(num_threads)
            .with_autoreset(AutoresetMode::SameStep);
        let mut envs = VecEnv::new(envs, config)?;
        let mut random = NpRandom::new(1);
        let mut goals = vec![envs.reset(Some(5))?.achieved_goal().to_vec()];
        for step in 1..=60 {
            let actions: Vec<f32> =
                (0..NUM_ENVS * 4).map(|_| random.uniform(-1.0, 1.0) as f32).collect();
            let batch = envs.step(&actions)?;
            goals.push(batch.achieved_goal().to_vec());
            if step == 50 {
                let heights = batch.observation().chunks(11).map(|row| row[2]);
                assert!(batch.achieved_goal().iter().copied().eq(heights), "a new episode");
            }
        }
        Ok(goals)
    };
    let one = run(1)?;
    assert_eq!(run(2)?, one);
    assert_eq!(run(5)?, one);
    Ok(())
}

#[test]
fn state_beside_the_memory_is_found() {
    let make = || {
        let task = Lowest { hidden: Some(Mutex::new(0.0)) };
        Ok(make_kinematic("FetchReach-v4")?.into_inner().with_task(task)?.time_limited())
    };
    let report = check_goal_env(make, &CheckOptions::default());
    let hidden = report.failures().find(|check| check.name == "snapshot/hidden-state");
    let message = &hidden.expect("it is found").message;
    assert!(message.contains("in the Memory of a task"), "{message}");
}
