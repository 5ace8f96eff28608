//! Pictures: they show what is there, and change nothing.
//!
//! Where there is no OpenGL these tests have nothing to look at and pass, unless MUJOCO_GL names the
//! library that has to work.
#![cfg(feature = "render")]

use std::{env, ffi::OsString, fs, process::Command, thread};

use fetch_sim::{
    Camera, Control, FreeCamera, MujocoSimulator, RenderError, RenderOptions, Renderer, Segment,
    SimConfig, Simulator, Task,
};
use nalgebra::Vector3;

const GOAL: Vector3<f64> = Vector3::new(1.35, 0.85, 0.6);

fn simulator(task: Task) -> MujocoSimulator {
    MujocoSimulator::new(&SimConfig::new(task)).expect("MuJoCo")
}

/// A small picture, without smooth edges.
fn small() -> RenderOptions {
    RenderOptions::default().with_width(96).with_height(64).with_samples(0)
}

fn try_renderer(task: Task, options: RenderOptions) -> Result<Renderer, RenderError> {
    Renderer::new(&SimConfig::new(task), options)
}

/// `None` where pictures cannot be made, and need not be.
fn renderer(task: Task, options: RenderOptions) -> Option<Renderer> {
    match try_renderer(task, options) {
        Err(RenderError::NoOpenGl { .. }) if env::var_os("MUJOCO_GL").is_none() => None,
        made => Some(made.expect("OpenGL")),
    }
}

fn red(rgb: &[u8]) -> usize {
    rgb.chunks_exact(3).filter(|p| p[0] > 120 && p[1] < 60 && p[2] < 60).count()
}

fn mean_difference(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    let sum: f64 = a.iter().zip(b).map(|(&a, &b)| f64::from(a.abs_diff(b))).sum();
    sum / a.len() as f64
}

fn with_control(
    simulator: &mut MujocoSimulator,
    step: u32,
    mut look: impl FnMut(&MujocoSimulator),
) {
    let x = if step.is_multiple_of(3) { 0.04 } else { -0.03 };
    let control = Control { displacement: Vector3::new(x, 0.02, -0.03), fingers: x };
    simulator.step(&control).expect("a step");
    look(simulator);
}

#[test]
fn the_goal_is_drawn_where_it_is_and_the_sky_above() {
    let Some(mut renderer) = renderer(Task::Push, RenderOptions::default()) else { return };
    let simulator = simulator(Task::Push);
    renderer.update_scene(&simulator, Some(GOAL)).unwrap();
    let near = renderer.rgb().unwrap().to_vec();
    assert_eq!(near.len(), 480 * 480 * 3);
    assert!((50..500).contains(&red(&near)), "{} red pixels", red(&near));
    let [r, g, b] = near[..3] else { panic!("a pixel") };
    assert!(g > r && g > b, "the sky is green, the top row is {r} {g} {b}");
    renderer.update_scene(&simulator, Some(GOAL - Vector3::new(0.0, 0.0, 5.0))).unwrap();
    assert_eq!(red(renderer.rgb().unwrap()), 0, "below the floor and out of the picture");
    renderer.update_scene(&simulator, Some(GOAL)).unwrap();
    assert_eq!(renderer.rgb().unwrap(), near, "the same scene gives the same bytes");
}

#[test]
fn depth_is_the_distance_in_meters() {
    // Straight down at the table's edge nearest to -y: its top is 2 m below, the floor 2.4 m.
    let lookat = Vector3::new(1.5, 0.45, 0.4);
    let down = FreeCamera::default()
        .with_lookat(lookat)
        .with_distance(2.0)
        .with_azimuth(90.0)
        .with_elevation(-90.0);
    let options = small().with_camera(Camera::Free(down));
    let Some(mut renderer) = renderer(Task::Reach, options) else { return };
    let depth = renderer.depth().unwrap();
    assert_eq!(depth.len(), 96 * 64);
    let at = |row: usize| depth[row * 96 + 48];
    assert!((at(32) - 2.0).abs() < 1e-3, "the table is {} m away", at(32));
    assert!((at(40) - 2.4).abs() < 1e-3, "the floor is {} m away", at(40));
    assert!(depth.iter().all(|meters| (1.0..200.0).contains(meters)));
}

