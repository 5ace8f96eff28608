//! A plain list of episodes: the contents of a buffer according to the documentation.

use her_relabel::{NewPriority, Priorities, PriorityUnit};

/// A state.
#[derive(Clone, Debug)]
pub(crate) struct State {
    pub(crate) observation: Vec<f64>,
    pub(crate) achieved_goal: Vec<f64>,
}

/// The step from a state to the next one.
#[derive(Clone, Debug)]
pub(crate) struct Taken {
    pub(crate) action: Vec<f64>,
    pub(crate) reward: f64,
    /// The fields, in the order of the configuration.
    pub(crate) fields: Vec<Vec<f64>>,
    pub(crate) priority: f64,
}

/// An episode, or what is left of it.
#[derive(Clone, Debug)]
pub(crate) struct Episode {
    pub(crate) desired_goal: Vec<f64>,
    /// One more than steps.
    pub(crate) states: Vec<State>,
    pub(crate) steps: Vec<Taken>,
    pub(crate) terminated: bool,
    pub(crate) truncated: bool,
    pub(crate) priority: f64,
}

/// The newest `capacity` steps of all finished episodes, and the unfinished episode of each
/// environment.
#[derive(Clone, Debug)]
pub(crate) struct List {
    pub(crate) capacity: usize,
    pub(crate) finished: Vec<Episode>,
    pub(crate) under_way: Vec<Option<Episode>>,
    /// Whether the last episode of each environment was discarded.
    pub(crate) discarded: Vec<bool>,
    pub(crate) priorities: Option<Priorities>,
    highest: f64,
}

impl List {
    pub(crate) fn new(capacity: usize, num_envs: usize, priorities: Option<Priorities>) -> Self {
        let (under_way, discarded) = (vec![None; num_envs], vec![false; num_envs]);
        Self { capacity, finished: Vec::new(), under_way, discarded, priorities, highest: 1.0 }
    }

    /// All stored transitions, oldest first: the episode and the step.
    pub(crate) fn transitions(&self) -> Vec<(&Episode, usize)> {
        self.finished.iter().flat_map(|e| (0..e.steps.len()).map(move |t| (e, t))).collect()
    }

    /// Adds an episode at the end, and drops the oldest steps beyond the capacity.
    pub(crate) fn finish(&mut self, mut episode: Episode) {
        let new = match self.priorities.map(|settings| settings.new_priority()) {
            Some(NewPriority::Given(priority)) => priority,
            _ => self.highest,
        };
        episode.priority = new;
        episode.steps.iter_mut().for_each(|step| step.priority = new);
        self.finished.push(episode);
        while self.finished.iter().map(|episode| episode.steps.len()).sum::<usize>() > self.capacity
        {
            let oldest = &mut self.finished[0];
            oldest.steps.remove(0);
            oldest.states.remove(0);
            if oldest.steps.is_empty() {
                self.finished.remove(0);
            }
        }
    }

    /// Ends an unfinished episode, unless it has no steps.
    pub(crate) fn end(&mut self, env: usize, terminated: bool, truncated: bool) {
        if let Some(episode) = self.under_way[env].take().filter(|e| !e.steps.is_empty()) {
            self.finish(Episode { terminated, truncated, ..episode });
        }
    }

    /// Sets the goal of the environment's next steps. Returns whether an episode with steps has ended.
    pub(crate) fn set_goal(&mut self, env: usize, desired_goal: Vec<f64>) -> bool {
        let changes = |episode: &&Episode| episode.desired_goal != desired_goal;
        let Some(episode) = self.under_way[env].clone().filter(|episode| changes(&episode)) else {
            return false;
        };
        self.end(env, false, true);
        let has_steps = !episode.steps.is_empty();
        let states = episode.states.last().cloned().into_iter().collect();
        let next = Episode { desired_goal, states, steps: Vec::new(), ..episode };
        self.under_way[env] = Some(next);
        has_steps
    }

    /// Returns whether a step of the environment can be recorded or skipped.
    pub(crate) fn has_begun(&self, env: usize) -> bool {
        self.under_way[env].is_some() || self.discarded[env]
    }

    pub(crate) fn clear(&mut self) {
        self.finished.clear();
        self.discarded = (0..self.under_way.len()).map(|env| self.has_begun(env)).collect();
        self.under_way.fill(None);
        self.highest = 1.0;
    }

    /// Sets the priority of a transition, or of its episode.
    pub(crate) fn set_priority(&mut self, transition: usize, priority: f64) {
        self.highest = self.highest.max(priority);
        let mut before = 0;
        for episode in &mut self.finished {
            let steps = episode.steps.len();
            if (before..before + steps).contains(&transition) {
                episode.priority = priority;
                episode.steps[transition - before].priority = priority;
            }
            before += steps;
        }
    }

    /// The priority of each transition, or of its episode.
    pub(crate) fn weights(&self) -> Vec<f64> {
        let by_episode = self.priorities.map(|p| p.unit()) == Some(PriorityUnit::Episode);
        let transitions = self.transitions().into_iter();
        transitions
            .map(|(e, t)| if by_episode { e.priority } else { e.steps[t].priority })
            .collect()
    }

    /// The probability of each transition in a draw by priority.
    pub(crate) fn probabilities(&self) -> Vec<f64> {
        let transitions = self.transitions();
        if self.priorities.map(|p| p.unit()) == Some(PriorityUnit::Episode) {
            let total: f64 = self.finished.iter().map(|episode| episode.priority).sum();
            let of = |e: &Episode| e.priority / total / e.steps.len() as f64;
            return transitions.into_iter().map(|(episode, _)| of(episode)).collect();
        }
        let weights = self.weights();
        let total: f64 = weights.iter().sum();
        weights.into_iter().map(|weight| weight / total).collect()
    }
}
