//! Estimates with confidence intervals, and tests of two samples.

mod chi_square;
mod error;
mod estimate;
mod fisher;
mod kolmogorov_smirnov;
mod wilcoxon;

pub use chi_square::chi_square;
pub use error::StatisticsError;
pub use estimate::Estimate;
pub use fisher::fisher_exact;
pub use kolmogorov_smirnov::kolmogorov_smirnov;
pub use wilcoxon::wilcoxon;
