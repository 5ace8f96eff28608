//! The parts of wrappers that are the same in many of them.

/// Keeps parts of the environment as they are, in an implementation of `Wrapper` for `E`.
macro_rules! keep {
    ($($part:ident),*) => {$(crate::gym::wrappers::macros::keep!(@$part);)*};
    (@ActionSpace) => {
        type ActionSpace = E::ActionSpace;

        fn action_space<'a>(&'a self, env: &'a E) -> &'a E::ActionSpace {
            env.action_space()
        }
    };
    (@Observation) => {
        type Observation = E::Observation;

        fn observation_space<'a>(&'a self, env: &'a E) -> &'a crate::gym::spaces::Space {
            env.observation_space()
        }

        fn last_observation(&self, inner: E::Observation) -> Option<E::Observation> {
            Some(inner)
        }
    };
    (@Info) => {
        type Info = E::Info;
    };
    (@reset) => {
        fn reset(
            &mut self,
            env: &mut crate::gym::wrappers::wrapper::Resetting<'_, E>,
            seed: Option<u64>,
            options: &E::ResetOptions,
        ) -> Result<crate::gym::env::Reset<E::Observation, E::Info>, crate::gym::error::EnvError> {
            env.reset_with(seed, options)
        }
    };
}
pub(crate) use keep;
