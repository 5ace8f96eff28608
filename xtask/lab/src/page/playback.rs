//! The figure that plays an episode back.

use super::{document::escape, recording::Recording};

/// What every page with a playback carries once.
pub const SCRIPT: &str = include_str!("playback.js");

/// The figure, with the episode within it.
pub fn figure(recording: &Recording) -> anyhow::Result<String> {
    // A script ends at the first "</", wherever it stands.
    let json = serde_json::to_string(recording)?.replace('<', "\\u003c");
    let title = escape(recording.title());
    Ok(format!(
        r#"<figure class="playback">
<canvas tabindex="0" role="img" aria-label="{title}; drag, or use the arrow keys, to look from elsewhere"></canvas>
<div class="controls"><button type="button">Play</button><input type="range" min="0" max="{last}" step="1" value="0" aria-label="Step"><output></output></div>
<p class="missing">The playback needs JavaScript and WebGL 2.</p>
<figcaption><strong>{title}</strong>: {outcome}. The red ball is the goal. Drag to turn; pinch, or press + and −, to zoom.</figcaption>
<script type="application/json">{json}</script>
</figure>"#,
        last = recording.steps(),
        outcome = escape(&recording.outcome()),
    ))
}
