//! The MuJoCo implementation of the simulator trait.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use super::{
    bodies::{FREE, Placed, Shown},
    data_mut::DataMut,
    fetch_model::{FetchModel, GRIPPER_DOWN},
    observer::{Frame, Observer, still_state},
    snapshot::MujocoSnapshot,
};
use crate::mujoco::binding::{data::Data, poses::Pose, version::MujocoVersion};
use crate::{
    bounds::{check_inside, check_object_position},
    config::SimConfig,
    error::SimError,
    physics::{Physics, PhysicsFactor},
    simulator::{Control, GripperState, ObjectState, Settled, Simulator},
    task::Task,
};

/// A Fetch robot simulated by MuJoCo, with the same steps as the reference.
#[derive(Debug)]
pub struct MujocoSimulator {
    fetch: Arc<FetchModel>,
    data: Data,
    observer: Observer,
    gripper: GripperState,
    object: Option<ObjectState>,
    /// The states of the model's other bodies that move.
    moving: Vec<ObjectState>,
    /// What differs from the model's physics.
    physics: Physics,
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
    /// [`SimError::NoMemory`].
    pub fn from_model(fetch: Arc<FetchModel>) -> Result<Self, SimError> {
        let mut data = Data::new(Arc::clone(fetch.model()))?;
        data.set_contact_filter(fetch.config.contact_filter())?;
        let mut simulator = Self {
            observer: Observer::new(fetch.model().nv()),
            moving: vec![ObjectState::default(); fetch.bodies.moving.len()],
            fetch,
            data,
            gripper: GripperState::default(),
            object: None,
            physics: Physics::default(),
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
    pub const fn data_mut(&mut self) -> DataMut<'_> {
        DataMut(&mut self.data)
    }

    /// Iterates over the names of the bodies that [`object_state`](Self::object_state) shows.
    pub fn object_names(&self) -> impl Iterator<Item = &str> {
        self.fetch.bodies.objects()
    }

    /// Returns the state of a body of the scene, as [`object`](Simulator::object) shows the task's
    /// object: of the site on the body that has its name, or else of the body's frame. Use it for
    /// additional objects of your own model.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has no body of this name, [`SimError::UnfitBody`] if
    /// it is a part of the robot.
    pub fn object_state(&self, name: &str) -> Result<ObjectState, SimError> {
        let body = self.fetch.bodies.get(name)?;
        match body.shown {
            Shown::Object => self.object.ok_or(SimError::NoObject { task: self.task() }),
            Shown::Moving(index) => Ok(self.moving[index]),
            Shown::Still(frame) => still_state(&self.data, frame),
            Shown::Robot => Err(body.unfit(
                "is a part of the robot: use `gripper()`, or `data().body_pose()`, which may show \
                 a link one substep later after a restored snapshot",
            )),
        }
    }

    /// Places a body that has a free joint, at rest, or a mocap body, such as a wall. `position`
    /// (meters) and `orientation` are those of the body's frame in the world frame.
    ///
    /// Everything shown afterwards is up to date, even what a step leaves one substep old. A reset
    /// takes free bodies back to where they settled, and mocap bodies to where the model has them.
    ///
    /// ```
    /// use fetch_sim::{Extension, ModelSource, MujocoSimulator, SimConfig, Simulator, Task};
    /// use nalgebra::{UnitQuaternion, Vector3};
    ///
    /// let wall = Extension::default().with_xml(
    ///     r#"<worldbody>
    ///          <body name="wall" mocap="true"><geom type="box" size="0.01 0.1 0.05"/></body>
    ///        </worldbody>"#,
    /// );
    /// let config = SimConfig::new(Task::Push).with_model(ModelSource::Extended(wall));
    /// # #[cfg(not(fetch_sim_no_shim))] {
    /// let mut simulator = MujocoSimulator::new(&config)?;
    /// simulator.reset(Some([1.30, 0.60]))?;
    /// let across = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.5);
    /// simulator.place_object("wall", Vector3::new(1.35, 0.75, 0.45), across)?;
    /// assert_eq!(simulator.object_state("wall")?.position.x, 1.35);
    /// # }
    /// # Ok::<(), fetch_sim::SimError>(())
    /// ```
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has no body of this name, [`SimError::UnfitBody`] if
    /// it cannot be placed, [`SimError::OutOfRange`] if a number is NaN or exceeds
    /// [`LARGEST_NUMBER`](crate::LARGEST_NUMBER); the simulation is then unchanged. Otherwise as
    /// [`Data::forward`].
    pub fn place_object(
        &mut self,
        name: &str,
        position: Vector3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> Result<(), SimError> {
        self.place(self.fetch.bodies.get(name)?.placed()?, position, orientation)
    }

    fn place(
        &mut self,
        placed: Placed,
        position: Vector3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> Result<(), SimError> {
        check_inside("the pose of a body", position.iter().chain(&orientation.coords))?;
        match placed {
            Placed::Joint { qpos, dof } => {
                let ([x, y, z], q) = (position.into(), orientation);
                let coordinates: [f64; FREE] = [x, y, z, q.w, q.i, q.j, q.k];
                self.data.qpos_mut()[qpos..][..FREE].copy_from_slice(&coordinates);
                self.data.qvel_mut()[dof..][..6].fill(0.0);
            }
            Placed::Mocap(mocap) => {
                self.data.set_mocap_pose(mocap, position, orientation.into_inner())?;
            }
        }
        self.data.forward()?;
        self.observe()
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
        let (velocity, _) = self.observer.velocity(&self.data, Frame::Site(fetch.ids.grip))?;
        self.gripper = GripperState {
            position: self.data.site_position(fetch.ids.grip)?,
            velocity,
            finger_positions: fetch.ids.fingers.map(|finger| self.data.qpos()[finger.qpos]),
            finger_velocities: fetch.ids.fingers.map(|finger| self.data.qvel()[finger.dof]),
        };
        let mut observe = |frame| self.observer.state(&self.data, frame);
        self.object =
            fetch.ids.object.map(|object| observe(Frame::Site(object.site))).transpose()?;
        for (state, &frame) in self.moving.iter_mut().zip(&fetch.bodies.moving) {
            *state = observe(frame)?;
        }
        Ok(())
    }

    fn set_mocap_poses(&mut self, poses: &[Pose]) -> Result<(), SimError> {
        let mut poses = poses.iter().enumerate();
        poses.try_for_each(|(mocap, &(position, orientation))| {
            self.data.set_mocap_pose(mocap, position, orientation)
        })
    }

    /// Changes the physics. The simulation must then be reset.
    fn set_physics(&mut self, physics: &Physics) -> Result<(), SimError> {
        if self.physics == *physics {
            return Ok(());
        }
        let FetchModel { places, model, .. } = &*self.fetch;
        self.data.vary(|varied| places.write(model, varied, physics))?;
        self.physics = *physics;
        Ok(())
    }

    /// Returns to a snapshot that has passed the check.
    fn return_to(&mut self, snapshot: &MujocoSnapshot) -> Result<(), SimError> {
        self.set_physics(&snapshot.physics)?;
        self.data.reset()?;
        self.data.set_time(snapshot.time)?;
        self.data.qpos_mut().copy_from_slice(&snapshot.qpos);
        self.data.qvel_mut().copy_from_slice(&snapshot.qvel);
        self.data.ctrl_mut().copy_from_slice(&snapshot.ctrl);
        self.data.act_mut().copy_from_slice(&snapshot.act);
        self.set_mocap_poses(&snapshot.mocap_poses)?;
        self.data.forward()?;
        // `forward` has recomputed what the next step starts from: overwrite it with the
        // snapshot's. That includes quaternions, because normalizing them twice changes their bits.
        self.set_mocap_poses(&snapshot.mocap_poses)?;
        self.data.qpos_mut().copy_from_slice(&snapshot.qpos);
        self.data.qacc_warmstart_mut().copy_from_slice(&snapshot.qacc_warmstart);
        self.data.set_body_pose(self.fetch.ids.gripper_link, snapshot.gripper_link_pose)?;
        self.gripper = snapshot.gripper;
        self.object = snapshot.object;
        self.moving.copy_from_slice(&snapshot.moving);
        Ok(())
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
        self.reset_varied(object_xy, &Physics::default())
    }

    fn can_vary(&self, factor: PhysicsFactor) -> Result<(), SimError> {
        self.fetch.places.check(factor)
    }

    fn physics(&self) -> Physics {
        self.physics
    }

    fn reset_varied(
        &mut self,
        object_xy: Option<[f64; 2]>,
        physics: &Physics,
    ) -> Result<(), SimError> {
        physics.iter().try_for_each(|(factor, _)| self.can_vary(factor))?;
        let fetch = Arc::clone(&self.fetch);
        if object_xy.is_some() && fetch.ids.object.is_none() {
            return Err(SimError::NoObject { task: self.task() });
        }
        object_xy.map_or(Ok(()), check_object_position)?;
        self.set_physics(physics)?;
        self.data.reset()?;
        self.data.set_time(fetch.start_time)?;
        self.data.qpos_mut().copy_from_slice(&fetch.start_qpos);
        self.data.qvel_mut().copy_from_slice(&fetch.start_qvel);
        if let Some(object) = fetch.ids.object {
            let position = &mut self.data.qpos_mut()[object.qpos..];
            if let Some(xy) = object_xy {
                position[..2].copy_from_slice(&xy);
            }
            position[2] += fetch.places.raised_by(&fetch.model, physics);
        }
        self.data.forward()?;
        self.observe()
    }

    fn place_task_object(
        &mut self,
        position: Vector3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> Result<(), SimError> {
        let no_object = SimError::NoObject { task: self.task() };
        let placed = self.fetch.bodies.object().ok_or(no_object)?.placed()?;
        self.place(placed, position, orientation)
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
        let mocap_pose = |mocap| self.data.mocap_pose(mocap).expect("an id of this model");
        MujocoSnapshot {
            config: self.fetch.config.clone(),
            mujoco: MujocoVersion::of_shim().to_string(),
            time: self.data.time(),
            qpos: self.data.qpos().to_vec(),
            qvel: self.data.qvel().to_vec(),
            ctrl: self.data.ctrl().to_vec(),
            act: self.data.act().to_vec(),
            qacc_warmstart: self.data.qacc_warmstart().to_vec(),
            mocap_poses: (0..self.data.model().nmocap()).map(mocap_pose).collect(),
            gripper_link_pose: self.data.body_pose(ids.gripper_link).expect("an id of this model"),
            gripper: self.gripper,
            object: self.object,
            moving: self.moving.clone(),
            physics: self.physics,
        }
    }

    fn restore(&mut self, snapshot: &MujocoSnapshot) -> Result<(), SimError> {
        snapshot.check(&self.fetch.config, &self.data, self.moving.len())?;
        let varies = |(factor, _)| self.can_vary(factor);
        snapshot
            .physics
            .iter()
            .try_for_each(varies)
            .map_err(|error| SimError::ForeignSnapshot { reason: error.to_string() })?;
        let before = self.snapshot();
        self.return_to(snapshot).inspect_err(|_| {
            // MuJoCo refuses some states of valid numbers. It takes its own state back, unless a
            // step has failed in it, in which case a reset is due anyway.
            let _ = self.return_to(&before);
        })
    }
}
