//! What the built-in model shows.
#![cfg(feature = "mujoco")]

use fetch_sim::{MujocoSimulator, Shape, SimConfig, Task, VisualGeom};

#[test]
fn every_scene_shows_table_robot_and_object_where_they_are_simulated() {
    for task in Task::ALL {
        let geoms = VisualGeom::of_builtin(task).expect("MuJoCo");
        let simulator = MujocoSimulator::new(&SimConfig::new(task)).expect("MuJoCo");
        let model = simulator.data().model();
        let on = |name: &str| -> Vec<&VisualGeom> {
            let body = model.body(name).expect(name);
            geoms.iter().filter(|geom| geom.body == body).collect()
        };
        for link in ["base_link", "torso_lift_link", "head_pan_link", "gripper_link"] {
            assert!(on(&format!("robot0:{link}")).len() >= 2, "{task}: {link}");
        }
        let [table] = on("table0")[..] else { panic!("{task}: one table") };
        assert!(matches!(table.shape, Shape::Box { half_size } if half_size[2] == 0.2));
        assert_eq!(table.rgba, [0.93, 0.93, 0.93, 1.0], "{task}: the material's colour");
        assert_eq!(on("robot0:laser_link")[0].rgba, [0.7922, 0.8196, 0.9333, 1.0], "{task}");
        assert_eq!(on("robot0:mocap").len(), 0, "{task}: the mocap body is hidden");
        assert_eq!(geoms.iter().filter(|g| matches!(g.shape, Shape::Plane { .. })).count(), 1);
        if task.has_object() {
            let [object] = on("object0")[..] else { panic!("{task}: one object") };
            assert_eq!(matches!(object.shape, Shape::Cylinder { .. }), task == Task::Slide);
            let height = simulator.data().body_pose(object.body).0.z;
            assert!((0.41..0.43).contains(&height), "{task}: on the table, at {height} m");
        }
    }
}
