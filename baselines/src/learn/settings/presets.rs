//! The presets: settings found for the Fetch tasks.

use fetch_env::{ObservationField, Task};

use super::algorithm::{AlgorithmSettings, DdpgSettings, PpoSettings, SacSettings};
use super::train::{
    ExplorationSettings, InputSettings, ReplaySettings, ScheduleSettings, TrainSettings,
};

impl TrainSettings {
    /// Returns the settings that this project found to learn soonest on a few cores.
    ///
    /// Source: this project's measurements, and for Slide MRL (Pitis et al., *Maximum entropy gain
    /// exploration for long horizon multi-goal reinforcement learning*, 2020). The settings that
    /// leave out inputs, mirror, move goals, and change rewards, starts and noise were chosen on the
    /// seeds 100 to 104, the windows of Push on 100 to 107, and its numbers of random episodes and of
    /// updates, which PickAndPlace shares, on 100 to 105. The presets use the observations and the
    /// symmetries of the tasks, but no solution. Reach, which has no object, and Slide, whose
    /// object keeps moving after the robot has left it, have different numbers than Push and
    /// PickAndPlace. For your own environment, [`default`](Self::default) assumes nothing about the
    /// task.
    #[must_use]
    pub fn fast(task: Task) -> Self {
        let mut ddpg = DdpgSettings::default();
        let Self { replay, inputs, exploration, schedule, .. } = Self::default();
        let mut replay = ReplaySettings {
            batch_size: 128,
            keep_already_achieved: 0.2,
            still_distance: 0.01,
            keep_motionless: 0.1,
            ..replay
        };
        let mut inputs = InputSettings { relative_goal: true, min_std: 0.01, ..inputs };
        let mut exploration =
            ExplorationSettings { random_episodes: 300, random_episode_share: 0.05, ..exploration };
        let mut schedule = ScheduleSettings { evaluation_interval: Some(8_000), ..schedule };
        match task {
            Task::Reach => {
                ddpg.actor_learning_rate = 0.001;
                ddpg.critic_learning_rate = 0.001;
                ddpg.action_l2 = 0.5;
                ddpg.average_fraction = 1.0;
                replay.batch_size = 256;
                exploration.random_episodes = 4;
                exploration.random_episode_share = 0.25;
                schedule.num_envs = 2;
                schedule.updates_per_cycle = 20;
                schedule.evaluation_interval = Some(200);
                // Evaluations of 100 episodes would take several times as long as the training.
                schedule.evaluation_episodes = 20;
            }
            Task::Push | Task::PickAndPlace => {
                // Each of the three symmetries as often as the transition itself.
                replay.mirrored = 0.75;
                replay.goal_noise = 0.04;
                replay.goal_noise_share = 0.25;
                inputs.left_out = elements(task, &["grip_pos", "object_pos"]);
                exploration.random_episodes = 100;
                exploration.max_action_hold = 9;
                schedule.updates_per_cycle = 320;
                if task == Task::Push {
                    // Without them, most failures are strikes that send the object off the table:
                    // noise hides these, and goals in hindsight lie where the object fell.
                    ddpg.average_fraction = 0.001;
                    replay.past_goal_weight = 1.0;
                    replay.n_step = 2;
                    replay.n_step_updates = Some(16_000);
                    exploration.noise_free_share = 0.5;
                }
            }
            Task::Slide => {
                ddpg.actor_learning_rate = 0.001;
                ddpg.critic_learning_rate = 0.001;
                ddpg.action_l2 = 0.01;
                ddpg.gamma = 0.98;
                ddpg.average_fraction = 0.0003;
                ddpg.noise = 0.1;
                ddpg.layer_norm = true;
                ddpg.halving_start = 125_000;
                ddpg.halving_interval = Some(75_000);
                replay.batch_size = 256;
                replay.past_goal_weight = 1.0;
                replay.mirrored = 0.5;
                replay.goal_noise = 0.03;
                replay.goal_noise_share = 0.5;
                replay.distance_factor = 1.43;
                inputs.left_out = elements(task, &["object_rot"]);
                exploration.random_action = 0.0;
                exploration.max_action_hold = 9;
                exploration.max_random_start_steps = 15;
                exploration.far_start_share = 0.5;
                exploration.noise_free_share = 0.5;
                schedule.updates_per_cycle = 200;
                schedule.evaluation_interval = Some(20_000);
            }
        }
        let algorithm = AlgorithmSettings::Ddpg(ddpg);
        Self { algorithm, replay, inputs, exploration, schedule, pixels: None }
    }

