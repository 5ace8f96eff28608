//! The figure that plays an episode back.

use fetch_env::{ActionElement, EnvError, Step};
use serde::Serialize;

use super::{
    document::escape, error::PageError, frames::Frames, pictures::Pictures, rounding::rounded,
    scene::PlaybackEnv,
};
use crate::{
    evaluate::{Event, check_policy, run_episode},
    policy::Policy,
};

/// A recorded episode as a figure: a 3-D view to play, turn and zoom (WebGL 2), pictures to play,
/// or plots, depending on the environment's [`scene`](PlaybackEnv::scene).
#[derive(Clone, Debug)]
pub struct Playback {
    title: String,
    episode: Recorded,
}

/// The JSON that `playback.js` reads.
#[derive(Clone, Debug, Serialize)]
struct Recorded {
    /// One for each step.
    rewards: Vec<f64>,
    /// One for each frame: the first after the reset, the others after each step.
    distances: Vec<f64>,
    successes: Vec<bool>,
    /// The unit of distances, with a space before it; empty if it is not known.
    unit: &'static str,
    #[serde(flatten)]
    frames: Frames,
    /// What the policy saw at each step, as data URLs; empty if that is not shown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    seen: Vec<String>,
    #[serde(skip)]
    seen_caption: String,
}

impl Playback {
    /// Runs one episode, reset with `seed`, until it is terminated or truncated, and calls `watch`
    /// after each step with its number, counted from 1, its action and its outcome.
    ///
    /// # Errors
    /// [`PageError::Policy`] if the policy does not fit the environment; [`PageError::Environment`]
    /// if a reset or a step fails; [`PageError::Shape`], [`PageError::Simulator`] or
    /// [`PageError::Scene`] if a state cannot be shown.
    pub fn record<E: PlaybackEnv>(
        env: &mut E,
        policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
        seed: u64,
        mut watch: impl FnMut(usize, &[ActionElement<E>], &Step<E::Observation, E::Info>),
    ) -> Result<Self, PageError> {
        check_policy(env, policy)?;
        let failed = |source: EnvError| PageError::Environment { seed, source };
        let mut recorded: Option<Recorded> = None;
        run_episode(env, policy, seed, failed, |env, event| {
            let (observation, info) = match event {
                Event::Start(reset) => {
                    let episode = Recorded::new(Frames::new(env, &reset.observation)?);
                    recorded = Some(episode);
                    (&reset.observation, reset.info.as_ref())
                }
                Event::Step(action, step) => {
                    if let Some(Recorded { rewards, .. }) = &mut recorded {
                        rewards.push(rounded(step.reward));
                        watch(rewards.len(), action, step);
                    }
                    (&step.observation, step.info.as_ref())
                }
            };
            if let Some(episode) = &mut recorded {
                episode.distances.push(rounded(info.distance));
                episode.successes.push(info.is_success);
                episode.frames.push(env, observation)?;
            }
            Ok(())
        })?;
        // Every episode begins with a reset.
        let mut episode = recorded.ok_or_else(|| failed(EnvError::ResetNeeded))?;
        episode.frames.finish();
        Ok(Self { title: format!("{}, seed {seed}", env.title()), episode })
    }

    /// Sets the title. The default names the environment and the seed.
    #[must_use]
    pub fn with_title(self, title: &str) -> Self {
        Self { title: title.into(), ..self }
    }

    /// Shows what the policy saw beside the frames: a picture for each step, all of this width and
    /// height, as in [`Scene::Picture`](super::Scene::Picture), and a sentence about them.
    ///
    /// # Errors
    /// [`PageError::Scene`] if a picture has not this width and height.
    pub fn with_seen<P: AsRef<[u8]>>(
        mut self,
        size: [usize; 2],
        seen: impl IntoIterator<Item = P>,
        caption: &str,
    ) -> Result<Self, PageError> {
        let mut pictures = Pictures::new(size);
        seen.into_iter().try_for_each(|rgb| pictures.push(rgb.as_ref(), size))?;
        self.episode.seen = pictures.into_urls();
        self.episode.seen_caption = format!(" {caption}");
        Ok(self)
    }

    /// Returns the title.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Returns the number of steps.
    #[must_use]
    pub fn num_steps(&self) -> usize {
        self.episode.rewards.len()
    }

    /// Returns the result of the episode in words: its return, how far from the goal it ended if
    /// goals have a distance, and whether it reached the goal.
    #[must_use]
    pub fn outcome(&self) -> String {
        let Recorded { rewards, distances, successes, unit, .. } = &self.episode;
        let distance = distances.last().filter(|distance| distance.is_finite());
        format!(
            "{} steps, return {:.2}{}{}",
            rewards.len(),
            rewards.iter().sum::<f64>(),
            distance.map_or(String::new(), |distance| format!(
                ", {distance:.3}{unit} from the goal at the end"
            )),
            if successes.last() == Some(&true) { ": reached" } else { "" },
        )
    }

    /// Returns the figure, with the episode within it, for a [`Document`](super::Document).
    ///
    /// # Errors
    /// [`PageError::Json`] if the episode cannot be written; [`PageError::Plot`] if a plot cannot
    /// be drawn.
    pub fn html(&self) -> Result<String, PageError> {
        let (title, outcome) = (escape(&self.title), escape(&self.outcome()));
        let caption = format!("<figcaption><strong>{title}</strong>: {outcome}.");
        let (screen, needs, hint) = match &self.episode.frames {
            Frames::Bodies(bodies) => {
                let canvas = format!(
                    "<canvas tabindex=\"0\" role=\"img\" aria-label=\"{title}; drag, or press the \
                     arrow keys, to turn the view\"></canvas>"
                );
                let goals = match bodies.num_goals() {
                    0 => "",
                    1 => " The red ball is the goal.",
                    _ => " The red balls are the goal.",
                };
                let turn = "Drag to turn; pinch, or press + and \u{2212}, to zoom.";
                (canvas, "JavaScript and WebGL 2", format!("{goals} {turn}"))
            }
            Frames::Pictures(_) => (format!("<img alt=\"{title}\">"), "JavaScript", String::new()),
            Frames::Columns(columns) => {
                let Recorded { rewards, distances, .. } = &self.episode;
                let plots = columns.html(rewards, distances)?;
                return Ok(format!(
                    "<figure class=\"columns\">\n{caption}</figcaption>\n{plots}</figure>"
                ));
            }
        };
        // A browser ends a script at the first "</", wherever it is.
        let json = serde_json::to_string(&self.episode)?.replace('<', "\\u003c");
        let seen = if self.episode.seen.is_empty() {
            ""
        } else {
            "\n<img class=\"seen\" alt=\"What the policy sees\">"
        };
        let (last, about_seen) = (self.num_steps(), escape(&self.episode.seen_caption));
        Ok(format!(
            r#"<figure class="playback">
{screen}{seen}
<div class="controls"><button type="button">Play</button><input \
type="range" min="0" max="{last}" step="1" value="0" aria-label="Step"><output></output></div>
<p class="missing">The playback needs {needs}.</p>
{caption}{hint}{about_seen}</figcaption>
<script type="application/json">{json}</script>
</figure>"#
        ))
    }
}

impl Recorded {
    /// Returns an episode without steps.
    fn new(frames: Frames) -> Self {
        let unit = if matches!(frames, Frames::Bodies(_)) { " m" } else { "" };
        let (rewards, distances, successes) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            rewards,
            distances,
            successes,
            unit,
            frames,
            seen: Vec::new(),
            seen_caption: String::new(),
        }
    }
}
