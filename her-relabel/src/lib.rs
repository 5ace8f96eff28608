//! Hindsight Experience Replay.
#![forbid(unsafe_code)]
