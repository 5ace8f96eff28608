//! Many environments, stepped together.

use fetch_env::{
    ActionSpace, BoxSpace, EnvError, FetchResetOptions, MovingGoal, make_vec_while,
    vec_env::{self, AutoresetMode, VecConfig, VecReset},
};
use numpy::PyArray1;
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict, PyMapping},
};

use crate::arrays::{self, Numbers, Settled};
use crate::config::Config;
use crate::episode_options::EpisodeOptions;
use crate::error::{Error, Result};
use crate::exclusive::{Exclusive, Guard};
use crate::integer::Integer;
use crate::pictures::{Pictures, camera_names};
use crate::reset::{options_of_each, seed};
use crate::results::{StepTuple, Steps, observations, results, row};
use crate::signals::Signals;
use crate::task::{self, Limited, Own, Simulated};
use crate::variation::varied;
use crate::warnings::{pass_on, simulate};

type Envs = vec_env::VecEnv<Limited>;

/// Many environments with a time limit. A call that simulates releases the interpreter.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct VecEnv {
    parts: Exclusive<Parts>,
    /// The kind of transitions; see [`Config::transitions`].
    transitions: String,
    /// The task in Python, if there is one.
    own: Option<Own>,
}

/// The environments and their renderer.
pub(crate) struct Parts {
    /// `None` when they are closed.
    envs: Option<Envs>,
    /// Chooses the options of episodes that begin without any.
    episode_options: Option<EpisodeOptions>,
    pictures: Pictures,
}

#[pymethods]
impl VecEnv {
    /// Returns the kind of transitions.
    pub(crate) fn transitions(&self) -> &str {
        &self.transitions
    }

    #[new]
    #[expect(clippy::too_many_arguments, reason = "Python names them")]
    fn new(
        py: Python<'_>,
        config: &Config,
        num_envs: Integer<usize>,
        num_threads: Integer<usize>,
        autoreset: &str,
        width: Integer<u32>,
        height: Integer<u32>,
        camera_name: Option<String>,
        default_camera: Option<&Bound<'_, PyMapping>>,
        episode_options: Option<Py<PyAny>>,
    ) -> Result<Self> {
        let autoreset = match autoreset {
            "NextStep" => AutoresetMode::NextStep,
            "SameStep" => AutoresetMode::SameStep,
            "Disabled" => AutoresetMode::Disabled,
            _ => return Err(Error::value(format!("there is no autoreset mode {autoreset:?}"))),
        };
        let vec_config =
            VecConfig::default().with_num_threads(num_threads.0).with_autoreset(autoreset);
        // The last states of episodes are gone if the same step begins the next ones.
        let own = config.own(autoreset != AutoresetMode::SameStep && !config.disturbs());
        let (transitions, config) = (config.transitions(), config.config.clone());
        let make = |config| task::make(config, own.as_ref()).map(Simulated::time_limited);
        let mut signals = Signals::new();
        let envs = simulate(py, || {
            make_vec_while(config, num_envs.0, vec_config, make, || signals.go_on())
        });
        signals.finish()?;
        let mut envs = envs?;
        let simulator = env(&envs, 0)?.inner().simulator();
        let pictures = Pictures::new(simulator, [width, height], camera_name, default_camera)?;
        let episode_options =
            episode_options.map(|function| EpisodeOptions::new(function, own.clone()));
        if let Some(options) = episode_options.clone() {
            envs.set_autoreset_start(move |env_index, episode| {
                (None, options.choose(env_index, episode))
            })?;
        }
        let parts = Parts { envs: Some(envs), episode_options, pictures };
        Ok(Self { parts: Exclusive::new(parts), transitions, own })
    }

