//! The file format of trained policies.

use std::collections::HashMap;
use std::io::{ErrorKind, Write};
use std::path::Path;

use her_relabel::files;
use safetensors::{Dtype, SafeTensorError, SafeTensors, tensor::TensorView};
use serde::{Serialize, de::DeserializeOwned};

use super::{LayerWeights, PolicyHeader, TrainedPolicy, TrainedPolicyError as Error};

/// The largest file that is read: some hundred times a policy's size.
const LIMIT: u64 = 64 << 20;

/// What a file is of. Its metadata has one key alone, because safetensors writes several in any order.
pub(super) struct Kind {
    key: &'static str,
    sees: &'static str,
    load: &'static str,
}

/// A policy that sees the state.
const STATE: Kind = Kind { key: "policy", sees: "no pictures", load: "TrainedPolicy" };

/// A policy that sees pictures.
pub(super) const PIXELS: Kind = Kind { key: "pixel_policy", sees: "pictures", load: "PixelPolicy" };

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    files::read(path, LIMIT).map_err(|source| match source.kind() {
        ErrorKind::FileTooLarge => Error::TooLarge { path: path.to_owned(), limit: LIMIT },
        _ => Error::Io { path: path.to_owned(), source },
    })
}

/// Returns what the metadata of a file of this kind says, and the tensors.
pub(super) fn open<'a, T: DeserializeOwned>(
    bytes: &'a [u8],
    kind: &Kind,
) -> Result<(T, SafeTensors<'a>), Error> {
    let format = |error: SafeTensorError| Error::Format { reason: error.to_string() };
    let header = |reason: String| Error::Header { reason };
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(format)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(format)?;
    let entry = |key| metadata.metadata().as_ref().and_then(|entries| entries.get(key));
    let Some(text) = entry(kind.key) else {
        let other = [STATE, PIXELS].into_iter().find(|other| entry(other.key).is_some());
        return Err(other.map_or_else(
            || header("it is missing".to_owned()),
            |Kind { sees, load, .. }| Error::Kind { sees, load },
        ));
    };
    let said = serde_json::from_str(text).map_err(|error| header(error.to_string()))?;
    Ok((said, tensors))
}

pub(super) fn decode(bytes: &[u8]) -> Result<TrainedPolicy, Error> {
    let (header, tensors): (PolicyHeader, _) = open(bytes, &STATE)?;
    let num_layers = tensors.len() / 2;
    let layers = (0..num_layers).map(|number| {
        let (weight, bias) = (name(number, "weight"), name(number, "bias"));
        let ([num_inputs, num_outputs], weights) = tensor(&tensors, &weight)?;
        let ([len], biases) = tensor(&tensors, &bias)?;
        if len != num_outputs {
            let (actual, expected) = (format!("of {len} numbers"), num_outputs.to_string());
            return Err(Error::Tensor { tensor: bias, actual, expected });
        }
        Ok(LayerWeights { num_inputs, weights, biases })
    });
    let layers = layers.collect::<Result<Vec<_>, _>>()?;
    if tensors.len() != 2 * num_layers {
        return Err(surplus());
    }
    TrainedPolicy::new(header, &layers)
}

/// Returns the contents of a file, which can be loaded.
pub(super) fn encode(policy: &TrainedPolicy) -> Result<Vec<u8>, Error> {
    let mut tensors = Vec::new();
    for (number, layer) in policy.layers.iter().enumerate() {
        let LayerWeights { num_inputs, weights, biases } = layer;
        let shape = vec![*num_inputs, biases.len()];
        tensors.push((name(number, "weight"), shape, weights.as_slice()));
        tensors.push((name(number, "bias"), vec![biases.len()], biases));
    }
    policy.header.check()?;
    let bytes = close(&policy.header, &STATE, tensors)?;
    // JSON can be written that is not read, such as settings that are nested deeply.
    decode(&bytes)?;
    Ok(bytes)
}

