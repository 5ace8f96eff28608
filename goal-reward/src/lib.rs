//! Pure reward, success and termination functions of goal-conditioned tasks.
#![forbid(unsafe_code)]
