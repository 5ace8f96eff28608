//! Learning: the laws that every run keeps.

#[cfg(feature = "render")]
mod asymmetric;
mod bad_input;
mod damaged_checkpoints;
mod diagnostics;
mod distilling;
mod evaluating;
mod folders;
mod noise;
mod offline;
mod pictures;
#[cfg(feature = "runs")]
mod plans;
mod ppo;
mod presets;
mod ranks;
mod resuming;
mod rewards;
mod runs;
mod same_bits;
#[cfg(feature = "render")]
mod seeing;
mod settings;
mod starting;
mod temperature;
mod unreadable_states;
mod watched;
