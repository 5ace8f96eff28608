use fetch_env::FetchObservation;

/// An action of the Fetch tasks: x, y and z displacement of the gripper, and the fingers, each in
/// [-1, 1].
pub type Action = [f32; 4];

/// What decides an action from an observation.
pub trait Policy {
    /// Forgets what was remembered of the last episode.
    fn reset(&mut self) {}

    /// The action for an observation, in [-1, 1].
    fn act(&mut self, observation: &FetchObservation) -> Action;
}

impl<P: Policy + ?Sized> Policy for Box<P> {
    fn reset(&mut self) {
        (**self).reset();
    }

    fn act(&mut self, observation: &FetchObservation) -> Action {
        (**self).act(observation)
    }
}
