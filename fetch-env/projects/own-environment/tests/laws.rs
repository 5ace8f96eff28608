//! The environment keeps every law of the checker, and everything that takes environments takes it.

use std::num::NonZeroU32;

use baselines::{Collector, VecPolicy, buffer_config};
use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::vec_env::{AutoresetMode, VecConfig, VecStep};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    DistanceReward, Env, EnvError, EnvExt, GoalEnv, GoalObservation, GoalReward, TimeLimit, VecEnv,
};
use her_relabel::{Batch, GoalStrategy, HerBuffer, Sampler, UnitInterval};
use own_environment::{PuckEnv, PuckObservation};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const LIMIT: NonZeroU32 = NonZeroU32::new(50).unwrap();
const NUM_ENVS: usize = 3;

fn make() -> Result<Wrapped<PuckEnv, TimeLimit>, EnvError> {
    PuckEnv::new()?.wrap(TimeLimit::new(LIMIT))
}

fn make_vec(autoreset: AutoresetMode) -> Result<VecEnv<Wrapped<PuckEnv, TimeLimit>>> {
    let envs = [make()?, make()?, make()?];
    Ok(VecEnv::new(envs, VecConfig::default().with_autoreset(autoreset))?)
}

fn make_buffer() -> Result<HerBuffer<f32>> {
    Ok(HerBuffer::new(buffer_config(10_000, &make()?)?.with_num_envs(NUM_ENVS))?)
}

/// Pushes toward the goal and brakes: a policy of one environment.
fn toward_goal(observation: &PuckObservation, force: &mut [f32]) {
    let goal = observation.desired_goal();
    for (axis, force) in force.iter_mut().enumerate() {
        let [place, speed] = [0, 2].map(|part| observation.observation()[part + axis]);
        *force = 4.0 * (goal[axis] as f32 - place) - 3.0 * speed;
    }
}

/// The same policy for all rows of a batch.
struct TowardGoals;

impl VecPolicy<PuckObservation> for TowardGoals {
    fn act_all(&mut self, batch: &VecStep<PuckObservation>, forces: &mut [f32]) {
        let states = batch.observation().chunks_exact(4);
        let rows = states.zip(batch.desired_goal().chunks_exact(2));
        for (force, (state, goal)) in forces.chunks_exact_mut(2).zip(rows) {
            for axis in 0..2 {
                force[axis] = 4.0 * (goal[axis] as f32 - state[axis]) - 3.0 * state[2 + axis];
            }
        }
    }
}

#[test]
fn the_environment_keeps_all_laws() {
    let options = CheckOptions::default().with_max_episode_steps(Some(LIMIT));
    let report = check_goal_env(make, &options);
    assert!(report.passed(), "{report}");
    // Without a limit, too.
    let options = options.with_max_episode_steps(None);
    let report = check_goal_env(PuckEnv::new, &options);
    assert!(report.passed(), "{report}");
}

#[test]
fn a_policy_solves_it() -> Result {
    let evaluation = baselines::evaluate(&mut make()?, &mut toward_goal, 20, 0, |_| ())?;
    assert_eq!(evaluation.summary()?.success_rate.value, 1.0);
    Ok(())
}

#[test]
fn many_environments_give_the_results_of_single_ones() -> Result {
    let mut envs = make_vec(AutoresetMode::SameStep)?;
    envs.reset(Some(7))?;
    let mut single = make()?;
    single.reset(Some(8))?;
    for _ in 0..2 * LIMIT.get() {
        let step = single.step(&[0.3, -0.2])?;
        let batch = envs.step(&[0.3, -0.2].repeat(NUM_ENVS))?;
        assert_eq!(&batch.next_observation()[4..8], step.observation.observation());
        assert_eq!(batch.reward()[1], step.reward);
        if step.is_last() {
            single.reset(None)?;
        }
    }
    Ok(())
}

#[test]
fn recording_by_hand_stores_what_a_collector_collects() -> Result {
    const NUM_STEPS: usize = 110;
    for autoreset in [AutoresetMode::NextStep, AutoresetMode::SameStep] {
        let mut collected = make_buffer()?;
        let mut collector = Collector::new(make_vec(autoreset)?);
        collector.reset(Some(1), &mut collected)?;
        collector.collect(NUM_STEPS, &mut TowardGoals, &mut collected, |_, _| ())?;

        let mut recorded = make_buffer()?;
        let mut envs = make_vec(autoreset)?;
        let mut forces = [0.0; 2 * NUM_ENVS];
        recorded.record(envs.reset(Some(1))?)?.check()?;
        for _ in 0..NUM_STEPS {
            TowardGoals.act_all(envs.last_step(), &mut forces);
            recorded.record(envs.step(&forces)?)?.check()?;
        }
        assert_eq!(recorded.len(), 2 * NUM_ENVS * LIMIT.get() as usize);
        assert_eq!(draw(&recorded)?, draw(&collected)?);
    }
    Ok(())
}

/// Draws a batch in which most goals are new.
fn draw(buffer: &HerBuffer<f32>) -> Result<Batch<f32>> {
    let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::new();
    sampler.sample(buffer, PuckEnv::new()?.goal_reward(), 3, &mut batch)?;
    Ok(batch)
}

#[test]
fn new_goals_have_the_environments_rewards_also_after_loading() -> Result {
    let mut buffer = make_buffer()?;
    Collector::new(make_vec(AutoresetMode::NextStep)?).collect(
        200,
        &mut TowardGoals,
        &mut buffer,
        |_, _| (),
    )?;

    let batch = draw(&buffer)?;
    let reward: DistanceReward = *PuckEnv::new()?.goal_reward();
    let as_f64 = |goal: &[f32]| [f64::from(goal[0]), f64::from(goal[1])];
    let goals =
        batch.next_achieved_goal().chunks_exact(2).zip(batch.desired_goal().chunks_exact(2));
    for ((achieved, desired), found) in goals.zip(batch.reward()) {
        assert_eq!(f64::from(*found), reward.reward(&as_f64(achieved), &as_f64(desired)));
    }
    assert!(batch.relabeled().any(|is_new| is_new) && batch.relabeled().any(|is_new| !is_new));

    let folder = tempfile::tempdir()?;
    buffer.save(folder.path().join("buffer"))?;
    assert_eq!(draw(&HerBuffer::load(folder.path().join("buffer"))?)?, batch);
    Ok(())
}
