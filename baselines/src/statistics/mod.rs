//! Estimates with confidence intervals, and tests of whether two samples come from the same
//! distribution.

mod chi_square;
mod error;
mod estimate;
mod fisher;
mod kolmogorov_smirnov;
mod normal;
mod wilcoxon;

pub use chi_square::chi_square;
pub use error::StatisticsError;
pub use estimate::Estimate;
pub use fisher::fisher_exact;
pub use kolmogorov_smirnov::kolmogorov_smirnov;
pub use normal::normal_test;
pub use wilcoxon::wilcoxon;
