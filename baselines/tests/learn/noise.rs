//! The noise of observations that an actor sees while it learns.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use baselines::learn::{Trainer, Transitions};
use baselines::workers::OneProcess;

use crate::runs::{Result, ddpg, make, settings};
use crate::watched;

/// What the actor sees of the observations before and after each step, without what the critic sees of
/// them.
type Noise = [Vec<f32>; 2];

fn keep(kept: &mut Noise, batch: Transitions<'_>) {
    let pairs = [(batch.actor_input, batch.input), (batch.next_actor_input, batch.next_input)];
    for (kept, (noisy, exact)) in kept.iter_mut().zip(pairs) {
        kept.extend(noisy.iter().zip(exact).map(|(noisy, exact)| noisy - exact));
    }
}

/// Returns the noise of the rows of 50 updates before and after the step, in the units of the
/// observation and then of the goal.
fn noise(std: f64) -> Result<[Vec<f64>; 2]> {
    let kept = Arc::<Mutex<Noise>>::default();
    let mut settings = settings(ddpg());
    settings.inputs.actor_observation_noise = std;
    settings.inputs.left_out = vec![1];
    // Nothing is clipped.
    settings.inputs.clip = 1_000.0;
    let build = watched::build(&kept, keep);
    let mut trainer = Trainer::with_algorithm(make, settings, 0, 1, Box::new(OneProcess), build)?;
    trainer.run(400, None, |_, _| ControlFlow::Continue(()))?;
    kept.lock().expect("no thread panics").iter_mut().for_each(Vec::clear);
    trainer.update(50)?;
    let header = trainer.policy("FetchReach-v4")?.header().clone();
    let normalizer = header.observation_normalizer.ok_or("no normalizer")?;
    let mut units: Vec<f64> = normalizer.std().collect();
    units.extend([1.0; 3]);
    let kept = kept.lock().expect("no thread panics");
    Ok(kept.each_ref().map(|noise| {
        noise
            .iter()
            .zip(units.iter().cycle())
            .map(|(noise, unit)| f64::from(*noise) * unit)
            .collect()
    }))
}

#[test]
fn the_actor_sees_noise_where_it_was_asked_for_and_the_critic_sees_none() -> Result {
    const LEN: usize = 13;
    assert!(noise(0.0)?.iter().flatten().all(|noise| *noise == 0.0));
    let both = noise(0.02)?;
    assert_ne!(both[0], both[1]);
    for noise in both {
        let rows = noise.len() / LEN;
        for element in 0..LEN {
            let of_element = || noise.iter().skip(element).step_by(LEN);
            let mean = of_element().sum::<f64>() / rows as f64;
            let std = (of_element().map(|noise| noise * noise).sum::<f64>() / rows as f64).sqrt();
            // The element that is left out, and the goal.
            let expected = if element == 1 || element >= 10 { 0.0 } else { 0.02 };
            assert!((std - expected).abs() < 0.03 * expected + 1e-12, "{element}: {std}");
            assert!(mean.abs() < 0.05 * expected + 1e-12, "{element}: {mean}");
        }
    }
    Ok(())
}
