//! The numbers of a Fetch model's physics that may vary, and what follows from them.

use super::names::{Ids, MOCAP};
use crate::mujoco::binding::{
    ffi::{
        FS_BOX, FS_CYLINDER, FS_SPHERE,
        ModelArray::{
            BodyBvhadr, BodyParentid, EqObj1id, EqObj2id, GeomBodyid, PairGeom1, PairGeom2,
        },
        PhysicsArray::{
            ActuatorBiasprm, ActuatorGainprm, BodyInertia, BodyInvweight, BodyMass,
            BodySubtreemass, BvhAabb, DofDamping, DofInvweight, DofM0, EqSolref, GeomAabb,
            GeomFriction, GeomRbound, GeomSize, Gravity, Meaninertia, PairFriction,
        },
    },
    ids::BodyId,
    model::Model,
    varied_model::VariedModel,
};
use crate::{
    error::SimError,
    physics::{Physics, PhysicsFactor as Factor},
};

/// The joints of the arm.
const ARM_JOINTS: [&str; 7] = [
    "robot0:shoulder_pan_joint",
    "robot0:shoulder_lift_joint",
    "robot0:upperarm_roll_joint",
    "robot0:elbow_flex_joint",
    "robot0:forearm_roll_joint",
    "robot0:wrist_flex_joint",
    "robot0:wrist_roll_joint",
];
const FINGERS: [&str; 2] = ["robot0:r_gripper_finger_link", "robot0:l_gripper_finger_link"];

/// Degrees of freedom of a free joint.
const FREE_DOFS: usize = 6;

/// Where the numbers are that may vary.
#[derive(Debug, Default)]
pub(crate) struct Places {
    object: Option<ObjectPlaces>,
    table_geoms: Vec<usize>,
    finger_geoms: Vec<usize>,
    /// Pairs of geoms of the object and the table that have coefficients of their own.
    pairs: Vec<usize>,
    arm_dofs: Vec<usize>,
    welds: Vec<usize>,
    finger_actuators: Vec<usize>,
}

#[derive(Debug)]
struct ObjectPlaces {
    geoms: Vec<usize>,
    dof: usize,
    /// `None` if its mass and inertia are not those of a single geom.
    solid: Option<Solid>,
}

/// An object of a single geom, with a mass and the inertia that follows.
#[derive(Clone, Copy, Debug)]
struct Solid {
    body: usize,
    geom: usize,
    /// The node of the body's tree of boxes, where MuJoCo has such trees.
    node: Option<usize>,
    form: Form,
}

/// A form whose inertia follows from its sizes.
#[derive(Clone, Copy, Debug)]
enum Form {
    Box,
    Sphere,
    Cylinder,
}

impl Places {
    pub(super) fn resolve(model: &Model, ids: &Ids) -> Result<Self, SimError> {
        let geoms_of = |body| model.fixed_to(GeomBodyid, body);
        let table_geoms = model.body("table0").map(geoms_of).unwrap_or_default();
        let finger_geoms =
            FINGERS.iter().flat_map(|name| model.body(name).map(geoms_of).unwrap_or_default());
        let mut places = Self {
            finger_geoms: finger_geoms.collect(),
            welds: equalities_of(model, model.body(MOCAP)?),
            ..Self::default()
        };
        // A robot of the user's own may have others.
        for joint in ARM_JOINTS.iter().filter_map(|name| model.joint(name).ok()) {
            places.arm_dofs.push(model.dof_address(joint)?);
        }
        let is_finger = |qpos: &usize| ids.fingers.iter().any(|finger| finger.qpos == *qpos);
        let actuators = ids.actuated_qpos.iter().enumerate();
        places.finger_actuators =
            actuators.filter(|(_, qpos)| is_finger(qpos)).map(|(actuator, _)| actuator).collect();
        if let Some(object) = ids.object {
            let body = model.site_body(object.site)?;
            let geoms = geoms_of(body);
            places.pairs = pairs_of(model, &geoms, &table_geoms);
            let solid = match *geoms {
                [geom] => Solid::of(model, body, geom),
                _ => None,
            };
            let dof = model.dof_address(object.joint)?;
            places.object = Some(ObjectPlaces { geoms, dof, solid });
        }
        places.table_geoms = table_geoms;
        Ok(places)
    }

    /// Checks that a number can vary.
    pub(super) fn check(&self, factor: Factor) -> Result<(), SimError> {
        let solid = self.object.as_ref().map(|object| object.solid.is_some());
        let reason = match (factor, solid) {
            (
                Factor::ObjectMass
                | Factor::ObjectSize
                | Factor::ObjectFriction
                | Factor::ObjectSpinFriction
                | Factor::ObjectDamping,
                None,
            ) => "the scene has no object",
            (Factor::ObjectMass | Factor::ObjectSize, Some(false)) => {
                "the object's mass and inertia are not those of one box, ball or cylinder"
            }
            (Factor::TableFriction, _) if self.table_geoms.is_empty() => "no body is named table0",
            (Factor::FingerFriction, _) if self.finger_geoms.is_empty() => {
                "the fingers have no geoms"
            }
            (Factor::ArmDamping, _) if self.arm_dofs.is_empty() => "the arm has no joints",
            (Factor::ArmStiffness, _) if self.welds.is_empty() => "no weld moves the gripper",
            (Factor::FingerStrength, _) if self.finger_actuators.is_empty() => {
                "the fingers have no actuators"
            }
            _ => return Ok(()),
        };
        Err(SimError::CannotVary { factor: factor.name(), reason })
    }

