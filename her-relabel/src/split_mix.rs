//! Random words as a function of a key and a place.

/// Returns the word at `place` of the sequence of `key`, so that words are available in any order
/// and on any thread.
///
/// This is the generator SplitMix64, seeded with the key. Source: Steele, Lea and Flood, *Fast
/// splittable pseudorandom number generators*, 2014.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers of the authors' program for two seeds.
    #[test]
    fn the_words_are_those_of_split_mix_64() {
        let words = [1, 2, 3].map(|place| word_at(0, place));
        assert_eq!(words, [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f]);
        assert_eq!(word_at(1_234_567, 1), 0x599e_d017_fb08_fc85);
    }

    #[test]
    fn a_unit_is_below_one() {
        assert_eq!([0, 1 << 63, u64::MAX].map(unit), [0.0, 0.5, 1.0 - f64::EPSILON / 2.0]);
    }
}
