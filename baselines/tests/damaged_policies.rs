//! Damaged or forged policy files are rejected, or are still policies.

use std::sync::LazyLock;

use baselines::{Policy, TrainedPolicy, TrainedPolicyError};
use fetch_env::{Env, FetchObservation, Task, make_kinematic};
use proptest::{prelude::*, sample::Index};
use serde_json::{Value, json};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// A policy that learned, whose file has normalizers and several layers.
static REAL: LazyLock<Vec<u8>> = LazyLock::new(|| {
    TrainedPolicy::shipped(Task::Reach).and_then(|policy| policy.to_bytes()).expect("it is whole")
});

/// The header of a file: the tensors, and the policy's own header as text.
fn parts(file: &[u8]) -> (Value, &[u8]) {
    let len = u64::from_le_bytes(*file.first_chunk().expect("a length")) as usize;
    let header = serde_json::from_slice(&file[8..8 + len]).expect("a header");
    (header, &file[8 + len..])
}

fn file(header: &Value, data: &[u8]) -> Vec<u8> {
    let header = header.to_string();
    let len = (header.len() as u64).to_le_bytes();
    [&len, header.as_bytes(), data].concat()
}

/// Changes the header of the real file.
fn with_header(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let (mut header, data) = parts(&REAL);
    change(&mut header);
    file(&header, data)
}

/// Changes the policy's own header.
fn with_policy(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    with_header(|header| {
        let text = header["__metadata__"]["policy"].as_str().expect("a policy");
        let mut policy = serde_json::from_str(text).expect("JSON");
        change(&mut policy);
        header["__metadata__"]["policy"] = policy.to_string().into();
    })
}

fn observation() -> FetchObservation {
    let mut env = make_kinematic("FetchReach-v4").expect("an environment");
    env.reset(Some(0)).expect("a reset").observation
}

/// Loads a file, and lets its policy act if it is one.
fn load_and_act(file: &[u8]) -> Result<(), TrainedPolicyError> {
    let mut policy = TrainedPolicy::from_bytes(file)?;
    policy.act(&observation(), &mut [0.0; 4]);
    policy.to_bytes().map(drop)
}

#[test]
fn headers_that_claim_too_much_are_refused() {
    let huge = u64::MAX;
    let tensor = "layers.0.weight";
    let with_tensor =
        |key: &str, value: Value| with_header(|header| header[tensor][key] = value.clone());
    let with_length = |len: u64| [&len.to_le_bytes(), &REAL[8..]].concat();
    for (what, file) in [
        ("shape", with_tensor("shape", json!([huge, huge]))),
        ("shape", with_tensor("shape", json!([1_u64 << 32, 1_u64 << 32]))),
        ("shape", with_tensor("shape", json!([0, huge]))),
        ("offsets", with_tensor("data_offsets", json!([0, huge]))),
        ("offsets", with_tensor("data_offsets", json!([huge, 0]))),
        ("type", with_tensor("dtype", json!("F64"))),
        ("length", with_length(huge)),
        ("length", with_length(1 << 40)),
        ("observation_len", with_policy(|policy| policy["observation_len"] = json!(huge))),
        ("goal_len", with_policy(|policy| policy["goal_len"] = json!(1_u64 << 62))),
        ("action_len", with_policy(|policy| policy["action_len"] = json!(huge))),
        ("inputs", with_policy(|policy| policy["inputs"] = json!(vec!["observation"; 100_000]))),
        ("settings", with_policy(|policy| policy["settings"] = json!("[".repeat(10)))),
    ] {
        let is_forged = what != "settings";
        assert_eq!(load_and_act(&file).is_err(), is_forged, "{what}");
    }
    let nested = format!("{{\"a\":{}", "[".repeat(1 << 20));
    let nested = [&(nested.len() as u64).to_le_bytes(), nested.as_bytes()].concat();
    assert!(matches!(load_and_act(&nested), Err(TrainedPolicyError::Format { .. })));
}

/// A policy whose normalizers are for other environments, or have scales that no update gives.
#[test]
fn forged_normalizers_are_refused_or_harmless() -> Result {
    for key in ["observation_normalizer", "goal_normalizer"] {
        let normalizer =
            |change: fn(&mut Value)| load_and_act(&with_policy(|policy| change(&mut policy[key])));
        assert!(normalizer(|scale| *scale = json!({})).is_err(), "{key}");
        assert!(normalizer(|scale| *scale = json!([1.0])).is_err(), "{key}");
        normalizer(|scale| *scale = Value::Null)?;
    }
    Ok(())
}

/// Replaces a number, a text or a list somewhere in JSON.
fn forge(value: &mut Value, at: &mut usize, new: &Value) {
    if *at == 0 {
        *value = new.clone();
        *at = usize::MAX;
        return;
    }
    *at -= 1;
    let children: Box<dyn Iterator<Item = &mut Value>> = match value {
        Value::Array(list) => Box::new(list.iter_mut()),
        Value::Object(entries) => Box::new(entries.values_mut()),
        _ => return,
    };
    for child in children {
        if *at != usize::MAX {
            forge(child, at, new);
        }
    }
}

fn any_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        any::<u64>().prop_map(Value::from),
        any::<i64>().prop_map(Value::from),
        (0..30_u64).prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        any::<bool>().prop_map(Value::from),
        ".{0,12}".prop_map(Value::from),
        Just(Value::Null),
        Just(json!([])),
        Just(json!({})),
        Just(json!([1e308, -1e308, 5e-324])),
    ]
}

proptest! {
    /// A part of the policy's header, or of the file's, is replaced by another value.
    #[test]
    fn forged_headers_never_panic(at in 0..200_usize, new in any_value(), of_policy: bool) {
        let change = |header: &mut Value| forge(header, &mut at.clone(), &new);
        let file = if of_policy { with_policy(change) } else { with_header(change) };
        let _ = load_and_act(&file);
    }

    #[test]
    fn damaged_files_never_panic(
        flips in prop::collection::vec((any::<Index>(), 0..8_u8, any::<bool>()), 0..8),
        repeated in prop::option::of(any::<Index>()),
        cut in prop::option::of(any::<Index>()),
    ) {
        let mut file = REAL.clone();
        for (at, bit, in_header) in flips {
            // Most of the file is weights.
            let len = if in_header { 4_000.min(file.len()) } else { file.len() };
            file[at.index(len)] ^= 1 << bit;
        }
        if let Some(repeated) = repeated {
            file.extend_from_within(repeated.index(file.len())..);
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len()));
        }
        let _ = load_and_act(&file);
    }

    #[test]
    fn random_bytes_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        len in 0..300_u64,
    ) {
        prop_assert!(TrainedPolicy::from_bytes(&bytes).is_err());
        prop_assert!(TrainedPolicy::from_bytes(&[&len.to_le_bytes(), &*bytes].concat()).is_err());
    }
}
