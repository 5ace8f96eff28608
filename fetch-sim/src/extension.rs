//! A user's additions and changes to the built-in model.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::object::ObjectShape;
#[cfg(feature = "mujoco")]
use crate::{bounds::check_between, error::SimError};

/// Additions and changes to the built-in model of a task. An empty extension is the built-in model,
/// to the last bit.
///
/// ```
/// use fetch_sim::{Extension, ModelSource, ObjectShape, SimConfig, Task};
///
/// // A slippery ball instead of the cube, and a shelf.
/// let extension = Extension::default()
///     .with_object_shape(ObjectShape::Sphere { radius: 0.03 })
///     .with_object_mass(0.5)
///     .with_object_friction(0.2)
///     .with_xml(r#"
///         <worldbody>
///           <geom name="shelf" type="box" size="0.05 0.2 0.01" pos="1.5 0.75 0.55"/>
///         </worldbody>"#);
/// let config = SimConfig::new(Task::Push).with_model(ModelSource::Extended(extension));
/// # #[cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]
/// fetch_sim::MujocoSimulator::new(&config)?;
/// # Ok::<(), fetch_sim::SimError>(())
/// ```
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[must_use]
pub struct Extension {
    #[serde(with = "shared_text")]
    xml: Arc<str>,
    object_shape: Option<ObjectShape>,
    object_mass: Option<f64>,
    object_friction: Option<f64>,
}

impl Extension {
    /// Adds sections of MJCF, such as `<worldbody>`, `<asset>`, `<contact>` or `<size>`, without a
    /// root element. MuJoCo merges sections of the same name, also with those of the built-in
    /// model.
    ///
    /// Positions are meters in the world frame, and angles are radians. The table's top is at a
    /// height of 0.4 m. A body with a free joint settles along with the scene before the first
    /// reset; a mocap body stays where it is placed. Physics lacks the shapes that collide with
    /// nothing, and may lack their mass: give their body an `<inertial>`. The materials `table`,
    /// `object`, `white`, `blue`, `gray`, `dark` and `red` are available. Sections that apply to
    /// the whole model (`<compiler>`, `<option>`, `<default>`) change the robot as well; the
    /// environments of fetch-env need the time step of 0.002 s. An added actuator must drive a
    /// slide or a hinge, and is commanded as the fingers are.
    pub fn with_xml(mut self, sections: &str) -> Self {
        self.xml = [&self.xml, sections].concat().into();
        self
    }

    /// Sets the object's form. It keeps its mass, and starts standing on the table.
    pub const fn with_object_shape(mut self, shape: ObjectShape) -> Self {
        self.object_shape = Some(shape);
        self
    }

    /// Sets the object's mass, in kilograms; 2 in the built-in model.
    pub const fn with_object_mass(mut self, mass: f64) -> Self {
        self.object_mass = Some(mass);
        self
    }

    /// Sets the coefficient of sliding friction between the object and the table: 1 in the built-in
    /// model, and 0.1 in Slide. Where the object touches something else, such as the fingers, whose
    /// coefficient is 1, the greater of the two coefficients applies.
    pub const fn with_object_friction(mut self, friction: f64) -> Self {
        self.object_friction = Some(friction);
        self
    }

    settings! {
        /// Returns the object's form, if it is changed.
        object_shape: Option<ObjectShape>;
        /// Returns the object's mass in kilograms, if it is changed.
        object_mass: Option<f64>;
        /// Returns the coefficient of friction between the object and the table, if it is changed.
        object_friction: Option<f64>;
    }

    /// Returns the added sections of MJCF.
    #[must_use]
    pub fn xml(&self) -> &str {
        &self.xml
    }

    /// Returns whether the object differs from that of the built-in model.
    #[cfg(feature = "mujoco")]
    pub(crate) const fn changes_object(&self) -> bool {
        self.object_shape.is_some() || self.object_mass.is_some() || self.object_friction.is_some()
    }

    /// Checks the object's numbers. The bounds are far wider than any size, mass or friction that
    /// makes sense in the scene: they catch numbers in other units.
    #[cfg(feature = "mujoco")]
    pub(crate) fn check(&self) -> Result<(), SimError> {
        for size in self.object_shape.iter().flat_map(|shape| shape.sizes()) {
            check_between("a size of the object, in meters,", size, [1e-4, 10.0])?;
        }
        if let Some(mass) = self.object_mass {
            check_between("the object's mass, in kilograms,", mass, [1e-6, 1e6])?;
        }
        self.object_friction.map_or(Ok(()), |friction| {
            check_between("the object's coefficient of friction", friction, [0.0, 1e3])
        })
    }

    /// Returns what equality compares: numbers by their bits, so that it is an equivalence.
    fn key(&self) -> impl Eq {
        let shape = self.object_shape.map(|shape| (shape.mjcf_type(), shape.sizes()));
        let shape = shape.map(|(mjcf_type, sizes)| (mjcf_type, sizes.map(f64::to_bits)));
        let numbers = [self.object_mass, self.object_friction];
        (Arc::clone(&self.xml), shape, numbers.map(|number| number.map(f64::to_bits)))
    }
}

impl PartialEq for Extension {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Extension {}

/// The serialized form of a shared text: a string.
mod shared_text {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(
        text: &Arc<str>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(text)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<str>, D::Error> {
        String::deserialize(deserializer).map(Arc::from)
    }
}
