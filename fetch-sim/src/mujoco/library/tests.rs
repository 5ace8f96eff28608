//! Tests of the contract and of what is loaded.

#[cfg(not(fetch_sim_no_shim))]
mod search;

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
