//! Your own models: the built-in one with additions and changes, and files held in memory.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use fetch_sim::{
    Control, Extension, FetchModel, ModelFiles, ModelSource, MujocoSimulator, ObjectShape,
    SimConfig, SimError, Simulator, Task, VisualGeom, builtin_files,
};
use nalgebra::Vector3;
use testing::Result;

const BLOCK: &str = r#"
    <worldbody>
      <body name="object1" pos="1.2 0.9 0.5">
        <freejoint/><geom name="object1" type="box" size="0.025 0.025 0.025" mass="2"/>
      </body>
    </worldbody>"#;

fn extended(task: Task, extension: Extension) -> SimConfig {
    SimConfig::new(task).with_model(ModelSource::Extended(extension))
}

fn simulator(extension: Extension) -> Result<MujocoSimulator, SimError> {
    MujocoSimulator::new(&extended(Task::Push, extension))
}

/// Returns everything that a simulator shows over an episode.
fn episode(config: &SimConfig) -> Result<Vec<u64>, SimError> {
    let mut simulator = MujocoSimulator::new(config)?;
    simulator.reset(config.task().has_object().then_some([1.30, 0.70]))?;
    let mut numbers = Vec::new();
    for step in 0..30 {
        let phase = f64::from(step);
        let displacement = 0.05 * Vector3::new(phase.sin(), (0.7 * phase).cos(), -phase.sin());
        simulator.step(&Control { displacement, fingers: 0.02 * phase.cos() })?;
        let data = simulator.data();
        numbers.extend(data.qpos().iter().chain(data.qvel()).map(|number| number.to_bits()));
        numbers.extend(simulator.gripper().position.iter().map(|number| number.to_bits()));
    }
    Ok(numbers)
}

#[test]
fn an_empty_extension_and_the_built_in_files_are_the_built_in_model() -> Result {
    for task in Task::ALL {
        let builtin = SimConfig::new(task);
        let expected = episode(&builtin)?;
        let files = ModelSource::Files(builtin_files(task));
        for source in [ModelSource::Extended(Extension::default()), files] {
            let config = builtin.clone().with_model(source);
            assert!(episode(&config)? == expected, "{config:?}");
            assert_eq!(VisualGeom::of(&config)?, VisualGeom::of(&builtin)?, "{config:?}");
        }
    }
    Ok(())
}

#[test]
fn all_sources_in_memory_are_loaded_without_visual_shapes() -> Result {
    let look = r#"<geom size="0.1" contype="0" conaffinity="0"/>"#;
    let extension = Extension::default().with_xml(&format!("<worldbody>{look}</worldbody>"));
    let files = builtin_files(Task::Push);
    let scene = files.get("push.xml").ok_or("a scene")?;
    let scene = scene.replace("</worldbody>", &format!("{look}</worldbody>"));
    let files = ModelSource::Files(files.with_file("push.xml", scene));
    let builtin = SimConfig::new(Task::Push);
    let count = |config: &SimConfig| -> Result<_, SimError> {
        Ok((FetchModel::load(config)?.model().ngeom(), VisualGeom::of(config)?.len()))
    };
    let (simulated, visible) = count(&builtin)?;
    for source in [ModelSource::Extended(extension), files] {
        assert_eq!(count(&builtin.clone().with_model(source))?, (simulated, visible + 1));
    }
    Ok(())
}

#[test]
fn an_added_block_settles_on_the_table() -> Result {
    let mut simulator = simulator(Extension::default().with_xml(BLOCK))?;
    simulator.reset(None)?;
    let [object, block] = ["object0", "object1"].map(|name| simulator.object_state(name));
    let (object, block) = (object?, block?);
    assert!((block.position.z - object.position.z).abs() < 1e-3, "at {} m", block.position.z);
    assert!(block.linear_velocity.norm() < 0.1);
    assert!((block.position.xy() - nalgebra::Vector2::new(1.2, 0.9)).norm() < 1e-3);
    Ok(())
}

#[test]
fn sections_are_added_one_after_another_and_may_repeat() -> Result {
    let material = r#"<asset><material name="green" rgba="0 1 0 1"/></asset>"#;
    let ball = r#"<worldbody><body name="ball" pos="1.3 0.8 0.45"><freejoint/>
        <geom size="0.02" material="green"/></body></worldbody>
        <contact><exclude body1="ball" body2="object1"/></contact>"#;
    let extension = Extension::default().with_xml(material).with_xml(BLOCK).with_xml(ball);
    let simulator = simulator(extension.clone())?;
    simulator.object_state("object1")?;
    let ball = simulator.data().model().body("ball")?;
    let geoms = VisualGeom::of(&extended(Task::Push, extension))?;
    let geom = geoms.iter().find(|geom| geom.body == ball).ok_or("the ball")?;
    assert_eq!(geom.rgba, [0.0, 1.0, 0.0, 1.0]);
    Ok(())
}

