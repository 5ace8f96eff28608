//! A model held in memory.

use std::{fmt, sync::Arc};

use serde::{Deserialize, Serialize};

/// The MJCF files of a model, held in memory: the main file first, which may include the others by
/// their names.
///
/// Copies share the contents, so they are cheap.
///
/// ```
/// use fetch_sim::ModelFiles;
///
/// let files = ModelFiles::new("ball.xml", r#"<mujoco><include file="world.xml"/></mujoco>"#)
///     .with_file("world.xml", r#"<mujocoinclude><worldbody/></mujocoinclude>"#);
/// assert_eq!(files.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["ball.xml", "world.xml"]);
/// ```
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Vec<(String, String)>", into = "Vec<(String, String)>")]
#[must_use]
pub struct ModelFiles(Arc<[(String, String)]>);

impl ModelFiles {
    /// Creates a model of one file.
    pub fn new(name: impl Into<String>, contents: impl Into<String>) -> Self {
        vec![(name.into(), contents.into())].into()
    }

    /// Adds a file, or replaces the one of this name.
    pub fn with_file(self, name: impl Into<String>, contents: impl Into<String>) -> Self {
        let (name, contents) = (name.into(), contents.into());
        let mut files = Vec::from(self);
        match files.iter_mut().find(|(other, _)| *other == name) {
            Some((_, old)) => *old = contents,
            None => files.push((name, contents)),
        }
        files.into()
    }

    /// Returns the contents of a file; `None` if there is no file of this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&str> {
        self.iter().find_map(|(other, contents)| (other == name).then_some(contents))
    }

    /// Returns the name and the contents of each file, the main file first.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(name, contents)| (name.as_str(), contents.as_str()))
    }
}

/// Collects names and contents; the main file comes first.
impl<N: Into<String>, C: Into<String>> FromIterator<(N, C)> for ModelFiles {
    fn from_iter<I: IntoIterator<Item = (N, C)>>(files: I) -> Self {
        Self(files.into_iter().map(|(name, contents)| (name.into(), contents.into())).collect())
    }
}

impl From<Vec<(String, String)>> for ModelFiles {
    fn from(files: Vec<(String, String)>) -> Self {
        Self(files.into())
    }
}

impl From<ModelFiles> for Vec<(String, String)> {
    fn from(ModelFiles(files): ModelFiles) -> Self {
        files.to_vec()
    }
}

/// Prints names and lengths, because error messages show the source of a model.
impl fmt::Debug for ModelFiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lengths = self.iter().map(|(name, contents)| (name, contents.len()));
        f.write_str("ModelFiles ")?;
        f.debug_map().entries(lengths).finish()
    }
}
