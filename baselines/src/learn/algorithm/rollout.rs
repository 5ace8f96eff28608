//! Advantages and returns of steps that were taken one after the other.

/// Steps in the order in which they were taken, with what a critic says of their states: what an
/// on-policy algorithm computes advantages from. All slices have a number for each step.
///
/// ```
/// use baselines::learn::{Rollout, RolloutError};
///
/// // Two steps of an episode that a time limit cuts off, and one of the next episode.
/// let rollout = Rollout::new(
///     &[-1.0, -1.0, -2.0],
///     &[0.5; 3],
///     &[-2.0, -1.0, -3.0],
///     &[-1.0, -4.0, -2.0],
///     &[false, true, true],
/// )?;
/// // The second step's is -1 + 0.5 * -4 + 1: the state at the cut keeps its value.
/// assert_eq!(rollout.advantages(0.8), [-0.3, -2.0, 0.0]);
/// assert_eq!(rollout.returns(0.8), [-2.3, -3.0, -3.0]);
/// # Ok::<(), RolloutError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Rollout<'a> {
    reward: &'a [f32],
    discount: &'a [f32],
    value: &'a [f32],
    next_value: &'a [f32],
    is_last: &'a [bool],
}

impl<'a> Rollout<'a> {
    /// Combines the rewards of steps, the discounts of the states after them, which are 0 where the
    /// task ended, the values of the states before and after them, and whether each step is the last
    /// of its episode, or the last that was taken in it so far.
    ///
    /// An episode that was only cut off has a discount and the value of its last state.
    ///
    /// # Errors
    /// [`RolloutError`] if the slices have different lengths.
    pub fn new(
        reward: &'a [f32],
        discount: &'a [f32],
        value: &'a [f32],
        next_value: &'a [f32],
        is_last: &'a [bool],
    ) -> Result<Self, RolloutError> {
        let lens = [reward.len(), discount.len(), value.len(), next_value.len(), is_last.len()];
        if lens.iter().any(|len| *len != lens[0]) {
            return Err(RolloutError { lens });
        }
        Ok(Self { reward, discount, value, next_value, is_last })
    }

    /// Returns the generalized advantage of each step: the discounted sum of the errors of the
    /// values from this step to the last of its episode, each weighted by `lambda` once for every
    /// step in between. With 0 it is the error of the step alone, and with 1 the sum of rewards up to
    /// the last state, and its value, minus the value of the first.
    ///
    /// Source: Schulman et al., *High-dimensional continuous control using generalized advantage
    /// estimation*, 2016.
    #[must_use]
    pub fn advantages(&self, lambda: f32) -> Vec<f32> {
        let mut advantages = vec![0.0; self.reward.len()];
        let mut after = 0.0;
        for (step, advantage) in advantages.iter_mut().enumerate().rev() {
            let discount = self.discount[step];
            let error = self.reward[step] + discount * self.next_value[step] - self.value[step];
            after = if self.is_last[step] { error } else { error + discount * lambda * after };
            *advantage = after;
        }
        advantages
    }

    /// Returns the return of each step, which its value should have been: its
    /// [advantage](Self::advantages) plus its value.
    #[must_use]
    pub fn returns(&self, lambda: f32) -> Vec<f32> {
        let mut returns = self.advantages(lambda);
        returns.iter_mut().zip(self.value).for_each(|(sum, value)| *sum += value);
        returns
    }
}

/// Error returned by [`Rollout::new`] for slices of different lengths.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "rewards, discounts, values, next values and ends have the lengths {lens:?}: pass a number for \
     each step"
)]
pub struct RolloutError {
    lens: [usize; 5],
}
debug_as_display!(RolloutError);

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::Rollout;

    /// A step: its reward, its discount, the values around it, and whether it is the last.
    type Step = (f32, f32, f32, f32, bool);

    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let discount = prop_oneof![Just(0.0), 0.5..1.0_f32];
        vec((-2.0..0.0_f32, discount, -9.0..0.0_f32, -9.0..0.0_f32, any::<bool>()), 1..60)
    }

    fn advantages(steps: &[Step], lambda: f32) -> Vec<f32> {
        let column = |get: fn(&Step) -> f32| steps.iter().map(get).collect::<Vec<_>>();
        let (reward, discount) = (column(|step| step.0), column(|step| step.1));
        let (value, next_value) = (column(|step| step.2), column(|step| step.3));
        let is_last: Vec<bool> = steps.iter().map(|step| step.4).collect();
        let rollout = Rollout::new(&reward, &discount, &value, &next_value, &is_last);
        rollout.expect("the lengths are the same").advantages(lambda)
    }

    proptest! {
        /// From the definition, forwards: sums of errors with growing powers of the discount.
        #[test]
        fn advantages_are_weighted_sums_of_the_errors_up_to_the_last_step(
            steps in steps(),
            lambda in 0.0..=1.0_f32,
        ) {
            let computed = advantages(&steps, lambda);
            for (first, computed) in computed.iter().enumerate() {
                let (mut sum, mut weight) = (0.0, 1.0);
                for (reward, discount, value, next_value, is_last) in &steps[first..] {
                    sum += weight * (reward + discount * next_value - value);
                    weight *= discount * lambda;
                    if *is_last {
                        break;
                    }
                }
                prop_assert!((computed - sum).abs() < 1e-3, "{computed} {sum}");
            }
        }

        #[test]
        fn episodes_do_not_depend_on_those_after_them(
            episode in steps(),
            others in [steps(), steps()],
            lambda in 0.0..=1.0_f32,
        ) {
            let mut episode = episode;
            episode.last_mut().expect("it has a step").4 = true;
            let of = |other: &[Step]| {
                advantages(&[episode.as_slice(), other].concat(), lambda)[..episode.len()].to_vec()
            };
            prop_assert_eq!(of(&others[0]), of(&others[1]));
        }

        /// A critic that is right everywhere leaves nothing to gain.
        #[test]
        fn true_values_have_no_advantage(
            rewards in vec(-2.0..0.0_f32, 1..50),
            discount in 0.5..1.0_f32,
            lambda in 0.0..=1.0_f32,
        ) {
            let mut steps = Vec::new();
            let mut next_value = 0.0;
            for reward in rewards.iter().rev() {
                let value = reward + discount * next_value;
                steps.push((*reward, discount, value, next_value, false));
                next_value = value;
            }
            steps.reverse();
            steps.last_mut().expect("it has a step").4 = true;
            prop_assert!(advantages(&steps, lambda).iter().all(|advantage| advantage.abs() < 1e-3));
        }
    }

    #[test]
    fn slices_of_different_lengths_are_refused() {
        let error = Rollout::new(&[0.0], &[0.9], &[0.0], &[], &[true]).expect_err("one is empty");
        assert!(error.to_string().contains("[1, 1, 1, 0, 1]"), "{error}");
    }
}
