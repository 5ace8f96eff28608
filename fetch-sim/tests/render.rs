//! Pictures show the scene and do not change it.
//!
//! Without OpenGL these tests pass without a picture, unless MUJOCO_GL names the library that has
//! to work.
#![cfg(all(feature = "render", not(fetch_sim_no_shim)))]

use std::{env, ffi::OsStr, fs, process::Command, thread};

use fetch_sim::{
    Camera, Control, Extension, FreeCamera, ModelSource, MujocoSimulator, RenderError,
    RenderOptions, Renderer, Segment, SimConfig, SimError, Simulator, Task, builtin_files,
};
use nalgebra::{UnitQuaternion, Vector3};
use testing::{Result, unless_blind};

/// In free sight of the reference's camera: the robot, which stands a little differently on every
/// MuJoCo, hides nothing of it.
const GOAL: Vector3<f64> = Vector3::new(1.35, 1.0, 0.6);

fn simulator(task: Task) -> Result<MujocoSimulator, SimError> {
    MujocoSimulator::new(&SimConfig::new(task))
}

/// Returns the options of a small picture with hard edges.
fn small() -> RenderOptions {
    RenderOptions::default().with_width(96).with_height(64).with_samples(0)
}

fn try_renderer(task: Task, options: RenderOptions) -> Result<Renderer, RenderError> {
    Renderer::new(&SimConfig::new(task), options)
}

/// Returns `None` if pictures cannot be made and need not be.
fn renderer(task: Task, options: RenderOptions) -> Result<Option<Renderer>, RenderError> {
    unless_blind(try_renderer(task, options))
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
    mut look: impl FnMut(&MujocoSimulator) -> Result,
) -> Result {
    let x = if step.is_multiple_of(3) { 0.04 } else { -0.03 };
    let control = Control { displacement: Vector3::new(x, 0.02, -0.03), fingers: x };
    simulator.step(&control)?;
    look(simulator)
}

#[test]
fn the_goal_is_drawn_at_its_position_and_the_sky_above() -> Result {
    let Some(mut renderer) = renderer(Task::Push, RenderOptions::default())? else { return Ok(()) };
    let simulator = simulator(Task::Push)?;
    renderer.update_scene(&simulator, &[GOAL])?;
    let near = renderer.rgb()?.to_vec();
    assert_eq!(near.len(), 480 * 480 * 3);
    assert!((50..80).contains(&red(&near)), "{} red pixels", red(&near));
    let [r, g, b] = near[..3] else { panic!("a pixel") };
    assert!(g > r && g > b, "the sky is green, the top row is {r} {g} {b}");
    renderer.update_scene(&simulator, &[GOAL - Vector3::new(0.0, 0.0, 5.0)])?;
    assert_eq!(red(renderer.rgb()?), 0, "below the floor and out of the picture");
    renderer.update_scene(&simulator, &[GOAL])?;
    assert_eq!(renderer.rgb()?, near, "the same scene gives the same bytes");
    renderer.set_goals_shown(false);
    assert_eq!(red(renderer.rgb()?), 0, "hidden");
    renderer.set_goals_shown(true);
    assert_eq!(renderer.rgb()?, near);
    Ok(())
}

/// Returns the number of pixels that show a site.
fn sites(segments: &[Segment]) -> usize {
    segments.iter().filter(|segment| matches!(segment, Segment::Site(_))).count()
}

#[test]
fn every_goal_is_drawn_as_the_first_one_is() -> Result {
    let options = RenderOptions::default().with_width(240).with_height(240).with_samples(0);
    let Some(mut renderer) = renderer(Task::Push, options)? else { return Ok(()) };
    let simulator = simulator(Task::Push)?;
    let mut draw = |goals: &[Vector3<f64>]| -> Result<Vec<Segment>> {
        renderer.update_scene(&simulator, goals)?;
        let _ = renderer.rgb()?;
        Ok(renderer.segmentation()?.to_vec())
    };
    let other = GOAL - Vector3::new(0.0, 0.2, 0.0);
    let [first, second] = [draw(&[GOAL])?, draw(&[other])?];
    let both = draw(&[GOAL, other])?;
    for ((both, first), second) in both.iter().zip(&first).zip(&second) {
        let expected = if matches!(first, Segment::Site(_)) { first } else { second };
        assert_eq!(both, expected, "each is where it is alone, and the rest as without it");
    }
    assert!(sites(&first) > 10 && sites(&both) == sites(&first) + sites(&second));
    assert_eq!(draw(&[GOAL])?, first, "the second one is gone");
    let nowhere = draw(&[])?;
    assert_ne!(nowhere, first, "without goals the sphere stays where the model has it");
    let many = vec![GOAL; 5000];
    let refused = renderer.update_scene(&simulator, &many).and_then(|()| renderer.rgb().map(drop));
    assert!(matches!(refused, Err(RenderError::Failed { .. })), "{refused:?}");
    Ok(())
}

