//! numpy's random numbers, from the generator that Gymnasium gives an environment.

use std::convert::Infallible;

use rand::rngs::SysRng;
use rand_core::{Rng, TryRng, utils::fill_bytes_via_next_word};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::gym::error::EnvError;

/// numpy's `Generator(PCG64(SeedSequence(seed)))`, with the distributions that environments draw
/// from.
///
/// The same seed gives the same numbers as in Python, bit for bit. The seed and the number of draws
/// determine the state and are its serialized form.
///
/// # Example
/// ```
/// # use fetch_env::NpRandom;
/// // numpy: np.random.Generator(np.random.PCG64(0)).random()
/// assert_eq!(NpRandom::new(0).random(), 0.6369616873214543);
/// ```
/// [Spaces](crate::spaces) can sample with it, so that no other generator is needed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Position")]
pub struct NpRandom {
    seed: u64,
    draws: u64,
    #[serde(skip_serializing)]
    pcg: Pcg64,
}

impl NpRandom {
    /// Creates the generator that numpy makes from `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let [s0, s1, i0, i1] = seed_sequence(seed);
        // numpy reads the four words as two big-endian pairs: the state and the stream.
        Self { seed, draws: 0, pcg: Pcg64::new(join(s0, s1), join(i0, i1)) }
    }

    /// Creates a generator with a seed from the operating system, which is its
    /// [`initial_seed`](Self::initial_seed).
    ///
    /// # Errors
    /// [`EnvError::Entropy`] if the operating system provides none.
    pub fn from_entropy() -> Result<Self, EnvError> {
        let seed = SysRng
            .try_next_u64()
            .map_err(|error| EnvError::Entropy { reason: error.to_string() })?;
        Ok(Self::new(seed))
    }

    /// Returns the seed with which the generator was made: always the same number, however many
    /// numbers were drawn. To draw a seed, pass on the generator itself, or its next `u64`.
    #[must_use]
    pub const fn initial_seed(&self) -> u64 {
        self.seed
    }

    /// Returns the number of 64-bit draws since the seed: numpy's generator is in the same state
    /// after `np.random.PCG64(seed).advance(draws)`.
    ///
    /// ```
    /// # use fetch_env::NpRandom;
    /// let mut random = NpRandom::new(7);
    /// random.uniform(-0.15, 0.15);
    /// assert_eq!(random.draws(), 1);
    /// ```
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    /// Returns one of the generators that follow from a seed, each independent of the others.
    pub(crate) fn numbered(seed: u64, number: u64) -> Self {
        // Different seeds for different numbers, of which the seed sequence makes different states.
        const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
        Self::new(seed.wrapping_add(number.wrapping_mul(ODD)))
    }

    /// Returns a generator that follows from this one, which stays as it is, and a number. It is
    /// independent of this one and of those for other numbers.
    pub(crate) fn beside(&self, number: u64) -> Self {
        Self::numbered(self.clone().next_u64(), number)
    }

    /// Draws numpy's `random()`: uniform over the multiples of 2^-53 in [0, 1).
    pub fn random(&mut self) -> f64 {
        unit_interval(self.next_u64())
    }

    /// Draws a number of the standard normal distribution, with the same bits on each processor. These
    /// are not the numbers of numpy's `standard_normal`, which come from tables.
    ///
    /// Source: Box and Muller, *A note on the generation of random normal deviates*, 1958.
    pub fn standard_normal(&mut self) -> f64 {
        // Never 0, whose logarithm is infinite.
        let share = 1.0 - self.random();
        let turn = self.random();
        (-2.0 * libm::log(share)).sqrt() * libm::cos(std::f64::consts::TAU * turn)
    }

    /// Draws numpy's `uniform(low, high)`: `low + (high - low) * random()`, rounded after each
    /// operation.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random()
    }
}

/// Every word is one draw of 64 bits, of which `next_u32` returns the lower half.
impl TryRng for NpRandom {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next_u64() as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.draws += 1;
        Ok(self.pcg.next_u64())
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        fill_bytes_via_next_word(bytes, || self.try_next_u64())
    }
}

