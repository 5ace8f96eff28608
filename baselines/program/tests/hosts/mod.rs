//! Ranks on two hosts, and the network between them: the bits of one host, and a clear end if it
//! fails.
//!
//! The hosts are namespaces of this machine, which need Linux, root, iproute2 and OpenSSH.

mod two_hosts;

use std::{
    collections::BTreeMap,
    fs, panic,
    path::Path,
    process::{Child, Command},
    sync::{Mutex, PoisonError},
    thread,
    time::Duration,
};

use tempfile::tempdir;

use self::two_hosts::{LAUNCHER, RANKS, TwoHosts};
use crate::{Ended, PROGRAM, Result, Results, TRAIN, results, run, start, train, wait_for, words};

const PAGE: &str = include_str!("../../../MANY_MACHINES.md");

/// Cycles that mostly collect, and cycles that mostly update.
const COLLECTING: &str = "--steps 9000 --set batch_size=16 --set steps_per_cycle=1000 \
                          --set updates_per_cycle=2";
const UPDATING: &str = "--steps 500 --set batch_size=16 --set updates_per_cycle=100";

/// How long ranks wait for each other.
const WAIT: &str = "--wait-seconds 2";

/// Returns the lines of the page that begin with `start`.
fn of_page(start: &str) -> impl Iterator<Item = &str> {
    PAGE.lines().filter(move |line| line.starts_with(start))
}

/// Returns the page's command for several hosts, up to the program, with one rank on each host.
fn mpirun(hosts: &TwoHosts) -> Result<Command> {
    let host_file: Vec<_> = of_page("node").map(|line| line.replace("=4", "=1")).collect();
    fs::write(hosts.folder().join("hosts"), host_file.join("\n"))?;
    let command = of_page("mpirun --hostfile hosts").next().ok_or("the page has no command")?;
    let (launcher, _) = command.split_once(" /shared/fetch-env train --mpi").ok_or("no program")?;
    let mut command = hosts.program("mpirun");
    command.args(words(&launcher.replace("-n 8", "-n 2")).skip(1));
    let settings = of_page("export OMPI_MCA_oob").next().ok_or("the page has no settings")?;
    command.envs(words(settings).filter_map(|word| word.split_once('=')));
    Ok(command)
}

/// Returns a command that trains with two ranks, one on each host.
fn train_on(hosts: &TwoHosts, flags: &str, name: &str) -> Result<Command> {
    let mut command = mpirun(hosts)?;
    command.arg(PROGRAM).args(words(TRAIN)).arg("--mpi").args(words(flags)).arg("--out");
    command.arg(hosts.runs().join(name));
    Ok(command)
}

/// Separates the ranks' network from the launcher's, as clusters with two networks do.
fn apart(command: &mut Command) -> &mut Command {
    command.env("OMPI_MCA_btl_tcp_if_include", RANKS).env("OMPI_MCA_oob_tcp_if_include", LAUNCHER)
}

/// Starts a run, and waits until it is well into a cycle after its second checkpoint.
fn start_on(hosts: &TwoHosts, command: &mut Command) -> Result<Child> {
    let child = start(command)?;
    let checkpoints = || {
        let files = fs::read_dir(hosts.runs().join("run")).into_iter().flatten().flatten();
        files.filter(|file| file.file_name().to_string_lossy().starts_with("checkpoint-")).count()
    };
    wait_for(|| checkpoints() > 1)?;
    thread::sleep(Duration::from_millis(150));
    Ok(child)
}

/// Checks that a run failed, and that ranks said which one they missed.
fn ranks_are_missed(ended: &Ended) {
    let Ended { succeeded, text, .. } = ended;
    let errors: Vec<_> = text.lines().filter(|line| line.starts_with("error:")).collect();
    let is_named = |error: &&str| {
        let of = |ranks: &str| format!("error: {ranks} has not answered for 2 s:");
        error.starts_with(&of("rank 0: rank 1")) || error.starts_with(&of("rank 1: rank 0"))
    };
    let is_named = !errors.is_empty() && errors.iter().all(is_named);
    assert!(!succeeded && is_named, "{text}");
}

/// Waits until no process of a run is left on the hosts.
fn wait_for_end(hosts: &TwoHosts) -> Result {
    wait_for(|| hosts.processes().is_ok_and(|left| left.is_empty()))
}

/// Takes both networks down, or up again.
fn set_links(hosts: &TwoHosts, state: &str) -> Result {
    [RANKS, LAUNCHER].iter().try_for_each(|network| hosts.set_link(network, state))
}

/// Resumes a run on the hosts, and checks that it ends with the bits of an uninterrupted run.
fn resumes(hosts: &TwoHosts, flags: &str) -> Result {
    let out = hosts.runs().join("run");
    let mut resume = mpirun(hosts)?;
    resume.arg(PROGRAM).args(["train", "--mpi", "--threads", "1", "--resume"]).arg(&out);
    let ended = run(&mut resume)?;
    assert!(ended.succeeded && ended.text.contains("train: resuming"), "{}", ended.text);
    has_the_bits_of_one_host(&out, flags)
}

