//! Any sequence of calls on environments that fail and panic gives typed errors and what the calls
//! promise; after a failure an environment can be reset.
#![no_main]

mod single;
mod vector;

use std::{
    panic::{self, panic_any},
    process::abort,
};

use arbitrary::Arbitrary;
use fetch_env::wrappers::Wrapped;
use fetch_env::{EnvId, FetchEnv, FetchResetOptions, TimeLimit};
use fetch_sim::SimError;
use libfuzzer_sys::fuzz_target;
use testing::{Fault, Faulty};

type TestEnv = Wrapped<FetchEnv<Faulty>, TimeLimit>;

/// The panic of an environment, whose drop panics as well.
struct Planned;

impl Drop for Planned {
    fn drop(&mut self) {
        panic_any(Self);
    }
}

/// What happens in a step in which the gripper goes down.
#[derive(Arbitrary, Clone, Copy, Debug)]
enum Kind {
    Good,
    Failing,
    Panicking,
}

/// The options of a reset.
#[derive(Arbitrary, Clone, Copy, Debug)]
struct Options {
    goal: Option<[f64; 3]>,
    object: Option<[f64; 2]>,
}

impl Options {
    fn get(self) -> FetchResetOptions {
        let mut options = FetchResetOptions::default();
        if let Some(goal) = self.goal {
            options = options.with_desired_goal(goal);
        }
        match self.object {
            Some(object) => options.with_object_position(object),
            None => options,
        }
    }
}

fn make(id: EnvId, max_episode_steps: u8, kind: Kind) -> TestEnv {
    let fault: Fault = match kind {
        Kind::Good => || Ok(()),
        Kind::Failing => || Err(SimError::Unstable { reason: "planned".into() }),
        Kind::Panicking => || panic_any(Planned),
    };
    let limit = u32::from(max_episode_steps) % 20 + 1;
    let config = id.config().with_max_episode_steps(limit).expect("not 0");
    let simulator = Faulty::new(config.sim(), fault);
    FetchEnv::new(config, simulator).expect("a simulator of these settings").time_limited()
}

#[derive(Arbitrary, Debug)]
enum Input {
    Single { is_failing: bool, id: u8, limit: u8, calls: Vec<single::Call> },
    Vector { setup: vector::Setup, calls: Vec<vector::Call> },
}

/// Lets planned panics unwind; libfuzzer's own hook ends the process at every panic.
fn allow_planned_panics() {
    let end = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        if !info.payload().is::<Planned>() {
            end(info);
            abort();
        }
    }));
}

fuzz_target!(init: allow_planned_panics(), |input: Input| {
    match input {
        Input::Single { is_failing, id, limit, calls } => {
            let id = EnvId::ALL[usize::from(id) % EnvId::ALL.len()];
            let kind = if is_failing { Kind::Failing } else { Kind::Good };
            single::run(make(id, limit, kind), &calls);
        }
        Input::Vector { setup, calls } => vector::run(&setup, &calls),
    }
});
