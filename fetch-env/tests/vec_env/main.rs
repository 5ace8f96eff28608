//! Environments stepped together give what each gives alone, on any number of threads, and fail
//! alone as well.

mod asynchronous;
mod common;
mod failures;
mod order;
mod synchronous;
