//! Two hosts on one machine: separate namespaces, joined by two networks.
//!
//! A host has its own name, network, processes, shared memory and SSH server. The first network
//! carries SSH and the launcher's messages, the second one is free for the ranks' messages. Nothing
//! on the machine is changed, and no namespace has a name: the kernel removes them with their last
//! process.

use std::{
    env,
    ffi::OsString,
    fs,
    io::{self, BufRead, BufReader, Write},
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    process::{Child, ChildStdout, Command, Stdio},
};

use tempfile::TempDir;

use crate::{Result, children};

/// The command that starts a program in its own namespaces.
const UNSHARE: [&str; 8] =
    ["--net", "--mount", "--uts", "--pid", "--ipc", "--fork", "--kill-child", "--mount-proc"];

/// The networks between the hosts: the launcher's and the ranks'.
pub(super) const LAUNCHER: &str = "eth0";
pub(super) const RANKS: &str = "eth1";

/// Addresses for documentation, which no machine has.
const NETWORKS: [(&str, &str); 2] = [(LAUNCHER, "192.0.2"), (RANKS, "198.51.100")];

/// Two hosts, `node1` and `node2`, until they are dropped.
#[derive(Debug)]
pub(super) struct TwoHosts {
    hosts: [Host; 2],
    folder: TempDir,
}

/// A host, and the process that made it.
#[derive(Debug)]
struct Host {
    made_by: Child,
    output: BufReader<ChildStdout>,
    /// The first process of the host, by its id on the machine.
    first: u32,
}

impl Drop for Host {
    fn drop(&mut self) {
        // This closes the standard input of the first process, which then ends. The kernel ends all
        // others of the host before the call returns.
        let _ = self.made_by.wait();
    }
}

impl Host {
    fn make(name: &str, folder: &Path) -> Result<Self> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hosts/host.sh");
        let mut made_by = Command::new("unshare")
            .args(UNSHARE)
            .args(["sh", script, name])
            .args([folder.to_path_buf(), folder.join("runs")])
            .env("PATH", path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let output = BufReader::new(made_by.stdout.take().ok_or("no output")?);
        let mut host = Self { made_by, output, first: 0 };
        host.says("made")?;
        host.first = *children(host.made_by.id())?.first().ok_or("the host has no process")?;
        Ok(host)
    }

    /// Waits until the host prints a word.
    fn says(&mut self, word: &str) -> Result {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        if line.trim_end() == word { Ok(()) } else { Err("a host could not be made".into()) }
    }

    /// Returns a command that runs a program in the namespaces of the host.
    fn enter(&self, namespaces: &[&str], program: &str) -> Command {
        let mut command = Command::new("nsenter");
        command.arg("--target").arg(self.first.to_string()).args(namespaces).arg(program);
        command.env("PATH", path());
        command
    }

    fn ip(&self, arguments: &str) -> Result {
        run("ip", self.enter(&["--net"], "ip").args(arguments.split(' ')))
    }
}

impl TwoHosts {
    /// Makes two hosts; returns none, and prints so, where they cannot be made.
    pub(super) fn make() -> Result<Option<Self>> {
        if !can_be_made() {
            return Ok(None);
        }
        let folder = TempDir::new()?;
        let path = folder.path();
        for key in ["host-key", "key"] {
            let mut keygen = Command::new("ssh-keygen");
            run(
                "ssh-keygen",
                keygen.args(["-q", "-t", "ed25519", "-N", "", "-f"]).arg(path.join(key)),
            )?;
        }
        fs::create_dir(path.join("runs"))?;
        let path = path.display();
        fs::write(
            folder.path().join("names"),
            "127.0.0.1 localhost\n192.0.2.1 node1\n192.0.2.2 node2\n",
        )?;
        let server = format!(
            "HostKey {path}/host-key\nAuthorizedKeysFile {path}/key.pub\nPidFile none\nUsePAM no\n\
             StrictModes no\nPermitRootLogin prohibit-password\n"
        );
        fs::write(folder.path().join("sshd_config"), server)?;
        let client = format!(
            "IdentityFile {path}/key\nIdentitiesOnly yes\nUserKnownHostsFile {path}/known\n\
             GlobalKnownHostsFile none\nStrictHostKeyChecking accept-new\nLogLevel ERROR\n"
        );
        fs::write(folder.path().join("ssh_config"), client)?;
        let make = |name| Host::make(name, folder.path());
        let hosts = [make("node1")?, make("node2")?];
        let mut hosts = Self { hosts, folder };
        hosts.join()?;
        Ok(Some(hosts))
    }

    /// Joins the hosts by their networks.
    fn join(&mut self) -> Result {
        let [first, second] = &self.hosts;
        for (link, network) in NETWORKS {
            let other = second.first;
            first.ip(&format!("link add {link} type veth peer name {link} netns {other}"))?;
            for (index, host) in self.hosts.iter().enumerate() {
                host.ip(&format!("address add {network}.{}/24 dev {link}", index + 1))?;
                host.ip(&format!("link set {link} up"))?;
            }
        }
        for host in &mut self.hosts {
            host.made_by.stdin.as_mut().ok_or("no input")?.write_all(b"joined\n")?;
            host.says("ready")?;
        }
        Ok(())
    }

