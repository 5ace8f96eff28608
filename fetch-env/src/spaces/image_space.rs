use rand_core::Rng;
use serde::{Deserialize, Serialize};

/// Images, or stacks of them: arrays of bytes of a fixed shape, each from 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageSpace {
    shape: [usize; 3],
}

impl ImageSpace {
    /// Arrays of `shape`, row-major.
    #[must_use]
    pub const fn new(shape: [usize; 3]) -> Self {
        Self { shape }
    }

    /// The length of each axis.
    #[must_use]
    pub const fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// The number of bytes.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.shape[0] * self.shape[1] * self.shape[2]
    }

    /// Whether its arrays have no element.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether `array`, row-major, has the right length.
    #[must_use]
    pub const fn contains(&self, array: &[u8]) -> bool {
        array.len() == self.len()
    }

    /// Draws a member, each byte independently and uniformly.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<u8> {
        let mut bytes = vec![0; self.len()];
        rng.fill_bytes(&mut bytes);
        bytes
    }
}