#[test]
fn segmentation_tells_geoms_and_sites_with_hard_edges() {
    let wide = RenderOptions::default().with_width(240).with_height(240).with_samples(4);
    let Some(mut smooth) = renderer(Task::Push, wide.clone()) else { return };
    let mut hard = try_renderer(Task::Push, wide.with_samples(0)).unwrap();
    let simulator = simulator(Task::Push);
    for renderer in [&mut smooth, &mut hard] {
        renderer.update_scene(&simulator, Some(GOAL)).unwrap();
    }
    let segments = smooth.segmentation().unwrap().to_vec();
    assert_eq!(segments, hard.segmentation().unwrap());
    let model = smooth.model();
    let count = |name: &str| {
        let geom = model.geom(name).expect(name);
        segments.iter().filter(|&&segment| segment == Segment::Geom(geom)).count()
    };
    assert!(count("table0") > 3000 && count("floor0") > 3000 && count("object0") > 20);
    let target = Segment::Site(model.site("target0").unwrap());
    assert!(segments.contains(&target) && segments.contains(&Segment::Background));
    assert!(!segments.contains(&Segment::Other));
    assert_eq!(segments[0], Segment::Background);
}

#[test]
fn rendering_changes_no_bit_of_the_simulation() {
    for task in Task::ALL {
        let Some(mut renderer) = renderer(task, small()) else { return };
        let (mut seen, mut unseen) = (simulator(task), simulator(task));
        for step in 0..30 {
            with_control(&mut unseen, step, |_| ());
            with_control(&mut seen, step, |simulator| {
                let state = || {
                    let contacts: Vec<_> = simulator.data().contacts().collect();
                    (simulator.snapshot(), contacts)
                };
                let before = state();
                renderer.update_scene(simulator, Some(GOAL)).unwrap();
                renderer.rgb().unwrap();
                renderer.depth().unwrap();
                renderer.segmentation().unwrap();
                assert_eq!(state(), before, "{task}");
            });
            assert_eq!(seen.snapshot(), unseen.snapshot(), "{task}, step {step}");
        }
    }
}

#[test]
fn every_camera_of_the_model_sees_something_else() {
    let Some(mut renderer) = renderer(Task::Reach, small()) else { return };
    let mut pictures = vec![renderer.rgb().unwrap().to_vec()];
    let names: Vec<String> = renderer.camera_names().iter().map(|&name| name.into()).collect();
    assert_eq!(names.len(), 4);
    for (index, name) in names.iter().enumerate() {
        renderer.set_camera(Camera::Named(name.clone())).unwrap();
        let named = renderer.rgb().unwrap().to_vec();
        renderer.set_camera(Camera::Index(index)).unwrap();
        assert_eq!(renderer.rgb().unwrap(), named, "{name}");
        assert!(!pictures.contains(&named), "{name}");
        pictures.push(named);
    }
}

#[test]
fn what_cannot_be_is_refused() {
    for (width, height) in [(0, 480), (480, 0), (4097, 1), (1, u32::MAX)] {
        let refused = try_renderer(Task::Reach, small().with_width(width).with_height(height));
        assert_eq!(refused.unwrap_err(), RenderError::Size { width, height });
    }
    let Some(mut renderer) = renderer(Task::Reach, small()) else { return };
    let before = renderer.rgb().unwrap().to_vec();
    for camera in [Camera::Named("none".into()), Camera::Named("a\0b".into()), Camera::Index(4)] {
        let error = renderer.set_camera(camera).unwrap_err();
        assert!(error.to_string().contains("external_camera_0"), "{error}");
    }
    for distance in [0.0, -1.0, f64::NAN] {
        let camera = Camera::Free(FreeCamera::REFERENCE.with_distance(distance));
        let error = renderer.set_camera(camera).unwrap_err();
        assert!(matches!(error, RenderError::FreeCamera { field: "distance", .. }));
    }
    let error = renderer.update_scene(&simulator(Task::Push), None).unwrap_err();
    assert!(matches!(error, RenderError::OtherModel { .. }), "{error}");
    assert_eq!(renderer.rgb().unwrap(), before, "as it was");
}

#[test]
fn pictures_have_the_size_asked_for_up_to_the_largest() {
    for (width, height) in [(1, 1), (7, 3), (4096, 16), (16, 4096)] {
        let options = small().with_width(width).with_height(height);
        let Some(mut renderer) = renderer(Task::Reach, options) else { return };
        assert_eq!(renderer.rgb().unwrap().len(), (3 * width * height) as usize);
        assert_eq!(renderer.depth().unwrap().len(), (width * height) as usize);
    }
}

