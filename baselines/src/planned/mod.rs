//! Planning on exact snapshots: a baseline that knows the simulator.

mod cross_entropy;
mod error;
mod knots;
mod plan;
mod rollouts;
mod settings;

use fetch_env::{BoxSpace, Task};

use self::{cross_entropy::Normals, knots::Knots, rollouts::Rollouts};
use crate::evaluate::check_policy;
use crate::policy::Policy;
use crate::scripted::{ScriptedPolicy, Strike};

pub use error::PlannerError;
pub use plan::{Plan, PlannedPolicy};
pub use rollouts::PlanEnv;
pub use settings::PlannerSettings;

/// The largest number of environments: the operating system may end a process with tens of
/// thousands of threads.
const MOST_ENVS: usize = 1_024;

/// A planner that searches for the actions that achieve the goal of one episode, by simulating many
/// candidates from its start.
///
/// It knows what no policy knows: what the simulator will do. So it shows how much of a task can be
/// solved at all and in how few steps, not how well a policy can act on observations. Candidates
/// are drawn by the cross-entropy method: normal distributions of a few numbers, fitted again and
/// again to the best candidates so far. Those that end in success come first, the sooner the
/// better, and then those that end nearest to the goal.
///
/// A search ends at the first iteration with a success, or after a number of iterations. The plan
/// depends on the start and on the settings, not on the number of environments. Each environment
/// has its own thread; those beyond the number of candidates simulate nothing.
///
/// ```
/// use baselines::{PlannedPolicy, Planner, PlannerSettings, evaluate};
/// use fetch_env::{Env, Task, make_kinematic};
///
/// // `make` does the same on MuJoCo.
/// let mut envs = [make_kinematic("FetchPush-v4")?, make_kinematic("FetchPush-v4")?];
/// let start = envs[0].reset(Some(3))?.observation;
/// let planner = Planner::new(PlannerSettings::default())?;
/// let plan = planner.plan_task(&mut envs, &start, Task::Push)?;
/// assert!(plan.episode.success);
///
/// let mut policy = PlannedPolicy::new(plan.actions);
/// let replayed = evaluate(&mut envs[0], &mut policy, 1, 3, |_| ())?;
/// assert_eq!(replayed.episodes[0].final_distance, plan.episode.final_distance);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Source: Rubinstein, "The cross-entropy method for combinatorial and continuous optimization",
/// Methodology and Computing in Applied Probability 1 (1999); for keeping elites from one iteration
/// to the next: Pinneri et al., "Sample-efficient cross-entropy method for real-time planning",
/// CoRL (2020).
#[derive(Clone, Debug)]
pub struct Planner {
    settings: PlannerSettings,
}

impl Planner {
    /// Returns a planner with these settings.
    ///
    /// # Errors
    /// [`PlannerError::Setting`] with the first that is out of its range.
    pub fn new(settings: PlannerSettings) -> Result<Self, PlannerError> {
        settings.check()?;
        Ok(Self { settings })
    }

    /// Plans from the state of the first environment, whose observation is `observation`, to the
    /// end of its episode: it tries the actions of `first`, and then actions near them.
    ///
    /// The environments must be made the same way; afterwards all are in that state. If an episode
    /// lasts longer than that of `first`, the actions after that are 0.
    ///
    /// # Errors
    /// [`PlannerError::NoEnvironment`]; [`PlannerError::TooManyEnvironments`] if there are more than
    /// 1,024; [`PlannerError::Unbounded`];
    /// [`PlannerError::Policy`] if `first` does not fit the environment;
    /// [`PlannerError::Environment`] if one cannot be restored or stepped, after which all must be
    /// reset.
    pub fn plan<E: PlanEnv>(
        &self,
        envs: &mut [E],
        observation: &E::Observation,
        first: &mut (impl Policy<E::Observation> + ?Sized),
    ) -> Result<Plan, PlannerError> {
        let space = check(envs, first)?;
        let mut rollouts = Rollouts::new(envs, observation)?;
        let best = rollouts.one(first)?;
        let best = self.search_actions(&mut rollouts, best, &space)?;
        Ok(Plan { rollouts: rollouts.end()?, ..best })
    }

