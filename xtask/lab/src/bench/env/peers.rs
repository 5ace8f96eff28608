//! gymnasium-robotics and EnvPool, each in a process of its own.

use fetch_env::EnvId;

use super::episodes::STEPS;
use crate::{
    bench::{
        interleaved::{Contender, Timed},
        peer::Peer,
    },
    shared::python,
};

const SCRIPT: &str = include_str!("../../../scripts/peers.py");

/// Environments of a peer.
pub struct PeerEnvs {
    peer: Peer,
    transitions: usize,
}

impl PeerEnvs {
    pub fn gymnasium_robotics(id: EnvId) -> anyhow::Result<Self> {
        Self::start("gymnasium-robotics", id, 1, 1)
    }

    pub fn envpool(id: EnvId, num_envs: usize, threads: usize) -> anyhow::Result<Self> {
        Self::start("envpool", id, num_envs, threads)
    }

    fn start(name: &str, id: EnvId, num_envs: usize, threads: usize) -> anyhow::Result<Self> {
        let arguments = [name.into(), id.to_string()]
            .into_iter()
            .chain(["--num-envs".into(), num_envs.to_string()])
            .chain(["--threads".into(), threads.to_string()])
            .collect::<Vec<String>>();
        let peer = Peer::start(&python::peers()?, ("peers.py", SCRIPT), &arguments, "disable")?;
        Ok(Self { peer, transitions: num_envs * STEPS })
    }
}

impl Contender for PeerEnvs {
    fn work(&mut self) -> anyhow::Result<usize> {
        Ok(self.timed()?.done)
    }

    fn timed(&mut self) -> anyhow::Result<Timed> {
        self.peer.timed(&self.transitions.to_string())
    }
}
