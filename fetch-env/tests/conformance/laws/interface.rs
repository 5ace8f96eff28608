//! Laws of what lies between a policy and the robot.

use fetch_env::variation::{InterfaceFactor, Variation};
use fetch_env::{
    Env, EnvId, FetchObservation, FetchResetOptions, GoalEnvExt, GoalObservation, SnapshotEnv,
    observation_fields,
};

use super::{
    Backend, Result, TestEnv, bits, make, make_with_config, random_steps, trajectory_bits,
};

const STEPS: usize = 45;

/// Some actions, within their bounds.
fn actions() -> Vec<[f32; 4]> {
    let element = |number: usize| (number % 9) as f32 / 4.0 - 1.0;
    (0..STEPS).map(|step| [0, 1, 2, 3].map(|axis| element(step * 7 + axis * 5))).collect()
}

/// Returns whether a factor is not of an object that is missing.
fn has(id: EnvId, factor: &str) -> bool {
    id.task.has_object() || !factor.starts_with("object_")
}

/// Returns what an environment observes and rewards of these actions.
fn run<B: Backend>(
    id: EnvId,
    factors: &[(&str, f64)],
    actions: &[[f32; 4]],
) -> Result<Vec<(FetchObservation, f64)>> {
    let options = factors.iter().fold(FetchResetOptions::default(), |options, &(name, value)| {
        options.with_factor(name, value)
    });
    let mut env = make::<B>(id)?;
    let start = env.reset_with(Some(12), &options)?.observation;
    let mut seen = vec![(start, 0.0)];
    for action in actions {
        let step = env.step(action)?;
        let goals = (step.observation.achieved_goal(), step.observation.desired_goal());
        assert_eq!(env.compute_reward(goals.0, goals.1)?, step.reward, "{id}: {factors:?}");
        seen.push((step.observation, step.reward));
    }
    Ok(seen)
}

pub(crate) fn neutral_numbers_change_no_bit<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let neutral = |factor: &InterfaceFactor| match factor {
            InterfaceFactor::ActionLowPass | InterfaceFactor::ActionScale => (factor.name(), 1.0),
            _ => (factor.name(), 0.0),
        };
        let has = |factor: &&InterfaceFactor| has(id, factor.name());
        let neutral: Vec<_> = InterfaceFactor::ALL.iter().filter(has).map(neutral).collect();
        let [plain, neutral] = [&[][..], &neutral].map(|factors| run::<B>(id, factors, &actions()));
        assert_eq!(plain?, neutral?, "{id}");
    }
    Ok(())
}

pub(crate) fn actions_are_scaled<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let doubled: Vec<_> = actions().iter().map(|action| action.map(|e| e * 2.0)).collect();
        let scaled = run::<B>(id, &[("action_scale", 2.0)], &actions())?;
        assert_eq!(scaled, run::<B>(id, &[], &doubled)?, "{id}");
    }
    Ok(())
}

pub(crate) fn actions_pass_the_low_pass<B: Backend>() -> Result {
    const PASS: f64 = 0.3;
    for id in EnvId::ALL {
        let mut last: Option<[f64; 4]> = None;
        let mut pass = |action: &[f32; 4]| {
            let now = action.map(f64::from);
            let out = match last {
                None => now,
                Some(last) => std::array::from_fn(|at| PASS * now[at] + (1.0 - PASS) * last[at]),
            };
            last = Some(out);
            out.map(|element| element as f32)
        };
        let passed: Vec<_> = actions().iter().map(&mut pass).collect();
        let through = run::<B>(id, &[("action_low_pass", PASS)], &actions())?;
        assert_eq!(through, run::<B>(id, &[], &passed)?, "{id}");
    }
    Ok(())
}

