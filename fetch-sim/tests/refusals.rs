//! Foreign ids, wrong lengths and invalid numbers are typed errors that change nothing.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::sync::Arc;

use fetch_sim::{Data, Model, SimError};
use nalgebra::{Quaternion, Vector3};
use testing::Result;

/// A model with one more object of each kind than `SMALL`.
const LARGE: &str = r#"
<mujoco>
  <worldbody>
    <body name="a" mocap="true"><geom name="a" size="1"/><site name="a"/></body>
    <body name="b" pos="5 0 0"><joint name="a"/><geom size="1"/><site/>
      <body name="c" pos="1 0 0">
        <joint name="b" axis="1 0 0"/><geom name="b" size="1"/><site name="b"/>
      </body>
    </body>
  </worldbody>
</mujoco>"#;

const SMALL: &str = r#"
<mujoco>
  <worldbody><body><freejoint/><geom size="1"/><site/></body></worldbody>
</mujoco>"#;

fn model(xml: &str) -> Result<Arc<Model>, SimError> {
    Ok(Arc::new(Model::from_files(&[("model.xml", xml)])?))
}

#[test]
fn ids_of_a_larger_model_are_errors() -> Result {
    let (large, small) = (model(LARGE)?, model(SMALL)?);
    let (body, joint) = (large.body("c")?, large.joint("b")?);
    let (geom, site) = (large.geom("b")?, large.site("b")?);
    let mut data = Data::new(Arc::clone(&small))?;
    let (mut translation, mut rotation) = ([0.0; 18], [0.0; 18]);
    let at = (Vector3::zeros(), Quaternion::identity());
    let jacobian = data.site_jacobian(site, &mut translation, &mut rotation);
    let refused = [
        ("body", 2, small.body_name(body).err()),
        ("body", 2, small.mocap_index(body).err()),
        ("body", 2, small.is_within(body, body).err()),
        ("body", 2, data.body_pose(body).err()),
        ("joint", 1, small.joint_name(joint).err()),
        ("joint", 1, small.qpos_address(joint).err()),
        ("joint", 1, small.dof_address(joint).err()),
        ("joint", 1, small.coordinate_count(joint).err()),
        ("geom", 1, small.geom_name(geom).err()),
        ("geom", 1, small.geom_body(geom).err()),
        ("site", 1, small.site_name(site).err()),
        ("site", 1, data.site_position(site).err()),
        ("site", 1, data.site_rotation(site).err()),
        ("site", 1, jacobian.err()),
        ("mocap body", 0, data.mocap_pose(0).err()),
        ("mocap body", 0, data.mocap_pose(usize::MAX).err()),
        ("mocap body", 0, data.set_mocap_pose(5, at.0, at.1).err()),
    ];
    for (expected, objects, error) in refused {
        let Some(SimError::UnknownId { kind, count, .. }) = error else { panic!("{error:?}") };
        assert_eq!((kind, count), (expected, objects));
    }
    Ok(())
}

#[test]
fn ids_of_the_model_find_its_objects() -> Result {
    let model = model(LARGE)?;
    let (world, a, b, c) = (model.geom("a")?, model.body("a")?, model.body("b")?, model.body("c")?);
    assert_eq!(model.geom_body(world)?, a);
    assert_eq!((model.mocap_index(a)?, model.mocap_index(b)?), (Some(0), None));
    assert_eq!((model.is_within(c, b)?, model.is_within(b, c)?), (true, false));
    assert_eq!((model.is_within(c, c)?, model.is_within(c, a)?), (true, false));
    assert_eq!(model.coordinate_count(model.joint("b")?)?, 1);
    assert_eq!(model.qpos_address(model.joint("b")?)?, 1);
    let mut data = Data::new(Arc::clone(&model))?;
    let at = (Vector3::new(1.0, 2.0, 3.0), Quaternion::new(0.0, 1.0, 0.0, 0.0));
    data.set_mocap_pose(0, at.0, at.1)?;
    assert_eq!(data.mocap_pose(0)?, at);
    data.forward()?;
    assert_eq!(data.body_pose(a)?, at);
    assert_eq!(data.site_position(model.site("b")?)?, Vector3::new(6.0, 0.0, 0.0));
    Ok(())
}

#[test]
fn slices_of_another_length_are_errors() -> Result {
    let model = model(LARGE)?;
    let (data, site) = (Data::new(Arc::clone(&model))?, model.site("b")?);
    let (mut right, mut wrong) = (vec![0.0; 3 * model.nv()], vec![0.0; 3]);
    let expected = SimError::WrongLength { what: "a Jacobian", expected: 6, actual: 3 };
    assert_eq!(data.site_jacobian(site, &mut right, &mut wrong), Err(expected.clone()));
    assert_eq!(data.site_jacobian(site, &mut wrong, &mut right), Err(expected));
    assert_eq!(data.site_jacobian(site, &mut right, &mut [0.0; 6]), Ok(()));
    Ok(())
}

#[test]
fn numbers_that_are_not_finite_or_huge_are_errors() -> Result {
    let mut data = Data::new(model(LARGE)?)?;
    let (before, time) = (data.mocap_pose(0)?, data.time());
    for bad in [f64::NAN, f64::INFINITY, -1.1e10] {
        let (good, turned) = (Vector3::new(1.0, 1.0, 1.0), Quaternion::new(1.0, 0.0, 0.0, bad));
        for refused in [
            data.set_time(bad),
            data.set_mocap_pose(0, Vector3::new(1.0, bad, 1.0), Quaternion::identity()),
            data.set_mocap_pose(0, good, turned),
        ] {
            assert!(matches!(refused, Err(SimError::OutOfRange { .. })), "{refused:?}");
        }
    }
    assert_eq!((data.mocap_pose(0)?, data.time()), (before, time));
    Ok(())
}

#[test]
fn a_control_that_is_not_finite_is_an_error_of_the_step() -> Result {
    let xml = LARGE.replace("</mujoco>", r#"<actuator><motor joint="a"/></actuator></mujoco>"#);
    for bad in [f64::NAN, f64::INFINITY] {
        let mut data = Data::new(model(&xml)?)?;
        data.ctrl_mut()[0] = bad;
        assert!(matches!(data.step(1), Err(SimError::Unstable { .. })), "{bad}");
    }
    Ok(())
}
