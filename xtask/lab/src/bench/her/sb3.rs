//! Stable-Baselines3's buffer, in a process of its own.

use std::{cell::RefCell, rc::Rc};

use super::SIZES;
use crate::{
    bench::{
        interleaved::{Contender, Timed},
        peer::Peer,
    },
    shared::python,
};

/// A buffer that is full.
pub struct Sb3(Rc<RefCell<Peer>>);

impl Sb3 {
    /// Starts it with as many transitions, of `f64`.
    pub fn start(transitions: usize) -> anyhow::Result<Self> {
        let python = python::environment("python-sb3", &python::STABLE_BASELINES3)?;
        println!("filling the buffer of Stable-Baselines3 step by step");
        let arguments = ["time".into(), transitions.to_string()];
        let script = ("sb3.py", python::SB3_SCRIPT);
        let peer = Peer::start(&python, script, &arguments, "disable")?;
        Ok(Self(Rc::new(RefCell::new(peer))))
    }

    /// Batches of a size, a step after each.
    pub fn sampling(&self, size: usize) -> impl Contender + 'static {
        // About as long a turn for every size, most of which is the same whatever the size.
        Orders { peer: Rc::clone(&self.0), order: format!("sample {size} {}", SIZES[2] / 256) }
    }

    /// Single steps.
    pub fn adding(&self) -> impl Contender + 'static {
        Orders { peer: Rc::clone(&self.0), order: "add 5000".into() }
    }
}

struct Orders {
    peer: Rc<RefCell<Peer>>,
    order: String,
}

impl Contender for Orders {
    fn work(&mut self) -> anyhow::Result<usize> {
        Ok(self.timed()?.done)
    }

    fn timed(&mut self) -> anyhow::Result<Timed> {
        self.peer.borrow_mut().timed(&self.order)
    }
}
