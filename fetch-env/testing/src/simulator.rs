//! Simulators whose steps do something else, or something more.

use fetch_sim::{
    Control, GripperState, KinematicSimulator, ObjectState, Settled, SimConfig, SimError,
    Simulator, Task,
};
use nalgebra::{UnitQuaternion, Vector3};

/// What a [`Delegating`] simulator does in a step.
pub trait OnStep<S> {
    /// Steps `simulator`.
    ///
    /// # Errors
    /// The errors of the step.
    fn step(&mut self, simulator: &mut S, control: &Control) -> Result<(), SimError>;
}

/// A simulator whose steps are those of `on_step`; everything else goes to `simulator`.
#[derive(Debug)]
pub struct Delegating<S, H> {
    /// The simulator that is stepped.
    pub simulator: S,
    /// What a step does.
    pub on_step: H,
}

impl<S: Simulator, H: OnStep<S>> Simulator for Delegating<S, H> {
    type Snapshot = S::Snapshot;

    fn task(&self) -> Task {
        self.simulator.task()
    }

    fn control_period(&self) -> f64 {
        self.simulator.control_period()
    }

    fn settled(&self) -> Settled {
        self.simulator.settled()
    }

    fn reset(&mut self, object_xy: Option<[f64; 2]>) -> Result<(), SimError> {
        self.simulator.reset(object_xy)
    }

    fn place_task_object(
        &mut self,
        position: Vector3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> Result<(), SimError> {
        self.simulator.place_task_object(position, orientation)
    }

    fn step(&mut self, control: &Control) -> Result<(), SimError> {
        self.on_step.step(&mut self.simulator, control)
    }

    fn gripper(&self) -> GripperState {
        self.simulator.gripper()
    }

    fn object(&self) -> Option<ObjectState> {
        self.simulator.object()
    }

    fn snapshot(&self) -> S::Snapshot {
        self.simulator.snapshot()
    }

    fn restore(&mut self, snapshot: &S::Snapshot) -> Result<(), SimError> {
        self.simulator.restore(snapshot)
    }
}

/// The result of a step in which the gripper goes down.
pub type Fault = fn() -> Result<(), SimError>;

/// The kinematic simulator with a fault.
pub type Faulty = Delegating<KinematicSimulator, Fault>;

impl Faulty {
    /// Creates a simulator with a fault.
    #[must_use]
    pub fn new(config: &SimConfig, fault: Fault) -> Self {
        Self { simulator: KinematicSimulator::new(config), on_step: fault }
    }
}

impl OnStep<KinematicSimulator> for Fault {
    fn step(
        &mut self,
        simulator: &mut KinematicSimulator,
        control: &Control,
    ) -> Result<(), SimError> {
        simulator.step(control)?;
        if control.displacement.z < 0.0 { self() } else { Ok(()) }
    }
}