    /// Returns the folder in which programs start. Both hosts have it.
    pub(super) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the folder of runs on the first host; the second one has an empty folder there.
    pub(super) fn runs(&self) -> PathBuf {
        self.folder.path().join("runs")
    }

    /// Returns a command that runs a program on the first host, which reaches the other one by SSH.
    pub(super) fn program(&self, name: &str) -> Command {
        // A process that enters a host starts at the root of its files.
        let mut command = self.hosts[0].enter(&["--all"], "env");
        command.arg("--chdir").arg(self.folder.path()).arg(name);
        let agent = format!("ssh -F {}/ssh_config", self.folder.path().display());
        command
            .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
            .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
            .env("OMPI_MCA_plm_rsh_agent", agent)
            .env("OMPI_MCA_orte_tmpdir_base", self.folder.path())
            // Both hosts have the same cores, and would give both ranks the first.
            .env("OMPI_MCA_hwloc_base_binding_policy", "none");
        command
    }

    /// Takes the second host's end of a network down, or up again.
    pub(super) fn set_link(&self, network: &str, state: &str) -> Result {
        self.hosts[1].ip(&format!("link set {network} {state}"))
    }

    /// Drops everything that the second host sends to the first one in the ranks' network, as a
    /// firewall would.
    pub(super) fn block_ranks(&self) -> Result {
        let nobody = "198.51.100.1 lladdr 02:00:00:00:00:01";
        self.hosts[1].ip(&format!("neighbour replace {nobody} nud permanent dev {RANKS}"))
    }

    /// Returns how many bytes the first host has sent in a network.
    pub(super) fn sent_bytes(&self, network: &str) -> Result<u64> {
        let output = self.hosts[0].enter(&["--net"], "cat").arg("/proc/net/dev").output()?;
        let text = String::from_utf8(output.stdout)?;
        let line =
            text.lines().find_map(|line| line.trim().strip_prefix(network)?.strip_prefix(':'));
        Ok(line
            .and_then(|line| line.split_whitespace().nth(8))
            .ok_or("no such network")?
            .parse()?)
    }

    /// Returns the names of the processes of a run that are left on the hosts.
    pub(super) fn processes(&self) -> Result<Vec<String>> {
        let namespace = |pid: &str| fs::metadata(format!("/proc/{pid}/ns/pid")).map(|of| of.ino());
        let ours: Vec<_> = self
            .hosts
            .iter()
            .map(|host| namespace(&host.first.to_string()))
            .collect::<io::Result<_>>()?;
        let mut names = Vec::new();
        for process in fs::read_dir("/proc")? {
            let process = process?;
            let is_ours = namespace(&process.file_name().to_string_lossy())
                .is_ok_and(|it| ours.contains(&it));
            let name = fs::read_to_string(process.path().join("comm")).unwrap_or_default();
            let name = name.trim_end().to_owned();
            if is_ours && ["fetch-env", "mpirun", "orted", "ssh"].contains(&name.as_str()) {
                names.push(name);
            }
        }
        Ok(names)
    }

    /// Returns the first processes of the hosts, by their ids on the machine.
    pub(super) fn first_processes(&self) -> [u32; 2] {
        [self.hosts[0].first, self.hosts[1].first]
    }
}

/// Whether two hosts can be made here. Where namespaces work, CI must have the programs; elsewhere,
/// a test that needs them prints that it is skipped.
fn can_be_made() -> bool {
    const PACKAGES: &str = "apt-get install iproute2 openssh-server openssh-client";
    let skipped = |why: &str| {
        // The harness holds back what `eprintln!` prints; a skipped test must not go unnoticed.
        let _ = writeln!(io::stderr(), "SKIPPED: {why}: nothing was tried on two hosts");
        false
    };
    let mut unshare = Command::new("unshare");
    let has_namespaces =
        unshare.args(UNSHARE).arg("true").output().is_ok_and(|it| it.status.success());
    if !has_namespaces {
        return skipped("namespaces cannot be made here (they need Linux and root)");
    }
    for program in ["ip", "nsenter", "ssh", "ssh-keygen", "sshd"] {
        let is_there = env::split_paths(&path()).any(|folder| folder.join(program).is_file());
        assert!(is_there || env::var_os("CI").is_none(), "CI must have {program}: {PACKAGES}");
        if !is_there {
            return skipped(&format!("{program} is missing ({PACKAGES})"));
        }
    }
    let link = "unshare --net ip link add eth0 type veth peer name eth1";
    let has_links = Command::new("sh").args(["-c", link]).env("PATH", path()).output();
    has_links.is_ok_and(|it| it.status.success()) || skipped("the kernel has no links (veth)")
}

/// Returns the folders of programs, including those for root.
fn path() -> OsString {
    let mut path = env::var_os("PATH").unwrap_or_default();
    path.push(":/usr/sbin:/sbin");
    path
}

fn run(what: &str, command: &mut Command) -> Result {
    let output = command.output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    if output.status.success() { Ok(()) } else { Err(format!("{what}: {errors}").into()) }
}
