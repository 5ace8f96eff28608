//! A tree of weights, to draw in proportion to them.

use std::ops::Range;

/// The number of summands of a sum on the next level: those of a cache line.
const FANOUT: usize = 8;

/// Weights of consecutive numbers that slide upward, and sums of them, so the time of a draw or a
/// change grows with the logarithm of their number.
///
/// A sum is always computed from its summands, never adjusted: no error accumulates, and equal
/// weights give equal draws, whatever their history.
#[derive(Clone, Debug)]
pub(crate) struct SumTree {
    /// The weights, each at the place of its number modulo the size, which is a power of two; then
    /// sums of groups of them, sums of groups of these, and so on until one group is left.
    levels: Vec<Vec<f64>>,
    live: Range<u64>,
}

impl SumTree {
    pub(crate) fn new() -> Self {
        Self { levels: levels(FANOUT), live: 0..0 }
    }

    /// Creates a tree of `size` places with the weights of the numbers `live`, in their order;
    /// `None` if the size does not fit.
    pub(crate) fn restore(size: usize, live: Range<u64>, weights: &[f64]) -> Option<Self> {
        let fits = size.is_power_of_two() && size >= FANOUT.max(weights.len());
        let mut tree = Self { levels: levels(if fits { size } else { FANOUT }), live };
        for (number, weight) in tree.live.clone().zip(weights) {
            let place = tree.place(number);
            tree.levels[0][place] = *weight;
        }
        tree.add_up(0..tree.size());
        fits.then_some(tree)
    }

    /// Returns the size of a tree of `len` weights.
    pub(crate) fn size_for(len: usize) -> usize {
        len.next_power_of_two().max(FANOUT)
    }

    /// Returns the number of places for weights.
    pub(crate) fn size(&self) -> usize {
        self.levels[0].len()
    }

    pub(crate) fn weights(&self) -> impl Iterator<Item = f64> {
        self.live.clone().map(|number| self.weight(number))
    }

    /// Returns the weight of a live number.
    #[inline(always)]
    pub(crate) fn weight(&self, number: u64) -> f64 {
        self.levels[0][self.place(number)]
    }

    pub(crate) fn total(&self) -> f64 {
        self.levels.last().map_or(0.0, |top| top.iter().sum())
    }

    /// Changes the weight of a live number.
    pub(crate) fn set(&mut self, number: u64, weight: f64) {
        debug_assert!(self.live.contains(&number));
        self.fill(number..number + 1, weight);
    }

    /// Moves the live numbers to `live`, neither end of which may be lower than before, and gives
    /// each new number the weight `weight`.
    pub(crate) fn slide(&mut self, live: Range<u64>, weight: f64) {
        let old = self.live.clone();
        self.fill(old.start..live.start.min(old.end), 0.0);
        self.live.start = live.start.min(old.end);
        let len = (live.end - live.start) as usize;
        if len > self.size() {
            let kept: Vec<f64> = self.weights().collect();
            if let Some(tree) = Self::restore(Self::size_for(len), self.live.clone(), &kept) {
                *self = tree;
            }
        }
        self.live = live;
        self.fill(old.end.max(self.live.start)..self.live.end, weight);
    }

    /// Draws a live number, with a probability in proportion to its weight, by a number `unit` of
    /// `[0, 1)`. The total must be positive. A number of weight 0 is never drawn.
    #[inline]
    pub(crate) fn draw(&self, unit: f64) -> u64 {
        let mut rest = unit * self.total();
        let mut chosen = 0;
        for level in self.levels.iter().rev() {
            let group = chosen * FANOUT;
            for (at, weight) in level[group..].iter().take(FANOUT).enumerate() {
                if *weight > 0.0 {
                    // Rounding may leave a rest beyond the last positive weight, which is then
                    // chosen.
                    chosen = group + at;
                    if rest < *weight {
                        break;
                    }
                    rest -= weight;
                }
            }
        }
        let ahead = (chosen as u64).wrapping_sub(self.live.start) & (self.size() as u64 - 1);
        self.live.start + ahead
    }

    #[inline(always)]
    fn place(&self, number: u64) -> usize {
        (number & (self.size() as u64 - 1)) as usize
    }

