//! Every number of a batch, computed again from the list.

use goal_reward::{GoalReward, goal_distance};
use her_relabel::{Batch, GoalStrategy, HerBuffer, Sampler, Scalar, Termination};

use crate::list::{Episode, List};
use crate::task::Exceed;

/// Asserts that the buffer reports the same contents as the list.
pub(crate) fn assert_contents<S: Scalar>(list: &List, buffer: &HerBuffer<S>) {
    let transitions = list.transitions();
    assert_eq!(buffer.len(), transitions.len());
    assert_eq!(buffer.is_empty(), transitions.is_empty());
    assert_eq!(buffer.num_episodes(), list.finished.len());
    for (env, episode) in list.under_way.iter().enumerate() {
        let steps = episode.as_ref().map(|episode| episode.steps.len().min(list.capacity));
        assert_eq!(buffer.unfinished_steps(env), Ok(steps));
    }
    let ids = buffer.transition_ids().map(|(oldest, newest)| (oldest.get(), newest.get()));
    let Some((oldest, newest)) = ids else { return assert!(transitions.is_empty()) };
    assert_eq!(newest - oldest + 1, transitions.len() as u64);
    let priority = |number| buffer.priority(her_relabel::TransitionId::new(number).unwrap());
    let found: Vec<Option<f64>> = (oldest..=newest).map(priority).collect();
    match list.priorities {
        None => assert!(found.iter().all(Option::is_none)),
        Some(_) => assert!(found.into_iter().eq(list.weights().into_iter().map(Some))),
    }
}

/// Asserts that numbers are those of the list, as elements of the batch's type, bit by bit.
fn assert_bits<B: Scalar>(found: &[B], expected: &[f64], what: &str) {
    let bits = |number: f64| number.to_bits();
    let found: Vec<u64> = found.iter().map(|number| bits(number.to_f64())).collect();
    let expected: Vec<u64> =
        expected.iter().map(|number| bits(B::from_f64(*number).to_f64())).collect();
    assert_eq!(found, expected, "{what}");
}

/// The transition and the goal of a row, as places in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) transition: usize,
    pub(crate) source: Option<usize>,
}

/// Reads the place of each row.
pub(crate) fn places<S: Scalar, B: Scalar>(
    buffer: &HerBuffer<S>,
    batch: &Batch<B>,
) -> impl Iterator<Item = Place> {
    let oldest = buffer.transition_ids().unwrap().0.get();
    let place = move |id: her_relabel::TransitionId| (id.get() - oldest) as usize;
    batch.transition().iter().zip(batch.goal_source()).map(move |(transition, source)| Place {
        transition: place(*transition),
        source: source.map(place),
    })
}

/// Returns whether a strategy may give a transition the goal of this source, desired or achieved.
fn may_give(strategy: GoalStrategy, list: &List, place: Place, is_desired: bool) -> bool {
    let transitions = list.transitions();
    let (episode, _) = transitions[place.transition];
    let source = place.source.unwrap();
    let (source_episode, t) = transitions[source];
    let is_own = std::ptr::eq(episode, source_episode);
    let may_be_achieved = match strategy {
        GoalStrategy::PastDesired => return is_desired,
        GoalStrategy::Random => true,
        GoalStrategy::Episode => is_own,
        GoalStrategy::Final => is_own && t + 1 == episode.steps.len(),
        _ => is_own && source >= place.transition,
    };
    may_be_achieved && !is_desired
}

/// The parts of a row that depend on the steps of its window.
struct Outcome {
    reward: f64,
    steps: usize,
    terminated: bool,
    truncated: bool,
    discount: f64,
}

/// Walks along the window of a row that begins with step `t`.
fn walk(episode: &Episode, t: usize, goal: Option<&[f64]>, sampler: &Sampler) -> Outcome {
    let (most, gamma) = sampler.n_step().map_or((1, 1.0), |n| (n.steps().get(), n.gamma().get()));
    let mut outcome =
        Outcome { reward: -0.0, steps: 0, terminated: false, truncated: false, discount: 1.0 };
    while outcome.steps < most && t + outcome.steps < episode.steps.len() && !outcome.terminated {
        let at = t + outcome.steps;
        let achieved = &episode.states[at + 1].achieved_goal;
        let is_last = at + 1 == episode.steps.len();
        let reward = goal.map_or(episode.steps[at].reward, |goal| Exceed.reward(achieved, goal));
        outcome.reward += outcome.discount * reward;
        outcome.discount *= gamma;
        let stored = is_last && episode.terminated;
        let recomputed = || goal.map(|goal| Exceed.terminated(achieved, goal));
        outcome.terminated = match sampler.termination() {
            Termination::Stored => stored,
            Termination::StoredOrRecomputed => stored || recomputed() == Some(true),
            Termination::Recomputed => recomputed().unwrap_or(stored),
        };
        outcome.truncated = is_last && episode.truncated;
        outcome.steps += 1;
    }
    if outcome.terminated {
        outcome.discount = 0.0;
    }
    outcome
}

/// Asserts that a batch has exactly the numbers that the list and the sampler determine.
pub(crate) fn assert_batch<S: Scalar, B: Scalar>(
    list: &List,
    buffer: &HerBuffer<S>,
    sampler: &Sampler,
    batch: &Batch<B>,
) {
    assert_eq!(batch.len(), sampler.batch_size());
    for (row, place) in places(buffer, batch).enumerate() {
        match place.source {
            None => assert!(sampler.ratio().get() < 1.0, "a row was left alone"),
            Some(_) => assert!(sampler.ratio().get() > 0.0, "a row was relabeled"),
        }
        assert_row(list, sampler, batch, row, place);
    }
    if sampler.priorities().is_some() {
        assert_weights(list, buffer, sampler, batch);
    }
}

