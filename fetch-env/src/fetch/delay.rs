//! Actions that come late.

use std::collections::VecDeque;

use fetch_sim::{Control, LARGEST_NUMBER};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::variation::Varied;

/// The commands that have been given and have not come yet, the next one first. Each is a
/// displacement along x, y, z, in meters, and one of the fingers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Delay(VecDeque<[f64; 4]>);

impl Delay {
    /// Begins an episode with a delay by a number of steps, in which the robot holds its position.
    pub(super) fn begin(&mut self, steps: u32) {
        self.0.clear();
        if steps > 0 {
            // A step adds its command before it takes one.
            self.0.reserve(steps as usize + 1);
            self.0.resize(steps as usize, [0.0; 4]);
        }
    }

    /// Adds a command, and returns the one that comes now.
    pub(super) fn pass(&mut self, control: Control) -> Control {
        if self.0.is_empty() {
            return control;
        }
        let [x, y, z] = control.displacement.into();
        self.0.push_back([x, y, z, control.fingers]);
        self.0.pop_front().map_or(control, |[x, y, z, fingers]| Control {
            displacement: Vector3::new(x, y, z),
            fingers,
        })
    }

    /// Checks commands that were loaded.
    pub(super) fn check(&self, varied: &Varied) -> Result<(), String> {
        if self.0.len() != varied.action_delay as usize {
            return Err(format!(
                "{} of its actions have not come yet, and they are late by {} steps",
                self.0.len(),
                varied.action_delay
            ));
        }
        let mut numbers = self.0.iter().flatten();
        match numbers.find(|number| number.is_nan() || number.abs() > LARGEST_NUMBER) {
            Some(number) => Err(format!("one of its actions has the number {number}")),
            None => Ok(()),
        }
    }
}
