//! A snapshot taken in one process goes on in another as it did in the first, to the last bit.
#![cfg(feature = "mujoco")]

use std::{env, fs, path::Path, process::Command};

use fetch_env::{
    Env, EnvId, FetchObservation, GoalObservation, MujocoEnv, SnapshotEnv, make_config,
};

const SNAPSHOTS: &str = "FETCH_ENV_TEST_SNAPSHOTS";
const STEPS: u32 = 40;

fn environment(id: EnvId) -> MujocoEnv {
    let mut builder = fetch_env::FetchConfig::builder(id.task);
    builder = builder.reward(id.reward).max_episode_steps(1000);
    make_config(builder.build().expect("a sound configuration")).expect("MuJoCo")
}

/// Drives at the object, or about where there is none: many contacts.
fn action(step: u32, observation: &FetchObservation) -> [f32; 4] {
    let phase = step as f32;
    let toward = |axis: usize| match observation.object_position() {
        Some(object) => 20.0 * (object[axis] - observation.grip_position()[axis]) as f32,
        None => (phase + axis as f32).sin(),
    };
    [toward(0), toward(1), toward(2), (0.3 * phase).sin()]
}

/// All bits of all observations and rewards of some steps, in hexadecimal.
fn go_on(env: &mut MujocoEnv, mut observation: FetchObservation) -> String {
    let mut bits = String::new();
    for step in 0..STEPS {
        let result = env.step(&action(step, &observation)).expect("a step");
        observation = result.observation;
        for value in observation.observation().iter().chain([&result.reward]) {
            bits.push_str(&format!("{:016x}", value.to_bits()));
        }
    }
    bits
}

#[test]
fn a_snapshot_goes_on_in_another_process() {
    if let Some(folder) = env::var_os(SNAPSHOTS) {
        return go_on_from(Path::new(&folder));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let mut expected = Vec::new();
    for id in EnvId::ALL {
        let mut env = environment(id);
        let mut observation = env.reset(Some(3)).expect("a reset").observation;
        for step in 0..15 {
            observation = env.step(&action(step, &observation)).expect("a step").observation;
        }
        let snapshot = serde_json::to_string(&env.snapshot()).expect("JSON");
        fs::write(folder.path().join(id.to_string()), snapshot).expect("a file");
        let bits = go_on(&mut env, observation);
        // Back in the same process too.
        let text = fs::read_to_string(folder.path().join(id.to_string())).expect("a file");
        env.restore(&serde_json::from_str(&text).expect("a snapshot")).expect("its own snapshot");
        let observation = env.inner().observe().expect("an observation");
        assert_eq!(go_on(&mut env, observation), bits, "{id}");
        expected.push((id, bits));
    }
    let status = Command::new(env::current_exe().expect("this test"))
        .args(["--exact", "a_snapshot_goes_on_in_another_process"])
        .env(SNAPSHOTS, folder.path())
        .status()
        .expect("the other process starts");
    assert!(status.success());
    for (id, bits) in expected {
        let theirs = fs::read_to_string(folder.path().join(format!("{id}.bits"))).expect("bits");
        assert!(theirs == bits, "{id}: the other process went on differently");
    }
}

/// The other process: restores every snapshot and writes down how it goes on.
fn go_on_from(folder: &Path) {
    for id in EnvId::ALL {
        let text = fs::read_to_string(folder.join(id.to_string())).expect("a file");
        let mut env = environment(id);
        env.restore(&serde_json::from_str(&text).expect("a snapshot")).expect("its own snapshot");
        let observation = env.inner().observe().expect("an observation");
        let bits = go_on(&mut env, observation);
        fs::write(folder.join(format!("{id}.bits")), bits).expect("a file");
    }
}
