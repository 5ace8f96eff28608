//! Recording an episode as rows.

use crate::add::arguments::{EpisodeData, FieldRows, StartData, StepData};
use crate::scalar::Scalar;
use crate::store::layout::Layout;
use crate::store::storage::{Storage, Unfinished};

impl<T: Scalar> Unfinished<T> {
    /// Begins an episode with a checked state.
    pub(crate) fn begin<O: Scalar, G: Scalar>(
        &mut self,
        layout: &Layout,
        start: &StartData<'_, O, G>,
    ) {
        self.rows.clear();
        self.is_discarded = false;
        self.push_state(layout, start.observation, start.achieved_goal);
        self.desired_goal.resize(layout.dims().goal, T::default());
        fill(&mut self.desired_goal, start.desired_goal);
    }

    /// Adds a checked step, whose fields are in their row `at`.
    pub(crate) fn step<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        storage: &Storage<T>,
        step: &StepData<'_, O, G, A>,
        at: usize,
    ) {
        let Storage { ref layout, capacity, .. } = *storage;
        self.set_action(layout, step.action, step.reward);
        let last = self.rows.len() - layout.row();
        set_fields(storage, &mut self.rows[last..], step.fields, at);
        self.push_state(layout, step.next_observation, step.next_achieved_goal);
        let steps = self.steps(layout);
        if steps >= 2 * capacity {
            // Bounds the memory of an endless episode. Half of it is dropped at a time, so that a
            // step moves a constant number of rows on average.
            self.rows.drain(..(steps - capacity) * layout.row());
        }
    }

    /// Records a checked episode from beginning to end.
    pub(crate) fn record<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        storage: &Storage<T>,
        episode: &EpisodeData<'_, O, G, A>,
    ) {
        let layout = &storage.layout;
        let dims = layout.dims();
        let skipped = episode.reward.len().saturating_sub(storage.capacity);
        let states = episode
            .observation
            .chunks_exact(dims.observation)
            .zip(episode.achieved_goal.chunks_exact(dims.goal));
        let steps = episode.action.chunks_exact(dims.action).zip(episode.reward);
        let mut states = states.skip(skipped);
        if let Some((observation, achieved_goal)) = states.next() {
            let desired_goal = episode.desired_goal;
            self.begin(layout, &StartData { observation, achieved_goal, desired_goal });
        }
        for ((action, reward), (observation, achieved_goal)) in steps.skip(skipped).zip(states) {
            self.set_action(layout, action, *reward);
            self.push_state(layout, observation, achieved_goal);
        }
        let last = self.rows.len() - layout.row();
        set_fields(storage, &mut self.rows[..last], episode.fields, skipped);
    }

    /// Returns the rows of the newest `capacity` steps, ready to be stored.
    pub(crate) fn finish(&mut self, storage: &Storage<T>) -> &[T] {
        let layout = &storage.layout;
        let skipped = self.steps(layout).saturating_sub(storage.capacity);
        let last = self.rows.len() - layout.row();
        self.rows[last..][layout.desired_goal()].copy_from_slice(&self.desired_goal);
        &self.rows[skipped * layout.row()..]
    }

    /// Forgets all steps, but not the state after the last one.
    pub(crate) fn keep_last_state(&mut self, layout: &Layout) {
        self.rows.drain(..self.rows.len() - layout.row());
        self.rows[layout.state().end..].fill(T::default());
    }

    fn set_action<G: Scalar, A: Scalar>(&mut self, layout: &Layout, action: &[A], reward: G) {
        let last = self.rows.len() - layout.row();
        let row = &mut self.rows[last..];
        fill(&mut row[layout.action()], action);
        row[layout.reward()] = T::from_f64(reward.to_f64());
    }

    fn push_state<O: Scalar, G: Scalar>(
        &mut self,
        layout: &Layout,
        observation: &[O],
        achieved_goal: &[G],
    ) {
        let at = self.rows.len();
        self.rows.resize(at + layout.row(), T::default());
        let row = &mut self.rows[at..];
        fill(&mut row[layout.observation()], observation);
        fill(&mut row[layout.achieved_goal()], achieved_goal);
    }
}

/// Writes the given fields, from their row `at`, into consecutive rows.
fn set_fields<T: Scalar, S: Scalar>(
    storage: &Storage<T>,
    rows: &mut [T],
    given: &[FieldRows<'_, S>],
    at: usize,
) {
    let layout = &storage.layout;
    for (field, place) in storage.fields.places() {
        let Some((_, values)) = given.iter().find(|(name, _)| *name == field.name) else {
            continue;
        };
        let values = values.chunks_exact(field.len).skip(at);
        for (row, values) in rows.chunks_exact_mut(layout.row()).zip(values) {
            fill(&mut row[layout.fields()][place.clone()], values);
        }
    }
}

pub(crate) fn fill<T: Scalar, S: Scalar>(target: &mut [T], source: &[S]) {
    for (target, source) in target.iter_mut().zip(source) {
        *target = T::from_f64(source.to_f64());
    }
}

/// Returns whether these numbers were stored as those.
pub(crate) fn are_same<T: Scalar, S: Scalar>(stored: &[T], numbers: &[S]) -> bool {
    let pairs = stored.iter().zip(numbers);
    pairs.into_iter().all(|(stored, number)| stored.bits() == T::from_f64(number.to_f64()).bits())
}
