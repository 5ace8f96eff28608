//! The pictures of an environment: drawing, stacking and reusing them.

use std::{collections::VecDeque, num::NonZeroU8, sync::Arc};

use fetch_sim::RenderOptions;
use serde::{Deserialize, Serialize};

use super::observations::{Layout, Pixels};
use super::{render::RenderEnv, view::View};
use crate::gym::spaces::{DictSpace, ImageSpace, Space, error::SpaceError, num_elements};
use crate::gym::wrappers::array::ArrayPool;
use crate::gym::{env::Env, error::EnvError};

/// Settings of pictures as observations.
///
/// ```
/// use fetch_env::{Camera, PixelOptions, RenderOptions};
///
/// let small = RenderOptions::default().with_width(84).with_height(84).with_samples(0);
/// let above = Camera::Named("external_camera_0".into());
/// let options = PixelOptions::default()
///     .with_views([("scene", small.clone()), ("above", small.with_camera(above))]);
/// let space = options.space()?;
/// assert!(space.as_dict().is_some_and(|images| images.get("above").is_some()));
/// # Ok::<(), fetch_env::spaces::SpaceError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[must_use]
pub struct PixelOptions {
    /// What is drawn, by key; one view may have no key.
    views: Vec<(Option<String>, RenderOptions)>,
    frame_stack: NonZeroU8,
    channels_first: bool,
}

impl Default for PixelOptions {
    fn default() -> Self {
        let render = RenderOptions::default().with_width(84).with_height(84).with_samples(0);
        let views = vec![(None, render)];
        Self { views, frame_stack: NonZeroU8::MIN, channels_first: false }
    }
}

impl PixelOptions {
    /// Shows one view, without a key. The default is 84 x 84 pixels without smooth edges, as
    /// policies use them, from the reference's camera.
    pub fn with_render(mut self, render: RenderOptions) -> Self {
        self.views = vec![(None, render)];
        self
    }

    /// Shows several views, such as those of several cameras, each with its key.
    pub fn with_views(
        mut self,
        views: impl IntoIterator<Item = (impl Into<String>, RenderOptions)>,
    ) -> Self {
        self.views = views.into_iter().map(|(key, view)| (Some(key.into()), view)).collect();
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

    /// Returns the views with their keys, in order.
    pub fn views(&self) -> impl ExactSizeIterator<Item = (Option<&str>, &RenderOptions)> {
        self.views.iter().map(|(key, view)| (key.as_deref(), view))
    }

    /// Returns the space of the pictures: an image, or a dictionary of images if they have keys.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if a view's pictures have more than 2^28 bytes;
    /// [`SpaceError::DuplicateKey`] if two views have one key.
    pub fn space(&self) -> Result<Space, SpaceError> {
        if let [(None, view)] = &*self.views {
            return Ok(self.image_space(view)?.into());
        }
        let images = self
            .views()
            .map(|(key, view)| Ok((key.unwrap_or_default(), self.image_space(view)?.into())));
        Ok(DictSpace::new(images.collect::<Result<Vec<_>, SpaceError>>()?)?.into())
    }

    fn image_space(&self, view: &RenderOptions) -> Result<ImageSpace, SpaceError> {
        let [width, height] = [view.width(), view.height()].map(|side| side as usize);
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
    /// Empty without an environment.
    views: Vec<View>,
    /// Where each view's pictures are in an observation.
    layout: Arc<Layout>,
    /// The last frames, oldest first: of all views, one after another.
    frames: VecDeque<Box<[u8]>>,
    pool: ArrayPool<u8>,
}

impl Pictures {
    pub(super) fn new(options: PixelOptions) -> Self {
        let (views, layout, frames) = (Vec::new(), Arc::from([]), VecDeque::new());
        Self { options, observation_space: None, views, layout, frames, pool: ArrayPool::new(0) }
    }

    /// Prepares pictures of `env`. `make_space` makes the space of the observations from those of
    /// the state and of the pictures.
    ///
    /// # Errors
    /// As [`RenderEnv::renderer`], [`PixelOptions::space`] and `make_space`, and
    /// [`SpaceError::TooLarge`] if the pictures of all views have more than 2^28 bytes.
    pub(super) fn attach<E: RenderEnv>(
        &mut self,
        env: &E,
        make_space: impl FnOnce(&Space, Space) -> Result<Space, SpaceError>,
    ) -> Result<(), EnvError> {
        let options = &self.options;
        let space = make_space(env.observation_space(), options.space()?)?;
        let (mut layout, mut len) = (Vec::new(), 0);
        for (key, view) in &options.views {
            let start = len;
            len += options.image_space(view)?.len();
            layout.push((key.clone(), start..len));
        }
        num_elements(&[len])?;
        let view = |(_, view): &(_, RenderOptions)| View::new(env, view.clone());
        self.views = options.views.iter().map(view).collect::<Result<_, _>>()?;
        self.layout = layout.into();
        let count = usize::from(options.frame_stack.get());
        self.frames = vec![vec![0; len / count].into_boxed_slice(); count].into();
        self.pool = ArrayPool::new(len);
        self.observation_space = Some(space);
        Ok(())
    }

    /// Returns the space of the observations.
    pub(super) fn observation_space<'a, E: Env>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
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
        let Self { frames, options: PixelOptions { channels_first, .. }, .. } = self;
        let count = frames.len();
        for (view, (_, bytes)) in self.views.iter().zip(&*self.layout) {
            let bytes = bytes.start / count..bytes.end / count;
            view.draw(env, |renderer| {
                let rgb = env.render(renderer)?;
                for frame in frames.range_mut(first..) {
                    frame[bytes.clone()].copy_from_slice(rgb);
                }
                Ok(())
            })?;
        }
        let pixels = self.pool.write(|pixels| {
            for (_, bytes) in &*self.layout {
                let part = bytes.start / count..bytes.end / count;
                let frames = frames.iter().map(|frame| &frame[part.clone()]);
                stack(frames, *channels_first, &mut pixels[bytes.clone()]);
            }
        });
        Ok(Pixels::new(pixels, Arc::clone(&self.layout)))
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

fn stack<'a>(
    frames: impl ExactSizeIterator<Item = &'a [u8]>,
    channels_first: bool,
    out: &mut [u8],
) {
    let channels = 3 * frames.len();
    for (index, frame) in frames.enumerate() {
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
