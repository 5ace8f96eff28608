//! Algorithms whose batches a test sees.

use std::fmt;
use std::sync::{Arc, Mutex};

use baselines::LayerWeights;
use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, Losses, StateMut, TrainError, Transitions,
};

/// What watches batches: it adds to a value.
type Watch<T> = fn(&mut T, Transitions<'_>);

/// An algorithm that shows each batch before it learns from it.
struct Watched<T> {
    algorithm: Box<dyn Algorithm>,
    seen: Arc<Mutex<T>>,
    watch: Watch<T>,
}

/// Builds an algorithm that lets `watch` add each batch to `seen`.
pub(crate) fn build<T: Send + 'static>(
    seen: &Arc<Mutex<T>>,
    watch: Watch<T>,
) -> impl FnOnce(&AlgorithmSettings, AlgorithmInit) -> Result<Box<dyn Algorithm>, TrainError> {
    let seen = Arc::clone(seen);
    move |settings, init| Ok(Box::new(Watched { algorithm: settings.build(init)?, seen, watch }))
}

impl<T> fmt::Debug for Watched<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.algorithm.fmt(f)
    }
}

impl<T: Send> Algorithm for Watched<T> {
    fn name(&self) -> &str {
        "watched"
    }
    fn gamma(&self) -> f64 {
        self.algorithm.gamma()
    }
    fn is_on_policy(&self) -> bool {
        self.algorithm.is_on_policy()
    }
    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        (self.watch)(&mut self.seen.lock().expect("no thread panics"), batch);
        self.algorithm.update(batch, average)
    }
    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        self.algorithm.explore(inputs, noise, actions);
    }
    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.algorithm.greedy_layers()
    }
    fn state_mut(&mut self) -> StateMut<'_> {
        self.algorithm.state_mut()
    }
}
