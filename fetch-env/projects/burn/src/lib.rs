//! Burn tensors from batches of a hindsight replay buffer, and a Fetch environment as burn-rl's
//! `Environment`, so that burn's training loops can step it.

use burn::rl::{Environment, StepResult};
use burn::tensor::{Device, Tensor, TensorData};
use fetch_env::{Env, EnvError, FetchObservation, GoalObservation, KinematicEnv, make_kinematic};
use her_relabel::{Batch, JoinedGoal, Sampler, UnitInterval};

/// The parts of a batch that a learner needs, with a row for each transition.
#[derive(Clone, Debug)]
pub struct Tensors {
    /// Observation and goal, side by side.
    pub input: Tensor<2>,
    pub action: Tensor<2>,
    pub reward: Tensor<2>,
    /// Factor of the next value, 0 where the task ended: the target is `reward + discount * value`.
    pub discount: Tensor<2>,
    pub next_input: Tensor<2>,
}

/// Sets up a sampler for [`Tensors`].
pub fn for_tensors(sampler: Sampler, gamma: UnitInterval) -> Sampler {
    sampler.with_joined_goal(JoinedGoal::Desired).with_discount(gamma)
}

impl Tensors {
    /// Turns the columns of a batch into tensors, which own them: nothing is copied on the CPU.
    pub fn take(batch: &mut Batch<f32>, device: &Device) -> Self {
        let rows = batch.len();
        let columns = batch.take_columns();
        let matrix = |column: Vec<f32>| {
            let shape = [rows, column.len() / rows];
            Tensor::from_data(TensorData::new(column, shape), device)
        };
        Self {
            input: matrix(columns.input),
            action: matrix(columns.action),
            reward: matrix(columns.reward),
            discount: matrix(columns.discount),
            next_input: matrix(columns.next_input),
        }
    }
}

/// A Fetch environment for burn-rl: its state is the input of a network, observation and goal. With
/// MuJoCo, use `MujocoEnv` and `make` for `KinematicEnv` and `make_kinematic`.
#[derive(Debug)]
pub struct BurnEnv {
    env: KinematicEnv,
    /// The seed of the first reset; later ones continue its random numbers.
    seed: Option<u64>,
    state: Vec<f32>,
    device: Device,
}

impl BurnEnv {
    /// Makes the environment of this name and resets it, because burn may ask for its state first.
    ///
    /// # Errors
    /// As `make` and `reset`.
    pub fn new(id: &str, seed: u64, device: &Device) -> Result<Self, EnvError> {
        let mut env = make_kinematic(id)?;
        let state = input(&env.reset(Some(seed))?.observation);
        Ok(Self { env, seed: Some(seed), state, device: device.clone() })
    }
}

/// Joins the observation and the goal.
fn input(observation: &FetchObservation) -> Vec<f32> {
    let parts = observation.observation().iter().chain(observation.desired_goal());
    parts.map(|number| *number as f32).collect()
}

/// The methods of burn-rl return no errors: they panic if the environment fails.
impl Environment for BurnEnv {
    type State = Tensor<1>;
    type Action = Tensor<1>;

    /// The time limit of all Fetch environments.
    const MAX_STEPS: usize = 50;

    fn state(&self) -> Tensor<1> {
        Tensor::from_floats(&self.state[..], &self.device)
    }

    fn step(&mut self, action: Tensor<1>) -> StepResult<Tensor<1>> {
        let action = action.into_data().try_into_vec::<f32>().expect("an action of f32");
        let step = self.env.step(&action).unwrap_or_else(|error| panic!("{error}"));
        self.state = input(&step.observation);
        StepResult {
            next_state: self.state(),
            reward: step.reward,
            done: step.terminated,
            truncated: step.truncated,
        }
    }

    fn reset(&mut self) {
        let reset = self.env.reset(self.seed.take()).unwrap_or_else(|error| panic!("{error}"));
        self.state = input(&reset.observation);
    }
}
