//! A simulator that counts contacts.

use fetch_sim::{
    BodyId, Control, GripperState, MujocoSimulator, MujocoSnapshot, ObjectState, Settled, SimError,
    Simulator, Task,
};

/// MuJoCo's simulator, which sums the contacts of the last step over its substeps.
#[derive(Debug)]
pub struct Counting {
    pub simulator: MujocoSimulator,
    base: BodyId,
    pub contacts: usize,
    /// Contacts between two parts of the robot.
    pub self_contacts: usize,
}

impl Counting {
    pub fn new(simulator: MujocoSimulator) -> Result<Self, SimError> {
        let base = simulator.fetch_model().model().body("robot0:base_link")?;
        Ok(Self { simulator, base, contacts: 0, self_contacts: 0 })
    }
}

impl Simulator for Counting {
    type Snapshot = MujocoSnapshot;

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
        (self.contacts, self.self_contacts) = (0, 0);
        self.simulator.step_inspected(control, |data| {
            let model = data.model();
            let of_robot = |geom| {
                model.geom_body(geom).and_then(|body| model.is_within(body, self.base)) == Ok(true)
            };
            self.contacts += data.contacts().len();
            self.self_contacts +=
                data.contacts().filter(|&(a, b)| of_robot(a) && of_robot(b)).count();
        })
    }

    fn gripper(&self) -> GripperState {
        self.simulator.gripper()
    }

    fn object(&self) -> Option<ObjectState> {
        self.simulator.object()
    }

    fn snapshot(&self) -> MujocoSnapshot {
        self.simulator.snapshot()
    }

    fn restore(&mut self, snapshot: &MujocoSnapshot) -> Result<(), SimError> {
        self.simulator.restore(snapshot)
    }
}
