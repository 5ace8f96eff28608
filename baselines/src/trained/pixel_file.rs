//! The file format of policies that see pictures.

use serde::{Deserialize, Serialize};

use super::PolicyHeader;
use super::error::TrainedPolicyError as Error;
use super::file::{self, PIXELS};
use super::sight::Sight;
use crate::network::{Convolution, PictureNetwork, PictureShape};

/// What a file says of a policy, besides its tensors.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    policy: PolicyHeader,
    sight: Sight,
    convolutions: Vec<Convolution>,
    hidden: Vec<usize>,
}

/// Returns the name and the shape of each tensor, in the order of a network's numbers: those of its
/// parameters, the mean picture and the scale.
fn tensors(shape: &PictureShape) -> Vec<(String, Vec<usize>)> {
    let (mut tensors, mut inputs) = (Vec::new(), 3);
    let last = shape.convolutions().len() - 1;
    for (number, Convolution { channels, kernel, .. }) in shape.convolutions().enumerate() {
        let name = |part| format!("convolutions.{number}.{part}");
        tensors.push((name("weight"), vec![kernel, kernel, inputs, channels]));
        if number < last {
            tensors.push((name("bias"), vec![channels]));
        }
        inputs = channels;
    }
    for (number, sizes) in shape.perceptron().windows(2).enumerate() {
        tensors.push((file::name(number, "weight"), sizes.to_vec()));
        tensors.push((file::name(number, "bias"), sizes[1..].to_vec()));
    }
    let [height, width] = shape.picture_size();
    tensors.push(("mean".to_owned(), vec![height, width, 3]));
    tensors.push(("scale".to_owned(), vec![1]));
    tensors
}

/// Returns the tensors of a network: name, shape and numbers.
fn tensors_of(network: &PictureNetwork) -> Vec<(String, Vec<usize>, &[f32])> {
    let [mut numbers, pixels] = network.vectors();
    let tensors = tensors(network.shape()).into_iter().map(|(name, shape)| {
        // The mean picture follows the last parameter.
        if numbers.is_empty() {
            numbers = pixels;
        }
        let (own, rest) = numbers.split_at(shape.iter().product());
        numbers = rest;
        (name, shape, own)
    });
    tensors.collect()
}

/// Checks that each number of a network is finite.
pub(super) fn check_finite(network: &PictureNetwork) -> Result<(), Error> {
    for (tensor, _, numbers) in tensors_of(network) {
        if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
            return Err(Error::NotFinite { tensor, index, value: numbers[index] });
        }
    }
    Ok(())
}

/// Returns the parts of the policy in a file.
pub(super) fn decode(bytes: &[u8]) -> Result<(PolicyHeader, Sight, PictureNetwork), Error> {
    let wrong = |reason: String| Error::Sight { reason };
    let (said, stored) = file::open(bytes, &PIXELS)?;
    let Saved { policy: header, sight, convolutions, hidden } = said;
    let numbers = sight.columns(&header)?.len();
    let size = sight.picture_size()?;
    let shape = PictureShape::new(size, &convolutions, numbers, &hidden, header.action_len)
        .map_err(|error| wrong(error.to_string()))?;
    let tensors = tensors(&shape);
    if stored.len() > tensors.len() {
        return Err(file::surplus());
    }
    let mut all = Vec::new();
    for (name, shape) in tensors {
        let (actual, numbers) = file::numbers(&stored, &name)?;
        if actual != shape {
            let (actual, expected) = (format!("of the shape {actual:?}"), format!("{shape:?}"));
            return Err(Error::Tensor { tensor: name, actual, expected });
        }
        all.extend(numbers);
    }
    let pixels = all.split_off(shape.num_parameters());
    Ok((header, sight, PictureNetwork::from_vectors(shape, all, pixels)))
}

/// Returns the contents of a file, which can be loaded.
pub(super) fn encode(
    header: &PolicyHeader,
    sight: &Sight,
    network: &PictureNetwork,
) -> Result<Vec<u8>, Error> {
    let shape = network.shape();
    let sizes = shape.perceptron();
    header.check()?;
    let saved = Saved {
        policy: header.clone(),
        sight: sight.clone(),
        convolutions: shape.convolutions().collect(),
        hidden: sizes[1..sizes.len() - 1].to_vec(),
    };
    let bytes = file::close(&saved, &PIXELS, tensors_of(network))?;
    decode(&bytes)?;
    Ok(bytes)
}
