//! The tensors are the batch's memory, a network learns from them, and burn's environment gives the
//! results of ours.

use burn::nn::LinearConfig;
use burn::optim::{GradientsParams, ModuleOptimizer, SgdConfig};
use burn::rl::Environment;
use burn::tensor::{Device, Tensor};
use fetch_env::vec_env::VecConfig;
use fetch_env::{DistanceReward, Env, GoalObservation, VecEnv, make_kinematic};
use her_relabel::{Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, UnitInterval};
use with_burn::{BurnEnv, Tensors, for_tensors};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const ROWS: usize = 64;

/// Draws a batch of single precision from a buffer of double precision with two episodes.
fn batch() -> Result<Batch<f32>> {
    let dims = Dims { observation: 25, goal: 3, action: 4 };
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(1000, dims).with_num_envs(2))?;
    let envs = [make_kinematic("FetchPush-v4")?, make_kinematic("FetchPush-v4")?];
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    buffer.record(envs.reset(Some(0))?)?.check()?;
    for _ in 0..50 {
        buffer.record(envs.step(&[0.5, 0.1, -0.2, 0.0, -0.5, 0.3, 0.1, 1.0])?)?.check()?;
    }
    let sampler = Sampler::new(ROWS, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::new();
    for_tensors(sampler, UnitInterval::new(0.98)?).sample(
        &buffer,
        &DistanceReward::sparse(),
        1,
        &mut batch,
    )?;
    Ok(batch)
}

#[test]
fn tensors_are_the_memory_of_the_batch() -> Result {
    let mut batch = batch()?;
    let (expected, memory) = (batch.clone(), batch.input().as_ptr());
    let tensors = Tensors::take(&mut batch, &Device::flex());
    for (tensor, column, width) in [
        (&tensors.action, expected.action(), 4),
        (&tensors.reward, expected.reward(), 1),
        (&tensors.discount, expected.discount(), 1),
        (&tensors.next_input, expected.next_input(), 28),
        (&tensors.input, expected.input(), 28),
    ] {
        assert_eq!(tensor.dims(), [ROWS, width]);
        assert_eq!(tensor.to_data().as_slice::<f32>()?, column);
    }
    // Even after passing through a tensor, the numbers are where the buffer wrote them.
    let column = tensors.input.into_data().try_into_vec::<f32>()?;
    assert_eq!(column.as_ptr(), memory);
    Ok(())
}

#[test]
fn a_gradient_step_lowers_the_loss() -> Result {
    let device = Device::flex().autodiff();
    let batch = Tensors::take(&mut batch()?, &device);
    let input = Tensor::cat(vec![batch.input, batch.action], 1);
    let critic = LinearConfig::new(28 + 4, 1).init(&device);
    let loss = |value: Tensor<2>| (value - batch.reward.clone()).powi_scalar(2).mean();

    let before = loss(critic.forward(input.clone()));
    let gradients = GradientsParams::from_grads(before.backward(), &critic);
    let mut optimizer: ModuleOptimizer = SgdConfig::new().init();
    let critic = optimizer.step(0.01, critic, gradients);
    let after = loss(critic.forward(input));
    assert!(after.into_scalar::<f32>() < before.into_scalar::<f32>());
    Ok(())
}

#[test]
fn the_environment_gives_its_own_results() -> Result {
    let device = Device::flex();
    let mut env = BurnEnv::new("FetchPush-v4", 3, &device)?;
    let mut alone = make_kinematic("FetchPush-v4")?;
    let mut observation = alone.reset(Some(3))?.observation;
    env.reset();
    for _ in 0..120 {
        let parts = observation.observation().iter().chain(observation.desired_goal());
        let expected: Vec<f32> = parts.map(|number| *number as f32).collect();
        assert_eq!(env.state().into_data().try_into_vec::<f32>()?, expected);

        let action = [0.5, 0.1, -0.2, 0.0];
        let result = env.step(Tensor::from_floats(action, &device));
        let step = alone.step(&action)?;
        assert_eq!((result.reward, result.done), (step.reward, step.terminated));
        assert_eq!(result.truncated, step.truncated);
        observation = if step.is_last() {
            env.reset();
            alone.reset(None)?.observation
        } else {
            step.observation
        };
    }
    Ok(())
}
