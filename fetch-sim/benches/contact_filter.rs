//! A control step of 20 substeps with and without the contact filter: bit-equal trajectories of
//! random actions, and of the gripper pressed onto the object or the table.
//!
//! `cargo bench -p fetch-sim --bench contact_filter`; skips the reference's model if it is missing.

use std::{hint::black_box, sync::Arc};

use criterion::{Criterion, criterion_group, criterion_main};
use fetch_sim::{
    Control, FetchModel, ModelSource, MujocoSimulator, SimConfig, SimError, Simulator, Task,
};
use nalgebra::Vector3;

const EPISODE: u32 = 50;

struct Run {
    simulator: MujocoSimulator,
    /// Whether the gripper moves down onto the object or the table, and not in a different
    /// direction in every step.
    presses: bool,
    step: u32,
}

impl Run {
    fn new(model: &Arc<FetchModel>, filter: bool, presses: bool) -> Result<Self, SimError> {
        let mut simulator = MujocoSimulator::from_model(Arc::clone(model))?;
        simulator.data_mut().set_contact_filter(filter)?;
        Ok(Self { simulator, presses, step: 0 })
    }

    fn step(&mut self) -> Result<(), SimError> {
        if self.step.is_multiple_of(EPISODE) {
            let object = self.simulator.task().has_object().then_some([1.30, 0.70]);
            self.simulator.reset(object)?;
        }
        self.step += 1;
        self.simulator.step(&black_box(self.control()))
    }

    fn control(&self) -> Control {
        let phase = f64::from(self.step % EPISODE);
        let spread = Vector3::new((7.0 * phase).sin(), (11.0 * phase).cos(), (13.0 * phase).sin());
        let gripper = self.simulator.gripper().position;
        let target =
            self.simulator.object().map_or(Vector3::new(1.3, 0.7, 0.38), |object| object.position);
        let displacement = if self.presses {
            (target - gripper).map(|d| d.clamp(-0.05, 0.05)) + 0.01 * spread
        } else {
            0.05 * spread
        };
        Control { displacement, fingers: (3.0 * phase).sin() }
    }
}

fn steps(criterion: &mut Criterion) {
    for (source, model_name) in
        [(ModelSource::Reference, "reference"), (ModelSource::Builtin, "builtin")]
    {
        for task in Task::ALL {
            let config = SimConfig::new(task).with_model(source.clone());
            let model = match FetchModel::load(&config) {
                Err(SimError::NoAssets { .. }) => continue,
                model => model.expect("MuJoCo"),
            };
            for (presses, actions) in [(false, "spread"), (true, "press")] {
                let mut group =
                    criterion.benchmark_group(format!("step/{task}/{model_name}/{actions}"));
                for (filter, name) in [(false, "plain"), (true, "filtered")] {
                    let mut run = Run::new(&model, filter, presses).expect("memory");
                    group.bench_function(name, |bencher| {
                        bencher.iter(|| run.step().expect("a stable step"));
                    });
                }
                group.finish();
            }
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).without_plots();
    targets = steps
}
criterion_main!(benches);
