//! The tensors have the numbers of the batch, and a network learns from them.

use candle_core::{DType, Device, Tensor};
use candle_nn::{Module, Optimizer, SGD, VarBuilder, VarMap, linear, loss::mse};
use fetch_env::vec_env::VecConfig;
use fetch_env::{DistanceReward, VecEnv, make_kinematic};
use her_relabel::{Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, UnitInterval};
use with_candle::{Staging, Tensors, for_tensors};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const DIMS: Dims = Dims { observation: 25, goal: 3, action: 4 };
const ROWS: usize = 64;
const DEVICE: Device = Device::Cpu;

/// Fills a buffer of double precision with an episode of two environments.
fn buffer() -> Result<HerBuffer<f64>> {
    let mut buffer = HerBuffer::new(BufferConfig::new(1000, DIMS).with_num_envs(2))?;
    let envs = [make_kinematic("FetchPush-v4")?, make_kinematic("FetchPush-v4")?];
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    buffer.record(envs.reset(Some(0))?)?.check()?;
    for _ in 0..50 {
        buffer.record(envs.step(&[0.5, 0.1, -0.2, 0.0, -0.5, 0.3, 0.1, 1.0])?)?.check()?;
    }
    Ok(buffer)
}

fn sampler() -> Result<Sampler> {
    let sampler = Sampler::new(ROWS, GoalStrategy::Future, UnitInterval::from_k(4));
    Ok(for_tensors(sampler, UnitInterval::new(0.98)?))
}

fn numbers(tensor: &Tensor) -> Result<Vec<f32>> {
    Ok(tensor.flatten_all()?.to_vec1()?)
}

#[test]
fn tensors_have_the_numbers_of_the_batch() -> Result {
    let mut batch = Batch::<f32>::new();
    sampler()?.sample(&buffer()?, &DistanceReward::sparse(), 1, &mut batch)?;
    let expected = batch.clone();
    let tensors = Tensors::take(&mut batch, &DEVICE)?;
    for (tensor, column, width) in [
        (&tensors.input, expected.input(), 28),
        (&tensors.action, expected.action(), 4),
        (&tensors.reward, expected.reward(), 1),
        (&tensors.discount, expected.discount(), 1),
        (&tensors.next_input, expected.next_input(), 28),
    ] {
        assert_eq!(tensor.dims2()?, (ROWS, width));
        assert_eq!(numbers(tensor)?, column);
    }
    Ok(())
}

#[test]
fn staged_tensors_are_the_same() -> Result {
    let buffer = buffer()?;
    let mut staging = Staging::new(sampler()?, DIMS);
    for seed in 0..3 {
        let mut batch = Batch::new();
        sampler()?.sample(&buffer, &DistanceReward::sparse(), seed, &mut batch)?;
        let taken = Tensors::take(&mut batch, &DEVICE)?;
        let staged = staging.draw(&buffer, &DistanceReward::sparse(), seed, &DEVICE)?;
        for (one, other) in [
            (&taken.input, &staged.input),
            (&taken.action, &staged.action),
            (&taken.reward, &staged.reward),
            (&taken.discount, &staged.discount),
            (&taken.next_input, &staged.next_input),
        ] {
            assert_eq!((one.dims(), numbers(one)?), (other.dims(), numbers(other)?));
        }
    }
    Ok(())
}

#[test]
fn a_gradient_step_lowers_the_loss() -> Result {
    let mut staging = Staging::new(sampler()?, DIMS);
    let batch = staging.draw(&buffer()?, &DistanceReward::sparse(), 0, &DEVICE)?;
    let variables = VarMap::new();
    let builder = VarBuilder::from_varmap(&variables, DType::F32, &DEVICE);
    let critic = linear(28 + 4, 1, builder)?;
    let loss =
        || mse(&critic.forward(&Tensor::cat(&[&batch.input, &batch.action], 1)?)?, &batch.reward);
    let before = loss()?;
    SGD::new(variables.all_vars(), 0.01)?.backward_step(&before)?;
    assert!(loss()?.to_scalar::<f32>()? < before.to_scalar::<f32>()?);
    Ok(())
}
