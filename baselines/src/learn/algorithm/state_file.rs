//! The vectors that were learned as a file: what is written is what can be read.

use std::collections::BTreeMap;

use safetensors::{Dtype, SafeTensors};

use crate::trained::file::{from_bytes, to_bytes};

/// The name that the file format keeps for itself.
const RESERVED: &str = "__metadata__";

/// What was learned: each vector with its name.
pub(crate) type Vectors<'a> = Vec<(String, &'a mut Vec<f32>)>;

/// The vectors of an algorithm or a student: the length of each, by its name. They are the same as
/// long as it lives, and those of one that is built again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct StateForm(BTreeMap<String, usize>);

/// Why a file does not have such vectors.
pub(crate) enum StateFault {
    /// No run has left it.
    Damaged(String),
    /// It is that of something else.
    Foreign(String),
}

impl StateFault {
    /// Returns what is wrong.
    pub(crate) fn into_reason(self) -> String {
        match self {
            Self::Damaged(reason) | Self::Foreign(reason) => reason,
        }
    }
}

impl StateForm {
    /// Returns the form of vectors, or why a file cannot have them.
    pub(crate) fn of(vectors: &Vectors<'_>) -> Result<Self, String> {
        let mut lens = BTreeMap::new();
        for (name, vector) in vectors {
            if name == RESERVED {
                return Err(format!("a vector has the name {RESERVED}, which files reserve"));
            }
            if lens.insert(name.clone(), vector.len()).is_some() {
                return Err(format!("two vectors have the name {name}"));
            }
        }
        Ok(Self(lens))
    }

    /// Returns vectors of this form as a file, or why it could not be read again.
    pub(crate) fn write(&self, vectors: Vectors<'_>) -> Result<Vec<u8>, String> {
        if *self != Self::of(&vectors)? {
            return Err("its vectors have other names or lengths than at first".to_owned());
        }
        let vectors = vectors.into_iter();
        let tensors = vectors.map(|(name, vector)| (name, vec![vector.len()], vector.as_slice()));
        let file = to_bytes(tensors.collect(), None).map_err(|error| error.to_string())?;
        self.read(&file).map_err(StateFault::into_reason)?;
        Ok(file)
    }

    /// Replaces vectors of this form by those of a file.
    pub(crate) fn restore(&self, vectors: Vectors<'_>, file: &[u8]) -> Result<(), StateFault> {
        let mut read = self.read(file)?;
        for (name, vector) in vectors {
            read.remove(&name).into_iter().for_each(|saved| *vector = saved);
        }
        Ok(())
    }

    /// Returns the vectors of a file.
    fn read(&self, file: &[u8]) -> Result<BTreeMap<String, Vec<f32>>, StateFault> {
        let damaged = |error: safetensors::SafeTensorError| StateFault::Damaged(error.to_string());
        let tensors = SafeTensors::deserialize(file).map_err(damaged)?;
        let foreign = || StateFault::Foreign("a network does not fit".to_owned());
        if tensors.len() != self.0.len() {
            return Err(foreign());
        }
        let vector = |(name, len): (&String, &usize)| {
            let view = tensors.tensor(name).map_err(|_| foreign())?;
            if view.dtype() != Dtype::F32 || view.data().len() != 4 * len {
                return Err(foreign());
            }
            let numbers: Vec<f32> = from_bytes(view.data()).collect();
            check_numbers(name, &numbers).map_err(StateFault::Damaged)?;
            Ok((name.clone(), numbers))
        };
        self.0.iter().map(vector).collect()
    }
}

/// Checks the numbers of a vector of the networks or of their optimizers.
fn check_numbers(name: &str, numbers: &[f32]) -> Result<(), String> {
    // Means of squares.
    let is_square = name.ends_with(".second_moment");
    let is_bad = |number: &f32| !number.is_finite() || (is_square && *number < 0.0);
    match numbers.iter().position(is_bad) {
        Some(index) => Err(format!("the tensor {name} has {} at {index}", numbers[index])),
        None => Ok(()),
    }
}
