//! Looks change pictures as documented, and leave no trace.
//!
//! Without OpenGL these tests pass without a picture, unless `MUJOCO_GL` names the library that has
//! to work.
#![cfg(all(feature = "render", not(fetch_sim_no_shim)))]

use std::sync::Arc;

use fetch_sim::{
    Camera, Extension, FreeCamera, LookFactor, Looks, ModelSource, MujocoSimulator, ObjectShape,
    Physics, PhysicsFactor, RenderOptions, Renderer, Segment, SimConfig, SimError, Simulator, Task,
};
use nalgebra::{UnitQuaternion, Vector3};
use testing::{Result, unless_blind};

/// In free sight of the reference's camera.
const GOAL: Vector3<f64> = Vector3::new(1.35, 1.0, 0.6);

const SIDE: usize = 120;

/// A renderer and a simulation of Push whose object is in sight.
struct Stage {
    renderer: Renderer,
    simulator: MujocoSimulator,
}

impl Stage {
    /// Returns `None` if pictures cannot be made and need not be.
    fn new(config: &SimConfig, side: usize) -> Result<Option<Self>> {
        let side = u32::try_from(side)?;
        let options = RenderOptions::default().with_width(side).with_height(side).with_samples(0);
        let made = unless_blind(Renderer::new(config, options))?;
        let Some(renderer) = made else { return Ok(None) };
        let mut simulator = MujocoSimulator::new(config)?;
        simulator.reset(Some([1.4, 0.85]))?;
        Ok(Some(Self { renderer, simulator }))
    }

    fn picture(&mut self, looks: Looks, goals: &[Vector3<f64>]) -> Result<Vec<u8>> {
        self.renderer.set_looks(looks);
        self.renderer.update_scene(&self.simulator, goals)?;
        Ok(self.renderer.rgb()?.to_vec())
    }
}

fn push() -> SimConfig {
    SimConfig::new(Task::Push)
}

fn looks(numbers: &[(LookFactor, f64)]) -> Result<Looks> {
    let mut numbers = numbers.iter();
    Ok(numbers.try_fold(Looks::default(), |looks, &(factor, value)| looks.with(factor, value))?)
}

/// Checks that two pictures differ in a few pixels at most, which rounding puts on either side of an
/// edge.
fn assert_close(a: &[u8], b: &[u8], what: &str) {
    let pixels = a.chunks_exact(3).zip(b.chunks_exact(3));
    let differing = pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2));
    let count = differing.count();
    assert!(a.len() == b.len() && count * 500 <= a.len() / 3, "{what}: {count} pixels differ");
}

#[test]
fn a_color_is_seen_on_its_object_alone() -> Result {
    for task in [Task::Push, Task::Slide] {
        for source in [ModelSource::Builtin, ModelSource::Reference] {
            let config = SimConfig::new(task).with_model(source);
            match MujocoSimulator::new(&config) {
                Err(SimError::NoAssets { .. }) => continue,
                simulator => drop(simulator?),
            }
            let Some(mut stage) = Stage::new(&config, SIDE)? else { return Ok(()) };
            check_colors(&mut stage)?;
        }
    }
    Ok(())
}

