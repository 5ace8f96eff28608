//! Estimates with confidence intervals.

mod error;
mod estimate;

pub use error::StatisticsError;
pub use estimate::Estimate;
