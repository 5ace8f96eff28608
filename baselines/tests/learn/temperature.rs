//! The temperature of SAC is learned, or stays as it is.

use baselines::learn::{Algorithm, AlgorithmInit, Sac, SacSettings, Transitions};

use crate::runs::Result;

/// Returns the temperature before and after some updates.
fn temperatures(target_entropy: Option<f32>) -> Result<[f32; 2]> {
    let init = AlgorithmInit {
        num_inputs: 1,
        num_actions: 1,
        reward_bounds: -1.0..=0.0,
        seed: 0,
        rank: 0,
    };
    let settings = SacSettings { hidden: vec![8], target_entropy, ..SacSettings::book() };
    let mut sac = Sac::new(settings, init)?;
    let batch = Transitions {
        len: 2,
        input: &[-1.0, 1.0],
        actor_input: &[-1.0, 1.0],
        action: &[0.4, 0.6],
        reward: &[-1.0, 0.0],
        discount: &[0.95; 2],
        next_input: &[0.0; 2],
        next_actor_input: &[0.0; 2],
        demonstrated: &[false; 2],
        ..Transitions::default()
    };
    let before = temperature(&mut sac)?;
    for _ in 0..20 {
        sac.update(batch, &mut |_| ());
    }
    Ok([before, temperature(&mut sac)?])
}

fn temperature(sac: &mut Sac) -> Result<f32> {
    let state = sac.state_mut();
    let found = state.vectors.iter().find(|(name, _)| name == "temperature.logarithm");
    Ok(found.ok_or("it is not saved")?.1[0].exp())
}

#[test]
fn a_temperature_without_a_target_stays() -> Result {
    let [before, after] = temperatures(None)?;
    assert!((before - 0.05).abs() < 1e-6 && after == before, "{before}, {after}");
    let [before, after] = temperatures(Some(-1.0))?;
    assert!(after != before, "{before}, {after}");
    Ok(())
}