/// Returns a file of this kind, whose metadata says `said`.
pub(super) fn close(
    said: &impl Serialize,
    kind: &Kind,
    tensors: Vec<(String, Vec<usize>, &[f32])>,
) -> Result<Vec<u8>, Error> {
    let failed = |reason: String| Error::Format { reason };
    let said = serde_json::to_string(said).map_err(|error| failed(error.to_string()))?;
    let entry = HashMap::from([(kind.key.to_owned(), said)]);
    let bytes = to_bytes(tensors, Some(entry)).map_err(|error| failed(error.to_string()))?;
    if bytes.len() as u64 > LIMIT {
        return Err(Error::Size { actual: bytes.len() as u64, limit: LIMIT });
    }
    Ok(bytes)
}

/// Writes a policy's file, which appears whole or not at all.
pub(super) fn save(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    files::replace(path, |file| file.write_all(bytes))
        .map_err(|source| Error::Write { path: path.to_owned(), source })
}

/// Reads a policy's file and decodes it.
pub(super) fn load<P>(
    path: &Path,
    decode: impl FnOnce(&[u8]) -> Result<P, Error>,
) -> Result<P, Error> {
    decode(&read(path)?)
        .map_err(|error| Error::Contents { path: path.to_owned(), source: Box::new(error) })
}

/// The error of a file with tensors that no layer has.
pub(super) fn surplus() -> Error {
    Error::Format { reason: "it has tensors that belong to no layer".to_owned() }
}

/// Returns a safetensors file of tensors, each with its name and its shape.
pub(crate) fn to_bytes(
    tensors: Vec<(String, Vec<usize>, &[f32])>,
    metadata: Option<HashMap<String, String>>,
) -> Result<Vec<u8>, SafeTensorError> {
    let bytes = |numbers: &[f32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let tensors: Vec<(_, _, Vec<u8>)> =
        tensors.into_iter().map(|(name, shape, numbers)| (name, shape, bytes(numbers))).collect();
    let views = tensors.iter().map(|(name, shape, bytes)| {
        TensorView::new(Dtype::F32, shape.clone(), bytes).map(|view| (name, view))
    });
    safetensors::serialize(views.collect::<Result<Vec<_>, _>>()?, metadata)
}

/// Returns the numbers that the bytes of a tensor encode.
pub(crate) fn from_bytes(bytes: &[u8]) -> impl Iterator<Item = f32> + '_ {
    let (chunks, _) = bytes.as_chunks::<4>();
    chunks.iter().map(|chunk| f32::from_le_bytes(*chunk))
}

/// Returns the name of a tensor.
pub(super) fn name(layer: usize, part: &str) -> String {
    format!("layers.{layer}.{part}")
}

/// Returns the shape and the numbers of a tensor with `N` dimensions.
fn tensor<const N: usize>(
    tensors: &SafeTensors<'_>,
    name: &str,
) -> Result<([usize; N], Vec<f32>), Error> {
    let (shape, numbers) = numbers(tensors, name)?;
    let shape = shape.try_into().map_err(|shape| Error::Tensor {
        tensor: name.to_owned(),
        actual: format!("of the shape {shape:?}"),
        expected: format!("{N} dimensions"),
    })?;
    Ok((shape, numbers))
}

/// Returns the shape and the numbers of a tensor.
pub(super) fn numbers(
    tensors: &SafeTensors<'_>,
    name: &str,
) -> Result<(Vec<usize>, Vec<f32>), Error> {
    let wrong = |actual: String| Error::Tensor {
        tensor: name.to_owned(),
        actual,
        expected: "of the type F32".to_owned(),
    };
    let view = tensors.tensor(name).map_err(|_| wrong("missing".to_owned()))?;
    match view.dtype() {
        Dtype::F32 => Ok((view.shape().to_vec(), from_bytes(view.data()).collect())),
        dtype => Err(wrong(format!("of the type {dtype:?}"))),
    }
}
