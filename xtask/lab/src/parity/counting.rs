//! A simulator that counts contacts.

use fetch_sim::{BodyId, Control, MujocoSimulator, SimError};
use testing::{Delegating, OnStep};

/// MuJoCo's simulator, which sums the contacts of the last step over its substeps.
pub type Counting = Delegating<MujocoSimulator, Contacts>;

/// The contacts of the last step, summed over its substeps.
#[derive(Debug)]
pub struct Contacts {
    base: BodyId,
    pub all: usize,
    /// Contacts between two parts of the robot.
    pub of_robot: usize,
}

/// Returns a simulator that counts its contacts.
pub fn counting(simulator: MujocoSimulator) -> Result<Counting, SimError> {
    let base = simulator.fetch_model().model().body("robot0:base_link")?;
    Ok(Delegating { simulator, on_step: Contacts { base, all: 0, of_robot: 0 } })
}

impl OnStep<MujocoSimulator> for Contacts {
    fn step(&mut self, simulator: &mut MujocoSimulator, control: &Control) -> Result<(), SimError> {
        (self.all, self.of_robot) = (0, 0);
        simulator.step_inspected(control, |data| {
            let model = data.model();
            let of_robot = |geom| {
                model.geom_body(geom).and_then(|body| model.is_within(body, self.base)) == Ok(true)
            };
            self.all += data.contacts().count();
            self.of_robot += data.contacts().filter(|&(a, b)| of_robot(a) && of_robot(b)).count();
        })
    }
}
