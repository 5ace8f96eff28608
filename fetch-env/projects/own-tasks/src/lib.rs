//! Each of the examples is a single-file program: `cargo run --example stack` runs one.
