//! Recording episodes of an environment as files.

use std::{
    fs,
    io::{self, Write},
    path::Path,
    sync::Arc,
};

use atomic_write_file::AtomicWriteFile;

use super::video_options::{VideoFormat, VideoOptions};
use super::{Clip, encode::ClipError};
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::wrappers::{
    macros::keep,
    wrapped::Wrapped,
    wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper},
};
use crate::pictures::clip::video_options::VideoError;
use crate::pictures::{pool::RendererPool, render::RenderEnv};

/// Records some episodes as moving pictures.
///
/// It is Gymnasium's wrapper of this name. Steps and resets return what they do without it, bit for
/// bit. A video shows an episode from its reset to its last step. It is written in that step if the
/// wrapped environment ends the episode, so a [`TimeLimit`](crate::TimeLimit) belongs inside, and
/// otherwise by the next reset or by [`finish`](Wrapped::finish). A file of the same name is
/// replaced, but nothing else of that name: a link or a folder is an error. No other file is
/// changed, and nothing is written outside the [folder](VideoOptions::folder).
///
/// Restoring a snapshot drops the frames of a recording that has not ended, and the rest of that
/// episode is not recorded: a video never shows a jump. Dropping the environment drops them too.
///
/// ```no_run
/// use fetch_env::{Env, EnvExt, RecordVideo, VideoOptions, make};
///
/// let options = VideoOptions::new("videos").with_episodes(|episode| episode % 100 == 0);
/// let mut env = make("FetchReach-v4")?.wrap(RecordVideo::new(options))?;
/// env.reset(Some(0))?;
/// while !env.step(&[0.2, 0.0, 0.0, 0.0])?.is_last() {}
/// assert!(std::path::Path::new("videos/rl-video-episode-0.gif").exists());
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
///
/// # Errors of recording
/// A reset or step returns [`RenderError`](fetch_sim::RenderError) or [`VideoError`] if a frame
/// cannot be rendered or a file cannot be written. The video is dropped then, and the environment
/// must be reset.
#[derive(Debug)]
pub struct RecordVideo {
    options: VideoOptions,
    /// `None` without an environment.
    renderers: Option<Arc<RendererPool>>,
    /// The number of episodes that have begun.
    num_episodes: u64,
    /// The frames of this episode; `None` if it is not recorded, or no longer.
    clip: Option<Clip>,
}

impl RecordVideo {
    /// Records episodes as `options` say.
    ///
    /// [`wrap`](crate::EnvExt::wrap) makes the folder, if there is none. It returns a
    /// [`VideoError`] for an invalid name prefix or if the folder cannot be made, and a
    /// [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options.
    #[must_use]
    pub const fn new(options: VideoOptions) -> Self {
        Self { options, renderers: None, num_episodes: 0, clip: None }
    }
}

impl<E> Wrapped<E, RecordVideo> {
    /// The settings.
    pub const fn options(&self) -> &VideoOptions {
        &self.wrapper().options
    }

    /// The number of episodes that have begun. The last of them has this number less one.
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
    /// [`VideoError`] if the file cannot be written.
    pub fn finish(&mut self) -> Result<(), EnvError> {
        self.wrapper_mut().finish()
    }
}

impl RecordVideo {
    fn finish(&mut self) -> Result<(), EnvError> {
        let Some(clip) = self.clip.take() else { return Ok(()) };
        let path = self.options.path(self.num_episodes.saturating_sub(1));
        let mut bytes = Vec::new();
        match self.options.format() {
            VideoFormat::Gif => clip.write_gif(&mut bytes),
            VideoFormat::Apng => clip.write_apng(&mut bytes),
        }
        .map_err(|error| VideoError::write(&path, &error))?;
        write(&path, &bytes).map_err(|error| VideoError::write(&path, &error).into())
    }

    /// Adds the current state to the video.
    fn record(&mut self, env: &impl RenderEnv) -> Result<(), EnvError> {
        let Some(mut clip) = self.clip.take() else { return Ok(()) };
        let renderers = self.renderers.as_ref().ok_or(EnvError::ResetNeeded)?;
        renderers.render(env, |rgb| clip.push(rgb))?.map_err(|error| self.invalid(&error))?;
        let is_full =
            self.options.max_frames().is_some_and(|max| clip.frames().len() >= max.get() as usize);
        self.clip = Some(clip);
        if is_full { self.finish() } else { Ok(()) }
    }

    fn start(&self) -> Result<Clip, EnvError> {
        let render = self.options.render();
        Ok(Clip::new(render.width(), render.height()).map_err(|error| self.invalid(&error))?)
    }

    fn invalid(&self, error: &ClipError) -> VideoError {
        VideoError::write(self.options.folder(), error)
    }
}

/// Writes a file that appears as a whole, so that a viewer never finds half a video.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if fs::symlink_metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it is no regular file"));
    }
    let mut file = AtomicWriteFile::open(path)?;
    file.write_all(bytes)?;
    file.commit()
}

impl<E: RenderEnv> Wrapper<E> for RecordVideo {
    keep!(Observation, Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        self.options.check()?;
        let renderers = RendererPool::shared(env, self.options.render().clone())?;
        let folder = self.options.folder();
        fs::create_dir_all(folder).map_err(|error| VideoError::write(folder, &error))?;
        (self.renderers, self.num_episodes, self.clip) = (Some(renderers), 0, None);
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
        if self.options.records(episode) {
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

impl KeepsGoals for RecordVideo {}

/// The state is the number of episodes, so that a restored run numbers its videos as before.
impl SnapshotWrapper for RecordVideo {
    type State = u64;

    fn state(&self) -> u64 {
        self.num_episodes
    }

    fn check_state(&self, _state: &u64) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, state: &u64) {
        self.num_episodes = *state;
        self.clip = None;
    }
}
