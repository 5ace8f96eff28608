//! The document around the parts of a page.

use super::{html::escape, playback::SCRIPT};

/// A self-contained HTML page: its style, script and data are within it, and it loads nothing.
///
/// ```
/// use baselines::page::Document;
///
/// let mut page = Document::new("Results");
/// page.push("<p>Trained for <em>an hour</em>.</p>");
/// page.section("returns", "Returns", "<p>All is well.</p>");
/// assert!(page.html().contains("<h2 id=\"returns\">Returns</h2>"));
/// ```
#[derive(Clone, Debug)]
pub struct Document {
    title: String,
    body: String,
}

impl Document {
    /// Returns an empty page with a title, which is also its first heading.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self { title: escape(title), body: String::new() }
    }

    /// Adds HTML.
    pub fn push(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    /// Adds a section of HTML with a heading that `#id` links to.
    pub fn section(&mut self, id: &str, heading: &str, html: &str) {
        let (id, heading) = (escape(id), escape(heading));
        self.push(&format!("<section>\n<h2 id=\"{id}\">{heading}</h2>\n{html}\n</section>"));
    }

    /// Returns the whole page.
    #[must_use]
    pub fn html(&self) -> String {
        let Self { title, body } = self;
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n\
             <h1>{title}</h1>\n{body}<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            style = include_str!("style.css"),
        )
    }
}
