//! A build without MuJoCo's headers: everything compiles, and the first use is an error.
#![cfg(all(feature = "mujoco", fetch_sim_no_shim))]

use std::path::Path;

use fetch_sim::{
    FetchModel, KinematicSimulator, Model, MujocoSimulator, MujocoVersion, SimConfig, SimError,
    Task, library_path,
};

const ERROR: SimError = SimError::BuiltWithoutMujoco;

#[test]
fn every_first_use_of_mujoco_is_an_error() {
    let config = SimConfig::new(Task::Push);
    assert_eq!(Model::from_path(Path::new("model.xml")).err(), Some(ERROR));
    assert_eq!(Model::from_files(&[("model.xml", "<mujoco/>")]).err(), Some(ERROR));
    assert_eq!(FetchModel::load(&config).err(), Some(ERROR));
    assert_eq!(MujocoSimulator::new(&config).err(), Some(ERROR));
    assert_eq!(MujocoVersion::of_library(), Err(ERROR));
    assert_eq!(library_path(), Err(ERROR));
    assert_eq!(MujocoVersion::of_headers(), None);
}

#[cfg(feature = "render")]
#[test]
fn a_renderer_is_the_same_error() {
    use fetch_sim::{RenderError, RenderOptions, Renderer};

    let made = Renderer::new(&SimConfig::new(Task::Push), RenderOptions::default());
    assert_eq!(made.err(), Some(RenderError::Sim(ERROR)));
    assert_eq!(Renderer::backend(), None);
}

#[test]
fn the_error_names_every_way_out() {
    let text = ERROR.to_string();
    let ways_out =
        ["libmujoco-dev", "MUJOCO_DIR", "download::remember", "cargo xtask mujoco", "build again"];
    for way_out in ways_out {
        assert!(text.contains(way_out), "{way_out}: {text}");
    }
    let _ = KinematicSimulator::new(&SimConfig::new(Task::Push)); // needs no MuJoCo
}
