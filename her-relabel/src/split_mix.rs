//! Random words as a function of a key and a place.

/// Returns the word at `place` of the sequence of `key`, so that words are available in any order and on any
/// thread.
///
/// This is the generator SplitMix64, seeded with the key. Source: Steele, Lea and Flood, *Fast splittable
/// pseudorandom number generators*, 2014.
#[inline(always)]
pub(crate) fn word_at(key: u64, place: u64) -> u64 {
    let mut word = key.wrapping_add(place.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

/// Draws a number from 0 up to but not including 1, a multiple of 2^-53, from a random word.
#[inline(always)]
pub(crate) fn unit(word: u64) -> f64 {
    (word >> 11) as f64 * f64::EPSILON / 2.0
}
