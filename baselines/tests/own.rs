//! Policies in a user's own environment, and of any action space.

mod plane;

use std::fmt::Debug;
use std::fs;

use baselines::{
    InputPart, LayerWeights, Policy, PolicyHeader, RandomPolicy, TrainedPolicy, VecPolicy,
    evaluate, evaluate_vec,
};
use fetch_env::{
    ActionSpace, BoxSpace, DiscreteSpace, Env, MultiBinarySpace, MultiDiscreteSpace, NpRandom,
    VecEnv, vec_env::VecConfig,
};
use plane::{Plane, STEPS};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// A network of one hidden layer with random weights.
fn policy() -> Result<TrainedPolicy> {
    let mut random = NpRandom::new(3);
    let mut numbers = |count| (0..count).map(|_| random.uniform(-1.0, 1.0) as f32).collect();
    let mut layer = |num_inputs, num_outputs| LayerWeights {
        num_inputs,
        weights: numbers(num_inputs * num_outputs),
        biases: numbers(num_outputs),
    };
    let header = PolicyHeader {
        version: PolicyHeader::VERSION,
        env_id: "Plane".into(),
        observation_len: 2,
        goal_len: 2,
        action_len: 2,
        inputs: vec![InputPart::Observation, InputPart::RelativeGoal],
        observation_normalizer: None,
        goal_normalizer: None,
        algorithm: "by chance".into(),
        settings: serde_json::Value::Null,
        seed: 3,
        steps: 0,
        demonstrations: 0,
        success: None,
    };
    Ok(TrainedPolicy::new(header, &[layer(4, 8), layer(8, 2)])?)
}

#[test]
fn a_loaded_policy_acts_on_one_observation_as_in_a_batch() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("plane.safetensors");
    fs::write(&path, policy()?.to_bytes()?)?;
    let mut loaded = TrainedPolicy::load(&path)?;

    let mut envs = VecEnv::new([Plane::make()?, Plane::make()?], VecConfig::default())?;
    let mut single = Plane::make()?;
    envs.reset(Some(4))?;
    let mut observation = single.reset(Some(5))?.observation;
    let (mut one, mut all) = ([0.0_f32; 2], [0.0_f32; 4]);
    for _ in 0..STEPS {
        policy()?.act(&observation, &mut one);
        loaded.act_all(envs.last_step(), &mut all);
        assert_eq!(one.map(f32::to_bits), [all[2].to_bits(), all[3].to_bits()]);
        observation = single.step(&one)?.observation;
        envs.step(&all)?;
    }

    let alone = evaluate(&mut single, &mut loaded, 10, 7, |_| ())?;
    assert_eq!(evaluate_vec(&mut envs, &mut loaded, 10, 7, |_| ())?, alone);
    Ok(())
}

/// Draws actions one by one and in rows, and returns the first.
fn draw<S: ActionSpace>(space: &S) -> Result<Vec<S::Element>>
where
    S::Element: Debug,
{
    const COUNT: usize = 200;
    let len = space.action_len();
    let mut rows = vec![S::Element::default(); COUNT * len];
    RandomPolicy::new(space, 5).act(&(), &mut rows);
    let mut policy = RandomPolicy::new(space, 5);
    let mut action = vec![S::Element::default(); len];
    for row in rows.chunks_exact(len) {
        policy.act(&(), &mut action);
        assert_eq!(action, row);
        space.check_action(row)?;
    }
    assert!(rows.chunks_exact(len).any(|row| row != &rows[..len]), "all actions are {action:?}");
    Ok(rows[..len].to_vec())
}

#[test]
fn a_random_policy_draws_from_any_space() -> Result {
    draw(&DiscreteSpace::from_start(3, -1)?)?;
    draw(&MultiDiscreteSpace::new(vec![2, 5])?)?;
    draw(&MultiBinarySpace::new(vec![3])?)?;
    draw(&BoxSpace::<f64>::uniform(vec![2], -1.0, 1.0)?)?;
    draw(&BoxSpace::<f32>::unbounded(2)?)?;
    let narrow = BoxSpace::new(vec![2], vec![0.0, 2.0], vec![1.0_f32, 2.5])?;
    assert!(narrow.contains(&draw(&narrow)?));
    Ok(())
}

/// The figures of random policies that are published rely on these draws.
#[test]
fn the_draws_of_a_box_from_minus_one_to_one_stay_the_same() -> Result {
    let mut generator = ChaCha8Rng::seed_from_u64(5);
    let expected: Vec<f32> = (0..4).map(|_| generator.random_range(-1.0..=1.0)).collect();
    assert_eq!(draw(&BoxSpace::uniform(vec![4], -1.0_f32, 1.0)?)?, expected);
    Ok(())
}

#[test]
fn a_random_policy_is_evaluated() -> Result {
    let mut env = Plane::make()?;
    let mut policy = RandomPolicy::new(env.action_space(), 1);
    let evaluation = evaluate(&mut env, &mut policy, 5, 0, |_| ())?;
    assert!(evaluation.episodes.iter().all(|episode| episode.episode_length == STEPS as usize));
    Ok(())
}
