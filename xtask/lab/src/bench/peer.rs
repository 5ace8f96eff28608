//! A script in a Python process that does what it is told and times it.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use anyhow::{Context, bail, ensure};
use fetch_sim::MujocoVersion;
use tempfile::TempDir;

use super::interleaved::Timed;
use crate::shared::python;

/// A peer that waits for its turn.
pub struct Peer {
    process: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Holds the script.
    _folder: TempDir,
}

impl Peer {
    /// Starts a script, given by name and text, with this library of OpenGL, and waits until it is
    /// ready.
    pub fn start(
        python: &Path,
        (name, text): (&str, &str),
        arguments: &[String],
        gl: &str,
    ) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir()?;
        let script = folder.path().join(name);
        fs::write(&script, text)?;
        let mut process = Command::new(python)
            .arg(script)
            .args(arguments)
            // MuJoCo's log file, if there is any.
            .current_dir(folder.path())
            .env("MUJOCO_GL", gl)
            .env("PYTHONWARNINGS", "ignore")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("the Python environment did not start")?;
        let orders = process.stdin.take().context("no pipe to the peer")?;
        let answers = BufReader::new(process.stdout.take().context("no pipe from the peer")?);
        let mut peer = Self { process, orders, answers, _folder: folder };
        let answer = peer.answer()?;
        ensure!(answer.ends_with("ready"), "{name} answered {answer:?}");
        Ok(peer)
    }

    /// Has an order carried out.
    pub fn timed(&mut self, order: &str) -> anyhow::Result<Timed> {
        writeln!(self.orders, "{order}")?;
        self.orders.flush()?;
        let answer = self.answer()?;
        let [done, wall, cpu] = answer.split(' ').collect::<Vec<_>>()[..] else {
            bail!("the peer answered {answer:?}");
        };
        Ok(Timed { done: done.parse()?, wall: wall.parse()?, cpu: cpu.parse()? })
    }

    fn answer(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        // Libraries greet on standard output.
        while !line.trim_end().ends_with("ready")
            && !line.starts_with(|first: char| first.is_ascii_digit())
        {
            line.clear();
            ensure!(self.answers.read_line(&mut line)? > 0, "the peer has stopped");
        }
        Ok(line.trim_end().to_owned())
    }
}

/// Tells so if the peers run on another MuJoCo.
pub fn note_other_mujoco() -> anyhow::Result<()> {
    let version = MujocoVersion::of_library()?.to_string();
    if version != python::MUJOCO {
        println!("this is built on MuJoCo {version}; the peers run on {}", python::MUJOCO);
    }
    Ok(())
}

impl Drop for Peer {
    fn drop(&mut self) {
        // Nothing is lost with it.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
