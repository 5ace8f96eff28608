//! What lies between a policy and the robot: low pass, scale, noise and delay.

use std::collections::VecDeque;

use fetch_sim::{Control, LARGEST_NUMBER};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::action::{ACTION_LEN, Precision};
use super::observation::FetchObservation;
use super::variation::interface::{InterfaceFactor, InterfaceNumbers};
use crate::gym::np_random::{MAX_COUNT, NpRandom};

/// The state of an environment's interface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Interface {
    numbers: InterfaceNumbers,
    /// The delayed commands, the next one first. Each is a displacement along x, y, z, in meters, and
    /// one of the fingers.
    late: VecDeque<[f64; ACTION_LEN]>,
    /// The elements of the observations that have not been shown yet, and of the one that is shown
    /// now, which is the first; none without a delay.
    #[serde(default)]
    observed: VecDeque<f64>,
    /// What came of the last action from the low pass.
    passed: Option<[f64; ACTION_LEN]>,
    /// The seed of the episode's noise.
    seed: u64,
    /// The number of actions so far.
    step: u64,
}

/// What noise is added to.
#[derive(Clone, Copy)]
enum Noise {
    Action,
    Observation,
}

impl Interface {
    /// Begins an episode.
    pub(super) fn begin(&mut self, numbers: InterfaceNumbers, seed: u64) {
        self.late.clear();
        self.observed.clear();
        let delay = numbers.delay(InterfaceFactor::ActionDelay);
        if delay > 0 {
            // A step adds its command before it takes one.
            self.late.reserve(delay + 1);
            self.late.resize(delay, [0.0; ACTION_LEN]);
        }
        (self.numbers, self.passed, self.seed, self.step) = (numbers, None, seed, 0);
    }

    /// Returns what comes of an action before it is clipped.
    pub(super) fn action<P: Precision>(&mut self, action: [P; ACTION_LEN]) -> [P; ACTION_LEN] {
        self.step += 1;
        let numbers = self.numbers;
        let [pass, scale, noise] = [
            (InterfaceFactor::ActionLowPass, 1.0),
            (InterfaceFactor::ActionScale, 1.0),
            (InterfaceFactor::ActionNoise, 0.0),
        ]
        .map(|(factor, nothing)| numbers.or(factor, nothing));
        if pass == 1.0 && scale == 1.0 && noise == 0.0 {
            return action;
        }
        // Finite, and so small that no product overflows.
        let mut elements =
            action.map(|element| element.into().clamp(-LARGEST_NUMBER, LARGEST_NUMBER));
        if pass < 1.0 {
            for (element, last) in elements.iter_mut().zip(self.passed.into_iter().flatten()) {
                *element = pass * *element + (1.0 - pass) * last;
            }
            self.passed = Some(elements);
        }
        let mut random = self.noise(Noise::Action);
        elements.map(|element| {
            let scaled = element * scale;
            P::from_f64(if noise == 0.0 {
                scaled
            } else {
                scaled + noise * random.standard_normal()
            })
        })
    }

    /// Delays a command, and returns the one that arrives now.
    pub(super) fn delay(&mut self, control: Control) -> Control {
        if self.late.is_empty() {
            return control;
        }
        let [x, y, z] = control.displacement.into();
        self.late.push_back([x, y, z, control.fingers]);
        self.late.pop_front().map_or(control, |[x, y, z, fingers]| Control {
            displacement: Vector3::new(x, y, z),
            fingers,
        })
    }

    /// Adds the noise of the current state to what is observed of it: always the same.
    pub(super) fn disturb(&self, observation: &mut FetchObservation) {
        let numbers = &self.numbers;
        if !numbers.has_noise_of_observations() {
            return;
        }
        let mut random = self.noise(Noise::Observation);
        let mut add = |sigma: f64, elements: &mut [f64]| {
            for element in elements {
                let error = random.standard_normal();
                if sigma > 0.0 {
                    *element += sigma * error;
                }
            }
        };
        let (fields, mut rest, achieved_goal) = observation.parts_mut();
        let of_all = numbers.or(InterfaceFactor::ObservationNoise, 0.0);
        for field in fields {
            let elements;
            (elements, rest) = rest.split_at_mut(field.range.len());
            add(numbers.or(field.noise, of_all), elements);
        }
        add(of_all, rest);
        add(numbers.or(InterfaceFactor::AchievedGoalNoise, 0.0), achieved_goal);
    }

    /// Takes up the observation of a new state, before it is [shown](Self::show).
    pub(super) fn observe(&mut self, observation: &[f64]) {
        let delay = self.numbers.delay(InterfaceFactor::ObservationDelay);
        if delay == 0 {
            return;
        }
        if self.observed.is_empty() {
            (0..delay).for_each(|_| self.observed.extend(observation));
        } else {
            self.observed.drain(..observation.len());
        }
        self.observed.extend(observation);
    }

    /// Replaces the elements of an observation by those that are shown now.
    pub(super) fn show(&self, observation: &mut FetchObservation) {
        let (_, elements, _) = observation.parts_mut();
        for (element, shown) in elements.iter_mut().zip(&self.observed) {
            *element = *shown;
        }
    }

    /// Returns the generator of a step's noise.
    fn noise(&self, noise: Noise) -> NpRandom {
        NpRandom::numbered(self.seed, self.step.wrapping_mul(2).wrapping_add(noise as u64))
    }

    /// Checks a state that was loaded, given the number of elements of an observation if an episode is
    /// under way.
    pub(super) fn check(
        &self,
        numbers: &InterfaceNumbers,
        observation_len: Option<usize>,
    ) -> Result<(), String> {
        if self.numbers != *numbers {
            return Err("its interface is that of another episode".into());
        }
        let (late, delay) = (self.late.len(), numbers.delay(InterfaceFactor::ActionDelay));
        if late != delay {
            return Err(format!(
                "{late} of its actions have not come yet, with a delay of {delay}"
            ));
        }
        let delay = numbers.delay(InterfaceFactor::ObservationDelay);
        let expected = observation_len.map(|len| if delay > 0 { (delay + 1) * len } else { 0 });
        let observed = self.observed.len();
        if let Some(expected) = expected.filter(|&expected| expected != observed) {
            return Err(format!("{observed} numbers are delayed instead of {expected}"));
        }
        if self.step > MAX_COUNT {
            return Err(format!("it has taken {} steps", self.step));
        }
        let mut numbers = self.late.iter().chain(&self.passed).flatten();
        match numbers.find(|number| number.is_nan() || number.abs() > LARGEST_NUMBER) {
            Some(number) => Err(format!("one of its actions has the number {number}")),
            None => Ok(()),
        }
    }
}
