//! Environments stepped together give the results that each gives alone, on any number of threads,
//! and fail alone, too.

mod asynchronous;
mod common;
mod completion;
mod failures;
#[cfg(feature = "her-relabel")]
mod forgotten;
mod order;
mod plain;
#[cfg(feature = "her-relabel")]
mod recording;
mod rows;
mod state;
mod synchronous;
mod threads;
