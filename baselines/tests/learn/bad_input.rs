//! Environments that return numbers that are not finite.

use baselines::CollectorError;
use baselines::learn::{TrainError, Trainer};
use fetch_env::wrappers::TransformReward;

use crate::runs::{Result, ddpg, make, settings};

#[test]
fn a_reward_that_is_not_finite_stops_the_run() -> Result {
    let mut trainer = Trainer::new(
        || Ok(TransformReward::with_goals(make()?, |_| f64::NAN)),
        settings(ddpg()),
        0,
        1,
    )?;
    match trainer.cycle() {
        Err(TrainError::Collect { steps: 0, source: CollectorError::NotFinite { .. }, .. }) => {
            Ok(())
        }
        other => panic!("{other:?}"),
    }
}
