//! A step through any wrapper allocates nothing.

use allocation_counter::measure;
use fetch_env::{
    ActionElement, BoxSpace, Env, EnvError, EnvExt, FetchObservation,
    wrappers::{
        ActionNoise, ActionRepeat, ClipAction, DelayAction, DelayObservation, FilterObservation,
        FlattenObservation, FrameStack, LowPassAction, NormalizeObservation, ObservationNoise,
        RecordEpisodeStatistics, RescaleAction, TimeAwareObservation, TransformObservation,
    },
};

use super::{FRAMES, Result, STEPS, TWICE, push, transform};

/// Fails if a step allocates, after the first few, while the last observation is kept.
fn ensure_free_of_allocation<E>(env: Result<E, EnvError>) -> Result
where
    E: Env<ActionSpace: Clone>,
    ActionElement<E>: Default,
{
    let mut env = env?;
    let action = vec![Default::default(); fetch_env::ActionSpace::action_len(env.action_space())];
    let mut last = env.reset(Some(0))?.observation;
    for _ in 0..4 {
        last = env.step(&action)?.observation;
    }
    let counted = measure(|| {
        for _ in 0..20 {
            last = env.step(&action).expect("a step").observation;
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?} for {last:?}");
    Ok(())
}

#[test]
fn no_step_allocates() -> Result {
    let space = BoxSpace::<f64>::unbounded(3)?.into();
    let grip = |observation: FetchObservation| observation.grip_position();
    ensure_free_of_allocation(push()?.wrap(RecordEpisodeStatistics::new()))?;
    ensure_free_of_allocation(push()?.wrap(FlattenObservation::new()))?;
    ensure_free_of_allocation(push()?.wrap(FilterObservation::new(0..3)))?;
    ensure_free_of_allocation(push()?.wrap(NormalizeObservation::new()))?;
    ensure_free_of_allocation(push()?.wrap(TimeAwareObservation::new(STEPS)))?;
    ensure_free_of_allocation(push()?.wrap(FrameStack::new(FRAMES)))?;
    ensure_free_of_allocation(push()?.wrap(TransformObservation::new(space, grip)))?;
    ensure_free_of_allocation(transform(push()?, |reward| -reward))?;
    ensure_free_of_allocation(push()?.wrap(RescaleAction::new(-2.0, 2.0)))?;
    ensure_free_of_allocation(push()?.wrap(ClipAction::new()))?;
    ensure_free_of_allocation(push()?.wrap(ActionRepeat::new(TWICE)))?;
    ensure_free_of_allocation(push()?.wrap(LowPassAction::new(0.5)))?;
    ensure_free_of_allocation(push()?.wrap(ActionNoise::new(0.1, 7)))?;
    ensure_free_of_allocation(push()?.wrap(DelayAction::new(3)))?;
    ensure_free_of_allocation(push()?.wrap(ObservationNoise::new(0.1, 7)))?;
    ensure_free_of_allocation(push()?.wrap(DelayObservation::new(3)))?;
    let flat = push()?.wrap(RecordEpisodeStatistics::new())?.wrap(FlattenObservation::new())?;
    ensure_free_of_allocation(flat.wrap(NormalizeObservation::new())?.wrap(FrameStack::new(FRAMES)))
}

#[test]
fn observations_that_are_kept_keep_their_elements() -> Result {
    let mut env = push()?.wrap(FlattenObservation::new())?;
    let mut kept = vec![env.reset(Some(0))?.observation];
    for _ in 0..20 {
        kept.push(env.step(&[1.0, 0.5, 0.0, 0.0])?.observation);
    }
    let copies: Vec<Vec<f32>> = kept.iter().map(|array| array.to_vec()).collect();
    for _ in 0..20 {
        env.step(&[-1.0, 0.0, 0.0, 0.0])?;
    }
    assert!(kept.iter().zip(&copies).all(|(kept, copy)| kept[..] == copy[..]));
    assert_ne!(copies[0], copies[20], "the gripper moves");
    Ok(())
}
