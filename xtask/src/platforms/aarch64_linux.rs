//! Linux on ARM servers: the tests run in QEMU, at a tenth of the machine's speed.

use fetch_install::download;

use super::{Platform, cargo_for};
use crate::tools::MUJOCO;

pub(super) const PLATFORM: Platform =
    Platform { name: "aarch64-linux", target: "aarch64-unknown-linux-gnu", check };

/// Programs from Debian's packages.
const TOOLS: [(&str, &str); 2] = [
    ("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", "aarch64-linux-gnu-gcc"),
    ("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER", "qemu-aarch64 -L /usr/aarch64-linux-gnu"),
];

/// Tests that take seconds, and start no process: QEMU would need the kernel's help for that.
const TESTS: &str = "--test properties --test numpy --test defaults --test binding \
    --test fetch --test random_models --test refusals --test visual_geoms --test choices \
    --test spaces --test registry --test time_limit --test bad_states --test own_ids \
    --example first_steps --example replay_buffer";

/// The laws of rewards, of the buffer, of the environments and of the contact filter, except those
/// that take a minute.
const LAWS: &str = "--test laws --test conformance --test contact_filter -- adding appending \
    determinism fields format goals outcomes relabeling success reward snapshots_survive \
    a_restored actions_are each_axis dense_and_sparse where_the_reference_puts_them \
    an_episode_lasts no_rejection contacts_below contacts_of a_filter_changes snapshots_do_not \
    --skip the_step_reward_is_the_reward_of_its_goals";

/// Matrix products, and training runs that give the same bits as on x86_64.
const LEARNING: &str = "--lib --test learn -- products_have gradients_agree same_bits::";

fn check() -> anyhow::Result<bool> {
    let Platform { name, target, .. } = PLATFORM;
    let mujoco = download::mujoco_for(MUJOCO, name)?;
    let run = |arguments: &str| cargo_for(target, arguments, &mujoco, &TOOLS);
    // The same crates with the same features each time, so that nothing is built twice.
    let test = |tests: &str| {
        run(&format!(
            "test -p goal-reward -p her-relabel -p fetch-sim -p fetch-env -p fetch-baselines \
             --features fetch-baselines/learn {tests}"
        ))
    };
    Ok(test(TESTS)?
        && test(LAWS)?
        && test(LEARNING)?
        && run("run -p fetch-cli --no-default-features -- verify --env-id FetchReach-v4")?)
}
