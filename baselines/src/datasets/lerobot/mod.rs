//! LeRobot's format, version 3.0: Parquet files that hold many episodes each, and JSON and Parquet
//! files that describe them.

mod frames;
mod shards;
mod statistics;
pub(super) mod writer;