#[test]
fn models_of_ones_own_are_drawn_with_their_own_goals() -> Result {
    let tower = r#"
        <worldbody>
          <body name="tower" mocap="true" pos="1.3 0.75 5">
            <geom name="tower" type="box" size="0.05 0.05 0.3"/>
          </body>
          <site name="target1" size="0.05" pos="1.3 0.75 5" rgba="0 0 1 1"/>
        </worldbody>"#;
    let files = builtin_files(Task::Push);
    let scene = files.get("push.xml").ok_or("a scene")?;
    let scene = scene.replace("</mujoco>", &format!("{tower}</mujoco>"));
    let sources = [
        ModelSource::Extended(Extension::default().with_xml(tower)),
        ModelSource::Files(files.with_file("push.xml", scene)),
    ];
    let mut pictures = Vec::new();
    for source in sources {
        let config = SimConfig::new(Task::Push).with_model(source);
        let made = unless_blind(Renderer::new(&config, small()))?;
        let Some(mut renderer) = made else { return Ok(()) };
        let mut simulator = MujocoSimulator::new(&config)?;
        let model = renderer.model();
        let geom = Segment::Geom(model.geom("tower")?);
        let target = Segment::Site(model.site("target1")?);
        renderer.update_scene(&simulator, &[])?;
        assert!(!renderer.segmentation()?.contains(&geom), "out of sight");
        let at = Vector3::new(1.3, 0.9, 0.7);
        simulator.place_object("tower", at, UnitQuaternion::identity())?;
        renderer.update_scene(&simulator, &[GOAL, Vector3::new(1.3, 0.5, 0.7)])?;
        let segments = renderer.segmentation()?;
        assert!(segments.contains(&geom) && segments.contains(&target));
        pictures.push(renderer.rgb()?.to_vec());
    }
    assert!(pictures[0] == pictures[1]);
    Ok(())
}

#[test]
fn depth_is_the_distance_in_meters() -> Result {
    // Straight down at the table's edge nearest to -y: its top is 2 m below, the floor 2.4 m.
    let lookat = Vector3::new(1.5, 0.45, 0.4);
    let down = FreeCamera { lookat, distance: 2.0, azimuth: 90.0, elevation: -90.0 };
    let options = small().with_camera(Camera::Free(down));
    let Some(mut renderer) = renderer(Task::Reach, options)? else { return Ok(()) };
    let depth = renderer.depth()?;
    assert_eq!(depth.len(), 96 * 64);
    let at = |row: usize| depth[row * 96 + 48];
    assert!((at(32) - 2.0).abs() < 1e-3, "the table is {} m away", at(32));
    assert!((at(40) - 2.4).abs() < 1e-3, "the floor is {} m away", at(40));
    assert!(depth.iter().all(|meters| (1.0..200.0).contains(meters)));
    Ok(())
}

#[test]
fn segmentation_distinguishes_geoms_and_sites_with_hard_edges() -> Result {
    let wide = RenderOptions::default().with_width(240).with_height(240).with_samples(4);
    let Some(mut smooth) = renderer(Task::Push, wide.clone())? else { return Ok(()) };
    let mut hard = try_renderer(Task::Push, wide.with_samples(0))?;
    let simulator = simulator(Task::Push)?;
    for renderer in [&mut smooth, &mut hard] {
        renderer.update_scene(&simulator, &[GOAL])?;
    }
    let segments = smooth.segmentation()?.to_vec();
    assert_eq!(segments, hard.segmentation()?);
    let model = smooth.model();
    for (name, least) in [("table0", 3000), ("floor0", 3000), ("object0", 20)] {
        let geom = Segment::Geom(model.geom(name)?);
        assert!(segments.iter().filter(|&&segment| segment == geom).count() > least, "{name}");
    }
    let target = Segment::Site(model.site("target0")?);
    assert!(segments.contains(&target) && segments.contains(&Segment::Background));
    assert!(!segments.contains(&Segment::Other));
    assert_eq!(segments[0], Segment::Background);
    Ok(())
}