    #[getter]
    fn num_threads(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.lock(py)?.envs()?.num_threads())
    }

    /// Begins episodes where the mask is true, and returns all observations.
    #[pyo3(signature = (seeds = None, mask = None, options = None))]
    fn reset<'py>(
        &self,
        py: Python<'py>,
        seeds: Option<Vec<Option<Bound<'py, PyAny>>>>,
        mask: Option<Vec<bool>>,
        options: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyDict>> {
        let read = |seeds: Vec<Option<Bound<'py, PyAny>>>| {
            seeds.iter().map(|each| seed(each.as_ref())).collect::<Result<Vec<_>>>()
        };
        let seeds = seeds.map(read).transpose()?;
        let mut parts = self.lock(py)?;
        let chosen = parts.episode_options.clone().filter(|_| options.is_none());
        let envs = parts.envs()?;
        let options = match chosen {
            None => options_of_each(options, envs.num_envs(), self.own.as_ref())?,
            Some(chosen) => {
                let is_reset =
                    |env_index| mask.as_ref().is_none_or(|mask| mask.get(env_index) == Some(&true));
                let next = |env_index| match envs.num_episodes(env_index) {
                    Some(episode) if is_reset(env_index) => chosen.next(py, env_index, episode),
                    _ => Ok(FetchResetOptions::default()),
                };
                (0..envs.num_envs()).map(next).collect::<Result<_>>()?
            }
        };
        self.simulate(py, envs, |envs| {
            let (seeds, mask) = (seeds.as_deref(), mask.as_deref());
            envs.reset_with(&VecReset { seeds, mask, options: Some(&options) }).map(drop)
        })?;
        Ok(observations(py, envs.last_step())?)
    }

    /// Takes an action, a row of `actions`, in each environment.
    fn step<'py>(&self, py: Python<'py>, actions: &Bound<'py, PyAny>) -> Result<StepTuple<'py>> {
        let actions = Numbers::take("actions", actions)?;
        let mut parts = self.lock(py)?;
        let envs = parts.envs()?;
        let actions = read_actions(envs, &actions)?;
        let stepped = self.simulate(py, envs, |envs| envs.step(&actions).map(drop));
        parts.check_options()?;
        stepped?;
        Ok(results(py, parts.last_step()?)?)
    }

    /// Starts a step.
    fn step_async<'py>(&self, py: Python<'py>, actions: &Bound<'py, PyAny>) -> Result<()> {
        let actions = Numbers::take("actions", actions)?;
        let mut parts = self.lock(py)?;
        let envs = parts.envs()?;
        let actions = read_actions(envs, &actions)?;
        if envs.in_flight() > 0 {
            let count = envs.in_flight();
            return Err(vec_env::VecEnvError::InFlight { count }.into());
        }
        let all: Vec<usize> = (0..envs.num_envs()).collect();
        Ok(envs.send(&actions, &all)?)
    }

    /// Waits for the step that was started, and returns its results.
    fn step_wait<'py>(&self, py: Python<'py>) -> Result<StepTuple<'py>> {
        let mut parts = self.lock(py)?;
        let envs = parts.envs()?;
        if envs.in_flight() == 0 {
            return Err(Error::runtime("no step is under way: call step_async() first"));
        }
        let stepped = self.simulate(py, envs, |envs| envs.recv_all().map(drop));
        parts.check_options()?;
        stepped?;
        Ok(results(py, parts.last_step()?)?)
    }

    /// The numbers of an environment's episode that differ from the model's, by name.
    fn variation<'py>(&self, py: Python<'py>, env_index: usize) -> Result<Bound<'py, PyDict>> {
        varied(py, self.lock(py)?.env(env_index)?.inner().variation())
    }

    /// The goal of an environment's episode; None before a reset.
    fn goal<'py>(
        &self,
        py: Python<'py>,
        env_index: usize,
    ) -> Result<Option<Bound<'py, PyArray1<f64>>>> {
        let mut parts = self.lock(py)?;
        let goal = parts.env(env_index)?.inner().desired_goal();
        Ok(goal.map(|goal| PyArray1::from_slice(py, goal)))
    }

    /// Replaces the goals of the episodes: one for all environments, or a row for each.
    fn set_goals(&self, py: Python<'_>, goals: &Bound<'_, PyAny>) -> Result<()> {
        let goals = Numbers::take("goal", goals)?;
        let mut parts = self.lock(py)?;
        let envs = parts.envs()?;
        let (num_envs, len) = (envs.num_envs(), envs.last_step().desired_goal().len());
        let len = len / num_envs;
        let all = match *goals.shape() {
            [columns] if columns == len => goals.to_double().repeat(num_envs),
            [rows, columns] if [rows, columns] == [num_envs, len] => goals.to_double(),
            ref shape => {
                let wrong =
                    format!("goal has the shape {shape:?}: pass ({len},), or ({num_envs}, {len})");
                return Err(Error::value(wrong));
            }
        };
        let mut before = Vec::new();
        for env_index in 0..num_envs {
            let goal = env(envs, env_index)?.inner().desired_goal();
            before.extend_from_slice(goal.ok_or(EnvError::ResetNeeded)?);
        }
        let mut set = |goals: &[f64], env_index: usize| {
            let env = envs.env_mut(env_index).ok_or(EnvError::ResetNeeded)?;
            env.set_desired_goal(row(goals, env_index, num_envs))
        };
        for env_index in 0..num_envs {
            set(&all, env_index).map_err(|error| {
                // Then nothing has changed.
                (0..env_index).for_each(|env_index| drop(set(&before, env_index)));
                Error::from(error).of_env(env_index)
            })?;
        }
        Ok(())
    }

    /// Where the gripper starts in all environments, and the height of the object, in meters.
    fn settled<'py>(&self, py: Python<'py>) -> Result<Settled<'py>> {
        let mut parts = self.lock(py)?;
        Ok(arrays::settled(py, parts.env(0)?.inner().simulator()))
    }

    /// The seed of an environment's random numbers, and how many 64-bit numbers were drawn.
    fn random(&self, py: Python<'_>, env_index: usize) -> Result<Option<(u64, u64)>> {
        let mut parts = self.lock(py)?;
        let random = parts.env(env_index)?.inner().np_random();
        Ok(random.map(|random| (random.initial_seed(), random.draws())))
    }

    /// How many steps, starts and failures each environment has had.
    fn numbers(&self, py: Python<'_>) -> Result<Vec<u64>> {
        Ok(self.lock(py)?.last_step()?.number().to_vec())
    }

    /// Everything that determines the future, as bytes.
    fn get_state<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let snapshot = self.lock(py)?.envs()?.snapshot()?;
        Ok(PyBytes::new(py, &serde_json::to_vec(&snapshot)?))
    }

    /// Restores a state that `get_state` of the same number of environments with equal settings
    /// returned, and returns its observations.
    fn set_state<'py>(&self, py: Python<'py>, state: &[u8]) -> Result<Bound<'py, PyDict>> {
        let state: Vec<_> = serde_json::from_slice(state)?;
        let mut parts = self.lock(py)?;
        let envs = parts.envs()?;
        self.simulate(py, envs, |envs| envs.restore(&state))?;
        Ok(observations(py, envs.last_step())?)
    }

    /// The names of the model's cameras.
    fn camera_names(&self, py: Python<'_>) -> Result<Vec<String>> {
        Ok(camera_names(self.lock(py)?.env(0)?.inner().simulator()))
    }

    /// Pictures of all environments.
    fn draw<'py>(&self, py: Python<'py>, asked: &Bound<'py, PyDict>) -> Result<Bound<'py, PyAny>> {
        let Parts { envs, pictures, .. } = &mut *self.lock(py)?;
        let envs = envs.as_ref().ok_or_else(Error::closed)?;
        let num_envs = envs.num_envs();
        let all = (0..num_envs).map(|index| Ok(env(envs, index)?.inner()));
        let all = all.collect::<Result<Vec<_>>>()?;
        pictures.draw(py, &all, &[num_envs], asked)
    }

    /// Ends the threads and frees the simulations, after a call that is under way. Later calls
    /// raise an error.
    fn close(&self, py: Python<'_>) -> Result<()> {
        let mut parts = self.lock(py)?;
        let envs = parts.envs.take();
        py.detach(|| drop(envs));
        parts.pictures.close();
        Ok(())
    }
}

