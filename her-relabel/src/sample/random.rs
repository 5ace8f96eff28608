//! The random numbers of a batch: their source, and draws that use them.

use rand_core::Rng;

use crate::split_mix::{unit, word_at};
use crate::store::episodes::Episodes;
use crate::store::priorities::PriorityUnit;
use crate::store::priority_table::PriorityTable;
use crate::unit_interval::UnitInterval;

/// The source of a batch's random numbers: a seed, or a generator.
///
/// A seed always gives the same batch of the same buffer. A generator provides one word per batch,
/// as the seed.
///
/// # Example
/// ```
/// use her_relabel::RandomSource;
/// use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
///
/// assert_eq!(7_u64.seed(), 7);
/// let mut random = ChaCha8Rng::seed_from_u64(7);
/// assert_ne!((&mut random).seed(), (&mut random).seed());
/// ```
pub trait RandomSource {
    /// Returns the seed of a batch.
    fn seed(self) -> u64;
}

impl RandomSource for u64 {
    fn seed(self) -> u64 {
        self
    }
}

impl<R: Rng + ?Sized> RandomSource for &mut R {
    fn seed(self) -> u64 {
        self.next_u64()
    }
}

/// The number of words that each row of a batch may use.
const WORDS_PER_ROW: u64 = 4;

/// The random words of a batch, all functions of one key: each row has its own places in the key's
/// sequence, so its words are available in any order and on any thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BatchWords {
    key: u64,
}

/// The streams of random words; each row has a word in each.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stream {
    Transition,
    Relabel,
    Goal,
    Strategy,
}

/// The random words of the rows of a batch.
pub(crate) trait Words: Copy + Sync {
    /// Returns the word of row `row` in `stream`.
    fn word(&self, row: usize, stream: Stream) -> u64;
}

/// The maximal number of times that a row is drawn.
pub(crate) const MAX_DRAWS: usize = 4;

/// A row that no batch has, whose words are the keys of other sequences.
const KEYS: usize = 1 << 60;

impl BatchWords {
    pub(crate) fn new(key: u64) -> Self {
        Self { key }
    }

    /// Returns the words that draw rows in attempt `attempt`, counted from 0.
    pub(crate) fn attempt(&self, attempt: usize) -> Self {
        if attempt == 0 { *self } else { Self::new(self.word(KEYS + attempt, Stream::Transition)) }
    }

    /// Returns the words that decide, in [`Stream::Transition`], whether the rows drawn in attempt
    /// `attempt` are kept.
    pub(crate) fn chances(&self, attempt: usize) -> Self {
        Self::new(self.word(KEYS + attempt, Stream::Relabel))
    }

    /// Returns the words that decide, in [`Stream::Transition`], which rows are mirrored.
    pub(crate) fn mirroring(&self) -> Self {
        Self::new(self.word(KEYS + MAX_DRAWS, Stream::Transition))
    }
}

impl Words for BatchWords {
    #[inline(always)]
    fn word(&self, row: usize, stream: Stream) -> u64 {
        let place = row as u64 * WORDS_PER_ROW + stream as u64 + 1;
        word_at(self.key, place)
    }
}

/// The random words of a batch in which some rows are drawn several times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Redrawn<'a> {
    by_attempt: [BatchWords; MAX_DRAWS],
    /// The draw of each row, from 0.
    attempts: &'a [u8],
}

impl<'a> Redrawn<'a> {
    pub(crate) fn new(words: BatchWords, attempts: &'a [u8]) -> Self {
        Self { by_attempt: std::array::from_fn(|attempt| words.attempt(attempt)), attempts }
    }
}

impl Words for Redrawn<'_> {
    #[inline(always)]
    fn word(&self, row: usize, stream: Stream) -> u64 {
        self.by_attempt[usize::from(self.attempts[row]) % MAX_DRAWS].word(row, stream)
    }
}

/// Draws a number below `n`, at least 1, from a random word. The probabilities differ by at most
/// `n / 2^64` of their value.
#[inline(always)]
pub(crate) fn below(word: u64, n: u64) -> u64 {
    ((u128::from(word) * u128::from(n)) >> 64) as u64
}

/// Draws a number of steps from 0 to `n - 1`, each with a probability proportional to
/// `gamma^steps`, from a number `unit` of `[0, 1)`; `n` is at least 1.
#[inline(never)]
pub(crate) fn geometric(gamma: UnitInterval, n: u64, unit: f64) -> u64 {
    let gamma = gamma.get();
    if gamma == 1.0 {
        // Rounding does not reach `n`, which is at most 2^53.
        return (unit * n as f64) as u64;
    }
    // The inverse of the distribution function (1 - gamma^(s + 1)) / (1 - gamma^n). Gamma 0 needs
    // no special case: ln(1 - unit) is at least -37, and ln(0) is minus infinity.
    let tail = gamma.powf(n as f64);
    let steps = (unit * (tail - 1.0)).ln_1p() / gamma.ln();
    (steps as u64).min(n - 1)
}

/// Draws a live transition, each with the same probability, from a random word. At least one must
/// be live.
#[inline(always)]
pub(crate) fn uniform(episodes: &Episodes, word: u64) -> u64 {
    let live = episodes.live();
    live.start + below(word, live.end - live.start)
}

/// Draws a live transition, by priority, from a random word. At least one priority must be
/// positive.
#[inline]
pub(crate) fn by_priority(table: &PriorityTable, episodes: &Episodes, word: u64) -> u64 {
    let drawn = table.tree.draw(unit(word));
    match table.settings.unit() {
        PriorityUnit::Transition => drawn,
        PriorityUnit::Episode => {
            let live = episodes.get(drawn).live();
            let another = BatchWords::new(word).word(0, Stream::Transition);
            live.start + below(another, live.end - live.start)
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The largest number below 1 that is drawn.
    const LARGEST: f64 = 1.0 - f64::EPSILON / 2.0;

    proptest! {
        #[test]
        fn steps_are_fewer_than_those_left(gamma in 0.0..=1.0, bits in 0..=53_u32, n in 1_u64..) {
            let n = n.checked_shr(64 - bits).unwrap_or(0).max(1);
            let gamma = UnitInterval::new(gamma).unwrap_or(UnitInterval::ONE);
            for gamma in [gamma, UnitInterval::ONE] {
                prop_assert!(geometric(gamma, n, LARGEST) < n);
                prop_assert_eq!(geometric(gamma, n, 0.0), 0);
            }
        }
    }

    /// The inverse of the distribution function is 2 here, by rounding.
    #[test]
    fn rounding_does_not_pass_the_last_step() {
        let gamma = UnitInterval::new(0.522).unwrap_or(UnitInterval::ONE);
        assert_eq!(geometric(gamma, 2, LARGEST), 1);
    }
}
