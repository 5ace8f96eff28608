//! The MuJoCo implementation of the simulator trait, and its snapshot.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::fetch_model::{FetchModel, GRIPPER_DOWN, ObjectIds};
use crate::mujoco::binding::{data::Data, ids::SiteId, poses::Pose, version::MujocoVersion};
use crate::{
    bounds::{check_object_position, first_outside},
    config::SimConfig,
    error::SimError,
    simulator::{Control, GripperState, ObjectState, Settled, Simulator},
    task::Task,
};

/// A Fetch robot simulated by MuJoCo, with the same steps as the reference.
#[derive(Debug)]
pub struct MujocoSimulator {
    fetch: Arc<FetchModel>,
    data: Data,
    /// Room for one site's Jacobians, `[3][nv]` each.
    jacobians: [Vec<f64>; 2],
    gripper: GripperState,
    object: Option<ObjectState>,
}

/// The complete state of a [`MujocoSimulator`].
///
/// In addition to MuJoCo's integration state it holds the derived quantities that outlive a step,
/// as the last step computed them: the next action starts from the gripper's pose, and the
/// environment observes the states. Those of PickAndPlace are one substep older than `qpos`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MujocoSnapshot {
    config: SimConfig,
    mujoco: String,
    time: f64,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    ctrl: Vec<f64>,
    qacc_warmstart: Vec<f64>,
    mocap_pose: Pose,
    gripper_link_pose: Pose,
    gripper: GripperState,
    object: Option<ObjectState>,
}

impl MujocoSimulator {
    /// Loads a model, and creates a simulator of it in the settled state.
    ///
    /// # Errors
    /// As [`FetchModel::load`].
    pub fn new(config: &SimConfig) -> Result<Self, SimError> {
        Self::from_model(FetchModel::load(config)?)
    }

    /// Creates a simulator of a model that it may share with others.
    ///
    /// # Errors
    /// [`SimError::Mujoco`] if memory runs out.
    pub fn from_model(fetch: Arc<FetchModel>) -> Result<Self, SimError> {
        let mut data = Data::new(Arc::clone(fetch.model()))?;
        data.set_contact_filter(fetch.config.contact_filter())?;
        let jacobian = vec![0.0; 3 * fetch.model().nv()];
        let mut simulator = Self {
            fetch,
            data,
            jacobians: [jacobian.clone(), jacobian],
            gripper: GripperState::default(),
            object: None,
        };
        simulator.reset(None)?;
        Ok(simulator)
    }

    /// Returns the model, which more simulators can share.
    #[must_use]
    pub const fn fetch_model(&self) -> &Arc<FetchModel> {
        &self.fetch
    }

    /// Returns the underlying simulation.
    #[must_use]
    pub const fn data(&self) -> &Data {
        &self.data
    }

    /// Returns the underlying simulation mutably, for what a [`Simulator`] cannot do, such as
    /// checking the contact filter. The next step starts from the positions and velocities set
    /// here.
    #[must_use]
    pub const fn data_mut(&mut self) -> &mut Data {
        &mut self.data
    }

    /// Does a [`step`](Simulator::step) and calls `inspect` with the simulation after every
    /// substep.
    ///
    /// # Errors
    /// As [`step`](Simulator::step).
    pub fn step_inspected(
        &mut self,
        control: &Control,
        mut inspect: impl FnMut(&Data),
    ) -> Result<(), SimError> {
        self.command(control)?;
        for _ in 0..self.fetch.config.n_substeps().get() {
            self.data.step(1)?;
            inspect(&self.data);
        }
        self.finish_step()
    }

    /// Moves the mocap body, and sets the fingers' targets if there are actuators.
    fn command(&mut self, control: &Control) -> Result<(), SimError> {
        control.check()?;
        let ids = &self.fetch.ids;
        // The mocap body starts from where the gripper is, not from its previous target.
        let (position, orientation) = self.data.body_pose(ids.gripper_link)?;
        self.data.set_mocap_pose(
            ids.mocap,
            position + control.displacement,
            // Added, not multiplied, and not normalized, as in the reference.
            orientation + GRIPPER_DOWN,
        )?;
        for (actuator, &qpos) in ids.actuated_qpos.iter().enumerate() {
            self.data.ctrl_mut()[actuator] = self.data.qpos()[qpos] + control.fingers;
        }
        Ok(())
    }