fn check_colors(stage: &mut Stage) -> Result {
    let goals = [GOAL, GOAL - Vector3::new(0.0, 0.2, 0.0)];
    let plain = stage.picture(Looks::default(), &goals)?;
    let segments = stage.renderer.segmentation()?.to_vec();
    let model = Arc::clone(stage.renderer.model());
    let [object, table] = [model.body("object0")?, model.body("table0")?];
    // The reference's is a transparent box.
    let mocap = model.body("robot0:mocap")?;
    let is_transparent = |segment: &Segment| matches!(segment, Segment::Geom(geom) if model.geom_body(*geom) == Ok(mocap));
    let (floor, goal) = (model.geom("floor0")?, model.site("target0")?);
    for color in [
        LookFactor::OBJECT_COLOR,
        LookFactor::TABLE_COLOR,
        LookFactor::FLOOR_COLOR,
        LookFactor::GOAL_COLOR,
    ] {
        let shows = |segment: &Segment| match (*segment, color) {
            (Segment::Geom(geom), LookFactor::OBJECT_COLOR) => model.geom_body(geom) == Ok(object),
            (Segment::Geom(geom), LookFactor::TABLE_COLOR) => model.geom_body(geom) == Ok(table),
            (Segment::Geom(geom), LookFactor::FLOOR_COLOR) => geom == floor,
            (Segment::Site(site), LookFactor::GOAL_COLOR) => site == goal,
            _ => false,
        };
        for channel in 0..3 {
            let numbers: [_; 3] =
                std::array::from_fn(|i| (color[i], f64::from(u8::from(i == channel))));
            let picture = stage.picture(looks(&numbers)?, &goals)?;
            let pixels = picture.chunks_exact(3).zip(plain.chunks_exact(3)).zip(&segments);
            let mut seen = 0;
            for ((pixel, plain), segment) in pixels {
                if shows(segment) {
                    // A goal has white highlights.
                    let others = (0..3).filter(|&i| i != channel).map(|i| pixel[i]).max();
                    assert!(others <= Some(pixel[channel] / 4), "{color:?}");
                    seen += u32::from(pixel[channel]);
                } else if !is_transparent(segment) {
                    assert_eq!(pixel, plain, "{color:?} changes something else");
                }
            }
            assert!(seen > 200, "{color:?}");
        }
    }
    assert_eq!(stage.picture(Looks::default(), &goals)?, plain, "no look stays");
    Ok(())
}

#[test]
fn hidden_goals_leave_the_picture_without_them() -> Result {
    let Some(mut stage) = Stage::new(&push(), SIDE)? else { return Ok(()) };
    let far = GOAL - Vector3::new(0.0, 0.0, 5.0);
    let without = stage.picture(Looks::default(), &[far])?;
    let hidden = looks(&[(LookFactor::GoalVisible, 0.0)])?;
    assert_eq!(stage.picture(hidden, &[GOAL, GOAL + Vector3::x()])?, without);
    let is_site = |segment: &Segment| matches!(segment, Segment::Site(_));
    assert!(!stage.renderer.segmentation()?.iter().any(is_site));
    assert_ne!(stage.picture(looks(&[(LookFactor::GoalVisible, 1.0)])?, &[GOAL])?, without);
    Ok(())
}

#[test]
fn the_camera_moves_and_turns_as_a_free_one_would() -> Result {
    let Some(mut stage) = Stage::new(&push(), SIDE)? else { return Ok(()) };
    let level = FreeCamera { elevation: 0.0, ..FreeCamera::REFERENCE };
    let direction = |azimuth: f64, elevation: f64| {
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let (sin, cos) = azimuth.sin_cos();
        Vector3::new(cos * elevation.cos(), sin * elevation.cos(), elevation.sin())
    };
    let ahead = direction(level.azimuth, 0.0);
    let turned = |azimuth, elevation| FreeCamera {
        lookat: level.lookat - level.distance * ahead
            + level.distance * direction(level.azimuth + azimuth, elevation),
        azimuth: level.azimuth + azimuth,
        elevation,
        ..level
    };
    let moved = |by: Vector3<f64>| FreeCamera { lookat: level.lookat + by, ..level };
    for (factor, value, camera) in [
        (LookFactor::CameraPan, 7.0, turned(7.0, 0.0)),
        (LookFactor::CameraTilt, -11.0, turned(0.0, -11.0)),
        (LookFactor::CameraRight, 0.2, moved(0.2 * ahead.cross(&Vector3::z()))),
        (LookFactor::CameraUp, -0.3, moved(-0.3 * Vector3::z())),
        (LookFactor::CameraForward, 0.5, moved(0.5 * ahead)),
    ] {
        stage.renderer.set_camera(Camera::Free(camera))?;
        let expected = stage.picture(Looks::default(), &[GOAL])?;
        stage.renderer.set_camera(Camera::Free(level))?;
        let picture = stage.picture(looks(&[(factor, value)])?, &[GOAL])?;
        assert_close(&picture, &expected, factor.name());
        assert_ne!(picture, stage.picture(Looks::default(), &[GOAL])?);
    }
    Ok(())
}

