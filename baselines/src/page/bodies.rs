//! The bodies of a simulation, which the page draws in 3-D.

use fetch_sim::{BodyId, MujocoSimulator, PhysicsFactor, Shape, Simulator, Task, VisualGeom};
use serde::Serialize;

use super::{error::PageError, rounding::rounded};

/// Half of the extent of a plane that is infinite (meters).
const HORIZON: f64 = 10.0;

/// The poses of a simulation's bodies, and the shapes that they carry.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Bodies {
    /// Duration of a step, in seconds.
    period: f64,
    goals: Vec<[f64; 3]>,
    view: View,
    shapes: Vec<DrawnShape>,
    meshes: Vec<Mesh>,
    #[serde(skip)]
    carriers: Vec<BodyId>,
    /// For each body that carries a shape, its position and quaternion in every frame, one after
    /// the other; only the first frame's for a body at rest.
    bodies: Vec<Vec<f64>>,
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

impl Bodies {
    /// Returns bodies without poses yet.
    pub(super) fn new(
        simulator: &MujocoSimulator,
        goals: Vec<[f64; 3]>,
    ) -> Result<Self, PageError> {
        let model = simulator.fetch_model();
        let config = model.config();
        let object_size = simulator.physics().get(PhysicsFactor::ObjectSize);
        let object = object_size.zip(model.model().body("object0").ok());
        let (mut carriers, mut meshes) = (Vec::new(), Vec::new());
        let shapes = VisualGeom::of(config)?
            .iter()
            .map(|geom| {
                let body = index_of(&mut carriers, geom.body);
                let mut shape = DrawnShape::new(geom, body, &mut meshes)?;
                if let Some((scale, _)) = object.filter(|&(_, object)| object == geom.body) {
                    shape.size = shape.size.map(|size| size * scale);
                }
                Ok(shape)
            })
            .collect::<Result<_, PageError>>()?;
        Ok(Self {
            period: simulator.control_period(),
            goals,
            view: View::of(config.task()),
            shapes,
            meshes,
            bodies: vec![Vec::new(); carriers.len()],
            carriers,
        })
    }

    /// Returns the number of points that are drawn as the goal.
    pub(super) const fn num_goals(&self) -> usize {
        self.goals.len()
    }

    /// Adds a frame.
    pub(super) fn push(&mut self, simulator: &MujocoSimulator) -> Result<(), PageError> {
        for (poses, &body) in self.bodies.iter_mut().zip(&self.carriers) {
            let (position, q) = simulator.data().body_pose(body)?;
            poses.extend(position.iter().chain(&[q.w, q.i, q.j, q.k]).copied().map(rounded));
        }
        Ok(())
    }

    /// Keeps a single pose of each body at rest.
    pub(super) fn finish(&mut self) {
        for poses in &mut self.bodies {
            if poses.chunks_exact(7).all(|pose| pose == &poses[..7]) {
                poses.truncate(7);
            }
        }
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
            Shape::Plane { half_size } => {
                let [x, y] = half_size.map(|half| if half > 0.0 { half } else { HORIZON });
                ("plane", [x, y, 0.0])
            }
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
