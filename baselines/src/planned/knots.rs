//! Actions about those of a plan: a few numbers that say how far they differ from it.

use fetch_env::BoxSpace;

/// The actions of a plan, to which offsets are added: one for each element of an action at each
/// knot, and straight lines between them.
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