#[test]
fn rendering_changes_no_bit_of_the_simulation() -> Result {
    for task in Task::ALL {
        let Some(mut renderer) = renderer(task, small())? else { return Ok(()) };
        let (mut seen, mut unseen) = (simulator(task)?, simulator(task)?);
        for step in 0..30 {
            with_control(&mut unseen, step, |_| Ok(()))?;
            with_control(&mut seen, step, |simulator| {
                let state = || {
                    let contacts: Vec<_> = simulator.data().contacts().collect();
                    (simulator.snapshot(), contacts)
                };
                let before = state();
                renderer.update_scene(simulator, &[GOAL])?;
                renderer.rgb()?;
                renderer.depth()?;
                renderer.segmentation()?;
                assert_eq!(state(), before, "{task}");
                Ok(())
            })?;
            assert_eq!(seen.snapshot(), unseen.snapshot(), "{task}, step {step}");
        }
    }
    Ok(())
}

#[test]
fn every_camera_of_the_model_sees_something_different() -> Result {
    let Some(mut renderer) = renderer(Task::Reach, small())? else { return Ok(()) };
    let mut pictures = vec![renderer.rgb()?.to_vec()];
    let names: Vec<String> = renderer.camera_names().iter().map(|&name| name.into()).collect();
    assert_eq!(names.len(), 4);
    for (index, name) in names.iter().enumerate() {
        renderer.set_camera(Camera::Named(name.clone()))?;
        let named = renderer.rgb()?.to_vec();
        renderer.set_camera(Camera::Index(index))?;
        assert_eq!(renderer.rgb()?, named, "{name}");
        assert!(!pictures.contains(&named), "{name}");
        pictures.push(named);
    }
    Ok(())
}

#[test]
fn invalid_options_are_rejected() -> Result {
    for (width, height) in [(0, 480), (480, 0), (4097, 1), (1, u32::MAX)] {
        let rejected = try_renderer(Task::Reach, small().with_width(width).with_height(height));
        assert_eq!(rejected.unwrap_err(), RenderError::Size { width, height });
    }
    let Some(mut renderer) = renderer(Task::Reach, small())? else { return Ok(()) };
    let before = renderer.rgb()?.to_vec();
    for camera in [Camera::Named("none".into()), Camera::Named("a\0b".into()), Camera::Index(4)] {
        let error = renderer.set_camera(camera).unwrap_err();
        assert!(error.to_string().contains("external_camera_0"), "{error}");
    }
    for distance in [0.0, -1.0, f64::NAN] {
        let camera = Camera::Free(FreeCamera { distance, ..FreeCamera::REFERENCE });
        let error = renderer.set_camera(camera).unwrap_err();
        assert!(matches!(error, RenderError::FreeCamera { field: "distance", .. }));
    }
    let error = renderer.update_scene(&simulator(Task::Push)?, &[]).unwrap_err();
    assert!(matches!(error, RenderError::OtherModel { .. }), "{error}");
    assert_eq!(renderer.rgb()?, before, "as it was");
    Ok(())
}

#[test]
fn pictures_have_the_requested_size_up_to_the_largest() -> Result {
    for (width, height) in [(1, 1), (7, 3), (4096, 16), (16, 4096)] {
        let options = small().with_width(width).with_height(height);
        let Some(mut renderer) = renderer(Task::Reach, options)? else { return Ok(()) };
        assert_eq!(renderer.rgb()?.len(), (3 * width * height) as usize);
        assert_eq!(renderer.depth()?.len(), (width * height) as usize);
    }
    Ok(())
}

#[test]
fn renderers_do_not_disturb_each_other_on_one_thread_or_several() -> Result {
    let Some(mut reach) = renderer(Task::Reach, small())? else { return Ok(()) };
    let expected = reach.rgb()?.to_vec();
    let mut slide = try_renderer(Task::Slide, small().with_width(33))?;
    slide.rgb()?;
    assert_eq!(reach.rgb()?, expected);
    drop(slide);
    assert_eq!(reach.rgb()?, expected);
    let threads: Vec<_> = (0..3)
        .map(|_| {
            thread::spawn(|| {
                let mut renderer = try_renderer(Task::Reach, small())?;
                (0..3).map(|_| renderer.rgb().map(<[u8]>::to_vec)).collect::<Result<Vec<_>, _>>()
            })
        })
        .collect();
    for thread in threads {
        assert!(thread.join().expect("no panic")?.iter().all(|rgb| *rgb == expected));
    }
    Ok(())
}

