//! The episodes that fill the buffers: of FetchPush's shape.

use fetch_env::NpRandom;
use her_relabel::{
    BufferConfig, Dims, EpisodeData, HerBuffer, Scalar, StartData, StepData, StepRows,
};

pub const DIMS: Dims = Dims { observation: 25, goal: 3, action: 4 };
pub const STEPS: usize = 50;
/// Few enough to stay in the cache, because the benchmark measures the table.
const EPISODES: usize = 64;

/// An episode of [`STEPS`] steps.
pub struct Episode<T> {
    observations: Vec<T>,
    achieved_goals: Vec<T>,
    desired_goal: Vec<T>,
    actions: Vec<T>,
    rewards: Vec<T>,
}

impl<T: Scalar> Episode<T> {
    /// Returns the episodes, which are added repeatedly.
    pub fn all() -> Vec<Self> {
        let mut random = NpRandom::new(0);
        (0..EPISODES).map(|_| Self::new(&mut random)).collect()
    }

    /// Returns an episode with small values, whose achieved goal moves a few centimeters per step.
    fn new(random: &mut NpRandom) -> Self {
        let mut take = |count: usize, scale: f64| -> Vec<T> {
            (0..count).map(|_| T::from_f64(random.uniform(-scale, scale))).collect()
        };
        let mut episode = Self {
            observations: take((STEPS + 1) * DIMS.observation, 1.0),
            achieved_goals: take((STEPS + 1) * DIMS.goal, 0.03),
            desired_goal: take(DIMS.goal, 0.15),
            actions: take(STEPS * DIMS.action, 1.0),
            rewards: vec![T::from_f64(-1.0); STEPS],
        };
        for at in DIMS.goal..episode.achieved_goals.len() {
            let walked = episode.achieved_goals[at].to_f64()
                + episode.achieved_goals[at - DIMS.goal].to_f64();
            episode.achieved_goals[at] = T::from_f64(walked);
        }
        episode
    }

    pub fn data(&self) -> EpisodeData<'_, T> {
        EpisodeData {
            observation: &self.observations,
            achieved_goal: &self.achieved_goals,
            desired_goal: &self.desired_goal,
            action: &self.actions,
            reward: &self.rewards,
            terminated: false,
            truncated: true,
            fields: &[],
        }
    }

    pub fn start(&self) -> StartData<'_, T> {
        StartData {
            observation: &self.observations[..DIMS.observation],
            achieved_goal: &self.achieved_goals[..DIMS.goal],
            desired_goal: &self.desired_goal,
        }
    }

    fn step(&self, t: usize) -> StepData<'_, T> {
        StepData {
            action: &self.actions[t * DIMS.action..][..DIMS.action],
            reward: self.rewards[t],
            next_observation: &self.observations[(t + 1) * DIMS.observation..][..DIMS.observation],
            next_achieved_goal: &self.achieved_goals[(t + 1) * DIMS.goal..][..DIMS.goal],
            terminated: false,
            truncated: t + 1 == STEPS,
            fields: &[],
        }
    }
}

/// Returns a full buffer with room for environments that add to it.
pub fn full_buffer<T: Scalar>(
    transitions: usize,
    num_envs: usize,
    episodes: &[Episode<T>],
) -> anyhow::Result<HerBuffer<T>> {
    let config = BufferConfig::new(transitions, DIMS).with_num_envs(num_envs);
    let mut buffer = HerBuffer::new(config)?;
    for episode in episodes.iter().cycle().take(transitions.div_ceil(STEPS)) {
        buffer.add_episode(&episode.data())?;
    }
    Ok(buffer)
}

/// Adds single steps endlessly, to one environment after another.
pub struct Stepper {
    pub first_env: usize,
    pub num_envs: usize,
    added: usize,
}

impl Stepper {
    pub fn new(first_env: usize, num_envs: usize) -> Self {
        Self { first_env, num_envs, added: 0 }
    }

    pub fn step<T: Scalar>(
        &mut self,
        buffer: &mut HerBuffer<T>,
        episodes: &[Episode<T>],
    ) -> anyhow::Result<()> {
        let env = self.added % self.num_envs;
        let t = self.added / self.num_envs % STEPS;
        let round = self.added / (self.num_envs * STEPS);
        let episode = &episodes[(round * self.num_envs + env) % episodes.len()];
        if t == 0 {
            buffer.begin_episode(self.first_env + env, &episode.start())?;
        }
        buffer.add_step(self.first_env + env, &episode.step(t))?;
        self.added += 1;
        Ok(())
    }
}

/// The rows of environments that each play an episode, step by step, and restart it in the last
/// step.
pub struct RecordedRows<T> {
    /// The columns of each step: actions, rewards, next observations and next achieved goals.
    steps: Vec<[Vec<T>; 4]>,
    /// The observations, achieved goals and desired goals of the start.
    start: [Vec<T>; 3],
    all: Vec<bool>,
    none: Vec<bool>,
}

impl<T: Scalar> RecordedRows<T> {
    pub fn new(episodes: &[Episode<T>]) -> Self {
        let column = |of: &dyn Fn(&Episode<T>) -> Vec<T>| episodes.iter().flat_map(of).collect();
        let steps = (0..STEPS).map(|t| {
            [
                column(&|episode| episode.step(t).action.to_vec()),
                column(&|episode| vec![episode.step(t).reward]),
                column(&|episode| episode.step(t).next_observation.to_vec()),
                column(&|episode| episode.step(t).next_achieved_goal.to_vec()),
            ]
        });
        Self {
            steps: steps.collect(),
            start: [
                column(&|episode| episode.start().observation.to_vec()),
                column(&|episode| episode.start().achieved_goal.to_vec()),
                column(&|episode| episode.desired_goal.clone()),
            ],
            all: vec![true; episodes.len()],
            none: vec![false; episodes.len()],
        }
    }

    /// Returns the rows of step `t`.
    pub fn at<'a>(&'a self, env_ids: &'a [usize], t: usize) -> StepRows<'a, T> {
        let ends = if t + 1 == STEPS { &self.all } else { &self.none };
        let [actions, rewards, next_observations, next_achieved_goals] = &self.steps[t];
        let [observations, achieved_goals, desired_goals] = &self.start;
        StepRows {
            env_index: env_ids,
            stepped: &self.all,
            started: ends,
            action: actions,
            reward: rewards,
            next_observation: next_observations,
            next_achieved_goal: next_achieved_goals,
            terminated: &self.none,
            truncated: ends,
            observation: observations,
            achieved_goal: achieved_goals,
            desired_goal: desired_goals,
            ..StepRows::default()
        }
    }
}
