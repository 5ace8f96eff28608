//! The environments that a trainer can learn.

use fetch_env::BoxSpace;

use crate::collector::CollectEnv;

/// An environment that a [`Trainer`](crate::learn::Trainer) can learn: its actions are a box from -1 to 1.
///
/// Every such environment implements this trait. A function that takes any of them:
///
/// ```
/// use baselines::learn::{LearnEnv, TrainError, TrainSettings, Trainer};
/// use fetch_env::{EnvError, Task, make_kinematic};
///
/// /// Returns the success rate after one cycle.
/// fn first_success_rate<E: LearnEnv>(
///     make: impl Fn() -> Result<E, EnvError>,
/// ) -> Result<f64, TrainError> {
///     let mut settings = TrainSettings::fast(Task::Reach);
///     settings.schedule.evaluation_episodes = 4;
///     let mut trainer = Trainer::new(make, settings, 0, 1)?;
///     trainer.cycle()?;
///     Ok(trainer.evaluate()?.success_rate.value)
/// }
///
/// assert!(first_success_rate(|| Ok(make_kinematic("FetchReach-v4")?))? <= 1.0);
/// # Ok::<(), TrainError>(())
/// ```
pub trait LearnEnv: CollectEnv<ActionSpace = BoxSpace<f32>> {}

impl<E: CollectEnv<ActionSpace = BoxSpace<f32>>> LearnEnv for E {}