#[test]
fn half_a_field_of_view_is_the_middle_of_the_whole_for_every_camera() -> Result {
    let Some(mut near) = Stage::new(&push(), SIDE / 2)? else { return Ok(()) };
    let Some(mut wide) = Stage::new(&push(), SIDE)? else { return Ok(()) };
    let half = looks(&[(LookFactor::CameraFieldOfView, 0.5)])?;
    let named = Camera::Named("external_camera_0".into());
    for camera in [Camera::default(), named, Camera::Index(0)] {
        near.renderer.set_camera(camera.clone())?;
        wide.renderer.set_camera(camera.clone())?;
        let wide = wide.picture(Looks::default(), &[GOAL])?;
        let rows = wide.chunks_exact(3 * SIDE).skip(SIDE / 4).take(SIDE / 2);
        let middle: Vec<u8> =
            rows.flat_map(|row| &row[3 * SIDE / 4..][..3 * SIDE / 2]).copied().collect();
        assert_close(&near.picture(half, &[GOAL])?, &middle, &format!("{camera:?}"));
    }
    Ok(())
}

#[test]
fn the_light_comes_from_its_direction_with_its_intensity() -> Result {
    let Some(mut stage) = Stage::new(&push(), SIDE)? else { return Ok(()) };
    let plain = stage.picture(Looks::default(), &[GOAL])?;
    let built_in = [(LookFactor::LightElevation, 90.0), (LookFactor::LightIntensity, 0.8)];
    assert_close(&stage.picture(looks(&built_in)?, &[GOAL])?, &plain, "the built-in light");
    let mut brightness = |numbers: &[(LookFactor, f64)]| -> Result<u64> {
        Ok(stage.picture(looks(numbers)?, &[])?.into_iter().map(u64::from).sum())
    };
    let mut intensities = [1.0, 0.8, 0.4, 0.0]
        .map(|value| brightness(&[(LookFactor::LightIntensity, value)]).expect("a picture"));
    intensities.reverse();
    assert!(intensities.is_sorted_by(|a, b| a < b), "{intensities:?}");
    // The camera sees the sides of the scene that are toward it.
    let behind = FreeCamera::REFERENCE.azimuth;
    let from = |azimuth| [(LookFactor::LightElevation, 10.0), (LookFactor::LightAzimuth, azimuth)];
    assert!(brightness(&from(behind - 180.0))? > brightness(&from(behind))? * 11 / 10);
    Ok(())
}

#[test]
fn an_object_of_another_size_looks_like_one_of_a_compiled_model() -> Result {
    let [x, y] = [1.4, 0.85];
    let size = Physics::default().with(PhysicsFactor::ObjectSize, 2.0)?;
    let Some(mut varied) = Stage::new(&push(), SIDE)? else { return Ok(()) };
    let plain = varied.picture(Looks::default(), &[GOAL])?;
    varied.simulator.reset_varied(Some([x, y]), &size)?;
    let picture = varied.picture(Looks::default(), &[GOAL])?;
    let shape = ObjectShape::Box { half_size: [0.05; 3] };
    let extension = Extension::default().with_object_shape(shape);
    let config = push().with_model(ModelSource::Extended(extension));
    let Some(mut compiled) = Stage::new(&config, SIDE)? else { return Ok(()) };
    let object = varied.simulator.object().ok_or("an object")?;
    compiled.simulator.place_object("object0", object.position, UnitQuaternion::identity())?;
    let expected = compiled.picture(Looks::default(), &[GOAL])?;
    assert_close(&picture, &expected, "the object");
    varied.simulator.reset(Some([x, y]))?;
    assert_eq!(varied.picture(Looks::default(), &[GOAL])?, plain);
    Ok(())
}
