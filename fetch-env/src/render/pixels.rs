//! Observations with pictures.

use std::{collections::VecDeque, fmt, num::NonZeroU8, ops::Deref, sync::Arc};

use fetch_sim::{RenderOptions, Renderer};
use serde::{Deserialize, Serialize};

use super::RenderEnv;
use crate::env::goal::{GoalEnv, GoalObservation};
use crate::env::{Env, Reset, Step};
use crate::error::{EnvError, SpaceError};
use crate::settings::{getters, setters};
use crate::spaces::{DictSpace, ImageSpace, Space, Value, box_space::BoxSpace};

/// An environment that adds pictures of itself to its observations.
///
/// It is Gymnasium's wrapper of this name, with stacked frames. Each observation owns its pictures,
/// and reuses the memory of dropped observations.
///
/// ```
/// use fetch_env::{AddRenderObservation, Env, PixelOptions, make};
///
/// let env = make("FetchPush-v4")?;
/// if let Ok(mut env) = AddRenderObservation::new(env, PixelOptions::default()) {
///     let first = env.reset(Some(0))?.observation;
///     assert_eq!(env.image_space().shape(), [84, 84, 3]);
///     assert_eq!(first.pixels.len(), 84 * 84 * 3);
///     assert!(first.state.object_position().is_some());
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Debug)]
pub struct AddRenderObservation<E> {
    env: E,
    renderer: Renderer,
    order: ChannelOrder,
    image_space: ImageSpace,
    observation_space: Space,
    /// The last frames, oldest first.
    frames: VecDeque<Box<[u8]>>,
    /// The pictures of the last observations, whose memory is reused once they are dropped.
    recent: VecDeque<Pixels>,
}

/// Number of observations whose memory is remembered.
const REMEMBERED: usize = 4;

/// Settings of the pictures of an [`AddRenderObservation`].
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

    setters! {
        /// Sets the number of frames in an observation, the current one last. The default is 1.
        /// After a reset all of them are the first frame.
        with_frame_stack(frame_stack: NonZeroU8),
        /// Sets the order of the axes. The default has the channels last, as Gymnasium does.
        with_channel_order(channel_order: ChannelOrder),
    }

    /// The options of the renderer.
    #[must_use]
    pub const fn render(&self) -> &RenderOptions {
        &self.render
    }

    getters! {
        /// The number of frames in an observation.
        frame_stack: NonZeroU8,
        /// The order of the axes.
        channel_order: ChannelOrder,
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

impl fmt::Debug for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pixels({} bytes)", self.len())
    }
}

/// Observation of an [`AddRenderObservation`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PixelObservation<O> {
    /// The pictures.
    pub pixels: Pixels,
    /// Observation of the wrapped environment.
    pub state: O,
}

impl<E: RenderEnv> AddRenderObservation<E> {
    /// Adds pictures to the observations of `env`.
    ///
    /// # Errors
    /// [`EnvError::Space`] if the observations of `env` already have the key `pixels`;
    /// [`EnvError::Render`] without OpenGL and for invalid options.
    pub fn new(env: E, options: PixelOptions) -> Result<Self, EnvError> {
        let PixelOptions { render, frame_stack, channel_order } = options;
        let count = usize::from(frame_stack.get());
        let (width, height) = (render.width() as usize, render.height() as usize);
        let image_space = ImageSpace::new(match channel_order {
            ChannelOrder::Hwc => [height, width, 3 * count],
            ChannelOrder::Chw => [3 * count, height, width],
        });
        let observation_space = with_pixels(env.observation_space(), image_space)?;
        let renderer = env.renderer(render)?;
        let frame = vec![0; width * height * 3].into_boxed_slice();
        Ok(Self {
            env,
            renderer,
            observation_space,
            order: channel_order,
            image_space,
            frames: vec![frame; count].into(),
            recent: VecDeque::with_capacity(REMEMBERED),
        })
    }

    /// The wrapped environment. There is no mutable access, because a step there would miss its
    /// frame.
    #[must_use]
    pub const fn inner(&self) -> &E {
        &self.env
    }

    /// Removes the wrapper.
    #[must_use]
    pub fn into_inner(self) -> E {
        self.env
    }

    /// The space of the pictures.
    #[must_use]
    pub const fn image_space(&self) -> ImageSpace {
        self.image_space
    }

    /// Renders the current state into the frames from `first` on, and stacks all frames.
    fn observe(&mut self, first: usize) -> Result<Pixels, EnvError> {
        let rgb = self.env.render(&mut self.renderer)?;
        for frame in self.frames.range_mut(first..) {
            frame.copy_from_slice(rgb);
        }
        let free = self.recent.iter_mut().position(|pixels| Arc::get_mut(&mut pixels.0).is_some());
        let mut pixels = match free.and_then(|index| self.recent.remove(index)) {
            Some(pixels) => pixels,
            None => Pixels(vec![0; self.image_space.len()].into()),
        };
        if let Some(bytes) = Arc::get_mut(&mut pixels.0) {
            stack(&self.frames, self.order, bytes);
        }
        if self.recent.len() == REMEMBERED {
            self.recent.pop_front();
        }
        self.recent.push_back(pixels.clone());
        Ok(pixels)
    }
}

/// Returns the space of a state with pictures: a dictionary keeps its keys, anything else becomes
/// `state`.
fn with_pixels(state: &Space, image: ImageSpace) -> Result<Space, SpaceError> {
    let mut spaces: Vec<(String, Space)> = match state {
        Space::Dict(dict) => dict.iter().map(|(key, space)| (key.into(), space.clone())).collect(),
        other => vec![("state".into(), other.clone())],
    };
    spaces.push(("pixels".into(), image.into()));
    Ok(DictSpace::new(spaces)?.into())
}

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

impl<E: RenderEnv> Env for AddRenderObservation<E> {
    type Observation = PixelObservation<E::Observation>;
    type Info = E::Info;
    type ResetOptions = E::ResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Self::Observation, E::Info>, EnvError> {
        let Reset { observation: state, info } = self.env.reset_with(seed, options)?;
        let pixels = self.observe(0)?;
        Ok(Reset { observation: PixelObservation { pixels, state }, info })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<Self::Observation, E::Info>, EnvError> {
        let Step { observation: state, reward, terminated, truncated, info } =
            self.env.step(action)?;
        self.frames.rotate_left(1);
        let pixels = self.observe(self.frames.len() - 1)?;
        let observation = PixelObservation { pixels, state };
        Ok(Step { observation, reward, terminated, truncated, info })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        self.env.action_space()
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

/// Goals and rewards are those of the wrapped environment.
impl<E: RenderEnv + GoalEnv> GoalEnv for AddRenderObservation<E> {
    type GoalReward = E::GoalReward;

    fn goal_reward(&self) -> &E::GoalReward {
        self.env.goal_reward()
    }
}

/// The vectors are those of the state; the pixels are a field.
impl<O: GoalObservation> GoalObservation for PixelObservation<O> {
    fn observation(&self) -> &[f64] {
        self.state.observation()
    }

    fn achieved_goal(&self) -> &[f64] {
        self.state.achieved_goal()
    }

    fn desired_goal(&self) -> &[f64] {
        self.state.desired_goal()
    }

    fn to_value(&self) -> Value {
        let pixels = Value::U8(self.pixels.to_vec());
        match self.state.to_value() {
            Value::Dict(mut values) => {
                values.push(("pixels".into(), pixels));
                Value::Dict(values)
            }
            other => Value::Dict(vec![("state".into(), other), ("pixels".into(), pixels)]),
        }
    }
}
