//! Python scripts that execute orders and time themselves.

use std::{
    cell::RefCell,
    fs,
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    rc::Rc,
};

use anyhow::{Context, bail, ensure};
use fetch_sim::MujocoVersion;
use tempfile::TempDir;

use super::interleaved::{Contender, Timed};
use crate::shared::python;

/// A peer as a contender: it executes the same order in each turn, and times itself.
pub struct Orders {
    peer: Rc<RefCell<Peer>>,
    order: String,
}

impl Orders {
    pub fn new(peer: &Rc<RefCell<Peer>>, order: String) -> Self {
        Self { peer: Rc::clone(peer), order }
    }
}

impl Contender for Orders {
    fn work(&mut self) -> anyhow::Result<usize> {
        Ok(self.timed()?.done)
    }

    fn timed(&mut self) -> anyhow::Result<Timed> {
        self.peer.borrow_mut().timed(&self.order)
    }
}

/// A Python process that waits for orders.
pub struct Peer {
    process: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Holds the script.
    _folder: TempDir,
}

impl Peer {
    /// Starts a script, given by name and text, with an OpenGL library, and waits until it is
    /// ready.
    pub fn start(
        python: &Path,
        (name, text): (&str, &str),
        arguments: &[String],
        gl: &str,
    ) -> anyhow::Result<Rc<RefCell<Self>>> {
        let folder = tempfile::tempdir()?;
        let script = folder.path().join(name);
        fs::write(&script, text)?;
        let mut process = Command::new(python)
            .arg(script)
            .args(arguments)
            // MuJoCo writes its log file there, if any.
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
        Ok(Rc::new(RefCell::new(peer)))
    }

    /// Sends an order and waits until it is executed.
    fn timed(&mut self, order: &str) -> anyhow::Result<Timed> {
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
        // Libraries print greetings first.
        while !line.trim_end().ends_with("ready")
            && !line.starts_with(|first: char| first.is_ascii_digit())
        {
            line.clear();
            ensure!(self.answers.read_line(&mut line)? > 0, "the peer has stopped");
        }
        Ok(line.trim_end().to_owned())
    }
}

/// Prints a note if the peers run on another MuJoCo.
pub fn note_other_mujoco() -> anyhow::Result<()> {
    let version = MujocoVersion::of_library()?.to_string();
    if version != python::MUJOCO {
        say!("this is built on MuJoCo {version}; the peers run on {}", python::MUJOCO)?;
    }
    Ok(())
}

impl Drop for Peer {
    fn drop(&mut self) {
        // Errors do not matter: the process may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
