//! The Fetch robot on MuJoCo.
