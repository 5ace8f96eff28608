//! Small multilayer perceptrons in `f32`: passes through them, their gradients, and an optimizer.

pub(crate) mod adam;
mod matrix;
mod packing;
pub(crate) mod pass;
pub(crate) mod perceptron;
mod product;
pub(crate) mod vectors;
