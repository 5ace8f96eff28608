//! Policies that see pictures: networks with convolutions that are loaded from a file.

use std::path::Path;

use fetch_env::vec_env::VecStep;
use fetch_env::{GoalObservation, PixelObservation, PixelOptions, Space};
use her_relabel::{Scalar, StateRows};

use super::error::TrainedPolicyError;
use super::header::{PolicyHeader, SuccessRate};
use super::sight::Sight;
use super::{file, pixel_file};
use crate::dims::lengths_of;
use crate::network::{PictureNetwork, PicturePass};
use crate::policy::{Policy, PolicyError, VecPolicy};
use crate::tanh::tanh;

/// A trained policy that sees a picture: a [`PictureNetwork`] with a hyperbolic tangent at its end,
/// what it sees, and how it was trained.
///
/// It acts on the observations of [`AddRenderObservation`](fetch_env::AddRenderObservation) with the
/// policy's own [`PixelOptions`], with the same bits alone and among other rows.
///
/// The file is a [safetensors](https://docs.rs/safetensors) file of the tensors
/// `convolutions.0.weight` (rows, columns and channels of a kernel, and outputs),
/// `convolutions.0.bias`, which the last convolution lacks, and so on, `layers.0.weight`,
/// `layers.0.bias`, and so on, as those of a [`TrainedPolicy`](crate::TrainedPolicy), `mean`, the
/// mean picture, and `scale`. Its metadata has JSON under the key `pixel_policy`: the
/// [header](PolicyHeader) as `policy`, what the policy sees as `sight`, and the layers.
#[derive(Debug)]
pub struct PixelPolicy {
    header: PolicyHeader,
    sight: Sight,
    network: PictureNetwork,
    columns: Vec<usize>,
    pass: PicturePass,
    work: Work,
}

/// The vectors that an action is computed with; they are reused.
#[derive(Debug, Default)]
struct Work {
    way: Vec<f64>,
    whole: Vec<f32>,
    numbers: Vec<f32>,
}

impl Clone for PixelPolicy {
    /// Returns the same policy, which has not acted yet.
    fn clone(&self) -> Self {
        let Self { header, sight, network, columns, .. } = self;
        Self {
            header: header.clone(),
            sight: sight.clone(),
            network: network.clone(),
            columns: columns.clone(),
            pass: PicturePass::default(),
            work: Work::default(),
        }
    }
}

impl PartialEq for PixelPolicy {
    fn eq(&self, other: &Self) -> bool {
        self.header == other.header && self.sight == other.sight && self.network == other.network
    }
}

impl PixelPolicy {
    /// Creates a policy from its network, whose numbers besides the picture are those of the
    /// header's [inputs](PolicyHeader::inputs): of an observation, its [fields](Sight::fields).
    /// Normalizers are those of whole observations and goals.
    ///
    /// # Errors
    /// [`TrainedPolicyError`] if the header contradicts itself, or the network does not fit it and
    /// what the policy sees, or has a number that is not finite.
    pub fn new(
        header: PolicyHeader,
        sight: Sight,
        network: PictureNetwork,
    ) -> Result<Self, TrainedPolicyError> {
        header.check()?;
        let columns = sight.columns(&header)?;
        let shape = network.shape();
        let (size, expected) = (sight.picture_size()?, shape.picture_size());
        let wrong = |what, own, expected| {
            let reason = format!("the policy has {own:?} {what}, and the network {expected:?}");
            Err(TrainedPolicyError::Sight { reason })
        };
        if size != expected {
            return wrong("rows and columns of pixels", size.to_vec(), expected.to_vec());
        }
        let lens = [
            ("numbers besides the picture", columns.len(), shape.num_numbers()),
            ("elements of an action", header.action_len, shape.num_outputs()),
        ];
        for (what, own, expected) in lens {
            if own != expected {
                return wrong(what, vec![own], vec![expected]);
            }
        }
        pixel_file::check_finite(&network)?;
        let (pass, work) = (PicturePass::default(), Work::default());
        Ok(Self { header, sight, network, columns, pass, work })
    }

