//! The settings of an actor that sees pictures.

use fetch_env::Task;

use crate::learn::settings::range::ranged_settings;

ranged_settings! {
    /// The actor that sees pictures, of a
    /// [`Trainer::with_pixels`](crate::learn::Trainer::with_pixels). The defaults are those of Push.
    ///
    /// Source: this project's measurements on the seeds 100 to 102. Actors with higher learning rates
    /// learned later, or never.
    pub struct PixelActorSettings {
        /// The lengths of the hidden layers, which follow the convolutions.
        pub pixel_hidden: Vec<usize> = vec![256, 256] => 1..=1_024 in at most 4 layers,
        /// The learning rate.
        pub pixel_learning_rate: f32 = 0.0015 => 1e-9..=1.0,
        /// The number of states of a batch.
        pub pixel_batch_size: usize = 64 => 1..=8_192,
        /// The number of updates of the critic for each of this actor, which take ten times as
        /// long.
        pub critic_updates: u64 = 8 => 1..=1_000_000,
        /// The fraction of the way that the actor that acts and is evaluated moves towards the
        /// learning one after every update. It is larger in the first updates.
        pub pixel_average_fraction: f32 = 0.005 => 1e-6..=1.0,
        /// The weight of the mean square of the actions in the loss, whose other part is the
        /// negative mean value.
        pub pixel_action_l2: f32 = 0.05 => 0.0..=1_000.0,
        /// The standard deviation of the noise on the actions while collecting.
        pub pixel_noise: f32 = 0.2 => 0.0..=10.0,
        /// The share of the environments in which this actor collects. In the others, the actor that
        /// sees the state does.
        pub acting_share: f64 = 0.5 => 0.0..=1.0,
        /// The number of states that are kept with their pictures, the newest ones. A picture of
        /// 64 x 64 pixels takes 12 kB.
        pub pixel_capacity: usize = 50_000 => 1..=100_000_000,
    }
}

impl PixelActorSettings {
    /// Returns the settings for a Fetch task.
    #[must_use]
    pub fn of_task(task: Task) -> Self {
        match task {
            Task::Reach => {
                let (pixel_learning_rate, pixel_action_l2) = (0.003, 0.5);
                Self { pixel_learning_rate, critic_updates: 4, pixel_action_l2, ..Self::default() }
            }
            _ => Self::default(),
        }
    }
}
