//! Environments by name, including users' own.

use std::{collections::BTreeMap, fmt, sync::Arc};

use super::error::EnvError;

/// A collection of environments that are made by name.
///
/// Names are Gymnasium's: `Name-v1` or `namespace/Name-v1`. A registry is a value; there is no
/// global one, so no library changes what another makes. All its environments are of one type,
/// which may be a boxed trait object.
///
/// ```
/// use fetch_env::{Env, FetchConfig, FetchEnv, KinematicSimulator, Registry, RewardKind, Task};
///
/// let mut registry = Registry::kinematic(); // `Registry::fetch()` has them on MuJoCo
/// registry.register("lab/FetchPushFar-v1", || {
///     let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_target_range(0.3)?;
///     let simulator = KinematicSimulator::new(config.sim());
///     Ok(FetchEnv::new(config, simulator)?.time_limited())
/// })?;
/// let mut env = registry.make("lab/FetchPushFar-v1")?;
/// env.reset(Some(0))?;
/// let newest = registry.make("FetchPush")?;
/// assert_eq!(newest.inner().config().task(), Task::Push);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Registry<E> {
    constructors: BTreeMap<String, Constructor<E>>,
}

type Constructor<E> = Box<dyn Fn() -> Result<E, EnvError> + Send + Sync>;

impl<E: 'static> Registry<E> {
    /// Creates a registry without environments.
    #[must_use]
    pub const fn new() -> Self {
        Self { constructors: BTreeMap::new() }
    }

    /// Adds an environment, made by `constructor`.
    ///
    /// # Errors
    /// [`RegistryError::Malformed`] if the name is not `Name`, `Name-v1`, `namespace/Name` or
    /// `namespace/Name-v1`, of letters, digits and `_:.-`; [`RegistryError::Taken`] if it is in
    /// use.
    pub fn register(
        &mut self,
        id: impl Into<String>,
        constructor: impl Fn() -> Result<E, EnvError> + Send + Sync + 'static,
    ) -> Result<(), RegistryError> {
        let id = id.into();
        if !is_well_formed(&id) {
            return Err(RegistryError::Malformed { id });
        }
        if self.constructors.contains_key(&id) {
            return Err(RegistryError::Taken { id });
        }
        self.constructors.insert(id, Box::new(constructor));
        Ok(())
    }

    /// Creates the environment of this name; a name without a version means the newest one.
    ///
    /// # Errors
    /// [`RegistryError::Unknown`], which lists the nearest names, if there is none;
    /// [`RegistryError::Make`] if its constructor fails.
    pub fn make(&self, id: &str) -> Result<E, RegistryError> {
        let exact = self.constructors.get(id);
        let constructor = exact.or_else(|| self.newest(id)).ok_or_else(|| self.unknown(id))?;
        Ok(constructor()?)
    }

    /// Iterates over the names, in alphabetical order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = &str> {
        self.constructors.keys().map(String::as_str)
    }

    /// Changes every environment after it is made: wraps it, or boxes it as a trait object so that
    /// environments of other types can be added.
    #[must_use]
    pub fn map<F: 'static>(
        self,
        change: impl Fn(E) -> Result<F, EnvError> + Send + Sync + 'static,
    ) -> Registry<F> {
        let change = Arc::new(change);
        let changed = |(id, make): (String, Constructor<E>)| {
            let change = Arc::clone(&change);
            (id, Box::new(move || change(make()?)) as _)
        };
        Registry { constructors: self.constructors.into_iter().map(changed).collect() }
    }

    /// Creates a registry in which `make` makes all of `ids`.
    pub(crate) fn of<T: Copy + ToString + Send + Sync + 'static>(
        ids: impl IntoIterator<Item = T>,
        make: fn(T) -> Result<E, EnvError>,
    ) -> Self {
        let constructor = |id: T| (id.to_string(), Box::new(move || make(id)) as _);
        Self { constructors: ids.into_iter().map(constructor).collect() }
    }

    fn newest(&self, name: &str) -> Option<&Constructor<E>> {
        let versions = self.constructors.iter().filter_map(|(id, constructor)| {
            let (theirs, version) = versioned(id)?;
            (theirs == name).then_some((version, constructor))
        });
        versions.max_by_key(|&(version, _)| version).map(|(_, constructor)| constructor)
    }

    fn unknown(&self, id: &str) -> RegistryError {
        let mut nearest: Vec<String> = self.constructors.keys().cloned().collect();
        sort_by_similarity(id, &mut nearest);
        nearest.truncate(3);
        RegistryError::Unknown { id: id.into(), nearest }
    }
}

/// Splits a name from its version.
fn versioned(id: &str) -> Option<(&str, u32)> {
    let (name, version) = id.rsplit_once("-v")?;
    let is_number = version.bytes().all(|byte| byte.is_ascii_digit());
    Some((name, version.parse().ok().filter(|_| is_number)?))
}

/// Whether a name follows Gymnasium's rules.
fn is_well_formed(id: &str) -> bool {
    let consists_of = |text: &str, marks: &str| {
        !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || marks.contains(c))
    };
    let (namespace, name) = id.split_once('/').unwrap_or(("none", id));
    let name = versioned(name).map_or(name, |(name, _)| name);
    consists_of(namespace, "_:-") && consists_of(name, "_:.-")
}

impl<E: 'static> Default for Registry<E> {
    fn default() -> Self {
        Self::new()
    }
}

impl<E> fmt::Debug for Registry<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.constructors.keys()).finish()
    }
}

/// Error returned when a [`Registry`] cannot add or make an environment.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistryError {
    /// The name does not follow the rules.
    #[error("{id:?} is not an environment name: pass one such as Name-v1 or namespace/Name-v1")]
    Malformed {
        /// The name.
        id: String,
    },
    /// The name is in use.
    #[error("there is already an environment {id:?}: give the new one another name or version")]
    Taken {
        /// The name.
        id: String,
    },
    /// No environment has this name.
    #[error("there is no environment {id:?}: {}", advice(nearest))]
    Unknown {
        /// The name.
        id: String,
        /// Up to three environments with the most similar names, the nearest first.
        nearest: Vec<String>,
    },
    /// The constructor failed.
    #[error(transparent)]
    Make(#[from] EnvError),
}

debug_as_display!(RegistryError);

impl From<RegistryError> for EnvError {
    fn from(error: RegistryError) -> Self {
        match error {
            RegistryError::Make(error) => error,
            error => Self::other(error),
        }
    }
}

fn advice(nearest: &[String]) -> String {
    match nearest {
        [] => "register one first".into(),
        names => format!("the nearest are {}", names.join(", ")),
    }
}

/// Sorts names by their similarity to `id`, ignoring case, the nearest first.
pub(crate) fn sort_by_similarity(id: &str, known: &mut [String]) {
    let lowercase = id.to_lowercase();
    known
        .sort_by_cached_key(|known| strsim::damerau_levenshtein(&lowercase, &known.to_lowercase()));
}
