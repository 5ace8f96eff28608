use fetch_env::FetchObservation;

use crate::{Action, Policy};

/// Does nothing: every action is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct ZeroPolicy;

impl Policy for ZeroPolicy {
    fn act(&mut self, _observation: &FetchObservation) -> Action {
        [0.0; 4]
    }
}
