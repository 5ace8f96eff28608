//! A checkpoint that no run could be resumed from is not written, and the earlier ones stay.

use std::fs;

use baselines::LayerWeights;
use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, CheckpointError, Losses, StateMut, TrainError,
    TrainSettings, Trainer, Transitions, checkpoints,
};
use baselines::workers::OneProcess;
use serde_json::{Value, json};
use tempfile::tempdir;

use crate::runs::{Kinematic, Result, make, settings};

/// What is wrong with a state.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    Number(f32),
    NegativeSquare,
    OtherLength,
    OtherName,
    AnotherVector,
    OneFewer,
    SameName,
    ReservedName,
    Jump,
}

/// An algorithm whose state has a fault after a number of updates.
#[derive(Debug)]
struct Faulty {
    num_inputs: usize,
    num_actions: usize,
    num_updates: u64,
    vectors: Vec<(String, Vec<f32>)>,
    fault: Fault,
    from: u64,
}

impl Faulty {
    fn new(fault: Fault, from: u64, init: &AlgorithmInit) -> Self {
        let names = ["actor.biases", "actor.second_moment"];
        let vectors = names.map(|name| (name.to_owned(), vec![0.5; 4])).to_vec();
        let (num_inputs, num_actions) = (init.num_inputs, init.num_actions);
        let mut faulty = Self { num_inputs, num_actions, num_updates: 0, vectors, fault, from };
        faulty.fail();
        faulty
    }

    fn fail(&mut self) {
        if self.num_updates != self.from {
            return;
        }
        match self.fault {
            Fault::None => {}
            Fault::Number(number) => self.vectors[0].1[3] = number,
            Fault::NegativeSquare => self.vectors[1].1[0] = -1e-9,
            Fault::OtherLength => self.vectors[0].1.push(0.0),
            Fault::OtherName => self.vectors[0].0 = "critic.biases".to_owned(),
            Fault::AnotherVector => self.vectors.push(("critic".to_owned(), Vec::new())),
            Fault::OneFewer => self.vectors.truncate(1),
            Fault::SameName => self.vectors[1].0 = "actor.biases".to_owned(),
            Fault::ReservedName => self.vectors[1].0 = "__metadata__".to_owned(),
            Fault::Jump => self.num_updates += 7,
        }
    }
}

impl Algorithm for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }
    fn gamma(&self) -> f64 {
        0.9
    }
    fn update(&mut self, _batch: Transitions<'_>, _average: &mut dyn FnMut(&mut [f32])) -> Losses {
        self.num_updates += 1;
        self.fail();
        Losses::default()
    }
    fn explore(&mut self, _inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        actions.copy_from_slice(noise);
    }
    fn greedy_layers(&self) -> Vec<LayerWeights> {
        let weights = vec![0.0; self.num_inputs * self.num_actions];
        vec![LayerWeights {
            num_inputs: self.num_inputs,
            weights,
            biases: vec![0.0; self.num_actions],
        }]
    }
    fn state_mut(&mut self) -> StateMut<'_> {
        let vectors = self.vectors.iter_mut().map(|(name, vector)| (name.clone(), vector));
        StateMut { num_updates: &mut self.num_updates, vectors: vectors.collect() }
    }
}

fn other(value: Value) -> TrainSettings {
    let mut settings = settings(AlgorithmSettings::Other(value));
    settings.schedule.updates_per_cycle = 10;
    settings.exploration.random_episodes = 0;
    settings
}

fn trainer(
    fault: Fault,
    from: u64,
    settings: TrainSettings,
) -> Result<Trainer<Kinematic>, TrainError> {
    Trainer::with_algorithm(make, settings, 0, 1, Box::new(OneProcess), |_, init| {
        Ok(Box::new(Faulty::new(fault, from, &init)))
    })
}

#[test]
fn a_state_that_cannot_be_read_again_costs_no_earlier_checkpoint() -> Result {
    for fault in [
        Fault::Number(f32::NAN),
        Fault::Number(f32::NEG_INFINITY),
        Fault::NegativeSquare,
        Fault::OtherLength,
        Fault::OtherName,
        Fault::AnotherVector,
        Fault::OneFewer,
        Fault::SameName,
        Fault::ReservedName,
        Fault::Jump,
    ] {
        let folder = tempdir()?;
        let mut trainer = trainer(fault, 40, other(Value::Null))?;
        while trainer.counters().updates < 40 {
            trainer.save(folder.path())?;
            trainer.cycle()?;
        }
        let earlier = checkpoints(folder.path())?;
        for _ in 0..4 {
            match trainer.save(folder.path()) {
                Err(CheckpointError::Unreadable { reason, .. }) => assert!(!reason.is_empty()),
                saved => panic!("{fault:?}: {saved:?}"),
            }
            assert_eq!(checkpoints(folder.path())?, earlier, "{fault:?}");
            assert_eq!(fs::read_dir(folder.path())?.count(), earlier.len(), "nothing is left over");
            trainer.cycle()?;
        }
        let build = |_: &_, init| {
            let algorithm: Box<dyn Algorithm> = Box::new(Faulty::new(Fault::None, 0, &init));
            Ok(algorithm)
        };
        let (mut resumed, _) =
            Trainer::resume_with_algorithm(make, folder.path(), 1, Box::new(OneProcess), build)?;
        assert!(resumed.counters().updates < 40);
        resumed.cycle()?;
        resumed.save(folder.path())?;
    }
    Ok(())
}

#[test]
fn names_that_no_file_can_have_are_refused_before_the_run() {
    for fault in [Fault::SameName, Fault::ReservedName] {
        match trainer(fault, 0, other(Value::Null)) {
            Err(TrainError::State { algorithm, .. }) => assert_eq!(algorithm, "faulty"),
            trainer => panic!("{fault:?}: {trainer:?}"),
        }
    }
}

#[test]
fn settings_are_nested_as_deeply_as_every_file_allows() -> Result {
    let nested = |depth: usize| {
        (0..depth).fold(Value::Null, |value, at| match at % 2 {
            0 => Value::Array(vec![value]),
            _ => json!({ "settings": value }),
        })
    };
    for depth in [1, 99, 100] {
        let folder = tempdir()?;
        let settings = other(nested(depth));
        let mut trainer = trainer(Fault::None, 0, settings.clone())?;
        trainer.save(folder.path())?;
        let policy = trainer.policy("Own-v0")?;
        assert!(baselines::TrainedPolicy::from_bytes(&policy.to_bytes()?)? == policy);
        let build = |_: &_, init| {
            let algorithm: Box<dyn Algorithm> = Box::new(Faulty::new(Fault::None, 0, &init));
            Ok(algorithm)
        };
        let workers = Box::new(OneProcess);
        let (resumed, _) = Trainer::resume_with_algorithm(make, folder.path(), 1, workers, build)?;
        assert_eq!(resumed.settings(), &settings);
    }
    for depth in [101, 127, 500] {
        match trainer(Fault::None, 0, other(nested(depth))) {
            Err(TrainError::Setting { name: "algorithm", .. }) => {}
            trainer => panic!("{depth}: {trainer:?}"),
        }
    }
    Ok(())
}