pub(crate) fn noise_disturbs_only_what_it_names<B: Backend>() -> Result {
    const SIGMA: f64 = 0.02;
    for id in EnvId::ALL {
        let exact = run::<B>(id, &[], &actions())?;
        let fields = observation_fields(id.task);
        let all = ("observation_noise".to_owned(), 0..FetchObservation::len_of(id.task), 0);
        let goal = ("achieved_goal_noise".to_owned(), 0..0, 3);
        let each =
            fields.iter().map(|field| (format!("{}_noise", field.name), field.range.clone(), 0));
        for (name, elements, goals) in each.chain([all, goal]) {
            let noisy = run::<B>(id, &[(&name, SIGMA)], &actions())?;
            let mut errors = Vec::new();
            for ((exact, exact_reward), (noisy, reward)) in exact.iter().zip(&noisy) {
                assert_eq!(exact.desired_goal(), noisy.desired_goal(), "{id}: {name}");
                assert!(goals > 0 || exact_reward == reward, "{id}: {name}");
                for (disturbed, exact, noisy) in [
                    (&elements, exact.observation(), noisy.observation()),
                    (&(0..goals), exact.achieved_goal(), noisy.achieved_goal()),
                ] {
                    for (at, (noisy, exact)) in noisy.iter().zip(exact).enumerate() {
                        if disturbed.contains(&at) {
                            errors.push(noisy - exact);
                        } else {
                            assert_eq!(noisy.to_bits(), exact.to_bits(), "{id}: {name}, {at}");
                        }
                    }
                }
            }
            let count = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / count;
            let sigma = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
            // Five standard errors.
            assert!(mean.abs() < 5.0 * SIGMA / count.sqrt(), "{id}: {name}, {mean}");
            let tolerance = 5.0 / (2.0 * count).sqrt();
            assert!((sigma / SIGMA - 1.0).abs() < tolerance, "{id}: {name}, {sigma}");
            errors.sort_by(f64::total_cmp);
            errors.dedup();
            assert_eq!(errors.len() as f64, count, "{id}: {name} is the same twice");
        }
        // A field's own noise takes the place of that of all.
        let factors = [("observation_noise", SIGMA), ("grip_pos_noise", 0.0)];
        for ((exact, _), (noisy, _)) in exact.iter().zip(run::<B>(id, &factors, &actions())?) {
            assert_eq!(noisy.grip_position(), exact.grip_position(), "{id}");
            assert_ne!(noisy.grip_velocity(), exact.grip_velocity(), "{id}");
        }
    }
    Ok(())
}

pub(crate) fn delayed_observations_come_late_and_goals_in_time<B: Backend>() -> Result {
    const DELAY: usize = 3;
    for id in EnvId::ALL {
        let noise = [("observation_noise", 0.02), ("action_noise", 0.1)];
        let now = run::<B>(id, &noise, &actions())?;
        let factors = [noise[0], noise[1], ("observation_delay", DELAY as f64)];
        for (at, (late, reward)) in run::<B>(id, &factors, &actions())?.iter().enumerate() {
            assert_eq!(late.observation(), now[at.saturating_sub(DELAY)].0.observation(), "{id}");
            assert_eq!(late.achieved_goal(), now[at].0.achieved_goal(), "{id}");
            assert_eq!(late.desired_goal(), now[at].0.desired_goal(), "{id}");
            assert_eq!(*reward, now[at].1, "{id}");
        }
    }
    Ok(())
}

pub(crate) fn noise_of_actions_follows_from_the_seed<B: Backend>() -> Result {
    let id: EnvId = "FetchReach-v4".parse()?;
    let factors = [("action_noise", 0.1)];
    let still = vec![[0.0; 4]; STEPS];
    let one = run::<B>(id, &factors, &still)?;
    assert_eq!(one, run::<B>(id, &factors, &still)?);
    let exact = run::<B>(id, &[], &still)?;
    assert_ne!(one.last(), exact.last());
    // The gripper wanders by 5 cm x sigma x sqrt(steps), and not away.
    let moved = |seen: &[(FetchObservation, f64)]| {
        let [from, to] = [0, STEPS].map(|at| seen[at].0.grip_position());
        from.iter().zip(to).map(|(from, to)| (to - from).powi(2)).sum::<f64>().sqrt()
    };
    assert!((0.0..5.0 * 0.05 * 0.1 * (3.0 * STEPS as f64).sqrt()).contains(&moved(&one)));
    Ok(())
}

pub(crate) fn what_was_observed_is_observed_again<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let variation = Variation::default()
            .with("observation_noise", 0.01)?
            .with("action_noise", 0.1..=0.3)?
            .with("action_low_pass", 0.5)?
            .with("action_delay", 2.0)?
            .with("observation_delay", 3.0)?
            .with("achieved_goal_noise", 0.01)?;
        let config = id.config().with_variation(variation);
        let mut env = make_with_config::<B>(config.clone())?;
        let start = env.reset(Some(6))?.observation;
        assert_eq!(env.inner().observe()?, start);
        let steps = random_steps::<B>(&mut env, 6, 7)?;
        assert_eq!(bits(&env.inner().observe()?), bits(&steps[6].observation), "{id}");
        let json = serde_json::to_string(&env.snapshot())?;
        let mut other = make_with_config::<B>(config)?;
        other.restore(&serde_json::from_str(&json)?)?;
        assert_eq!(other.inner().observe()?, env.inner().observe()?);
        let rest = |env: &mut TestEnv<B>| -> Result<_> {
            Ok(trajectory_bits(&random_steps::<B>(env, 7, 80)?))
        };
        assert_eq!(rest(&mut env)?, rest(&mut other)?, "{id}");
    }
    Ok(())
}
