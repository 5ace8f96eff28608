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

/// Implements the resets and steps of a `Wrapper` that changes only observations, by its method
/// `observe(observation, is_first)`.
macro_rules! observe {
    () => {
        fn reset(
            &mut self,
            env: &mut crate::gym::wrappers::wrapper::Resetting<'_, E>,
            seed: Option<u64>,
            options: &E::ResetOptions,
        ) -> Result<crate::gym::env::Reset<Self::Observation, E::Info>, crate::gym::error::EnvError>
        {
            let reset = env.reset_with(seed, options)?;
            reset.try_map_observation(|observation| self.observe(observation, true))
        }

        fn step(
            &mut self,
            env: &mut E,
            action: &[crate::gym::env::ActionElement<E>],
        ) -> Result<crate::gym::env::Step<Self::Observation, E::Info>, crate::gym::error::EnvError>
        {
            let step = env.step(action)?;
            step.try_map_observation(|observation| self.observe(observation, false))
        }
    };
}
pub(super) use observe;

/// Implements `Wrapper` for `$wrapper<T>`, which changes only the observed vector and keeps its
/// precision `T`, by its method `observe`, its field `vectors` and their space.
macro_rules! vector_wrapper {
    ($wrapper:ident, |$this:ident, $vector:ident| $space:expr) => {
        impl<E, O, T> crate::gym::wrappers::wrapper::Wrapper<E> for $wrapper<T>
        where
            E: crate::gym::env::Env<Observation = O>,
            O: crate::gym::wrappers::vector::VectorObservation<Element = T>,
            T: crate::gym::spaces::box_space::Element,
        {
            type Observation = O::Replaced<T>;
            crate::gym::wrappers::macros::keep!(Info, ActionSpace);
            crate::gym::wrappers::macros::observe!();

            fn attach(&mut self, env: &E) -> Result<(), crate::gym::error::EnvError> {
                let mut vectors = crate::gym::wrappers::vectors::Vectors::new();
                let $this = &mut *self;
                vectors.attach(env, |$vector| $space)?;
                self.vectors = vectors;
                Ok(())
            }

            fn observation_space<'a>(&'a self, env: &'a E) -> &'a crate::gym::spaces::Space {
                self.vectors.observation_space(env)
            }
        }

        impl<T> crate::gym::wrappers::wrapper::KeepsGoals for $wrapper<T> {}
    };
}
pub(super) use vector_wrapper;
