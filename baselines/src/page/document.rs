//! The document around the parts of a page, and text, numbers and tables as HTML.

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
             <h1>{title}</h1>\n{body}<script>\n{script}</script>\n</body>\n</html>\n",
            style = include_str!("style.css"),
            script = include_str!("playback.js"),
        )
    }
}

/// A column of a [`table`]: its heading, and how its cells are aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// Cells of text, aligned left.
    Text(&'static str),
    /// Cells of numbers, aligned right.
    Number(&'static str),
}

impl Column {
    const fn class(self) -> &'static str {
        match self {
            Self::Text(_) => "text",
            Self::Number(_) => "number",
        }
    }
}

/// Returns a table of cells, which are HTML already: see [`escape`].
#[must_use]
pub fn table<const N: usize>(
    columns: [Column; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut html = String::from("<div class=\"scroll\"><table>\n<thead><tr>");
    for column in columns {
        let (Column::Text(name) | Column::Number(name)) = column;
        html += &format!("<th class=\"{}\">{}</th>", column.class(), escape(name));
    }
    html += "</tr></thead>\n<tbody>\n";
    for row in rows {
        html += "<tr>";
        for (column, cell) in columns.iter().zip(&row) {
            html += &format!("<td class=\"{}\">{cell}</td>", column.class());
        }
        html += "</tr>\n";
    }
    html + "</tbody></table></div>"
}

/// Returns a text as HTML.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns a number with a typographic minus sign, but none before zero.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.chars().all(|c| c == '0' || c == '.');
    if value < 0.0 && !is_zero { format!("\u{2212}{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn zero_has_no_sign() {
        assert_eq!([number(-0.04, 1), number(-1.26, 1)], ["0.0", "\u{2212}1.3"]);
    }
}
