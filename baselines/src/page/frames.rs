//! The frames of an episode in the form that a page shows.

use fetch_env::GoalObservation;
use serde::Serialize;

use super::{
    bodies::Bodies,
    columns::Columns,
    error::PageError,
    pictures::Pictures,
    scene::{PlaybackEnv, Scene},
};

/// The frames of an episode: the first after the reset, the others after each step.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Frames {
    Bodies(Bodies),
    Pictures(Pictures),
    Columns(#[serde(skip)] Columns),
}

impl Frames {
    /// Returns the empty frames of an environment after a reset.
    pub(super) fn new(
        env: &impl PlaybackEnv,
        observation: &impl GoalObservation,
    ) -> Result<Self, PageError> {
        Ok(match env.scene() {
            Scene::Bodies(simulator) => {
                let goals = env.goal_positions(observation.desired_goal());
                Self::Bodies(Bodies::new(simulator, goals)?)
            }
            Scene::Picture { width, height, .. } => Self::Pictures(Pictures::new([width, height])),
            Scene::Columns => Self::Columns(Columns::default()),
        })
    }

    /// Adds a frame.
    pub(super) fn push(
        &mut self,
        env: &impl PlaybackEnv,
        observation: &impl GoalObservation,
    ) -> Result<(), PageError> {
        match (self, env.scene()) {
            (Self::Bodies(bodies), Scene::Bodies(simulator)) => bodies.push(simulator),
            (Self::Pictures(pictures), Scene::Picture { rgb, width, height }) => {
                pictures.push(&rgb, [width, height])
            }
            (Self::Columns(columns), Scene::Columns) => {
                columns.push(observation);
                Ok(())
            }
            _ => Err(PageError::Scene {
                reason: "the environment shows its states in several ways: choose one".into(),
            }),
        }
    }

    /// Ends the episode.
    pub(super) fn finish(&mut self) {
        if let Self::Bodies(bodies) = self {
            bodies.finish();
        }
    }
}
