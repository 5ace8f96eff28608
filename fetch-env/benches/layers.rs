//! The cost of each layer of a step and of a reset: `cargo bench -p fetch-env --bench layers`.
//!
//! On a busy machine times vary; `cargo xtask bench instructions` counts instructions instead.
#![allow(missing_docs)] // for the functions that the macros generate

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use fetch_env::vec_env::{AutoresetMode, VecConfig};
use fetch_env::{Env, EnvId, make, make_kinematic, make_vec};
use fetch_sim::{Control, MujocoSimulator, Simulator};
use nalgebra::Vector3;

const ACTION: [f32; 4] = [0.3, -0.2, 0.1, 0.5];

/// Measures the simulator's step and the environment's around it.
fn layers(criterion: &mut Criterion) {
    for id in EnvId::ALL.into_iter().step_by(2) {
        let mut group = criterion.benchmark_group(id.to_string());
        let mut env = make(id).expect("MuJoCo");
        env.reset(Some(0)).expect("a reset");
        group.bench_function("observation", |bencher| {
            bencher.iter(|| black_box(&env).inner().observe().expect("an observation"));
        });
        group.bench_function("reset", |bencher| {
            bencher.iter(|| env.reset(None).expect("a reset"));
        });
        group.bench_function("env", |bencher| {
            env.reset(Some(0)).expect("a reset");
            bencher.iter(|| {
                let step = env.step(&ACTION).expect("a step");
                if step.is_last() {
                    env.reset(Some(0)).expect("a reset");
                }
                step
            });
        });
        let model = env.inner().simulator().fetch_model().clone();
        let mut simulator = MujocoSimulator::from_model(model).expect("memory");
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(ACTION[axis] * 0.05));
        let control = Control { displacement: Vector3::new(x, y, z), fingers: 0.5 };
        group.bench_function("simulator", |bencher| {
            let mut steps = 0;
            simulator.reset(None).expect("a reset");
            bencher.iter(|| {
                simulator.step(&control).expect("a step");
                steps += 1;
                if steps % 50 == 0 {
                    simulator.reset(None).expect("a reset");
                }
            });
        });
        group.finish();
    }
}

/// Measures an environment around a simulator that costs almost nothing.
fn above_the_simulator(criterion: &mut Criterion) {
    let mut env = make_kinematic("FetchPush-v4").expect("an id");
    env.reset(Some(0)).expect("a reset");
    criterion.bench_function("kinematic/step", |bencher| {
        bencher.iter_batched_ref(
            || env.clone(),
            |env| env.step(&ACTION).expect("a step"),
            BatchSize::SmallInput,
        );
    });
}

fn together(criterion: &mut Criterion) {
    let id: EnvId = "FetchPush-v4".parse().expect("an id");
    for threads in [1, 2] {
        let config =
            VecConfig::default().with_num_threads(threads).with_autoreset(AutoresetMode::SameStep);
        let mut envs = make_vec(id, 16, config).expect("MuJoCo");
        envs.reset(Some(0)).expect("a reset");
        let actions = ACTION.repeat(16);
        criterion.bench_function(&format!("vec/16-envs/threads-{threads}"), |bencher| {
            bencher.iter(|| envs.step(&actions).expect("a step").len());
        });
    }
}

criterion_group!(benches, layers, above_the_simulator, together);
criterion_main!(benches);
