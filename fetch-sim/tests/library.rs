//! A program finds MuJoCo's library wherever it is moved, and shares its process with others.
#![cfg(all(feature = "mujoco", unix, not(fetch_sim_no_shim)))]

use std::{
    env,
    ffi::{CString, OsStr, c_char, c_int, c_void},
    fs::{self, Permissions},
    io::{self, Write},
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::{Path, PathBuf},
    process::Command,
};

use fetch_sim::{
    Model, MujocoSimulator, SimConfig, Task, cache_folder, library_path, reference_folder,
};
use testing::Result;

unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
}

/// Opens libraries for their user alone, as Python does.
fn open_locally(libraries: &OsStr) -> Result {
    const RTLD_NOW: c_int = 2;
    for library in env::split_paths(libraries) {
        let path = CString::new(library.into_os_string().into_encoded_bytes())?;
        // SAFETY: the path is a C string, and the libraries are MuJoCo's.
        assert!(!unsafe { dlopen(path.as_ptr(), RTLD_NOW) }.is_null());
    }
    Ok(())
}

/// Makes a simulator, loads a model with a mesh file if there is one beside this program, and
/// prints the library's path, if this is a copy of the program.
#[test]
fn simulate_in_this_process() -> Result {
    if env::var_os("FETCH_SIM_TEST_MOVED").is_none() {
        return Ok(());
    }
    env::var_os("FETCH_SIM_TEST_BEFORE").map_or(Ok(()), |libraries| open_locally(&libraries))?;
    MujocoSimulator::new(&SimConfig::new(Task::Reach))?;
    writeln!(io::stdout(), "\nloaded {}", library_path()?.display())?;
    writeln!(io::stdout(), "folders {:?} {:?}", reference_folder(), cache_folder())?;
    env::var_os("FETCH_SIM_TEST_AFTER").map_or(Ok(()), |libraries| open_locally(&libraries))?;
    let model = env::current_exe()?.with_file_name("mesh.xml");
    let made = model.exists().then(|| Model::from_path(&model).map(|model| model.ngeom()));
    // MuJoCo's messages have several lines.
    writeln!(io::stdout(), "mesh {}", format!("{made:?}").replace('\n', " "))?;
    Ok(())
}

/// The output of a copy of this program, or how it ended.
struct Printed(String);

impl Printed {
    /// Returns the rest of the line that begins with a word.
    fn after(&self, word: &str) -> Result<&str> {
        let line = self.0.lines().find_map(|line| line.strip_prefix(word));
        Ok(line.ok_or_else(|| self.0.clone())?.trim())
    }
}

/// Copies this program. Another process does so: a child that another test forks meanwhile would
/// have the copy open for writing, and such a file cannot be run.
fn copy_program(to: &Path) -> Result {
    assert!(Command::new("cp").arg(env::current_exe()?).arg(to).status()?.success());
    Ok(())
}

/// No other libraries.
const ALONE: (&str, &[PathBuf]) = ("FETCH_SIM_TEST_BEFORE", &[]);

/// Returns the command that runs a copy of this program.
fn command(program: &Path, mujoco_dir: &Path) -> Result<Command> {
    let mut command = Command::new(program);
    command
        .args(["--exact", "simulate_in_this_process", "--nocapture"])
        .current_dir(program.parent().ok_or("a folder")?)
        .env("FETCH_SIM_TEST_MOVED", "1")
        // What this machine's user remembers is not taken.
        .env("XDG_CACHE_HOME", program.parent().ok_or("a folder")?)
        .env("MUJOCO_DIR", mujoco_dir);
    Ok(command)
}

/// Runs a copy of this program, which opens other libraries as a variable says.
fn run(program: &Path, mujoco_dir: &Path, others: (&str, &[PathBuf])) -> Result<Printed> {
    let folder = program.parent().ok_or("a folder")?;
    let output =
        command(program, mujoco_dir)?.env(others.0, env::join_paths(others.1)?).output()?;
    let [stdout, stderr] = [output.stdout, output.stderr].map(String::from_utf8);
    let log = fs::read_to_string(folder.join("MUJOCO_LOG.TXT"));
    assert!(log.is_err(), "{log:?}");
    Ok(Printed(format!("{}\n{}{}", stdout?, stderr?, output.status)))
}

