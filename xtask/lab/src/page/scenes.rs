//! Frames of the four scenes.

use base64::prelude::{BASE64_STANDARD, Engine};
use fetch_env::Task;

use super::document::escape;
use crate::figures::Scene;

/// One figure a scene, after a reset with this seed.
pub fn section(seed: u64) -> anyhow::Result<String> {
    let mut figures = String::new();
    for task in Task::ALL {
        figures += &figure(task, Scene::after_reset(task, seed)?.png());
    }
    Ok(format!("<div class=\"grid four\">\n{figures}</div>"))
}

fn figure(task: Task, frame: Result<Vec<u8>, String>) -> String {
    let picture = match frame {
        Ok(png) => format!(
            "<img alt=\"The scene of Fetch{task} after reset\" src=\"data:image/png;base64,{}\">",
            BASE64_STANDARD.encode(png)
        ),
        Err(reason) => format!("<div class=\"missing\">{}</div>", escape(&reason)),
    };
    format!(
        "<figure class=\"frame\">{picture}<figcaption>Fetch{task}, after reset</figcaption></figure>\n"
    )
}
