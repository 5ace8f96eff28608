//! A user's own rewards: they are learned, or the first that is wrong is named.

use std::ops::{ControlFlow, RangeInclusive};

use baselines::learn::{RunError, Target, TrainError, Trainer};
use fetch_env::wrappers::Wrapped;
use fetch_env::{DistanceReward, EnvError, FetchEnv, GoalReward, TimeLimit};
use fetch_sim::KinematicSimulator;

use crate::runs::{Result, ddpg, make, settings};

/// Two rewards, of a goal that is missed and of one that is reached, and their bounds.
#[derive(Clone)]
struct Either {
    missed: f64,
    reached: f64,
    bounds: RangeInclusive<f64>,
}

impl GoalReward for Either {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        if self.is_success(achieved_goal, desired_goal) { self.reached } else { self.missed }
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        DistanceReward::sparse().is_success(achieved_goal, desired_goal)
    }

    fn bounds(&self) -> RangeInclusive<f64> {
        self.bounds.clone()
    }
}

type EitherEnv = Wrapped<FetchEnv<KinematicSimulator, Either>, TimeLimit>;

fn trainer(
    missed: f64,
    reached: f64,
    bounds: RangeInclusive<f64>,
    n_step: usize,
) -> Result<Trainer<EitherEnv>> {
    let reward = Either { missed, reached, bounds };
    let make = || -> Result<_, EnvError> {
        Ok(make()?.into_inner().with_goal_reward(reward.clone()).time_limited())
    };
    let mut settings = settings(ddpg());
    settings.replay.n_step = n_step;
    Ok(Trainer::new(make, settings, 1, 2)?)
}

#[test]
fn rewards_of_any_range_are_learned() -> Result {
    let unbounded = f64::NEG_INFINITY..=f64::INFINITY;
    let rewards = [
        (0.0, 1.0, 0.0..=1.0, 1),
        (0.0, 1.0, unbounded, 3),
        (-3.0, 2.0, -3.0..=2.0, 1),
        (-3.0, 2.0, -3.0..=2.0, 2),
    ];
    for (missed, reached, bounds, n_step) in rewards {
        let mut trainer = trainer(missed, reached, bounds.clone(), n_step)?;
        let target = Target { success_rate: 1.0, evaluations: 2 };
        trainer.run(12_000, Some(target), |_, _| ControlFlow::Continue(()))?;
        assert!(target.is_reached(trainer.rows()), "{bounds:?}: {:?}", trainer.rows().last());
    }
    Ok(())
}

#[test]
fn the_first_reward_outside_the_bounds_is_named() -> Result {
    // Rounding to the buffer's precision takes no reward out of its bounds, nor any sum of them.
    for (low, high, n_step) in [(0.1, 0.7, 1), (0.1, 0.7, 4), (-0.1, 0.0, 2), (-0.3, 0.0, 2)] {
        let mut inside = trainer(low, high, low..=high, n_step)?;
        inside.run(400, None, |_, _| ControlFlow::Continue(()))?;
    }

    for (bounds, outside) in [(0.0..=0.5, 1.0), (0.5..=2.0, 0.0), (f64::NAN..=1.0, f64::NAN)] {
        let trained = trainer(0.0, 1.0, bounds.clone(), 1).map_err(|error| error.to_string());
        if outside.is_nan() {
            let error = trained.map(drop).expect_err("there are no such rewards");
            assert!(error.contains("reward_bounds is NaN to 1"), "{error}");
            continue;
        }
        match trained?.run(10_000, None, |_, _| ControlFlow::Continue(())) {
            Err(TrainError::Run { steps: 200.., source, .. }) => {
                let RunError::RewardOutside { value, low, high } = *source else {
                    panic!("{source:?}")
                };
                assert_eq!((value, low..=high), (outside, bounds));
            }
            other => panic!("{other:?}"),
        }
    }
    Ok(())
}
