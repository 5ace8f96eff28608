//! Text, numbers and tables as HTML.

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

/// Returns a number with a typographic minus sign, and with none before zero.
#[must_use]
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.chars().all(|c| c == '0' || c == '.');
    if value < 0.0 && !is_zero { format!("\u{2212}{text}") } else { text }
}
