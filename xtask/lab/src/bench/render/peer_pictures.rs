//! Pictures of gymnasium-robotics, in a process of its own.

use fetch_env::EnvId;

use super::TURN;
use crate::{
    bench::{
        interleaved::{Contender, Timed},
        peer::Peer,
    },
    shared::python,
};

const SCRIPT: &str = include_str!("../../../scripts/pictures.py");

pub struct PeerPictures(Peer);

impl PeerPictures {
    /// Square ones, drawn with this library of OpenGL.
    pub fn start(id: EnvId, side: u32, opengl: &str) -> anyhow::Result<Self> {
        let arguments = [id.to_string(), "--side".into(), side.to_string()];
        let (script, gl) = (("pictures.py", SCRIPT), opengl.to_lowercase());
        Ok(Self(Peer::start(&python::peers()?, script, &arguments, &gl)?))
    }
}

impl Contender for PeerPictures {
    fn work(&mut self) -> anyhow::Result<usize> {
        Ok(self.timed()?.done)
    }

    fn timed(&mut self) -> anyhow::Result<Timed> {
        self.0.timed(&TURN.to_string())
    }
}
