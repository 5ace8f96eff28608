//! Recording of episodes as files.

use std::{
    fmt, fs,
    io::{self, Write},
    num::NonZeroU32,
    path::{Path, PathBuf},
    sync::Arc,
};

use atomic_write_file::AtomicWriteFile;
use fetch_sim::RenderOptions;
use serde::{Deserialize, Serialize};

use super::{Clip, error::ClipError};
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::np_random::MAX_COUNT;
use crate::gym::wrappers::{
    macros::keep,
    wrapped::Wrapped,
    wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper},
};
use crate::pictures::{render::RenderEnv, view::View};

/// Records some episodes as videos.
///
/// It is Gymnasium's wrapper of this name. Steps and resets return what they would without it, bit
/// for bit. A video shows an episode from its reset to its last step. It is written in that step if
/// the wrapped environment ends the episode, so a [`TimeLimit`](crate::TimeLimit) belongs inside,
/// and otherwise by the next reset or by [`finish`](Wrapped::finish). A file of the same name is
/// replaced, but nothing else of that name: a link or a folder is an error. No other file is
/// changed, and nothing is written outside the [folder](RecordVideo::folder).
///
/// Restoring a snapshot drops the frames of a recording that has not ended, and the rest of that
/// episode is not recorded: a video never shows a jump. Dropping the environment drops them too.
///
/// ```no_run
/// use fetch_env::{Env, EnvExt, RecordVideo, make};
///
/// let video = RecordVideo::new("videos").with_episodes(|episode| episode % 100 == 0);
/// let mut env = make("FetchReach-v4")?.wrap(video)?;
/// env.reset(Some(0))?;
/// while !env.step(&[0.2, 0.0, 0.0, 0.0])?.is_last() {}
/// assert!(std::path::Path::new("videos/rl-video-episode-0.gif").exists());
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
///
/// # Errors of recording
/// A reset or step returns [`RenderError`](fetch_sim::RenderError) or [`ClipError`] if a frame
/// cannot be rendered or a file cannot be written. The video is dropped then, and the environment
/// must be reset.
#[must_use]
pub struct RecordVideo {
    folder: PathBuf,
    name_prefix: String,
    episodes: Arc<dyn Fn(u64) -> bool + Send + Sync>,
    max_frames: Option<NonZeroU32>,
    format: VideoFormat,
    render: RenderOptions,
    /// `None` without an environment.
    view: Option<View>,
    /// The number of episodes that have begun.
    num_episodes: u64,
    /// The frames of this episode; `None` if it is not recorded, or no longer.
    clip: Option<Clip>,
}

impl RecordVideo {
    /// Records videos in `folder`.
    ///
    /// [`wrap`](crate::EnvExt::wrap) makes the folder, if there is none. It returns a [`ClipError`]
    /// for an invalid name prefix or if the folder cannot be made, and a
    /// [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            name_prefix: "rl-video".into(),
            episodes: Arc::new(capped_cubic),
            max_frames: None,
            format: VideoFormat::default(),
            render: RenderOptions::default(),
            view: None,
            num_episodes: 0,
            clip: None,
        }
    }

    /// Sets the start of the file names. The default is `rl-video`, as in Gymnasium. Environments
    /// that record into one folder need different ones.
    pub fn with_name_prefix(mut self, name_prefix: impl Into<String>) -> Self {
        self.name_prefix = name_prefix.into();
        self
    }

    /// Sets which episodes are recorded, by the number of episodes that the environment has begun
    /// before. The default is Gymnasium's: 0, 1, 8, 27 and so on up to 729, then every 1000th.
    pub fn with_episodes(mut self, episodes: impl Fn(u64) -> bool + Send + Sync + 'static) -> Self {
        self.episodes = Arc::new(episodes);
        self
    }

    /// Sets the options of the renderer. The default is the reference's pictures, 480 x 480 pixels.
    pub fn with_render(mut self, render: RenderOptions) -> Self {
        self.render = render;
        self
    }

    settings! {
        /// Sets the number of frames after which a video ends, even if its episode does not. The
        /// default, `None`, records whole episodes. Frames are kept in memory until then.
        with_max_frames(max_frames: Option<NonZeroU32>);
        /// Sets the file format. The default is GIF.
        with_format(format: VideoFormat);

        /// Returns the number of frames after which a video ends.
        max_frames: Option<NonZeroU32>;
        /// Returns the file format.
        format: VideoFormat;
    }

    /// Returns the folder of the videos.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the start of the file names.
    #[must_use]
    pub fn name_prefix(&self) -> &str {
        &self.name_prefix
    }

    /// Whether an episode is recorded, by its number from 0.
    #[must_use]
    pub fn records(&self, episode: u64) -> bool {
        (self.episodes)(episode)
    }

    /// Returns the options of the renderer.
    pub const fn render(&self) -> &RenderOptions {
        &self.render
    }

    /// Returns the file of an episode's video, by the number of the episode from 0:
    /// `{folder}/{name_prefix}-episode-{episode}.{extension}`.
    #[must_use]
    pub fn path(&self, episode: u64) -> PathBuf {
        let (prefix, extension) = (&self.name_prefix, self.format.extension());
        self.folder.join(format!("{prefix}-episode-{episode}.{extension}"))
    }

    /// Rejects a prefix that would lead out of the folder.
    fn check(&self) -> Result<(), ClipError> {
        if self.name_prefix.contains(['/', '\\', '\0', ':']) {
            return Err(ClipError::NamePrefix { name_prefix: self.name_prefix.clone() });
        }
        Ok(())
    }
}

