//! The factors of what lies between a policy and the robot.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::VariationError;

/// Declares the factors, with their names and bounds.
macro_rules! factors {
    ($($(#[$doc:meta])* $factor:ident = $name:literal, [$least:literal, $most:expr];)*) => {
        /// A factor of what lies between a policy and the robot.
        ///
        /// An action goes through the low pass, is scaled, gets noise, is clipped as always, and is
        /// delayed. What is observed gets noise, and is delayed. At its neutral value, which each
        /// factor names, a stage changes nothing.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum InterfaceFactor {
            $($(#[$doc])* $factor,)*
        }

        impl InterfaceFactor {
            /// All factors.
            pub const ALL: &[Self] = &[$(Self::$factor),*];

            /// Returns the factor's name, such as `action_noise`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$factor => $name,)* }
            }

            /// Returns the smallest and the largest value.
            #[must_use]
            pub const fn bounds(self) -> [f64; 2] {
                match self { $(Self::$factor => [$least, $most],)* }
            }
        }
    };
}

/// The largest delay, in steps.
const MAX_DELAY: f64 = 50.0;

// From `observation_noise` on, they are noise of what is observed.
factors! {
    /// `action_low_pass`: the share a of an action in what comes of it, a * action + (1 - a) * what
    /// came of the last one. The first action passes as it is, and so do all at 1.
    ActionLowPass = "action_low_pass", [1e-3, 1.0];
    /// `action_scale`: a factor of each element of an action. 1 leaves it.
    ActionScale = "action_scale", [0.0, 1e2];
    /// `action_noise`: the standard deviation of normal noise that is added to each element of an
    /// action. None at 0.
    ActionNoise = "action_noise", [0.0, 1e2];
    /// `action_delay`: the number of steps, up to 50, by which actions are delayed. What is drawn is
    /// rounded. Until the first action arrives, the robot holds its position. None at 0.
    ActionDelay = "action_delay", [0.0, MAX_DELAY];
    /// `observation_delay`: the number of steps, up to 50, by which `observation` is late. What is
    /// drawn is rounded. At the start, the first one repeats. The goals, and so the rewards, are
    /// those of the present. None at 0.
    ObservationDelay = "observation_delay", [0.0, MAX_DELAY];
    /// `observation_noise`: the standard deviation of normal noise that is added to each element of
    /// `observation`, in its unit. The goals, and so the rewards, stay exact. None at 0.
    ObservationNoise = "observation_noise", [0.0, 1e2];
    /// `grip_pos_noise`: that of the field `grip_pos`, in place of `observation_noise`.
    GripPosNoise = "grip_pos_noise", [0.0, 1e2];
    /// `object_pos_noise`: that of the field `object_pos`, in place of `observation_noise`.
    ObjectPosNoise = "object_pos_noise", [0.0, 1e2];
    /// `object_rel_pos_noise`: that of the field `object_rel_pos`, in place of `observation_noise`.
    ObjectRelPosNoise = "object_rel_pos_noise", [0.0, 1e2];
    /// `gripper_state_noise`: that of the field `gripper_state`, in place of `observation_noise`.
    GripperStateNoise = "gripper_state_noise", [0.0, 1e2];
    /// `object_rot_noise`: that of the field `object_rot`, in place of `observation_noise`.
    ObjectRotNoise = "object_rot_noise", [0.0, 1e2];
    /// `object_velp_noise`: that of the field `object_velp`, in place of `observation_noise`.
    ObjectVelpNoise = "object_velp_noise", [0.0, 1e2];
    /// `object_velr_noise`: that of the field `object_velr`, in place of `observation_noise`.
    ObjectVelrNoise = "object_velr_noise", [0.0, 1e2];
    /// `grip_velp_noise`: that of the field `grip_velp`, in place of `observation_noise`.
    GripVelpNoise = "grip_velp_noise", [0.0, 1e2];
    /// `gripper_vel_noise`: that of the field `gripper_vel`, in place of `observation_noise`.
    GripperVelNoise = "gripper_vel_noise", [0.0, 1e2];
    /// `achieved_goal_noise`: the standard deviation of normal noise that is added to each element of
    /// `achieved_goal`, in its unit. Reward, success and distance are those of the noisy goal, so
    /// that a step's reward always is that of its goals: measure success without this noise. The
    /// desired goal stays exact. None at 0.
    AchievedGoalNoise = "achieved_goal_noise", [0.0, 1e2];
}

/// The numbers of an interface that differ from the plain one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub(in crate::fetch) struct InterfaceNumbers([Option<f64>; InterfaceFactor::ALL.len()]);

impl InterfaceNumbers {
    pub(super) const fn set(&mut self, factor: InterfaceFactor, value: f64) {
        self.0[factor as usize] = Some(value);
    }

    pub(super) const fn get(&self, factor: InterfaceFactor) -> Option<f64> {
        self.0[factor as usize]
    }

    /// Returns a number, or the one that changes nothing.
    pub(in crate::fetch) fn or(&self, factor: InterfaceFactor, nothing: f64) -> f64 {
        self.get(factor).unwrap_or(nothing)
    }

    /// Returns a delay, in steps.
    pub(in crate::fetch) fn delay(&self, factor: InterfaceFactor) -> usize {
        self.or(factor, 0.0) as usize
    }

    /// Returns whether anything that is observed has noise.
    pub(in crate::fetch) fn has_noise_of_observations(&self) -> bool {
        let noises = &self.0[InterfaceFactor::ObservationNoise as usize..];
        noises.iter().flatten().any(|&sigma| sigma > 0.0)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (InterfaceFactor, f64)> + '_ {
        InterfaceFactor::ALL.iter().filter_map(|&factor| Some((factor, self.get(factor)?)))
    }
}

impl From<InterfaceNumbers> for BTreeMap<String, f64> {
    fn from(numbers: InterfaceNumbers) -> Self {
        numbers.iter().map(|(factor, value)| (factor.name().to_owned(), value)).collect()
    }
}

impl TryFrom<BTreeMap<String, f64>> for InterfaceNumbers {
    type Error = VariationError;

    fn try_from(named: BTreeMap<String, f64>) -> Result<Self, VariationError> {
        let mut numbers = Self::default();
        for (name, value) in named {
            let mut factors = InterfaceFactor::ALL.iter().copied();
            let factor = factors.find(|factor| factor.name() == name);
            let factor = factor.ok_or_else(|| VariationError::UnknownFactor {
                name: name.clone(),
                nearest: InterfaceFactor::ALL.iter().map(|factor| factor.name().into()).collect(),
            })?;
            let [least, most] = factor.bounds();
            if !(least..=most).contains(&value) {
                return Err(VariationError::OutOfRange { factor: name, value, least, most });
            }
            numbers.set(factor, value);
        }
        Ok(numbers)
    }
}
