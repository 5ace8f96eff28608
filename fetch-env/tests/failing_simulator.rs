//! What an environment does when the physics fails.

use fetch_env::{Env, EnvError, EnvId, FetchEnv, SnapshotEnv};
use fetch_sim::{
    Control, GripperState, KinematicSimulator, ObjectState, Settled, SimError, Simulator, Task,
};

/// Becomes unstable where the gripper is told to go down.
struct Fragile(KinematicSimulator);

impl Simulator for Fragile {
    type Snapshot = KinematicSimulator;

    fn task(&self) -> Task {
        self.0.task()
    }

    fn control_period(&self) -> f64 {
        self.0.control_period()
    }

    fn settled(&self) -> Settled {
        self.0.settled()
    }

    fn reset(&mut self, object_xy: Option<[f64; 2]>) -> Result<(), SimError> {
        self.0.reset(object_xy)
    }

    fn step(&mut self, control: &Control) -> Result<(), SimError> {
        self.0.step(control)?;
        if control.displacement.z < 0.0 { Err(unstable()) } else { Ok(()) }
    }

    fn gripper(&self) -> GripperState {
        self.0.gripper()
    }

    fn object(&self) -> Option<ObjectState> {
        self.0.object()
    }

    fn snapshot(&self) -> KinematicSimulator {
        self.0.snapshot()
    }

    fn restore(&mut self, snapshot: &KinematicSimulator) -> Result<(), SimError> {
        self.0.restore(snapshot)
    }
}

fn unstable() -> SimError {
    SimError::Unstable { reason: "told to go down".into() }
}

#[test]
fn a_failed_step_is_an_error_and_asks_for_a_reset() {
    for id in EnvId::ALL {
        let config = id.config();
        let simulator = Fragile(KinematicSimulator::new(config.sim()));
        let mut env = FetchEnv::new(config, simulator).expect("it fits").time_limited();
        env.reset(Some(0)).expect("a reset");
        let good = env.snapshot();
        for recover in 0..2 {
            env.step(&[0.0; 4]).expect("a step");
            let failure = env.step(&[0.0, 0.0, -1.0, 0.0]);
            assert_eq!(failure, Err(EnvError::Sim(unstable())), "{id}");
            for _ in 0..2 {
                assert_eq!(env.step(&[0.0; 4]), Err(EnvError::ResetNeeded), "{id}");
            }
            assert_eq!(env.inner().observe(), Err(EnvError::ResetNeeded), "{id}");
            if recover == 0 {
                env.restore(&good).expect("its own snapshot");
            } else {
                env.reset(None).expect("a reset");
            }
            assert_eq!(env.elapsed_steps(), 0);
            env.step(&[0.0; 4]).expect("a step");
        }
    }
}
