//! A step through any wrapper allocates nothing.

use allocation_counter::measure;
use fetch_env::{
    ActionElement, BoxSpace, Env, EnvError, FetchObservation,
    wrappers::{
        ActionRepeat, ClipAction, FilterObservation, FlattenObservation, FrameStack,
        NormalizeObservation, RecordEpisodeStatistics, RescaleAction, TimeAwareObservation,
        TransformObservation, TransformReward,
    },
};

use super::{FRAMES, Result, STEPS, TWICE, push};

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
    ensure_free_of_allocation(Ok(RecordEpisodeStatistics::new(push()?)))?;
    ensure_free_of_allocation(FlattenObservation::new(push()?))?;
    ensure_free_of_allocation(FilterObservation::new(push()?, 0..3))?;
    ensure_free_of_allocation(NormalizeObservation::new(push()?))?;
    ensure_free_of_allocation(TimeAwareObservation::new(push()?, STEPS))?;
    ensure_free_of_allocation(FrameStack::new(push()?, FRAMES))?;
    ensure_free_of_allocation(Ok(TransformObservation::new(push()?, space, grip)))?;
    ensure_free_of_allocation(Ok(TransformReward::with_goals(push()?, |reward| -reward)))?;
    ensure_free_of_allocation(RescaleAction::new(push()?, -2.0, 2.0))?;
    ensure_free_of_allocation(Ok(ClipAction::new(push()?)))?;
    ensure_free_of_allocation(Ok(ActionRepeat::new(push()?, TWICE)))?;
    let flat = FlattenObservation::new(RecordEpisodeStatistics::new(push()?))?;
    ensure_free_of_allocation(FrameStack::new(NormalizeObservation::new(flat)?, FRAMES))
}

#[test]
fn observations_that_are_kept_keep_their_elements() -> Result {
    let mut env = FlattenObservation::new(push()?)?;
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
