//! Episodes of policies that see pictures, with what they see.

use fetch_env::{
    AddRenderObservation, BoxSpace, Env, EnvExt, GoalObservation, PixelObservation, RenderEnv, Step,
};
use her_relabel::Scalar;

use super::error::PageError;
use super::playback::Playback;
use super::scene::PlaybackEnv;
use crate::policy::Policy;
use crate::trained::PixelPolicy;

/// What a page says of the pictures that a policy sees.
const SEEN: &str = "The small picture is what the policy sees; the red pixels are the points to \
                    which its network reduces it.";

impl Playback {
    /// Records an episode of a policy that sees pictures as [`record`](Self::record) does, and shows
    /// what it sees beside the frames, with the points to which its network reduces a picture. The
    /// pictures are the policy's own, drawn of `env`.
    ///
    /// # Errors
    /// As [`record`](Self::record), and [`PageError::Environment`] if there are no pictures.
    pub fn record_seen<E>(
        env: E,
        policy: &mut PixelPolicy,
        seed: u64,
        watch: impl FnMut(usize, &[f32], &Step<PixelObservation<E::Observation>, E::Info>),
    ) -> Result<Self, PageError>
    where
        E: PlaybackEnv<Observation: GoalObservation<Element: Scalar>, ActionSpace = BoxSpace<f32>>
            + RenderEnv,
    {
        let pictures = AddRenderObservation::new(policy.sight().pixels.clone());
        let failed = |source| PageError::Environment { seed, source };
        let mut env = env.wrap(pictures).map_err(failed)?;
        policy.check_spaces(env.observation_space(), &env.action_space().clone().into())?;
        let [height, width] = policy.network().shape().picture_size();
        let mut seen = Vec::new();
        let mut acting = |observation: &PixelObservation<E::Observation>, action: &mut [f32]| {
            policy.act(observation, action);
            seen.push(with_points(&observation.pixels, [width, height], policy.points()));
        };
        let playback = Self::record(&mut env, &mut acting, seed, watch)?;
        playback.with_seen([width, height], seen, SEEN)
    }
}

/// Returns a picture with a red pixel at each point: a column and a row.
fn with_points(
    picture: &[u8],
    [width, height]: [usize; 2],
    points: impl Iterator<Item = [f32; 2]>,
) -> Vec<u8> {
    let mut picture = picture.to_vec();
    for [column, row] in points {
        let place = |at: f32, len: usize| (at.round().max(0.0) as usize).min(len - 1);
        let at = 3 * (place(row, height) * width + place(column, width));
        picture[at..at + 3].copy_from_slice(&[255, 0, 0]);
    }
    picture
}
