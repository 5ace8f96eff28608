//! Fetch's left and right.

use fetch_sim::{ModelSource, Simulator};
use goal_reward::{Mirror, Mirrored, Symmetry, SymmetryError};

use super::env::FetchEnv;
use super::layout::{Kind, observation_fields};

impl Kind {
    /// Returns the rules of a vector whose first element is `start`, in a mirror across the y axis
    /// at `plane` meters.
    fn mirrored(self, start: usize, plane: f64) -> Vec<Mirrored> {
        let [x, y, z] = [start, start + 1, start + 2];
        match self {
            Self::Position => {
                vec![Mirrored::same(x), Mirrored::across(y, plane), Mirrored::same(z)]
            }
            Self::Difference => vec![Mirrored::same(x), Mirrored::negated(y), Mirrored::same(z)],
            // In a mirror, only turns about the axis across it keep their sense.
            Self::Turn => vec![Mirrored::negated(x), Mirrored::same(y), Mirrored::negated(z)],
            // The right finger is the left one in the mirror.
            Self::Fingers => vec![Mirrored::same(start + 1), Mirrored::same(start)],
        }
    }
}

impl<S, R, T> FetchEnv<S, R, T> {
    /// Sets the [symmetry](crate::GoalEnv::symmetry) of a reward, a task or a model of your own,
    /// or `None`. [`robot_symmetry`](Self::robot_symmetry) is what it has in common with the
    /// built-in tasks.
    ///
    /// ```
    /// use fetch_env::{GoalEnv, make_kinematic};
    /// use fetch_env::goal_reward::{Mirror, Mirrored, Symmetry};
    ///
    /// # let env = make_kinematic("FetchPush-v4")?.into_inner();
    /// // A task that observes the x and y of a wall behind the table in 2 more elements.
    /// let robot = env.robot_symmetry()?;
    /// let plane = env.simulator().settled().gripper_position.y;
    /// # use fetch_env::Simulator;
    /// let wall = Mirror::new([Mirrored::same(0), Mirrored::across(1, plane)])?;
    /// let observation = robot.observation.clone().followed_by(&wall);
    /// let env = env.with_symmetry(Symmetry { observation, ..robot });
    /// assert_eq!(env.symmetry().map(|symmetry| symmetry.observation.len()), Some(27));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_symmetry(mut self, symmetry: impl Into<Option<Symmetry>>) -> Self {
        self.symmetry = symmetry.into();
        self
    }
}

impl<S: Simulator, R, T> FetchEnv<S, R, T> {
    /// Returns the symmetry of Fetch's left and right: of the elements that
    /// [`FetchObservation`](crate::FetchObservation) documents, of goals that are positions, and of
    /// actions. The mirror stands across the y axis, through the gripper's start.
    ///
    /// The built-in tasks have it: a mirrored start is one that they draw as often. The arm keeps it
    /// only nearly, because it is not in the mirror's plane itself. After 0 to 50 random steps and the
    /// same steps in a mirror, the grippers are not exactly mirror images: they are 0.1 to 0.8 mm
    /// apart in the median, less than 2 mm in 95 % of the states, and 21 mm at most (`cargo test -p
    /// fetch-env --test symmetry -- --nocapture`). What an object does after a touch may differ by
    /// more: a puck that was hit ends up to 61 mm from its mirror image.
    ///
    /// # Errors
    /// [`SymmetryError`] if the gripper's start is not finite.
    pub fn robot_symmetry(&self) -> Result<Symmetry, SymmetryError> {
        let plane = self.simulator.settled().gripper_position.y;
        let fields = observation_fields(self.config.task());
        let observation: Vec<Mirrored> =
            fields.iter().flat_map(|field| field.kind.mirrored(field.range.start, plane)).collect();
        // An action displaces the gripper, and its last element commands both fingers.
        let mut action = Kind::Difference.mirrored(0, plane);
        action.push(Mirrored::same(action.len()));
        Ok(Symmetry {
            observation: Mirror::new(observation)?,
            goal: Mirror::new(Kind::Position.mirrored(0, plane))?,
            action: Mirror::new(action)?,
        })
    }

    /// Adds the symmetry of a built-in task, if the model is one that has it.
    pub(super) fn with_own_symmetry(self) -> Self {
        let is_own =
            matches!(self.config.sim().model(), ModelSource::Builtin | ModelSource::Reference);
        let symmetry = if is_own { self.robot_symmetry().ok() } else { None };
        self.with_symmetry(symmetry)
    }
}
