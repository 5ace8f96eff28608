//! Frames of the four scenes.

use base64::prelude::{BASE64_STANDARD, Engine};
use fetch_env::Task;

use super::document::escape;

/// A frame as PNG, or why there is none.
type Frame = Result<Vec<u8>, String>;

/// One figure a scene.
pub fn section() -> String {
    let figures = Task::ALL.map(|task| figure(task, frame(task)));
    format!("<div class=\"grid four\">\n{}</div>", figures.concat())
}

fn frame(_task: Task) -> Frame {
    Err("No frame: this build cannot render. The playback below shows the same scene.".into())
}

fn figure(task: Task, frame: Frame) -> String {
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