/// File format of a video.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum VideoFormat {
    /// GIF, which every viewer shows, in 256 colors.
    #[default]
    Gif,
    /// Animated PNG: lossless, about four times as large.
    Apng,
}

impl VideoFormat {
    /// Returns the extension of its files, without a dot: `gif` or `png`.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Apng => "png",
        }
    }
}

impl<E> Wrapped<E, RecordVideo> {
    /// Returns the number of episodes that have begun. The last of them has this number minus one.
    #[must_use]
    pub const fn num_episodes(&self) -> u64 {
        self.wrapper().num_episodes
    }

    /// Whether the current episode is being recorded.
    #[must_use]
    pub const fn is_recording(&self) -> bool {
        self.wrapper().clip.is_some()
    }

    /// Writes the video of an episode that has not ended, and stops recording it.
    ///
    /// # Errors
    /// [`ClipError`] if the file cannot be written.
    pub fn finish(&mut self) -> Result<(), EnvError> {
        self.wrapper_mut().finish()
    }
}

impl RecordVideo {
    fn finish(&mut self) -> Result<(), EnvError> {
        let Some(clip) = self.clip.take() else { return Ok(()) };
        let path = self.path(self.num_episodes.saturating_sub(1));
        let mut bytes = Vec::new();
        match self.format {
            VideoFormat::Gif => clip.write_gif(&mut bytes),
            VideoFormat::Apng => clip.write_apng(&mut bytes),
        }
        .map_err(|error| unwritten(&path, &error))?;
        write(&path, &bytes).map_err(|error| unwritten(&path, &error).into())
    }

    /// Adds the current state to the video.
    fn record(&mut self, env: &impl RenderEnv) -> Result<(), EnvError> {
        let Some(mut clip) = self.clip.take() else { return Ok(()) };
        let view = self.view.as_ref().ok_or(EnvError::ResetNeeded)?;
        view.draw(env, |renderer| Ok(clip.push(env.render(renderer)?)))?
            .map_err(|error| self.invalid(&error))?;
        let is_full = self.max_frames.is_some_and(|max| clip.frames().len() >= max.get() as usize);
        self.clip = Some(clip);
        if is_full { self.finish() } else { Ok(()) }
    }

    fn start(&self) -> Result<Clip, EnvError> {
        let render = &self.render;
        Ok(Clip::new(render.width(), render.height()).map_err(|error| self.invalid(&error))?)
    }

    fn invalid(&self, error: &ClipError) -> ClipError {
        unwritten(&self.folder, error)
    }
}

impl fmt::Debug for RecordVideo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RecordVideo")
            .field("folder", &self.folder)
            .field("name_prefix", &self.name_prefix)
            .field("max_frames", &self.max_frames)
            .field("format", &self.format)
            .field("render", &self.render)
            .field("num_episodes", &self.num_episodes)
            .finish_non_exhaustive()
    }
}

/// Returns the error for a folder or file that cannot be written.
fn unwritten(path: &Path, reason: &dyn fmt::Display) -> ClipError {
    ClipError::Video { path: path.into(), reason: reason.to_string() }
}

/// Writes a file that appears as a whole, so that a viewer never finds half a video.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if fs::symlink_metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it is not a regular file"));
    }
    let mut file = AtomicWriteFile::open(path)?;
    file.write_all(bytes)?;
    file.commit()
}

impl<E: RenderEnv> Wrapper<E> for RecordVideo {
    keep!(Observation, Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        self.check()?;
        let view = View::new(env, self.render.clone())?;
        let folder = &self.folder;
        fs::create_dir_all(folder).map_err(|error| unwritten(folder, &error))?;
        (self.view, self.num_episodes, self.clip) = (Some(view), 0, None);
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        // The frames are those of the last episode, whose number is still the last one.
        self.finish()?;
        let episode = self.num_episodes;
        self.num_episodes += 1;
        if self.records(episode) {
            self.clip = Some(self.start()?);
            self.record(&**env)?;
        }
        Ok(reset)
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        let step = env.step(action)?;
        self.record(env)?;
        if step.is_last() {
            self.finish()?;
        }
        Ok(step)
    }
}

impl KeepsGoals for RecordVideo {
    const KEEPS_SYMMETRIES: bool = true;
}

/// The state is the number of episodes, so that a restored run numbers its videos as before.
impl SnapshotWrapper for RecordVideo {
    type State = u64;

    fn state(&self) -> u64 {
        self.num_episodes
    }

    fn check_state(&self, state: &u64) -> Result<(), EnvError> {
        if *state > MAX_COUNT {
            let reason = format!("{state} episodes have been counted");
            return Err(EnvError::ForeignSnapshot { reason });
        }
        Ok(())
    }

    fn set_state(&mut self, state: &u64) {
        self.num_episodes = *state;
        self.clip = None;
    }
}

/// Gymnasium's `capped_cubic_video_schedule`.
fn capped_cubic(episode: u64) -> bool {
    if episode < 1000 {
        (0..10).any(|root: u64| root.pow(3) == episode)
    } else {
        episode.is_multiple_of(1000)
    }
}