/// The largest count of draws or episodes that a program can have reached. At a billion a second it
/// takes 292 years, and as many are left before the counter overflows.
pub(crate) const MAX_COUNT: u64 = u64::MAX / 2;

/// The serialized form.
#[derive(Deserialize)]
#[serde(rename = "NpRandom", deny_unknown_fields)]
struct Position {
    seed: u64,
    draws: u64,
}

impl TryFrom<Position> for NpRandom {
    type Error = String;

    fn try_from(Position { seed, draws }: Position) -> Result<Self, String> {
        if draws > MAX_COUNT {
            return Err(format!("{draws} random numbers cannot have been drawn"));
        }
        let mut random = Self::new(seed);
        random.pcg.advance(draws.into());
        random.draws = draws;
        Ok(random)
    }
}

/// Turns the upper 53 bits into a number in [0, 1).
fn unit_interval(bits: u64) -> f64 {
    const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;
    (bits >> 11) as f64 * UNIT
}

const fn join(high: u64, low: u64) -> u128 {
    (high as u128) << 64 | low as u128
}

/// Generates four 64-bit words by numpy's `SeedSequence` of one integer, which follows M. O'Neill's
/// `seed_seq_fe`.
///
/// Source:
/// <https://numpy.org/doc/stable/reference/random/bit_generators/generated/numpy.random.SeedSequence.html>
/// and <https://www.pcg-random.org/posts/developing-a-seed_seq-alternative.html>.
fn seed_sequence(seed: u64) -> [u64; 4] {
    const MIX_L: u32 = 0xca01_f9dd;
    const MIX_R: u32 = 0x4973_f715;
    let mut hash = hasher(0x43b0_d7e5, 0x931e_8875);
    // A missing high word hashes as zero, so every seed counts as two words.
    let mut pool = [seed as u32, (seed >> 32) as u32, 0, 0].map(&mut hash);
    for source in 0..pool.len() {
        for target in 0..pool.len() {
            if source != target {
                let hashed = hash(pool[source]).wrapping_mul(MIX_R);
                let mixed = pool[target].wrapping_mul(MIX_L).wrapping_sub(hashed);
                pool[target] = mixed ^ (mixed >> 16);
            }
        }
    }
    let mut hash = hasher(0x8b51_f9dd, 0x58f3_8ded);
    let words: [u32; 8] = std::array::from_fn(|i| hash(pool[i % pool.len()]));
    // The lower half of each word comes first.
    std::array::from_fn(|i| u64::from(words[2 * i]) | u64::from(words[2 * i + 1]) << 32)
}