/// On MuJoCo 2 the built-in model has room for 288 constraints; each block needs 16 more.
#[test]
fn a_model_with_more_has_room_for_more_contacts() -> Result {
    let block = |i: u32| {
        let (x, y) = (1.12 + 0.08 * f64::from(i % 4), 0.83 + 0.075 * f64::from(i / 4));
        format!(
            r#"<body name="block{i}" pos="{x} {y} 0.43"><freejoint/>
               <geom type="box" size="0.03 0.03 0.03" mass="1"/></body>"#
        )
    };
    let blocks: String = (0..16).map(block).collect();
    let xml = format!("<worldbody>{blocks}</worldbody>");
    let mut simulator = simulator(Extension::default().with_xml(&xml))?;
    simulator.reset(None)?;
    for _ in 0..10 {
        simulator.step(&Control { displacement: Vector3::zeros(), fingers: 0.0 })?;
    }
    assert!(simulator.data().contacts().count() > 50, "{}", simulator.data().contacts().count());
    Ok(())
}

/// The gripper's weld has no offset; another keeps the one in which its bodies are defined.
#[test]
fn other_welds_keep_their_offset() -> Result {
    let xml = r#"
        <worldbody>
          <body name="left" pos="1.2 0.9 0.43"><freejoint/><geom size="0.02"/></body>
          <body name="right" pos="1.3 0.9 0.43"><freejoint/><geom size="0.02"/></body>
        </worldbody>
        <equality><weld body1="left" body2="right"/></equality>"#;
    let simulator = simulator(Extension::default().with_xml(xml))?;
    let (left, right) = (simulator.object_state("left")?, simulator.object_state("right")?);
    let distance = (right.position - left.position).norm();
    assert!((distance - 0.1).abs() < 1e-3, "{distance} m apart");
    Ok(())
}

#[test]
fn the_object_stands_on_the_table_whatever_its_form() -> Result {
    let shapes = [
        (ObjectShape::Box { half_size: [0.02, 0.03, 0.06] }, 0.06),
        (ObjectShape::Box { half_size: [0.01, 0.01, 0.01] }, 0.01),
        (ObjectShape::Sphere { radius: 0.04 }, 0.04),
        (ObjectShape::Cylinder { radius: 0.03, half_length: 0.05 }, 0.05),
    ];
    for task in [Task::Push, Task::PickAndPlace, Task::Slide] {
        for (shape, half_height) in shapes {
            let config = extended(task, Extension::default().with_object_shape(shape));
            let mut simulator = MujocoSimulator::new(&config)?;
            simulator.reset(None)?;
            let object = simulator.object().ok_or("an object")?;
            let height = object.position.z - 0.4;
            assert!((height - half_height).abs() < 3e-3, "{task}, {shape:?}: at {height} m");
            let settled = simulator.settled().object_height.ok_or("a height")?;
            assert!((settled - object.position.z).abs() < 1e-3, "{task}, {shape:?}: {settled} m");
            assert!(object.linear_velocity.norm() < 0.1, "{task}, {shape:?}: {object:?}");
            let [x, y, _] = task.spec().object.ok_or("an object")?.dropped_at;
            let moved = object.position.xy() - nalgebra::Vector2::new(x, y);
            assert!(moved.norm() < 5e-3, "{task}, {shape:?}: moved by {moved:?}");
        }
    }
    Ok(())
}

/// Gives the object a speed along x, in meters per second, and returns the simulator a second
/// later.
fn after_a_push(extension: Extension, speed: f64) -> Result<MujocoSimulator, SimError> {
    let mut simulator = simulator(extension)?;
    simulator.reset(Some([1.10, 0.9]))?;
    let model = simulator.data().model();
    let dof = model.dof_address(model.joint("object0:joint")?)?;
    simulator.data_mut().qvel_mut()[dof] = speed;
    for _ in 0..25 {
        simulator.step(&Control { displacement: Vector3::zeros(), fingers: 0.0 })?;
    }
    Ok(simulator)
}

