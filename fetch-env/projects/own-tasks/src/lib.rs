//! Each of the examples is a program of one file: `cargo run --example stack` runs one.
