//! DDPG whose batches a test sees.

use std::fmt;
use std::sync::{Arc, Mutex};

use baselines::LayerWeights;
use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, Ddpg, Losses, StateMut, TrainError, Transitions,
};

/// What watches batches: it adds to a value.
type Watch<T> = fn(&mut T, Transitions<'_>);

/// DDPG that shows each batch before it learns from it.
struct Watched<T> {
    ddpg: Ddpg,
    seen: Arc<Mutex<T>>,
    watch: Watch<T>,
}

/// Builds DDPG that lets `watch` add each batch to `seen`.
pub(crate) fn build<T: Send + 'static>(
    seen: &Arc<Mutex<T>>,
    watch: Watch<T>,
) -> impl FnOnce(&AlgorithmSettings, AlgorithmInit) -> Result<Box<dyn Algorithm>, TrainError> {
    let seen = Arc::clone(seen);
    move |settings, init| {
        let AlgorithmSettings::Ddpg(settings) = settings else { unreachable!("they are of DDPG") };
        Ok(Box::new(Watched { ddpg: Ddpg::new(settings.clone(), init)?, seen, watch }))
    }
}

impl<T> fmt::Debug for Watched<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.ddpg.fmt(f)
    }
}

impl<T: Send> Algorithm for Watched<T> {
    fn name(&self) -> &str {
        "watched"
    }
    fn gamma(&self) -> f64 {
        self.ddpg.gamma()
    }
    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        (self.watch)(&mut self.seen.lock().expect("no thread panics"), batch);
        self.ddpg.update(batch, average)
    }
    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        self.ddpg.explore(inputs, noise, actions);
    }
    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.ddpg.greedy_layers()
    }
    fn state_mut(&mut self) -> StateMut<'_> {
        self.ddpg.state_mut()
    }
}
