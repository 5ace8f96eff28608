//! The random numbers of a batch, and their source.

use rand_core::Rng;

/// The source of a batch's random numbers: a seed, or a generator. Sealed.
///
/// A seed always gives the same batch of the same buffer, whatever was drawn before. Of a generator one
/// word is used per batch, as the seed.
pub trait RandomSource: sealed::Sealed {
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

mod sealed {
    pub trait Sealed {}
    impl Sealed for u64 {}
    impl<R: rand_core::Rng + ?Sized> Sealed for &mut R {}
}

/// The number of words that each row of a batch may use.
const WORDS_PER_ROW: u64 = 4;

/// The random words of a batch. All are functions of one key, so that a row's words are available in any
/// order and on any thread.
///
/// This is the generator SplitMix64, seeded with the key, with each row at its own place of the
/// sequence. Source: Steele, Lea and Flood, *Fast splittable pseudorandom number generators*, 2014.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draws {
    key: u64,
}

/// The purpose of one of a row's words.
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

/// A number below `n`, at least 1, from a random word. The probabilities differ by at most `n / 2^64` of
/// their value.
#[inline(always)]
pub(crate) fn below(word: u64, n: u64) -> u64 {
    ((u128::from(word) * u128::from(n)) >> 64) as u64
}

/// A number from 0 up to but not including 1, a multiple of 2^-53.
#[inline(always)]
pub(crate) fn unit(word: u64) -> f64 {
    (word >> 11) as f64 * f64::EPSILON / 2.0
}
