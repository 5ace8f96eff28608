//! Users' models: those that MuJoCo or the Fetch tasks cannot use are typed errors.
#![cfg(all(feature = "mujoco", unix, not(fetch_sim_no_shim)))]

use std::{
    collections::BTreeSet,
    env,
    ffi::OsString,
    fs,
    os::unix::ffi::OsStringExt,
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
    thread,
};

use fetch_sim::{
    ContactFilter, Control, Data, FetchModel, Model, ModelSource, MujocoSimulator, SimConfig,
    SimError, Simulator, Task, builtin_files,
};
use nalgebra::Vector3;
use testing::Result;

/// The least that the Fetch tasks need.
const SCENE: &str = r#"
<mujoco>
  <worldbody>
    <body name="robot0:mocap" mocap="true"/>
    <body name="robot0:gripper_link" pos="1 1 1">
      <joint name="robot0:slide0" type="slide"/>
      <joint name="robot0:slide1" type="slide" axis="0 1 0"/>
      <joint name="robot0:slide2" type="slide" axis="1 0 0"/>
      <geom size="0.1" contype="0"/>
      <site name="robot0:grip"/>
      <body>
        <joint name="robot0:r_gripper_finger_joint" type="slide"/><geom size="0.01" contype="0"/>
      </body>
      <body>
        <joint name="robot0:l_gripper_finger_joint" type="slide"/><geom size="0.01" contype="0"/>
      </body>
    </body>
    <body pos="5 5 5">
      <joint name="object0:joint" type="free"/><geom size="0.1" contype="0"/><site name="object0"/>
    </body>
  </worldbody>
  <actuator>
    <position joint="robot0:r_gripper_finger_joint"/>
    <position joint="robot0:l_gripper_finger_joint"/>
  </actuator>
</mujoco>"#;

fn config(folder: &Path) -> SimConfig {
    SimConfig::new(Task::Push).with_model(ModelSource::Folder(folder.into()))
}

/// Loads a scene with one part replaced by another.
fn load(part: &str, other: &str) -> Result<Arc<FetchModel>, SimError> {
    assert!(SCENE.contains(part));
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("push.xml"), SCENE.replacen(part, other, 1)).expect("a file");
    FetchModel::load(&config(folder.path()))
}

#[test]
fn the_least_model_can_be_simulated() -> Result {
    let mut simulator = MujocoSimulator::from_model(load("mujoco", "mujoco")?)?;
    simulator.reset(Some([1.3, 0.7]))?;
    simulator.step(&Control { displacement: Vector3::zeros(), fingers: 0.0 })?;
    assert!(simulator.object().is_some());
    Ok(())
}

/// Returns the kind, the name and the tasks in each row of the table that
/// [`ModelSource`] documents.
fn documented_names() -> Vec<(&'static str, &'static str, &'static [Task])> {
    let rows = include_str!("../src/assets.rs").lines().filter_map(|line| {
        let row: Vec<_> = line.trim().strip_prefix("/// | ")?.split(" | ").collect();
        let tasks = match row[2] {
            "all" => &Task::ALL[..],
            "not Reach" => &Task::ALL[1..],
            _ => return None,
        };
        Some(row[1].split(", ").map(move |name| (row[0], name.trim_matches('`'), tasks)))
    });
    rows.flatten().collect()
}

#[test]
fn every_documented_name_is_needed_and_the_built_in_model_has_them_all() -> Result {
    let load_without = |name: &str, task| {
        let files = builtin_files(task);
        let renamed = |text: &str| text.replace(&format!("\"{name}\""), "\"other\"");
        let files = files.iter().map(|(file, text)| (file, renamed(text))).collect();
        FetchModel::load(&SimConfig::new(task).with_model(ModelSource::Files(files)))
    };
    let names = documented_names();
    assert_eq!(names.len(), 10);
    for task in Task::ALL {
        load_without("nothing", task)?;
    }
    for (kind, name, tasks) in names {
        for task in Task::ALL {
            match load_without(name, task) {
                Err(SimError::MissingName { kind: of, name: missing }) => {
                    assert!(tasks.contains(&task), "{task} needs {name}");
                    assert!(missing == name && kind.ends_with(of), "{name}: the {of} {missing}");
                }
                Err(error) => return Err(error.into()),
                Ok(_) => assert!(!tasks.contains(&task), "{task} does not need {name}"),
            }
        }
    }
    Ok(())
}

