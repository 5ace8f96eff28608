//! The pictures of an environment: drawing, stacking and reusing them.

use std::{collections::VecDeque, num::NonZeroU8, sync::Arc};

use fetch_sim::RenderOptions;
use serde::{Deserialize, Serialize};

use super::{pool::RendererPool, render::RenderEnv};
use crate::gym::spaces::{ImageSpace, Space, error::SpaceError};
use crate::gym::wrappers::array::{ArrayPool, SharedArray};
use crate::gym::{env::Env, error::EnvError};

/// Settings of pictures as observations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[must_use]
pub struct PixelOptions {
    render: RenderOptions,
    frame_stack: NonZeroU8,
    channels_first: bool,
}

impl Default for PixelOptions {
    fn default() -> Self {
        Self {
            render: RenderOptions::default().with_width(84).with_height(84).with_samples(0),
            frame_stack: NonZeroU8::MIN,
            channels_first: false,
        }
    }
}

impl PixelOptions {
    /// Sets the options of the renderer. The default is 84 x 84 pixels without smooth edges, as
    /// policies use them, from the reference's camera.
    pub fn with_render(mut self, render: RenderOptions) -> Self {
        self.render = render;
        self
    }

    settings! {
        /// Sets the number of frames in an observation, the current one last. The default is 1.
        /// After a reset all of them are the first frame.
        with_frame_stack(frame_stack: NonZeroU8);
        /// Sets whether the axes are channels, height and width, as convolutions expect them. The
        /// default, false, is height, width and channels, as in Gymnasium. The channels are red,
        /// green and blue of the oldest frame, then of the next.
        with_channels_first(channels_first: bool);

        /// Returns the number of frames in an observation.
        frame_stack: NonZeroU8;
        /// Whether the channels are the first axis, and not the last.
        channels_first: bool;
    }

    /// Returns the options of the renderer.
    pub const fn render(&self) -> &RenderOptions {
        &self.render
    }

    /// Returns the space of the pictures.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if they have more than 2^28 bytes.
    pub fn image_space(&self) -> Result<ImageSpace, SpaceError> {
        let [width, height] = [self.render.width(), self.render.height()].map(|side| side as usize);
        let channels = 3 * usize::from(self.frame_stack.get());
        ImageSpace::new(if self.channels_first {
            [channels, height, width]
        } else {
            [height, width, channels]
        })
    }
}

/// Draws an environment and stacks the last frames.
#[derive(Debug)]
pub(super) struct Pictures {
    options: PixelOptions,
    /// `None` without an environment.
    observation_space: Option<Space>,
    /// `None` without an environment.
    renderers: Option<Arc<RendererPool>>,
    /// The last frames, oldest first.
    frames: VecDeque<Box<[u8]>>,
    pool: ArrayPool<u8>,
}

impl Pictures {
    pub(super) fn new(options: PixelOptions) -> Self {
        let (observation_space, renderers, frames) = (None, None, VecDeque::new());
        Self { options, observation_space, renderers, frames, pool: ArrayPool::new(0) }
    }

    /// Prepares pictures of `env`. `make_space` makes the space of the observations from those of
    /// the state and of the pictures.
    ///
    /// # Errors
    /// As [`RenderEnv::renderer`] and `make_space`, and [`SpaceError::TooLarge`] if the pictures
    /// have more than 2^28 bytes.
    pub(super) fn attach<E: RenderEnv>(
        &mut self,
        env: &E,
        make_space: impl FnOnce(&Space, ImageSpace) -> Result<Space, SpaceError>,
    ) -> Result<(), EnvError> {
        let image_space = self.options.image_space()?;
        let count = usize::from(self.options.frame_stack.get());
        self.renderers = Some(RendererPool::shared(env, self.options.render.clone())?);
        let frame = vec![0; image_space.len() / count].into_boxed_slice();
        self.frames = vec![frame; count].into();
        self.pool = ArrayPool::new(image_space.len());
        self.observation_space = Some(make_space(env.observation_space(), image_space)?);
        Ok(())
    }

    /// Returns the space of the observations.
    pub(super) fn observation_space<'a, E: Env>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
    }

    /// Draws the state after a reset into all frames, and stacks them.
    pub(super) fn first<E: RenderEnv>(&mut self, env: &E) -> Result<SharedArray<u8>, EnvError> {
        self.observe(env, 0)
    }

    /// Draws the state after a step into the newest frame, and stacks all frames.
    pub(super) fn next<E: RenderEnv>(&mut self, env: &E) -> Result<SharedArray<u8>, EnvError> {
        self.frames.rotate_left(1.min(self.frames.len()));
        self.observe(env, self.frames.len().saturating_sub(1))
    }

    fn observe<E: RenderEnv>(
        &mut self,
        env: &E,
        first: usize,
    ) -> Result<SharedArray<u8>, EnvError> {
        let renderers = self.renderers.as_ref().ok_or(EnvError::ResetNeeded)?;
        let frames = &mut self.frames;
        renderers.render(env, |rgb| {
            for frame in frames.range_mut(first..) {
                frame.copy_from_slice(rgb);
            }
        })?;
        let (frames, channels_first) = (&self.frames, self.options.channels_first);
        Ok(self.pool.write(|pixels| stack(frames, channels_first, pixels)))
    }

    /// Returns the frames that later observations show again: all but the oldest one.
    pub(super) fn later_frames(&self) -> Vec<Vec<u8>> {
        self.frames.iter().skip(1).map(|frame| frame.to_vec()).collect()
    }

    /// Checks the [later frames](Self::later_frames) of a snapshot.
    ///
    /// # Errors
    /// [`EnvError::ForeignSnapshot`] if their number or size differs.
    pub(super) fn check_later_frames(&self, frames: &[Vec<u8>]) -> Result<(), EnvError> {
        let ours = || self.frames.iter().skip(1).map(|frame| frame.len());
        if frames.iter().map(Vec::len).eq(ours()) {
            return Ok(());
        }
        let sizes = |sizes: Vec<usize>| format!("{} frames of {:?} bytes", sizes.len(), sizes);
        let (theirs, ours) = (frames.iter().map(Vec::len).collect(), ours().collect());
        let reason = format!("it stacks {}, this one {}", sizes(theirs), sizes(ours));
        Err(EnvError::ForeignSnapshot { reason })
    }

    /// Sets the [later frames](Self::later_frames), which were checked.
    pub(super) fn set_later_frames(&mut self, frames: &[Vec<u8>]) {
        for (ours, theirs) in self.frames.iter_mut().skip(1).zip(frames) {
            ours.copy_from_slice(theirs);
        }
    }
}

fn stack(frames: &VecDeque<Box<[u8]>>, channels_first: bool, out: &mut [u8]) {
    let channels = 3 * frames.len();
    for (index, frame) in frames.iter().enumerate() {
        let (pixels, _) = frame.as_chunks::<3>();
        if channels_first {
            let planes = out.chunks_exact_mut(pixels.len()).skip(3 * index).take(3);
            for (channel, plane) in planes.enumerate() {
                for (pixel, out) in pixels.iter().zip(plane) {
                    *out = pixel[channel];
                }
            }
        } else {
            for (pixel, out) in pixels.iter().zip(out.chunks_exact_mut(channels)) {
                out[3 * index..][..3].copy_from_slice(pixel);
            }
        }
    }
}
