//! The Fetch environments.
#![forbid(unsafe_code)]
