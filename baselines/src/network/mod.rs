//! Small networks in `f32`, multilayer perceptrons and convolutions: passes through them, their
//! gradients, and an optimizer.
//!
//! They know nothing of reinforcement learning: [`Ddpg`](crate::learn::Ddpg) and
//! [`Sac`](crate::learn::Sac) are built from them, and so can your own
//! [`Algorithm`](crate::learn::Algorithm) be. Results have the same bits on each processor, whatever
//! the width of its vectors.
//!
//! Matrices are row-major slices, with a row for each input of a batch.

pub(crate) mod adam;
mod matrix;
mod packing;
pub(crate) mod pass;
pub(crate) mod perceptron;
mod picture_network;
mod picture_pass;
mod picture_shape;
mod product;
mod spatial_softmax;
pub(crate) mod vectors;
mod windows;

pub use adam::{Adam, Trained};
pub use pass::Pass;
pub use perceptron::{Network, Shape};
pub use picture_network::PictureNetwork;
pub use picture_pass::PicturePass;
#[cfg(feature = "render")]
pub(crate) use picture_shape::LARGEST;
pub use picture_shape::{Convolution, PictureShape, PictureShapeError};
