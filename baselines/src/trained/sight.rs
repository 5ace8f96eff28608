//! What policies that see pictures see.

use std::fmt;
use std::ops::Range;

use fetch_env::{
    Camera, FreeCamera, ObservationField, PixelOptions, RenderOptions, Task, observation_fields,
};
use serde::{Deserialize, Serialize};

use super::error::TrainedPolicyError;
use super::header::{InputPart, PolicyHeader};
use crate::network::LARGEST;

/// What a [`PixelPolicy`](crate::PixelPolicy) sees: a picture, and some fields of the observation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// The picture: one view without a key, one frame, and the channels last.
    pub pixels: PixelOptions,
    /// The elements of an observation that the policy sees, too.
    pub fields: Vec<SeenField>,
}

/// Consecutive elements of an observation that a policy sees.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeenField {
    /// Its name, as in [`ObservationField`].
    pub name: String,
    /// The indices of its elements.
    pub range: Range<usize>,
}

impl Sight {
    /// Returns what students of a Fetch task see unless they are told otherwise: 64 x 64 pixels
    /// without smooth edges, in which all that matters is as large as it can be, without the goal's
    /// marker, and [the robot's own fields](Self::robot).
    ///
    /// The camera looks as the reference's does, from nearer: the whole region of goals and the
    /// gripper are in the picture, and in Slide the puck and the table, too.
    #[must_use]
    pub fn of_task(task: Task) -> Self {
        let (lookat, distance, elevation) = match task {
            Task::Reach => ([1.34, 0.75, 0.55], 0.9, -30.0),
            Task::Push => ([1.34, 0.75, 0.42], 0.9, -40.0),
            Task::PickAndPlace => ([1.34, 0.75, 0.55], 1.15, -30.0),
            Task::Slide => ([1.44, 0.75, 0.42], 1.7, -40.0),
        };
        let camera =
            FreeCamera { lookat: lookat.into(), distance, elevation, ..FreeCamera::REFERENCE };
        let view = RenderOptions::default()
            .with_width(64)
            .with_height(64)
            .with_samples(0)
            .with_goals_shown(false)
            .with_camera(Camera::Free(camera));
        Self::robot(task, PixelOptions::default().with_render(view))
    }

    /// Changes the view that is seen, its first one.
    ///
    /// ```
    /// use baselines::Sight;
    /// use fetch_env::Task;
    ///
    /// let larger = Sight::of_task(Task::Push).with_view(|view| view.with_width(84).with_height(84));
    /// assert_ne!(larger, Sight::of_task(Task::Push));
    /// ```
    #[must_use]
    pub fn with_view(self, change: impl FnOnce(RenderOptions) -> RenderOptions) -> Self {
        let view = self.pixels.views().next().map(|(_, view)| change(view.clone()));
        Self { pixels: PixelOptions::default().with_render(view.unwrap_or_default()), ..self }
    }

    /// Returns a part of the names of runs, such as `pixels=64x64`, which says where it differs from
    /// [that of the task](Self::of_task).
    #[cfg(feature = "runs")]
    pub(crate) fn name(&self, task: Task) -> String {
        let mut name = "pixels=".to_owned();
        let of_task = Self::of_task(task);
        let usual = of_task.pixels.views().next().map(|(_, view)| view.camera());
        for (_, view) in self.pixels.views() {
            name += &format!("{}x{}", view.width(), view.height());
            name += if view.goals_shown() { ",goal" } else { "" };
            name += match view.camera() {
                camera if Some(camera) == usual => "",
                Camera::Free(camera) if *camera == FreeCamera::REFERENCE => ",reference",
                _ => ",camera",
            };
        }
        name
    }

    /// Returns a picture and the robot's own fields: all but the object's.
    #[must_use]
    pub fn robot(task: Task, pixels: PixelOptions) -> Self {
        let robot = observation_fields(Task::Reach).iter();
        let fields = robot.filter_map(|field| ObservationField::find(task, field.name));
        let seen = |field: &ObservationField| SeenField {
            name: field.name.to_owned(),
            range: field.range.clone(),
        };
        Self { pixels, fields: fields.map(seen).collect() }
    }

    /// Returns the places of the numbers that the policy sees, among those that the header's parts
    /// make of a whole observation and goals.
    ///
    /// # Errors
    /// [`TrainedPolicyError::Sight`] if an observation does not have a field, or there are more than
    /// 16,384 numbers.
    pub(crate) fn columns(&self, header: &PolicyHeader) -> Result<Vec<usize>, TrainedPolicyError> {
        let wrong = |reason| Err(TrainedPolicyError::Sight { reason });
        let PolicyHeader { observation_len, goal_len, .. } = *header;
        if header.input_len() > LARGEST {
            return wrong(format!("an input has {} numbers", header.input_len()));
        }
        let (mut columns, mut start) = (Vec::new(), 0);
        for part in &header.inputs {
            if *part != InputPart::Observation {
                columns.extend(start..start + goal_len);
                start += goal_len;
                continue;
            }
            for SeenField { name, range } in &self.fields {
                if range.end > observation_len || columns.len() > LARGEST {
                    return wrong(format!(
                        "an observation has {observation_len} elements, and {name} is {range:?}"
                    ));
                }
                columns.extend(range.clone().map(|element| start + element));
            }
            start += observation_len;
        }
        Ok(columns)
    }

    /// Returns the height and the width of the picture.
    ///
    /// # Errors
    /// [`TrainedPolicyError::Sight`] if it is not one view without a key, with one frame and the
    /// channels last.
    pub(super) fn picture_size(&self) -> Result<[usize; 2], TrainedPolicyError> {
        let mut views = self.pixels.views();
        if let (Some((None, view)), 1, 1, false) = (
            views.next(),
            self.pixels.views().len(),
            self.pixels.frame_stack().get(),
            self.pixels.channels_first(),
        ) {
            return Ok([view.height() as usize, view.width() as usize]);
        }
        let reason = "it sees one view without a key, one frame, and the channels last".to_owned();
        Err(TrainedPolicyError::Sight { reason })
    }
}

/// Says size, camera and goal's marker of each view, and the names of the fields.
impl fmt::Display for Sight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (_, view) in self.pixels.views() {
            let goal = if view.goals_shown() { "with the goal" } else { "without the goal" };
            write!(f, "{} x {} pixels {goal} of ", view.width(), view.height())?;
            match view.camera() {
                Camera::Free(FreeCamera { lookat, distance, azimuth, elevation }) => write!(
                    f,
                    "a camera {distance} m from {:?}, azimuth {azimuth}, elevation {elevation}, ",
                    lookat.as_slice()
                ),
                camera => write!(f, "the camera {camera:?}, "),
            }?;
        }
        let names: Vec<_> = self.fields.iter().map(|field| field.name.as_str()).collect();
        write!(f, "and the fields {}", names.join(", "))
    }
}
