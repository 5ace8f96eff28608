//! The memory of a process, and measuring in a process of its own.

use std::{fs, process::Command};

use anyhow::{Context, ensure};

/// Returns the resident memory of this process in bytes.
pub fn resident_bytes() -> anyhow::Result<f64> {
    let status = fs::read_to_string("/proc/self/status").context("memory is measured on Linux")?;
    let kilobytes = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB"))
        .context("/proc/self/status has no VmRSS")?;
    Ok(kilobytes.trim().parse::<f64>()? * 1024.0)
}

/// Runs this program again with other arguments, and returns its output. Earlier allocations would
/// distort a measurement of memory in this process.
pub fn measure_in_new_process(arguments: &[String]) -> anyhow::Result<String> {
    let output = Command::new(std::env::current_exe()?).args(arguments).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "the measurement of memory failed: {errors}");
    Ok(String::from_utf8(output.stdout)?)
}
