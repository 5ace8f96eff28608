//! Figures of the real environment, recorded in Python, to compare evaluations with.

use fetch_env::Task;
use goal_reward::RewardKind;
use serde::{Deserialize, Serialize};

use crate::{
    error::EvaluationError,
    evaluate::{Episode, Evaluation},
    statistics::fisher_exact,
};

/// Results of uniformly random actions in gymnasium-robotics 1.4.2 on MuJoCo 2.2.2: 400 episodes of
/// each task, with actions from a stream independent of the resets'.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RandomReference {
    /// Sum of the rewards.
    pub return_sum: Sample,
    /// Distance at the end of an episode, in meters.
    pub final_distance: Sample,
    /// Episodes whose last step was a success.
    pub successes: u64,
    /// Episodes recorded.
    pub episodes: u64,
}

/// Mean and standard deviation of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Mean.
    pub mean: f64,
    /// Standard deviation (with n - 1).
    pub sd: f64,
}

/// One figure compared with the reference's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the figure, such as `return_mean`.
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
            return_sum: Sample { mean: return_mean, sd: return_sd },
            final_distance: Sample { mean: final_distance.0, sd: final_distance.1 },
            successes,
            episodes: 400,
        }
    }

    /// Compares an evaluation of the random policy with the recorded figures: the means by a
    /// two-sample z test, the successes by Fisher's exact test.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if the evaluation is empty.
    pub fn compare(&self, evaluation: &Evaluation) -> Result<[Comparison; 3], EvaluationError> {
        let count = evaluation.episodes.len() as u64;
        if count == 0 {
            return Err(EvaluationError::NoEpisodes);
        }
        let mean = |name, value: fn(&Episode) -> f64, sample: Sample| {
            let measured = evaluation.episodes.iter().map(value).sum::<f64>() / count as f64;
            // The reference's spread serves for both: where successes are rare, a small sample's own
            // spread is a poor estimate.
            let error = sample.sd * (1.0 / count as f64 + 1.0 / self.episodes as f64).sqrt();
            let p_value = two_sided_normal((measured - sample.mean) / error);
            Comparison { name, measured, reference: sample.mean, p_value }
        };
        let successes = evaluation.episodes.iter().filter(|e| e.success).count() as u64;
        Ok([
            mean("return_mean", |e| e.return_sum, self.return_sum),
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

/// Successes at the last step of [`ScriptedPolicy`](crate::ScriptedPolicy) on the reference's own
/// model, with resets seeded from [`FIRST_SEED`](Self::FIRST_SEED) on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ScriptedReference {
    /// Episodes whose last step was a success.
    pub successes: u64,
    /// Episodes run.
    pub episodes: u64,
}

impl ScriptedReference {
    /// Seed of the first episode's reset.
    pub const FIRST_SEED: u64 = 30_000;

    /// Returns the figures of a task on MuJoCo `2.2.2` or `3.6.0`; `None` on any other.
    #[must_use]
    pub fn new(task: Task, mujoco: &str) -> Option<Self> {
        let successes = match (mujoco, task) {
            ("2.2.2" | "3.6.0", Task::Reach | Task::PickAndPlace) => 300,
            ("2.2.2", Task::Push) => 286,
            ("2.2.2", Task::Slide) => 49,
            ("3.6.0", Task::Push) => 300,
            ("3.6.0", Task::Slide) => 65,
            _ => return None,
        };
        Some(Self { successes, episodes: 300 })
    }
}

fn two_sided_normal(z: f64) -> f64 {
    statrs::function::erf::erfc(z.abs() / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::two_sided_normal;

    #[test]
    fn p_values_are_those_of_the_textbook() {
        assert!((two_sided_normal(1.959_964) - 0.05).abs() < 1e-6);
    }
}