    /// Plans an episode of a Fetch task, as [`plan`](Self::plan) does: it tries the task's
    /// [`ScriptedPolicy`], then for Slide single strikes with different angles, speeds, run-ups and
    /// follow-throughs, and then actions near the best of these.
    ///
    /// # Errors
    /// As [`plan`](Self::plan), and [`PlannerError::Policy`] if the observations do not begin with
    /// the task's columns.
    pub fn plan_task<E: PlanEnv>(
        &self,
        envs: &mut [E],
        observation: &E::Observation,
        task: Task,
    ) -> Result<Plan, PlannerError> {
        let mut scripted = ScriptedPolicy::new(task);
        let space = check(envs, &scripted)?;
        let mut rollouts = Rollouts::new(envs, observation)?;
        let mut best = rollouts.one(&mut scripted)?;
        if task == Task::Slide {
            best = self.search_strikes(&mut rollouts, best)?;
        }
        let best = self.search_actions(&mut rollouts, best, &space)?;
        Ok(Plan { rollouts: rollouts.end()?, ..best })
    }

    /// Searches for a strike that is better than the best plan so far.
    fn search_strikes<E: PlanEnv>(
        &self,
        rollouts: &mut Rollouts<'_, E>,
        best: Plan,
    ) -> Result<Plan, PlannerError> {
        let normals = Normals::new(Strike::MEAN.into(), Strike::SPREAD.into(), self.settings.seed);
        self.search(rollouts, best, Vec::new(), normals, Strike::new)
    }

    /// Searches for actions near those of the best plan so far.
    fn search_actions<E: PlanEnv>(
        &self,
        rollouts: &mut Rollouts<'_, E>,
        best: Plan,
        space: &BoxSpace<f32>,
    ) -> Result<Plan, PlannerError> {
        let actions = best.actions.clone();
        let knots = Knots::new(&actions, space, self.settings.knots);
        let spread = knots.spread(self.settings.spread);
        let still = vec![0.0; spread.len()];
        let normals = Normals::new(still.clone(), spread, self.settings.seed);
        let elites = vec![(still, best.clone())];
        let policy = |offsets: &[f64]| PlannedPolicy::new(knots.actions(offsets));
        self.search(rollouts, best, elites, normals, policy)
    }

    /// Searches among the policies of a family. Returns the best plan, which may still be `best`.
    fn search<E: PlanEnv, P: Policy<E::Observation> + Send>(
        &self,
        rollouts: &mut Rollouts<'_, E>,
        best: Plan,
        mut elites: Vec<(Vec<f64>, Plan)>,
        mut normals: Normals,
        policy: impl Fn(&[f64]) -> P,
    ) -> Result<Plan, PlannerError> {
        let PlannerSettings { population, iterations, fewest_steps, .. } = self.settings;
        let mut best = best;
        for _ in 0..iterations {
            if best.episode.success && !fewest_steps {
                break;
            }
            let parameters: Vec<_> = (0..population).map(|_| normals.draw()).collect();
            let candidates = parameters.iter().map(|parameters| policy(parameters)).collect();
            elites.extend(parameters.into_iter().zip(rollouts.all(candidates)?));
            elites.sort_by(|(_, one), (_, other)| one.order(other));
            elites.truncate(self.settings.elites);
            let parameters: Vec<_> = elites.iter().map(|(parameters, _)| &parameters[..]).collect();
            normals.fit(&parameters);
            if elites[0].1.order(&best).is_lt() {
                best = elites[0].1.clone();
            }
        }
        Ok(best)
    }
}

/// Checks that there are environments, that a policy fits them, and that actions have bounds.
/// Returns the space of the actions.
fn check<E: PlanEnv>(
    envs: &[E],
    policy: &(impl Policy<E::Observation> + ?Sized),
) -> Result<BoxSpace<f32>, PlannerError> {
    let env = envs.first().ok_or(PlannerError::NoEnvironment)?;
    if envs.len() > MOST_ENVS {
        return Err(PlannerError::TooManyEnvironments { actual: envs.len(), most: MOST_ENVS });
    }
    check_policy(env, policy)?;
    let space = env.action_space();
    let bounds = space.low().iter().zip(space.high()).enumerate();
    for (index, (&low, &high)) in bounds {
        if !(low.is_finite() && high.is_finite()) {
            return Err(PlannerError::Unbounded { index, low, high });
        }
    }
    Ok(space.clone())
}
