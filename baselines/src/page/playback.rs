//! The figure that plays an episode back, and what it is drawn from.

use fetch_env::wrappers::Wrapped;
use fetch_env::{
    BoxSpace, EnvError, EnvId, FetchEnv, FetchObservation, GoalEnv, GoalObservation, Info,
    ModelSource, Step, Task, TimeLimit,
};
use fetch_sim::{BodyId, MujocoSimulator, Shape, SimError, Simulator, VisualGeom};
use serde::Serialize;

use super::{document::escape, error::PageError};
use crate::{
    evaluate::{Event, run_episode},
    policy::Policy,
};

/// An environment whose episodes can be played back: a Fetch environment on MuJoCo, in wrappers
/// that leave its observations alone. A wrapper of yours needs only to pass
/// [`fetch_env`](Self::fetch_env) on.
///
/// ```
/// use baselines::page::PlaybackEnv;
/// use fetch_env::{Simulator, make};
///
/// /// Returns the simulated time of one step, in seconds.
/// fn seconds_per_step(env: &impl PlaybackEnv) -> f64 {
///     env.fetch_env().simulator().control_period()
/// }
///
/// assert_eq!(seconds_per_step(&make("FetchReach-v4")?), 0.04);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait PlaybackEnv:
    GoalEnv<Observation = FetchObservation, ActionSpace = BoxSpace<f32>>
{
    /// Returns the environment below all wrappers.
    fn fetch_env(&self) -> &FetchEnv<MujocoSimulator>;
}

impl PlaybackEnv for FetchEnv<MujocoSimulator> {
    fn fetch_env(&self) -> &FetchEnv<MujocoSimulator> {
        self
    }
}

impl<E: PlaybackEnv> PlaybackEnv for Wrapped<E, TimeLimit> {
    fn fetch_env(&self) -> &FetchEnv<MujocoSimulator> {
        self.inner().fetch_env()
    }
}

/// A recorded episode as a figure to play, turn and zoom (WebGL 2).
#[derive(Clone, Debug)]
pub struct Playback {
    title: String,
    episode: Recorded,
}

/// The JSON that `playback.js` reads.
#[derive(Clone, Debug, Default, Serialize)]
struct Recorded {
    /// Duration of a step, in seconds.
    period: f64,
    goal: [f64; 3],
    view: View,
    shapes: Vec<DrawnShape>,
    meshes: Vec<Mesh>,
    /// For each body that carries a shape, its position and quaternion in every frame, one after
    /// the other; only the first frame's for a body at rest.
    bodies: Vec<Vec<f64>>,
    /// One for each step.
    rewards: Vec<f64>,
    /// One for each frame: the first after the reset, the others after each step.
    distances: Vec<f64>,
    successes: Vec<bool>,
}

/// The point at which the camera looks, and its distance from it (meters).
#[derive(Clone, Debug, Default, Serialize)]
struct View {
    at: [f64; 3],
    distance: f64,
}

#[derive(Clone, Debug, Serialize)]
struct DrawnShape {
    shape: &'static str,
    size: [f64; 3],
    /// Index in `meshes` of a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<usize>,
    rgba: [f64; 4],
    /// Index of its body in `bodies`.
    body: usize,
    position: [f64; 3],
    quaternion: [f64; 4],
}

/// Triangles that share their corners.
#[derive(Clone, Debug, Default, Serialize)]
struct Mesh {
    /// In tenths of a millimeter.
    corners: Vec<[i32; 3]>,
    /// Three indices in `corners` each.
    triangles: Vec<[usize; 3]>,
}

impl Playback {
    /// Runs one episode, reset with `seed`, until it is terminated or truncated, and calls `watch`
    /// after each step with its number, counted from 1, its action and its outcome.
    ///
    /// # Errors
    /// [`PageError::Environment`] if a reset or a step fails; [`PageError::ForeignModel`] if the
    /// environment does not simulate the built-in model.
    pub fn record<E: PlaybackEnv>(
        env: &mut E,
        policy: &mut (impl Policy + ?Sized),
        seed: u64,
        mut watch: impl FnMut(usize, &[f32], &Step<FetchObservation, E::Info>),
    ) -> Result<Self, PageError> {
        let failed = |source| PageError::Environment { seed, source };
        let config = env.fetch_env().config();
        if *config.sim().model() != ModelSource::Builtin {
            return Err(PageError::ForeignModel);
        }
        let id = EnvId { task: config.task(), reward: config.reward() };
        let geoms = VisualGeom::of(config.sim()).map_err(|e| failed(EnvError::from(e)))?;
        let (mut carriers, mut meshes) = (Vec::new(), Vec::new());
        let shapes = geoms
            .iter()
            .map(|geom| DrawnShape::new(geom, index_of(&mut carriers, geom.body), &mut meshes))
            .collect::<Result<_, PageError>>()?;
        let mut episode = Recorded {
            period: env.fetch_env().simulator().control_period(),
            view: View::of(id.task),
            shapes,
            meshes,
            bodies: vec![Vec::new(); carriers.len()],
            ..Recorded::default()
        };
        run_episode(env, policy, seed, failed, |env, event| {
            let info = match event {
                Event::Start(reset) => {
                    episode.goal.copy_from_slice(reset.observation.desired_goal());
                    &reset.info
                }
                Event::Step(action, step) => {
                    episode.rewards.push(rounded(step.reward));
                    watch(episode.rewards.len(), action, step);
                    &step.info
                }
            };
            let pushed = episode.push(env.fetch_env().simulator(), &carriers, info.as_ref());
            pushed.map_err(|error| failed(EnvError::from(error)))
        })?;
        for poses in &mut episode.bodies {
            if poses.chunks_exact(7).all(|pose| pose == &poses[..7]) {
                poses.truncate(7);
            }
        }
        Ok(Self { title: format!("{id}, seed {seed}"), episode })
    }

