//! The pages of `play` and `report`, looked at in headless Chromium.

use std::{
    fs,
    io::{self, Write},
    path::Path,
    process::Command,
};

use baselines::learn::network::{Convolution, PictureNetwork, PictureShape};
use baselines::{InputPart, PixelPolicy, PolicyHeader, Sight, TrainedPolicy};
use fetch_env::{PixelOptions, RenderOptions, Task};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use testing::Result;

fn fetch(arguments: &[&str], out: &Path) -> Result<String> {
    run(arguments, "--out", out)
}

fn run(arguments: &[&str], flag: &str, file: &Path) -> Result<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_fetch-env"))
        .args(arguments)
        .arg(flag)
        .arg(file)
        .output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}\n{errors}");
    Ok(String::from_utf8(output.stdout)?)
}

/// Whether Chromium is there. CI installs it; elsewhere a test that needs it prints that it is
/// skipped.
fn has_chromium() -> bool {
    let found = Command::new("chromium").arg("--version").output().is_ok();
    assert!(found || std::env::var_os("CI").is_none(), "CI must install chromium");
    if !found {
        // The harness holds back what `eprintln!` prints; a skipped test must not go unnoticed.
        let _ = writeln!(
            io::stderr(),
            "SKIPPED: chromium is missing (apt-get install chromium): no page was looked at"
        );
    }
    found
}

