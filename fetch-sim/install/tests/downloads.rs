//! Downloads into the user's cache: whole, one at a time, and with nothing left over by a killed
//! process.
#![cfg(all(feature = "download", unix))]

use std::{
    env,
    fs::{self, File},
    io::{self, BufRead, BufReader, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    thread,
    time::Duration,
};

use base64::prelude::{BASE64_URL_SAFE_NO_PAD, Engine};
use fetch_install::download;
use zip::{ZipWriter, write::SimpleFileOptions};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const VERSION: &str = "9.8.7";
const FILES: [(&str, &str); 3] = [
    ("include/mujoco/mujoco.h", "a header"),
    ("libmujoco.so.9.8.7", "a library"),
    ("plugin/libstl_decoder.so", "a plugin"),
];

/// The task of a process of these tests.
const TASK: &str = "FETCH_SIM_TEST_TASK";

/// Does what the variable says, if this is a process of the tests below.
#[test]
fn fetch_in_this_process() -> Result {
    let Some(task) = env::var_os(TASK) else { return Ok(()) };
    let folder = match task.to_str().ok_or("UTF-8")? {
        "mujoco" => download::mujoco(VERSION)?,
        "reference model" => download::reference_model()?,
        other if other.ends_with("-linux") => download::mujoco_for(VERSION, other)?,
        wheel => download::mujoco_from_wheel(VERSION, Path::new(wheel))?,
    };
    writeln!(io::stdout(), "\nfetched {}", folder.display())?;
    Ok(())
}

/// Returns the name of this platform.
fn own_platform() -> String {
    format!("{}-{}", env::consts::ARCH, env::consts::OS)
}

/// Returns the name, in the cache, of MuJoCo's folder for a platform.
fn mujoco_of(platform: &str) -> String {
    match platform {
        "x86_64-linux" => "mujoco-9.8.7".into(),
        _ => format!("mujoco-9.8.7-{platform}"),
    }
}

/// A cache, a wheel of MuJoCo 9.8.7, and a folder for a `python3` of the tests'.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Result<Self> {
        let place = Self(tempfile::tempdir()?);
        fs::create_dir(place.path("bin"))?;
        let mut wheel = ZipWriter::new(File::create(place.wheel())?);
        let mut record = String::new();
        for (name, text) in FILES {
            let digest = BASE64_URL_SAFE_NO_PAD.encode(hmac_sha256::Hash::hash(text.as_bytes()));
            record += &format!("mujoco/{name},sha256={digest},{}\n", text.len());
            wheel.start_file(format!("mujoco/{name}"), SimpleFileOptions::default())?;
            wheel.write_all(text.as_bytes())?;
        }
        wheel.start_file("mujoco_core-9.8.7.dist-info/RECORD", SimpleFileOptions::default())?;
        wheel.write_all(record.as_bytes())?;
        wheel.finish()?;
        Ok(place)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn wheel(&self) -> PathBuf {
        self.path("mujoco_core-9.8.7-py3-none-any.whl")
    }

    fn mujoco(&self) -> PathBuf {
        self.path("cache/fetch-env").join(mujoco_of(&own_platform()))
    }

    /// Puts a script in Python's place. It has the wheel and pip's folder in `$wheel` and `$into`,
    /// and does not know its platform.
    fn put_python(&self, script: &str) -> Result {
        let path = self.path("bin/python3");
        let head = "#!/bin/sh\n[ \"$1\" != -c ] || exit 1\n\
                    while [ \"$1\" != --dest ]; do shift; done\ninto=$2\n";
        let wheel = self.wheel();
        fs::write(&path, format!("{head}wheel={}\n{script}\n", wheel.display()))?;
        Ok(fs::set_permissions(&path, fs::Permissions::from_mode(0o755))?)
    }

    fn command(&self, task: &str) -> Result<Command> {
        let mut paths = vec![self.path("bin")];
        paths.extend(env::split_paths(&env::var_os("PATH").unwrap_or_default()));
        let mut command = Command::new(env::current_exe()?);
        command
            .args(["--exact", "fetch_in_this_process", "--nocapture"])
            .env(TASK, task)
            .env("XDG_CACHE_HOME", self.path("cache"))
            .env_remove("FETCH_ASSETS_DIR")
            .env("PATH", env::join_paths(paths)?);
        Ok(command)
    }

    /// Runs a task to its end.
    fn run(&self, task: &str) -> Result<Output> {
        Ok(self.command(task)?.output()?)
    }

    /// Starts a task, and returns when the script in Python's place has made the file `ready`.
    fn start(&self, task: &str) -> Result<Child> {
        let mut child = self.command(task)?.stdout(Stdio::piped()).spawn()?;
        let ready = self.path("ready");
        while !ready.exists() {
            if child.try_wait()?.is_some() {
                let lines = BufReader::new(child.stdout.take().ok_or("stdout")?).lines();
                return Err(lines.collect::<io::Result<Vec<_>>>()?.join("\n").into());
            }
            thread::sleep(Duration::from_millis(5));
        }
        Ok(child)
    }

    /// Returns the names of all that is in the cache.
    fn names(&self) -> Result<Vec<String>> {
        fn add(folder: &Path, names: &mut Vec<PathBuf>) -> io::Result<()> {
            for entry in fs::read_dir(folder)? {
                let path = entry?.path();
                if path.is_dir() {
                    add(&path, names)?;
                }
                names.push(path);
            }
            Ok(())
        }
        let cache = self.path("cache");
        let mut names = Vec::new();
        add(&cache, &mut names)?;
        let names = names.iter().map(|path| path.strip_prefix(&cache).unwrap_or(path));
        let own = mujoco_of(&own_platform());
        let mut names: Vec<_> =
            names.map(|path| path.display().to_string().replace(&own, "mujoco-9.8.7")).collect();
        names.sort();
        Ok(names)
    }
}