    /// Returns the settings of the authors, in one process.
    ///
    /// Source: `her/experiment/config.py` of openai/baselines, with two episodes and 40 updates per
    /// cycle.
    #[must_use]
    pub fn authors() -> Self {
        let Self { replay, inputs, exploration, .. } = Self::default();
        Self {
            algorithm: AlgorithmSettings::Ddpg(DdpgSettings::authors()),
            replay: ReplaySettings { still_distance: 0.01, ..replay },
            inputs: InputSettings { min_std: 0.01, ..inputs },
            exploration: ExplorationSettings {
                random_episodes: 0,
                random_episode_share: 0.0,
                ..exploration
            },
            schedule: ScheduleSettings {
                num_envs: 2,
                steps_per_cycle: 50,
                updates_per_cycle: 40,
                evaluation_interval: Some(8_000),
                evaluation_episodes: 100,
                per_rank: true,
            },
            pixels: None,
        }
    }

    /// Returns the settings of [`fast`](Self::fast), with SAC and the values that the book found
    /// best for it on Push: gamma 0.95 and a fixed temperature of 0.05. On Reach, which the book
    /// learns from dense rewards, the temperature is tuned. Windows have one step,
    /// because the value of a longer one would lack the entropies of its steps. This project
    /// implements the book's chapter on the anatomy of these environments.
    ///
    /// Source: the book's chapter on sparse rewards, a comparison of 24 settings. Its other numbers
    /// are those of Stable-Baselines3, which learn much later: learning rate 0.0003, target
    /// fraction 0.005, batches of 256, an update for each step of eight environments, inputs that
    /// are not normalized.
    #[must_use]
    pub fn book(task: Task) -> Self {
        let mut settings = Self::fast(task);
        let mut sac = SacSettings::book();
        if task == Task::Reach {
            sac.initial_temperature = 0.01;
            sac.target_entropy = Some(-1.0);
        }
        settings.algorithm = AlgorithmSettings::Sac(sac);
        settings.replay.n_step = 1;
        settings.replay.n_step_updates = None;
        settings
    }

    /// Returns the settings of PPO that this project found to learn Reach soonest from dense rewards.
    ///
    /// Source: this project's measurements, on the seeds 100 to 102.
    #[must_use]
    pub fn fast_ppo() -> Self {
        let mut settings = Self::on_policy(AlgorithmSettings::Ppo(PpoSettings::fast()));
        settings.inputs.relative_goal = true;
        settings.inputs.min_std = 0.01;
        settings.schedule.num_envs = 16;
        settings.schedule.evaluation_interval = Some(800);
        settings
    }

    /// Returns the settings of PPO that the book has for Reach with dense rewards, and the inputs of
    /// [`fast_ppo`](Self::fast_ppo).
    ///
    /// Source: the book's chapter on PPO. Its other numbers are those of Stable-Baselines3, whose
    /// hidden layers have hyperbolic tangents, and whose inputs are not normalized.
    #[must_use]
    pub fn book_ppo() -> Self {
        let mut settings = Self::fast_ppo();
        settings.algorithm = AlgorithmSettings::Ppo(PpoSettings::default());
        settings.schedule.num_envs = 8;
        settings.schedule.steps_per_cycle = 1_024;
        settings.schedule.evaluation_interval = Some(16_384);
        settings
    }
}

impl PpoSettings {
    /// Returns the settings that this project found to learn soonest.
    #[must_use]
    pub fn fast() -> Self {
        Self { learning_rate: 0.001, gamma: 0.9, minibatches: 8, ..Self::default() }
    }
}

impl DdpgSettings {
    /// Returns the authors' settings.
    #[must_use]
    pub fn authors() -> Self {
        Self {
            hidden: vec![256; 3],
            last_layer_scale: 1.0,
            actor_learning_rate: 0.001,
            critic_learning_rate: 0.001,
            gamma: 0.98,
            target_interval: 40,
            average_fraction: 1.0,
            action_l2: 1.0,
            ..Self::default()
        }
    }
}

impl SacSettings {
    /// Returns the settings with the book's fixed temperature and, as in the book, critics that are
    /// not normalized.
    #[must_use]
    pub fn book() -> Self {
        Self {
            layer_norm: false,
            initial_temperature: 0.05,
            target_entropy: None,
            ..Self::default()
        }
    }
}

/// Returns the elements of the fields with these names in a task's observation.
fn elements(task: Task, names: &[&str]) -> Vec<usize> {
    let fields = names.iter().filter_map(|name| ObservationField::find(task, name));
    fields.flat_map(|field| field.range.clone()).collect()
}
