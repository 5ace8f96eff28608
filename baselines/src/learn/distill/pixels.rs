//! Students that see pictures.

use std::path::Path;

use fetch_env::vec_env::BatchObservation;
use fetch_env::{EnvError, Info, PictureRows, SnapshotEnv, Space};
use her_relabel::Dims;

use super::distiller::{Distiller, Pictures};
use super::settings::DistillSettings;
use super::student::{Student, StudentNetwork};
use crate::learn::error::{CheckpointError, TrainError};
use crate::learn::run::env::LearnEnv;
use crate::network::{Convolution, PictureShape};
use crate::policy::VecPolicy;
use crate::trained::{PixelPolicy, Sight, TrainedPolicyError};

/// For environments whose observations have pictures, as those with an
/// [`AddRenderObservation`](fetch_env::AddRenderObservation) do.
impl<E> Distiller<E>
where
    E: LearnEnv<Observation: BatchObservation<Rows: AsRef<PictureRows>>, Info: AsRef<Info>>,
{
    /// Prepares to distill a teacher that sees the state into a network that sees pictures, the
    /// fields of `sight` and the desired goal. `make` makes environments with the pictures of
    /// `sight`; the network has [`Convolution::defaults`]. Otherwise as [`new`](Self::new).
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`TrainError::Frames`] or [`TrainError::Picture`] if there is no
    /// network for the pictures.
    pub fn with_pixels(
        make: impl Fn() -> Result<E, EnvError>,
        teacher: Box<dyn VecPolicy<E::Observation, E::Info> + Send>,
        sight: &Sight,
        settings: DistillSettings,
        seed: u64,
        num_threads: usize,
    ) -> Result<Self, TrainError> {
        let student = |env: &E, dims, settings: &DistillSettings, rates, seed| {
            let space = env.observation_space();
            let student = pixel_student(space, dims, sight, &settings.hidden, rates, seed);
            student.map(|(student, columns)| (student, Some(columns)))
        };
        let pictures: Pictures<E> = |batch| batch.pixels();
        let own = Self::with_student(
            make,
            teacher,
            settings,
            seed,
            num_threads,
            Some(pictures),
            student,
        )?;
        Ok(Self { sight: Some(sight.clone()), ..own })
    }

    /// Continues a run of [`with_pixels`](Self::with_pixels), otherwise as [`resume`](Self::resume).
    ///
    /// # Errors
    /// As [`resume`](Self::resume), and [`CheckpointError::OtherSight`] if the student of the
    /// checkpoint sees another picture, or other fields.
    pub fn resume_pixels(
        make: impl Fn() -> Result<E, EnvError>,
        teacher: Box<dyn VecPolicy<E::Observation, E::Info> + Send>,
        sight: &Sight,
        folder: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, CheckpointError>
    where
        E: SnapshotEnv,
    {
        Self::resume_with(folder.as_ref(), |settings, seed| {
            Ok(Self::with_pixels(make, teacher, sight, settings, seed, num_threads)?)
        })
    }
}

impl<E: LearnEnv<Info: AsRef<Info>>> Distiller<E> {
    /// Returns the student that is evaluated, as it is now, if it sees pictures.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if it has diverged, and [`TrainedPolicyError::Sight`] if it
    /// sees none.
    pub fn pixel_policy(&self, env_id: &str) -> Result<PixelPolicy, TrainedPolicyError> {
        match (&self.student.averaged, &self.sight) {
            (StudentNetwork::Pixels(network), Some(sight)) => {
                PixelPolicy::new(self.header(env_id), sight.clone(), network.clone())
            }
            _ => {
                let reason = "the student sees no pictures".to_owned();
                Err(TrainedPolicyError::Sight { reason })
            }
        }
    }
}

/// Draws a student for the pictures of an observation space, the fields of `sight` and the desired
/// goal. Returns it with the places of the numbers that it sees, among observation and goal.
pub(in crate::learn) fn pixel_student(
    space: &Space,
    dims: Dims,
    sight: &Sight,
    hidden: &[usize],
    rates: [f32; 2],
    seed: u64,
) -> Result<(Student, Vec<usize>), TrainError> {
    let size = picture_size(space).ok_or(TrainError::Frames)?;
    let fields = sight.fields.iter().map(|field| field.range.clone());
    if let Some(range) = fields.clone().find(|range| range.end > dims.observation) {
        return Err(TrainError::Setting {
            name: "fields",
            value: format!("{range:?}"),
            expected: "choose elements of the observation, counted from 0",
        });
    }
    let goal = dims.observation..dims.observation + dims.goal;
    let columns: Vec<usize> = fields.chain([goal]).flatten().collect();
    let (convolutions, numbers) = (Convolution::defaults(size), columns.len());
    let shape = PictureShape::new(size, &convolutions, numbers, hidden, dims.action)?;
    Ok((Student::of_pixels(shape, rates, seed), columns))
}

/// Returns the height and the width of single RGB pictures with the channels last.
fn picture_size(space: &Space) -> Option<[usize; 2]> {
    match space.as_dict()?.get("pixels")? {
        Space::Image(image) => match image.shape() {
            [height, width, 3] => Some([height, width]),
            _ => None,
        },
        _ => None,
    }
}
