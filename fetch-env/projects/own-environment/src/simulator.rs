//! The simulator: a puck that a force pushes over a square table with walls.

use serde::{Deserialize, Serialize};

/// Duration of a step, in seconds.
const TIME_STEP: f32 = 0.1;
/// Share of the velocity that friction leaves after a step.
const FRICTION: f32 = 0.9;

/// Position in meters and velocity in meters per second; the walls are 1 m from the center.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Puck {
    pub position: [f32; 2],
    pub velocity: [f32; 2],
}

impl Puck {
    /// Simulates one step under a force, which is the acceleration of the puck of 1 kg.
    pub fn push(&mut self, force: [f32; 2]) {
        let axes = self.position.iter_mut().zip(&mut self.velocity).zip(force);
        for ((position, velocity), force) in axes {
            *velocity = (*velocity + force * TIME_STEP) * FRICTION;
            *position += *velocity * TIME_STEP;
            if position.abs() > 1.0 {
                *position = position.clamp(-1.0, 1.0);
                *velocity = 0.0;
            }
        }
    }
}
