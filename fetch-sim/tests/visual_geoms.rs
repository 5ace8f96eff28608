//! The visible geoms of the built-in model.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::collections::HashSet;

use fetch_sim::{MujocoSimulator, Shape, SimConfig, Task, VisualGeom};
use nalgebra::{UnitQuaternion, Vector3};
use testing::Result;

#[test]
fn every_scene_shows_table_robot_and_object_where_they_are_simulated() -> Result {
    for task in Task::ALL {
        let geoms = VisualGeom::of(&SimConfig::new(task))?;
        let simulator = MujocoSimulator::new(&SimConfig::new(task))?;
        let model = simulator.data().model();
        let on = |name: &str| -> Result<Vec<&VisualGeom>> {
            let body = model.body(name)?;
            Ok(geoms.iter().filter(|geom| geom.body == body).collect())
        };
        for link in ["base_link", "torso_lift_link", "head_pan_link"] {
            assert!(on(&format!("robot0:{link}"))?.len() >= 2, "{task}: {link}");
        }
        let [table] = on("table0")?[..] else { panic!("{task}: one table") };
        assert!(matches!(table.shape, Shape::Box { half_size } if half_size[2] == 0.2));
        assert_eq!(table.rgba, [0.93, 0.93, 0.93, 1.0], "{task}: the material's color");
        assert_eq!(on("robot0:laser_link")?[0].rgba, [0.7922, 0.8196, 0.9333, 1.0], "{task}");
        assert_eq!(on("robot0:mocap")?.len(), 0, "{task}: the mocap body is hidden");
        assert_eq!(geoms.iter().filter(|g| matches!(g.shape, Shape::Plane { .. })).count(), 1);
        if task.has_object() {
            let [object] = on("object0")?[..] else { panic!("{task}: one object") };
            assert_eq!(matches!(object.shape, Shape::Cylinder { .. }), task == Task::Slide);
            let height = simulator.data().body_pose(object.body)?.0.z;
            assert!((0.41..0.43).contains(&height), "{task}: on the table, at {height} m");
        }
    }
    Ok(())
}

const WHITE: [f32; 4] = [1.0; 4];
const BLUE: [f32; 4] = [0.086, 0.506, 0.767, 1.0];

#[test]
fn every_mesh_is_a_closed_surface_that_faces_outwards() -> Result {
    let geoms = VisualGeom::of(&SimConfig::new(Task::Push))?;
    let meshes: Vec<_> = geoms.iter().filter_map(|geom| triangles_of(geom)).collect();
    assert_eq!(meshes.len(), 9, "as many as `model/hulls.xml` has");
    for triangles in meshes {
        let mut edges = HashSet::new();
        for triangle in triangles {
            let bits = triangle.map(|corner| corner.map(f64::to_bits));
            for edge in [[0, 1], [1, 2], [2, 0]] {
                assert!(
                    edges.insert(edge.map(|corner| bits[corner])),
                    "{triangle:?}: an edge twice"
                );
            }
            let [a, b, c] = triangle.map(Vector3::from);
            assert!((b - a).cross(&(c - a)).dot(&a) > 0.0, "{triangle:?} faces inwards");
        }
        assert!(edges.iter().all(|&[a, b]| edges.contains(&[b, a])), "{triangles:?}: a hole");
    }
    Ok(())
}

#[test]
fn forearm_wrist_and_palm_are_where_the_links_are() -> Result {
    let geoms = VisualGeom::of(&SimConfig::new(Task::Push))?;
    let simulator = MujocoSimulator::new(&SimConfig::new(Task::Push))?;
    // Links, their colors, and the bounding box of the corners in `model/hulls.xml` (meters, in the
    // link's frame).
    let hulls = [
        ("robot0:gripper_link", WHITE, [[-0.154, -0.0629, -0.0401], [-0.0324, 0.0629, 0.0394]]),
        ("robot0:wrist_flex_link", BLUE, [[-0.052, -0.0542, -0.0519], [0.1174, 0.0672, 0.0523]]),
        ("robot0:forearm_roll_link", WHITE, [[-0.032, -0.0873, -0.0523], [0.1764, 0.0515, 0.0525]]),
    ];
    for (link, rgba, [lowest, highest]) in hulls {
        let body = simulator.data().model().body(link)?;
        let (geom, triangles) = geoms
            .iter()
            .filter(|geom| geom.body == body)
            .find_map(|geom| Some((geom, triangles_of(geom)?)))
            .ok_or(link)?;
        assert_eq!(geom.rgba, rgba, "{link}");
        assert_eq!(triangles.len(), 92, "{link}: as many as 48 corners make");

        let rotation = UnitQuaternion::from_quaternion(geom.orientation);
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat);
        for corner in triangles.as_flattened() {
            let corner = geom.position + rotation * Vector3::from(*corner);
            low = low.inf(&corner);
            high = high.sup(&corner);
        }
        let off = (low - Vector3::from(lowest)).amax().max((high - Vector3::from(highest)).amax());
        assert!(off < 1e-6, "{link}: from {low:?} to {high:?}");
    }
    Ok(())
}

fn triangles_of(geom: &VisualGeom) -> Option<&[[[f64; 3]; 3]]> {
    match &geom.shape {
        Shape::Mesh { triangles } => Some(triangles),
        _ => None,
    }
}
