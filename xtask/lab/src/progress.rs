//! Progress bars, where somebody is watching.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar over `total` parts on standard error; hidden where that is no terminal.
pub fn bar(total: usize, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr())
        .with_style(style)
        .with_message(what)
}

/// Says in a plain line what has been done, where there is no bar to show it.
pub fn note(bar: &ProgressBar, what: impl std::fmt::Display) {
    if bar.is_hidden() {
        eprintln!("{what}");
    }
}
