//! Numbers at the bounds of what a buffer takes: what is added can be saved, exported and read.

use her_relabel::{AddError, EpisodeData, HerBuffer, Scalar, StartData, StepData};
use proptest::prelude::*;

use crate::common::{Result, config, drawn, exported};

/// The places of numbers in an episode of one step: observations, goals, actions, rewards, fields.
const PLACES: usize = 5;

/// The next number of `f32`.
fn next(number: f64) -> f64 {
    (number as f32).next_up().into()
}

/// A number at a bound, or next to it in `f32` or in `f64`, of both signs.
fn at_a_bound() -> impl Strategy<Value = f64> {
    let largest = f64::from(f32::MAX);
    // From here on, numbers are infinite in `f32`.
    let infinite = largest + (largest - f64::from(f32::MAX.next_down())) / 2.0;
    let bounds = [1e20, f64::from(1e20_f32), next(1e20), largest, infinite, f64::MAX, 1e-45, 0.0];
    let near = |bound: f64| {
        let halfway = (bound + next(bound)) / 2.0;
        prop::sample::select(vec![bound, bound.next_up(), bound.next_down(), halfway])
    };
    let signed = |number: f64| prop::sample::select(vec![number, -number]);
    prop::sample::select(bounds.to_vec()).prop_flat_map(near).prop_flat_map(signed)
}

fn add<T: Scalar, S: Scalar>(numbers: [f64; PLACES]) -> Result<HerBuffer<T>, AddError> {
    let mut buffer = HerBuffer::<T>::new(config(10)).expect("a configuration");
    let [observation, goal, action, reward, field] = numbers.map(S::from_f64);
    let data = EpisodeData {
        observation: &[observation; 4],
        achieved_goal: &[goal; 2],
        desired_goal: &[goal],
        action: &[action],
        reward: &[reward],
        terminated: false,
        truncated: true,
        fields: &[("latent", &[field; 2]), ("log_prob", &[field])],
    };
    buffer.add_episode(&data)?;
    // An unfinished episode is saved as well.
    let start =
        StartData { observation: &[observation; 2], achieved_goal: &[goal], desired_goal: &[goal] };
    buffer.begin_episode(0, &start)?;
    let step = StepData {
        action: &[action],
        reward,
        next_observation: &[observation; 2],
        next_achieved_goal: &[goal],
        terminated: false,
        truncated: false,
        fields: data.fields,
    };
    buffer.add_step(0, &step)?;
    Ok(buffer)
}

/// Returns whether the buffer took the numbers.
fn is_read_again<T: Scalar, S: Scalar>(numbers: [f64; PLACES]) -> Result<bool, TestCaseError> {
    let Ok(buffer) = add::<T, S>(numbers) else { return Ok(false) };
    let failed = |error: &dyn std::fmt::Debug| TestCaseError::fail(format!("{error:?}"));
    let mut saved = Vec::new();
    buffer.write_to(&mut saved).map_err(|error| failed(&error))?;
    let loaded = HerBuffer::<T>::read_from(&*saved).map_err(|error| failed(&error))?;
    prop_assert_eq!(loaded.unfinished_steps(0), buffer.unfinished_steps(0));
    let mut imported = HerBuffer::<T>::new(config(10)).map_err(|error| failed(&error))?;
    imported.import_npz_bytes(&exported(&buffer)).map_err(|error| failed(&error))?;
    for same in [&loaded, &imported] {
        let bits = |buffer| drawn(buffer).into_iter().map(f64::to_bits).collect::<Vec<_>>();
        prop_assert_eq!(bits(same), bits(&buffer));
    }
    // The wider type takes all numbers of the narrower one.
    let mut wider = HerBuffer::<f64>::new(config(10)).map_err(|error| failed(&error))?;
    wider.import_npz_bytes(&exported(&buffer)).map_err(|error| failed(&error))?;
    prop_assert_eq!(drawn(&wider).len(), drawn(&buffer).len());
    Ok(true)
}

proptest! {
    #[test]
    fn what_a_buffer_takes_is_read_again_after_saving_and_exporting(
        place in 0..PLACES,
        number in at_a_bound(),
        others in at_a_bound(),
    ) {
        let mut numbers = [others.clamp(-1e20, 1e20); PLACES];
        numbers[place] = number;
        is_read_again::<f32, f32>(numbers)?;
        is_read_again::<f32, f64>(numbers)?;
        is_read_again::<f64, f32>(numbers)?;
        is_read_again::<f64, f64>(numbers)?;
    }
}

#[test]
fn the_largest_reward_is_the_same_for_all_types() -> Result<(), TestCaseError> {
    let largest = f64::from(1e20_f32);
    let beyond = f64::from(1e20_f32.next_up());
    for (reward, fits) in [(1e20, true), (largest, true), (beyond, false), (1.1e20, false)] {
        for reward in [reward, -reward] {
            let numbers = [0.0, 0.0, 0.0, reward, 0.0];
            let taken = [
                is_read_again::<f32, f32>(numbers)?,
                is_read_again::<f32, f64>(numbers)?,
                is_read_again::<f64, f32>(numbers)?,
                is_read_again::<f64, f64>(numbers)?,
            ];
            assert_eq!(taken, [fits; 4], "{reward}");
        }
    }
    Ok(())
}
