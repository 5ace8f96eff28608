//! Files of users: reading regular files of a bounded size, and replacing files whole or not at all.
//!
//! A path that a user passes can name a pipe, which waits for ever, a device without an end, or a
//! link to one. What this crate reads and writes goes through these functions, and so can yours.

mod marked;
mod read;
mod replace;

pub use marked::{remove_unfinished, replace_marked};
pub use read::{open, read, read_text};
pub use replace::{replace, replace_entry};
