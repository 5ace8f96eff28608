//! Plans are the same on any number of threads, and their episodes end as they promise.

mod plane;

use std::slice;

use baselines::{
    Episode, Plan, PlanEnv, PlannedPolicy, Planner, PlannerError, PlannerSettings, PolicyError,
    ScriptedPolicy, ZeroPolicy, evaluate,
};
use fetch_env::{Env, SnapshotEnv, Task, make_kinematic};
use plane::Plane;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// The settings of a short search.
fn short() -> PlannerSettings {
    PlannerSettings { population: 7, elites: 3, iterations: 4, ..PlannerSettings::default() }
}

/// Plays a plan from the reset, and checks that it ends as it says.
fn check_replay<E: PlanEnv>(env: &mut E, plan: &Plan, seed: u64) -> Result {
    let mut policy = PlannedPolicy::new(plan.actions.clone());
    let replayed = evaluate(env, &mut policy, 1, seed, |_| ())?.episodes.remove(0);
    assert_eq!(replayed, Episode { seed: Some(seed), ..plan.episode.clone() });
    let bits =
        |episode: &Episode| [episode.episode_return.to_bits(), episode.final_distance.to_bits()];
    assert_eq!(bits(&replayed), bits(&plan.episode));
    assert_eq!(plan.steps_to_goal.is_some(), replayed.success);
    Ok(())
}

#[test]
fn the_number_of_threads_changes_nothing() -> Result {
    for task in [Task::Push, Task::Slide] {
        let id = format!("Fetch{task}-v4");
        let plan = |threads: usize, seed| -> Result<_> {
            let envs = (0..threads).map(|_| make_kinematic(&*id));
            let mut envs = envs.collect::<Result<Vec<_>, _>>()?;
            let start = envs[0].reset(Some(11))?.observation;
            let settings = PlannerSettings { fewest_steps: true, seed, ..short() };
            Ok(Planner::new(settings)?.plan_task(&mut envs, &start, task)?)
        };
        let one = plan(1, 0)?;
        let searches = if task == Task::Slide { 2 } else { 1 };
        assert_eq!(one.rollouts, 1 + searches * 4 * 7);
        for threads in [2, 3, 9] {
            assert_eq!(plan(threads, 0)?, one, "{task} on {threads} threads");
        }
    }
    Ok(())
}

#[test]
fn the_seed_decides_the_candidates() -> Result {
    let mut env = make_kinematic("FetchPush-v4")?;
    let start = env.reset(Some(11))?.observation;
    let mut plan = |seed| -> Result<_> {
        let settings = PlannerSettings { fewest_steps: true, seed, ..short() };
        let planner = Planner::new(settings)?;
        Ok(planner.plan_task(slice::from_mut(&mut env), &start, Task::Push)?.actions)
    };
    assert_eq!(plan(1)?, plan(1)?);
    assert_ne!(plan(1)?, plan(2)?);
    Ok(())
}

#[test]
fn a_plan_is_no_worse_than_what_it_began_with() -> Result {
    let mut env = make_kinematic("FetchSlide-v4")?;
    let planner = Planner::new(short())?;
    let mut solved = [0, 0];
    for seed in 0..20 {
        let start = env.reset(Some(seed))?.observation;
        let snapshot = env.snapshot();
        let first = Plan::record(&mut env, &start, &mut ScriptedPolicy::new(Task::Slide))?;
        env.restore(&snapshot)?;
        let plan = planner.plan_task(slice::from_mut(&mut env), &start, Task::Slide)?;
        assert_eq!(env.snapshot(), snapshot, "the environment is at the start again");
        assert!(plan.episode.success || !first.episode.success);
        assert!(
            plan.episode.success || plan.episode.final_distance <= first.episode.final_distance
        );
        check_replay(&mut env, &plan, seed)?;
        solved[0] += usize::from(first.episode.success);
        solved[1] += usize::from(plan.episode.success);
    }
    assert!(solved[0] < solved[1], "{solved:?}");
    Ok(())
}