/// Returns the goal of a row, which a strategy of the sampler may give, and its noise may move.
fn goal<B: Scalar>(list: &List, sampler: &Sampler, place: Place, found: &[B]) -> Vec<f64> {
    let transitions = list.transitions();
    let Some(source) = place.source else {
        return transitions[place.transition].0.desired_goal.clone();
    };
    let (episode, t) = transitions[source];
    let achieved = &episode.states[t + 1].achieved_goal;
    let may_be = |is_desired| {
        let mut parts = sampler.goals().parts().iter().filter(|part| part.weight() > 0.0);
        parts.any(|part| may_give(part.strategy(), list, place, is_desired))
    };
    let mut given = [(true, &episode.desired_goal), (false, achieved)].into_iter();
    let is_found =
        |goal: &[f64]| goal.iter().map(|number| B::from_f64(*number)).eq(found.iter().copied());
    if let Some((_, goal)) =
        given.clone().find(|(is_desired, goal)| may_be(*is_desired) && is_found(goal))
    {
        return goal.clone();
    }
    let moved: Vec<f64> = found.iter().map(|number| number.to_f64()).collect();
    let noise = sampler.goal_noise().filter(|noise| noise.share().get() > 0.0);
    let reaches = |goal: &[f64]| {
        // A goal is rounded to the buffer's type when it has been moved.
        noise.is_some_and(|noise| goal_distance(goal, &moved) < noise.radius() * 1.000_001 + 1e-6)
    };
    assert!(
        given.any(|(is_desired, goal)| may_be(is_desired) && reaches(goal)),
        "no strategy gives the goal of {place:?}"
    );
    moved
}

fn assert_row<B: Scalar>(
    list: &List,
    sampler: &Sampler,
    batch: &Batch<B>,
    row: usize,
    place: Place,
) {
    let transitions = list.transitions();
    let (episode, t) = transitions[place.transition];
    let part = |column: &'static str, values: &[B], len: usize| -> Vec<B> {
        assert_eq!(values.len(), len * batch.len(), "{column}");
        values[row * len..][..len].to_vec()
    };
    let (state, step) = (&episode.states[t], &episode.steps[t]);
    let (observations, goals) = (state.observation.len(), state.achieved_goal.len());
    let found = part("desired goal", batch.desired_goal(), goals);
    let goal = goal(list, sampler, place, &found);
    assert_bits(&found, &goal, "desired goal");
    let is_judged = place.source.is_some() || sampler.recomputed_rewards();
    let new_goal = is_judged.then_some(&goal[..]);
    let outcome = walk(episode, t, new_goal, sampler);
    let next = &episode.states[t + outcome.steps];
    if sampler.joined_goal().is_some() {
        let input = [&state.observation[..], &goal].concat();
        assert_bits(&part("input", batch.input(), observations + goals), &input, "input");
        let next_input = [&next.observation[..], &goal].concat();
        let found = part("next input", batch.next_input(), observations + goals);
        assert_bits(&found, &next_input, "next input");
    } else {
        let found = part("observation", batch.observation(), observations);
        assert_bits(&found, &state.observation, "observation");
        let found = part("next observation", batch.next_observation(), observations);
        assert_bits(&found, &next.observation, "next observation");
    }
    let found = part("achieved goal", batch.achieved_goal(), goals);
    assert_bits(&found, &state.achieved_goal, "achieved goal");
    let found = part("next achieved goal", batch.next_achieved_goal(), goals);
    assert_bits(&found, &next.achieved_goal, "next achieved goal");
    let found = part("action", batch.action(), step.action.len());
    assert_bits(&found, &step.action, "action");
    for (at, field) in step.fields.iter().enumerate() {
        let values = batch.field(&format!("field_{at}")).unwrap();
        assert_bits(&part("field", values, field.len()), field, "field");
    }
    if outcome.steps == 1 {
        assert_bits(&batch.reward()[row..=row], &[outcome.reward], "reward");
    }
    // The sign of the sum of several zeros is not documented.
    assert_eq!(batch.reward()[row].to_f64(), outcome.reward, "reward of {place:?}");
    assert_eq!(batch.terminated()[row], outcome.terminated, "terminated");
    assert_eq!(batch.truncated()[row], outcome.truncated, "truncated");
    match sampler.n_step() {
        None => assert!(batch.discount().is_empty()),
        Some(_) => assert_bits(&batch.discount()[row..=row], &[outcome.discount], "discount"),
    }
    match sampler.success() {
        false => assert!(batch.success().is_empty()),
        true => {
            let expected = Exceed.is_success(&next.achieved_goal, &goal);
            assert_eq!(batch.success()[row], expected, "success");
        }
    }
}

/// Asserts the documented importance weights: `(N * P)^-beta`, divided by the highest of the batch.
fn assert_weights<S: Scalar, B: Scalar>(
    list: &List,
    buffer: &HerBuffer<S>,
    sampler: &Sampler,
    batch: &Batch<B>,
) {
    let beta = sampler.priorities().unwrap().get();
    let (probabilities, count) = (list.probabilities(), list.transitions().len() as f64);
    let raw: Vec<f64> = places(buffer, batch)
        .map(|place| (count * probabilities[place.transition]).powf(-beta))
        .collect();
    let highest = raw.iter().copied().fold(0.0, f64::max);
    assert_eq!(batch.importance_weight().len(), batch.len());
    for (weight, raw) in batch.importance_weight().iter().zip(raw) {
        assert!((weight.to_f64() - raw / highest).abs() < 1e-6, "{weight:?}");
    }
}
