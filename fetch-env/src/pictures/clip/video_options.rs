//! Settings of recorded videos: which episodes, where, and how they look.

use std::{
    fmt,
    num::NonZeroU32,
    path::{Path, PathBuf},
    sync::Arc,
};

use fetch_sim::RenderOptions;
use serde::{Deserialize, Serialize};

use crate::gym::error::EnvError;

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
    /// The extension of its files, without a dot: `gif` or `png`.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Apng => "png",
        }
    }
}

/// Settings of a [`RecordVideo`](crate::RecordVideo).
#[derive(Clone)]
#[must_use]
pub struct VideoOptions {
    folder: PathBuf,
    name_prefix: String,
    episodes: Arc<dyn Fn(u64) -> bool + Send + Sync>,
    max_frames: Option<NonZeroU32>,
    format: VideoFormat,
    render: RenderOptions,
}

impl VideoOptions {
    /// Creates settings for videos in `folder`.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            name_prefix: "rl-video".into(),
            episodes: Arc::new(capped_cubic),
            max_frames: None,
            format: VideoFormat::default(),
            render: RenderOptions::default(),
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
    }

    /// The folder of the videos.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The start of the file names.
    #[must_use]
    pub fn name_prefix(&self) -> &str {
        &self.name_prefix
    }

    /// Whether an episode is recorded, by its number from 0.
    #[must_use]
    pub fn records(&self, episode: u64) -> bool {
        (self.episodes)(episode)
    }

    /// The options of the renderer.
    #[must_use]
    pub const fn render(&self) -> &RenderOptions {
        &self.render
    }

    settings! {
        /// The number of frames after which a video ends.
        max_frames: Option<NonZeroU32>;
        /// The file format.
        format: VideoFormat;
    }

    /// The file of an episode's video, by the number of the episode from 0:
    /// `{folder}/{name_prefix}-episode-{episode}.{extension}`.
    #[must_use]
    pub fn path(&self, episode: u64) -> PathBuf {
        let (prefix, extension) = (&self.name_prefix, self.format.extension());
        self.folder.join(format!("{prefix}-episode-{episode}.{extension}"))
    }

    /// Rejects a prefix that would lead out of the folder.
    pub(super) fn check(&self) -> Result<(), VideoError> {
        if self.name_prefix.contains(['/', '\\', '\0', ':']) {
            return Err(VideoError::NamePrefix { name_prefix: self.name_prefix.clone() });
        }
        Ok(())
    }
}

impl fmt::Debug for VideoOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("VideoOptions")
            .field("folder", &self.folder)
            .field("name_prefix", &self.name_prefix)
            .field("max_frames", &self.max_frames)
            .field("format", &self.format)
            .field("render", &self.render)
            .finish_non_exhaustive()
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

/// Error returned when an episode cannot be recorded.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VideoError {
    /// A name prefix that is a path.
    #[error("{name_prefix:?} cannot begin a file's name: leave out / \\ : and NUL")]
    NamePrefix {
        /// The prefix.
        name_prefix: String,
    },
    /// The folder or the file cannot be written.
    #[error("the video {} could not be written ({reason}): check its folder", path.display())]
    Write {
        /// The folder or file.
        path: PathBuf,
        /// The message of the operating system or of the encoder.
        reason: String,
    },
}

debug_as_display!(VideoError);

impl VideoError {
    pub(super) fn write(path: &Path, reason: &dyn fmt::Display) -> Self {
        Self::Write { path: path.into(), reason: reason.to_string() }
    }
}

impl From<VideoError> for EnvError {
    fn from(error: VideoError) -> Self {
        Self::other(error)
    }
}
