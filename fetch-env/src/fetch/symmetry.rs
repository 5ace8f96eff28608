//! Mirror symmetries of Fetch: left-right and front-back.

use fetch_sim::{ModelSource, Simulator, Task};
use goal_reward::{Mirror, Mirrored, Symmetry, SymmetryError};

use super::env::FetchEnv;
use super::layout::{Kind, observation_fields};
use super::task::FetchTask;

/// One or two mirrors: the positions of the planes across the x axis and the y axis, in meters.
#[derive(Clone, Copy)]
struct Planes {
    x: Option<f64>,
    y: Option<f64>,
}

impl Planes {
    /// Returns the rules for a vector of this kind whose first element is `start`.
    fn rules(self, kind: Kind, start: usize) -> Vec<Mirrored> {
        let [x, y, z] = [start, start + 1, start + 2];
        let across = |element, plane: Option<f64>| {
            plane.map_or(Mirrored::same(element), |plane| Mirrored::across(element, plane))
        };
        let negated = |element, is_negated: bool| {
            if is_negated { Mirrored::negated(element) } else { Mirrored::same(element) }
        };
        let (by_x, by_y) = (self.x.is_some(), self.y.is_some());
        match kind {
            Kind::Position => vec![across(x, self.x), across(y, self.y), Mirrored::same(z)],
            Kind::Difference => vec![negated(x, by_x), negated(y, by_y), Mirrored::same(z)],
            // In a mirror, only rotations about the axis perpendicular to it keep their direction.
            Kind::Turn => vec![negated(x, by_y), negated(y, by_x), negated(z, by_x != by_y)],
            // The right finger is the left one in the mirror between them.
            Kind::Fingers if by_y => vec![Mirrored::same(y), Mirrored::same(x)],
            Kind::Fingers => vec![Mirrored::same(x), Mirrored::same(y)],
        }
    }
}

impl<S: Simulator, R, T: FetchTask<S>> FetchEnv<S, R, T> {
    /// Sets the [symmetries](crate::GoalEnv::symmetries) of a reward, a task or a model of your
    /// own. [`robot_symmetries`](Self::robot_symmetries) returns those of the robot, from which you
    /// can start.
    ///
    /// ```
    /// use fetch_env::{GoalEnv, make_kinematic};
    /// use fetch_env::goal_reward::{Mirror, Mirrored, Symmetry};
    ///
    /// # let env = make_kinematic("FetchPush-v4")?.into_inner();
    /// // A task that observes the x and y of a wall in 2 more elements, and has only left-right
    /// // symmetry.
    /// let [sides, _, _] = env.robot_symmetries()?;
    /// let plane = env.simulator().settled().gripper_position.y;
    /// # use fetch_env::Simulator;
    /// let wall = Mirror::new([Mirrored::same(0), Mirrored::across(1, plane)])?;
    /// let observation = sides.observation.clone().followed_by(&wall);
    /// let env = env.with_symmetries([Symmetry { observation, ..sides }]);
    /// assert_eq!(env.symmetries()[0].observation.len(), 27);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_symmetries(mut self, symmetries: impl Into<Vec<Symmetry>>) -> Self {
        self.symmetries = symmetries.into();
        self
    }

    /// Returns the symmetries of Fetch: left-right, front-back, and both combined. Each mirrors the
    /// elements that [`FetchObservation`](crate::FetchObservation) documents, goals that are
    /// positions, and actions. The mirrors are perpendicular to the y axis and to the x axis and
    /// pass through the gripper's start.
    ///
    /// Of the built-in tasks, Push and PickAndPlace have all three: they draw a mirrored start as
    /// often as the original. Reach and Slide have only the first. The arm keeps the symmetries
    /// only approximately, because it is in neither mirror's plane and reaches less far to the
    /// front. After 0 to 50 random steps and the same steps mirrored (`cargo test -p fetch-env
    /// --test symmetry -- --nocapture`), the grippers are this far from being mirror images of each
    /// other:
    ///
    /// | | median | less in 95 % of the states | maximum |
    /// |---|---|---|---|
    /// | left and right | 0.1 to 0.8 mm | 2 mm | 21 mm |
    /// | front and back | 15 mm | 58 mm | 139 mm |
    ///
    /// An object may deviate more after a touch: a puck that was hit ends up to 61 mm from its
    /// mirror image. Even so, Push and PickAndPlace are learned from fewer steps with all three.
    ///
    /// # Errors
    /// [`SymmetryError`] if the gripper's start is not finite.
    pub fn robot_symmetries(&self) -> Result<[Symmetry; 3], SymmetryError> {
        let start = self.simulator.settled().gripper_position;
        let (x, y) = (Some(start.x), Some(start.y));
        Ok([
            self.mirrored(Planes { x: None, y })?,
            self.mirrored(Planes { x, y: None })?,
            self.mirrored(Planes { x, y })?,
        ])
    }

    fn mirrored(&self, planes: Planes) -> Result<Symmetry, SymmetryError> {
        let fields = observation_fields(self.config.task());
        let rules = fields.iter().flat_map(|field| planes.rules(field.kind, field.range.start));
        // An action displaces the gripper, and its last element commands both fingers.
        let mut action = planes.rules(Kind::Difference, 0);
        action.push(Mirrored::same(action.len()));
        Ok(Symmetry {
            observation: Mirror::new(rules.collect::<Vec<_>>())?,
            goal: Mirror::new(planes.rules(Kind::Position, 0))?,
            action: Mirror::new(action)?,
        })
    }

    /// Adds the symmetries of a built-in task, if the model is one that has them.
    pub(super) fn with_own_symmetries(self) -> Self {
        let is_own =
            matches!(self.config.sim().model(), ModelSource::Builtin | ModelSource::Reference);
        let robot = if is_own { self.robot_symmetries().ok() } else { None };
        let symmetries = robot.into_iter().flatten();
        let count = match self.config.task() {
            Task::Push | Task::PickAndPlace => 3,
            Task::Reach | Task::Slide => 1,
        };
        let symmetries = symmetries.take(count).collect::<Vec<_>>();
        self.with_symmetries(symmetries)
    }
}
