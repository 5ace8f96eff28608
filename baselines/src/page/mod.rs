//! Self-contained HTML pages that play episodes back (feature `page`).
//!
//! [`episode_page`] turns an environment and a policy into a page; [`PlaybackEnv`] says how your
//! own environment is shown. You build other pages from a [`Document`], [`Playback`]s, [`Plot`]s
//! and [`table`]s. A page loads nothing from elsewhere, and follows the reader's preference for
//! light or dark.
//!
//! ```
//! use baselines::{ScriptedPolicy, page::episode_page};
//! use fetch_env::{Task, make};
//!
//! let mut env = make("FetchPush-v4")?;
//! let html = episode_page(&mut env, &mut ScriptedPolicy::new(Task::Push), 0)?;
//! assert!(html.starts_with("<!doctype html>"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axis;
mod bodies;
mod columns;
mod document;
mod error;
mod frames;
mod pictures;
mod playback;
mod plot;
mod rounding;
mod scene;
#[cfg(all(feature = "learn", feature = "render"))]
mod seen;

pub use axis::Axis;
pub use document::{Column, Document, escape, table};
pub use error::PageError;
pub use playback::Playback;
pub use plot::{Ink, Plot};
pub use scene::{PlaybackEnv, Scene};

use fetch_env::ActionElement;

use crate::policy::Policy;

/// Runs one episode, reset with `seed`, until it is terminated or truncated, and returns the page
/// that plays it back.
///
/// # Errors
/// As [`Playback::record`] and [`Playback::html`].
pub fn episode_page<E: PlaybackEnv>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
    seed: u64,
) -> Result<String, PageError> {
    let playback = Playback::record(env, policy, seed, |_, _, _| ())?;
    let mut page = Document::new(playback.title());
    page.push(&playback.html()?);
    Ok(page.html())
}
