//! The numbers of a scene's physics that may differ between episodes.

use std::{collections::BTreeMap, fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::{bounds::check_between, error::SimError};

/// Declares the factors, with their names, what errors call them, and their bounds.
macro_rules! factors {
    ($($(#[$doc:meta])* $factor:ident = $name:literal, $what:literal, [$least:literal, $most:literal];)*) => {
        /// A number of a scene's physics that may differ between episodes.
        ///
        /// Those that are called a *scale* multiply what the model has; the others replace it. Where
        /// two geoms touch, MuJoCo takes the greater of their coefficients of friction: a slippery
        /// object needs a slippery table, which [`Friction`](Self::Friction) gives at once.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum PhysicsFactor {
            $($(#[$doc])* $factor,)*
        }

        impl PhysicsFactor {
            /// All factors.
            pub const ALL: &[Self] = &[$(Self::$factor),*];

            /// Returns the factor's name, such as `object_mass`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$factor => $name,)* }
            }

            /// Returns the smallest and the largest value: far wider than what makes sense in the
            /// scene, to catch numbers in other units.
            #[must_use]
            pub const fn bounds(self) -> [f64; 2] {
                match self { $(Self::$factor => [$least, $most],)* }
            }

            const fn what(self) -> &'static str {
                match self { $(Self::$factor => $what,)* }
            }
        }
    };
}

factors! {
    /// `object_mass`: the object's mass, in kilograms. Its inertia follows.
    ObjectMass = "object_mass", "object_mass, in kilograms,", [1e-3, 1e3];
    /// `object_size`: scale of the object's size. Its inertia follows, and not its mass.
    ObjectSize = "object_size", "object_size, a scale,", [0.1, 10.0];
    /// `object_friction`: the object's coefficient of sliding friction.
    ObjectFriction = "object_friction", "object_friction", [1e-3, 1e2];
    /// `object_spin_friction`: the object's coefficient of torsional friction, in meters. It has an
    /// effect where the object touches the fingers.
    ObjectSpinFriction = "object_spin_friction", "object_spin_friction, in meters,", [1e-6, 1e2];
    /// `object_damping`: damping of the object's motion, in N s/m and N m s/rad.
    ObjectDamping = "object_damping", "object_damping", [0.0, 1e3];
    /// `table_friction`: the table's coefficient of sliding friction.
    TableFriction = "table_friction", "table_friction", [1e-3, 1e2];
    /// `finger_friction`: the fingers' coefficient of sliding friction.
    FingerFriction = "finger_friction", "finger_friction", [1e-3, 1e2];
    /// `friction`: scale of the sliding friction of the object, the table and the fingers. It also
    /// multiplies their own factors.
    Friction = "friction", "friction, a scale,", [1e-3, 1e3];
    /// `arm_stiffness`: scale of the stiffness of the weld that moves the gripper to its target.
    ArmStiffness = "arm_stiffness", "arm_stiffness, a scale,", [1e-2, 1e1];
    /// `arm_damping`: scale of the damping of the arm's seven joints.
    ArmDamping = "arm_damping", "arm_damping, a scale,", [1e-3, 1e3];
    /// `finger_strength`: scale of the force with which the fingers go to their targets.
    FingerStrength = "finger_strength", "finger_strength, a scale,", [1e-3, 1e2];
    /// `gravity`: the acceleration of free fall, in m/s^2.
    Gravity = "gravity", "gravity, in m/s^2,", [0.0, 1e2];
}

impl fmt::Display for PhysicsFactor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PhysicsFactor {
    type Err = SimError;

    fn from_str(name: &str) -> Result<Self, SimError> {
        let mut factors = Self::ALL.iter().copied();
        factors
            .find(|factor| factor.name() == name)
            .ok_or_else(|| SimError::UnknownFactor { name: name.into() })
    }
}

/// Numbers of a scene's physics that differ from the model's.
///
/// ```
/// use fetch_sim::{Physics, PhysicsFactor};
///
/// let physics = Physics::default().with(PhysicsFactor::ObjectMass, 0.5)?;
/// assert_eq!(physics.get(PhysicsFactor::ObjectMass), Some(0.5));
/// assert_eq!(physics.get(PhysicsFactor::Gravity), None);
/// # Ok::<(), fetch_sim::SimError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
#[must_use]
pub struct Physics([Option<f64>; PhysicsFactor::ALL.len()]);

impl Physics {
    /// Sets a number.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`] outside of the factor's [bounds](PhysicsFactor::bounds).
    pub fn with(mut self, factor: PhysicsFactor, value: f64) -> Result<Self, SimError> {
        check_between(factor.what(), value, factor.bounds())?;
        self.0[factor as usize] = Some(value);
        Ok(self)
    }

    /// Returns a number, if it differs from the model's.
    #[must_use]
    pub const fn get(&self, factor: PhysicsFactor) -> Option<f64> {
        self.0[factor as usize]
    }

    /// Returns a scale: 1 unless it is set.
    pub(crate) fn scale(&self, factor: PhysicsFactor) -> f64 {
        self.get(factor).unwrap_or(1.0)
    }

    /// Returns the numbers that are set.
    pub fn iter(&self) -> impl Iterator<Item = (PhysicsFactor, f64)> + '_ {
        PhysicsFactor::ALL.iter().filter_map(|&factor| Some((factor, self.get(factor)?)))
    }

    /// Returns whether nothing differs from the model.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }
}

impl From<Physics> for BTreeMap<String, f64> {
    fn from(physics: Physics) -> Self {
        physics.iter().map(|(factor, value)| (factor.to_string(), value)).collect()
    }
}

impl TryFrom<BTreeMap<String, f64>> for Physics {
    type Error = SimError;

    fn try_from(numbers: BTreeMap<String, f64>) -> Result<Self, SimError> {
        numbers
            .into_iter()
            .try_fold(Self::default(), |physics, (name, value)| physics.with(name.parse()?, value))
    }
}
