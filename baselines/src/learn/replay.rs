//! The buffer and the sampler that the settings describe.

use her_relabel::{GoalMixture, GoalPart, GoalStrategy, Sampler, StillEpisodes, UnitInterval};

use super::error::TrainError;
use super::settings::ReplaySettings;

/// Returns the sampler of the settings.
pub(super) fn sampler(settings: &ReplaySettings, gamma: f64) -> Result<Sampler, TrainError> {
    let ReplaySettings { batch_size, future_k, past_desired, already_achieved, .. } = *settings;
    let goals = GoalMixture::new(&[
        GoalPart::new(GoalStrategy::Future, 1.0),
        GoalPart::new(GoalStrategy::PastDesired, past_desired),
    ]);
    let goals = goals.map_err(|_| TrainError::Setting {
        name: "past_desired",
        value: past_desired.to_string(),
        expected: "choose a finite number of at least 0",
    })?;
    let ratio = share("future_k", future_k / (future_k + 1.0))?;
    Ok(Sampler::new(batch_size, GoalStrategy::Future, ratio)
        .with_goals(goals)
        .with_already_achieved(share("already_achieved", already_achieved)?)
        .with_discount(share("gamma", gamma)?))
}

/// Returns which still episodes are left out; `None` if none is.
pub(super) fn still_episodes(
    settings: &ReplaySettings,
) -> Result<Option<StillEpisodes>, TrainError> {
    let kept = share("still_kept", settings.still_kept)?;
    let still = StillEpisodes::new(settings.still_distance, kept);
    Ok((kept != UnitInterval::ONE).then_some(still))
}

/// Checks a share.
fn share(name: &'static str, value: f64) -> Result<UnitInterval, TrainError> {
    UnitInterval::new(value).map_err(|_| TrainError::Setting {
        name,
        value: value.to_string(),
        expected: "choose a number from 0 to 1",
    })
}