#[test]
fn no_other_name_is_needed() {
    let least: BTreeSet<_> =
        SCENE.split("name=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let documented: BTreeSet<_> = documented_names().iter().map(|(_, name, _)| *name).collect();
    assert_eq!(least, documented, "`the_least_model_can_be_simulated` loads it");
}

#[test]
fn joints_and_actuators_of_another_kind_are_errors() {
    let finger = r#"<position joint="robot0:l_gripper_finger_joint"/>"#;
    let object = r#"<joint name="object0:joint" type="free"/>"#;
    let slide = r#"type="slide"/>"#;
    let unfit = [
        (finger, r#"<position site="robot0:grip"/>"#, "an actuator"),
        (finger, r#"<position joint="object0:joint"/>"#, "the joint object0:joint"),
        (object, r#"<joint name="object0:joint" type="ball"/>"#, "the joint object0:joint"),
        (object, r#"<joint name="object0:joint"/>"#, "the joint object0:joint"),
        (slide, r#"type="ball"/>"#, "the joint robot0:slide0"),
    ];
    for (part, other, named) in unfit {
        let error = load(part, other).unwrap_err();
        let SimError::UnfitModel { object, .. } = &error else { panic!("{other}: {error}") };
        assert_eq!(object, named, "{other}");
    }
}

#[test]
fn files_without_a_name_or_contents_are_errors() {
    let long = "x".repeat(1000);
    for name in ["", "x/", &long, "with\0nul"] {
        // Versions differ in how they treat a file that nothing includes.
        let beside = Model::from_files(&[("main.xml", SCENE), (name, SCENE)]);
        assert!(matches!(beside, Ok(_) | Err(SimError::Model { .. })), "{name}: {beside:?}");
        let main = Model::from_files(&[(name, ""), ("main.xml", SCENE)]);
        assert!(matches!(main, Err(SimError::Model { .. })), "{name}: {main:?}");
    }
    for empty in
        [&[("empty.xml", "")][..], &[("a.xml", "<mujoco><include file='b'/></mujoco>"), ("b", "")]]
    {
        assert!(matches!(Model::from_files(empty), Err(SimError::Model { .. })), "{empty:?}");
    }
}

/// MuJoCo until 3.1 keeps a model's files in a table.
#[test]
fn more_files_than_mujoco_takes_are_an_error_that_says_so() -> Result {
    let names: Vec<_> = (0..3000).map(|i| format!("{i}.xml")).collect();
    let files: Vec<_> = names.iter().map(|name| (name.as_str(), SCENE)).collect();
    let Err(refusal) = Model::from_files(&files) else { return Ok(()) };
    let message = refusal.to_string();
    let words = "it has 3000 files, and this version of MuJoCo takes at most ";
    let (_, rest) = message.split_once(words).ok_or(message.clone())?;
    let most: usize = rest.chars().take_while(char::is_ascii_digit).collect::<String>().parse()?;
    Model::from_files(&files[..most])?;
    let one_more = Model::from_files(&files[..=most]).map(drop).expect_err("one too many");
    assert!(one_more.to_string().contains("takes at most"), "{one_more}");
    Ok(())
}

const FLAT: &str = r#"
    <mujoco>
      <asset><mesh name="m" vertex="0 0 0  1 0 0  0 1 0  1 1 0"/></asset>
      <worldbody><geom type="mesh" mesh="m"/></worldbody>
    </mujoco>"#;

#[test]
fn a_flat_mesh_is_an_error_that_says_so() {
    let refusal = Model::from_files(&[("flat.xml", FLAT)]).map(drop).expect_err("a flat mesh");
    assert!(refusal.to_string().contains("coplanar"), "{refusal}");
}

/// C's `stderr` belongs to the host: whatever the host writes there while models are compiled
/// arrives.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[test]
fn c_code_keeps_its_standard_error_while_models_are_compiled() -> Result {
    use std::{
        ffi::{c_char, c_int, c_void},
        sync::atomic::{AtomicBool, Ordering},
    };

    const CHILD: &str = "FETCH_SIM_TEST_STDERR";
    const LINES: usize = 20_000;
    unsafe extern "C" {
        static stderr: *mut c_void;
        fn fputs(text: *const c_char, stream: *mut c_void) -> c_int;
    }
    if env::var_os(CHILD).is_some() {
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    while !is_over.load(Ordering::Relaxed) {
                        Model::from_files(&[("flat.xml", FLAT)]).map(drop).expect_err("flat");
                    }
                });
            }
            for _ in 0..LINES {
                // SAFETY: the text is a C string, and C's stream is open.
                unsafe { fputs(c"[the host's]\n".as_ptr(), stderr) };
            }
            is_over.store(true, Ordering::Relaxed);
        });
        return Ok(());
    }
    let name = "c_code_keeps_its_standard_error_while_models_are_compiled";
    let mut child = Command::new(env::current_exe()?);
    let output = child.args(["--exact", name, "--nocapture"]).env(CHILD, "1").output()?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    let arrived = String::from_utf8_lossy(&output.stderr).matches("[the host's]\n").count();
    assert_eq!(arrived, LINES);
    Ok(())
}

#[test]
fn a_folder_need_not_be_utf_8() -> Result {
    let parent = tempfile::tempdir()?;
    let folder = parent.path().join(PathBuf::from(OsString::from_vec(b"mod\xe8le".to_vec())));
    fs::create_dir(&folder)?;
    fs::write(folder.join("push.xml"), SCENE)?;
    FetchModel::load(&config(&folder))?;
    Ok(())
}

#[test]
fn a_pipe_or_a_device_is_an_error() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("push.xml");
    let load = || Model::from_path(&path).map(drop);
    std::os::unix::fs::symlink("/dev/zero", &path)?;
    let device = load().expect_err("no regular file");
    fs::remove_file(&path)?;
    assert!(Command::new("mkfifo").arg(&path).status()?.success());
    let pipe = load().expect_err("no regular file");
    for error in [device, pipe] {
        assert!(error.to_string().contains("is not a regular file"), "{error}");
    }
    Ok(())
}

/// The table of pairs of a filter takes 1.6 GB at 20,000 geoms, and outgrows 32 bits soon after.
#[test]
fn a_model_of_many_geoms_is_simulated_without_a_filter() -> Result {
    let geoms = r#"<geom size="0.1" contype="0" conaffinity="0"/>"#;
    let geoms = geoms.repeat(ContactFilter::MAX_GEOMS + 1);
    let xml = format!("<mujoco><worldbody>{geoms}</worldbody></mujoco>");
    let mut data = Data::new(Arc::new(Model::from_files(&[("many.xml", &xml)])?))?;
    data.set_contact_filter(true)?;
    assert!(data.contact_filter().is_none());
    data.step(1)?;
    Ok(())
}