    fn finish_step(&mut self) -> Result<(), SimError> {
        if self.fetch.config.task().block_gripper() {
            for finger in self.fetch.ids.fingers {
                self.data.qpos_mut()[finger.qpos] = 0.0;
            }
            // This also changes the solver's warm start, so the next step depends on it.
            self.data.forward()?;
        }
        self.observe()
    }

    fn observe(&mut self) -> Result<(), SimError> {
        let fetch = Arc::clone(&self.fetch);
        let (velocity, _) = self.site_velocity(fetch.ids.grip)?;
        self.gripper = GripperState {
            position: self.data.site_position(fetch.ids.grip)?,
            velocity,
            finger_positions: fetch.ids.fingers.map(|finger| self.data.qpos()[finger.qpos]),
            finger_velocities: fetch.ids.fingers.map(|finger| self.data.qvel()[finger.dof]),
        };
        let mut object = |object: ObjectIds| -> Result<_, SimError> {
            let (linear_velocity, angular_velocity) = self.site_velocity(object.site)?;
            Ok(ObjectState {
                position: self.data.site_position(object.site)?,
                rotation: self.data.site_rotation(object.site)?,
                linear_velocity,
                angular_velocity,
            })
        };
        self.object = fetch.ids.object.map(&mut object).transpose()?;
        Ok(())
    }

    /// Returns the linear and angular velocity of a site: its Jacobians, as old as its position,
    /// times `qvel`.
    fn site_velocity(&mut self, site: SiteId) -> Result<(Vector3<f64>, Vector3<f64>), SimError> {
        let [translation, rotation] = &mut self.jacobians;
        self.data.site_jacobian(site, translation, rotation)?;
        let qvel = self.data.qvel();
        let times_qvel = |jacobian: &[f64]| {
            Vector3::from_iterator(
                jacobian
                    .chunks_exact(qvel.len())
                    .map(|row| row.iter().zip(qvel).map(|(j, v)| j * v).sum()),
            )
        };
        Ok((times_qvel(translation), times_qvel(rotation)))
    }

    fn check_snapshot(&self, snapshot: &MujocoSnapshot) -> Result<(), SimError> {
        let foreign = |reason: String| Err(SimError::ForeignSnapshot { reason });
        let config = &self.fetch.config;
        if !snapshot.config.same_physics(config) {
            return foreign(format!("it is of {:?}, this is of {config:?}", snapshot.config));
        }
        let version = MujocoVersion::of_shim().to_string();
        if snapshot.mujoco != version {
            return foreign(format!("it is of MuJoCo {}, this is of {version}", snapshot.mujoco));
        }
        let fits = snapshot.qpos.len() == self.data.qpos().len()
            && snapshot.qvel.len() == self.data.qvel().len()
            && snapshot.qacc_warmstart.len() == self.data.qacc_warmstart().len()
            && snapshot.ctrl.len() == self.data.ctrl().len()
            && snapshot.object.is_some() == config.task().has_object();
        if !fits {
            return foreign("its arrays have other lengths".into());
        }
        match first_outside(snapshot.numbers()) {
            None => Ok(()),
            Some(number) => foreign(format!("it has the number {number}")),
        }
    }

