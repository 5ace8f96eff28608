//! A simulator with a fault.

use fetch_sim::{
    Control, GripperState, KinematicSimulator, ObjectState, Settled, SimConfig, SimError,
    Simulator, Task,
};

/// The result of a step in which the gripper goes down.
pub(crate) type Fault = fn() -> Result<(), SimError>;

/// The stand-in with a fault.
pub(crate) struct Faulty {
    simulator: KinematicSimulator,
    fault: Fault,
}

impl Faulty {
    pub(crate) fn new(config: &SimConfig, fault: Fault) -> Self {
        Self { simulator: KinematicSimulator::new(config), fault }
    }
}

impl Simulator for Faulty {
    type Snapshot = KinematicSimulator;

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

    fn step(&mut self, control: &Control) -> Result<(), SimError> {
        self.simulator.step(control)?;
        if control.displacement.z < 0.0 { (self.fault)() } else { Ok(()) }
    }

    fn gripper(&self) -> GripperState {
        self.simulator.gripper()
    }

    fn object(&self) -> Option<ObjectState> {
        self.simulator.object()
    }

    fn snapshot(&self) -> KinematicSimulator {
        self.simulator.snapshot()
    }

    fn restore(&mut self, snapshot: &KinematicSimulator) -> Result<(), SimError> {
        self.simulator.restore(snapshot)
    }
}
