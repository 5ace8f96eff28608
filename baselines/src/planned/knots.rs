//! Actions near those of a plan: a few numbers say how far they differ from it.

use fetch_env::BoxSpace;

/// The actions of a plan, to which offsets are added: one for each element of an action at each
/// knot, with linear interpolation between knots.
pub(super) struct Knots<'a> {
    actions: &'a [Vec<f32>],
    space: &'a BoxSpace<f32>,
    count: usize,
}

impl<'a> Knots<'a> {
    pub(super) const fn new(
        actions: &'a [Vec<f32>],
        space: &'a BoxSpace<f32>,
        count: usize,
    ) -> Self {
        Self { actions, space, count }
    }

    /// Returns the standard deviation of each offset: a share of the distance between the bounds.
    pub(super) fn spread(&self, share: f64) -> Vec<f64> {
        let bounds = self.space.low().iter().zip(self.space.high());
        let widths: Vec<_> =
            bounds.map(|(low, high)| share * (f64::from(*high) - f64::from(*low))).collect();
        widths.repeat(self.count)
    }

    /// Returns the actions with these offsets, clipped to the bounds.
    pub(super) fn actions(&self, offsets: &[f64]) -> Vec<Vec<f32>> {
        let len = self.space.len();
        let last = (self.actions.len().max(2) - 1) as f64;
        let intervals = self.count - 1;
        let moved = |(step, action): (usize, &Vec<f32>)| {
            let place = step as f64 / last * intervals as f64;
            let knot = (place as usize).min(intervals - 1);
            let share = place - knot as f64;
            let [before, after] = [knot, knot + 1].map(|knot| &offsets[knot * len..][..len]);
            let element = |index: usize| {
                let offset = before[index] + share * (after[index] - before[index]);
                let value = f64::from(action[index]) + offset;
                (value as f32).clamp(self.space.low()[index], self.space.high()[index])
            };
            (0..len).map(element).collect()
        };
        self.actions.iter().enumerate().map(moved).collect()
    }
}

#[cfg(test)]
mod tests {
    use fetch_env::BoxSpace;
    use proptest::prelude::*;

    use super::Knots;

    proptest! {
        #[test]
        fn actions_lie_in_the_space_and_are_the_plans_without_offsets(
            steps in 1..60_usize,
            count in 2..20_usize,
            action in -1.0..=1.0_f32,
            offset in -9.0..=9.0_f64,
        ) {
            let space = BoxSpace::uniform(vec![2], -1.0, 1.0).expect("bounds");
            let actions = vec![vec![action, 0.25]; steps];
            let knots = Knots::new(&actions, &space, count);
            let still = vec![0.0; knots.spread(0.1).len()];
            prop_assert_eq!(&knots.actions(&still), &actions);
            let moved = knots.actions(&vec![offset; still.len()]);
            prop_assert!(moved.iter().all(|action| space.contains(action)));
        }
    }

    #[test]
    fn offsets_change_along_straight_lines() {
        let space = BoxSpace::uniform(vec![1], -1.0, 1.0).expect("bounds");
        let actions = vec![vec![0.5]; 5];
        let knots = Knots::new(&actions, &space, 3);
        let expected = [[0.5], [0.25], [0.0], [0.5], [1.0]];
        assert_eq!(knots.actions(&[0.0, -0.5, 0.5]), expected.map(Vec::from));
        assert_eq!(knots.actions(&[0.0, -0.5, 0.7])[4], [1.0], "clipped");
    }
}
