//! The file that describes a grid, as a user writes it.

use std::{collections::BTreeSet, fmt};

use baselines::learn::{Preset, SettingError, TrainSettings, nearest};
use fetch_env::{EnvId, MakeError};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{Error as _, MapAccess, Visitor},
};
use serde_json::{Map, Value};

use super::{super::files::file_name, GridError};

/// A grid: every choice of values with every seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    env_id: String,
    preset: String,
    /// As in the flags `--steps` and `--target`.
    pub steps: Option<u64>,
    pub target: Option<f64>,
    /// The values of each setting that the grid sets.
    #[serde(rename = "set", default)]
    pub axes: Axes,
    pub seeds: Vec<u64>,
}

/// The names of the fields in the file.
const FIELDS: [&str; 6] = ["env_id", "preset", "steps", "target", "set", "seeds"];

/// The largest number of runs.
const MOST_RUNS: usize = 1_000;

/// The values of settings, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axes(pub Vec<(String, Vec<Value>)>);

impl Grid {
    /// Reads the text of a file.
    pub fn parse(text: &str) -> Result<Self, GridError> {
        let fields: Map<String, Value> = serde_json::from_str(text)?;
        if let Some(key) = fields.keys().find(|key| !FIELDS.contains(&key.as_str())) {
            let nearest = nearest(FIELDS.into_iter(), key);
            return Err(GridError::UnknownKey { key: key.clone(), nearest });
        }
        let grid: Self = serde_json::from_str(text)?;
        let lists = grid.axes.0.iter().map(|(key, values)| (key.as_str(), values.len()));
        let mut num_runs = 1_usize;
        for (key, len) in lists.chain([("seeds", grid.seeds.len())]) {
            if len == 0 {
                return Err(GridError::Empty { key: key.to_owned() });
            }
            num_runs = num_runs.saturating_mul(len);
        }
        if num_runs > MOST_RUNS {
            return Err(GridError::TooMany { num_runs, most: MOST_RUNS });
        }
        let mut seeds = BTreeSet::new();
        match grid.seeds.iter().find(|seed| !seeds.insert(**seed)) {
            Some(seed) => Err(GridError::Repeated { what: format!("seed {seed}") }),
            None => Ok(grid),
        }
    }

    pub fn env_id(&self) -> Result<EnvId, GridError> {
        let wrong = |error: MakeError| GridError::value("env_id", &error);
        self.env_id.parse().map_err(wrong)
    }

    pub fn preset(&self) -> Result<Preset, GridError> {
        self.preset.parse().map_err(|error: SettingError| GridError::value("preset", &error))
    }

    pub fn preset_name(&self) -> &str {
        &self.preset
    }

    /// Returns every choice of values, with the preset's settings changed by it. The last value
    /// changes first.
    pub fn choices(&self, preset: &TrainSettings) -> Result<Vec<Choice<'_>>, GridError> {
        let mut choices = vec![(Vec::new(), preset.clone())];
        for (key, values) in &self.axes.0 {
            let mut longer = Vec::new();
            for (choice, settings) in &choices {
                for value in values {
                    let settings = settings
                        .with_value(key, value.clone())
                        .map_err(|error| GridError::value("set", &error))?;
                    longer.push(([choice.as_slice(), &[value]].concat(), settings));
                }
            }
            choices = longer;
        }
        for (number, (values, settings)) in choices.iter().enumerate() {
            if choices[..number].iter().any(|(_, other)| other == settings) {
                return Err(GridError::Repeated { what: self.assignments(values).join(", ") });
            }
        }
        let choices = choices.into_iter().map(|(values, settings)| {
            let assignments = self.assignments(&values);
            let differs = self.axes.0.iter().map(|(_, values)| values.len() > 1);
            let parts = assignments.iter().zip(differs).filter(|(_, differs)| *differs);
            let parts = parts.map(|(part, _)| part.clone()).collect();
            Choice { values, assignments, parts, settings }
        });
        Ok(choices.collect())
    }

    /// Returns values in the form of `--set`.
    fn assignments(&self, values: &[&Value]) -> Vec<String> {
        let keys = self.axes.0.iter().map(|(key, _)| key);
        keys.zip(values).map(|(key, value)| format!("{key}={value}")).collect()
    }
}

/// A value for each setting.
pub struct Choice<'a> {
    pub values: Vec<&'a Value>,
    /// The values in the form of `--set`.
    pub assignments: Vec<String>,
    /// The assignments that differ between choices.
    pub parts: Vec<String>,
    pub settings: TrainSettings,
}

impl Choice<'_> {
    /// Returns the choice as part of a path, which does not depend on the order of its settings.
    pub fn file_name(&self) -> String {
        let mut parts: Vec<_> = self.parts.iter().map(|part| file_name(part)).collect();
        parts.sort();
        if parts.is_empty() { "preset".to_owned() } else { parts.join("-") }
    }
}

impl Serialize for Axes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, values)| (key, values)))
    }
}

impl<'de> Deserialize<'de> for Axes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(AxesVisitor)
    }
}

/// Reads an object in its order, and refuses repeated keys.
struct AxesVisitor;

impl<'de> Visitor<'de> for AxesVisitor {
    type Value = Axes;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object with a list of values for each setting")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Axes, A::Error> {
        let mut axes: Vec<(String, Vec<Value>)> = Vec::new();
        while let Some((key, values)) = map.next_entry::<String, Value>()? {
            let Value::Array(values) = values else {
                let reason = format!("{key} is {values}: write a list, such as [{values}]");
                return Err(A::Error::custom(reason));
            };
            if axes.iter().any(|(other, _)| *other == key) {
                return Err(A::Error::custom(format!("{key} appears twice")));
            }
            axes.push((key, values));
        }
        Ok(Axes(axes))
    }
}
