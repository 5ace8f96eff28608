//! LeRobot's format, version 3.0: files of Parquet that hold many episodes each, and files of JSON
//! and Parquet that say what is in them.

mod frames;
mod shards;
mod statistics;
pub(super) mod writer;