/// Returns the path of the library that a copy of this program loads.
fn loaded_by(program: &Path, mujoco_dir: &Path) -> Result<PathBuf> {
    run(program, mujoco_dir, ALONE)?.after("loaded").map(PathBuf::from)
}

#[test]
fn a_moved_program_finds_a_library() -> Result {
    let folder = tempfile::tempdir()?;
    let folder = folder.path().canonicalize()?;
    let [bin, lib, dir] = ["bin", "lib", "dir"].map(|name| folder.join(name));
    for folder in [&bin, &lib, &dir] {
        fs::create_dir(folder)?;
    }
    let program = bin.join("moved");
    copy_program(&program)?;
    let of_build = library_path()?;
    // An empty variable is unset, and `none` concerns builds alone.
    for unset in ["", "none"] {
        assert_eq!(loaded_by(&program, Path::new(unset))?, of_build, "{unset}");
    }
    for (place, mujoco_dir) in [(&lib, ""), (&bin, ""), (&dir, "../dir")] {
        let put = place.join("libmujoco.so");
        fs::copy(&of_build, &put)?;
        assert_eq!(loaded_by(&program, Path::new(mujoco_dir))?, put);
    }
    let file = lib.join("libmujoco.so");
    assert_eq!(loaded_by(&program, &file)?, file, "a path to the library itself");
    Ok(())
}

#[test]
fn a_mujoco_dir_that_names_nothing_is_an_error() -> Result {
    let folder = tempfile::tempdir()?;
    let program = folder.path().join("program");
    copy_program(&program)?;
    for value in ["/nonexistent", "libmujoco.so", "."] {
        let printed = run(&program, Path::new(value), ALONE)?;
        assert!(printed.0.contains(&format!("MUJOCO_DIR is {value}, from which")), "{}", printed.0);
    }
    Ok(())
}

/// A program with the privileges of its file's owner does not obey the user who starts it. Only
/// root can make one for another user.
#[test]
fn a_set_user_id_program_ignores_the_environment() -> Result {
    const STRANGER: u32 = 12345;
    let folder = tempfile::tempdir()?;
    fs::set_permissions(folder.path(), Permissions::from_mode(0o755))?;
    let (program, dir) = (folder.path().join("program"), folder.path().join("dir"));
    fs::create_dir(&dir)?;
    let put = dir.join("libmujoco.so");
    fs::copy(library_path()?, &put)?;
    copy_program(&program)?;
    assert_eq!(loaded_by(&program, &dir)?, put.canonicalize()?);
    fs::set_permissions(&program, Permissions::from_mode(0o4755))?;
    let mut command = command(&program, &dir)?;
    command.env("FETCH_ASSETS_DIR", &dir).env("XDG_CACHE_HOME", &dir);
    let Ok(output) = command.uid(STRANGER).gid(STRANGER).output() else { return Ok(()) };
    let printed = Printed(String::from_utf8(output.stdout)?);
    assert_eq!(Path::new(printed.after("loaded")?), library_path()?);
    assert_eq!(printed.after("folders")?, "None None", "{}", printed.0);
    Ok(())
}

/// Copies the library and its plugins to a folder, and returns the library and the plugins.
fn copy_mujoco(to: &Path) -> Result<(PathBuf, Vec<PathBuf>)> {
    let library = library_path()?;
    let copy = to.join(library.file_name().ok_or("a name")?);
    fs::create_dir_all(to.join("plugin"))?;
    fs::copy(&library, &copy)?;
    let mut plugins = Vec::new();
    // Some versions have none.
    if let Ok(entries) = library.with_file_name("plugin").read_dir() {
        for plugin in entries {
            let plugin = plugin?;
            plugins.push(to.join("plugin").join(plugin.file_name()));
            fs::copy(plugin.path(), plugins.last().ok_or("a plugin")?)?;
        }
    }
    fs::copy(library, to.join("libmujoco.so"))?;
    Ok((copy, plugins))
}

