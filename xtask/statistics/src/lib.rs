//! Tests of whether two samples come from the same distribution.
//!
//! Parity and the chapter's commands compare this project with the reference by these tests. The
//! estimates with intervals that the libraries return are `baselines::Estimate`.
#![forbid(unsafe_code)]

mod chi_square;
mod error;
mod fisher;
mod kolmogorov_smirnov;
mod normal;
mod wilcoxon;

pub use chi_square::chi_square;
pub use error::TestError;
pub use fisher::fisher_exact;
pub use kolmogorov_smirnov::kolmogorov_smirnov;
pub use normal::normal_test;
pub use wilcoxon::wilcoxon;
