//! Libraries and models in a process that was forked while other threads loaded some.
#![cfg(all(unix, feature = "mujoco", not(fetch_sim_no_shim)))]

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::SeqCst},
    },
    thread,
    time::Duration,
};

use fetch_sim::{Data, Model, MujocoSimulator, SimConfig, SimError, Simulator, Task, library_path};
use testing::{Result, in_child};

const XML: &str =
    r#"<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>"#;

fn model() -> Result<Arc<Model>, SimError> {
    Ok(Arc::new(Model::from_files(&[("model.xml", XML)])?))
}

/// Steps a model with a contact filter, for which the model's shapes are prepared.
fn simulate(model: &Arc<Model>) -> Result<(), SimError> {
    let mut data = Data::new(Arc::clone(model))?;
    data.set_contact_filter(true)?;
    data.step(1)
}

#[test]
fn a_child_of_a_process_that_loads_the_library_can_use_it() -> Result {
    for attempt in 0..20 {
        // This process never loads it, so each of these children begins without.
        in_child(|| {
            let loading = thread::spawn(library_path);
            thread::sleep(Duration::from_micros(200 * attempt));
            in_child(|| {
                let mut simulator = MujocoSimulator::new(&SimConfig::new(Task::Push))?;
                simulator.reset(Some([1.3, 0.6]))?;
                Ok(())
            })?;
            loading.join().expect("no panic")?;
            Ok(())
        })?;
    }
    Ok(())
}

#[test]
fn a_child_of_a_process_that_compiles_models_can_compile_some() -> Result {
    // In a child, so that the other test's parent does not load the library.
    in_child(|| {
        let shared = model()?;
        let done = AtomicBool::new(false);
        thread::scope(|scope| {
            let compile = || -> Result<(), SimError> {
                while !done.load(SeqCst) {
                    simulate(&model()?)?;
                }
                Ok(())
            };
            let others = [(); 2].map(|()| scope.spawn(compile));
            let children = (0..20).try_for_each(|_| {
                in_child(|| {
                    simulate(&model()?)?;
                    Ok(simulate(&shared)?)
                })
            });
            done.store(true, SeqCst);
            others.into_iter().try_for_each(|other| other.join().expect("no panic"))?;
            children
        })
    })
}