/// The environment is the test's own, and the plan begins in the middle of an episode.
#[test]
fn any_environment_with_snapshots_is_planned_in() -> Result {
    let mut envs = [Plane::make()?, Plane::make()?];
    let planner = Planner::new(PlannerSettings::default())?;
    for seed in 0..5 {
        envs[0].reset(Some(seed))?;
        let now = envs[0].step(&[0.4, -0.3])?.observation;
        let plan = planner.plan(&mut envs, &now, &mut ZeroPolicy)?;
        assert!(plan.episode.success, "{plan:?}");
        assert_eq!(plan.actions.len(), plane::STEPS as usize - 1);
        for env in &mut envs {
            let mut policy = PlannedPolicy::new(plan.actions.clone());
            let replayed = Plan::record(env, &now, &mut policy)?;
            assert_eq!(replayed, Plan { rollouts: 1, ..plan.clone() });
        }
    }
    Ok(())
}

#[test]
fn wrong_usage_is_a_typed_error() -> Result {
    let defaults = PlannerSettings::default;
    for (name, settings) in [
        ("population", PlannerSettings { population: 1, ..defaults() }),
        ("elites", PlannerSettings { elites: 25, ..defaults() }),
        ("iterations", PlannerSettings { iterations: usize::MAX, ..defaults() }),
        ("knots", PlannerSettings { knots: 1, ..defaults() }),
        ("spread", PlannerSettings { spread: f64::NAN, ..defaults() }),
    ] {
        let error = Planner::new(settings).err().ok_or("no error")?;
        assert!(matches!(error, PlannerError::Setting { name: n, .. } if n == name), "{error}");
    }

    let planner = Planner::new(defaults())?;
    let mut reach = make_kinematic("FetchReach-v4")?;
    let before_reset = reach.snapshot();
    let start = reach.reset(Some(0))?.observation;
    let error = planner.plan(&mut [] as &mut [fetch_env::KinematicEnv], &start, &mut ZeroPolicy);
    assert!(matches!(error, Err(PlannerError::NoEnvironment)));
    let mut many = vec![Plane::make()?; 1_025];
    let place = many[0].reset(Some(0))?.observation;
    let error = planner.plan(&mut many, &place, &mut ZeroPolicy);
    assert!(matches!(error, Err(PlannerError::TooManyEnvironments { actual: 1_025, most: 1_024 })));
    planner.plan(&mut many[..1_024], &place, &mut ZeroPolicy)?;
    let error = planner.plan_task(slice::from_mut(&mut reach), &start, Task::Slide);
    assert!(matches!(error, Err(PlannerError::Policy(PolicyError::Scripted { .. }))));
    let mut other = PlannedPolicy::new(vec![vec![0.0; 4], vec![0.0; 3]]);
    let error = planner.plan(slice::from_mut(&mut reach), &start, &mut other);
    assert!(matches!(
        error,
        Err(PlannerError::Policy(PolicyError::Planned { expected: 4, actual: 3 }))
    ));
    let mut mixed = [make_kinematic("FetchPush-v4")?, make_kinematic("FetchSlide-v4")?];
    let start = mixed[0].reset(Some(0))?.observation;
    let error = planner.plan(&mut mixed, &start, &mut ZeroPolicy);
    assert!(matches!(error, Err(PlannerError::Environment(_))));
    reach.restore(&before_reset)?;
    let error = planner.plan_task(slice::from_mut(&mut reach), &start, Task::Reach);
    assert!(matches!(error, Err(PlannerError::Environment(fetch_env::EnvError::ResetNeeded))));
    let mut unbounded = Plane::unbounded()?;
    let start = unbounded.reset(Some(0))?.observation;
    let error = planner.plan(slice::from_mut(&mut unbounded), &start, &mut ZeroPolicy);
    assert!(matches!(error, Err(PlannerError::Unbounded { index: 0, .. })));
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
fn starts_are_solved_on_the_real_physics() -> Result {
    for (task, seeds) in [(Task::Reach, 0..10), (Task::Push, 0..3), (Task::Slide, 2..5)] {
        let make = || fetch_env::make(&*format!("Fetch{task}-v4"));
        let mut envs = [make()?, make()?];
        let planner = Planner::new(PlannerSettings::default())?;
        for seed in seeds {
            let start = envs[0].reset(Some(seed))?.observation;
            let plan = planner.plan_task(&mut envs, &start, task)?;
            assert!(plan.episode.success, "{task}, seed {seed}: {:?}", plan.episode);
            check_replay(&mut envs[1], &plan, seed)?;
        }
    }
    Ok(())
}
