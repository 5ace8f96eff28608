//! Renderers that the environments of a process share.

use std::{
    fmt,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
};

use fetch_sim::{RenderError, RenderOptions, Renderer, SimConfig};

use super::render::RenderEnv;
use crate::gym::error::EnvError;
use crate::shared::Shared;

/// The renderers of all living environments that are drawn with one model, in one size and with one
/// number of samples.
///
/// A picture borrows one of them. There are as many as have ever drawn at the same time, at most
/// one for each thread, however many environments there are. Which of them draws a picture changes
/// no byte of it.
pub(super) struct RendererPool {
    config: SimConfig,
    options: RenderOptions,
    idle: Mutex<Vec<Renderer>>,
    /// The number of renderers made so far.
    made: AtomicUsize,
}

/// Locks a list. A panic while it was locked has left it valid.
fn lock<T>(list: &Mutex<T>) -> MutexGuard<'_, T> {
    list.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns what a renderer cannot change between two pictures.
fn format(options: &RenderOptions) -> (u32, u32, u8) {
    (options.width(), options.height(), options.samples())
}

impl RendererPool {
    /// Returns the pool for pictures of `env`, with at least one renderer.
    ///
    /// # Errors
    /// As [`RenderEnv::renderer`].
    pub(super) fn shared<E: RenderEnv>(
        env: &E,
        options: &RenderOptions,
    ) -> Result<Arc<Self>, EnvError> {
        /// The views own the pools, so that the last one frees the renderers.
        static POOLS: Shared<RendererPool> = Shared::new();
        options.check()?;
        Renderer::check_process()?;
        let config = env.sim_config();
        let fits = |pool: &Self| pool.config == *config && format(&pool.options) == format(options);
        POOLS.get_or_make(fits, || {
            let idle = Mutex::new(vec![env.renderer(options.clone())?]);
            let (config, options, made) = (config.clone(), options.clone(), AtomicUsize::new(1));
            Ok(Arc::new(Self { config, options, idle, made }))
        })
    }

    /// Lends an idle renderer to `draw`. If none is idle, `env` makes one.
    pub(super) fn lend<E: RenderEnv, T>(
        &self,
        env: &E,
        draw: impl FnOnce(&mut Renderer) -> Result<T, EnvError>,
    ) -> Result<T, EnvError> {
        Renderer::check_process()?;
        let idle = lock(&self.idle).pop();
        let mut renderer = match idle {
            Some(renderer) => renderer,
            None => {
                let renderer = env.renderer(self.options.clone())?;
                // Room for all, so that returning one never allocates.
                lock(&self.idle).reserve(self.made.fetch_add(1, Relaxed) + 1);
                renderer
            }
        };
        let drawn = draw(&mut renderer);
        let failure = drawn.as_ref().err().and_then(EnvError::downcast_ref);
        if !matches!(failure, Some(RenderError::Failed { .. })) {
            lock(&self.idle).push(renderer);
        }
        drawn
    }
}

impl fmt::Debug for RendererPool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RendererPool").field("options", &self.options).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;
    use crate::fetch::make::{MujocoEnv, make};
    use crate::gym::env::Env;

    #[test]
    fn there_is_a_renderer_for_each_thread_and_none_after_the_last_environment() {
        let options = RenderOptions::default().with_width(19).with_height(17).with_samples(0);
        let envs = ["FetchPush-v4", "FetchReach-v4"].map(|id| make(id).expect("MuJoCo"));
        let Ok(push) = RendererPool::shared(&envs[0], &options) else { return };
        let pool = |index: usize| RendererPool::shared(&envs[index], &options).expect("a pool");
        let num_idle = || lock(&push.idle).len();
        assert!((0..1000).all(|_| Arc::ptr_eq(&push, &pool(0))));
        assert!(!Arc::ptr_eq(&push, &pool(1)));
        assert_eq!(num_idle(), 1);
        let draw = || {
            let mut env = make("FetchPush-v4").expect("MuJoCo");
            let render =
                |env: &MujocoEnv| push.lend(env, |renderer| env.render(renderer).map(|_| ()));
            assert!(render(&env).is_err(), "before a reset");
            env.reset(Some(0)).expect("a reset");
            (0..50).for_each(|_| render(&env).expect("a picture"));
        };
        draw();
        thread::scope(|scope| (0..3).for_each(|_| drop(scope.spawn(draw))));
        assert!((1..=3).contains(&num_idle()), "{}", num_idle());
        let weak = Arc::downgrade(&push);
        drop(push);
        assert!(weak.upgrade().is_none());
    }
}
