//! Progress bars.

use crate::output::tell;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Returns a bar of `total` parts on standard error, hidden if that is not a terminal.
pub fn bar(total: usize, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr())
        .with_style(style)
        .with_message(what)
}

/// Prints progress as a plain line where the bar is hidden.
pub fn note(bar: &ProgressBar, what: impl std::fmt::Display) {
    if bar.is_hidden() {
        tell(what);
    }
}
