//! Exchanging episodes with numpy, on top of adding and saving.

pub(crate) mod array;
pub(crate) mod arrays;
pub(crate) mod error;
pub(crate) mod export;
pub(crate) mod import;