/// A program in a folder with a model that has a mesh file.
fn program_with_mesh(folder: &Path) -> Result<PathBuf> {
    let (program, corners) = (folder.join("program"), [[0; 3], [1, 0, 0], [0, 1, 0], [0, 0, 1]]);
    let mut stl = [0; 80].to_vec();
    stl.extend(4_u32.to_le_bytes());
    for triangle in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        let numbers = triangle.map(|corner: usize| corners[corner]).concat();
        let numbers =
            [0; 3].into_iter().chain(numbers).flat_map(|x: u8| f32::from(x).to_le_bytes());
        stl.extend(numbers.chain([0; 2]));
    }
    fs::write(folder.join("mesh.stl"), stl)?;
    let xml = r#"<mujoco><asset><mesh name="m" file="mesh.stl"/></asset>
        <worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>"#;
    fs::write(folder.join("mesh.xml"), xml)?;
    copy_program(&program)?;
    Ok(program)
}

#[test]
fn a_model_with_a_mesh_file_finds_its_decoder() -> Result {
    let folder = tempfile::tempdir()?;
    let (program, dir) = (program_with_mesh(folder.path())?, folder.path().join("dir"));
    copy_mujoco(&dir)?;
    assert_eq!(run(&program, &dir, ALONE)?.after("mesh")?, "Some(Ok(1))");
    Ok(())
}

#[test]
fn broken_plugins_end_no_process() -> Result {
    let folder = tempfile::tempdir()?;
    let (program, dir) = (program_with_mesh(folder.path())?, folder.path().join("dir"));
    let (_, plugins) = copy_mujoco(&dir)?;
    for length in [6, 20_000] {
        for plugin in &plugins {
            let whole = fs::read(plugin)?;
            fs::write(plugin, &whole[..length])?;
        }
        let printed = run(&program, &dir, ALONE)?;
        assert!(Path::new(printed.after("loaded")?).starts_with(dir.canonicalize()?));
        if plugins.iter().any(|plugin| plugin.ends_with("libstl_decoder.so")) {
            let (mesh, reason) = (printed.after("mesh")?, format!("damaged ({length} bytes)"));
            assert!(mesh.contains("libstl_decoder.so: ") && mesh.contains(&reason), "{mesh}");
        }
        copy_mujoco(&dir)?;
    }
    Ok(())
}

/// As in a program that links MuJoCo: two copies would call each other's functions.
#[test]
fn a_copy_that_is_loaded_for_the_whole_process_is_used() -> Result {
    let folder = tempfile::tempdir()?;
    let program = program_with_mesh(folder.path())?;
    let [ours, theirs] = ["ours", "theirs"].map(|name| folder.path().join(name));
    copy_mujoco(&ours)?;
    let (library, plugins) = copy_mujoco(&theirs)?;
    let preloaded = [vec![library.clone()], plugins].concat();
    let printed = run(&program, &ours, ("LD_PRELOAD", &preloaded))?;
    assert_eq!(Path::new(printed.after("loaded")?), library.canonicalize()?);
    assert_eq!(printed.after("mesh")?, "Some(Ok(1))");
    Ok(())
}

/// As in a Python process that imports another installation of the same version, before or after.
#[test]
fn another_copy_in_the_process_ends_nothing() -> Result {
    let folder = tempfile::tempdir()?;
    let program = program_with_mesh(folder.path())?;
    let [ours, theirs] = ["ours", "theirs"].map(|name| folder.path().join(name));
    let (_, plugins) = copy_mujoco(&ours)?;
    let (library, their_plugins) = copy_mujoco(&theirs)?;
    let needs_decoder = plugins.iter().any(|plugin| plugin.ends_with("libstl_decoder.so"));
    let others = [vec![library.clone()], their_plugins].concat();
    for (order, is_theirs) in [("FETCH_SIM_TEST_BEFORE", true), ("FETCH_SIM_TEST_AFTER", false)] {
        let printed = run(&program, &ours, (order, &others))?;
        assert!(Path::new(printed.after("loaded")?).starts_with(ours.canonicalize()?), "{order}");
        // The decoders that came first are in their copy, and those that came later in ours.
        let refused = is_theirs && needs_decoder;
        let expected = if refused { "another copy of libmujoco.so" } else { "Some(Ok(1))" };
        let mesh = printed.after("mesh")?;
        assert!(mesh.contains(expected), "{order}: {mesh}");
    }
    // With their copy, there is only one.
    let shared = run(&program, &library, ("FETCH_SIM_TEST_BEFORE", &others))?;
    assert_eq!(shared.after("mesh")?, "Some(Ok(1))");
    Ok(())
}