    /// Sets the title. The default names the environment and the seed.
    #[must_use]
    pub fn with_title(self, title: &str) -> Self {
        Self { title: title.into(), ..self }
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

    /// Returns the result of the episode in words: its return and how far from the goal it ended.
    #[must_use]
    pub fn outcome(&self) -> String {
        let Recorded { rewards, distances, successes, .. } = &self.episode;
        format!(
            "{} steps, return {:.2}, {:.3} m from the goal at the end{}",
            rewards.len(),
            rewards.iter().sum::<f64>(),
            distances.last().copied().unwrap_or(f64::NAN),
            if successes.last() == Some(&true) { ": reached" } else { "" },
        )
    }

    /// Returns the figure, with the episode within it, for a [`Document`](super::Document).
    ///
    /// # Errors
    /// [`PageError::Json`] if the episode cannot be written.
    pub fn html(&self) -> Result<String, PageError> {
        // A browser ends a script at the first "</", wherever it stands.
        let json = serde_json::to_string(&self.episode)?.replace('<', "\\u003c");
        let (title, outcome) = (escape(&self.title), escape(&self.outcome()));
        let last = self.num_steps();
        Ok(format!(
            r#"<figure class="playback">
<canvas tabindex="0" role="img" \
aria-label="{title}; drag, or press the arrow keys, to turn the view"></canvas>
<div class="controls"><button type="button">Play</button><input \
type="range" min="0" max="{last}" step="1" value="0" aria-label="Step"><output></output></div>
<p class="missing">The playback needs JavaScript and WebGL 2.</p>
<figcaption><strong>{title}</strong>: {outcome}. The red ball is the goal. Drag to turn; pinch, or \
press + and −, to zoom.</figcaption>
<script type="application/json">{json}</script>
</figure>"#
        ))
    }
}

impl Recorded {
    /// Adds a frame.
    fn push(
        &mut self,
        simulator: &MujocoSimulator,
        carriers: &[BodyId],
        info: &Info,
    ) -> Result<(), SimError> {
        for (poses, &body) in self.bodies.iter_mut().zip(carriers) {
            let (position, q) = simulator.data().body_pose(body)?;
            poses.extend(position.iter().chain(&[q.w, q.i, q.j, q.k]).copied().map(rounded));
        }
        self.distances.push(rounded(info.distance));
        self.successes.push(info.is_success);
        Ok(())
    }
}

impl View {
    /// Looks at a scene as the reference does, from somewhat farther: to show the whole robot, and
    /// all of Slide's long table.
    const fn of(task: Task) -> Self {
        match task {
            Task::Slide => Self { at: [1.1, 0.75, 0.42], distance: 2.9 },
            _ => Self { at: [1.0, 0.75, 0.46], distance: 2.5 },
        }
    }
}

impl DrawnShape {
    fn new(geom: &VisualGeom, body: usize, meshes: &mut Vec<Mesh>) -> Result<Self, PageError> {
        let mut mesh = None;
        let (shape, size) = match &geom.shape {
            Shape::Plane { half_size: [x, y] } => ("plane", [*x, *y, 0.0]),
            Shape::Sphere { radius } => ("sphere", [*radius, 0.0, 0.0]),
            Shape::Capsule { radius, half_length } => ("capsule", [*radius, *half_length, 0.0]),
            Shape::Ellipsoid { radii } => ("ellipsoid", *radii),
            Shape::Cylinder { radius, half_length } => ("cylinder", [*radius, *half_length, 0.0]),
            Shape::Box { half_size } => ("box", *half_size),
            Shape::Mesh { triangles } => {
                mesh = Some(meshes.len());
                meshes.push(Mesh::new(triangles));
                ("mesh", [0.0; 3])
            }
            other => return Err(PageError::Shape { shape: format!("{other:?}") }),
        };
        let q = geom.orientation;
        Ok(Self {
            shape,
            size,
            mesh,
            rgba: geom.rgba.map(|channel| rounded(channel.into())),
            body,
            position: geom.position.map(rounded).into(),
            quaternion: [q.w, q.i, q.j, q.k].map(rounded),
        })
    }
}

impl Mesh {
    fn new(triangles: &[[[f64; 3]; 3]]) -> Self {
        let mut corners = Vec::new();
        let tenths = |corner: [f64; 3]| corner.map(|meters| (meters * 1e4).round() as i32);
        let triangles = triangles
            .iter()
            .map(|triangle| triangle.map(|corner| index_of(&mut corners, tenths(corner))))
            .collect();
        Self { corners, triangles }
    }
}

/// Returns the index of an item, adding it if it is new.
fn index_of<T: PartialEq>(items: &mut Vec<T>, item: T) -> usize {
    items.iter().position(|known| *known == item).unwrap_or_else(|| {
        items.push(item);
        items.len() - 1
    })
}

/// Rounds to a hundredth of a millimeter, which is far less than a pixel.
fn rounded(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}
