//! Tests of the contract and of the loaded library.

#[cfg(all(target_os = "linux", not(fetch_sim_no_shim)))]
mod search;

use std::{collections::BTreeSet, fs, path::Path};

use super::{Item, MujocoVersion, compare, ffi::ITEMS, items_of_shim};
use crate::error::SimError;

#[test]
fn versions_are_spelled_as_mujoco_does() {
    assert_eq!(MujocoVersion(222).to_string(), "2.2.2");
    assert_eq!(MujocoVersion(330).to_string(), "3.3.0");
    assert_eq!(MujocoVersion(3_006_000).to_string(), "3.6.0");
}

#[cfg(not(fetch_sim_no_shim))]
#[test]
fn the_shim_and_rust_share_one_contract() {
    assert_eq!(compare(&items_of_shim(), ITEMS), Ok(()));
    assert!(ITEMS.len() > 60, "{} items", ITEMS.len());
}

#[cfg(fetch_sim_no_shim)]
#[test]
fn a_missing_shim_shares_nothing() {
    assert_eq!(items_of_shim(), []);
    assert_eq!(MujocoVersion::of_headers(), None);
    assert_eq!(MujocoVersion::of_library(), Err(SimError::BuiltWithoutMujoco));
}

#[test]
fn a_mismatch_is_an_error_that_names_the_item() {
    let mismatch = |shim: &[Item]| match compare(shim, ITEMS) {
        Err(SimError::ShimMismatch { item, .. }) => item,
        other => panic!("{other:?}"),
    };
    for (at, &(name, value, size)) in ITEMS.iter().enumerate() {
        let with = |changed: &[Item]| [&ITEMS[..at], changed, &ITEMS[at + 1..]].concat();
        assert_eq!(mismatch(&with(&[(name, value + 1, size)])), name);
        assert_eq!(mismatch(&with(&[(name, value, size + 4)])), name);
        assert_eq!(mismatch(&with(&[])), name);
    }
    assert_eq!(mismatch(&[ITEMS, &[("fs_sizes.nkey", 0, 4)]].concat()), "fs_sizes.nkey");
}

/// The words of a text that follow `before` and are followed by `after`.
fn words(text: &str, before: &str, after: char) -> BTreeSet<String> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let word = |rest: &str| {
        let (word, rest) = rest.split_at(rest.find(|c| !is_word(c))?);
        (rest.starts_with(after) && word.starts_with("mj")).then(|| word.to_owned())
    };
    text.split(before).skip(1).filter_map(word).collect()
}

/// MuJoCo's functions may end the process, so the shim must call each of them within a guarded
/// statement. It reaches them through the `mj` of that statement, and the linker knows no other
/// way.
#[test]
fn every_function_of_mujoco_is_called_under_the_guard() {
    let shim = Path::new(env!("CARGO_MANIFEST_DIR")).join("shim");
    let read = |name: &str| fs::read_to_string(shim.join(name)).expect("a source of the shim");
    let mut listed = words(&read("internal.h"), "X(", ')');
    assert!(listed.remove("mj_version"), "the library is checked before it is loaded");
    let sources =
        ["library.c", "model.c", "data.c", "render.c", "gl_context.c", "contact_filter.c"];
    let called: BTreeSet<_> =
        sources.iter().flat_map(|source| words(&read(source), "mj->", '(')).collect();
    assert_eq!(called, listed);
    assert!(listed.len() > 25, "{listed:?}");
}
