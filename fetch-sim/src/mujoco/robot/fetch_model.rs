//! The model of a Fetch task: ids and settled state.

use std::sync::Arc;

use nalgebra::{Quaternion, Vector3};

use super::{
    bodies::Bodies,
    names::{AXIS, Ids, MOCAP, address},
    scene,
    vary::Places,
};
use crate::mujoco::binding::{data::Data, model::Model};
use crate::{assets::ModelSource, config::SimConfig, error::SimError, simulator::Settled};

/// Orientation of the gripper, pointing down: deliberately not of unit length, as in the reference.
pub(crate) const GRIPPER_DOWN: Quaternion<f64> = Quaternion::new(1.0, 0.0, 1.0, 0.0);

/// First displacement of the gripper from where the joints put it (meters).
const GRIPPER_OFFSET: Vector3<f64> = Vector3::new(-0.498, 0.005, -0.431);

/// Height of the table, in meters.
const TABLE_TOP: f64 = 0.4;

const BASE_JOINTS: [&str; 3] = ["robot0:slide0", "robot0:slide1", "robot0:slide2"];

/// Control steps during which the scene settles.
const SETTLING_STEPS: u32 = 10;

/// Room for constraints in each simulation on MuJoCo 2: twice the maximum (144) observed when the
/// gripper is driven into the table and the object. A step that needs more is an error. MuJoCo's
/// own default, 500, takes 2 MB more memory, all of which each reset writes.
const MAX_CONSTRAINTS: u16 = 288;

/// Room on the stack of each simulation on MuJoCo 2, in numbers: 2 MiB instead of 10.7 MB.
const MAX_STACK: u32 = 1 << 18;

/// A compiled model of a Fetch task, with the ids and the settled state, which are computed once.
/// Share it through an `Arc` to make many simulators cheaply.
#[derive(Debug)]
pub struct FetchModel {
    pub(crate) config: SimConfig,
    pub(crate) model: Arc<Model>,
    pub(crate) ids: Ids,
    pub(super) bodies: Bodies,
    /// Where the numbers are that may vary.
    pub(super) places: Places,
    pub(crate) settled: Settled,
    /// The time after a reset, in seconds.
    pub(crate) start_time: f64,
    pub(crate) start_qpos: Vec<f64>,
    pub(crate) start_qvel: Vec<f64>,
}

impl FetchModel {
    /// Compiles the configured model and lets it settle.
    ///
    /// # Errors
    /// [`SimError::NoAssets`] if the model's files are missing, [`SimError::Model`] if it cannot be
    /// compiled, [`SimError::MissingName`] or [`SimError::UnfitModel`] if it is not a model of the
    /// task, [`SimError::OutOfRange`] or [`SimError::NoObject`] if an
    /// [`Extension`](crate::Extension) does not fit, [`SimError::Library`],
    /// [`SimError::BuiltWithoutMujoco`] or [`SimError::ShimMismatch`] if MuJoCo cannot be used.
    pub fn load(config: &SimConfig) -> Result<Arc<Self>, SimError> {
        Self::settle(scene::load(config, scene::PHYSICS)?, config).map(Arc::new)
    }

    /// Returns the settings of the model.
    pub const fn config(&self) -> &SimConfig {
        &self.config
    }

    /// Returns the compiled model.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Returns the state after a reset: positions (`nq`) and velocities (`nv`).
    #[must_use]
    pub fn start(&self) -> (&[f64], &[f64]) {
        (&self.start_qpos, &self.start_qvel)
    }

    /// Does what the reference does when it is constructed: sets joints and welds, moves the
    /// gripper once, and simulates 200 time steps.
    fn settle(mut model: Model, config: &SimConfig) -> Result<Self, SimError> {
        // Other models have the room that MuJoCo gives them, or that they ask for.
        if matches!(config.model(), ModelSource::Builtin | ModelSource::Reference) {
            model.limit_sizes(MAX_CONSTRAINTS, MAX_STACK);
        }
        let mocap = model.body(MOCAP)?;
        // The weld holds the gripper at the mocap body's pose. The offset is 0, and only the real
        // part of the orientation is overwritten, because the reference's numbers are meant for an
        // older layout of a weld's data.
        model.set_weld_data(mocap.0, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let model = Arc::new(model);
        let spec = config.task().spec();
        let ids = Ids::resolve(&model, mocap, config.task())?;
        let object = ids.object.map(|object| object.joint);
        let bodies = Bodies::resolve(&model, ids.gripper_link, mocap, object)?;
        let mut data = Data::new(Arc::clone(&model))?;
        for (joint, value) in BASE_JOINTS.into_iter().zip(spec.base_position) {
            data.qpos_mut()[address(&model, model.joint(joint)?, AXIS)?.qpos] = value;
        }
        if let (Some(ids), Some(object)) = (ids.object, spec.object) {
            let [x, y, mut z] = object.dropped_at;
            if let ModelSource::Extended(extension) = config.model()
                && let Some(shape) = extension.object_shape()
            {
                z = TABLE_TOP + shape.half_height();
            }
            data.qpos_mut()[ids.qpos..][..7].copy_from_slice(&[x, y, z, 1.0, 0.0, 0.0, 0.0]);
        }
        data.forward()?;
        let offset = GRIPPER_OFFSET + Vector3::new(0.0, 0.0, spec.gripper_extra_height);
        data.set_mocap_pose(ids.mocap, offset + data.site_position(ids.grip)?, GRIPPER_DOWN)?;
        for _ in 0..SETTLING_STEPS {
            data.step(config.n_substeps().get())?;
        }
        let object = ids.object.map(|object| data.site_position(object.site)).transpose()?;
        let settled = Settled {
            gripper_position: data.site_position(ids.grip)?,
            object_height: object.map(|position| position.z),
        };
        Ok(Self {
            config: config.clone(),
            places: Places::resolve(&model, &ids)?,
            model,
            ids,
            bodies,
            settled,
            start_time: data.time(),
            start_qpos: data.qpos().to_vec(),
            start_qvel: data.qvel().to_vec(),
        })
    }
}