    /// Loads a policy from a file.
    ///
    /// # Errors
    /// [`TrainedPolicyError`] if the file cannot be read, is damaged, or is not a policy that sees
    /// pictures.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, TrainedPolicyError> {
        file::load(path.as_ref(), Self::from_bytes)
    }

    /// Creates a policy from the contents of a file.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TrainedPolicyError> {
        let (header, sight, network) = pixel_file::decode(bytes)?;
        Self::new(header, sight, network)
    }

    /// Returns the contents of a file with this policy.
    ///
    /// # Errors
    /// As [`TrainedPolicy::to_bytes`](crate::TrainedPolicy::to_bytes).
    pub fn to_bytes(&self) -> Result<Vec<u8>, TrainedPolicyError> {
        pixel_file::encode(&self.header, &self.sight, &self.network)
    }

    /// Saves the policy to a file, as [`TrainedPolicy::save`](crate::TrainedPolicy::save) does.
    ///
    /// # Errors
    /// As [`TrainedPolicy::save`](crate::TrainedPolicy::save).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), TrainedPolicyError> {
        file::save(path.as_ref(), &self.to_bytes()?)
    }

    /// Returns how the policy was trained, and for what.
    #[must_use]
    pub const fn header(&self) -> &PolicyHeader {
        &self.header
    }

    /// Returns what the policy sees.
    #[must_use]
    pub const fn sight(&self) -> &Sight {
        &self.sight
    }

    /// Returns the network.
    #[must_use]
    pub const fn network(&self) -> &PictureNetwork {
        &self.network
    }

    /// Sets the success rate that an evaluation has measured.
    #[must_use]
    pub fn with_success(mut self, success: SuccessRate) -> Self {
        self.header.success = Some(success);
        self
    }

    /// Checks that an environment shows one picture of the policy's size, and has the lengths of
    /// observation, goal and action that the policy was trained with.
    ///
    /// # Errors
    /// [`PolicyError::Picture`] and [`PolicyError::Trained`].
    pub fn check_spaces(&self, observation: &Space, action: &Space) -> Result<(), PolicyError> {
        let [height, width] = self.network.shape().picture_size();
        let (expected, pixels) = ([height, width, 3], observation.as_dict());
        let actual = match pixels.and_then(|parts| parts.get("pixels")) {
            Some(Space::Image(image)) => Some(image.shape()),
            _ => None,
        };
        if actual != Some(expected) {
            return Err(PolicyError::Picture { expected, actual });
        }
        self.header.check_lengths(lengths_of(observation, action)?)
    }

    /// Checks that pictures show what the policy was trained with: the same camera, size and frames.
    /// Spaces do not tell the camera, so that no evaluation can.
    ///
    /// # Errors
    /// [`PolicyError::View`].
    pub fn check_view(&self, pixels: &PixelOptions) -> Result<(), PolicyError> {
        if *pixels == self.sight.pixels {
            return Ok(());
        }
        let [expected, actual] =
            [&self.sight.pixels, pixels].map(|pixels| Box::new(pixels.clone()));
        Err(PolicyError::View { expected, actual })
    }

    /// Returns the points to which the network has reduced the pictures of the last actions, a row
    /// for each picture and a point for each channel: the column and the row of pixels, which the
    /// middle of the top left one counts from.
    pub fn points(&self) -> impl Iterator<Item = [f32; 2]> + '_ {
        let shape = self.network.shape();
        let num_points = shape.num_points();
        let rows = self.pass.points().chunks_exact(2 * num_points);
        rows.flat_map(move |row| {
            let (xs, ys) = row.split_at(num_points);
            xs.iter().zip(ys).map(|(x, y)| shape.pixel_of([*x, *y]))
        })
    }

    /// Writes the greedy actions for pictures and states, row after row: `action_len` numbers for
    /// each.
    ///
    /// # Errors
    /// [`TrainedPolicyError::Rows`] if the lengths are not those of the same number of rows, and
    /// [`TrainedPolicyError::StateNotFinite`]; nothing is written then.
    pub fn act_rows<S: Scalar>(
        &mut self,
        pictures: &[u8],
        states: &StateRows<'_, S, f64>,
        actions: &mut [f32],
    ) -> Result<(), TrainedPolicyError> {
        let Self { header, network, columns, pass, work: Work { way, whole, numbers }, .. } = self;
        let rows = header.check_rows(states, actions.len())?;
        let len = network.shape().picture_len();
        if rows.checked_mul(len) != Some(pictures.len()) {
            let (what, actual) = ("bytes of pictures", pictures.len());
            return Err(TrainedPolicyError::Rows { what, actual, rows, len });
        }
        numbers.clear();
        for row in 0..rows {
            let StateRows { observation, achieved_goal, desired_goal } = header.row(states, row);
            whole.clear();
            header.push_inputs(observation, achieved_goal, desired_goal, way, whole);
            numbers.extend(columns.iter().map(|column| whole[*column]));
        }
        let outputs = pass.run(network, pictures, numbers);
        actions.iter_mut().zip(outputs).for_each(|(action, output)| *action = tanh(*output));
        Ok(())
    }
}

impl<O: GoalObservation<Element: Scalar>> Policy<PixelObservation<O>> for PixelPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        Self::check_spaces(self, observation_space, action_space)
    }

    fn act(&mut self, observation: &PixelObservation<O>, action: &mut [f32]) {
        let states = StateRows {
            observation: observation.observation(),
            achieved_goal: observation.achieved_goal(),
            desired_goal: observation.desired_goal(),
        };
        if self.act_rows(&observation.pixels, &states, action).is_err() {
            action.fill(f32::NAN);
        }
    }
}

/// Chooses the same actions as for one environment at a time.
impl<O: GoalObservation<Element: Scalar>, I> VecPolicy<PixelObservation<O>, I> for PixelPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        Self::check_spaces(self, observation_space, action_space)
    }

    fn act_all(&mut self, batch: &VecStep<PixelObservation<O>, I>, actions: &mut [f32]) {
        let (pictures, states) = (batch.pixels(), StateRows::from(batch));
        match self.act_rows(pictures, &states, actions) {
            Ok(()) => {}
            // The other rows still act.
            Err(TrainedPolicyError::StateNotFinite { .. }) => {
                let len = self.network.shape().picture_len();
                let rows = actions.chunks_exact_mut(self.header.action_len);
                for (row, (action, picture)) in rows.zip(pictures.chunks_exact(len)).enumerate() {
                    let state = self.header.row(&states, row);
                    if self.act_rows(picture, &state, action).is_err() {
                        action.fill(f32::NAN);
                    }
                }
            }
            Err(_) => actions.fill(f32::NAN),
        }
    }
}