    /// Returns how much higher the object's center is, in meters, when it stands on the table.
    pub(super) fn raised_by(&self, model: &Model, physics: &Physics) -> f64 {
        let solid = self.object.as_ref().and_then(|object| object.solid);
        match (physics.get(Factor::ObjectSize), solid) {
            (Some(scale), Some(solid)) => {
                let half_height = match (solid.form, solid.sizes(model.physics(GeomSize))) {
                    (Form::Box, [.., height]) | (Form::Cylinder, [_, height, _]) => height,
                    (Form::Sphere, [radius, ..]) => radius,
                };
                (scale - 1.0) * half_height
            }
            _ => 0.0,
        }
    }

    /// Writes all numbers that may vary, and all that follow from them.
    pub(super) fn write(&self, model: &Model, varied: &mut VariedModel, physics: &Physics) {
        self.write_frictions(varied, physics);
        let stiffness = physics.scale(Factor::ArmStiffness);
        for &weld in &self.welds {
            // The stiffness of a constraint is proportional to 1 / (time constant)^2.
            let at = 2 * weld;
            varied.array_mut(EqSolref)[at] = varied.base(EqSolref)[at] / stiffness.sqrt();
        }
        let strength = physics.scale(Factor::FingerStrength);
        for actuator in &self.finger_actuators {
            // A position servo: its force is gain * target - gain * position.
            for (array, number) in [(ActuatorGainprm, 0), (ActuatorBiasprm, 1)] {
                let at = actuator * (varied.base(array).len() / model.nu()) + number;
                varied.array_mut(array)[at] = varied.base(array)[at] * strength;
            }
        }
        let damping = physics.scale(Factor::ArmDamping);
        for &dof in &self.arm_dofs {
            varied.array_mut(DofDamping)[dof] = varied.base(DofDamping)[dof] * damping;
        }
        let gravity = varied.base(Gravity)[2];
        varied.array_mut(Gravity)[2] =
            physics.get(Factor::Gravity).map_or(gravity, |acceleration| -acceleration);
        if let Some(object) = &self.object {
            for dof in object.dof..object.dof + FREE_DOFS {
                let base = varied.base(DofDamping)[dof];
                varied.array_mut(DofDamping)[dof] =
                    physics.get(Factor::ObjectDamping).unwrap_or(base);
            }
            if let Some(solid) = object.solid {
                solid.write(varied, physics, object.dof);
                derive_totals(model, varied);
            }
        }
    }

    fn write_frictions(&self, varied: &mut VariedModel, physics: &Physics) {
        let scale = physics.scale(Factor::Friction);
        let object_geoms = self.object.iter().flat_map(|object| &object.geoms);
        let geoms = object_geoms.map(|geom| (geom, Factor::ObjectFriction));
        let geoms = geoms.chain(self.table_geoms.iter().map(|geom| (geom, Factor::TableFriction)));
        let geoms =
            geoms.chain(self.finger_geoms.iter().map(|geom| (geom, Factor::FingerFriction)));
        for (&geom, factor) in geoms {
            let [sliding, spinning] = [3 * geom, 3 * geom + 1];
            let [base, base_spinning] = [sliding, spinning].map(|at| varied.base(GeomFriction)[at]);
            let friction = varied.array_mut(GeomFriction);
            friction[sliding] = physics.get(factor).unwrap_or(base) * scale;
            if factor == Factor::ObjectFriction {
                friction[spinning] =
                    physics.get(Factor::ObjectSpinFriction).unwrap_or(base_spinning);
            }
        }
        for pair in self.pairs.iter().map(|pair| 5 * pair) {
            for at in [pair, pair + 1] {
                // The pair has its own coefficient in place of the greater of both.
                let chosen = [Factor::ObjectFriction, Factor::TableFriction]
                    .into_iter()
                    .filter_map(|factor| physics.get(factor))
                    .reduce(f64::max);
                let base = varied.base(PairFriction)[at];
                varied.array_mut(PairFriction)[at] = chosen.unwrap_or(base) * scale;
            }
        }
    }
}

impl Solid {
    /// Returns an object of one geom, if its numbers are those that MuJoCo computes for the geom.
    fn of(model: &Model, body: BodyId, geom: usize) -> Option<Self> {
        let form = match model.geom_shape(geom) {
            FS_BOX => Form::Box,
            FS_SPHERE => Form::Sphere,
            FS_CYLINDER => Form::Cylinder,
            _ => return None,
        };
        let node = model.array(BodyBvhadr).get(body.0).and_then(|&node| usize::try_from(node).ok());
        let solid = Self { body: body.0, geom, node, form };
        let (mass, sizes) = (model.physics(BodyMass)[body.0], solid.sizes(model.physics(GeomSize)));
        let inertia = &model.physics(BodyInertia)[3 * body.0..][..3];
        (solid.inertia(mass, sizes) == *inertia).then_some(solid)
    }

