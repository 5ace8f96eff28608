//! Noise in new goals.

use std::f64::consts::TAU;

use libm::{cos, log1p, sin};
use serde::{Deserialize, Serialize};

use crate::sample::random::{BatchWords, Stream, Words};
use crate::scalar::Scalar;
use crate::split_mix::unit;
use crate::unit_interval::UnitInterval;

/// Noise in the goals of relabeled rows, for [`Sampler::with_goal_noise`](crate::Sampler).
///
/// A share of the new goals is moved by a vector that is drawn uniformly from a ball, with as many
/// dimensions as goals have elements. The moved goal is rounded to the buffer's type, and the
/// reward, termination and success of the row follow from it. A goal stays in place if the type
/// cannot hold the moved one.
///
/// If the radius is below the distance within which a goal counts as reached, some rows reach their
/// goal only approximately, besides those that reach it exactly.
///
/// Source: Lin et al., *Invariant transform experience replay*, 2019, which also mirrors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[must_use]
pub struct GoalNoise {
    radius: f64,
    share: UnitInterval,
}

impl GoalNoise {
    /// Creates noise of at most `radius`, in the unit of the goals, finite and at least 0, for the
    /// share `share` of the relabeled rows. For the Fetch tasks, 0.04 m and 0.5 work well.
    pub const fn new(radius: f64, share: UnitInterval) -> Self {
        Self { radius, share }
    }

    settings! {
        /// Returns the farthest distance that a goal is moved.
        radius: f64;
        /// Returns the average share of relabeled rows whose goal is moved.
        share: UnitInterval;
    }

    /// Returns whether the radius is finite and at least 0.
    pub(crate) fn is_valid(&self) -> bool {
        (0.0..f64::INFINITY).contains(&self.radius)
    }

    /// Moves the new goal of row `row` of a batch from a buffer of `S`. Returns `false` if the goal
    /// stays in place.
    pub(crate) fn displace<S: Scalar>(
        self,
        words: impl Words,
        row: usize,
        goal: &mut [f64],
    ) -> bool {
        // The words of a row belong to its other draws.
        let words = BatchWords::new(words.word(row, Stream::Strategy));
        let is_chosen = unit(words.word(0, Stream::Transition)) < self.share.get();
        // A sum with zero could change the sign of one.
        if !is_chosen || self.radius == 0.0 {
            return false;
        }
        // If a normal vector with two more elements is scaled to length 1, its other elements are
        // uniform in the ball. Source: Voelker et al., *Efficiently sampling vectors and
        // coordinates from the n-sphere and n-ball*, 2017.
        let two_squares = -2.0 * log1p(-unit(words.word(0, Stream::Goal)));
        let squares = (0..goal.len()).map(|index| normal(words, index).powi(2)).sum::<f64>();
        let factor = self.radius / (two_squares + squares).sqrt();
        for (index, element) in goal.iter_mut().enumerate() {
            let moved = S::from_f64(*element + factor * normal(words, index)).to_f64();
            if moved.is_finite() {
                *element = moved;
            }
        }
        true
    }
}

/// Returns element `index` of a vector of independent normal numbers, by the method of Box and
/// Muller.
fn normal(words: BatchWords, index: usize) -> f64 {
    let pair = index / 2 + 1;
    let length = (-2.0 * log1p(-unit(words.word(pair, Stream::Transition)))).sqrt();
    let angle = TAU * unit(words.word(pair, Stream::Goal));
    length * if index.is_multiple_of(2) { cos(angle) } else { sin(angle) }
}
