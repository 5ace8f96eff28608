//! Policies of Python: trained ones, and functions.

use baselines::{Policy as Acts, TrainedPolicy, VecPolicy};
use fetch_env::vec_env::VecStep;
use fetch_env::{FetchObservation, GoalObservation, Info};
use pyo3::{intern, prelude::*};

use crate::arrays::{Numbers, observation_of};
use crate::config::ACTION_LEN;
use crate::error::{Error, Result};
use crate::policy::Policy;

/// What chooses actions.
pub(crate) enum Acting {
    Trained(Box<TrainedPolicy>),
    Function(Function),
}

/// A function of an observation that returns an action, or of a batch that returns one for each
/// row.
pub(crate) struct Function {
    function: Py<PyAny>,
    is_batched: bool,
    /// Its first error, for which the traits have no place. Then it is not called again.
    error: Option<Error>,
}

impl Acting {
    /// Takes a trained policy, or a function.
    pub(crate) fn take(policy: &Bound<'_, PyAny>, is_batched: bool) -> Result<Self> {
        if let Ok(trained) = policy.cast::<Policy>() {
            return Ok(Self::Trained(Box::new(trained.get().state(policy.py(), "policy")?)));
        }
        let function = policy.clone().unbind();
        Ok(Self::Function(Function { function, is_batched, error: None }))
    }

    /// Whether it chooses the actions of many environments at once. Others may remember their own
    /// episode.
    pub(crate) const fn is_batched(&self) -> bool {
        match self {
            Self::Trained(_) => true,
            Self::Function(function) => function.is_batched,
        }
    }

    /// Returns the error of the function, and otherwise a result.
    pub(crate) fn or_error<T>(&mut self, result: Result<T>) -> Result<T> {
        match self {
            Self::Function(Function { error: error @ Some(_), .. }) => {
                error.take().map_or(result, Err)
            }
            _ => result,
        }
    }
}

impl Function {
    /// Calls the method `reset`, if there is one.
    fn reset(&mut self) {
        let reset = || {
            Python::attach(|py| {
                let reset = self.function.bind(py).getattr_opt(intern!(py, "reset"))?;
                reset.map_or(Ok(()), |reset| reset.call0().map(drop))
            })
        };
        if self.error.is_none() {
            self.error = reset().err().map(Error::from);
        }
    }

    /// Writes the actions for the rows of states, or NaN, which environments refuse.
    fn act(&mut self, observation: &[f64], goals: [&[f64]; 2], actions: &mut [f32]) {
        if self.error.is_none() {
            self.error = self.call(observation, goals, actions).err();
        }
        if self.error.is_some() {
            actions.fill(f32::NAN);
        }
    }

    fn call(&self, observation: &[f64], goals: [&[f64]; 2], actions: &mut [f32]) -> Result<()> {
        Python::attach(|py| {
            let rows = actions.len() / ACTION_LEN;
            let dict = observation_of(py, observation, goals)?;
            if self.is_batched {
                for (key, part) in &dict {
                    dict.set_item(key, part.call_method1(intern!(py, "reshape"), (rows, -1))?)?;
                }
            }
            let returned = self.function.bind(py).call1((dict,))?;
            let shape = [rows, ACTION_LEN];
            let shape = if self.is_batched { &shape[..] } else { &shape[1..] };
            let taken = Numbers::of_shape("the action that the policy returned", &returned, shape)?;
            actions.copy_from_slice(&taken.to_single());
            Ok(())
        })
    }
}

impl Acts for Acting {
    fn reset(&mut self) {
        match self {
            Self::Trained(_) => {}
            Self::Function(function) => function.reset(),
        }
    }

    fn act(&mut self, observation: &FetchObservation, action: &mut [f32]) {
        let goals = [observation.achieved_goal(), observation.desired_goal()];
        match self {
            Self::Trained(policy) => policy.act(observation, action),
            Self::Function(function) => function.act(observation.observation(), goals, action),
        }
    }
}

impl VecPolicy for Acting {
    fn reset_all(&mut self) {
        Acts::reset(self);
    }

    fn act_all(&mut self, batch: &VecStep<FetchObservation, Info>, actions: &mut [f32]) {
        let goals = [batch.achieved_goal(), batch.desired_goal()];
        match self {
            Self::Trained(policy) => policy.act_all(batch, actions),
            Self::Function(function) => function.act(batch.observation(), goals, actions),
        }
    }
}
