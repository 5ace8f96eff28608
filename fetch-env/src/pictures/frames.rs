//! The pictures of an environment: drawing, stacking and reusing them.

use std::{collections::VecDeque, fmt, num::NonZeroU8, ops::Deref, sync::Arc};

use fetch_sim::RenderOptions;
use serde::{Deserialize, Serialize};

use super::{pool::RendererPool, render::RenderEnv};
use crate::gym::env::observation::{ArrayRows, BatchObservation};
use crate::gym::spaces::ImageSpace;
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Number of observations whose memory is remembered.
const REMEMBERED: usize = 4;

/// Settings of pictures as observations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[must_use]
pub struct PixelOptions {
    render: RenderOptions,
    frame_stack: NonZeroU8,
    channel_order: ChannelOrder,
}

impl Default for PixelOptions {
    fn default() -> Self {
        Self {
            render: RenderOptions::default().with_width(84).with_height(84).with_samples(0),
            frame_stack: NonZeroU8::MIN,
            channel_order: ChannelOrder::default(),
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
        /// Sets the order of the axes. The default has the channels last, as Gymnasium does.
        with_channel_order(channel_order: ChannelOrder);
    }

    /// The options of the renderer.
    #[must_use]
    pub const fn render(&self) -> &RenderOptions {
        &self.render
    }

    settings! {
        /// The number of frames in an observation.
        frame_stack: NonZeroU8;
        /// The order of the axes.
        channel_order: ChannelOrder;
    }

    /// Returns the space of the pictures.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if they have more than 2^28 bytes.
    pub fn image_space(&self) -> Result<ImageSpace, SpaceError> {
        let [width, height] = [self.render.width(), self.render.height()].map(|side| side as usize);
        let channels = 3 * usize::from(self.frame_stack.get());
        ImageSpace::new(match self.channel_order {
            ChannelOrder::Hwc => [height, width, channels],
            ChannelOrder::Chw => [channels, height, width],
        })
    }
}

/// Order of the axes. The channels are red, green and blue of the oldest frame, then of the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChannelOrder {
    /// Height x width x channels, as image files have it.
    #[default]
    Hwc,
    /// Channels x height x width, as convolutions expect it.
    Chw,
}

/// Bytes of stacked pictures, row-major. Clones share them.
#[derive(Clone, PartialEq, Eq)]
pub struct Pixels(Arc<[u8]>);

impl Deref for Pixels {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl AsRef<[u8]> for Pixels {
    fn as_ref(&self) -> &[u8] {
        self
    }
}

impl fmt::Debug for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pixels({} bytes)", self.len())
    }
}

impl BatchObservation for Pixels {
    type Rows = ArrayRows<u8>;
}

/// Draws an environment and stacks the last frames.
#[derive(Debug)]
pub(super) struct Pictures {
    options: PixelOptions,
    /// `None` without an environment.
    renderers: Option<Arc<RendererPool>>,
    /// The last frames, oldest first.
    frames: VecDeque<Box<[u8]>>,
    /// The pictures of the last observations, whose memory is reused once they are dropped.
    recent: VecDeque<Pixels>,
}

impl Pictures {
    pub(super) fn new(options: PixelOptions) -> Self {
        let recent = VecDeque::with_capacity(REMEMBERED);
        Self { options, renderers: None, frames: VecDeque::new(), recent }
    }

    /// Prepares pictures of `env`, and returns their space.
    ///
    /// # Errors
    /// As [`RenderEnv::renderer`], and [`EnvError::Space`] if they have more than 2^28 bytes.
    pub(super) fn attach<E: RenderEnv>(&mut self, env: &E) -> Result<ImageSpace, EnvError> {
        let image_space = self.options.image_space()?;
        let count = usize::from(self.options.frame_stack.get());
        self.renderers = Some(RendererPool::shared(env, self.options.render.clone())?);
        let frame = vec![0; image_space.len() / count].into_boxed_slice();
        self.frames = vec![frame; count].into();
        self.recent.clear();
        Ok(image_space)
    }

    /// Draws the state after a reset into all frames, and stacks them.
    pub(super) fn first<E: RenderEnv>(&mut self, env: &E) -> Result<Pixels, EnvError> {
        self.observe(env, 0)
    }

    /// Draws the state after a step into the newest frame, and stacks all frames.
    pub(super) fn next<E: RenderEnv>(&mut self, env: &E) -> Result<Pixels, EnvError> {
        self.frames.rotate_left(1.min(self.frames.len()));
        self.observe(env, self.frames.len().saturating_sub(1))
    }

    fn observe<E: RenderEnv>(&mut self, env: &E, first: usize) -> Result<Pixels, EnvError> {
        let renderers = self.renderers.as_ref().ok_or(EnvError::ResetNeeded)?;
        let frames = &mut self.frames;
        renderers.render(env, |rgb| {
            for frame in frames.range_mut(first..) {
                frame.copy_from_slice(rgb);
            }
        })?;
        let free = self.recent.iter_mut().position(|pixels| Arc::get_mut(&mut pixels.0).is_some());
        let mut pixels = match free.and_then(|index| self.recent.remove(index)) {
            Some(pixels) => pixels,
            None => Pixels(vec![0; self.frames.iter().map(|frame| frame.len()).sum()].into()),
        };
        if let Some(bytes) = Arc::get_mut(&mut pixels.0) {
            stack(&self.frames, self.options.channel_order, bytes);
        }
        if self.recent.len() == REMEMBERED {
            self.recent.pop_front();
        }
        self.recent.push_back(pixels.clone());
        Ok(pixels)
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
        let reason = format!("it stacks {}, this {}", sizes(theirs), sizes(ours));
        Err(EnvError::ForeignSnapshot { reason })
    }

    /// Sets the [later frames](Self::later_frames), which were checked.
    pub(super) fn set_later_frames(&mut self, frames: &[Vec<u8>]) {
        for (ours, theirs) in self.frames.iter_mut().skip(1).zip(frames) {
            ours.copy_from_slice(theirs);
        }
    }
}

/// Implements `SnapshotWrapper` for a wrapper with pictures: the state is the frames that later
/// observations show again. Without stacked frames there are none to keep.
macro_rules! snapshot_pictures {
    ($wrapper:ty) => {
        impl crate::gym::wrappers::wrapper::SnapshotWrapper for $wrapper {
            type State = Vec<Vec<u8>>;

            fn state(&self) -> Vec<Vec<u8>> {
                self.pictures.later_frames()
            }

            fn check_state(&self, state: &Vec<Vec<u8>>) -> Result<(), crate::gym::error::EnvError> {
                self.pictures.check_later_frames(state)
            }

            fn set_state(&mut self, state: &Vec<Vec<u8>>) {
                self.pictures.set_later_frames(state);
            }
        }
    };
}
pub(super) use snapshot_pictures;

fn stack(frames: &VecDeque<Box<[u8]>>, order: ChannelOrder, out: &mut [u8]) {
    let channels = 3 * frames.len();
    for (index, frame) in frames.iter().enumerate() {
        let (pixels, _) = frame.as_chunks::<3>();
        match order {
            ChannelOrder::Hwc => {
                for (pixel, out) in pixels.iter().zip(out.chunks_exact_mut(channels)) {
                    out[3 * index..][..3].copy_from_slice(pixel);
                }
            }
            ChannelOrder::Chw => {
                let planes = out.chunks_exact_mut(pixels.len()).skip(3 * index).take(3);
                for (channel, plane) in planes.enumerate() {
                    for (pixel, out) in pixels.iter().zip(plane) {
                        *out = pixel[channel];
                    }
                }
            }
        }
    }
}