/// Runs the next test in a separate process, and returns its answer.
fn in_a_process_with(variable: &str, value: impl AsRef<OsStr>) -> Result<Vec<u8>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("answer");
    let output = Command::new(env::current_exe()?)
        .args(["--exact", "answer_with_a_picture", "--ignored"])
        .env("FETCH_TEST_ANSWER", &path)
        .env(variable, value)
        .output()?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    Ok(fs::read(path)?)
}

#[test]
#[ignore = "run by other tests, in separate processes"]
fn answer_with_a_picture() -> Result {
    let answer = match try_renderer(Task::PickAndPlace, RenderOptions::default()) {
        Ok(mut renderer) => {
            renderer.update_scene(&simulator(Task::PickAndPlace)?, &[GOAL])?;
            renderer.rgb()?.to_vec()
        }
        Err(error) => {
            // A forked child has no OpenGL either, for the same reason.
            #[cfg(target_os = "linux")]
            testing::in_child(|| {
                let again = try_renderer(Task::PickAndPlace, RenderOptions::default());
                assert_eq!(again.err(), Some(error.clone()));
                Ok(())
            })?;
            error.to_string().into_bytes()
        }
    };
    fs::write(env::var_os("FETCH_TEST_ANSWER").ok_or("no path")?, answer)?;
    Ok(())
}

#[test]
fn without_opengl_there_is_one_error_that_names_the_packages() -> Result {
    // Files that are not libraries hide those of machines with OpenGL.
    let folder = tempfile::tempdir()?;
    for name in ["libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6"] {
        fs::write(folder.path().join(name), "no library")?;
    }
    let disabled = OsStr::new("disable");
    for (variable, value) in
        [("LD_LIBRARY_PATH", folder.path().as_os_str()), ("MUJOCO_GL", disabled)]
    {
        let answer = String::from_utf8(in_a_process_with(variable, value)?)?;
        let packages = ["libegl1", "libgl1-mesa-dri", "libosmesa6"];
        let ways = if cfg!(target_os = "linux") { &packages[..] } else { &["on Linux"] };
        for part in ways.iter().chain(&["no OpenGL"]) {
            assert!(answer.contains(part), "{answer}");
        }
    }
    Ok(())
}

#[test]
fn egl_and_osmesa_draw_the_same() -> Result {
    let [egl, osmesa] =
        [in_a_process_with("MUJOCO_GL", "egl")?, in_a_process_with("MUJOCO_GL", "osmesa")?];
    // An answer of another length is the error of a library that is missing.
    if [egl.len(), osmesa.len()] == [480 * 480 * 3; 2] {
        assert!(mean_difference(&egl, &osmesa) < 1.0);
    }
    Ok(())
}

/// Returns the resident memory of this process, in kB.
fn resident() -> Result<usize> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with("VmRSS")).ok_or("no VmRSS")?;
    Ok(line.split_whitespace().nth(1).ok_or("no number")?.parse()?)
}

#[test]
#[ignore = "takes minutes: run it after changing the shim"]
fn ten_thousand_pictures_and_a_hundred_renderers_leave_no_memory_behind() -> Result {
    let simulator = simulator(Task::Push)?;
    let one_round = |pictures: usize| -> Result {
        let mut renderer = try_renderer(Task::Push, small())?;
        for _ in 0..pictures {
            renderer.update_scene(&simulator, &[GOAL])?;
            renderer.rgb()?;
        }
        Ok(())
    };
    for _ in 0..10 {
        one_round(10)?;
    }
    let before = resident()?;
    for _ in 0..100 {
        one_round(100)?;
    }
    let grown = resident()?.saturating_sub(before);
    assert!(grown < 16_000, "{grown} kB more");
    Ok(())
}

#[test]
fn any_thread_may_use_and_drop_a_renderer() -> Result {
    let Some(mut renderer) = renderer(Task::Slide, small())? else { return Ok(()) };
    let expected = renderer.rgb()?.to_vec();
    for _ in 0..3 {
        let moved = thread::spawn(move || {
            let picture = renderer.rgb().expect("a picture").to_vec();
            (renderer, picture)
        });
        let (back, picture) = moved.join().expect("no panic");
        assert!(picture == expected);
        renderer = back;
        assert!(renderer.rgb()? == expected);
    }
    thread::spawn(move || drop(renderer)).join().expect("no panic");
    Ok(())
}
