//! gymnasium-robotics and EnvPool, each in a process of its own.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use anyhow::{Context, bail, ensure};
use fetch_env::EnvId;
use tempfile::TempDir;

use super::episodes::STEPS;
use crate::{
    bench::interleaved::{Contender, Timed},
    python,
};

const ENVPOOL: &str = "envpool==1.2.5";
const SCRIPT: &str = include_str!("../../../scripts/peers.py");

/// A peer that waits for its turn.
pub struct Peer {
    process: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    transitions: usize,
    /// Holds the script.
    _folder: TempDir,
}

impl Peer {
    pub fn gymnasium_robotics(id: EnvId) -> anyhow::Result<Self> {
        Self::start("gymnasium-robotics", id, 1, 1)
    }

    pub fn envpool(id: EnvId, num_envs: usize, threads: usize) -> anyhow::Result<Self> {
        Self::start("envpool", id, num_envs, threads)
    }

    fn start(name: &str, id: EnvId, num_envs: usize, threads: usize) -> anyhow::Result<Self> {
        let packages = [&python::REFERENCE[..], &[ENVPOOL]].concat();
        let python = python::environment("python-peers", &packages)?;
        let folder = tempfile::tempdir()?;
        let script = folder.path().join("peers.py");
        fs::write(&script, SCRIPT)?;
        let mut process = Command::new(python)
            .arg(script)
            .args([name, &id.to_string()])
            .args(["--num-envs", &num_envs.to_string(), "--threads", &threads.to_string()])
            // MuJoCo's log file, if there is any.
            .current_dir(folder.path())
            .env("MUJOCO_GL", "disable")
            .env("PYTHONWARNINGS", "ignore")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("the Python environment did not start")?;
        let orders = process.stdin.take().context("no pipe to the peer")?;
        let answers = BufReader::new(process.stdout.take().context("no pipe from the peer")?);
        let transitions = num_envs * STEPS;
        let mut peer = Self { process, orders, answers, transitions, _folder: folder };
        let answer = peer.answer()?;
        ensure!(answer.ends_with("ready"), "{name} answered {answer:?}");
        Ok(peer)
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

impl Contender for Peer {
    fn work(&mut self) -> anyhow::Result<usize> {
        Ok(self.timed()?.done)
    }

    fn timed(&mut self) -> anyhow::Result<Timed> {
        writeln!(self.orders, "{}", self.transitions)?;
        self.orders.flush()?;
        let answer = self.answer()?;
        let [done, wall, cpu] = answer.split(' ').collect::<Vec<_>>()[..] else {
            bail!("the peer answered {answer:?}");
        };
        Ok(Timed { done: done.parse()?, wall: wall.parse()?, cpu: cpu.parse()? })
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // Nothing is lost with it.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
