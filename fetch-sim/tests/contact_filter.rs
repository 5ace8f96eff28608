//! The contact filter skips only tests that find no contact.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::{fmt::Write, sync::Arc};

use fetch_sim::{
    ContactFilterCounts, Control, Data, Model, MujocoSimulator, SimConfig, Simulator, Task,
};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use testing::Result;

const SHAPES: [&str; 6] = [
    r#"type="sphere" size="0.1""#,
    r#"type="capsule" size="0.05 0.2""#,
    r#"type="ellipsoid" size="0.05 0.1 0.2""#,
    r#"type="cylinder" size="0.1 0.15""#,
    r#"type="box" size="0.05 0.1 0.2""#,
    r#"type="mesh" mesh="lump""#,
];

/// Returns a plane and two free bodies of each shape, all with a margin.
fn zoo() -> Arc<Model> {
    // The vertices of an irregular, round lump: enough for MuJoCo to search its hull along the
    // edges.
    let vertices = (0..90).fold(String::new(), |mut text, i| {
        let (turn, height) = (2.4 * f64::from(i), f64::from(i) / 44.5 - 1.0);
        let radius = 0.15 * (1.0 - height * height).sqrt();
        let _ = write!(text, "{} {} {} ", radius * turn.cos(), radius * turn.sin(), 0.1 * height);
        text
    });
    let bodies = (SHAPES.iter().chain(&SHAPES)).fold(String::new(), |mut text, shape| {
        let _ = write!(text, r#"<body><freejoint/><geom {shape} margin="0.003"/></body>"#);
        text
    });
    let xml = format!(
        r#"<mujoco>
          <option gravity="0 0 0"/>
          <size njmax="2000" nconmax="500"/>
          <asset><mesh name="lump" vertex="{vertices}"/></asset>
          <worldbody><geom type="plane" size="1 1 1"/>{bodies}</worldbody>
        </mujoco>"#
    );
    Arc::new(Model::from_files(&[("zoo.xml", &xml)]).expect("a sound model"))
}

/// A pose for each body: position and, as a rotation vector, orientation.
type Scene = Vec<([f64; 3], [f64; 3])>;

fn scene() -> impl Strategy<Value = Scene> {
    let near = prop::array::uniform3(-0.5..0.5);
    let turned = prop::array::uniform3(-3.0..3.0);
    prop::collection::vec((near, turned), 2 * SHAPES.len())
}

fn place(data: &mut Data, scene: &Scene) {
    for (qpos, (position, turn)) in data.qpos_mut().chunks_exact_mut(7).zip(scene) {
        qpos[..3].copy_from_slice(position);
        let q = UnitQuaternion::from_scaled_axis(Vector3::from(*turn));
        qpos[3..].copy_from_slice(&[q.w, q.i, q.j, q.k]);
    }
}

/// Returns everything that follows from the poses of the bodies.
fn outcome(data: &Data) -> (Vec<f64>, Vec<f64>, usize) {
    let contacts = data.contacts().count();
    (data.qpos().to_vec(), data.qvel().to_vec(), contacts)
}

fn counts(data: &Data) -> ContactFilterCounts {
    data.contact_filter().expect("a filter").counts()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// In scenes that jump and drift, MuJoCo's own routine, with a margin as wide as the assumed
    /// gap, confirms every rejection, and no bit of the result differs.
    #[test]
    fn no_rejection_is_refuted(scenes in prop::collection::vec(scene(), 4)) {
        let model = zoo();
        let mut plain = Data::new(Arc::clone(&model))?;
        let mut filtered = Data::new(model)?;
        filtered.set_contact_filter(true)?;
        assert!(filtered.contact_filter().is_some());
        filtered.check_rejections(true);
        for scene in &scenes {
            for data in [&mut plain, &mut filtered] {
                data.reset()?;
                place(data, scene);
            }
            for _ in 0..10 {
                // Deep overlaps fling bodies apart, up to an error: in both simulations, or in
                // neither.
                prop_assert_eq!(plain.step(1), filtered.step(1));
                prop_assert_eq!(outcome(&plain), outcome(&filtered));
                let same = plain.contacts().eq(filtered.contacts());
                prop_assert!(same, "the same contacts in the same order");
            }
        }
        let counts = counts(&filtered);
        prop_assert!(counts.rejected > 0 && counts.checked > 0, "{:?}", counts);
        prop_assert_eq!(counts.refuted, 0, "{:?}", counts);
    }
}

/// MuJoCo leaves quaternions as they are whose length is 1 up to rounding. Under an upright
/// cylinder of such a quaternion it normalizes a vector of rounding errors, and finds the rim as
/// low as the radius below the lower disk.
#[test]
fn contacts_below_an_upright_cylinder_are_found_as_without_a_filter() -> Result {
    const CYLINDER: &str = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
        <body><freejoint/><geom type="cylinder" size="0.1 0.15"/></body>
    </worldbody></mujoco>"#;
    let model = Arc::new(Model::from_files(&[("cylinder.xml", CYLINDER)])?);
    let mut plain = Data::new(Arc::clone(&model))?;
    let mut filtered = Data::new(model)?;
    filtered.set_contact_filter(true)?;
    for ulps in -10..=10 {
        let length = 1.0 + 1e-16 * f64::from(ulps);
        for data in [&mut plain, &mut filtered] {
            data.reset()?;
            data.qpos_mut().copy_from_slice(&[0.0, 0.0, 0.17, length, 0.0, 0.0, 0.0]);
            data.step(1)?;
        }
        assert_eq!(outcome(&filtered), outcome(&plain), "a quaternion of length {length}");
    }
    Ok(())
}

/// Some versions of MuJoCo find contacts of meshes that overlap less than a negative margin asks
/// for.
#[test]
fn contacts_of_negative_margins_are_found_as_without_a_filter() -> Result {
    const MESHES: &str = r#"<mujoco>
        <asset><mesh name="m" vertex="0 0 0.1  0.3 0 0.3  -0.2 0.3 -0.1  0 -0.3 -0.1"/></asset>
        <worldbody>
            <body><geom type="mesh" mesh="m" margin="-1"/></body>
            <body pos="0 0 0.02"><joint type="hinge"/><geom type="mesh" mesh="m"/></body>
        </worldbody>
    </mujoco>"#;
    let model = Arc::new(Model::from_files(&[("meshes.xml", MESHES)])?);
    let mut plain = Data::new(Arc::clone(&model))?;
    let mut filtered = Data::new(model)?;
    filtered.set_contact_filter(true)?;
    for _ in 0..3 {
        plain.step(1)?;
        filtered.step(1)?;
        assert_eq!(outcome(&filtered), outcome(&plain));
    }
    Ok(())
}

#[test]
fn a_filter_changes_no_bit_of_the_built_in_model() -> Result {
    for task in Task::ALL {
        let mut filtered = MujocoSimulator::new(&SimConfig::new(task))?;
        assert!(filtered.data().contact_filter().is_some());
        filtered.data_mut().check_rejections(true);
        let off = SimConfig::new(task).with_contact_filter(false);
        let mut plain = MujocoSimulator::new(&off)?;
        assert!(plain.data().contact_filter().is_none());
        for episode in 0..3 {
            let object = task.has_object().then_some([1.30, 0.70]);
            for simulator in [&mut filtered, &mut plain] {
                simulator.reset(object)?;
            }
            for step in 0..25 {
                let phase = f64::from(50 * episode + step);
                let (x, y) = (phase.sin(), (0.7 * phase).cos());
                let control =
                    Control { displacement: 0.05 * Vector3::new(x, y, -0.5), fingers: x - y };
                filtered.step(&control)?;
                plain.step(&control)?;
                assert_eq!(filtered.data().qpos(), plain.data().qpos(), "{task} {episode} {step}");
                assert_eq!(filtered.data().qvel(), plain.data().qvel(), "{task} {episode} {step}");
                assert!(filtered.data().contacts().eq(plain.data().contacts()));
            }
        }
        let counts = counts(filtered.data());
        assert!(counts.rejected > counts.pairs / 4, "{task}: {counts:?}");
        assert_eq!(counts.refuted, 0, "{task}: {counts:?}");
    }
    Ok(())
}

#[test]
fn snapshots_do_not_depend_on_the_filter() -> Result {
    let mut filtered = MujocoSimulator::new(&SimConfig::new(Task::Reach))?;
    let off = SimConfig::new(Task::Reach).with_contact_filter(false);
    let mut plain = MujocoSimulator::new(&off)?;
    let control = Control { displacement: Vector3::new(0.03, -0.02, -0.05), fingers: 0.0 };
    filtered.step(&control)?;
    plain.restore(&filtered.snapshot())?;
    filtered.step(&control)?;
    plain.step(&control)?;
    assert_eq!(filtered.data().qpos(), plain.data().qpos());
    assert_eq!(filtered.data().qvel(), plain.data().qvel());
    Ok(())
}
