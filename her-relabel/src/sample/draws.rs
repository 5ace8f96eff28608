//! The random numbers of a batch.

/// How many words each row of a batch may use.
const WORDS_PER_ROW: u64 = 4;

/// The random words of a batch, all of them functions of one key: a row's words can be had in any
/// order and on any thread.
///
/// This is the generator SplitMix64, seeded with the key, with each row at its own place of the
/// sequence. Source: Steele, Lea and Flood, *Fast splittable pseudorandom number generators*, 2014.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draws {
    key: u64,
}

/// What a word of a row is for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    Transition,
    Relabel,
    Goal,
    Strategy,
}

impl Draws {
    pub(crate) fn new(key: u64) -> Self {
        Self { key }
    }

    /// The word of row `row` for `purpose`.
    #[inline(always)]
    pub(crate) fn word(&self, row: usize, purpose: Purpose) -> u64 {
        let place = row as u64 * WORDS_PER_ROW + purpose as u64 + 1;
        let mut word = self.key.wrapping_add(place.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        word ^ (word >> 31)
    }
}

/// A number below `n`, at least 1, from a random word. No number is likelier than another by more than
/// `n / 2^64` of its probability.
#[inline(always)]
pub(crate) fn below(word: u64, n: u64) -> u64 {
    ((u128::from(word) * u128::from(n)) >> 64) as u64
}

/// A number from 0 up to but not including 1, a multiple of 2^-53.
#[inline(always)]
pub(crate) fn unit(word: u64) -> f64 {
    (word >> 11) as f64 * f64::EPSILON / 2.0
}