    /// Returns to a snapshot that has passed the check.
    fn return_to(&mut self, snapshot: &MujocoSnapshot) -> Result<(), SimError> {
        let ids = &self.fetch.ids;
        self.data.reset()?;
        self.data.set_time(snapshot.time)?;
        self.data.qpos_mut().copy_from_slice(&snapshot.qpos);
        self.data.qvel_mut().copy_from_slice(&snapshot.qvel);
        self.data.ctrl_mut().copy_from_slice(&snapshot.ctrl);
        let (position, orientation) = snapshot.mocap_pose;
        self.data.set_mocap_pose(ids.mocap, position, orientation)?;
        self.data.forward()?;
        // `forward` has recomputed what the next step starts from: overwrite it with the
        // snapshot's. That includes the object's quaternion, because normalizing it twice changes
        // its bits.
        self.data.qpos_mut().copy_from_slice(&snapshot.qpos);
        self.data.qacc_warmstart_mut().copy_from_slice(&snapshot.qacc_warmstart);
        self.data.set_body_pose(ids.gripper_link, snapshot.gripper_link_pose)?;
        self.gripper = snapshot.gripper;
        self.object = snapshot.object;
        Ok(())
    }
}

impl MujocoSnapshot {
    fn numbers(&self) -> impl Iterator<Item = &f64> {
        let poses = [&self.mocap_pose, &self.gripper_link_pose].into_iter();
        [&self.qpos, &self.qvel, &self.ctrl, &self.qacc_warmstart]
            .into_iter()
            .flatten()
            .chain([&self.time])
            .chain(poses.flat_map(|(at, orientation)| at.iter().chain(&orientation.coords)))
            .chain(self.gripper.numbers())
            .chain(self.object.iter().flat_map(ObjectState::numbers))
    }
}

impl Simulator for MujocoSimulator {
    type Snapshot = MujocoSnapshot;

    fn task(&self) -> Task {
        self.fetch.config.task()
    }

    fn control_period(&self) -> f64 {
        f64::from(self.fetch.config.n_substeps().get()) * self.fetch.model().timestep()
    }

    fn settled(&self) -> Settled {
        self.fetch.settled
    }

    fn reset(&mut self, object_xy: Option<[f64; 2]>) -> Result<(), SimError> {
        let fetch = &*self.fetch;
        if object_xy.is_some() && fetch.ids.object.is_none() {
            return Err(SimError::NoObject { task: self.task() });
        }
        object_xy.map_or(Ok(()), check_object_position)?;
        self.data.reset()?;
        self.data.set_time(fetch.start_time)?;
        self.data.qpos_mut().copy_from_slice(&fetch.start_qpos);
        self.data.qvel_mut().copy_from_slice(&fetch.start_qvel);
        if let (Some(object), Some(xy)) = (fetch.ids.object, object_xy) {
            self.data.qpos_mut()[object.qpos..][..2].copy_from_slice(&xy);
        }
        self.data.forward()?;
        self.observe()
    }

    fn step(&mut self, control: &Control) -> Result<(), SimError> {
        self.command(control)?;
        self.data.step(self.fetch.config.n_substeps().get())?;
        self.finish_step()
    }

    fn gripper(&self) -> GripperState {
        self.gripper
    }

    fn object(&self) -> Option<ObjectState> {
        self.object
    }

    fn snapshot(&self) -> MujocoSnapshot {
        let ids = &self.fetch.ids;
        MujocoSnapshot {
            config: self.fetch.config.clone(),
            mujoco: MujocoVersion::of_shim().to_string(),
            time: self.data.time(),
            qpos: self.data.qpos().to_vec(),
            qvel: self.data.qvel().to_vec(),
            ctrl: self.data.ctrl().to_vec(),
            qacc_warmstart: self.data.qacc_warmstart().to_vec(),
            mocap_pose: self.data.mocap_pose(ids.mocap).expect("an id of this model"),
            gripper_link_pose: self.data.body_pose(ids.gripper_link).expect("an id of this model"),
            gripper: self.gripper,
            object: self.object,
        }
    }

    fn restore(&mut self, snapshot: &MujocoSnapshot) -> Result<(), SimError> {
        self.check_snapshot(snapshot)?;
        let before = self.snapshot();
        self.return_to(snapshot).inspect_err(|_| {
            // MuJoCo refuses some states of valid numbers. It takes its own state back, unless a
            // step has failed in it; then a reset is due anyway.
            let _ = self.return_to(&before);
        })
    }
}
