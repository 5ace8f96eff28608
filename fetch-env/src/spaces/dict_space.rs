use rand_core::Rng;
use serde::{Deserialize, Serialize};

use super::{Space, SpaceError, Value};

/// Named spaces in a fixed order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Entries", into = "Entries")]
pub struct DictSpace {
    spaces: Vec<(String, Space)>,
}

impl DictSpace {
    /// Spaces by name, in this order.
    ///
    /// # Errors
    /// [`SpaceError::DuplicateKey`] if two have the same name.
    pub fn new(
        spaces: impl IntoIterator<Item = (impl Into<String>, Space)>,
    ) -> Result<Self, SpaceError> {
        let mut dict = Self { spaces: Vec::new() };
        for (key, space) in spaces {
            let key = key.into();
            if dict.get(&key).is_some() {
                return Err(SpaceError::DuplicateKey { key });
            }
            dict.spaces.push((key, space));
        }
        Ok(dict)
    }

    /// The space of this name.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&Space> {
        self.iter().find_map(|(name, space)| (name == key).then_some(space))
    }

    /// Names and spaces in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&str, &Space)> {
        self.spaces.iter().map(|(key, space)| (key.as_str(), space))
    }

    /// Whether there is exactly one value for each space, in any order, and each lies in its space.
    #[must_use]
    pub fn contains(&self, values: &[(String, Value)]) -> bool {
        values.len() == self.spaces.len()
            && self.iter().all(|(key, space)| {
                values.iter().any(|(name, value)| name == key && space.contains(value))
            })
    }

    /// Draws a member of each space, in order.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<(String, Value)> {
        self.spaces.iter().map(|(key, space)| (key.clone(), space.sample(rng))).collect()
    }
}

#[derive(Serialize, Deserialize)]
#[serde(rename = "DictSpace", deny_unknown_fields)]
struct Entries {
    spaces: Vec<(String, Space)>,
}

impl From<DictSpace> for Entries {
    fn from(DictSpace { spaces }: DictSpace) -> Self {
        Self { spaces }
    }
}

impl TryFrom<Entries> for DictSpace {
    type Error = SpaceError;

    fn try_from(Entries { spaces }: Entries) -> Result<Self, SpaceError> {
        Self::new(spaces)
    }
}
