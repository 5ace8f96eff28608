//! Critics: networks that value actions.

use super::algorithm::Transitions;
use super::network::Network;
use super::pass::Pass;

/// Returns the values of actions, as a critic estimates them: a number for each row.
pub(crate) fn evaluate<'a>(
    pass: &'a mut Pass,
    critic: &Network,
    inputs: &[f32],
    actions: &[f32],
) -> &'a [f32] {
    let width = critic.shape.num_inputs();
    let num_rows = (inputs.len() + actions.len()) / width;
    let len = inputs.len() / num_rows;
    let joined = pass.input_mut(num_rows, width).chunks_exact_mut(width);
    let rows = inputs.chunks_exact(len).zip(actions.chunks_exact(width - len));
    for (joined, (input, action)) in joined.zip(rows) {
        joined[..len].copy_from_slice(input);
        joined[len..].copy_from_slice(action);
    }
    pass.forward(critic)
}

/// Computes the gradient of a critic's mean squared error against `targets`, by way of `slopes`.
/// Returns the error and the mean value.
pub(crate) fn regress(
    pass: &mut Pass,
    critic: &Network,
    batch: Transitions<'_>,
    targets: &[f32],
    slopes: &mut Vec<f32>,
    gradient: &mut [f32],
) -> (f32, f32) {
    let values = evaluate(pass, critic, batch.input, batch.action);
    let value = values.iter().sum::<f32>() * batch.share();
    let errors = values.iter().zip(targets).map(|(value, target)| value - target);
    let loss = errors.clone().map(|error| error * error).sum::<f32>() * batch.share();
    slopes.clear();
    slopes.extend(errors.map(|error| 2.0 * batch.share() * error));
    pass.backward(critic, slopes, Some(gradient), 0);
    (loss, value)
}
