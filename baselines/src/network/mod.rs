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
mod picture;
mod picture_pass;
mod product;
mod spatial_softmax;
pub(crate) mod vectors;
mod windows;

pub use adam::{Adam, Trained};
pub use pass::Pass;
pub use perceptron::{Network, Shape};
#[cfg(feature = "render")]
pub(crate) use picture::LARGEST;
pub use picture::{Convolution, PictureNetwork, PictureShape, PictureShapeError};
pub use picture_pass::PicturePass;