    /// Gives the numbers, of which there are no more than places, the same weight.
    fn fill(&mut self, numbers: Range<u64>, weight: f64) {
        let mut start = numbers.start;
        while start < numbers.end {
            let place = self.place(start);
            let len = ((numbers.end - start) as usize).min(self.size() - place);
            self.levels[0][place..place + len].fill(weight);
            self.add_up(place..place + len);
            start += len as u64;
        }
    }

    /// Computes the sums over some places, at least one.
    fn add_up(&mut self, places: Range<usize>) {
        let Range { mut start, mut end } = places;
        for at in 1..self.levels.len() {
            (start, end) = (start / FANOUT, end.div_ceil(FANOUT));
            let [below, level] = &mut self.levels[at - 1..=at] else { return };
            for (group, sum) in level[start..end].iter_mut().enumerate() {
                let first = (start + group) * FANOUT;
                *sum = below[first..].iter().take(FANOUT).sum();
            }
        }
    }
}

/// Creates the levels of a tree of `size` weights, all 0.
fn levels(size: usize) -> Vec<Vec<f64>> {
    let mut levels = vec![vec![0.0; size]];
    let mut len = size;
    while len > FANOUT {
        len = len.div_ceil(FANOUT);
        levels.push(vec![0.0; len]);
    }
    levels
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 4 } else { 64 }))]

        #[test]
        fn a_tree_is_a_list_of_weights(
            slides in prop::collection::vec((0_u64..90, 0_u64..90, 0_u8..4), 1..12),
            changes in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..4), 0..20),
        ) {
            let mut tree = SumTree::new();
            let mut model = BTreeMap::new();
            let (mut start, mut end) = (0, 0);
            for (added, dropped, weight) in slides {
                end += added;
                start = (start + dropped).min(end);
                tree.slide(start..end, f64::from(weight));
                model.extend((end - added..end).map(|number| (number, f64::from(weight))));
                model.retain(|number, _| *number >= start);
                for (index, weight) in changes.iter().filter(|_| start < end) {
                    let number = start + index.index((end - start) as usize) as u64;
                    tree.set(number, f64::from(*weight));
                    model.insert(number, f64::from(*weight));
                }
                prop_assert!(tree.weights().eq(model.values().copied()));
                let total: f64 = model.values().sum();
                prop_assert_eq!(tree.total(), total);
                // A draw inverts the sums, which are exact, so every unit of weight is found.
                let mut found = BTreeMap::new();
                for at in 0..total as u32 {
                    *found.entry(tree.draw((f64::from(at) + 0.5) / total)).or_insert(0.0) += 1.0;
                }
                model.retain(|_, weight| *weight > 0.0);
                prop_assert_eq!(&found, &model);
                model = (start..end).zip(tree.weights()).collect();
            }
        }
    }

    #[test]
    fn each_number_has_its_share_of_the_units() {
        let mut tree = SumTree::new();
        tree.slide(0..200, 0.0);
        let numbers = [3, 4, 77, 199];
        numbers.iter().for_each(|number| tree.set(*number, 1.0));
        for (number, quarter) in numbers.into_iter().zip([0.0, 0.25, 0.5, 0.75]) {
            assert_eq!(tree.draw(quarter), number);
            assert_eq!(tree.draw((quarter + 0.25_f64).next_down()), number);
        }
        // What rounding leaves beyond the last weight is that one's.
        assert_eq!(tree.draw(1.0), 199);
        tree.set(199, 0.0);
        assert_eq!(tree.draw(1.0), 77);
    }

    #[test]
    fn rounding_never_draws_a_weight_of_zero() {
        let mut tree = SumTree::new();
        tree.slide(0..100, 0.0);
        for (number, weight) in [(3, 0.1), (40, 1e-300), (41, 0.7), (77, 0.2)] {
            tree.set(number, weight);
        }
        for unit in [0.0, 0.1, 0.8, 0.9, 1.0 - f64::EPSILON / 2.0, 1.0] {
            assert!(tree.weight(tree.draw(unit)) > 0.0);
        }
    }
}