#[test]
fn the_object_slides_farther_the_less_its_friction() -> Result {
    let slid = |friction: f64| -> Result<f64> {
        let extension = Extension::default().with_object_friction(friction);
        let object = after_a_push(extension, 0.6)?.object().ok_or("an object")?;
        Ok(object.position.x - 1.10)
    };
    // It stops after v^2 / (2 mu g).
    let law = |friction: f64| 0.6 * 0.6 / (2.0 * friction * 9.81);
    for friction in [0.1, 0.2, 0.4] {
        let (slid, expected) = (slid(friction)?, law(friction));
        assert!((slid / expected - 1.0).abs() < 0.25, "{friction}: {slid} m, not {expected} m");
    }
    let unchanged = after_a_push(Extension::default(), 0.6)?.object();
    let same = after_a_push(Extension::default().with_object_friction(1.0), 0.6)?.object();
    assert_eq!(same, unchanged, "1 is the built-in coefficient");
    Ok(())
}

#[test]
fn a_heavy_object_moves_a_block_farther_than_a_light_one() -> Result {
    let block = BLOCK.replace("1.2 0.9 0.5", "1.2 0.9 0.43");
    let pushed = |mass: f64| -> Result<f64> {
        let extension = Extension::default().with_xml(&block).with_object_mass(mass);
        let pushed = after_a_push(extension.with_object_friction(0.1), 1.0)?;
        Ok(pushed.object_state("object1")?.position.x - 1.2)
    };
    let [light, heavy] = [pushed(0.2)?, pushed(20.0)?];
    assert!(light > 0.0 && heavy > 4.0 * light, "{light} m, {heavy} m");
    Ok(())
}

#[test]
fn what_cannot_be_changed_is_a_typed_error() -> Result {
    let ball = |radius| Extension::default().with_object_shape(ObjectShape::Sphere { radius });
    let sizes = [0.0, -1.0, f64::NAN, 11.0].map(ball);
    let masses = [0.0, f64::INFINITY].map(|mass| Extension::default().with_object_mass(mass));
    let frictions = [-0.1, f64::NAN].map(|mu| Extension::default().with_object_friction(mu));
    for extension in sizes.into_iter().chain(masses).chain(frictions) {
        assert_eq!(extension, extension.clone());
        let error = simulator(extension.clone()).unwrap_err();
        assert!(matches!(error, SimError::OutOfRange { .. }), "{extension:?}: {error}");
    }
    let reach = extended(Task::Reach, ball(0.02));
    let error = FetchModel::load(&reach).unwrap_err();
    assert_eq!(error, SimError::NoObject { task: Task::Reach });
    for xml in ["<worldbody>", "<nothing/>", "</mujoco>", "<worldbody><body/><x/>", "<"] {
        let error = simulator(Extension::default().with_xml(xml)).unwrap_err();
        assert!(matches!(error, SimError::Model { .. }), "{xml}: {error}");
    }
    let nothing = ModelSource::Files(ModelFiles::new("push.xml", "<mujoco><option/></mujoco>"));
    let error = FetchModel::load(&SimConfig::new(Task::Push).with_model(nothing)).unwrap_err();
    assert!(matches!(error, SimError::MissingName { .. }), "{error}");
    let broken = ModelSource::Files(ModelFiles::new("mine.xml", "<mujoco"));
    let error = FetchModel::load(&SimConfig::new(Task::Push).with_model(broken)).unwrap_err();
    assert!(error.to_string().contains("mine.xml"), "{error}");
    Ok(())
}

#[test]
fn sources_are_compared_by_what_they_hold() -> Result {
    let files = builtin_files(Task::Push);
    let edited = files.clone().with_file("object.xml", "<mujocoinclude/>");
    assert_eq!(edited.get("object.xml"), Some("<mujocoinclude/>"));
    assert_eq!(edited.iter().count(), files.iter().count());
    let extension = Extension::default().with_xml(BLOCK).with_object_mass(0.3);
    let sources = [
        ModelSource::Files(files),
        ModelSource::Files(edited),
        ModelSource::Extended(extension.clone()),
        ModelSource::Extended(extension.clone().with_object_mass(0.4)),
        ModelSource::Extended(extension.with_xml(BLOCK)),
        ModelSource::Builtin,
    ];
    for (i, a) in sources.iter().enumerate() {
        for (j, b) in sources.iter().enumerate() {
            assert_eq!(a == b, i == j, "{a:?} and {b:?}");
        }
        let config = SimConfig::new(Task::Push).with_model(a.clone());
        let json = serde_json::to_string(&config)?;
        assert_eq!(serde_json::from_str::<SimConfig>(&json)?, config);
    }
    Ok(())
}
