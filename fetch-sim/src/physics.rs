//! The numbers of a scene's physics that may differ between episodes.

factors! {
    /// A number of a scene's physics that may differ between episodes.
    ///
    /// Those that are called a *scale* multiply what the model has; the others replace it. Where
    /// two geoms touch, MuJoCo takes the greater of their coefficients of friction: a slippery
    /// object needs a slippery table, which [`Friction`](Self::Friction) gives at once.
    PhysicsFactor {
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
    Physics
}

impl Physics {
    /// Returns a scale: 1 unless it is set.
    pub(crate) fn scale(&self, factor: PhysicsFactor) -> f64 {
        self.get(factor).unwrap_or(1.0)
    }
}
