//! A snapshot continues in another process as in its own, to the last bit.
#![cfg(feature = "mujoco")]

use std::{env, fs, path::Path, process::Command};

use fetch_env::{Env, EnvId, FetchObservation, GoalObservation, MujocoEnv, SnapshotEnv, make};
use testing::Result;

const SNAPSHOTS: &str = "FETCH_ENV_TEST_SNAPSHOTS";
const STEPS: u32 = 40;

fn environment(id: EnvId) -> Result<MujocoEnv> {
    Ok(make(id.config().with_max_episode_steps(1000)?)?)
}

/// Drives at the object, which causes many contacts, or around if there is no object.
fn action(step: u32, observation: &FetchObservation) -> [f32; 4] {
    let phase = step as f32;
    let toward = |axis: usize| match observation.object_position() {
        Some(object) => 20.0 * (object[axis] - observation.grip_position()[axis]) as f32,
        None => (phase + axis as f32).sin(),
    };
    [toward(0), toward(1), toward(2), (0.3 * phase).sin()]
}

/// Takes some steps and returns all bits of their observations and rewards, in hexadecimal.
fn continue_from(env: &mut MujocoEnv, mut observation: FetchObservation) -> Result<String> {
    let mut bits = String::new();
    for step in 0..STEPS {
        let result = env.step(&action(step, &observation))?;
        observation = result.observation;
        for value in observation.observation().iter().chain([&result.reward]) {
            bits.push_str(&format!("{:016x}", value.to_bits()));
        }
    }
    Ok(bits)
}

#[test]
fn a_snapshot_continues_in_another_process() -> Result {
    if let Some(folder) = env::var_os(SNAPSHOTS) {
        return continue_all(Path::new(&folder));
    }
    let folder = tempfile::tempdir()?;
    let mut expected = Vec::new();
    for id in EnvId::ALL {
        let mut env = environment(id)?;
        let mut observation = env.reset(Some(3))?.observation;
        for step in 0..15 {
            observation = env.step(&action(step, &observation))?.observation;
        }
        let snapshot = serde_json::to_string(&env.snapshot())?;
        fs::write(folder.path().join(id.to_string()), snapshot)?;
        let bits = continue_from(&mut env, observation)?;
        // Restored in the same process too.
        let text = fs::read_to_string(folder.path().join(id.to_string()))?;
        env.restore(&serde_json::from_str(&text)?)?;
        let observation = env.inner().observe()?;
        assert_eq!(continue_from(&mut env, observation)?, bits, "{id}");
        expected.push((id, bits));
    }
    let status = Command::new(env::current_exe()?)
        .args(["--exact", "a_snapshot_continues_in_another_process"])
        .env(SNAPSHOTS, folder.path())
        .status()?;
    assert!(status.success());
    for (id, bits) in expected {
        let theirs = fs::read_to_string(folder.path().join(format!("{id}.bits")))?;
        assert!(theirs == bits, "{id}: the other process continued differently");
    }
    Ok(())
}

/// The other process: restores every snapshot and writes the bits of the steps that follow.
fn continue_all(folder: &Path) -> Result {
    for id in EnvId::ALL {
        let text = fs::read_to_string(folder.join(id.to_string()))?;
        let mut env = environment(id)?;
        env.restore(&serde_json::from_str(&text)?)?;
        let observation = env.inner().observe()?;
        let bits = continue_from(&mut env, observation)?;
        fs::write(folder.join(format!("{id}.bits")), bits)?;
    }
    Ok(())
}
