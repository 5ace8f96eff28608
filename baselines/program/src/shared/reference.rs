//! Figures of random actions in the real environment, recorded in Python, to compare evaluations
//! with.

use anyhow::ensure;
use baselines::{
    Episode, Evaluation,
    statistics::{fisher_exact, normal_test},
};
use fetch_env::Task;
use goal_reward::RewardKind;

/// Results of uniformly random actions in gymnasium-robotics 1.4.2 on MuJoCo 2.2.2: 400 episodes of
/// each task, with actions from a stream independent of the resets'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomReference {
    /// Sum of the rewards.
    pub episode_return: Sample,
    /// Distance at the end of an episode, in meters.
    pub final_distance: Sample,
    /// Episodes whose last step was a success.
    pub successes: u64,
    /// Episodes recorded.
    pub episodes: u64,
}

/// Mean and standard deviation of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Mean.
    pub mean: f64,
    /// Standard deviation (with n - 1).
    pub sd: f64,
}

/// One figure compared with the reference's.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Name of the figure, such as `episode_return_mean`.
    pub name: &'static str,
    /// The value measured here.
    pub measured: f64,
    /// The value of the reference.
    pub reference: f64,
    /// Probability of a difference at least this large if both were the same environment.
    pub p_value: f64,
}

impl RandomReference {
    /// Returns the recorded figures of a task and reward.
    #[must_use]
    pub const fn new(task: Task, reward: RewardKind) -> Self {
        let (dense, sparse, final_distance, successes) = match task {
            Task::Reach => ((-9.875_050, 3.082_527), (-49.3325, 2.137_373), (0.228, 0.086_509), 0),
            Task::Push => {
                ((-8.793_011, 4.010_647), (-46.9375, 11.863_830), (0.181_959, 0.091_186), 24)
            }
            Task::PickAndPlace => {
                ((-12.410_651, 5.977_864), (-48.3075, 8.967_105), (0.253_949, 0.128_716), 13)
            }
            Task::Slide => {
                ((-22.226_287, 9.066_091), (-49.6725, 3.712_101), (0.464_207, 0.212_463), 4)
            }
        };
        let (return_mean, return_sd) = match reward {
            RewardKind::Dense => dense,
            RewardKind::Sparse => sparse,
        };
        Self {
            episode_return: Sample { mean: return_mean, sd: return_sd },
            final_distance: Sample { mean: final_distance.0, sd: final_distance.1 },
            successes,
            episodes: 400,
        }
    }

    /// Compares an evaluation of the random policy with the recorded figures: the means by a
    /// two-sample z test, the successes by Fisher's exact test.
    ///
    /// # Errors
    /// The evaluation has no episodes.
    pub fn compare(&self, evaluation: &Evaluation) -> anyhow::Result<[Comparison; 3]> {
        let count = evaluation.episodes.len() as u64;
        ensure!(count > 0, "there is no episode to compare: run at least one");
        let mean = |name, value: fn(&Episode) -> f64, sample: Sample| {
            let measured = evaluation.episodes.iter().map(value).sum::<f64>() / count as f64;
            // The reference's spread serves for both: where successes are rare, a small sample's
            // own spread is a poor estimate.
            let error = sample.sd * (1.0 / count as f64 + 1.0 / self.episodes as f64).sqrt();
            let p_value = normal_test((measured - sample.mean) / error);
            Comparison { name, measured, reference: sample.mean, p_value }
        };
        let successes = evaluation.episodes.iter().filter(|e| e.success).count() as u64;
        Ok([
            mean("episode_return_mean", |e| e.episode_return, self.episode_return),
            mean("final_distance_mean", |e| e.final_distance, self.final_distance),
            Comparison {
                name: "success_rate",
                measured: successes as f64 / count as f64,
                reference: self.successes as f64 / self.episodes as f64,
                p_value: fisher_exact(successes, count, self.successes, self.episodes)?,
            },
        ])
    }
}

#[cfg(test)]
mod tests {
    use baselines::{RandomPolicy, ScriptedPolicy, evaluate};
    use fetch_env::{Env, EnvId, make};

    use super::*;

    const EPISODES: usize = 40;

    #[test]
    fn the_comparison_with_the_reference_tells_policies_apart() -> anyhow::Result<()> {
        let id = EnvId { task: Task::Reach, reward: RewardKind::Dense };
        let mut env = make(id)?;
        let reference = RandomReference::new(id.task, id.reward);
        let mut policy = RandomPolicy::new(env.action_space(), 0);
        let random = evaluate(&mut env, &mut policy, EPISODES, 0, |_| ())?;
        let compared = reference.compare(&random)?;
        assert!(compared.iter().all(|figure| figure.p_value > 1e-4), "{compared:?}");
        let scripted = evaluate(&mut env, &mut ScriptedPolicy::new(id.task), EPISODES, 0, |_| ())?;
        let compared = reference.compare(&scripted)?;
        assert!(compared.iter().all(|figure| figure.p_value < 1e-4), "{compared:?}");
        Ok(())
    }
}
