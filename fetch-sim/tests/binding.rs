//! The safe binding: MuJoCo's errors are returned as typed errors.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::{
    path::Path,
    sync::{Arc, Mutex},
    thread,
};

use fetch_sim::{Data, Model, MujocoVersion, SimError};
use testing::Result;

/// A box that falls onto a floor.
const FALLING_BOX: &str = r#"
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="box" pos="0 0 0.2">
      <freejoint name="free"/>
      <geom name="box" type="box" size="0.05 0.05 0.05"/>
      <site name="top" pos="0 0 0.05"/>
    </body>
  </worldbody>
</mujoco>"#;

fn falling_box() -> Result<Arc<Model>, SimError> {
    Ok(Arc::new(Model::from_files(&[("box.xml", FALLING_BOX)])?))
}

fn with_size(size: &str) -> Result<Data, SimError> {
    let xml = FALLING_BOX.replace("<worldbody>", &format!("<size {size}/><worldbody>"));
    Data::new(Arc::new(Model::from_files(&[("box.xml", &xml)])?))
}

/// Returns data with the least memory with which the model compiles: enough until there are
/// contacts.
fn with_least_memory() -> Option<Data> {
    let attribute = if old_sizes() { "nstack" } else { "memory" };
    (1..1000).find_map(|size| with_size(&format!(r#"{attribute}="{}""#, 64 * size)).ok())
}

/// Returns whether every buffer has its own size, as until 2.2; since 2.3 they share one memory.
fn old_sizes() -> bool {
    MujocoVersion::of_headers().is_some_and(|version| version.to_string().starts_with("2.2."))
}

/// Steps until something goes wrong.
fn first_error(data: &mut Data) -> Option<SimError> {
    (0..500).find_map(|_| data.step(1).err())
}

#[test]
fn the_library_has_the_version_of_the_headers() -> Result {
    assert_eq!(Some(MujocoVersion::of_library()?), MujocoVersion::of_headers());
    Ok(())
}

#[test]
fn a_box_falls_onto_the_floor_and_stays() -> Result {
    let model = falling_box()?;
    let mut data = Data::new(Arc::clone(&model))?;
    data.step(1000)?;
    assert!((data.qpos()[2] - 0.05).abs() < 1e-3, "rests at {}", data.qpos()[2]);
    assert!((data.site_position(model.site("top")?)?.z - 0.1).abs() < 1e-3);
    let (floor, body) = (model.geom("floor")?, model.geom("box")?);
    assert!(data.contacts().count() >= 3);
    assert!(data.contacts().all(|pair| pair == (floor, body)));
    assert!((data.time() - 1000.0 * model.timestep()).abs() < 1e-9);
    Ok(())
}

#[test]
fn damaged_and_missing_models_are_errors() {
    let damaged = Model::from_files(&[("damaged.xml", "<mujoco><worldbody></mujoco>")]);
    let Err(SimError::Model { name, reason }) = damaged else { panic!("{damaged:?}") };
    assert_eq!(name, "damaged.xml");
    assert!(!reason.is_empty());
    let unknown = Model::from_files(&[("unknown.xml", "<mujoco><nothing/></mujoco>")]);
    assert!(matches!(unknown, Err(SimError::Model { .. })));
    let included = Model::from_files(&[("a.xml", r#"<mujoco><include file="b.xml"/></mujoco>"#)]);
    assert!(matches!(included, Err(SimError::Model { .. })));
    let missing = Model::from_path(Path::new("/no/such/model.xml"));
    assert!(matches!(missing, Err(SimError::Model { .. })));
    assert!(matches!(Model::from_files(&[]), Err(SimError::Model { .. })));
}

#[test]
fn included_files_come_from_memory() -> Result {
    let body = FALLING_BOX.replace("box.xml", "body.xml");
    let model = Model::from_files(&[
        ("main.xml", r#"<mujoco><include file="body.xml"/></mujoco>"#),
        ("body.xml", &body),
    ]);
    assert_eq!(model?.nq(), 7);
    Ok(())
}

#[test]
fn unknown_names_are_errors() -> Result {
    let error = falling_box()?.site("bottom").unwrap_err();
    assert_eq!(error, SimError::MissingName { kind: "site", name: "bottom".into() });
    assert!(falling_box()?.site("with\0nul").is_err());
    Ok(())
}

#[test]
fn a_diverged_simulation_is_an_error_until_reset() -> Result {
    let mut data = Data::new(falling_box()?)?;
    data.qvel_mut()[0] = 1e12;
    assert!(matches!(data.step(1), Err(SimError::Unstable { .. })));
    data.reset()?;
    data.step(10)?;
    data.qpos_mut()[2] = f64::NAN;
    assert!(matches!(data.step(1), Err(SimError::Unstable { .. })));
    Ok(())
}

#[test]
fn an_error_inside_mujoco_is_returned_and_can_be_recovered_from() -> Result {
    let mut data = with_least_memory().ok_or("no size is enough")?;
    let error = first_error(&mut data).ok_or("contacts need more memory")?;
    let expected = match &error {
        SimError::Mujoco { message } => message.to_lowercase().contains("stack"),
        SimError::BufferFull { .. } => !old_sizes(),
        _ => false,
    };
    assert!(expected, "{error}");
    data.reset()?;
    assert_eq!(data.time(), 0.0);
    Data::new(falling_box()?)?.step(10)?;
    Ok(())
}

#[test]
fn full_buffers_are_errors() -> Result {
    if !old_sizes() {
        return Ok(()); // one shared memory: see the test above
    }
    for size in [r#"nconmax="2" njmax="100""#, r#"nconmax="100" njmax="5""#] {
        let error = first_error(&mut with_size(size)?).ok_or("too small")?;
        assert!(matches!(error, SimError::BufferFull { .. }), "{error}");
    }
    Ok(())
}

/// A subscriber that keeps MuJoCo's warnings.
#[derive(Default)]
struct Log(Mutex<Vec<String>>);

impl tracing::Subscriber for &'static Log {
    fn enabled(&self, metadata: &tracing::Metadata<'_>) -> bool {
        metadata.target() == "mujoco"
    }

    fn event(&self, event: &tracing::Event<'_>) {
        struct Text<'a>(&'a mut String);
        impl tracing::field::Visit for Text<'_> {
            fn record_debug(&mut self, _: &tracing::field::Field, value: &dyn std::fmt::Debug) {
                self.0.push_str(&format!("{value:?}"));
            }
        }
        let mut text = String::new();
        event.record(&mut Text(&mut text));
        self.0.lock().expect("no panic").push(text);
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }
    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}
    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}
    fn enter(&self, _: &tracing::span::Id) {}
    fn exit(&self, _: &tracing::span::Id) {}
}

#[test]
fn warnings_are_traced_and_not_written_to_a_file() -> Result {
    let log: &'static Log = Box::leak(Box::default());
    let mut data = Data::new(falling_box()?)?;
    data.qvel_mut()[0] = 1e12;
    tracing::subscriber::with_default(log, || data.step(1)).unwrap_err();
    let lines = log.0.lock().map_err(|_| "poisoned")?;
    assert!(lines.iter().any(|line| line.contains("QVEL")), "{lines:?}");
    assert!(!Path::new("MUJOCO_LOG.TXT").exists());
    Ok(())
}

#[test]
fn threads_that_share_a_model_compute_the_same_bits() -> Result {
    let model = falling_box()?;
    let run = |model: Arc<Model>| -> Result<_, SimError> {
        let mut data = Data::new(model)?;
        data.qvel_mut()[3] = 5.0;
        data.step(500)?;
        Ok(data.qpos().to_vec())
    };
    let expected = run(Arc::clone(&model))?;
    let threads: Vec<_> = (0..4)
        .map(|_| {
            let model = Arc::clone(&model);
            thread::spawn(move || run(model))
        })
        .collect();
    for thread in threads {
        assert_eq!(thread.join().expect("no panic")?, expected);
    }
    Ok(())
}

#[test]
fn contacts_of_a_flex_are_not_those_of_geoms() -> Result {
    let xml = r#"
        <mujoco>
          <worldbody>
            <geom name="floor" type="plane" size="1 1 1"/>
            <body pos="0.5 0 0.05"><freejoint/><geom name="ball" size="0.1"/></body>
            <flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" pos="0 0 0.005"
                      radius="0.01" dim="2"/>
          </worldbody>
        </mujoco>"#;
    if MujocoVersion::of_library()?.to_string().starts_with("2.") {
        return Ok(()); // it has no flexes
    }
    let mut data = Data::new(Arc::new(Model::from_files(&[("flex.xml", xml)])?))?;
    data.step(1)?;
    let name = |geom| data.model().geom_name(geom);
    let contacts: Vec<_> = data.contacts().collect();
    assert_eq!(contacts.len(), 1, "{contacts:?}");
    let (floor, ball) = contacts[0];
    assert_eq!((name(floor)?, name(ball)?), (Some("floor"), Some("ball")));
    Ok(())
}