const WHOLE: [&str; 8] = [
    "fetch-env",
    "fetch-env/mujoco-9.8.7",
    "fetch-env/mujoco-9.8.7/SHA256SUMS",
    "fetch-env/mujoco-9.8.7/include",
    "fetch-env/mujoco-9.8.7/include/mujoco",
    "fetch-env/mujoco-9.8.7/include/mujoco/mujoco.h",
    "fetch-env/mujoco-9.8.7/libmujoco.so.9.8.7",
    "fetch-env/mujoco-9.8.7/plugin",
];

fn is_whole(place: &Place) -> Result {
    let names = place.names()?;
    assert_eq!(names[..8], WHOLE);
    assert_eq!(names[8..], ["fetch-env/mujoco-9.8.7/plugin/libstl_decoder.so"]);
    for (name, text) in FILES {
        assert_eq!(fs::read_to_string(place.mujoco().join(name))?, text);
    }
    Ok(())
}

/// Delivers the wheel, and counts how often.
const DELIVER: &str = r#"cp "$wheel" "$into"; echo one more >> "$wheel.count""#;

#[test]
fn killed_downloads_leave_nothing_for_good() -> Result {
    let place = Place::new()?;
    let ready = place.path("ready");
    for _ in 0..3 {
        // As pip does, which has its own folder for incomplete files.
        place.put_python(&format!(
            "echo $$ > \"$wheel.pid\"; {DELIVER}; touch \"$TMPDIR/part\"; touch {}; exec sleep 600",
            ready.display()
        ))?;
        let mut child = place.start("mujoco")?;
        child.kill()?;
        child.wait()?;
        fs::remove_file(&ready)?;
        let pid = fs::read_to_string(format!("{}.pid", place.wheel().display()))?;
        let kill = format!("kill {}", pid.trim());
        assert!(Command::new("sh").args(["-c", &kill]).status()?.success());
        assert!(place.names()?.iter().any(|name| name.ends_with("/part")), "it was killed within");
    }
    place.put_python(DELIVER)?;
    let output = place.run("mujoco")?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    is_whole(&place)?;
    // The remains of a process that is killed while it writes a file.
    let staging = place.mujoco().join(".fetch-sim-unpacking");
    fs::create_dir(&staging)?;
    fs::write(staging.join("lock"), "")?;
    fs::write(staging.join("unfinished"), "a libr")?;
    assert!(place.run("mujoco")?.status.success());
    is_whole(&place)
}

