//! Exchanging episodes with numpy, on top of adding and saving.

pub(crate) mod array;
pub(crate) mod export;
pub(crate) mod import;
mod quiet;
