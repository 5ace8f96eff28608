//! Runs end with the same bits on each processor: these checksums hold for all.

use std::hash::{DefaultHasher, Hasher};
use std::ops::ControlFlow;

use baselines::learn::{AlgorithmSettings, DdpgSettings, PpoSettings, SacSettings, Trainer};

use crate::runs::{Result, all_on, make, outcome};

/// Returns the weights in a policy's file, after the header, which contains all settings.
fn weights(policy: &[u8]) -> Option<&[u8]> {
    let (header_len, rest) = policy.split_first_chunk()?;
    rest.get(usize::try_from(u64::from_le_bytes(*header_len)).ok()?..)
}

/// Returns a checksum of the curve of a run, and of the weights at its end.
fn checksum(algorithm: AlgorithmSettings) -> Result<String> {
    let mut settings = all_on(algorithm);
    // Lengths that are not multiples of a vector's, and enough columns for several vectors.
    if !matches!(settings.algorithm, AlgorithmSettings::Ppo(_)) {
        settings.replay.batch_size = 61;
    }
    settings.schedule.evaluation_interval = Some(200);
    let mut trainer = Trainer::new(make, settings, 7, 2)?;
    trainer.run(400, None, |_, _| ControlFlow::Continue(()))?;
    let (rows, policy) = outcome(&trainer)?;
    let mut hasher = DefaultHasher::new();
    hasher.write(&serde_json::to_vec(&rows)?);
    hasher.write(weights(&policy).ok_or("not a policy's file")?);
    Ok(format!("{:016x}", hasher.finish()))
}

#[test]
fn ddpg_has_the_same_bits_on_each_processor() -> Result {
    let settings =
        DdpgSettings { hidden: vec![43, 21], layer_norm: true, ..DdpgSettings::default() };
    assert_eq!(checksum(AlgorithmSettings::Ddpg(settings))?, "fc5d58714939efb4");
    Ok(())
}

#[test]
fn sac_has_the_same_bits_on_each_processor() -> Result {
    let settings = SacSettings { hidden: vec![43, 21], ..SacSettings::default() };
    assert_eq!(checksum(AlgorithmSettings::Sac(settings))?, "1e011d1aa21972ce");
    Ok(())
}

#[test]
fn ppo_has_the_same_bits_on_each_processor() -> Result {
    let settings = PpoSettings { hidden: vec![43, 21], minibatches: 3, ..PpoSettings::default() };
    assert_eq!(checksum(AlgorithmSettings::Ppo(settings))?, "8e55342f7a5ea6ab");
    Ok(())
}
