//! Settings by their names in JSON, with errors for Python.

use baselines::learn::nearest;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

use crate::error::{Error, Result};

/// Returns settings with those changed that JSON names.
pub(super) fn with<S: Serialize + DeserializeOwned>(settings: S, changes: &str) -> Result<S> {
    if changes == "{}" {
        return Ok(settings);
    }
    let changes: Map<String, Value> = serde_json::from_str(changes).map_err(Error::value)?;
    let mut all = serde_json::to_value(&settings).map_err(Error::value)?;
    let mut changed = settings;
    for (name, value) in changes {
        match all.get_mut(&name) {
            Some(place) => *place = value,
            None => {
                let names = all.as_object().into_iter().flat_map(Map::keys);
                let names: Vec<_> = names.map(String::as_str).collect();
                return Err(Error::value(unknown(&name, &names)));
            }
        }
        changed = S::deserialize(&all).map_err(|error| explained(&name, &error))?;
    }
    Ok(changed)
}

/// Reads the setting of this name.
pub(super) fn parse<S: DeserializeOwned>(name: &str, json: &str) -> Result<S> {
    let value: Value = serde_json::from_str(json).map_err(Error::value)?;
    S::deserialize(value).map_err(|error| explained(name, &error))
}

/// Returns the message of a name that none of these is.
fn unknown(name: &str, names: &[&str]) -> String {
    let nearest = nearest(names.iter().copied(), name);
    format!("there is no {name}; did you mean {nearest}? All are: {}", names.join(", "))
}

/// Returns the error of a setting, in words of Python.
fn explained(name: &str, error: &serde_json::Error) -> Error {
    let text = error.to_string();
    let quoted: Vec<_> = text.split('`').skip(1).step_by(2).collect();
    let parts = text.strip_prefix("invalid ").and_then(|rest| rest.split_once(": "));
    let parts = parts.and_then(|(_, rest)| rest.rsplit_once(", expected "));
    let message = match (&*quoted, parts) {
        ([name, names @ ..], _) if text.starts_with("unknown ") => unknown(name, names),
        ([missing], _) if text.starts_with("missing ") => format!("pass {missing}, too"),
        (_, Some((found, expected))) => {
            format!("pass {}, not {}", in_python(expected), in_python(found))
        }
        _ => text,
    };
    Error::value(format!("{name}: {message}"))
}

/// Returns what serde calls a kind of value as Python calls it.
fn in_python(kind: &str) -> &str {
    match kind {
        "f64" => "a number",
        "u64" | "usize" => "an integer from 0 on",
        "a nonzero usize" => "an integer from 1 on",
        "a boolean" => "True or False",
        "a sequence" | "sequence" => "a list",
        "string or map" => "a name or a dictionary",
        "null" => "None",
        "map" => "a dictionary",
        "unit variant" => "a name alone",
        kind if kind.starts_with("struct ") => "a dictionary",
        kind if kind.starts_with("unit") => "a name alone",
        kind => kind,
    }
}