    fn sizes(&self, all: &[f64]) -> [f64; 3] {
        std::array::from_fn(|axis| all[3 * self.geom + axis])
    }

    /// Returns the inertia about the principal axes, as MuJoCo's compiler computes it.
    fn inertia(&self, mass: f64, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self.form {
            Form::Box => [
                mass * (y * y + z * z) / 3.0,
                mass * (x * x + z * z) / 3.0,
                mass * (x * x + y * y) / 3.0,
            ],
            Form::Sphere => [2.0 * mass * x * x / 5.0; 3],
            Form::Cylinder => {
                let height = 2.0 * y;
                let across = mass * (3.0 * x * x + height * height) / 12.0;
                [across, across, mass * x * x / 2.0]
            }
        }
    }

    /// Writes mass and sizes, and what MuJoCo's compiler computes from them for a body that moves
    /// freely: see `mj_setConst`.
    fn write(&self, varied: &mut VariedModel, physics: &Physics, dof: usize) {
        let Self { body, geom, node, form } = *self;
        let mass = physics.get(Factor::ObjectMass).unwrap_or(varied.base(BodyMass)[body]);
        let scale = physics.scale(Factor::ObjectSize);
        let sizes @ [x, y, z] = self.sizes(varied.base(GeomSize)).map(|size| size * scale);
        let inertia = self.inertia(mass, sizes);
        varied.array_mut(BodyMass)[body] = mass;
        varied.array_mut(BodyInertia)[3 * body..][..3].copy_from_slice(&inertia);
        varied.array_mut(GeomSize)[3 * geom..][..3].copy_from_slice(&sizes);
        let (radius, half) = match form {
            Form::Box => ((x * x + y * y + z * z).sqrt(), sizes),
            Form::Sphere => (x, [x; 3]),
            Form::Cylinder => ((x * x + y * y).sqrt(), [x, x, y]),
        };
        varied.array_mut(GeomRbound)[geom] = radius;
        let node = node.map(|node| (BvhAabb, node));
        for (array, at) in node.into_iter().chain(node.map(|_| (GeomAabb, geom))) {
            // A box around the body's center: the numbers before are the center.
            varied.array_mut(array)[6 * at + 3..][..3].copy_from_slice(&half);
        }
        let mean = |numbers: [f64; 3]| {
            let [a, b, c] = numbers.map(|number| 1.0 / number);
            (a + b + c) / 3.0
        };
        let (translation, rotation) = (mean([mass; 3]), mean(inertia));
        varied.array_mut(BodyInvweight)[2 * body..][..2].copy_from_slice(&[translation, rotation]);
        let [r0, r1, r2] = inertia;
        let m0 = [mass, mass, mass, r0, r1, r2];
        varied.array_mut(DofM0)[dof..][..FREE_DOFS].copy_from_slice(&m0);
        let [t, r] = [translation, rotation];
        varied.array_mut(DofInvweight)[dof..][..FREE_DOFS].copy_from_slice(&[t, t, t, r, r, r]);
        varied.resize_shape(geom);
    }
}

/// Writes the sums over bodies and degrees of freedom.
fn derive_totals(model: &Model, varied: &mut VariedModel) {
    let parents = model.array(BodyParentid);
    for body in 0..parents.len() {
        varied.array_mut(BodySubtreemass)[body] = varied.array_mut(BodyMass)[body];
    }
    let subtrees = varied.array_mut(BodySubtreemass);
    for body in (1..parents.len()).rev() {
        subtrees[parents[body] as usize] += subtrees[body];
    }
    let inertias = varied.array_mut(DofM0);
    let mean = inertias.iter().sum::<f64>() / inertias.len() as f64;
    varied.array_mut(Meaninertia)[0] = mean;
}

/// Returns the equality constraints of a body, of which the model of a Fetch task has one: a weld.
fn equalities_of(model: &Model, body: BodyId) -> Vec<usize> {
    let bodies = model.array(EqObj1id).iter().zip(model.array(EqObj2id)).enumerate();
    let is_of = |id: i32| usize::try_from(id) == Ok(body.0);
    bodies.filter(|&(_, (&a, &b))| is_of(a) || is_of(b)).map(|(equality, _)| equality).collect()
}

/// Returns the pairs of a geom of the first list and one of the second.
fn pairs_of(model: &Model, first: &[usize], second: &[usize]) -> Vec<usize> {
    let geoms = model.array(PairGeom1).iter().zip(model.array(PairGeom2)).enumerate();
    let touches = |a: i32, b: i32| first.contains(&(a as usize)) && second.contains(&(b as usize));
    geoms.filter(|&(_, (&a, &b))| touches(a, b) || touches(b, a)).map(|(pair, _)| pair).collect()
}