/// Returns a hash of 32-bit words whose constant changes with every word.
fn hasher(mut constant: u32, multiplier: u32) -> impl FnMut(u32) -> u32 {
    move |word| {
        let word = word ^ constant;
        constant = constant.wrapping_mul(multiplier);
        let word = word.wrapping_mul(constant);
        word ^ (word >> 16)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn standard_normal_numbers_are_normal() {
        const COUNT: usize = 100_000;
        let mut random = NpRandom::new(0);
        let numbers: Vec<f64> = (0..COUNT).map(|_| random.standard_normal()).collect();
        for (bound, share) in [(0.0, 0.5), (1.0, 0.841_345), (-1.0, 0.158_655), (2.0, 0.977_250)] {
            let below = numbers.iter().filter(|&&number| number < bound).count() as f64;
            // Four standard errors.
            let error = 4.0 * (share * (1.0 - share) / COUNT as f64).sqrt();
            assert!((below / COUNT as f64 - share).abs() < error, "{below} below {bound}");
        }
    }

    #[derive(Deserialize)]
    struct Golden {
        seeds: BTreeMap<u64, Recorded>,
    }

    #[derive(Deserialize)]
    struct Recorded {
        state: String,
        inc: String,
        raw_u64: Vec<String>,
        random: Vec<String>,
        uniform_pm_0p15_3: Vec<String>,
    }

    /// rand_pcg's serialized generator.
    #[derive(Deserialize)]
    struct PcgState {
        state: u128,
        increment: u128,
    }

    /// Reads C99's hexadecimal notation, such as `-0x1.8p-3`.
    fn hex_float(text: &str) -> f64 {
        let (sign, text) = text.strip_prefix('-').map_or((1.0, text), |rest| (-1.0, rest));
        let (mantissa, exponent) =
            text.strip_prefix("0x1.").and_then(|rest| rest.split_once('p')).expect("0x1.…p…");
        let fraction = u64::from_str_radix(mantissa, 16).expect("hexadecimal digits");
        let fraction = fraction as f64 / 16_f64.powi(mantissa.len().try_into().expect("short"));
        sign * (1.0 + fraction) * 2_f64.powi(exponent.parse().expect("an exponent"))
    }

    #[test]
    fn every_recorded_number_of_numpy_is_reproduced() {
        let golden = include_str!("../../tests/fixtures/numpy_pcg64.json");
        let golden: Golden = serde_json::from_str(golden).expect("the fixture's format");
        assert!(!golden.seeds.is_empty());
        for (seed, recorded) in golden.seeds {
            let mut random = NpRandom::new(seed);
            let pcg = serde_json::to_string(&random.pcg).expect("serializable");
            let pcg: PcgState = serde_json::from_str(&pcg).expect("rand_pcg's format");
            assert_eq!(pcg.state.to_string(), recorded.state, "state of seed {seed}");
            assert_eq!(pcg.increment.to_string(), recorded.inc, "increment of seed {seed}");

            let mut raw = random.pcg.clone();
            for word in &recorded.raw_u64 {
                assert_eq!(raw.next_u64().to_string(), *word, "raw draw of seed {seed}");
            }
            for number in &recorded.random {
                assert_eq!(random.random(), hex_float(number), "random() of seed {seed}");
            }
            for number in &recorded.uniform_pm_0p15_3 {
                assert_eq!(random.uniform(-0.15, 0.15), hex_float(number), "uniform of {seed}");
            }
        }
    }

    proptest! {
        #[test]
        fn a_deserialized_generator_goes_on_with_the_stream(seed: u64, draws in 0..1000_u32) {
            let mut random = NpRandom::new(seed);
            for _ in 0..draws {
                random.random();
            }
            let json = serde_json::to_string(&random).expect("serializable");
            let mut copy: NpRandom = serde_json::from_str(&json).expect("deserializable");
            prop_assert_eq!(&copy, &random);
            prop_assert_eq!(&copy.pcg, &random.pcg);
            prop_assert_eq!(copy.random().to_bits(), random.random().to_bits());
        }

        #[test]
        fn draws_stay_in_their_interval(seed: u64, low in -1e3..1e3, width in 0.0..1e3) {
            let mut random = NpRandom::new(seed);
            prop_assert!((0.0..1.0).contains(&random.random()));
            prop_assert!((low..=low + width).contains(&random.uniform(low, low + width)));
        }
    }

    #[test]
    fn more_draws_than_a_program_makes_are_not_deserialized() {
        let at = |draws| format!(r#"{{"seed":7,"draws":{draws}}}"#);
        let mut late: NpRandom = serde_json::from_str(&at(u64::MAX / 2)).expect("the last of them");
        late.random();
        assert_eq!(late.draws, 1 << 63);
        for draws in [1 << 63, u64::MAX] {
            let refusal = serde_json::from_str::<NpRandom>(&at(draws));
            assert!(refusal.is_err(), "{draws}");
        }
    }

    #[test]
    fn the_initial_seed_stays() {
        let mut random = NpRandom::new(7);
        random.random();
        assert_eq!(random.initial_seed(), 7);
    }

    #[test]
    fn the_operating_system_gives_different_seeds() {
        let seeds = [0; 2].map(|_| NpRandom::from_entropy().expect("entropy").initial_seed());
        assert_ne!(seeds[0], seeds[1]);
    }
}