#[test]
fn a_process_waits_for_another_and_then_finds_all_there() -> Result {
    let place = Place::new()?;
    let [ready, go] = ["ready", "go"].map(|name| place.path(name));
    let (touch, wait) = (ready.display(), go.display());
    place.put_python(&format!(
        "touch {touch}; while [ ! -e {wait} ]; do sleep 0.01; done; {DELIVER}"
    ))?;
    let first = place.start("mujoco")?;
    let others =
        [(); 3].map(|()| place.command("mujoco").map(|mut it| it.stdout(Stdio::piped()).spawn()));
    fs::write(go, "")?;
    for child in others.into_iter().chain([Ok(Ok(first))]) {
        let output = child??.wait_with_output()?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    }
    let count = fs::read_to_string(format!("{}.count", place.wheel().display()))?;
    assert_eq!(count, "one more\n", "three found what the first had fetched");
    is_whole(&place)
}

#[test]
fn a_damaged_file_is_fetched_again_and_the_users_stay() -> Result {
    let place = Place::new()?;
    let wheel = place.wheel();
    assert!(place.run(wheel.to_str().ok_or("UTF-8")?)?.status.success());
    is_whole(&place)?;
    place.put_python("exit 1")?;
    assert!(place.run("mujoco")?.status.success(), "nothing is missing");
    fs::write(place.mujoco().join("notes.txt"), "the user's")?;
    for (name, text) in FILES {
        for damaged in ["", &text[..4], "other"] {
            fs::write(place.mujoco().join(name), damaged)?;
            place.put_python("exit 1")?;
            assert!(!place.run("mujoco")?.status.success(), "{name}: {damaged:?}");
            place.put_python(DELIVER)?;
            assert!(place.run("mujoco")?.status.success(), "{name}: {damaged:?}");
            assert_eq!(fs::read_to_string(place.mujoco().join(name))?, text);
        }
    }
    #[cfg(unix)]
    for name in [FILES[0].0, "SHA256SUMS"] {
        fs::remove_file(place.mujoco().join(name))?;
        std::os::unix::fs::symlink("/dev/zero", place.mujoco().join(name))?;
        assert!(place.run("mujoco")?.status.success(), "{name} has no end");
    }
    fs::write(place.mujoco().join("SHA256SUMS"), "")?;
    assert!(place.run("mujoco")?.status.success());
    assert_eq!(fs::read_to_string(place.mujoco().join("notes.txt"))?, "the user's");
    fs::remove_file(place.mujoco().join("notes.txt"))?;
    is_whole(&place)
}

/// The folder may belong to the user and hold more files, and may be a link.
#[test]
fn a_folder_of_the_users_keeps_its_files_when_the_model_cannot_be_fetched() -> Result {
    let place = Place::new()?;
    let (own, link) = (place.path("own"), place.path("link"));
    fs::create_dir(&own)?;
    fs::write(own.join("thesis.txt"), "the user's")?;
    std::os::unix::fs::symlink(&own, &link)?;
    place.put_python(DELIVER)?;
    let output = place.command("reference model")?.env("FETCH_ASSETS_DIR", &link).output()?;
    assert!(!output.status.success(), "the wheel is another's");
    assert!(fs::symlink_metadata(&link)?.is_symlink());
    let names: Vec<_> =
        fs::read_dir(&own)?.map(|entry| Ok(entry?.file_name())).collect::<Result<_>>()?;
    assert_eq!(names, ["thesis.txt"]);
    Ok(())
}

/// A wheel for another processor is requested by its tags, and has its own folder.
#[test]
fn mujoco_for_another_platform_is_beside_the_own() -> Result {
    let place = Place::new()?;
    // The arguments that follow the folder.
    place.put_python(&format!("shift; echo \"$*\" > \"$wheel.tags\"; {DELIVER}"))?;
    for platform in ["x86_64-linux", "aarch64-linux"] {
        let output = place.run(platform)?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        let folder = place.path("cache/fetch-env").join(mujoco_of(platform));
        assert_eq!(fs::read_to_string(folder.join("libmujoco.so.9.8.7"))?, "a library");
        let tags = fs::read_to_string(format!("{}.tags", place.wheel().display()))?;
        let processor = platform.strip_suffix("-linux").ok_or("a processor")?;
        assert!(tags.contains(&format!("--platform manylinux_2_28_{processor}")), "{tags}");
    }
    Ok(())
}
