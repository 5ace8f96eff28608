//! The store: the buffer, its configuration, and everything it holds.

pub(crate) mod block;
pub(crate) mod buffer;
pub(crate) mod config;
pub(crate) mod episodes;
pub(crate) mod fields;
pub(crate) mod layout;
pub(crate) mod motionless;
pub(crate) mod priorities;
pub(crate) mod priority_table;
pub(crate) mod queue;
pub(crate) mod storage;
pub(crate) mod sum_tree;
pub(crate) mod tape;
pub(crate) mod transition_id;
