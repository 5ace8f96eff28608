//! HTML: the document around the sections, and tables.

use super::playback;

/// A self-contained page: style and script within it, nothing from elsewhere.
#[derive(Debug)]
pub struct Document {
    title: String,
    body: String,
}

impl Document {
    pub fn new(title: &str) -> Self {
        Self { title: escape(title), body: String::new() }
    }

    /// Adds HTML.
    pub fn push(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    /// Adds a section with a heading that can be linked to.
    pub fn section(&mut self, id: &str, heading: &str, html: &str) {
        let heading = escape(heading);
        self.push(&format!("<section>\n<h2 id=\"{id}\">{heading}</h2>\n{html}\n</section>"));
    }

    /// The whole page.
    pub fn html(&self) -> String {
        let Self { title, body } = self;
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n\
             <h1>{title}</h1>\n{body}<script>\n{script}</script>\n</body>\n</html>\n",
            style = include_str!("style.css"),
            script = playback::SCRIPT,
        )
    }
}

/// A table's column: its heading, and whether it holds numbers.
pub enum Column {
    Text(&'static str),
    Number(&'static str),
}

impl Column {
    const fn class(&self) -> &'static str {
        match self {
            Self::Text(_) => "text",
            Self::Number(_) => "number",
        }
    }
}

/// A table of cells that are HTML already.
pub fn table<const N: usize>(
    columns: [Column; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut html = String::from("<div class=\"scroll\"><table>\n<thead><tr>");
    for column in &columns {
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

/// Text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
