//! Random models, sound and broken: loading, stepping, failing and dropping them ends in results or
//! typed errors. `cargo xtask sanitize` runs this under sanitizers, with more cases.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::sync::Arc;

use fetch_sim::{Data, Model, SimError};
use proptest::prelude::*;
use proptest::sample::select;

const SIZES: [&str; 3] = ["0.1 0.2 0.3", "0.05 0.05 0.05", "0.3 0.1 0.01"];
const BAD_SIZES: [&str; 5] = ["1e-9", "0", "0.1", "-1 1 1", "nan 1 1"];
const KINDS: [&str; 6] = ["sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"];
const BAD_KINDS: [&str; 3] = ["plane", "hfield", "nothing"];
const JOINTS: [&str; 4] = ["", "hinge", "slide", "ball"];
const BAD_JOINTS: [&str; 2] = ["free", "nothing"];
const BAD_NUMBERS: [&str; 8] = ["0", "1", "-1", "0.1", "1e300", "nan", "inf", "x"];

/// Selects a sound value most of the time, so that most models of several bodies are sound.
fn mostly(
    sound: &'static [&'static str],
    bad: &'static [&'static str],
) -> impl Strategy<Value = &'static str> {
    prop_oneof![60 => select(sound), 1 => select(bad)]
}

#[derive(Debug, Clone)]
struct Body {
    joint: &'static str,
    kind: &'static str,
    size: &'static str,
    position: [f64; 3],
    margin: &'static str,
    children: Vec<Body>,
}

fn body() -> impl Strategy<Value = Body> {
    let parts = (
        mostly(&JOINTS, &BAD_JOINTS),
        mostly(&KINDS, &BAD_KINDS),
        mostly(&SIZES, &BAD_SIZES),
        prop::array::uniform3(-0.4..0.4),
        mostly(&["0.01", "0"], &BAD_NUMBERS),
    );
    let leaf = parts.prop_map(|(joint, kind, size, position, margin)| Body {
        joint,
        kind,
        size,
        position,
        margin,
        children: Vec::new(),
    });
    leaf.prop_recursive(3, 8, 3, |inner| {
        (inner.clone(), prop::collection::vec(inner, 0..3))
            .prop_map(|(body, children)| Body { children, ..body })
    })
}

impl Body {
    fn write(&self, xml: &mut String) {
        let Self { joint, kind, size, position: [x, y, z], margin, children } = self;
        let mesh = if *kind == "mesh" { r#" mesh="m""# } else { "" };
        let joint = match *joint {
            "" => String::new(),
            joint => format!(r#"<joint type="{joint}"/>"#),
        };
        *xml += &format!(
            r#"<body pos="{x} {y} {z}">{joint}<geom type="{kind}" size="{size}"{mesh} margin="{margin}"/><site/>"#
        );
        children.iter().for_each(|child| child.write(xml));
        *xml += "</body>";
    }
}

fn xml() -> impl Strategy<Value = String> {
    let option = mostly(&["0.002", "0.01"], &BAD_NUMBERS);
    let mesh = prop::collection::vec(-0.3..0.3, 12..60);
    (prop::collection::vec(body(), 1..6), mesh, option).prop_map(|(bodies, mesh, timestep)| {
        let mesh: Vec<_> = mesh.chunks_exact(3).flatten().map(f64::to_string).collect();
        let mut xml = format!(
            r#"<mujoco><option timestep="{timestep}"/><asset><mesh name="m" vertex="{}"/></asset>
            <worldbody><geom type="plane" size="1 1 1"/>"#,
            mesh.join(" ")
        );
        bodies.iter().for_each(|body| body.write(&mut xml));
        xml + "</worldbody></mujoco>"
    })
}

/// Steps a simulation, with a disturbance that may make it fail, and returns its results.
fn run(data: &mut Data, disturbance: f64) -> Vec<Result<Vec<u64>, SimError>> {
    (0..8)
        .map(|step| {
            if let (4, Some(velocity)) = (step, data.qvel_mut().first_mut()) {
                *velocity += disturbance;
            }
            data.step(1)?;
            Ok(data.qpos().iter().chain(data.qvel()).map(|number| number.to_bits()).collect())
        })
        .collect()
}

proptest! {
    #[test]
    fn a_model_is_simulated_or_refused(
        xml in xml(),
        disturbance in select(&[0.0, 1.0, 1e12, f64::NAN][..]),
    ) {
        let model = match Model::from_files(&[("random.xml", &xml)]) {
            Ok(model) => Arc::new(model),
            Err(error) => {
                prop_assert!(matches!(error, SimError::Model { .. }), "{}", error);
                return Ok(());
            }
        };
        let mut data = Data::new(Arc::clone(&model))?;
        let mut filtered = Data::new(model)?;
        filtered.set_contact_filter(true)?;
        let first = run(&mut data, disturbance);
        prop_assert_eq!(&run(&mut filtered, disturbance), &first);
        // An error lasts until the reset, and nothing outlasts it.
        for data in [&mut data, &mut filtered] {
            data.reset()?;
            prop_assert_eq!(&run(data, disturbance), &first);
        }
    }

    /// A model whose text is damaged anywhere.
    #[test]
    fn a_damaged_text_is_refused_or_read(
        xml in xml(),
        at in any::<prop::sample::Index>(),
        len in 0_usize..40,
        other in "[<>\"/ a-z0-9=.-]{0,10}",
    ) {
        let start = at.index(xml.len());
        let end = (start + len).min(xml.len());
        let damaged = [&xml[..start], &other, &xml[end..]].concat();
        match Model::from_files(&[("damaged.xml", &damaged)]) {
            Err(SimError::Model { reason, .. }) => prop_assert!(!reason.is_empty()),
            Err(error) => prop_assert!(false, "{}", error),
            Ok(model) => drop(Data::new(Arc::new(model))?.step(1)),
        }
    }
}
