//! What several commands share.

pub mod check;
pub mod choice;
pub mod json;
pub mod process;
pub mod progress;
pub mod python;
pub mod ranks;
pub mod rewards;