/// Checks that a run has the bits of two ranks on one host, which run once for all tests.
fn has_the_bits_of_one_host(out: &Path, flags: &str) -> Result {
    static RUNS: Mutex<BTreeMap<String, Results>> = Mutex::new(BTreeMap::new());
    let mut runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
    if !runs.contains_key(flags) {
        let folder = tempdir()?;
        let whole = folder.path().join("whole");
        let ended = run(&mut train(flags, &whole))?;
        assert!(ended.succeeded, "{}", ended.text);
        runs.insert(flags.to_owned(), results(&whole)?);
    }
    assert!(runs.get(flags) == Some(&results(out)?));
    Ok(())
}

#[test]
fn two_hosts_have_the_bits_of_one() -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    let names = run(mpirun(&hosts)?.arg("hostname"))?.text;
    assert!(names.contains("node1\n") && names.contains("node2\n"), "{names}");
    let ended = run(apart(&mut train_on(&hosts, UPDATING, "run")?))?;
    assert!(ended.succeeded, "{}", ended.text);
    has_the_bits_of_one_host(&hosts.runs().join("run"), UPDATING)?;
    // The gradients went over the network.
    assert!(hosts.sent_bytes(RANKS)? > 500_000);
    Ok(())
}

#[test]
fn a_network_that_comes_back_in_time_changes_nothing() -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    let child = start_on(&hosts, &mut train_on(&hosts, UPDATING, "run")?)?;
    set_links(&hosts, "down")?;
    thread::sleep(Duration::from_secs(1));
    set_links(&hosts, "up")?;
    let ended = Ended::of(child)?;
    assert!(ended.succeeded, "{}", ended.text);
    has_the_bits_of_one_host(&hosts.runs().join("run"), UPDATING)
}

fn a_cut_between_ranks_is_named(flags: &str) -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    let mut command = train_on(&hosts, &format!("{flags} {WAIT}"), "run")?;
    let child = start_on(&hosts, apart(&mut command))?;
    hosts.set_link(RANKS, "down")?;
    ranks_are_missed(&Ended::of(child)?);
    wait_for_end(&hosts)?;
    hosts.set_link(RANKS, "up")?;
    resumes(&hosts, flags)
}

#[test]
fn a_cut_between_ranks_that_collect_is_named() -> Result {
    a_cut_between_ranks_is_named(COLLECTING)
}

#[test]
fn a_cut_between_ranks_that_update_is_named() -> Result {
    a_cut_between_ranks_is_named(UPDATING)
}

/// The launcher waits longer than the ranks, and then cannot reach the other host: it ends when the
/// network is back.
#[test]
fn a_cut_between_ranks_and_launcher_is_named_by_the_ranks() -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    let mut command = train_on(&hosts, &format!("{UPDATING} {WAIT}"), "run")?;
    let child = start_on(&hosts, &mut command)?;
    set_links(&hosts, "down")?;
    let has_ranks =
        || hosts.processes().map_or(true, |left| left.contains(&"fetch-env".to_owned()));
    wait_for(|| !has_ranks())?;
    set_links(&hosts, "up")?;
    ranks_are_missed(&Ended::of(child)?);
    wait_for_end(&hosts)?;
    resumes(&hosts, UPDATING)
}

/// The page's settings, but with limits of seconds.
const IMPATIENT: [(&str, &str); 3] = [
    ("OMPI_MCA_oob_tcp_keepalive_time", "1"),
    ("OMPI_MCA_oob_tcp_keepalive_intvl", "1"),
    ("OMPI_MCA_oob_tcp_keepalive_probes", "2"),
];

#[test]
fn a_cut_between_ranks_and_launcher_is_named_by_the_launcher() -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    let child = start_on(&hosts, train_on(&hosts, UPDATING, "run")?.envs(IMPATIENT))?;
    set_links(&hosts, "down")?;
    let ended = Ended::of(child)?;
    let words = ["lost communication with a remote daemon", "on node node2"];
    let is_named = words.iter().all(|words| ended.text.contains(words));
    assert!(!ended.succeeded && is_named, "{}", ended.text);
    wait_for_end(&hosts)?;
    set_links(&hosts, "up")?;
    resumes(&hosts, UPDATING)
}

/// A firewall lets the launcher through, but no rank.
#[test]
fn ranks_that_cannot_connect_are_named() -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    hosts.block_ranks()?;
    let mut command = train_on(&hosts, &format!("{UPDATING} {WAIT}"), "run")?;
    ranks_are_missed(&run(apart(&mut command))?);
    wait_for_end(&hosts)
}

#[test]
fn a_panic_leaves_no_host_behind() -> Result {
    let Some(hosts) = TwoHosts::make()? else { return Ok(()) };
    let (firsts, folder) = (hosts.first_processes(), hosts.folder().to_owned());
    start(hosts.program("sleep").arg("1000"))?;
    let is_there = |process: &u32| Path::new("/proc").join(process.to_string()).exists();
    assert!(firsts.iter().all(is_there));
    let result = panic::catch_unwind(panic::AssertUnwindSafe(|| {
        let _hosts = hosts;
        panic!("on purpose");
    }));
    assert!(result.is_err() && !firsts.iter().any(is_there) && !folder.exists());
    Ok(())
}
