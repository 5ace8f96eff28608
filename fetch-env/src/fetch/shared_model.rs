use std::sync::{Arc, Mutex, PoisonError, Weak};

use fetch_sim::{FetchModel, SimConfig, SimError};

/// The models that some environment of this process is alive with.
static MODELS: Mutex<Vec<Weak<FetchModel>>> = Mutex::new(Vec::new());

/// The model of a configuration, compiled and settled once for all environments that are alive: a
/// model never changes.
pub(crate) fn shared_model(config: &SimConfig) -> Result<Arc<FetchModel>, SimError> {
    // A panic in here leaves a list that is as good as any.
    let mut models = MODELS.lock().unwrap_or_else(PoisonError::into_inner);
    models.retain(|model| model.strong_count() > 0);
    let mut alive = models.iter().filter_map(Weak::upgrade);
    if let Some(model) = alive.find(|model| model.config() == config) {
        return Ok(model);
    }
    drop(alive);
    let model = FetchModel::load(config)?;
    models.push(Arc::downgrade(&model));
    Ok(model)
}
