//! A safe binding of the parts of MuJoCo that this crate needs, for any model.

pub(crate) mod contact_filter;
pub(crate) mod data;
mod decoders;
pub(crate) mod ffi;
pub(crate) mod ids;
pub(crate) mod library;
mod library_file;
pub(crate) mod model;
pub(crate) mod poses;
mod search;
mod system;
mod unforked;
pub(crate) mod varied_model;
pub(crate) mod version;