/// Returns what `look.js` saw of a page in a frame of a width, because a window has a minimum
/// width.
fn look_at(page: &Path, width: u32, dark: bool) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    let watched = folder.path().join("page.html");
    let html = fs::read_to_string(page)?;
    let script = |source: &str| format!("<script>{source}</script>");
    let html =
        html.replacen("<head>", &format!("<head>{}", script(include_str!("page/errors.js"))), 1);
    let html = html + &script(include_str!("page/look.js"));
    let inner = html.replace('&', "&amp;").replace('"', "&quot;");
    let style = format!("border: 0; width: {width}px; height: 844px");
    let outer = format!("<body><iframe style=\"{style}\" srcdoc=\"{inner}\"></iframe></body>");
    fs::write(&watched, outer)?;
    let scheme = format!("--blink-settings=preferredColorScheme={}", u8::from(!dark));
    let output = Command::new("chromium")
        .args(["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"])
        .args([
            "--enable-unsafe-swiftshader",
            "--virtual-time-budget=20000",
            "--dump-dom",
            "--hide-scrollbars",
        ])
        .args([scheme.as_str(), "--window-size=1200,1000"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", watched.display()))
        .output()?;
    let dom = String::from_utf8_lossy(&output.stdout);
    let seen = dom
        .split_once("<pre id=\"seen\">")
        .and_then(|(_, rest)| rest.split_once("</pre>"))
        .ok_or_else(|| format!("no result\n{}", String::from_utf8_lossy(&output.stderr)))?;
    let json = seen.0.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    Ok(serde_json::from_str(&json)?)
}

fn assert_playback_lives(playback: &Value) {
    let figure =
        |name: &str| playback[name].as_u64().unwrap_or_else(|| panic!("{name}: {playback}"));
    let share = |name: &str| figure(name) as f64 / figure("size") as f64;
    assert!(figure("colors") > 200, "{playback}");
    assert!((0.2..0.85).contains(&share("background")), "{playback}");
    assert!(share("blue") > 0.003, "the arm is blue: {playback}");
    assert!(share("red") > 0.00002, "the goal is red: {playback}");
    assert!(share("changed_by_scrubbing") > 0.003, "{playback}");
    assert_eq!(figure("changed_by_scrubbing_back"), 0, "{playback}");
    assert!(share("changed_by_mouse") > 0.05, "{playback}");
    assert!(share("changed_by_touch") > 0.05, "{playback}");
    assert!(figure("played_to") > 0, "{playback}");
    assert!(playback["told"].as_str().is_some_and(|told| told.contains("distance")), "{playback}");
}

fn assert_self_contained(page: &Path) -> Result {
    let html = fs::read_to_string(page)?;
    for outside in ["http://", "https://", "src=\"/", "<link", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    Ok(())
}

#[test]
fn an_episode_is_played_back() -> Result {
    let folder = tempfile::tempdir()?;
    let page = folder.path().join("new/play.html");
    let arguments = ["play", "--env-id", "FetchPush-v4", "--seed", "3", "--verbose"];
    let text = fetch(&[&arguments[..], &["--policy", "scripted"]].concat(), &page)?;
    assert_eq!(text.lines().filter(|line| line.contains(" m  [")).count(), 50, "{text}");
    assert_self_contained(&page)?;
    if has_chromium() {
        let seen = look_at(&page, 800, false)?;
        assert_eq!(seen["faults"], serde_json::json!([]), "{seen}");
        assert_playback_lives(&seen["playbacks"][0]);
    }
    Ok(())
}

/// Writes a policy of Push that sees pictures, and has learned nothing.
fn write_pixel_policy(path: &Path) -> Result {
    let view = RenderOptions::default().with_width(24).with_height(16).with_samples(0);
    let sight = Sight::robot(Task::Push, PixelOptions::default().with_render(view));
    let shape = PictureShape::new([16, 24], &Convolution::defaults([16, 24]), 13, &[8], 4)?;
    let network = PictureNetwork::init(shape, &mut ChaCha8Rng::seed_from_u64(0));
    let header = TrainedPolicy::shipped(Task::Push)?.header().clone();
    let inputs = vec![InputPart::Observation, InputPart::DesiredGoal];
    let header = PolicyHeader { inputs, goal_normalizer: None, ..header };
    Ok(PixelPolicy::new(header, sight, network)?.save(path)?)
}

#[test]
fn a_policy_that_sees_pictures_is_evaluated_and_shows_what_it_sees() -> Result {
    let folder = tempfile::tempdir()?;
    let (policy, page) =
        (folder.path().join("policy.safetensors"), folder.path().join("play.html"));
    write_pixel_policy(&policy)?;
    let policy = policy.to_str().ok_or("no text")?;
    let arguments = ["--env-id", "FetchPush-v4", "--policy", policy];
    fetch(&[&["play", "--verbose"], &arguments[..]].concat(), &page)?;
    assert_self_contained(&page)?;
    let html = fs::read_to_string(&page)?;
    assert_eq!(html.matches("data:image/png").count(), 50, "a picture for each step");
    assert!(html.contains("The small picture is what the policy sees"));
    if has_chromium() {
        let seen = look_at(&page, 800, false)?;
        assert_eq!(seen["faults"], serde_json::json!([]), "{seen}");
        assert_playback_lives(&seen["playbacks"][0]);
        assert_eq!(seen["playbacks"][0]["seen_width"], 24, "{seen}");
    }
    let figures = folder.path().join("figures.json");
    let evaluate = [&["evaluate", "--episodes", "3"], &arguments[..]].concat();
    run(&evaluate, "--json", &figures)?;
    assert!(fs::read_to_string(&figures)?.contains("evaluate/FetchPush-v4/success_rate"));
    Ok(())
}

#[test]
fn the_report_shows_everything_in_light_and_dark_and_on_a_phone() -> Result {
    let folder = tempfile::tempdir()?;
    let page = folder.path().join("report.html");
    fetch(&["report", "--episodes", "3", "--verify-only", "FetchReach-v4"], &page)?;
    assert_self_contained(&page)?;
    let html = fs::read_to_string(&page)?;
    assert_eq!(html.matches("<svg ").count(), 12 + 8 + 3, "episodes, workspace, rewards");
    // Embedded poses and shapes, in base64, may contain any letters.
    let is_base64 = |c: char| c.is_ascii_alphanumeric() || "+/=".contains(c);
    let shown: String =
        html.split_inclusive(|c| !is_base64(c)).filter(|run| run.len() < 100).collect();
    for no_number in ["NaN", ">inf", "Minf", "Linf"] {
        assert!(!shown.contains(no_number), "{no_number} in a plot or table");
    }
    for text in ["43 checks", "FetchSlideDense-v4", "object_velp", "Reward over distance"] {
        assert!(html.contains(text), "{text}");
    }
    if !has_chromium() {
        return Ok(());
    }
    let mut backgrounds = Vec::new();
    for (width, dark) in [(1000, false), (390, true)] {
        let seen = look_at(&page, width, dark)?;
        assert_eq!(seen["faults"], serde_json::json!([]), "{seen}");
        assert_eq!(seen["dark"], dark, "{seen}");
        assert_eq!(seen["width"], width, "{seen}");
        assert_eq!(seen["content_width"], seen["width"], "no scrolling sideways: {seen}");
        let playbacks = seen["playbacks"].as_array().ok_or("no list")?;
        // The scripted and the trained policy in each task.
        assert_eq!(playbacks.len(), 8);
        playbacks.iter().for_each(assert_playback_lives);
        backgrounds.push(seen["page"].clone());
    }
    assert_ne!(backgrounds[0], backgrounds[1], "the page's color follows the scheme");
    Ok(())
}
