//! An episode as it is played back: what there is to draw, and what each step came to.

use anyhow::Context;
use baselines::Action;
use fetch_env::{
    Env, EnvId, FetchObservation, GoalObservation, Info, MujocoEnv, Step, make_with_config,
};
use fetch_sim::{BodyId, Shape, Simulator, Task, VisualGeom};
use serde::Serialize;

use crate::policy_choice::PolicyChoice;

/// The JSON that `playback.js` reads.
#[derive(Debug, Serialize)]
pub struct Recording {
    #[serde(skip)]
    title: String,
    /// Duration of a step, in seconds.
    period: f64,
    goal: [f64; 3],
    view: View,
    shapes: Vec<DrawnShape>,
    meshes: Vec<Mesh>,
    /// For each body that carries a shape, its position and quaternion in every frame, one after
    /// the other; only the first frame's for a body that rests.
    bodies: Vec<Vec<f64>>,
    /// One a step.
    rewards: Vec<f64>,
    /// One a frame: the reset's, then one a step.
    distances: Vec<f64>,
    successes: Vec<bool>,
}

/// Where the camera looks, and from how far (meters).
#[derive(Debug, Serialize)]
struct View {
    at: [f64; 3],
    distance: f64,
}

#[derive(Debug, Serialize)]
struct DrawnShape {
    shape: &'static str,
    size: [f64; 3],
    /// Index in `meshes`, if it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<usize>,
    rgba: [f64; 4],
    /// Index of its body in `bodies`.
    body: usize,
    position: [f64; 3],
    quaternion: [f64; 4],
}

/// Triangles; a corner is told once, for all that meet there.
#[derive(Debug, Default, Serialize)]
struct Mesh {
    /// In tenths of a millimeter.
    corners: Vec<[i32; 3]>,
    /// Three indices in `corners` each.
    triangles: Vec<[usize; 3]>,
}

impl Recording {
    /// Runs one episode; `each` is told the number, the action and the outcome of every step.
    pub fn of(
        id: EnvId,
        policy: PolicyChoice,
        seed: u64,
        mut each: impl FnMut(usize, &Action, &Step<FetchObservation, Info>),
    ) -> anyhow::Result<Self> {
        let mut env = make_with_config(id.config())?;
        let geoms = VisualGeom::of_builtin(id.task)?;
        let mut carriers: Vec<BodyId> = Vec::new();
        let mut meshes = Vec::new();
        let shapes = geoms
            .iter()
            .map(|geom| {
                let known = carriers.iter().position(|&body| body == geom.body);
                let body = known.unwrap_or_else(|| {
                    carriers.push(geom.body);
                    carriers.len() - 1
                });
                DrawnShape::new(geom, body, &mut meshes)
            })
            .collect::<anyhow::Result<_>>()?;

        let start = env.reset(Some(seed))?;
        let mut recording = Self {
            title: format!("{id}, {} policy, seed {seed}", policy.name()),
            period: env.inner().simulator().control_period(),
            goal: start
                .observation
                .desired_goal()
                .try_into()
                .context("a goal has three coordinates")?,
            view: View::of(id.task),
            shapes,
            meshes,
            bodies: vec![Vec::new(); carriers.len()],
            rewards: Vec::new(),
            distances: Vec::new(),
            successes: Vec::new(),
        };
        recording.push(&env, &carriers, &start.info);
        let mut policy = policy.policy(id.task, seed);
        let mut observation = start.observation;
        loop {
            let action = policy.act(&observation);
            let step = env.step(&action)?;
            observation = step.observation;
            recording.rewards.push(rounded(step.reward));
            recording.push(&env, &carriers, &step.info);
            each(recording.rewards.len(), &action, &step);
            if step.is_last() {
                break;
            }
        }
        for poses in &mut recording.bodies {
            if poses.chunks_exact(7).all(|pose| pose == &poses[..7]) {
                poses.truncate(7);
            }
        }
        Ok(recording)
    }

    fn push(&mut self, env: &MujocoEnv, carriers: &[BodyId], info: &Info) {
        let data = env.inner().simulator().data();
        for (poses, &body) in self.bodies.iter_mut().zip(carriers) {
            let (position, q) = data.body_pose(body);
            poses.extend(position.iter().chain(&[q.w, q.i, q.j, q.k]).copied().map(rounded));
        }
        self.distances.push(rounded(info.distance));
        self.successes.push(info.is_success);
    }

    /// Environment, policy and seed.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.rewards.len()
    }

    /// What the episode came to, in words.
    pub fn outcome(&self) -> String {
        format!(
            "{} steps, return {:.2}, {:.3} m from the goal at the end{}",
            self.steps(),
            self.rewards.iter().sum::<f64>(),
            self.distances.last().copied().unwrap_or(f64::NAN),
            if self.successes.last() == Some(&true) { ": reached" } else { "" },
        )
    }
}

impl View {
    /// As the reference looks at its scenes; somewhat farther, to see the whole robot, and all of
    /// Slide's long table.
    const fn of(task: Task) -> Self {
        match task {
            Task::Slide => Self { at: [1.1, 0.75, 0.42], distance: 2.9 },
            _ => Self { at: [1.0, 0.75, 0.46], distance: 2.5 },
        }
    }
}

impl DrawnShape {
    fn new(geom: &VisualGeom, body: usize, meshes: &mut Vec<Mesh>) -> anyhow::Result<Self> {
        let mut mesh = None;
        let (shape, size) = match geom.shape {
            Shape::Plane { half_size: [x, y] } => ("plane", [x, y, 0.0]),
            Shape::Sphere { radius } => ("sphere", [radius, 0.0, 0.0]),
            Shape::Capsule { radius, half_length } => ("capsule", [radius, half_length, 0.0]),
            Shape::Ellipsoid { radii } => ("ellipsoid", radii),
            Shape::Cylinder { radius, half_length } => ("cylinder", [radius, half_length, 0.0]),
            Shape::Box { half_size } => ("box", half_size),
            Shape::Mesh { ref triangles } => {
                mesh = Some(meshes.len());
                meshes.push(Mesh::new(triangles));
                ("mesh", [0.0; 3])
            }
            ref other => anyhow::bail!("the playback cannot draw {other:?}"),
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
        let mut mesh = Self::default();
        for corners in triangles {
            mesh.triangles.push(corners.map(|corner| {
                let corner = corner.map(|meters| (meters * 1e4).round() as i32);
                let known = mesh.corners.iter().position(|&other| other == corner);
                known.unwrap_or_else(|| {
                    mesh.corners.push(corner);
                    mesh.corners.len() - 1
                })
            }));
        }
        mesh
    }
}

/// A hundredth of a millimeter is far less than a pixel.
fn rounded(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}