#[test]
fn renderers_do_not_disturb_each_other_on_one_thread_or_several() {
    let Some(mut reach) = renderer(Task::Reach, small()) else { return };
    let expected = reach.rgb().unwrap().to_vec();
    let mut slide = try_renderer(Task::Slide, small().with_width(33)).unwrap();
    slide.rgb().unwrap();
    assert_eq!(reach.rgb().unwrap(), expected);
    drop(slide);
    assert_eq!(reach.rgb().unwrap(), expected);
    let threads: Vec<_> = (0..3)
        .map(|_| {
            thread::spawn(|| {
                let mut renderer = try_renderer(Task::Reach, small()).expect("OpenGL");
                (0..3).map(|_| renderer.rgb().expect("a picture").to_vec()).collect::<Vec<_>>()
            })
        })
        .collect();
    for thread in threads {
        assert!(thread.join().unwrap().iter().all(|rgb| *rgb == expected));
    }
}

/// Runs one of the tests below, which are made for it, in a process of its own.
fn in_a_process_with(test: &str, variables: &[(&str, OsString)]) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("the operating system helps");
    let path = folder.path().join("answer");
    let output = Command::new(env::current_exe().expect("the operating system helps"))
        .args(["--exact", test, "--ignored"])
        .env("FETCH_TEST_ANSWER", &path)
        .envs(variables.iter().map(|(name, value)| (name, value)))
        .output()
        .expect("the operating system helps");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    fs::read(path).expect("the operating system helps")
}

#[test]
#[ignore = "run by other tests, in processes of their own"]
fn answer_with_a_picture() {
    let answer = match try_renderer(Task::PickAndPlace, RenderOptions::default()) {
        Ok(mut renderer) => {
            renderer.update_scene(&simulator(Task::PickAndPlace), Some(GOAL)).unwrap();
            renderer.rgb().unwrap().to_vec()
        }
        Err(error) => error.to_string().into_bytes(),
    };
    fs::write(env::var_os("FETCH_TEST_ANSWER").unwrap(), answer).unwrap();
}

#[test]
fn without_opengl_there_is_one_error_that_names_the_packages() {
    // Libraries that are there but cannot be loaded: as good as none, on machines with OpenGL too.
    let folder = tempfile::tempdir().unwrap();
    for name in ["libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6"] {
        fs::write(folder.path().join(name), "no library").unwrap();
    }
    let hidden: OsString = folder.path().into();
    for variables in [[("LD_LIBRARY_PATH", hidden)], [("MUJOCO_GL", "disable".into())]] {
        let answer = in_a_process_with("answer_with_a_picture", &variables);
        let answer = String::from_utf8(answer).unwrap();
        for part in ["no OpenGL", "libegl1", "libgl1-mesa-dri", "libosmesa6"] {
            assert!(answer.contains(part), "{answer}");
        }
    }
}

#[test]
fn egl_and_osmesa_draw_the_same() {
    let picture = |library: &str| {
        let answer = in_a_process_with("answer_with_a_picture", &[("MUJOCO_GL", library.into())]);
        (answer.len() == 480 * 480 * 3).then_some(answer)
    };
    if let (Some(egl), Some(osmesa)) = (picture("egl"), picture("osmesa")) {
        assert!(mean_difference(&egl, &osmesa) < 1.0);
    }
}

/// Resident memory of this process, in kB.
fn resident() -> usize {
    let status = fs::read_to_string("/proc/self/status").expect("the operating system helps");
    let line =
        status.lines().find(|line| line.starts_with("VmRSS")).expect("the operating system helps");
    line.split_whitespace()
        .nth(1)
        .expect("the operating system helps")
        .parse()
        .expect("the operating system helps")
}

#[test]
#[ignore = "takes minutes: run it after a change of the shim"]
fn ten_thousand_pictures_and_a_hundred_renderers_leave_no_memory_behind() {
    let simulator = simulator(Task::Push);
    let one_round = |pictures: usize| {
        let mut renderer = try_renderer(Task::Push, small()).unwrap();
        for _ in 0..pictures {
            renderer.update_scene(&simulator, Some(GOAL)).unwrap();
            renderer.rgb().unwrap();
        }
    };
    for _ in 0..10 {
        one_round(10);
    }
    let before = resident();
    for _ in 0..100 {
        one_round(100);
    }
    let grown = resident().saturating_sub(before);
    assert!(grown < 16_000, "{grown} kB more");
}
