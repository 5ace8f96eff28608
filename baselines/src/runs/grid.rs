//! The description of a grid, as a user writes it.

use std::collections::BTreeSet;
use std::fmt;

use fetch_env::{EnvId, MakeError};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{Error as _, MapAccess, Visitor},
};
use serde_json::{Map, Value};

use super::description::file_name;
use super::error::GridError;
use crate::learn::{Preset, SettingError, TrainSettings, limits, nearest};

/// A grid: every choice of values with every seed.
///
/// Its file is JSON: `env_id` and `preset`; `seeds`, a list; `set`, an object with a list of values
/// for each setting; `steps` and `target`, which end a run and may be left out; and
/// `one_at_a_time`, which is false unless it is given. With true, at most one setting has another
/// value than its first, which shows what each change is worth alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    env_id: String,
    preset: String,
    steps: Option<u64>,
    target: Option<f64>,
    #[serde(rename = "set", default)]
    axes: Axes,
    #[serde(default, skip_serializing_if = "is_false")]
    one_at_a_time: bool,
    seeds: Vec<u64>,
}

/// The names of the fields in the file.
const FIELDS: [&str; 7] = ["env_id", "preset", "steps", "target", "set", "one_at_a_time", "seeds"];

/// The largest number of runs.
const MOST_RUNS: usize = 1_000;

/// The values of settings, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
struct Axes(Vec<(String, Vec<Value>)>);

impl Grid {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// [`GridError`] if it is not JSON, a key is unknown or missing, or a list is empty, has an
    /// entry twice or makes too many runs.
    pub fn parse(text: &str) -> Result<Self, GridError> {
        let fields: Map<String, Value> = serde_json::from_str(text)?;
        if let Some(key) = fields.keys().find(|key| !FIELDS.contains(&key.as_str())) {
            let nearest = nearest(FIELDS.into_iter(), key);
            return Err(GridError::UnknownKey { key: key.clone(), nearest });
        }
        let grid: Self = serde_json::from_slice(text.as_bytes())?;
        let lists = grid.axes.0.iter().map(|(key, values)| (key.as_str(), values.len()));
        if let Some((key, _)) =
            lists.clone().chain([("seeds", grid.seeds.len())]).find(|(_, len)| *len == 0)
        {
            return Err(GridError::Empty { key: key.to_owned() });
        }
        let longer = |num_choices: usize, (_, len): (&str, usize)| match grid.one_at_a_time {
            true => num_choices.saturating_add(len - 1),
            false => num_choices.saturating_mul(len),
        };
        let num_runs = lists.fold(1, longer).saturating_mul(grid.seeds.len());
        if num_runs > MOST_RUNS {
            return Err(GridError::TooMany { num_runs, most: MOST_RUNS });
        }
        let mut seeds = BTreeSet::new();
        match grid.seeds.iter().find(|seed| !seeds.insert(**seed)) {
            Some(seed) => Err(GridError::Repeated { what: format!("seed {seed}") }),
            None => Ok(grid),
        }
    }

    /// Returns the environment.
    ///
    /// # Errors
    /// [`GridError::Value`] if there is none of this name.
    pub fn env_id(&self) -> Result<EnvId, GridError> {
        let wrong = |error: MakeError| GridError::value("env_id", &error);
        self.env_id.parse().map_err(wrong)
    }

    /// Returns the settings of the learner to start from.
    ///
    /// # Errors
    /// [`GridError::Value`] if there is no preset of this name.
    pub fn preset(&self) -> Result<Preset, GridError> {
        let wrong = |error: SettingError| GridError::value("preset", &error);
        self.preset.parse().map_err(wrong)
    }

    /// Returns the steps and the success rate at which a run ends.
    ///
    /// # Errors
    /// As [`env_id`](Self::env_id).
    pub fn limits(&self) -> Result<(u64, f64), GridError> {
        let (steps, target) = limits(self.env_id()?.task);
        Ok((self.steps.unwrap_or(steps), self.target.unwrap_or(target)))
    }

    /// Returns the seeds of each choice of values.
    #[must_use]
    pub fn seeds(&self) -> &[u64] {
        &self.seeds
    }

    /// Returns the settings that the grid changes, in the order of the file, each with its values.
    #[must_use]
    pub fn axes(&self) -> &[(String, Vec<Value>)] {
        &self.axes.0
    }

    /// Whether at most one setting of a choice has another value than its first.
    #[must_use]
    pub const fn is_one_at_a_time(&self) -> bool {
        self.one_at_a_time
    }

    /// Returns every choice of values, with the preset's settings changed by it. The last value
    /// changes first.
    ///
    /// # Errors
    /// [`GridError::Value`] if a setting or a value is wrong, and [`GridError::Repeated`] if two
    /// choices are the same.
    pub fn choices(&self, preset: &TrainSettings) -> Result<Vec<Choice<'_>>, GridError> {
        let mut choices = vec![(Vec::<&Value>::new(), preset.clone())];
        for (key, values) in &self.axes.0 {
            let mut longer = Vec::new();
            for (choice, settings) in &choices {
                let mut chosen = choice.iter().zip(&self.axes.0);
                let has_changed = chosen.any(|(value, (_, values))| **value != values[0]);
                let num_values = if self.one_at_a_time && has_changed { 1 } else { values.len() };
                for value in &values[..num_values] {
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

    /// Returns values with their settings.
    fn assignments(&self, values: &[&Value]) -> Vec<String> {
        let keys = self.axes.0.iter().map(|(key, _)| key);
        keys.zip(values).map(|(key, value)| format!("{key}={value}")).collect()
    }
}

fn is_false(value: &bool) -> bool {
    !value
}

/// A value for each setting.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Choice<'a> {
    /// The values, in the order of [`Grid::axes`].
    pub values: Vec<&'a Value>,
    /// The values with their settings, such as `gamma=0.98`.
    pub assignments: Vec<String>,
    /// The assignments that differ between choices.
    pub parts: Vec<String>,
    /// The settings of the learner.
    pub settings: TrainSettings,
}

impl Choice<'_> {
    /// Returns the choice as part of a path, which does not depend on the order of its settings.
    #[must_use]
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
