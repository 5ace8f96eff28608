//! Baselines for the Fetch tasks.
#![forbid(unsafe_code)]
