//! One self-contained page of all curves and heat maps.

use base64::prelude::{BASE64_STANDARD, Engine};
use baselines::page::{Column, Document, escape, table};
use fetch_env::EnvId;

use super::drawing::Curves;
use super::output::rate;
use crate::figures::{
    heat_map::HeatMap,
    picture::{Drawing, Picture},
};

pub struct Page(Document);

impl Page {
    /// Returns a page without results.
    pub fn new(env_id: EnvId, episodes: usize) -> Self {
        let mut page = Document::new(&format!("{env_id}: what its policies stand"));
        page.push(&format!(
            "<p>{episodes} episodes for each value and policy. The pale areas and the numbers in \
             parentheses are 95 % intervals.</p>"
        ));
        Self(page)
    }

    /// Adds the curves over a factor, and their numbers.
    pub fn add_curves(&mut self, curves: &Curves<'_>) -> anyhow::Result<()> {
        let rows = curves.curves.iter().flat_map(|curve| {
            curve.points().map(|(value, end, any, _)| {
                [escape(&curve.policy), value.to_string(), rate(end), rate(any)]
            })
        });
        let columns = [
            Column::Text("Policy"),
            Column::Number("Value"),
            Column::Number("Success at the end"),
            Column::Number("Success at any time"),
        ];
        let html = picture(curves, curves.factor)? + &table(columns, rows);
        self.0.section(curves.factor, curves.factor, &html);
        Ok(())
    }

    /// Adds the heat map of a pair of factors.
    pub fn add_pair(&mut self, map: &HeatMap) -> anyhow::Result<()> {
        self.0.push(&format!("<section>\n{}</section>", picture(map, &map.title)?));
        Ok(())
    }

    pub fn html(&self) -> String {
        self.0.html()
    }
}

/// Returns a picture as HTML.
fn picture(drawing: &impl Drawing, name: &str) -> anyhow::Result<String> {
    let svg = BASE64_STANDARD.encode(Picture::new(drawing)?.svg);
    let name = escape(name);
    Ok(format!(
        "<p><img alt=\"{name}\" style=\"max-width: 100%\" \
         src=\"data:image/svg+xml;base64,{svg}\"></p>\n"
    ))
}
