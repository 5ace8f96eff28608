//! What users say of mirror images: a letter for each element of a vector.

use goal_reward::{Mirror, Mirrored, Symmetry, SymmetryError};
use nalgebra::Vector3;
use serde::Deserialize;

use crate::error::{Error, Result};

/// How a task in Python looks in a mirror.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TaskMirror {
    goal: Elements,
    #[serde(default)]
    extra: Elements,
    #[serde(default)]
    axes: Axes,
}

impl TaskMirror {
    /// Checks the lengths.
    pub(crate) fn check(&self, goal_len: usize, extra_len: usize) -> Result<()> {
        self.goal.check("goal", goal_len)?;
        self.extra.check("extra", extra_len)
    }

    /// Returns the symmetries of the task, from the robot's and the center of their mirrors.
    pub(crate) fn symmetries(
        &self,
        robot: &[Symmetry; 3],
        center: Vector3<f64>,
    ) -> Result<Vec<Symmetry>, SymmetryError> {
        let symmetry = |turn: &usize| {
            let (robot, planes) = (&robot[*turn], planes(*turn, center));
            let observation = robot.observation.clone().followed_by(&self.extra.image(planes)?);
            let goal = self.goal.image(planes)?;
            Ok(Symmetry { observation, goal, ..robot.clone() })
        };
        self.axes.turns().iter().map(symmetry).collect()
    }
}

/// How another environment looks in a mirror.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EnvMirror {
    observation: Elements,
    goal: Elements,
    action: Elements,
    #[serde(default)]
    axes: Axes,
    #[serde(default)]
    center: [f64; 2],
}

impl EnvMirror {
    /// Returns the symmetries of an environment whose vectors have these lengths.
    pub(crate) fn symmetries(&self, dims: goal_reward::Dims) -> Result<Vec<Symmetry>> {
        self.observation.check("observation", dims.observation)?;
        self.goal.check("goal", dims.goal)?;
        self.action.check("action", dims.action)?;
        let [x, y] = self.center;
        let symmetry = |turn: &usize| -> Result<_, SymmetryError> {
            let planes = planes(*turn, Vector3::new(x, y, 0.0));
            let (observation, goal) = (self.observation.image(planes)?, self.goal.image(planes)?);
            Ok(Symmetry { observation, goal, action: self.action.image(planes)? })
        };
        self.axes.turns().iter().map(symmetry).collect::<Result<_, _>>().map_err(Error::value)
    }
}

/// The axes along which mirrors turn things around.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
enum Axes {
    #[default]
    #[serde(rename = "y")]
    Y,
    #[serde(rename = "x")]
    X,
    /// One, the other and both, by turns.
    #[serde(rename = "xy")]
    Both,
}

impl Axes {
    /// Returns indices of the robot's symmetries.
    const fn turns(self) -> &'static [usize] {
        match self {
            Self::Y => &[0],
            Self::X => &[1],
            Self::Both => &[0, 1, 2],
        }
    }
}

/// The positions of the planes across x, y and z, where there are any.
type Planes = [Option<f64>; 3];

/// Returns the planes of the robot's symmetry with this index.
const fn planes(turn: usize, center: Vector3<f64>) -> Planes {
    let [[x, y, _]] = center.data.0;
    match turn {
        0 => [None, Some(y), None],
        1 => [Some(x), None, None],
        _ => [Some(x), Some(y), None],
    }
}

/// What an element of a vector is, along or about x, y or z.
#[derive(Clone, Copy, Debug)]
enum Element {
    Position(usize),
    /// A difference of two positions, or a velocity.
    Difference(usize),
    /// A rotation, or an angular velocity.
    Turn(usize),
    Other,
}

impl Element {
    fn of(letter: char) -> Result<Self, String> {
        Ok(match letter {
            'X' => Self::Position(0),
            'Y' => Self::Position(1),
            'Z' => Self::Position(2),
            'x' => Self::Difference(0),
            'y' => Self::Difference(1),
            'z' => Self::Difference(2),
            'u' => Self::Turn(0),
            'v' => Self::Turn(1),
            'w' => Self::Turn(2),
            '.' => Self::Other,
            other => {
                return Err(format!(
                    "there is no letter {other:?}: pass X, Y and Z for positions, x, y and z for \
                     differences and velocities, u, v and w for rotations about x, y and z, and . \
                     for what stays"
                ));
            }
        })
    }

    fn rule(self, index: usize, planes: Planes) -> Mirrored {
        let is_negated = match self {
            Self::Position(axis) => match planes[axis] {
                Some(plane) => return Mirrored::across(index, plane),
                None => false,
            },
            Self::Difference(axis) => planes[axis].is_some(),
            // A mirror keeps the direction of rotations about the axis perpendicular to it.
            Self::Turn(axis) => {
                let others = (0..3).filter(|other| *other != axis && planes[*other].is_some());
                others.count() % 2 == 1
            }
            Self::Other => false,
        };
        if is_negated { Mirrored::negated(index) } else { Mirrored::same(index) }
    }
}

/// The elements of a vector.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(try_from = "String")]
struct Elements(Vec<Element>);

impl TryFrom<String> for Elements {
    type Error = String;

    fn try_from(letters: String) -> Result<Self, String> {
        letters.chars().map(Element::of).collect::<Result<_, _>>().map(Self)
    }
}

impl Elements {
    fn check(&self, what: &str, len: usize) -> Result<()> {
        if self.0.len() == len {
            return Ok(());
        }
        let letters = self.0.len();
        Err(Error::value(format!(
            "mirror: {what} has {letters} letters: pass one for each of its {len} elements"
        )))
    }

    fn image(&self, planes: Planes) -> Result<Mirror, SymmetryError> {
        let rules = self.0.iter().enumerate().map(|(index, element)| element.rule(index, planes));
        Mirror::new(rules.collect::<Vec<_>>())
    }
}