impl VecEnv {
    /// Waits until no other thread uses the environments.
    pub(crate) fn lock(&self, py: Python<'_>) -> Result<Guard<'_, Parts>> {
        self.parts.lock(py)
    }

    /// Makes a call that simulates, without holding the interpreter, and finishes its results.
    fn simulate(
        &self,
        py: Python<'_>,
        envs: &mut Envs,
        call: impl FnOnce(&mut Envs) -> std::result::Result<(), vec_env::VecEnvError> + Send,
    ) -> Result<()> {
        let called = py.detach(|| call(envs)).map_err(Error::from);
        pass_on(py, called.and_then(|()| self.finish(py, envs)))
    }

    /// Completes the results of a call with those of a task in Python, and raises the error of the
    /// first environment that has failed.
    fn finish(&self, py: Python<'_>, envs: &mut Envs) -> Result<()> {
        match &self.own {
            Some(own) if own.is_together => task::complete(py, envs, own)?,
            Some(own) => own.task.check()?,
            None => {}
        }
        check(envs.last_step())
    }
}

impl Parts {
    /// Returns the results of the last call.
    pub(crate) fn last_step(&mut self) -> Result<&Steps> {
        Ok(self.envs()?.last_step())
    }

    /// Raises what the function that chooses options has raised on another thread.
    fn check_options(&self) -> Result<()> {
        self.episode_options.as_ref().map_or(Ok(()), EpisodeOptions::check)
    }

    fn envs(&mut self) -> Result<&mut Envs> {
        self.envs.as_mut().ok_or_else(Error::closed)
    }

    fn env(&mut self, env_index: usize) -> Result<&Limited> {
        env(self.envs()?, env_index)
    }
}

impl Drop for Parts {
    /// Threads that are still at work may need the interpreter for a task in Python.
    fn drop(&mut self) {
        let envs = self.envs.take();
        Python::try_attach(|py| py.detach(|| drop(envs)));
    }
}

fn env(envs: &Envs, env_index: usize) -> Result<&Limited> {
    let missing =
        || Error::runtime(format!("environment {env_index} is in flight: call step_wait()"));
    envs.env(env_index).ok_or_else(missing)
}

/// Reads one action for each environment, so that a wrong one changes nothing.
fn read_actions(envs: &Envs, actions: &Numbers<'_>) -> Result<Vec<f32>> {
    let space: &BoxSpace<f32> = envs.single_action_space();
    let expected = [envs.num_envs(), space.action_len()];
    if actions.shape() != expected {
        return Err(Error::value(format!(
            "the actions have the shape {:?}: pass {expected:?}, a row for each environment",
            actions.shape()
        )));
    }
    let actions = actions.to_single();
    for (env_index, action) in actions.chunks(space.action_len()).enumerate() {
        let refusal = |error: EnvError| Error::value(format!("environment {env_index}: {error}"));
        space.check_action(action).map_err(refusal)?;
    }
    Ok(actions)
}

/// Raises the error of the first environment that has failed.
fn check(step: &Steps) -> Result<()> {
    match step.errors().next() {
        // An exception of the user's own code stays as it is.
        Some((_, error)) if error.downcast_ref::<PyErr>().is_some() => Err(error.clone().into()),
        Some((env_index, error)) => Err(Error::from(error.clone()).of_env(env_index)),
        None => Ok(()),
    }
}
